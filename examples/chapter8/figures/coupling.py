"""What motors that work together must do: torque over speed, beside what each would do with a joint to itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import coupled_groups, rotor_turns, with_coupling
from drivetrain.arrays import Array
from drivetrain.dynamics.inverse import drive_torques
from drivetrain.errors import Fault, InputError
from drivetrain.report.charts.chart import JOINT_COLOURS, MUTED
from drivetrain.report.charts.plotting import house_style
from drivetrain.report.quantities import convert, printed_unit, shown_unit

Motion = tuple[Any, Any, Any]


def figure_coupled_motors(cases: Mapping[str, tuple[Arm, Motion]]) -> Figure:
    """One picture a group of coupled motors that turn: each one's path through torque and speed, coupled and alone.

    Args:
        cases: By title: an arm whose motors are coupled, and q, qd, qdd [rad or m, and per s, s^2], (N, n) each.

    Raises:
        InputError: An arm without coupled motors that turn, wrong shapes, or a NaN or infinity.
    """
    pictures = [
        (title, *case, group)
        for title, case in cases.items()
        for group in coupled_groups(case[0])
        if np.any(np.asarray(case[1][1])[..., group])
    ]
    for title in sorted({*cases} - {title for title, *_ in pictures}):
        raise InputError(Fault(f"cases[{title!r}]", "must have coupled motors that turn"))
    with house_style("coupled motors"):
        figure = Figure(figsize=(0.6 + 3.6 * len(pictures), 3.7))
        row = figure.subplots(1, len(pictures), squeeze=False)[0]
        for axes, (title, arm, motion, group) in zip(row, pictures, strict=True):
            _draw(axes, arm, motion, group)
            axes.set_title(f"{title}: " + ", ".join(arm.joint_names[joint] for joint in group))
    return figure


def _draw(axes: Axes, arm: Arm, motion: Motion, group: tuple[int, ...]) -> None:
    speeds, torques = _paths(arm, motion)
    lone_speeds, lone_torques = _paths(with_coupling(arm, None), motion)
    unit = shown_unit(float(np.abs(torques[:, group]).max()), "N m")
    axes.axhline(0.0, color=MUTED, linewidth=0.6)
    axes.axvline(0.0, color=MUTED, linewidth=0.6)
    for place, joint in enumerate(group):
        colour = JOINT_COLOURS[place % len(JOINT_COLOURS)]
        alone = (lone_speeds[:, joint], convert(lone_torques[:, joint], "N m", unit))
        axes.plot(*alone, color=colour, linewidth=0.9, linestyle=(0, (4, 2)), alpha=0.8)
        path = (speeds[:, joint], convert(torques[:, joint], "N m", unit))
        axes.plot(*path, color=colour, linewidth=1.6, label=f"motor {joint + 1}")
    axes.plot([], [], color=MUTED, linestyle=(0, (4, 2)), label="one joint each")
    axes.set_xlabel("motor speed [rad/s]")
    axes.set_ylabel(f"motor torque [{printed_unit(unit)}]")
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)


def _paths(arm: Arm, motion: Motion) -> tuple[Array, Array]:
    """Speeds and torques of all motors, (N, n) each."""
    return np.asarray(motion[1]) @ rotor_turns(arm).T, drive_torques(arm, *motion).motor
