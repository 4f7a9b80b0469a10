"""For those who decide: one page as PDF with verdict, drives and limits; one picture of all drives, for a slide."""

from __future__ import annotations

import io
import textwrap

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from drivetrain.arrays import Array
from drivetrain.report.charts.arm_charts import margin_chart
from drivetrain.report.charts.chart import BLUE, GREEN, INSTANTS, MUTED, ORANGE, VERMILLION, Chart, Mark
from drivetrain.report.charts.motion_data import regions, temperatures, view
from drivetrain.report.charts.plotting import draw, house_style, png_bytes
from drivetrain.report.quantities import convert, percent, printed_unit, shown_unit
from drivetrain.report.words import both, gaps, headline, named, objective_text, overall_sentence, study_facts
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.version import __version__

PAGE = (8.27, 11.0)  # [in]: as wide as A4 and as high as Letter, so that it prints on both at full size
COLUMNS = {"joint": 0.13, "motor": 0.27, "gear": 0.27, "verdict": 0.11, "used": 0.06, "closest to a limit": 0.16}
WRAP = 105  # letters
COLOURS = {Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: "#5b6775"}


def summary_pdf(result: Evaluation | Selection) -> bytes:
    """The page as a PDF; the same result gives the same bytes."""
    evaluation, selection = both(result)
    study, joints = evaluation.study, list(evaluation.joints.values())
    with house_style("summary"):
        figure = Figure(figsize=PAGE, facecolor="white")
        figure.set_layout_engine("none")
        figure.text(0.07, 0.945, study.name, fontsize=17, weight="bold")
        figure.text(0.07, 0.922, " · ".join(study_facts(study)), color=MUTED)
        figure.text(0.07, 0.885, str(result.verdict), fontsize=19, weight="bold", color=COLOURS[result.verdict])
        words = [headline(evaluation, selection), *gaps(evaluation)[:1], overall_sentence(evaluation),
                 objective_text(evaluation, selection) + (f"; {selection.proof}" if selection else "")]  # fmt: skip
        words += list(selection.advice[:2]) if selection else []
        wrapped = "\n".join(line for text in words for line in textwrap.wrap(text, WRAP))
        figure.text(0.07, 0.870, wrapped, va="top", fontsize=9, linespacing=1.5)
        top = 0.845 - 0.0165 * (wrapped.count("\n") + 1)
        if joints:
            height = 0.030 * (len(joints) + 1)
            axes = figure.add_axes((0.07, top - height, 0.86, height))
            axes.axis("off")
            table = axes.table(
                [_cells(joint) for joint in joints], colLabels=list(COLUMNS), colWidths=list(COLUMNS.values()),
                cellLoc="left", colLoc="left", bbox=Bbox.unit(), edges="horizontal",
            )  # fmt: skip
            table.auto_set_font_size(False)
            for (row, column), cell in table.get_celld().items():
                cell.set(edgecolor="#c5ced8", linewidth=0.6)
                cell.set_text_props(fontsize=6.3, weight="bold" if row == 0 else "normal")
                if row and column == 3:
                    cell.set_text_props(color=COLOURS[joints[row - 1].verdict], weight="bold")
            top -= height + 0.03
        chart = margin_chart(evaluation)
        if chart is not None:
            height = min(0.020 * len(chart.rows) + 0.03, top - 0.12)
            axes = figure.add_axes((0.30, top - height, 0.48, height))
            draw(chart, axes)
            axes.tick_params(axis="y", labelsize=6.5)
        foot = f"drivetrain {__version__} · inputs {study.digest[:16]} · checks, assumptions and limits: report.html"
        figure.text(0.07, 0.035, foot, fontsize=6.5, color=MUTED)
        out = io.BytesIO()
        figure.savefig(out, format="pdf", metadata={"CreationDate": None, "Title": f"{study.name}: {result.verdict}"})
    return out.getvalue()


def _cells(joint: JointResult) -> list[str]:
    """One row of the table, long part names on two lines."""
    parts = [
        "\n".join(textwrap.wrap(named(key, part), 34, break_on_hyphens=False)[:2])
        for key, part in ((joint.motor, joint.drive.motor), (joint.gear or "direct drive", joint.drive.gear))
    ]
    binding = joint.binding
    used, limit = ("–", "–") if binding is None else (percent(binding.utilisation), binding.name)
    return [joint.name, *parts, str(joint.verdict), used, "\n".join(textwrap.wrap(limit, 22)[:2])]


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
