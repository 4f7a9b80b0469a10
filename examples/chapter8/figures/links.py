"""An arm by its masses: each link as the uniform ellipsoid that has its mass, centre and inertia, told at a glance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import link_poses, skeleton
from drivetrain.arrays import Array, checked_array
from drivetrain.report.charts.chart import INK, JOINT_COLOURS
from drivetrain.report.charts.plotting import house_style
from drivetrain.report.quantities import axis_name
from drivetrain.spatial.inertia import half_axes

PLANE_XZ = np.eye(3)[[0, 2]]
TURN = np.linspace(0.0, 2.0 * np.pi, 121)


def figure_links(arms: Mapping[str, Arm], q: Any, *, plane: Any = PLANE_XZ) -> Figure:
    """Arms side by side, the masses of their links drawn to scale; a link of 1 kg that is a metre wide cannot hide.

    Args:
        q: One posture [rad or m], (n,).
        plane: Across and up in the picture, unit vectors of the base frame [-], (2, 3).

    Returns:
        The figure, one picture an arm, all on one scale [m].

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.
    """
    view = checked_array(plane, (2, 3), "plane")
    with house_style("links"):
        figure = Figure(figsize=(0.8 + 3.4 * len(arms), 3.4))
        row = figure.subplots(1, len(arms), squeeze=False, sharex=True, sharey=True)[0]
        for axes, (title, arm) in zip(row, arms.items(), strict=True):
            _draw(axes, arm, q, view)
            axes.set_title(title)
            axes.set_xlabel(f"{axis_name(view[0])} [m]")
        row[0].set_ylabel(f"{axis_name(view[1])} [m]")
        figure.suptitle("each link as the uniform ellipsoid that has its mass and inertia")
        handles, labels = row[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)))
    return figure


def _draw(axes: Axes, arm: Arm, q: Any, view: Array) -> None:
    """One arm: its bones in ink, its links' masses in their colours."""
    for i, place in enumerate(link_poses(arm, q)):
        colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
        label = f"{arm.link_names[i]}, {arm.masses[i]:.3g} kg"
        axes.fill(*_outline(arm, i, place, view).T, color=colour, alpha=0.35, linewidth=1.0, label=label)
        axes.plot(*(view @ place[:3, 3]), "+", color=colour, markersize=7, markeredgewidth=1.6, zorder=4)
    axes.plot(*(skeleton(arm, q) @ view.T).T, "o-", color=INK, linewidth=1.0, markersize=3.0, zorder=3)
    axes.set_aspect("equal")


def _outline(arm: Arm, link: int, place: Array, view: Array) -> Array:
    """The shadow of a link's ellipsoid: its square is the projection of the ellipsoid's."""
    if not arm.masses[link]:
        return np.asarray(view @ place[:3, 3])[None]
    _, axes = np.linalg.eigh(arm.inertias[link])
    across = view @ place[:3, :3] @ (axes * half_axes(arm.masses[link], arm.inertias[link]))
    size, directions = np.linalg.eigh(across @ across.T)
    circle = np.column_stack([np.cos(TURN), np.sin(TURN)]) * np.sqrt(np.clip(size, 0.0, None))
    return np.asarray(circle @ directions.T + view @ place[:3, 3])
