"""Charts as data: a page draws them with BokehJS, ``plot`` with matplotlib."""

from __future__ import annotations

import base64
import importlib.util
import zlib
from collections.abc import Sequence
from dataclasses import Field, dataclass, fields, replace
from functools import cache
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np
from markupsafe import Markup

from drivetrain.report.json_text import json_text

HERE = Path(__file__).parent
STRETCHES = 400  # sections of a long line, in each of which two points are kept

INK = "#1f2a37"
MUTED = "#64748b"
FAINT = "#dfe5ec"
# palette of Okabe and Ito, distinguishable with the common kinds of colour blindness
BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"
JOINT_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION, SKY, "#7f6a3f", "#444444")
# Instants from first to last: viridis without its yellow end, which is lost on white paper.
INSTANTS = (
    "#440154", "#471063", "#481d6f", "#472a7a", "#453781", "#414287", "#3d4e8a", "#38598c", "#33638d", "#2e6d8e",
    "#2a768e", "#27808e", "#23898e", "#20928c", "#1e9c89", "#21a585", "#28ae80", "#35b779", "#46c06f", "#5ac864",
    "#70cf57", "#89d548", "#a2da37", "#bddf26",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Mark:
    """One element of a chart.

    A step keeps a value until the next; an area is a filled polygon; bars go from ``x`` to ``to`` in the rows ``y``; a
    span shades all from ``x``, or ``y``, to ``to``; a rule is a line at ``x``, or ``y``, across everything.
    """

    kind: Literal["line", "step", "points", "area", "bars", "span", "rule", "text"]
    x: Any = ()  # in the units of the axes, (N,)
    y: Any = ()
    to: Any = ()
    label: str = ""  # text in the legend; of a rule or a text, the text drawn at it
    colour: str = BLUE  # or ink, muted, faint, which adapt to a dark page
    colours: Sequence[str] = ()  # one per point
    size: float = 1.5  # size of points or width of lines [px]; of bars, the share of a row
    dash: bool = False
    alpha: float = 1.0
    marker: str = "circle"  # in Bokeh's names
    tips: Sequence[str] = ()  # tooltips, one per point


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart with two axes."""

    label: str  # description for screen readers
    x: str  # label of the axis, with its unit
    y: str
    marks: Sequence[Mark]  # drawn in this order
    x_range: Sequence[float] = ()  # empty: what is drawn
    y_range: Sequence[float] = ()
    log_x: bool = False
    log_y: bool = False
    rows: Sequence[str] = ()  # names of rows 0, 1, ... from the top, in place of numbers on the vertical axis
    height: int = 320  # px
    title: str = ""
    joined: str = ""  # charts with the same text share the range of their horizontal axes


def captioned(charts: Sequence[Chart], caption: str) -> tuple[tuple[Chart, str], ...]:
    """Charts that belong together, with a caption below the last."""
    return tuple((chart, caption if chart is charts[-1] else "") for chart in charts)


class Pictures:
    """The charts of one page: their placeholders in the text, and their data at the end of the page."""

    def __init__(self) -> None:
        self.charts: list[dict[str, Any]] = []

    def add(self, chart: Chart) -> Markup:
        """Add a chart; returns its placeholder for the text."""
        self.charts.append(_data(chart))
        number, label = len(self.charts) - 1, escape(chart.label)
        return Markup(
            f'<div class="chart" data-chart="{number}" style="min-height:{chart.height}px" '
            f'role="img" aria-label="{label}"></div>'
        )

    def data(self, **beside: Any) -> str:
        """Data of all charts, and additional data for the page's scripts, as JSON text."""
        return json_text({"charts": self.charts, **beside}, packed=True)

    def end(self, **beside: Any) -> Markup:
        """Data, library and script of the page; empty without charts."""
        if not self.charts and not beside:
            return Markup("")
        data = self.data(**beside).replace("<", "\\u003c")
        return Markup(
            f'<script type="application/json" id="data">{data}</script>\n'
            f'<script type="application/octet-stream" id="library">{_library()}</script>\n'
            f"<script>\n{(HERE / 'charts.js').read_text(encoding='utf-8')}</script>"
        )


def rounded(values: Any, digits: int = 4) -> list[Any]:
    """Numbers rounded to ``digits`` digits of the largest, which a chart cannot show finer; None for NaN."""
    array = np.asarray(values, dtype=np.float64)
    finite = np.isfinite(array)
    largest = float(np.abs(array[finite]).max(initial=0.0))
    decimals = digits - int(np.floor(np.log10(largest))) if largest > 0.0 else 0
    texts = np.round(array, decimals) + 0.0
    if decimals <= 0:
        texts = texts.astype(np.int64) if finite.all() and largest < 1e15 else texts
    found: list[Any] = texts.tolist()
    return found if finite.all() else [value if ok else None for value, ok in zip(found, finite.tolist(), strict=True)]


def _significant(values: Any) -> list[float | None]:
    """Numbers of a logarithmic axis, on which small ones are as far apart as large ones."""
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in values]


def _data(chart: Chart) -> dict[str, Any]:
    """Data of a chart for the script: only fields that differ from their defaults."""
    marks = [
        _changed_fields(mark, [one for one in fields(mark) if one.name not in ("x", "y", "to")])
        | {
            name: _significant(getattr(mark, name)) if log else rounded(getattr(mark, name))
            for name, log in (("x", chart.log_x), ("y", chart.log_y), ("to", chart.log_x))
            if len(getattr(mark, name))
        }
        for mark in map(_thinned, chart.marks)
    ]
    return _changed_fields(chart, [one for one in fields(chart) if one.name != "marks"]) | {"marks": marks}


def _thinned(mark: Mark) -> Mark:
    """A long line with fewer points but all peaks: the smallest and the largest value of every section."""
    n = len(mark.y)
    if mark.kind not in ("line", "step") or n <= 3 * STRETCHES:
        return mark
    y = np.asarray(mark.y, dtype=np.float64)
    width = -(-n // STRETCHES)
    stretches = np.append(y, np.full(-n % width, y[-1])).reshape(-1, width)
    first = np.arange(len(stretches)) * width
    kept = np.concatenate([[0, n - 1], first + stretches.argmin(axis=1), first + stretches.argmax(axis=1)])
    kept = np.unique(np.minimum(kept, n - 1))
    return replace(mark, x=np.asarray(mark.x)[kept], y=y[kept])


def _changed_fields(record: Chart | Mark, known: list[Field[Any]]) -> dict[str, Any]:
    values = {one.name: (getattr(record, one.name), one.default) for one in known}
    return {name: value for name, (value, usual) in values.items() if value != usual}


def moving_script() -> Markup:
    """The script that draws the animated charts of a report."""
    return Markup((HERE / "motion.js").read_text(encoding="utf-8"))


@cache
def _library() -> str:
    """BokehJS (BSD-3-Clause) from the files of the installed package, without importing it."""
    spec = importlib.util.find_spec("bokeh")
    assert spec is not None and spec.origin is not None
    folder = Path(spec.origin).parent / "server" / "static" / "js"
    scripts = b"\n".join((folder / f"{name}.min.js").read_bytes() for name in ("bokeh", "bokeh-api"))
    return base64.b64encode(zlib.compress(scripts, 9)).decode()
