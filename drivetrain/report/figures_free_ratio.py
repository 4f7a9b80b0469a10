"""Free ratios: the goal of the whole arm over each joint's ratio, the best, and the catalogue's gears beside it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from drivetrain.report.colours import BLUE, GREEN, INK, MUTED, ORANGE, VERMILLION
from drivetrain.report.quantities import number, printed_unit
from drivetrain.report.svg import house_style
from drivetrain.sizing.answers.free_ratio import FreeJoint, FreeRatios
from drivetrain.study.verdicts import Verdict

COLOURS = {
    Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: MUTED,
}  # fmt: skip
BESIDE = 1.06  # times beyond the range that the picture goes on
HIGHEST = 3.0  # times the best value that is drawn


def figure_free_ratio(found: FreeRatios, *, name: str = "free-ratio") -> Figure:
    """One panel a joint: the goal over its ratio, the others at their best."""
    count = len(found.joints)
    columns = 1 if count == 1 else 2
    rows = (count + columns - 1) // columns
    with house_style(name):
        figure = Figure(figsize=(7.6, 2.5 * rows + 0.7))
        panels = list(figure.subplots(rows, columns, squeeze=False).ravel())
        for axes, joint in zip(panels, found.joints, strict=False):
            _panel(axes, found, joint)
        for axes in panels[count:]:
            axes.set_visible(False)
        _legend(figure, panels[0])
    return figure


def _panel(axes: Axes, found: FreeRatios, joint: FreeJoint) -> None:
    """One joint."""
    goal = np.where(np.isfinite(joint.goal), joint.goal, np.nan)
    axes.set_xscale("log")
    axes.set_xlim(joint.family.low / BESIDE, joint.family.high * BESIDE)
    axes.axvspan(joint.low, joint.high, color=GREEN, alpha=0.10, linewidth=0, zorder=0)
    axes.plot(joint.ratios, goal, color=BLUE, zorder=3)
    axes.plot(joint.best, found.value, "D", color=INK, markersize=5, zorder=6)
    axes.annotate(number(joint.best), (joint.best, found.value), xytext=(0, -11), textcoords="offset points",
                  ha="right" if joint.best > 0.7 * joint.family.high else "center", fontsize=7.5)  # fmt: skip
    if joint.family.low < joint.alone < joint.family.high:
        axes.axvline(joint.alone, color=MUTED, linewidth=0.9, linestyle=(0, (2, 2)), zorder=2)
    top = min(float(np.nanmax(goal)), HIGHEST * found.value)
    heights = [found.value * (1.0 + gear.loss) for gear in joint.gears]
    top = max(top, *(min(height, HIGHEST * found.value) for height in heights if np.isfinite(height)), found.value)
    for gear, height in zip(joint.gears, heights, strict=True):
        if np.isfinite(height) and height <= top and joint.family.low <= abs(gear.ratio) <= joint.family.high:
            axes.plot(abs(gear.ratio), height, "o", color=COLOURS[gear.verdict], markersize=4, zorder=5)
    span = max(top - found.value, 1e-3 * abs(found.value))
    axes.set_ylim(found.value - 0.28 * span, top + 0.08 * span)
    axes.set_title(joint.joint)
    axes.set_xlabel("gear ratio [-]")
    unit = f" [{printed_unit(found.goal.unit)}]" if printed_unit(found.goal.unit) else ""
    axes.set_ylabel(f"{found.goal} of the arm{unit}")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _legend(figure: Figure, axes: Axes) -> None:
    """What the marks mean."""
    marks = [
        axes.plot([], [], color=BLUE, label="continuous ratio")[0],
        axes.plot([], [], "D", color=INK, markersize=5, label="best for the arm")[0],
        axes.plot([], [], color=MUTED, linestyle=(0, (2, 2)), label="by formula, its motor only")[0],
        axes.plot([], [], "o", color=GREEN, markersize=4, label="gear of the catalogue, passes")[0],
        axes.plot([], [], "o", color=ORANGE, markersize=4, label="marginal")[0],
        axes.plot([], [], "o", color=VERMILLION, markersize=4, label="fails")[0],
    ]
    figure.legend(handles=marks, loc="outside upper center", ncols=3, handletextpad=0.3, columnspacing=1.0)
