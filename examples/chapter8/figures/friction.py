"""Friction laws side by side, as in Modern Robotics figure 8.13: torque over speed, and what rest allows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.drive.friction import Friction, breakaway_torque, friction_torque
from drivetrain.report.charts.chart import BLUE, INK, MUTED, VERMILLION
from drivetrain.report.charts.plotting import house_style
from drivetrain.report.quantities import convert, printed_unit, shown_unit

SHARE_NEAR_REST = 1e-6  # of the top speed: where the sliding curve begins


def figure_friction(laws: Mapping[str, Friction], *, top_speed: float, name: str = "friction") -> Figure:
    """One small picture a law: sliding friction over speed, and the torques between which the shaft stays at rest.

    Args:
        top_speed: Right end of every picture [rad/s].
    """
    columns = min(3, len(laws))
    rows = -(-len(laws) // columns)
    speed = np.geomspace(SHARE_NEAR_REST, 1.0, 400) * top_speed
    both = np.concatenate([-speed[::-1], speed])
    ends = np.array([-1.0, 1.0])
    largest = max(
        float(np.abs(np.concatenate([friction_torque(law, both), breakaway_torque(law, ends)])).max())
        for law in laws.values()
    )
    unit = shown_unit(largest, "N m")
    with house_style(name):
        figure = Figure(figsize=(2.9 * columns, 2.25 * rows))
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        for axes in grid.flat[len(laws) :]:
            axes.set_visible(False)
        for axes, (title, law) in zip(grid.flat, laws.items(), strict=False):
            _law(axes, law, speed, unit)
            axes.set_title(title)
            axes.set_ylim(*(1.15 * float(convert(largest, "N m", unit)) * ends))
        for axes in grid[:, 0]:
            axes.set_ylabel(f"friction torque [{printed_unit(unit)}]")
        for axes in grid[-1]:
            axes.set_xlabel("speed [rad/s]")
        figure.legend(
            *grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2, handlelength=1.6
        )  # fmt: skip
    return figure


def _law(axes: Axes, law: Friction, speed: Array, unit: str) -> None:
    """One law: a curve for each direction, and the interval that rest allows."""
    axes.axhline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    axes.axvline(0.0, color=MUTED, linewidth=0.7, zorder=1)
    held = convert(breakaway_torque(law, np.array([-1.0, 1.0])), "N m", unit)
    for way in (-1.0, 1.0):
        label = "sliding" if way > 0 else None
        torque = convert(friction_torque(law, way * speed), "N m", unit)
        axes.plot(way * speed, torque, color=BLUE, label=label, zorder=3)
    axes.plot([0.0, 0.0], held, color=VERMILLION, linewidth=2.2, zorder=4, label="at rest: any torque that holds")
    if held[1] > held[0]:
        axes.plot(
            [0.0, 0.0], held, "o", color=VERMILLION, markersize=3.5, markeredgecolor=INK, markeredgewidth=0.4, zorder=5
        )
