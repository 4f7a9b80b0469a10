"""Pictures of arms under constraints: how they move, what the constraints carry, and how well they are kept."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import skeleton
from drivetrain.arrays import Array, checked_array
from drivetrain.report.charts.chart import BLUE, INK, JOINT_COLOURS, MUTED, VERMILLION
from drivetrain.report.charts.plotting import TIME_COLOURS, house_style
from drivetrain.report.quantities import axis_name, printed_unit
from drivetrain.simulation.recording import Recording

PLANE_XY = np.eye(3)[[0, 1]]
POSTURES = 7
FLOOR = 1e-17  # below rounding; a logarithmic scale has no zero


def figure_held_arm(
    arm: Arm,
    recording: Recording,
    *,
    plane: Any = PLANE_XY,
    hinge: Any = None,
    name: str = "held arm",
) -> Figure:
    """An arm under constraints: its postures and the path of its tip, multipliers and joint speeds over time.

    Args:
        plane: Across and up in the picture, unit vectors of the base frame [-], (2, 3).
        hinge: Point about which turns what the tip holds, base frame [m], (3,); it is marked, and joined to the tip.
            None: no such point.

    Raises:
        InputError: Wrong shapes.
    """
    view = checked_array(plane, (2, 3), "plane")
    q = np.array(list(recording.ending("position").values())).T
    with house_style(name):
        figure = Figure(figsize=(9.4, 3.9))
        grid = figure.add_gridspec(2, 2, width_ratios=[1.0, 1.25])
        picture = figure.add_subplot(grid[:, 0])
        top, bottom = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
        corners = skeleton(arm, q) @ view.T
        _postures(picture, corners)
        picture.set_xlabel(f"{axis_name(view[0])} [m]")
        picture.set_ylabel(f"{axis_name(view[1])} [m]")
        if hinge is not None:
            _leaves(picture, corners[:, -1], view @ checked_array(hinge, (3,), "hinge"))
        _multipliers(top, recording)
        for i, (joint, values) in enumerate(recording.ending("speed").items()):
            colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
            bottom.plot(recording.time, values, color=colour, label=joint)
        bottom.set_ylabel("joint speeds [rad/s]" if arm.screws[:, :3].any(axis=1).all() else "joint speeds [SI]")
        bottom.set_xlabel("time [s]")
        bottom.set_title("how it moves")
        for axes in (top, bottom):
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=1.2)
            axes.set_xlim(recording.time[0], recording.time[-1])
    return figure


def figure_drift(recordings: Mapping[str, Recording], *, name: str = "drift") -> Figure:
    """How far positions leave their constraints, and what energy is made or lost, for several ways to hold them."""
    with house_style(name):
        figure = Figure(figsize=(9.0, 3.1))
        left, right = figure.subplots(1, 2, sharex=True)
        for i, (title, recording) in enumerate(recordings.items()):
            colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
            for axes, series in ((left, "constraint_error"), (right, "energy_error")):
                values = np.maximum(np.abs(recording[series]), FLOOR)
                axes.semilogy(recording.time[1:], values[1:], color=colour, label=title, linewidth=0.9)
        left.set_ylabel("error of the constraints [m]")
        right.set_ylabel("energy made or lost [J]")
        for axes in (left, right):
            axes.set_xlabel("time [s]")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=min(3, len(recordings)))
    return figure


def _postures(axes: Axes, corners: Array) -> None:
    """Stick figures from the first posture (light) to the last (dark), and the whole path of the tip."""
    axes.plot(*corners[:, -1].T, color=BLUE, linewidth=1.6, zorder=4, label="tip")
    picked = np.linspace(0, len(corners) - 1, POSTURES).astype(int)
    for share, k in zip(np.linspace(0.0, 1.0, POSTURES), picked, strict=True):
        axes.plot(
            *corners[k].T, "o-", color=TIME_COLOURS(1.0 - share), linewidth=1.1, markersize=2.5, alpha=0.8, zorder=3
        )
    axes.plot(*corners[0, 0], "^", color=INK, markersize=7, zorder=5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("postures from light to dark, path of the tip")


def _leaves(axes: Axes, tips: Array, hinge: Array) -> None:
    """What turns about the hinge, in the same postures as the arm."""
    for k in np.linspace(0, len(tips) - 1, POSTURES).astype(int):
        axes.plot(*np.array([hinge, tips[k]]).T, color=VERMILLION, linewidth=0.8, linestyle="--", alpha=0.7, zorder=2)
    axes.plot(*hinge, "s", color=VERMILLION, markersize=5, zorder=6)
    axes.annotate("hinge", tuple(hinge), textcoords="offset points", xytext=(6, 4), color=VERMILLION)


def _multipliers(axes: Axes, recording: Recording) -> None:
    names = [name for name in recording.series if ".multiplier_" in name]
    units = {printed_unit(recording.unit(name)) for name in names}
    for i, name in enumerate(names):
        values, unit = recording[name], recording.unit(name)
        if np.abs(values).max() > 1e-9:
            row = name.rsplit("_", 1)[1]
            colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
            axes.plot(recording.time, values, color=colour, label=f"row {row} [{printed_unit(unit)}]")
    axes.axhline(0.0, color=MUTED, linewidth=0.6)
    axes.set_ylabel(f"multipliers [{', '.join(sorted(units))}]")
    axes.set_title("what the constraints carry")
