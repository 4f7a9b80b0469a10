"""Pictures as data: a page draws them by BokehJS, ``plot`` by matplotlib."""

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
STRETCHES = 400  # of a long line, of each of which two points are kept

INK = "#1f2a37"
MUTED = "#64748b"
FAINT = "#dfe5ec"
# Okabe and Ito's palette, distinguishable with every common kind of colour blindness.
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
    """One thing drawn in a chart.

    A step keeps a value until the next; an area is a filled polygon; bars go from ``x`` to ``to`` in the rows ``y``; a
    span shades all from ``x``, or ``y``, to ``to``; a rule is a line at ``x``, or ``y``, across everything.
    """

    kind: Literal["line", "step", "points", "area", "bars", "span", "rule", "text"]
    x: Any = ()  # in the units of the axes, (N,)
    y: Any = ()
    to: Any = ()
    label: str = ""  # in the legend; of a rule or a text what stands at it
    colour: str = BLUE  # or ink, muted, faint, which follow a dark page
    colours: Sequence[str] = ()  # one a point
    size: float = 1.5  # of points or lines [px], of bars the share of a row
    dash: bool = False
    alpha: float = 1.0
    marker: str = "circle"  # in Bokeh's names
    tips: Sequence[str] = ()  # shown at the pointer, one a point


@dataclass(frozen=True, eq=False)
class Chart:
    """A picture with two axes."""

    label: str  # what it shows, for those who do not see it
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
    joined: str = ""  # charts of the same word show the same stretch of their horizontal axes


def captioned(charts: Sequence[Chart], caption: str) -> tuple[tuple[Chart, str], ...]:
    """Charts that belong together, what they show below the last."""
    return tuple((chart, caption if chart is charts[-1] else "") for chart in charts)


class Pictures:
    """The charts of one page, each with its place in the text and its data at the page's end."""

    def __init__(self) -> None:
        self.charts: list[dict[str, Any]] = []

    def add(self, chart: Chart) -> Markup:
        """Where the chart will stand."""
        self.charts.append(_data(chart))
        number, label = len(self.charts) - 1, escape(chart.label)
        return Markup(
            f'<div class="chart" data-chart="{number}" style="min-height:{chart.height}px" '
            f'role="img" aria-label="{label}"></div>'
        )

    def data(self, **beside: Any) -> str:
        """What the scripts draw, and more data for those of the page, as JSON text."""
        return json_text({"charts": self.charts, **beside}, packed=True)

    def end(self, **beside: Any) -> Markup:
        """Data, library and script of the page; nothing where nothing is drawn."""
        if not self.charts and not beside:
            return Markup("")
        data = self.data(**beside).replace("<", "\\u003c")
        return Markup(
            f'<script type="application/json" id="data">{data}</script>\n'
            f'<script type="application/octet-stream" id="library">{_library()}</script>\n'
            f"<script>\n{(HERE / 'charts.js').read_text(encoding='utf-8')}</script>"
        )


def rounded(values: Any, digits: int = 4) -> list[Any]:
    """Numbers as short as the eye allows: rounded to a share of the largest; None where there is none."""
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
    """A chart for the script: what is not as it would be by itself."""
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
    """A long line with fewer points and every peak: the smallest and the largest of every stretch."""
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
    """What draws the moving pictures of a report."""
    return Markup((HERE / "motion.js").read_text(encoding="utf-8"))


@cache
def _library() -> str:
    """BokehJS (BSD-3-Clause) out of the installed package, which need not be imported for it."""
    spec = importlib.util.find_spec("bokeh")
    assert spec is not None and spec.origin is not None
    folder = Path(spec.origin).parent / "server" / "static" / "js"
    scripts = b"\n".join((folder / f"{name}.min.js").read_bytes() for name in ("bokeh", "bokeh-api"))
    return base64.b64encode(zlib.compress(scripts, 9)).decode()
