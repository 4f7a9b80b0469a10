"""One picture of all drives: the motor planes of every joint side by side, for a README or a slide."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from drivetrain.report.charts.chart import BLUE, GREEN, MUTED, ORANGE, VERMILLION
from drivetrain.report.charts.motion_data import regions, temperatures, view
from drivetrain.report.charts.plotting import TIME_COLOURS, house_style, png_bytes
from drivetrain.report.quantities import convert, percent, printed_unit, shown_unit
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.verdicts import Verdict

COLOURS = {Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: "#5b6775"}


def overview_png(evaluation: Evaluation) -> bytes:
    """The speed-torque planes of all joints with their clouds, drives and verdicts."""
    tasks = {task.name: task for task in evaluation.study.joints}
    joints = list(evaluation.joints.values())
    columns = min(3, len(joints))
    rows = -(-len(joints) // columns)
    with house_style("overview"):
        figure = Figure(figsize=(3.5 * columns, 2.95 * rows + 0.35))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, joint in zip(grid.flat, joints, strict=False):
            unit = _motor_plane(axes, joint, tasks[joint.name], evaluation.study)
            axes.set_title(f"{joint.name}\n", fontsize=9)
            drive = joint.motor + (f" + {joint.gear}" if joint.gear else "")
            axes.annotate(
                drive, (0, 1), xycoords="axes fraction", xytext=(0, 4), textcoords="offset points", fontsize=6.5
            )
            binding = "" if joint.binding is None else f" {percent(joint.binding.utilisation)}"
            axes.annotate(
                f"{joint.verdict}{binding}", (1, 1), xycoords="axes fraction", xytext=(0, 17),
                textcoords="offset points", ha="right", fontsize=8, weight="bold", color=COLOURS[joint.verdict],
            )  # fmt: skip
            axes.set_xlabel("motor speed [rpm]")
            axes.set_ylabel(f"motor torque [{printed_unit(unit)}]")
        for axes in grid.flat[len(joints) :]:
            axes.set_visible(False)
        marks = [
            grid.flat[0].plot([], [], color=BLUE, linewidth=6, alpha=0.3, label="intermittent")[0],
            grid.flat[0].plot([], [], color=GREEN, linewidth=6, alpha=0.4, label="continuous")[0],
            grid.flat[0].plot([], [], color=BLUE, linestyle="--", label="cold motor")[0],
            grid.flat[0].plot([], [], ".", color="#2c718e", label="the motion, coloured by time")[0],
        ]
        figure.legend(handles=marks, loc="outside upper center", ncols=4)
        return png_bytes(figure)


def _motor_plane(axes: Axes, joint: JointResult, task: JointTask, study: Study) -> str:
    """Regions and samples of one joint; the unit of the torque axis."""
    series, at = joint.series, temperatures(joint, study)
    hot, cold = (regions(joint, task, study, at[name], study.supply.voltage) for name in ("hot", "cold"))
    right, top = view(joint, hot[0])
    unit = shown_unit(top, "N m")
    axes.set_xlim(-float(convert(right, "rad/s", "rpm")), float(convert(right, "rad/s", "rpm")))
    axes.set_ylim(-float(convert(top, "N m", unit)), float(convert(top, "N m", unit)))
    for warm, outline, colour, opacity in zip(hot, cold, (BLUE, GREEN), (0.12, 0.24), strict=True):
        for corners, face, dash in ((warm, (colour, opacity), "-"), (outline, "none", "--")):
            if corners is not None:
                points = np.stack([convert(corners[:, 0], "rad/s", "rpm"), convert(corners[:, 1], "N m", unit)], axis=1)
                axes.add_patch(Polygon(points, facecolor=face, edgecolor=colour, linestyle=dash, linewidth=1.0))
    axes.axhline(0, color=MUTED, linewidth=0.7, zorder=2)
    axes.axvline(0, color=MUTED, linewidth=0.7, zorder=2)
    speed, torque = convert(series.motor_speed, "rad/s", "rpm"), convert(series.motor_torque, "N m", unit)
    axes.scatter(speed, torque, c=series.time, s=6, cmap=TIME_COLOURS, linewidths=0, zorder=4)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    return unit
