"""Free ratios as a page, and in lines for the terminal."""

from __future__ import annotations

import math

from drivetrain.report.answer_charts import free_ratio_charts
from drivetrain.report.quantities import DASH, number, percent, with_unit
from drivetrain.report.sections import Chip, Section, SheetTable, captioned
from drivetrain.report.sheet import sheet
from drivetrain.report.views import CSS, anchor
from drivetrain.sizing.answers.free_ratio import FreeJoint, FreeRatios
from drivetrain.study.parts.verdicts import Verdict

WORDS = {
    "heat": "mean copper loss", "current": "RMS of the relative motor currents", "energy": "energy a cycle",
    "mass": "mass of all drives",
}  # fmt: skip

NO_USE = 1e6  # a ratio by formula beyond this says only that the load turns nothing to speak of


def free_ratio_report(found: FreeRatios) -> str:
    """The best ratios as a page."""
    caption = (
        "The goal of the whole arm over the ratio of one joint, the others at their best. Shaded: ratios that speed "
        "and voltage allow. Dots: gears of the catalogue in the place of the continuous one, with their own sheet."
    )
    word = "every check holds" if found.feasible else "not every check holds or could be made"
    css, charts = "pass" if found.feasible else "fail", captioned(free_ratio_charts(found), caption)
    first = Section(
        "Best ratios", "ratios", word, css, (free_ratio_sentence(found),), charts, (_table(found),), found.notes
    )
    return sheet(found.study, "Gears as free ratios", [first, *(_joint(one) for one in found.joints)])


def free_ratio_sentence(found: FreeRatios) -> str:
    """The answer in words."""
    value = _value(found, found.value)
    text = f"With the best ratios the {WORDS[found.goal]} of the arm is {value}"
    more = found.alone / found.value - 1.0 if found.value else math.nan
    if math.isfinite(more):
        small = f"{number(100.0 * more, 2)} %" if abs(more) >= 1e-6 else "less than a ten-thousandth of a percent"
        text += f"; with every joint at the best for its own motor it is {small} more"
    short = [one.joint for one in found.joints if one.verdict not in (Verdict.PASS, Verdict.MARGINAL)]
    told = f" Not every check holds or could be made at {', '.join(short)}." if short else ""
    return f"{text}.{told}"


def free_ratio_lines(found: FreeRatios) -> list[str]:
    """The ratios for the terminal."""
    lines = []
    for one in found.joints:
        holding = [gear for gear in one.gears if gear.verdict not in ("FAIL", "NOT CHECKED")]
        beside = "of the catalogue's gears near it none holds"
        if holding:
            least = min(holding, key=lambda gear: gear.loss)
            beside = f"of the catalogue's, {least.key} loses least, {_loss(least.loss)} of the arm's {found.goal}"
        span = f"{number(one.low)} to {number(one.high)}"
        lines.append(f"{one.joint}: ratio {number(one.best)}, allowed {span}, {one.verdict}; {beside}")
    return lines


def _value(found: FreeRatios, value: float) -> str:
    return number(value) if found.goal.unit == "1" else with_unit(value, found.goal.unit)


def _loss(share: float) -> str:
    return DASH if math.isnan(share) else f"{number(100.0 * share, 2)}\u00a0%"


def _table(found: FreeRatios) -> SheetTable:
    rows = []
    for one in found.joints:
        mass = one.gear.mass
        rows.append((
            one.joint, one.motor, number(one.best), DASH if one.alone > NO_USE else number(one.alone), number(one.low),
            number(one.high), one.ended_by, with_unit(one.gear.repeated_peak_torque, "N m"), with_unit(mass, "kg"),
            Chip(str(one.verdict), CSS[one.verdict]),
        ))  # fmt: skip
    headings = (
        "joint", "motor", "best for the arm", "by formula, motor only", "allowed from", "to",
        "ended above by", "gear's peak torque", "gear's mass", "checks",
    )  # fmt: skip
    return SheetTable(headings, tuple(rows), "", (2, 3, 4, 5, 7, 8))


def _joint(one: FreeJoint) -> Section:
    rows = tuple(
        (gear.key, number(gear.ratio), _loss(gear.loss), Chip(str(gear.verdict), CSS[gear.verdict]),
         percent(gear.utilisation), gear.binding)
        for gear in one.gears
    )  # fmt: skip
    headings = ("gear", "ratio", "goal above the continuous best", "verdict", "utilisation", "of")
    title = f"Gears of the catalogue nearest to a ratio of {number(one.best)}"
    tables = (SheetTable(headings, rows, title, (1, 2, 4)),) if rows else ()
    lead = () if rows else ("No gear of the catalogue goes with this motor.",)
    return Section(one.joint, anchor(one.joint), str(one.verdict), CSS[one.verdict], lead, tables=tables)
