"""Charts by matplotlib in one common style, for notebooks, files and print."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from drivetrain.report.charts.chart import FAINT, INK, MUTED, Chart, Mark

NAMED = {"ink": INK, "muted": MUTED, "faint": FAINT}
MARKERS = {"circle": "o", "star": "*", "diamond": "D", "x": "x", "dash": "_", "triangle": "^"}
# viridis without its yellow end, which is not visible on white paper
TIME_COLOURS = LinearSegmentedColormap.from_list("instants", mpl.colormaps["viridis"](np.linspace(0.0, 0.9, 64)))

_LOOK: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "figure.constrained_layout.use": True,
    "path.simplify_threshold": 0.2,
    "savefig.facecolor": "none",
    "figure.facecolor": "none",
    "axes.facecolor": "white",
    "svg.fonttype": "path",
}


@contextmanager
def house_style(name: str) -> Iterator[None]:
    """Context with the common style of all figures, independent of the user's settings."""
    defaults = {key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith("backend")}
    look = cast(Any, {**_LOOK, "svg.hashsalt": name})
    with mpl.rc_context(defaults), mpl.rc_context(look):
        yield


def svg_text(figure: Figure, label: str) -> str:
    """A figure as an SVG element with a description; call it inside ``house_style``."""
    out = io.StringIO()
    figure.savefig(out, format="svg", dpi=150, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    return text[text.index("<svg") :].strip().replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1)


def png_bytes(figure: Figure, dpi: float = 150) -> bytes:
    """A figure as a PNG file on white; call it inside ``house_style``."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi, facecolor="white", metadata={"Software": None})
    return out.getvalue()


def draw(chart: Chart, axes: Axes) -> Axes:
    for mark in chart.marks:
        _draw(mark, axes)
    axes.set_xlabel(chart.x)
    axes.set_ylabel(chart.y)
    axes.set_title(chart.title)
    for log, scale, axis in ((chart.log_x, axes.set_xscale, axes.xaxis), (chart.log_y, axes.set_yscale, axes.yaxis)):
        if log:
            scale("log")
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(NullFormatter())
    if len(chart.x_range):
        axes.set_xlim(*chart.x_range)
    if len(chart.y_range):
        axes.set_ylim(*chart.y_range)
    for log, axis in ((chart.log_x, axes.xaxis), (chart.log_y, axes.yaxis)):
        low, high = axis.get_view_interval()
        if log and high < 1e4 * low:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    if len(chart.rows):
        axes.set_yticks(range(len(chart.rows)), list(chart.rows))
        axes.set_ylim(len(chart.rows) - 0.5, -0.5)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.3)
    return axes


def figure_of(charts: Sequence[Chart]) -> Figure:
    with house_style("charts"):
        heights = [chart.height / 96.0 for chart in charts]
        figure = Figure(figsize=(7.6, sum(heights)), layout="constrained")
        column = figure.subplots(len(charts), 1, squeeze=False, height_ratios=heights)[:, 0]
        for chart, axes in zip(charts, column, strict=True):
            draw(chart, axes)
    return figure


def _draw(mark: Mark, axes: Axes) -> None:
    colour, x, y, to = NAMED.get(mark.colour, mark.colour), *(np.asarray(v, float) for v in (mark.x, mark.y, mark.to))
    style: dict[str, Any] = {"color": colour, "alpha": mark.alpha}
    line = style | {"linewidth": mark.size, "linestyle": "--" if mark.dash else "-"}
    label = mark.label or None
    if mark.kind in ("line", "step"):
        axes.plot(x, y, label=label, drawstyle="steps-post" if mark.kind == "step" else "default", **line)
    elif mark.kind == "points":
        colours = [NAMED.get(one, one) for one in mark.colours] or colour
        marker, hollow = MARKERS.get(mark.marker, "o"), mark.alpha == 0.0
        shown = {"facecolors": "none", "edgecolors": colours} if hollow else {"c": colours, "alpha": mark.alpha}
        axes.scatter(x, y, s=(0.75 * mark.size) ** 2, marker=marker, label=label, zorder=4, **shown)
    elif mark.kind == "area":
        axes.fill(x, y, label=label, linewidth=0.8, **style)
    elif mark.kind == "bars":
        axes.barh(y, to - x, mark.size, x, label=label, **style)
    elif mark.kind == "span":
        span, ends = (axes.axvspan, (x[0], to[0])) if len(x) else (axes.axhspan, (y[0], to[0]))
        span(*ends, linewidth=0, zorder=0, **style)
    elif mark.kind == "rule":
        (axes.axvline if len(x) else axes.axhline)(x[0] if len(x) else y[0], label=label, **line)
    else:
        axes.annotate(mark.label, (x[0], y[0]), xytext=(4, 0), textcoords="offset points", va="center", fontsize=7.5)
