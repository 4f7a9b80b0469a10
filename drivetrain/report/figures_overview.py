"""One picture of all drives: the motor planes of every joint side by side, for a README or a slide."""

from __future__ import annotations

from matplotlib.figure import Figure

from drivetrain.report.figures_motor import draw_motor_plane, motor_regions
from drivetrain.report.quantities import percent, printed_unit
from drivetrain.report.svg import BLUE, GREEN, ORANGE, VERMILLION, house_style, png_bytes
from drivetrain.sizing.results import Evaluation, Verdict

_COLOURS = {Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: "#5b6775"}


def overview_png(evaluation: Evaluation) -> bytes:
    """The speed-torque planes of all joints with their clouds, drives and verdicts.

    Args:
        evaluation: What was found.

    Returns:
        A PNG file.
    """
    tasks = {task.name: task for task in evaluation.study.joints}
    joints = list(evaluation.joints.values())
    columns = min(3, len(joints))
    rows = -(-len(joints) // columns)
    with house_style("overview"):
        figure = Figure(figsize=(3.5 * columns, 2.95 * rows + 0.35))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, joint in zip(grid.flat, joints, strict=False):
            unit = draw_motor_plane(axes, joint, motor_regions(joint, tasks[joint.name], evaluation.study), small=True)
            axes.set_title(f"{joint.name}\n", fontsize=9)
            drive = joint.motor + (f" + {joint.gear}" if joint.gear else "")
            axes.annotate(
                drive, (0, 1), xycoords="axes fraction", xytext=(0, 4), textcoords="offset points", fontsize=6.5
            )
            binding = "" if joint.binding is None else f" {percent(joint.binding.utilisation)}"
            axes.annotate(
                f"{joint.verdict}{binding}", (1, 1), xycoords="axes fraction", xytext=(0, 17),
                textcoords="offset points", ha="right", fontsize=8, weight="bold", color=_COLOURS[joint.verdict],
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
