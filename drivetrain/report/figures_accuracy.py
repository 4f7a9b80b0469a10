"""Pictures of what accuracy costs: effects, solvers, and the two roads to a current."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from drivetrain.report.colours import BLUE, FAINT, GREEN, INK, JOINT_COLOURS, MUTED, ORANGE, SKY, VERMILLION
from drivetrain.report.quantities import printed_unit
from drivetrain.report.svg import house_style
from drivetrain.simulation.cost_results import AutoChoice, Change, EffectCost, EffectCosts, RoadsCompared, SolverCosts

SHOWN = ("peak current", "RMS current", "RMS torque", "winding temperature", "tip")
COLOURS = (BLUE, ORANGE, GREEN, VERMILLION, MUTED)
LEAST = 1e-5  # share below which a change is not drawn


def worst(row: EffectCost, tip: float) -> tuple[float, ...]:
    """The largest change of each quantity over all joints.

    Args:
        tip: What counts as the whole for the tip [m].

    Returns:
        Signed shares in the order of the pictures [-]; NaN where no joint tells one.
    """
    columns = zip(*(_shares(change, tip) for change in row.changes.values()), strict=True)
    return tuple(
        max((v for v in column if not math.isnan(v)), key=abs, default=math.nan) for column in map(tuple, columns)
    )


def _shares(change: Change, tip: float) -> tuple[float, ...]:
    return *change.shares, change.tip / tip if tip > 0.0 else math.nan


def figure_effects(found: EffectCosts, *, name: str = "effects") -> Figure:
    """What each effect changes when it is left out, beside what it costs to keep."""
    tip = found.full.tip_deviation
    rows = found.rows[::-1]
    with house_style(name):
        figure = Figure(figsize=(9.2, 1.3 + 0.62 * max(len(rows), 1)))
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.6, 1.0))
        height = 0.8 / len(SHOWN)
        for k, (what, colour) in enumerate(zip(SHOWN, COLOURS, strict=True)):
            values = [abs(worst(row, tip)[k]) for row in rows]
            at = [i + 0.4 - (k + 0.5) * height for i in range(len(rows))]
            left.barh(
                at, [max(v, LEAST) if v > LEAST else 0.0 for v in values], height * 0.92, color=colour, label=what
            )
        left.set_xscale("log")
        left.set_xlim(LEAST, max(1.0, *(abs(v) for row in rows for v in worst(row, tip) if not math.isnan(v))) * 1.6)
        left.xaxis.set_major_locator(LogLocator(10.0, numticks=8))
        left.xaxis.set_minor_locator(NullLocator())
        left.set_xticks([t for t in (1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0) if t <= left.get_xlim()[1]])
        left.set_xticklabels([_percent(t) for t in left.get_xticks()])
        left.set_yticks(range(len(rows)), [row.label for row in rows])
        left.axvline(0.01, color=INK, linewidth=0.8, linestyle=(0, (2, 2)))
        left.set_xlabel("largest change at any joint when left out; dashed 1 %")
        _times(right, rows)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(SHOWN))
    return figure


def _percent(share: float) -> str:
    return f"{100.0 * share:g} %"


def _times(axes: Axes, rows: Sequence[EffectCost]) -> None:
    """Factors in time, from 1 on."""
    for i, row in enumerate(rows):
        axes.barh(i, row.time - 1.0, 0.5, left=1.0, color=INK if row.time >= 1.0 else FAINT)
        axes.annotate(f"×{row.time:.2f}", (max(row.time, 1.0), i), (4, 0), textcoords="offset points", va="center",
                      fontsize=7.5)  # fmt: skip
    axes.axvline(1.0, color=MUTED, linewidth=0.8)
    axes.set_xlim(min(0.9, *(row.time for row in rows)) - 0.05, max(1.3, *(row.time for row in rows)) * 1.15)
    axes.set_xlabel("time with it over time without")
    axes.tick_params(axis="y", length=0)


def figure_solvers(found: SolverCosts, *, name: str = "solvers") -> Figure:
    """Error in the decision quantities over wall time and over evaluations."""
    with house_style(name):
        figure = Figure(figsize=(9.2, 3.7))
        axes = figure.subplots(1, 2, sharey=True)
        families = list(dict.fromkeys(run.family for run in found.runs))
        for i, family in enumerate(families):
            runs = [run for run in found.runs if run.family == family and run.error > 2.0 * found.settled]
            if not runs:
                continue
            for part, values in zip(axes, ([run.seconds for run in runs], [run.work for run in runs]), strict=True):
                colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
                part.loglog(values, [run.error for run in runs], "o-", color=colour, markersize=4, label=family)
        for part in axes:
            part.axhline(max(2.0 * found.settled, 1e-12), color=MUTED, linewidth=0.8, linestyle=(0, (2, 2)))
            part.axhline(0.01, color=INK, linewidth=0.8, linestyle=(0, (1, 2)))
        axes[0].set_ylabel("largest error of a decision quantity [-]")
        axes[0].set_xlabel("wall time of one run [s]")
        axes[1].set_xlabel("right-hand sides; of the fixed step: systems solved")
        axes[1].annotate("1 %", (1.0, 0.01), (-3, 3), xycoords=("axes fraction", "data"), textcoords="offset points",
                         fontsize=7.5, ha="right")  # fmt: skip
        axes[1].annotate(
            "limit of the reference", (1.0, max(2.0 * found.settled, 1e-12)), (-3, 3), fontsize=7.5, ha="right",
            xycoords=("axes fraction", "data"), textcoords="offset points", color=MUTED,
        )  # fmt: skip
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=max(1, len(families)))
    return figure


def figure_roads(found: RoadsCompared, *, name: str = "roads") -> Figure:
    """The current of every joint by both roads."""
    with house_style(name):
        figure = Figure(figsize=(9.2, 0.9 + 1.35 * len(found.joints)))
        column = figure.subplots(len(found.joints), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (joint, told) in zip(column, found.joints.items(), strict=True):
            low, high = _span(told.inverse, told.forward)
            rests = np.logical_not(told.moving).tolist()
            axes.fill_between(told.time, low, high, where=rests, color=FAINT, step="mid", linewidth=0.0)
            axes.plot(told.time, told.forward, color=SKY, linewidth=2.8, label="simulated")
            axes.plot(told.time, told.inverse, color=INK, linewidth=0.8, label="by sizing")
            axes.set_ylim(low, high)
            axes.set_ylabel(f"{joint.replace('_', ' ')}\n[A]".replace(" joint", ""))
        column[-1].set_xlabel("time [s]; shaded: the joint rests")
        column[-1].set_xlim(float(told.time[0]), float(told.time[-1]))
        figure.align_ylabels(list(column))
        figure.legend(*column[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _span(*series: np.ndarray) -> tuple[float, float]:
    low, high = min(float(s.min()) for s in series), max(float(s.max()) for s in series)
    room = 0.06 * (high - low) or 1.0
    return low - room, high + room


def figure_auto(found: AutoChoice, *, name: str = "auto") -> Figure | None:
    """Estimated against measured change, joint by joint.

    Returns:
        The figure; None where nothing was left out.
    """
    if found.proof is None:
        return None
    proof, scale = found.proof, found.tip_tolerance / found.tolerance
    joints = list(proof.measured)
    with house_style(name):
        figure = Figure(figsize=(9.2, 3.4))
        columns = figure.subplots(1, len(SHOWN), sharey=True)
        for k, (axes, what) in enumerate(zip(columns, SHOWN, strict=True)):
            for i, joint in enumerate(joints):
                told = abs(_shares(proof.estimate[joint], scale)[k])
                real = abs(_shares(proof.measured[joint], scale)[k])
                axes.barh(i, 100.0 * told, 0.62, color=FAINT, label="estimated" if i == 0 else None)
                axes.barh(i, 100.0 * real, 0.3, color=BLUE, label="measured" if i == 0 else None)
            axes.axvline(100.0 * found.tolerance, color=VERMILLION, linewidth=1.0)
            axes.set_title(what, fontsize=8.5)
            axes.set_xlim(0.0, 108.0 * found.tolerance)
            axes.set_xlabel("[%]")
        columns[0].set_yticks(range(len(joints)), [joint for joint in joints])
        columns[0].invert_yaxis()
        figure.legend(*columns[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def told_setting(family: str, setting: float) -> str:
    """A solver's setting in words.

    Args:
        setting: Step [s] or tolerance [-].
    """
    fixed = "step" in family or "RK4" in family
    return f"{1e3 * setting:g}\u00a0m{printed_unit('s')}" if fixed else f"{setting:.0e}".replace("e-0", "e−")
