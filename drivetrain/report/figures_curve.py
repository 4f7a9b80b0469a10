"""The best set over payload, cycle time, voltage or air: its worth, its energy, its reserve, piece by piece."""

from __future__ import annotations

import math
from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.report.colours import INK, JOINT_COLOURS, MUTED, ORANGE, VERMILLION
from drivetrain.report.quantities import convert, printed_unit, shown_unit
from drivetrain.report.svg import house_style
from drivetrain.sizing.answers.curve import CurvePiece, OptimumCurve
from drivetrain.sizing.judge.vary import Vary

NAMES = {
    Vary.PAYLOAD: "payload", Vary.CYCLE_TIME: "length of the cycle", Vary.VOLTAGE: "supply voltage",
    Vary.AMBIENT: "air temperature",
}  # fmt: skip
OBJECTIVES = {"mass": "mass of all drives [kg]", "price": "price of all drives", "energy": "energy a cycle [J]"}


def figure_curve(found: OptimumCurve, *, name: str = "curve") -> Figure:
    """Objective, energy a cycle and worst utilisation of the best set over what is varied."""
    with house_style(name):
        figure = Figure(figsize=(7.6, 6.4))
        rows = list(figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1.0, 1.0]))
        _objective(rows[0], found)
        _energy(rows[1], found)
        _reserve(rows[2], found)
        for axes in rows:
            _frame(axes, found)
        what = f" {found.payload}" if found.payload else ""
        unit = f" [{printed_unit(found.unit)}]" if found.unit else ""
        rows[-1].set_xlabel(f"{NAMES[found.vary]}{what}{unit}")
        rows[-1].set_xlim(found.pieces[0].low, found.pieces[-1].high)
        figure.align_ylabels(rows)
    return figure


def colour_of(found: OptimumCurve, piece: CurvePiece) -> str:
    """The colour of a piece's set: one a set, wherever it occurs."""
    sets = list(dict.fromkeys(tuple(one.drives.items()) for one in found.pieces if one.drives))
    return JOINT_COLOURS[sets.index(tuple(piece.drives.items())) % len(JOINT_COLOURS)]


def _frame(axes: Axes, found: OptimumCurve) -> None:
    """Breakpoints, the study's own value, and where nothing fits."""
    for piece in found.pieces:
        if not piece.drives:
            axes.axvspan(piece.low, piece.high, color=VERMILLION, alpha=0.10, linewidth=0, zorder=0)
    for piece in found.pieces[:-1]:
        axes.axvline(piece.high, color=MUTED, linewidth=0.5, alpha=0.6, zorder=1)
    if found.pieces[0].low <= found.now <= found.pieces[-1].high:
        axes.axvline(found.now, color=INK, linewidth=0.9, linestyle=(0, (1, 1.5)), zorder=2)


def _objective(axes: Axes, found: OptimumCurve) -> None:
    """Steps of the objective, with what ends the range in which anything fits."""
    objective = found.study.objective
    _runs(axes, found, lambda values: values["objective"], width=2.6)
    axes.set_ylabel(OBJECTIVES.get(objective, "objective"))
    low, high = found.pieces[0].low, found.pieces[-1].high
    if low <= found.now <= high:
        far = (found.now - low) / (high - low) > 0.8
        axes.annotate(
            "as in the study", (found.now, 1.0), xycoords=("data", "axes fraction"), xytext=(-3 if far else 3, 6),
            textcoords="offset points", ha="right" if far else "left", va="center", fontsize=7, color=INK,
        )  # fmt: skip
    for before, after in zip(found.pieces, found.pieces[1:], strict=False):
        if bool(before.drives) == bool(after.drives):
            continue
        check = before.high_ends_by if before.drives else after.low_ends_by
        side = 1 if before.drives else -1
        middle = 0.5 * ((after.low + after.high) if before.drives else (before.low + before.high))
        wide = abs((after.high - after.low) if before.drives else (before.high - before.low)) > 0.25 * (high - low)
        axes.annotate(
            f"no set fits:\n{check.replace(' at ', chr(10) + 'at ')}", (middle if wide else before.high, 0.5),
            xycoords=("data", "axes fraction"), xytext=(0 if wide else -4 * side, 0), textcoords="offset points",
            ha="center" if wide else ("right" if side > 0 else "left"), va="center", fontsize=7.5, color=VERMILLION,
        )  # fmt: skip


def _runs(axes: Axes, found: OptimumCurve, of: Callable[[dict[str, float]], float], width: float) -> None:
    """One line a piece, in the colour of its set."""
    for piece in found.pieces:
        if not piece.drives:
            continue
        x = [point.value for point in piece.points]
        y = [of({**point.criteria, "objective": point.objective}) for point in piece.points]
        axes.plot(x, y, color=colour_of(found, piece), linewidth=width, solid_capstyle="butt", zorder=3)


def _energy(axes: Axes, found: OptimumCurve) -> None:
    known = [point.criteria["energy"] for piece in found.pieces for point in piece.points]
    known = [value for value in known if not math.isnan(value)]
    unit = shown_unit(max((abs(value) for value in known), default=0.0), "J")
    axes.set_ylabel(f"energy a cycle [{printed_unit(unit)}]")
    if known:
        _runs(axes, found, lambda values: float(convert(values["energy"], "J", unit)), width=1.5)
    else:
        axes.text(0.5, 0.5, "not known", transform=axes.transAxes, ha="center", va="center", color=MUTED)


def _reserve(axes: Axes, found: OptimumCurve) -> None:
    """The highest utilisation of the best set; 100 % is the limit."""
    _runs(axes, found, lambda values: 100.0 * values["utilisation"], width=1.5)
    axes.axhline(100.0, color=VERMILLION, linewidth=0.9, linestyle=(0, (5, 2)), zorder=2)
    wanted = 100.0 * (1.0 - found.study.safety.reserve)
    axes.axhline(wanted, color=ORANGE, linewidth=0.7, linestyle=(0, (2, 2)), zorder=2)
    used = [100.0 * point.criteria["utilisation"] for piece in found.pieces for point in piece.points]
    axes.set_ylim(10.0 * math.floor(min([80.0, *used]) / 10.0), 104.0)
    axes.set_ylabel("highest\nutilisation [%]")
