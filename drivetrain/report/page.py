"""The report: one self-contained HTML page for one evaluation or one selection."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
from markupsafe import Markup

from drivetrain.drive.amplifier import available_voltage
from drivetrain.report.assumptions import assumption_groups
from drivetrain.report.best_sets import HEADINGS, set_rows
from drivetrain.report.fallen_columns import counted, fallen_columns
from drivetrain.report.figures_arm import supply_power, temperatures
from drivetrain.report.figures_gear import gear_plane
from drivetrain.report.figures_margins import margin_bars
from drivetrain.report.figures_motor import motor_plane
from drivetrain.report.figures_selection import candidates
from drivetrain.report.figures_strips import ElectricalLimits, electrical_strips, motion_strips
from drivetrain.report.proof_section import proof_section
from drivetrain.report.quantities import number, percent, with_unit
from drivetrain.report.sections import Extra, with_markup
from drivetrain.report.spread_section import spread_frame
from drivetrain.report.views import (
    CSS,
    anchor,
    check_row,
    check_rows,
    fallen_counts,
    joint_card,
    matrix,
    nearest_misses,
    passed_over,
    used_rows,
)
from drivetrain.report.words import (
    OUTSIDE,
    gaps,
    headline,
    identity,
    objective_text,
    overall_sentence,
)
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.judge.checks import factors
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.model import JointTask, Study
from drivetrain.study.verdicts import shared_place
from drivetrain.version import __version__

HERE = Path(__file__).parent


def html_report(
    result: Evaluation | Selection,
    *,
    fallen: pd.DataFrame | None = None,
    spread: Spread | None = None,
    extra: Extra | None = None,
) -> str:
    """The whole report as one page that needs nothing from outside.

    Args:
        result: Of ``evaluate`` or ``select``.
        fallen: Its ``fallen_columns``, where they are at hand.
        spread: What the scatter of its numbers means, where the study states tolerances.
        extra: Sections that were asked for beside.

    Returns:
        HTML text; the same result gives the same bytes.
    """
    selection = result if isinstance(result, Selection) else None
    evaluation = result.evaluation if isinstance(result, Selection) else result
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.get_template("page.html.j2")
    if selection is not None and fallen is None:
        fallen = fallen_columns(selection)
    content = _frame(evaluation, selection) | _body(evaluation, selection, fallen) | spread_frame(spread)
    content["extra"] = [] if extra is None else [with_markup(section) for section in extra.sections]
    return template.render(content) + "\n"


def _frame(evaluation: Evaluation, selection: Selection | None) -> dict[str, Any]:
    """What stands around the content: title, verdict, navigation, style and script."""
    study = evaluation.study
    verdict = evaluation.verdict if selection is None else selection.verdict
    return {
        "kind": "Drive sizing report" if selection is None else "Drive selection report",
        "study": study,
        "facts": _facts(study),
        "verdict": str(verdict),
        "verdict_css": CSS[verdict],
        "headline": headline(evaluation, selection),
        "gaps": gaps(evaluation)[: None if selection is None else 1],
        "binding": overall_sentence(evaluation),
        "objective": objective_text(evaluation, selection),
        "proof": None if selection is None else with_markup(proof_section(selection)),
        "proven": "" if selection is None else selection.proof,
        "advice": () if selection is None else selection.advice,
        "notes": () if selection is None else selection.notes,
        "cards": [joint_card(joint) for joint in evaluation.joints.values()],
        "version": __version__,
        "style": Markup((HERE / "style.css").read_text(encoding="utf-8")),
        "script": Markup((HERE / "page.js").read_text(encoding="utf-8")),
    }


def _facts(study: Study) -> list[str]:
    """The line under the title."""
    arm = f"{len(study.joints)} joint{'s' if len(study.joints) > 1 else ''}"
    return [
        arm if study.arm is None else f"{study.arm.name}, {arm}",
        _task(study),
        f"supply {with_unit(study.supply.voltage, 'V')}",
        f"ambient {study.ambient:g} °C",
    ]


def _task(study: Study) -> str:
    """How long what is repeated, of a mix which shares."""
    cycle = study.cycle
    if len(cycle.parts) == 1:
        return f"cycle of {number(cycle.duration)} s"
    shares = ", ".join(f"{percent(share)} {name}" for share, name in zip(cycle.shares, cycle.part_names, strict=True))
    return f"mix of {shares}"


def _body(evaluation: Evaluation, selection: Selection | None, fallen: pd.DataFrame | None) -> dict[str, Any]:
    """The content, section by section."""
    rows = check_rows(evaluation)
    tasks = {task.name: task for task in evaluation.study.joints}
    joints = [_joint(joint, tasks[name], evaluation) for name, joint in evaluation.joints.items()]
    if selection is not None and fallen is not None:
        joints = [one | _others(selection, fallen, name) for one, name in zip(joints, evaluation.joints, strict=True)]
    checks, counts = fallen_counts({} if fallen is None else counted(fallen), evaluation.joints)
    reserve = evaluation.study.safety.reserve
    return {
        "groups": assumption_groups(evaluation),
        "rows": rows,
        "matrix": matrix(evaluation),
        "unchecked": [row for row in rows if row.css == "unchecked"],
        "joints": joints,
        "shared": [check_row(shared_place(check), check) for check in evaluation.shared],
        "margin_figure": Markup(
            margin_bars(evaluation, reserve=reserve) if any(row.share >= 0 for row in rows) else ""
        ),
        "supply_figure": Markup(supply_power(evaluation)),
        "heat_figure": Markup(temperatures(evaluation)),
        "candidate_figure": Markup("" if selection is None else candidates(selection, fallen=fallen)),
        "sets": [] if selection is None else set_rows(selection),
        "share_heading": HEADINGS[evaluation.study.objective],
        "is_selection": selection is not None,
        "factored": any(
            factors(evaluation.study.safety)[check.name] != 1.0
            for joint in evaluation.joints.values()
            for check in joint.checks
            if check.utilisation is not None
        ),
        "feasible": evaluation.feasible,
        "felling_checks": checks,
        "fallen_counts": counts,
        "passed_over": passed_over(evaluation.study.joints),
        "outside": OUTSIDE,
    }


def _joint(joint: JointResult, task: JointTask, evaluation: Evaluation) -> dict[str, Any]:
    """One joint's section."""
    study, name = evaluation.study, anchor(joint.name)
    limits = ElectricalLimits(
        task.amplifier.peak_current, available_voltage(task.amplifier, study.supply.voltage)
    )  # fmt: skip
    prismatic = task.travel_per_turn is not None
    motion = motion_strips(joint, study.cycle, prismatic=prismatic, name=f"{name}-motion")
    electrical = electrical_strips(joint, study.cycle, limits=limits, name=f"{name}-electrical")
    return {
        "card": joint_card(joint),
        "motor_figure": Markup(motor_plane(joint, task, study, name=f"{name}-motor")),
        "gear_figure": Markup(gear_plane(joint, parts=study.cycle.parts, name=f"{name}-gear")),
        "motion_figure": Markup(motion),
        "electrical_figure": Markup(electrical),
        "rows": [check_row(joint.name, check) for check in joint.checks],
        "assumptions": joint.drive.assumptions,
        "remarks": joint.remarks,
        "parts": used_rows(joint, study),
        "motor_name": identity(joint.drive.motor),
        "gear_name": identity(joint.drive.gear),
        "names": {},
        "alternatives": [],
        "misses": [],
        "fell": 0,
    }


def _others(selection: Selection, fallen: pd.DataFrame, joint: str) -> dict[str, Any]:
    """What only a selection knows of a joint: who else passes, and who failed by little."""
    catalog, safety = selection.evaluation.study.catalog, selection.evaluation.study.safety
    alternatives, misses = _alternatives(selection, joint), nearest_misses(fallen, joint, safety)
    pairs = [(motor, gear) for motor, gear, _ in alternatives] + [(miss.motor, miss.gear) for miss in misses]
    names = {motor: identity(catalog.motors.get(motor)) for motor, _ in pairs}
    return {
        "alternatives": alternatives,
        "misses": misses,
        "names": names | {gear: identity(catalog.gears.get(gear)) for _, gear in pairs},
        "fell": int((fallen["joint"] == joint).sum()),
    }


def _alternatives(selection: Selection, joint: str) -> list[tuple[str, str, str]]:
    """The next best pairs of a joint that also pass."""
    return [
        (motor, gear or "direct drive", number(share)) for motor, gear, share in selection.alternatives.get(joint, ())
    ]
