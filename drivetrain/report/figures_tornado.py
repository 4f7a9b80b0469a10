"""A tornado: what each number that scatters does alone to one check, the widest at the top."""

from __future__ import annotations

import math

from drivetrain.report.colours import BLUE, FAINT, INK, MUTED, ORANGE, VERMILLION
from drivetrain.report.panel import Panel, panel
from drivetrain.report.picture import SMALL, TICK, Font, Key, Pen, Picture, legend_height
from drivetrain.report.quantities import percent
from drivetrain.report.scales import text_width
from drivetrain.sizing.tolerance.tornado import Bar, Tornado

MOST_BARS = 12
WIDTH, ROW = 662.0, 19.0  # [points]
SHARES = 58.0  # [points] for the column of shares
FARTHEST = 10.0  # times the limit: bars of utilisations beyond it, endless ones too, end there
CLOSE_ENDS = 10.0  # [%] between all ends: whole per cents would not tell them apart
HALF = 0.34  # of a row: half a bar
UNITS = {"payload": "kg", "ambient": "K"}
KEYS = (Key("number at its lower end", "box", Pen("none"), BLUE), Key("at its upper end", "box", Pen("none"), ORANGE))


def figure_tornado(tornado: Tornado, *, name: str = "tornado") -> str:
    """The bars of one check."""
    bars = tornado.bars[:MOST_BARS]
    ends = [_shown(value) for bar in bars for value in (bar.at_low, bar.at_high)] + [_shown(tornado.nominal)]
    low, high = min(ends), max(ends)
    room = 0.16 * max(high - low, 1.0)
    labels = [f"{bar.source}  ±{deviation_text(bar)}" for bar in bars]
    left = 14.0 + max((text_width(label, TICK.size) for label in labels), default=0.0)
    right = WIDTH - 4.0 - SHARES
    top = 8.0 + legend_height(KEYS, WIDTH)
    bottom = top + ROW * max(len(bars), 1)
    picture = Picture(name, WIDTH, bottom + 32.0)
    rows = panel(picture, (left, right), (top, bottom), (low - room, high + room), (max(len(bars), 1) - 0.5, -0.5))
    rows.picture.box((left, right), (top, bottom), "#fff")
    if high + room > 100.0:
        rows.block((max(100.0, low - room), high + room), None, VERMILLION, 0.10)
    for tick in rows.x.ticks(60.0):
        rows.upright(tick, Pen(FAINT, 0.6))
    for row, (bar, label) in enumerate(zip(bars, labels, strict=True)):
        _bar(rows, row, bar, tornado.nominal, 1 if high - low < CLOSE_ENDS else 0)
        rows.words(rows.x.low, row, label, Font(TICK.size, INK, "end", "middle"), (-6.0, 0.0))
        rows.words(rows.x.high, row, _share_text(bar.share), Font(TICK.size, INK, "end", "middle"), (SHARES, 0.0))
    picture.words(WIDTH - 4.0, top - 6.0, "of the variance", Font(SMALL, MUTED, "end"))
    rows.upright(_shown(tornado.nominal), Pen(INK, 0.9))
    rows.upright(100.0, Pen(VERMILLION, 1.2))
    rows.edges()
    rows.x_axis(f"utilisation of {tornado.check} [% of the limit]")
    picture.legend(KEYS, 8.0, across=(0.0, WIDTH))
    return picture.svg(f"{tornado.joint}: effect of each tolerance by itself on {tornado.check}")


def deviation_text(bar: Bar) -> str:
    """How far a bar's number goes from its nominal value."""
    if bar.absolute:
        return f"{bar.high:g}\u00a0{UNITS.get(bar.source.quantity, '')}".rstrip("\u00a0")
    return f"{100.0 * bar.high:g}\u00a0%"


def _bar(rows: Panel, row: int, bar: Bar, nominal: float, decimals: int) -> None:
    """From the nominal utilisation to that at either end, each with its number."""
    middle = _shown(nominal)
    for value, colour in ((bar.at_low, BLUE), (bar.at_high, ORANGE)):
        rows.block((middle, _shown(value)), (row - HALF, row + HALF), colour, 0.85)
    for value, side in ((min(bar.at_low, bar.at_high), "end"), (max(bar.at_low, bar.at_high), "start")):
        by = -3.0 if side == "end" else 3.0
        told = f"{100.0 * value:.{decimals}f}\u00a0%" if decimals and math.isfinite(value) else percent(value)
        rows.words(_shown(value), row, told, Font(SMALL, MUTED, side, "middle"), (by, 0.0))


def _shown(utilisation: float) -> float:
    """Where a utilisation stands on the axis [%]."""
    return 100.0 * min(utilisation, FARTHEST)


def _share_text(share: float) -> str:
    """A share of the variance; nothing where it is not known."""
    if math.isnan(share):
        return "\u2013"
    return f"{100.0 * share:.0f}\u00a0%" if share >= 0.01 else "<\u00a01\u00a0%"
