"""A summary of one page as PDF with verdict, drives and limits."""

from __future__ import annotations

import io
import textwrap

from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from drivetrain.report.charts.arm_charts import margin_chart
from drivetrain.report.charts.chart import GREEN, MUTED, ORANGE, VERMILLION
from drivetrain.report.charts.plotting import draw, house_style
from drivetrain.report.quantities import percent
from drivetrain.report.words import both, gaps, headline, named, objective_text, overall_sentence, study_facts
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.model import gear_name
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.version import __version__

PAGE = (8.27, 11.0)  # [in] width of A4 and height of Letter, so that it prints on both at full size
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
    """One row of the table, with long part names in two lines."""
    parts = [
        "\n".join(textwrap.wrap(named(key, part), 34, break_on_hyphens=False)[:2])
        for key, part in ((joint.motor, joint.drive.motor), (gear_name(joint.gear), joint.drive.gear))
    ]
    binding = joint.binding
    used, limit = ("–", "–") if binding is None else (percent(binding.utilisation), binding.name)
    return [joint.name, *parts, str(joint.verdict), used, "\n".join(textwrap.wrap(limit, 22)[:2])]
