"""The page of a ratio study: one picture and its tables a joint, in the look of the report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from drivetrain.errors import Fault, InputError
from drivetrain.report.charts.answer_charts import free_ratio_charts, ratio_charts
from drivetrain.report.charts.chart import captioned
from drivetrain.report.json_text import job_data, json_text, picked
from drivetrain.report.pages.sheet import Chip, Row, Section, SheetTable, sheet
from drivetrain.report.pages.views import CSS, anchor, chip
from drivetrain.report.quantities import DASH, number, percent, with_unit
from drivetrain.sizing.answers.free_ratio import FreeJoint, FreeRatios
from drivetrain.sizing.answers.ratio import ClosedForms, RatioStudy, RatioWindow
from drivetrain.sizing.judge.vary import NOT_CHECKED
from drivetrain.study.model import pair_name
from drivetrain.study.parts.verdicts import Verdict

METHOD = (
    "Motor torque at the ratio G is T/G + rotor inertia · G · acceleration, with the mesh's loss by the direction of "
    "power, friction on both sides of the gear and the acceleration of the link that carries the motor. Its RMS value "
    "is smallest where both terms contribute equally.",
    "Matched inertia, √(load inertia / rotor inertia), is the answer for an inertia alone (Modern Robotics, exercise "
    "8.9); weight and friction require a larger ratio.",
    "α of the motor is its rated torque² over its rotor inertia; β is what the load needs at its best ratio. Where α "
    "is smaller, no ratio is sufficient. This method divides by the efficiency even where the load drives, so that its "
    "range is narrower than that of the checks.",
    "The lower end of a window is set by torque, current or heat, the upper end by speed or voltage.",
)


def ratio_report(studies: Sequence[RatioStudy]) -> str:
    """The ratio studies of one task as one page that needs nothing from outside."""
    if not studies:
        raise InputError(Fault("joints", "none of them moves, so there is no ratio to study"))
    method = Section("How to read this", "method", notes=METHOD)
    return sheet(studies[0].study, "Gear ratios", [_overview(studies), *map(_joint, studies), method])


def ratio_rows(found: RatioStudy) -> list[Row]:
    nothing = RatioWindow(math.nan, math.nan, found.best.binding_words, found.best.binding_words)
    return [
        (
            found.joint, found.motor, found.gear.removeprefix("+") or "ideal gear", number(found.drive.gear.ratio),
            Chip("no ratio", "fail")
            if window is nothing
            else Chip(number(window.low) if window.low else "any", "pass"),
            number(window.high),
            window.low_binding or DASH, window.high_binding or DASH, number(found.best.ratio),
            percent(found.best.utilisation),
        )
        for window in found.windows or (nothing,)
    ]  # fmt: skip


def ratio_sentence(found: RatioStudy) -> str:
    """The answer for one joint."""
    drive = pair_name(found.motor, found.gear or "an ideal gear")
    if not found.windows:
        return f"No ratio lets {drive} meet all limits: the best, {number(found.best.ratio)}, " + (
            f"leaves {found.best.binding} unchecked for lack of data."
            if found.best.binding in found.best.undecided
            else f"needs {percent(found.best.utilisation)} of the limit on {found.best.binding}."
        )
    spans = " and ".join(_span(window) for window in found.windows)
    own = abs(found.drive.gear.ratio)
    inside = any(window.low <= own <= window.high for window in found.windows)
    where = f"{spans}; its own, {number(own)}, is {'inside' if inside else 'outside'}."
    if found.lacking:
        unknown = ", ".join(check.name for check in found.lacking)
        missing = f"{drive} is not proven to fit: data are missing to check {unknown}"
        return f"{missing}; all other checks are satisfied with a ratio {where}"
    return f"{drive} fits with a ratio {where}"


def _span(window: RatioWindow) -> str:
    """A window in words, with what ends it."""
    ends = (window.low_binding, window.high_binding)
    low_end, high_end = (end.replace(NOT_CHECKED, ", not checked") for end in ends)
    low = f"from {number(window.low)} ({low_end})" if window.low > 0.0 else ""
    high = f"to {number(window.high)} ({high_end})" if window.high < math.inf else ""
    if low:
        return f"{low} {high or 'upwards'}"
    return f"up {high}" if high else "of any size"


def _overview(studies: Sequence[RatioStudy]) -> Section:
    headings = (
        "joint", "motor", "gear varied", "its ratio", "all checks satisfied from", "to", "check that ends it below",
        "check that ends it above", "ratio of lowest utilisation", "lowest utilisation",
    )  # fmt: skip
    rows = tuple(row for found in studies for row in ratio_rows(found))
    return Section("Every joint", "joints", tables=(SheetTable(headings, rows, "", (3, 4, 5, 8, 9)),))


def _joint(found: RatioStudy) -> Section:
    caption = (
        "All data of the gear except its ratio are kept. Shaded: ratios at which all checks are satisfied; "
        "dashed line: the ratio of the data sheet."
    )
    if any(point.undecided for point in found.points):
        caption += " Grey in the utilisation: a check is not decided for lack of data."
    charts = ratio_charts(found)
    if not any("winding" in chart.y for chart in charts):
        caption += " Winding temperature not computed: no thermal data in the catalogue row."
    gears = tuple(
        (one.key, number(one.ratio), chip(one.verdict), percent(one.utilisation), one.binding) for one in found.gears
    )
    reaction = tuple(
        (joint, f"{number(100.0 * share, 2)}\u00a0%" if share >= 1e-4 else "below 0.01\u00a0%")
        for joint, share in found.reaction.items()
    )
    headings = ("gear", "ratio", "verdict", "utilisation", "binding check")
    felt = "Effect on the joints before it: change of their torque over the window, divided by their peak"
    tables = (
        SheetTable(headings, gears, "Nearest gears of the catalogue, each with its own data", (1, 3)),
        SheetTable(("joint", "change"), reaction, felt, (1,)),
    )
    word, css = ("fits", "pass") if found.feasible else ("no ratio fits", "fail")
    return Section(found.joint, anchor(found.joint), word, css, (ratio_sentence(found),),
                   captioned(charts, caption), tables, found.notes,
                   tuple(_formulas(found.closed_forms, found.limits.continuous_torque)))  # fmt: skip


def _formulas(forms: ClosedForms, rated: float | None) -> list[tuple[str, str]]:
    rows = [
        ("ratio of matched inertia, √(I/J)", number(forms.matching)),
        ("ratio of least RMS motor torque", number(forms.least_rms)),
        ("ratio of least peak motor torque", number(forms.least_peak)),
    ]
    if forms.rated is not None:
        spans = [f"{number(span.low)} to {number(span.high)}" for span in forms.rated]
        rows.append((f"ratios with an RMS torque within {with_unit(rated, 'N m')}", " and ".join(spans) or "no ratio"))
    match = forms.load_match
    if match is not None:
        span = "no ratio" if match.range is None else f"{number(match.range.low)} to {number(match.range.high)}"
        rows += [
            ("accelerating factor α", f"{number(match.accelerating_factor)} W/s"),
            ("load factor β/η", f"{number(match.load_factor)} W/s"),
            ("ratios by α and β", span),
            ("best ratio by α and β", number(match.best)),
        ]
    return rows


def ratio_json(studies: Sequence[RatioStudy]) -> str:
    """The ratio studies of one task as JSON text, in SI and degrees Celsius."""
    joints = {found.joint: _joint_data(found) for found in studies}
    feasible = all(found.feasible for found in studies)
    return json_text(job_data(studies[0].study, "ratio", feasible=feasible, joints=joints))


def _joint_data(found: RatioStudy) -> dict[str, Any]:
    forms = found.closed_forms
    return {
        "drive": {"motor": found.motor, "gear": found.gear, "ratio": found.drive.gear.ratio},
        "windows": [vars(window) for window in found.windows],
        "best": picked(found.best, *POINT),
        "matched_inertia": forms.matching,
        "least_rms_torque": forms.least_rms,
        "least_peak_torque": forms.least_peak,
        "rated_ranges": forms.rated,
        "load_match": None if forms.load_match is None else forms.load_match._asdict(),
        "limits": vars(found.limits),
        "gears": [
            {"gear": gear.key} | picked(gear, "ratio", "utilisation", "binding", "verdict", "inside")
            for gear in found.gears
        ],
        "reaction": found.reaction,
        "not_checked": [check.name for check in found.lacking],
        "notes": found.notes,
        "points": [picked(point, *POINT) for point in found.points],
    }


POINT = ("ratio", "rms_torque", "peak_torque", "motor_speed", "winding_temperature", "utilisation", "binding")


WORDS = {
    "heat": "mean copper loss", "current": "RMS of the relative motor currents", "energy": "energy a cycle",
    "mass": "mass of all drives",
}  # fmt: skip

NO_USE = 1e6  # a ratio by formula beyond this says only that the load turns nothing to speak of


def free_ratio_report(found: FreeRatios) -> str:
    caption = (
        "The goal of the whole arm over the ratio of one joint, the others at their best. Shaded: ratios that speed "
        "and voltage allow. Dots: gears of the catalogue in the place of the continuous one, with their own sheet."
    )
    word = "all checks satisfied" if found.feasible else "a check fails or could not be made"
    css, charts = "pass" if found.feasible else "fail", captioned(free_ratio_charts(found), caption)
    first = Section(
        "Best ratios", "ratios", word, css, (free_ratio_sentence(found),), charts, (_table(found),), found.notes
    )
    return sheet(found.study, "Gears as free ratios", [first, *(_free_joint(one) for one in found.joints)])


def free_ratio_sentence(found: FreeRatios) -> str:
    value = number(found.value) if found.goal.unit == "1" else with_unit(found.value, found.goal.unit)
    text = f"With the best ratios the {WORDS[found.goal]} of the arm is {value}"
    more = found.value_at_least_rms / found.value - 1.0 if found.value else math.nan
    if math.isfinite(more):
        small = f"{number(100.0 * more, 2)} %" if abs(more) >= 1e-6 else "less than a ten-thousandth of a percent"
        text += f"; with every joint at the best for its own motor it is {small} more"
    short = [one.joint for one in found.joints if one.verdict not in (Verdict.PASS, Verdict.MARGINAL)]
    addition = f" A check fails or could not be made at {', '.join(short)}." if short else ""
    return f"{text}.{addition}"


def free_ratio_lines(found: FreeRatios) -> list[str]:
    lines = []
    for one in found.joints:
        holding = [gear for gear in one.gears if gear.verdict not in ("FAIL", "NOT CHECKED")]
        beside = "none of the catalogue's gears near it fits"
        if holding:
            least = min(holding, key=lambda gear: gear.excess)
            beside = f"of the catalogue's, {least.key} loses least, {_excess(least.excess)} of the arm's {found.goal}"
        span = f"{number(one.low)} to {number(one.high)}"
        lines.append(f"{one.joint}: ratio {number(one.best)}, {one.verdict}; speed and voltage allow {span}; {beside}")
    return lines


def _excess(share: float) -> str:
    return DASH if math.isnan(share) else f"{number(100.0 * share, 2)}\u00a0%"


def _table(found: FreeRatios) -> SheetTable:
    rows = []
    for one in found.joints:
        mass = one.gear.mass
        rows.append((
            one.joint, one.motor, number(one.best), DASH if one.least_rms > NO_USE else number(one.least_rms),
            number(one.low), number(one.high), one.ended_by, with_unit(one.gear.repeated_peak_torque, "N m"),
            with_unit(mass, "kg"), chip(one.verdict),
        ))  # fmt: skip
    headings = (
        "joint", "motor", "best for the arm", "by formula, motor only", "speed and voltage allow from", "to",
        "ended above by", "gear's peak torque", "gear's mass", "checks",
    )  # fmt: skip
    return SheetTable(headings, tuple(rows), "", (2, 3, 4, 5, 7, 8))


def _free_joint(one: FreeJoint) -> Section:
    rows = tuple(
        (gear.key, number(gear.ratio), _excess(gear.excess), chip(gear.verdict),
         percent(gear.utilisation), gear.binding)
        for gear in one.gears
    )  # fmt: skip
    headings = ("gear", "ratio", "goal above the continuous best", "verdict", "utilisation", "binding check")
    title = f"Gears of the catalogue nearest to a ratio of {number(one.best)}"
    tables = (SheetTable(headings, rows, title, (1, 2, 4)),)
    lead = () if rows else ("No gear of the catalogue goes with this motor.",)
    return Section(one.joint, anchor(one.joint), str(one.verdict), CSS[one.verdict], lead, tables=tables)
