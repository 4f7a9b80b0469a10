"""Torques computed from readings of positions, to look at: what noise makes of them, and how sure they are."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array, checked_array
from drivetrain.dynamics.from_positions import TorqueFromPositions
from drivetrain.errors import Fault, InputError
from drivetrain.report.charts.chart import BLUE, INK, MUTED, SKY, VERMILLION
from drivetrain.report.charts.plotting import house_style

SURE = 2.0  # deviations drawn to either side


def figure_torque_from_positions(
    time: Any, found: TorqueFromPositions, joint: int, *, differenced: Any = None, exact: Any = None
) -> Figure:
    """The torque of one joint, with the band of its uncertainty, beside others of the same motion.

    Args:
        time: [s], (N,).
        differenced: Torques from the same readings differenced twice [N m], (N, n); shown on a scale of their own.
        exact: Torques of the true motion [N m], (N, n); adds a panel with the error.

    Raises:
        InputError: Wrong shapes, or no such joint.
    """
    shape = found.torque.shape
    if not 0 <= joint < shape[1]:
        raise InputError(Fault("joint", f"must be between 0 and {shape[1] - 1}", joint))
    t = checked_array(time, (shape[0],), "time")
    others = {"differenced": differenced, "exact": exact}
    given = {name: checked_array(v, shape, name)[:, joint] for name, v in others.items() if v is not None}
    with house_style("torque from positions"):
        figure = Figure(figsize=(7.2, 1.3 + 1.6 * (1 + len(given))))
        panels = list(figure.subplots(1 + len(given), 1, sharex=True, squeeze=False)[:, 0])
        panels[-1].set_xlabel("time [s]")
        if "differenced" in given:
            rough = panels.pop(0)
            rough.plot(t, given["differenced"], color=VERMILLION, linewidth=0.4)
            rough.set(ylabel="torque [N m]", title=f"Joint {joint + 1}: readings differenced twice")
        _smoothed(panels[0], t, found.torque[:, joint], found.deviation[:, joint], given.get("exact"))
        panels[0].set_title(f"Joint {joint + 1}: readings smoothed by their resolution")
        if "exact" in given:
            _error(panels[1], t, found.torque[:, joint] - given["exact"], SURE * found.deviation[:, joint])
    return figure


def _smoothed(panel: Axes, time: Array, torque: Array, deviation: Array, exact: Array | None) -> None:
    """The torque in its band, and the true one."""
    panel.fill_between(time, torque - SURE * deviation, torque + SURE * deviation, color=SKY, alpha=0.6, linewidth=0)
    panel.plot(time, torque, color=BLUE, linewidth=1.6, label="from readings")
    panel.set_ylabel("torque [N m]")
    if exact is not None:
        panel.plot(time, exact, color=INK, linewidth=0.9, linestyle=(0, (4, 3)), label="true motion")
        panel.legend(loc="lower right", ncols=2)


def _error(panel: Axes, time: Array, error: Array, band: Array) -> None:
    """How far off the torque is, and how far it says it may be."""
    panel.fill_between(time, -band, band, color=SKY, alpha=0.6, linewidth=0)
    panel.axhline(0.0, color=MUTED, linewidth=0.7)
    panel.plot(time, error, color=BLUE, linewidth=1.0)
    panel.set(ylabel="error [N m]", title=f"Smoothed less true; band: {SURE:g} standard deviations")
