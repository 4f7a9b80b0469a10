"""The picture of the README: the motors' planes of torque over speed, all joints of an arm in one PNG."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from drivetrain.arrays import Array
from drivetrain.report.charts.chart import BLUE, GREEN, INSTANTS, Chart, Mark
from drivetrain.report.charts.motion_data import regions, temperatures, view
from drivetrain.report.charts.plotting import draw, house_style, png_bytes
from drivetrain.report.quantities import convert, percent, printed_unit, shown_unit
from drivetrain.report.summary import COLOURS
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study


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
            draw(_motor_plane(joint, tasks[joint.name], evaluation.study), axes)
            axes.xaxis.set_major_locator(MaxNLocator(5))
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


def _motor_plane(joint: JointResult, task: JointTask, study: Study) -> Chart:
    """Regions and samples of one joint."""
    series, at = joint.series, temperatures(joint, study)
    hot, cold = (regions(joint, task, study, at[name], study.supply.voltage) for name in ("hot", "cold"))
    wide, top = view(joint, hot[0])
    unit = shown_unit(top, "N m")

    def speed(values: object) -> Array:
        return convert(values, "rad/s", "rpm")

    def torque(values: object) -> Array:
        return convert(values, "N m", unit)

    marks = []
    for warm, outline, colour, opacity in zip(hot, cold, (BLUE, GREEN), (0.12, 0.24), strict=True):
        if warm is not None:
            marks.append(Mark("area", speed(warm[:, 0]), torque(warm[:, 1]), colour=colour, alpha=opacity))
        for corners, dash in ((warm, False), (outline, True)):
            if corners is not None:
                marks.append(
                    Mark("line", speed(corners[:, 0]), torque(corners[:, 1]), colour=colour, size=1.0, dash=dash)
                )
    marks += [Mark("rule", y=[0.0], colour="muted", size=0.7), Mark("rule", x=[0.0], colour="muted", size=0.7)]
    instants = np.interp(series.time, series.time[[0, -1]], [0, len(INSTANTS) - 1]).astype(int)
    marks.append(Mark("points", speed(series.motor_speed), torque(series.motor_torque), size=3,
                      colours=[INSTANTS[k] for k in instants]))  # fmt: skip
    right, high = float(speed(wide)), float(torque(top))
    return Chart(joint.name, "motor speed [rpm]", f"motor torque [{printed_unit(unit)}]", marks, (-right, right),
                 (-high, high))  # fmt: skip
