"""A body let go, to look at: the way of its angular momentum through the body, and its rates over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drivetrain.arrays import Array, checked_array
from drivetrain.report.charts.chart import FAINT, INK, JOINT_COLOURS, MUTED, VERMILLION
from drivetrain.report.charts.plotting import house_style
from drivetrain.spatial.free_body import FreeMotion

INNER = 0.985  # radius of the drawn sphere, so that curves on the unit sphere lie in front of it


def figure_free_motion(inertia: Any, motion: FreeMotion, others: Sequence[FreeMotion] = ()) -> Figure:
    """Where the angular momentum points as seen from the body, on a sphere, and the body's rates over time.

    A free body's momentum keeps its length, so it moves on a sphere; its energy too, so it moves along a curve: around
    the axes of the largest and of the smallest moment, away from the middle one.

    Args:
        inertia: About the centre of mass, in the body's frame [kg m^2], (3, 3).

    Raises:
        InputError: An inertia of another shape.
    """
    tensor = checked_array(inertia, (3, 3), "inertia")
    with house_style("free motion"):
        figure = Figure(figsize=(8.4, 3.6))
        grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
        _sphere(figure.add_subplot(grid[0], projection="3d"), tensor, motion, others)
        rates = figure.add_subplot(grid[1])
        for axis, name in enumerate("xyz"):
            rates.plot(motion.time, motion.twists[:, axis], color=JOINT_COLOURS[axis], label=f"about {name}")
        rates.set(xlabel="time [s]", ylabel="rate in the body's frame [rad/s]", title="Rates over time")
        rates.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3)
    return figure


def _sphere(panel: Any, tensor: Array, motion: FreeMotion, others: Sequence[FreeMotion]) -> None:
    """Unit momenta in the body's frame; the far side is hidden."""
    moments, axes = np.linalg.eigh(tensor)
    turn, rise = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 49), np.linspace(0.0, np.pi, 25))
    ball = INNER * np.array([np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)])
    panel.plot_surface(*ball, color="white", edgecolor=FAINT, linewidth=0.3, shade=False, zorder=0)
    # Eye on the middle axis, a little to the side: that is where the curves part.
    eye = axes @ [0.55, 1.0, 0.4]
    eye /= np.linalg.norm(eye)
    panel.view_init(elev=np.degrees(np.arcsin(eye[2])), azim=np.degrees(np.arctan2(eye[1], eye[0])))
    for line, colour, width in [*((m, MUTED, 0.8) for m in others), (motion, VERMILLION, 1.8)]:
        way = line.twists[:, :3] @ tensor
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        near = np.where((way @ eye)[:, None] > 0.0, way, np.nan)
        panel.plot(*near.T, color=colour, linewidth=width, zorder=5)
    for name, axis in zip(("smallest", "middle", "largest"), axes.T, strict=True):
        end = 1.16 * axis * (np.sign(axis @ eye) or 1.0)
        panel.plot(*np.transpose([0.86 * end, end]), color=INK, linewidth=1.0, zorder=6)
        side = "right" if np.cross([0.0, 0.0, 1.0], eye) @ end < 0.0 else "left"
        panel.text(*(1.06 * end), f" {name} ", fontsize=7, color=INK, ha=side, zorder=7)
    panel.set_proj_type("ortho")
    panel.set_box_aspect((1, 1, 1), zoom=1.45)
    panel.set_axis_off()
    panel.set_title("Angular momentum seen from the body")
    shown = ", ".join(f"{moment:.3g}" for moment in moments)
    panel.text2D(0.5, -0.03, f"moments {shown} kg m²", transform=panel.transAxes, fontsize=7.5, ha="center")
