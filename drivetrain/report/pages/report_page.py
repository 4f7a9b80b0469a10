"""The report: one self-contained HTML page for one evaluation or one selection."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
from markupsafe import Markup

from drivetrain.report.charts.arm_charts import heat_chart, margin_chart, power_chart
from drivetrain.report.charts.chart import INSTANTS, JOINT_COLOURS, Chart, Pictures, moving_script
from drivetrain.report.charts.motion_data import FOLLOWS, SUPPLIES, gear_limits, motion_data
from drivetrain.report.pages import views
from drivetrain.report.pages.assumptions import assumption_groups
from drivetrain.report.pages.proof_section import proof_section, search_table
from drivetrain.report.pages.sheet import TEMPLATES, Extra, SheetTable, page_text, with_markup
from drivetrain.report.pages.spread_section import spread_section
from drivetrain.report.quantities import number, percent, with_unit
from drivetrain.report.rejected import SHARES, counted, rejected_data
from drivetrain.report.words import (
    HEADINGS,
    OUTSIDE,
    both,
    gaps,
    headline,
    named,
    objective_text,
    overall_sentence,
    study_facts,
)
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.judge.checks import factors
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.model import Study, gear_name
from drivetrain.study.parts.verdicts import shared_place


def html_report(
    result: Evaluation | Selection,
    *,
    spread: Spread | None = None,
    extra: Extra | None = None,
) -> str:
    """The whole report as one page that needs nothing from outside.

    Args:
        result: Of ``evaluate`` or ``select``.
        spread: What the scatter of its numbers means, where the study states tolerances.
        extra: Sections that were asked for beside.

    Returns:
        HTML text; the same result gives the same bytes.
    """
    content, data, pictures = report_content(result, spread=spread, extra=extra)
    return report_text(content, data, pictures)


def report_content(
    result: Evaluation | Selection, *, spread: Spread | None = None, extra: Extra | None = None, briefly: bool = False
) -> tuple[dict[str, Any], dict[str, Any], Pictures]:
    """What the template lays out, data of the moving pictures, other pictures; briefly: without more evaluations."""
    evaluation, selection = both(result)
    rejected = None if selection is None else selection.rejected
    pictures = Pictures()
    content = _frame(evaluation, selection) | _body(evaluation, selection, rejected, pictures)
    content["groups"] = assumption_groups(evaluation, briefly=briefly)
    beside = [*([] if spread is None else [spread_section(spread)]), *([] if extra is None else extra.sections)]
    content["extra"] = [with_markup(section, pictures) for section in beside]
    data: dict[str, Any] = {"instants": INSTANTS, "motion": motion_data(evaluation)} if evaluation.joints else {}
    if selection is not None and rejected is not None and len(rejected):
        data["rejected"] = rejected_data(selection, rejected)
    content["units"] = data.get("motion", {}).get("units", {})
    return content, data, pictures


def report_text(content: dict[str, Any], data: dict[str, Any], pictures: Pictures, live: str = "") -> str:
    script = Markup((TEMPLATES / "page.js").read_text(encoding="utf-8"))
    answers = Markup((TEMPLATES / "live.js").read_text(encoding="utf-8")) if live else ""
    return page_text(
        "page.html.j2", **content, script=script, pictures=pictures.end(**data), live=Markup(live),
        live_script=answers, motion_script=moving_script() if data else "",
    )  # fmt: skip


def _frame(evaluation: Evaluation, selection: Selection | None) -> dict[str, Any]:
    """What stands around the content: title, verdict, navigation, style and script."""
    study = evaluation.study
    verdict = evaluation.verdict if selection is None else selection.verdict
    return {
        "kind": "Drive sizing report" if selection is None else "Drive selection report",
        "study": study,
        "facts": study_facts(study),
        "verdict": str(verdict),
        "verdict_css": views.CSS[verdict],
        "headline": headline(evaluation, selection),
        "gaps": gaps(evaluation)[: None if selection is None else 1],
        "binding": overall_sentence(evaluation),
        "objective": objective_text(evaluation, selection),
        "proof": None if selection is None else with_markup(proof_section(selection)),
        "search": None if selection is None else search_table(selection),
        "proven": "" if selection is None else selection.proof,
        "advice": () if selection is None else selection.advice,
        "notes": () if selection is None else selection.notes,
        "cards": [
            views.joint_card(joint, JOINT_COLOURS[k % len(JOINT_COLOURS)])
            for k, joint in enumerate(evaluation.joints.values())
        ],
    }


def _body(
    evaluation: Evaluation, selection: Selection | None, rejected: pd.DataFrame | None, pictures: Pictures
) -> dict[str, Any]:
    rows = views.check_rows(evaluation)
    joints = [_joint(joint, evaluation) for joint in evaluation.joints.values()]
    if selection is not None and rejected is not None:
        joints = [one | _others(selection, rejected, name) for one, name in zip(joints, evaluation.joints, strict=True)]
    checks, counts = views.rejected_counts({} if rejected is None else counted(rejected), evaluation.joints)

    def picture(chart: Chart | None) -> Markup:
        return Markup("") if chart is None else pictures.add(chart)

    return {
        "rows": rows,
        "matrix": views.matrix(evaluation),
        "unchecked": _unchecked(rows),
        "joints": joints,
        "shared": [views.check_row(shared_place(check), check) for check in evaluation.shared],
        "moments": _moments(evaluation),
        "supplies": {f"{share:g}": _supply(evaluation.study, share) for share in SUPPLIES},
        "margin_figure": picture(margin_chart(evaluation)),
        "supply_figure": picture(power_chart(evaluation)),
        "heat_figure": picture(heat_chart(evaluation)),
        "rejected": _rejected_words(evaluation, rejected),
        "is_selection": selection is not None,
        "factored": any(
            factors(evaluation.study.safety)[check.name] != 1.0
            for joint in evaluation.joints.values()
            for check in joint.checks
            if check.utilisation is not None
        ),
        "feasible": evaluation.feasible,
        "rejecting_checks": checks,
        "rejected_counts": counts,
        "passed_over": views.passed_over(evaluation.study.joints),
        "outside": SheetTable(("not in any verdict above", "what it would take to check it"), OUTSIDE),
    }


def _unchecked(rows: list[views.CheckRow]) -> SheetTable | None:
    left = [(row.joint, row.name, row.required, row.unit, row.remark or "data missing") for row in rows
            if row.css == "unchecked"]  # fmt: skip
    return SheetTable(("joint", "check", "required", "unit", "why"), tuple(left), "", (2,)) if left else None


def _moments(evaluation: Evaluation) -> dict[str, str]:
    """First and last instant, and the one at which a limit is closest: there the page begins [s]."""
    time = evaluation.study.cycle.time
    judged = [check for joint in evaluation.joints.values() for check in joint.checks
              if check.utilisation is not None and check.time is not None and check.unit != "C"]  # fmt: skip
    worst = max(judged, key=lambda check: check.utilisation or 0.0, default=None)
    at = time[0] if worst is None or worst.time is None else worst.time
    return {name: f"{value:.6g}" for name, value in (("first", time[0]), ("last", time[-1]), ("worst", at))}


def _supply(study: Study, share: float) -> str:
    share_text = "" if share == 1.0 else f" ({percent(share)} of the study's)"
    return f"{with_unit(share * study.supply.voltage, 'V')}{share_text}"


def _rejected_words(evaluation: Evaluation, rejected: pd.DataFrame | None) -> dict[str, Any] | None:
    """What the table of rejected candidates is headed by; None where there are none."""
    if rejected is None or not len(rejected):
        return None
    joints = [name for name in evaluation.joints if (rejected["joint"] == name).any()]
    headings = ("joint", "motor", "gear", "rejected by", "used of the limit", SHARES[evaluation.study.objective])
    return {"joints": joints, "headings": headings}


def _joint(joint: JointResult, evaluation: Evaluation) -> dict[str, Any]:
    gear, study = joint.drive.gear, evaluation.study
    ratio = abs(gear.ratio)
    step = 1.0 if ratio >= 20.0 else 0.1
    follows = [
        (check.name, FOLLOWS[check.name], percent(check.utilisation)) for check in joint.checks
        if check.name in FOLLOWS and check.utilisation is not None and math.isfinite(check.utilisation)
    ]  # fmt: skip
    ends = {
        "low": max(step, 0.4 * ratio // step * step),
        "high": 2.5 * ratio // step * step,
        "own": ratio,
        "step": step,
    }
    return {
        "card": views.joint_card(joint),
        "ratio": None if gear.kind == "ideal" else {name: f"{value:g}" for name, value in ends.items()},
        "follows": follows,
        "gear_limits": [f"{name} {with_unit(value, unit)}" for name, value, unit in gear_limits(gear)],
        "rows": [views.check_row(joint.name, check) for check in joint.checks],
        "assumptions": joint.drive.assumptions,
        "remarks": joint.remarks,
        "parts": views.used_rows(joint, study),
        "tables": [],
    }


def _others(selection: Selection, rejected: pd.DataFrame, joint: str) -> dict[str, list[SheetTable]]:
    """What a selection adds for a joint: who else passes, and who failed by little."""
    study, found = selection.study, []
    catalog, worth = study.catalog, HEADINGS[study.objective]

    def pair(motor: str, gear: str) -> tuple[str, str]:
        known = catalog.motors.get(motor), catalog.gears.get(gear)
        return named(motor, known[0]), named(gear_name(gear), known[1])

    after = tuple((*pair(motor, gear), number(share)) for motor, gear, share in selection.alternatives.get(joint, ()))
    if after:
        title = "Runners-up" if selection.choice is None else "Runners-up, with nominal values"
        found.append(SheetTable(("motor", "gear", worth), after, title, (2,)))
    rows = tuple((*pair(*one[:2]), *one[2:]) for one in views.nearest_misses(rejected, joint, study.safety))
    if rows:
        headings = ("motor", "gear", "rejected by", "required", "available", "unit", "utilisation", worth)
        title = f"Closest of the {(rejected['joint'] == joint).sum()} rejected"
        found.append(SheetTable(headings, rows, title, (3, 4, 6, 7)))
    return {"tables": found}
