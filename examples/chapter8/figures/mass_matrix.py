"""The mass matrix to look at: its ellipsoids in the joints and at the tip, and what a growing gear ratio makes of it.

Reference: Modern Robotics, figures 8.2, 8.3 and 8.4 and section 8.9.2, for any arm and posture.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import skeleton, tip_acceleration_terms
from drivetrain.arrays import Array, batch, checked_array
from drivetrain.dynamics.book.ellipsoids import (
    Ellipsoid,
    acceleration_ellipsoid,
    outline,
    tip_acceleration_ellipsoid,
    tip_force_ellipsoid,
    torque_ellipsoid,
)
from drivetrain.dynamics.book.ratio_sweep import RatioSweep, with_ratio
from drivetrain.errors import Fault, InputError
from drivetrain.report.charts.chart import BLUE, FAINT, GREEN, INK, JOINT_COLOURS, MUTED, VERMILLION
from drivetrain.report.charts.plotting import TIME_COLOURS, house_style
from drivetrain.report.quantities import axis_name

PLANE_XY = np.eye(3)[:2]
CUT = 4.0  # an infinite semi-axis is drawn this many times as long as the longest finite one
NEGLIGIBLE = 1e-9  # of the largest acceleration: rounding, drawn as none
MOST_POSTURES = 6
ELLIPSE_RATIOS = (10.0, 100.0, 1000.0)
ELLIPSE_AT_TIP = 0.25  # of the picture's width: how long the tip's force ellipse is drawn at the arm


def figure_velocity_accelerations(arm: Arm, q: Any, qd: Any, *, plane: Any = PLANE_XY) -> Figure:
    """The accelerations of the tip at constant joint speeds: each joint alone, then all together with Coriolis terms.

    Args:
        q, qd: One posture and its speeds [rad or m, and per s], (n,).
        plane: Across and up in the picture, unit vectors of the base frame [-], (2, 3).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.
    """
    view = _checked_view(plane)
    speeds = checked_array(qd, (arm.n,), "qd")
    terms = tip_acceleration_terms(arm, checked_array(q, (arm.n,), "q"), speeds)
    corners = skeleton(arm, q) @ view.T
    own = np.einsum("jjx->jx", terms)
    steps = np.vstack([own, terms.sum(axis=(0, 1)) - own.sum(axis=0)])
    sizes = np.linalg.norm(steps, axis=1)
    steps[sizes <= NEGLIGIBLE * sizes.max()] = 0.0
    sizes = np.linalg.norm(steps, axis=1)
    seen = steps @ view.T
    longest = float(np.linalg.norm([*seen, seen.sum(axis=0)], axis=1).max())
    seen *= 0.6 * float(np.ptp(corners, axis=0).max()) / (longest or 1.0)
    with house_style("velocity accelerations"):
        across = min(arm.n + 1, 4)
        down = -(-(arm.n + 1) // across)
        figure = Figure(figsize=(3.1 * across, 3.2 * down + 0.4))
        panels = figure.subplots(down, across, squeeze=False).ravel()
        for joint, panel in enumerate(panels[: arm.n]):
            _stick(panel, corners, view)
            _arrow(panel, corners[-1], seen[joint], JOINT_COLOURS[joint % len(JOINT_COLOURS)])
            panel.set_title(f"joint {joint + 1} alone: {sizes[joint]:.3g} m/s²")
        _chain(panels[arm.n], corners, seen, view)
        panels[arm.n].set_title(f"all: Coriolis {sizes[-1]:.3g}, sum {np.linalg.norm(steps.sum(axis=0)):.3g} m/s²")
        for panel in panels[arm.n + 1 :]:
            panel.set_visible(False)
        _same_limits(panels[: arm.n + 1])
        figure.legend(loc="outside lower center", ncols=arm.n + 2)
    return figure


def figure_mass_ellipsoids(arm: Arm, q: Any, *, joints: Any = (0, 1), plane: Any = PLANE_XY) -> Figure:
    """Torques for unit accelerations and accelerations by unit torques, of two joints while the others are held.

    Args:
        q: Postures [rad or m], (n,) or (N, n), a row of the picture each.
        plane: Across and up in the picture of the arm, unit vectors of the base frame [-], (2, 3).

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or not two joints.
    """
    if len(joints) != 2:
        raise InputError(Fault("joints", "must be two, to be drawn in a plane", joints))
    postures = _few_postures(arm, q)
    one, two = (int(joint) + 1 for joint in joints)
    labels = [(f"acceleration {one}", f"acceleration {two}", "rad/s²"), (f"torque {one}", f"torque {two}", "N m")]
    accelerations = acceleration_ellipsoid(arm, postures, joints=joints)
    torques = torque_ellipsoid(arm, postures, joints=joints)
    words = _Words(labels, ("M⁻¹", "M"), "torque")
    return _ellipse_rows(arm, postures, _checked_view(plane), (accelerations, torques), words)


def figure_tip_mass(arm: Arm, q: Any, *, plane: Any = PLANE_XY) -> Figure:
    """Forces at the tip for unit accelerations of it and accelerations by unit forces: the effective mass.

    Args:
        q: Postures [rad or m], (n,) or (N, n), a row of the picture each.
        plane: Across and up in the picture, unit vectors of the base frame [-], (2, 3); forces act in this plane.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.
    """
    view = _checked_view(plane)
    postures = _few_postures(arm, q)
    x, y = (axis_name(row) for row in view)
    labels = [(f"acceleration {x}", f"acceleration {y}", "m/s²"), (f"force {x}", f"force {y}", "N")]
    accelerations = tip_acceleration_ellipsoid(arm, postures, axes=view)
    forces = tip_force_ellipsoid(arm, postures, axes=view)
    figure = _ellipse_rows(arm, postures, view, (accelerations, forces), _Words(labels, ("Λ⁻¹", "Λ"), "force"))
    curves = outline(forces, longest=CUT * _size(forces))
    tips = skeleton(arm, postures)[:, -1] @ view.T
    for row, mobility in enumerate(accelerations.matrix):
        arm_panel, moved, pushed = figure.axes[3 * row : 3 * row + 3]
        scale = ELLIPSE_AT_TIP * float(np.ptp(arm_panel.get_xlim())) / (2.0 * float(np.abs(curves[row]).max()))
        arm_panel.plot(*(tips[row] + scale * curves[row]).T, color=BLUE, linewidth=1.4, zorder=2)
        moved.plot(*mobility[:, 0], "x", color=VERMILLION, zorder=5)
        pushed.plot(1.0, 0.0, "x", color=VERMILLION, zorder=5)
    _same_limits(figure.axes[::3])
    return figure


def figure_ratio_sweep(sweeps: Mapping[str, RatioSweep], arm: Arm, q: Any) -> Figure:
    """How the mass matrix becomes diagonal, and the same everywhere, as the gear ratio grows.

    Args:
        q: Its postures [rad or m], (N, n).

    Returns:
        Ellipses above [N m a rad/s^2], coupling and variation over the ratio below [-].

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or an arm without rotors.
    """
    postures = batch(q, arm.n, "q")
    with house_style("ratio sweep"):
        figure = Figure(figsize=(9.2, 7.0))
        upper, lower = figure.subfigures(2, 1, height_ratios=(1.0, 1.1), squeeze=False)[:, 0]
        upper.suptitle("torques that all accelerations of 1 rad/s² take: an ellipse a posture, dark first, light last")
        for axes, ratio in zip(upper.subplots(1, len(ELLIPSE_RATIOS)), ELLIPSE_RATIOS, strict=True):
            _posture_ellipses(axes, with_ratio(arm, ratio), postures)
            axes.set_title(f"{arm.name}, ratio {ratio:g}")
        coupling, variation = lower.subplots(1, 2)
        for colour, (name, sweep) in zip(JOINT_COLOURS, sweeps.items(), strict=False):
            coupling.fill_between(
                sweep.ratios, sweep.coupling.min(axis=1), sweep.coupling.max(axis=1), color=colour, alpha=0.15, lw=0
            )
            coupling.plot(sweep.ratios, np.median(sweep.coupling, axis=1), color=colour, label=name)
            variation.plot(sweep.ratios, sweep.variation.max(axis=1), color=colour, label=name)
        _finish_sweep(coupling, "coupling: largest |Mᵢⱼ| / √(Mᵢᵢ Mⱼⱼ) [-]", "median and range over postures")
        _finish_sweep(variation, "largest swing of a joint's inertia / its mean [-]", "over postures")
    return figure


def _posture_ellipses(axes: Axes, arm: Arm, postures: Array) -> None:
    """Torque ellipses of joints 1 and 2, a colour a posture."""
    curves = outline(torque_ellipsoid(arm, postures, joints=(0, 1)))
    for curve, shade in zip(curves, np.linspace(0.0, 1.0, len(curves)), strict=True):
        axes.plot(*curve.T, color=TIME_COLOURS(shade), linewidth=1.0)
    _square(axes, 1.1 * float(np.abs(curves).max()))
    axes.set_xlabel("torque 1 [N m]")
    axes.set_ylabel("torque 2 [N m]")


def _finish_sweep(axes: Axes, label: str, what: str) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("gear ratio [-]")
    axes.set_title(f"{label}\n{what}")
    axes.legend(loc="lower left")


class _Words(NamedTuple):
    """What stands at the two planes: of accelerations, and of what they take."""

    labels: list[tuple[str, str, str]]  # across, up, unit
    names: tuple[str, str]  # of the matrices
    cause: str


def _ellipse_rows(arm: Arm, postures: Array, view: Array, pair: tuple[Ellipsoid, Ellipsoid], words: _Words) -> Figure:
    """The arm, the plane of accelerations, the plane of torques or forces; a row a posture."""
    with house_style("ellipsoids"):
        figure = Figure(figsize=(9.2, 3.2 * len(postures) + 0.3), layout=ConstrainedLayoutEngine(h_pad=0.08))
        panels = figure.subplots(len(postures), 3, squeeze=False)
        for row, posture in zip(panels, postures, strict=True):
            _stick(row[0], skeleton(arm, posture) @ view.T, view)
            row[0].set_title(_posture_name(arm, posture))
        _same_limits(list(panels[:, 0]))
        for column, ellipsoid in enumerate(pair):
            (across, up, unit), name, size = words.labels[column], words.names[column], _size(ellipsoid)
            curves = outline(ellipsoid, longest=CUT * size)
            for axes, curve, matrix in zip(panels[:, column + 1], curves, ellipsoid.matrix, strict=True):
                _pair_of_curves(axes, curve, bold=column == 1)
                _square(axes, 1.15 * size)
                axes.set_xlabel(f"{across} [{unit}]")
                axes.set_ylabel(f"{up} [{unit}]")
                axes.set_title(f"{name} = {_printed(matrix)}")
        told = [f"unit accelerations, and the {words.cause}s that they take",
                f"unit {words.cause}s, and the accelerations that they give"]  # fmt: skip
        figure.legend(panels[0, 1].lines[:2], told, loc="outside lower center", ncols=2)
    return figure


def _posture_name(arm: Arm, posture: Array) -> str:
    """Its joint angles where they are few and angles, else the name of the arm."""
    if arm.n > 3 or not arm.screws[:, :3].any(axis=1).all():
        return arm.name
    return "θ = (" + ", ".join(f"{np.degrees(angle):.4g}°" for angle in posture) + ")"


def _size(ellipsoid: Ellipsoid) -> float:
    """The longest finite semi-axis, or 1 if all are shorter."""
    lengths = ellipsoid.semi_axes[np.isfinite(ellipsoid.semi_axes)]
    return max(1.0, float(lengths.max(initial=0.0)))


def _pair_of_curves(axes: Axes, curve: Array, bold: bool) -> None:
    """The ellipse in this plane and the unit circle; bold what starts from unit accelerations."""
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    solid, dotted = (curve, circle) if bold else (circle, curve)
    axes.plot(*solid.T, color=BLUE, linewidth=2.0)
    axes.plot(*dotted.T, color=GREEN, linestyle=(0, (1.0, 1.2)), linewidth=1.8)


def _stick(axes: Axes, corners: Array, view: Array) -> None:
    """The arm as lines between its joints."""
    axes.plot(*corners.T, "-", color=FAINT, linewidth=7.0, solid_capstyle="round", zorder=1)
    axes.plot(*corners[:-1].T, "o", color=MUTED, markersize=6.0, markerfacecolor="white", zorder=3)
    axes.plot(*corners[-1], "o", color=INK, markersize=5.0, zorder=3)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{axis_name(view[0])} [m]")
    axes.set_ylabel(f"{axis_name(view[1])} [m]")


def _chain(axes: Axes, corners: Array, steps: Array, view: Array) -> None:
    """The accelerations head to tail from the tip, and their sum."""
    _stick(axes, corners, view)
    labels = [*(f"centripetal, joint {joint + 1}" for joint in range(len(steps) - 1)), "Coriolis"]
    colours = [*(JOINT_COLOURS[joint % len(JOINT_COLOURS)] for joint in range(len(steps) - 1)), INK]
    start = corners[-1]
    for step, colour, label in zip(steps, colours, labels, strict=True):
        _arrow(axes, start, step, colour, label)
        start = start + step
    axes.plot(*np.column_stack([corners[-1], start]), color=INK, linestyle="--", linewidth=1.0, label="sum")


def _arrow(axes: Axes, start: Array, along: Array, colour: str, label: str = "") -> None:
    """An acceleration; one of length zero is not drawn."""
    if np.linalg.norm(along) > 0.0:
        look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.014, "zorder": 4}
        axes.quiver(*start, *along, color=colour, label=label, **look)
        axes.update_datalim([start + along])


def _same_limits(panels: Any) -> None:
    """One square window that shows all of what any panel shows."""
    corners = np.vstack([panel.dataLim.get_points() for panel in panels])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = 0.5 * (low + high), 0.62 * float((high - low).max())
    for panel in panels:
        panel.set_xlim(middle[0] - half, middle[0] + half)
        panel.set_ylim(middle[1] - half, middle[1] + half)


def _square(axes: Axes, half: float) -> None:
    axes.set_aspect("equal")
    axes.set_xlim(-half, half)
    axes.set_ylim(-half, half)


def _printed(matrix: Array) -> str:
    """A 2 x 2 matrix in one line; an infinite one in a word."""
    if not np.isfinite(matrix).all():
        return "infinite in a direction"
    rows = ("  ".join(f"{x + 0.0:.3g}" for x in np.round(row, 9)) for row in matrix)
    return "[" + " ; ".join(rows) + "]"


def _checked_view(plane: Any) -> Array:
    rows = checked_array(plane, (2, 3), "plane")
    if np.abs(rows @ rows.T - np.eye(2)).max() > 1e-9:
        raise InputError(Fault("plane", "must be two unit vectors at right angles", rows.tolist()))
    return rows


def _few_postures(arm: Arm, q: Any) -> Array:
    postures = batch(q, arm.n, "q")
    if not 1 <= len(postures) <= MOST_POSTURES:
        raise InputError(Fault("q", f"must be 1 to {MOST_POSTURES} postures to be drawn", len(postures)))
    return postures
