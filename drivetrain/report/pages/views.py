"""Rows and cards of the page: results as texts for the template, which only arranges them."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields

import numpy as np
import pandas as pd

from drivetrain.catalog.schema import BRAKE_COLUMNS, GEAR_COLUMNS, MOTOR_COLUMNS
from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, bare_key
from drivetrain.report.pages.sheet import Chip
from drivetrain.report.quantities import DASH, convert, number, percent, printed_unit
from drivetrain.report.rejected import COLUMNS
from drivetrain.report.words import (
    common_unit,
    digits_near_limit,
    identity,
    in_study_amperes,
    joint_sentence,
    nearness,
    required_text,
)
from drivetrain.sizing.judge.checks import factors
from drivetrain.sizing.results import Evaluation, JointResult, RejectedPair
from drivetrain.study.model import JointTask, Safety, Study, gear_name
from drivetrain.study.parts.verdicts import Check, Verdict, shared_place

CSS = {Verdict.PASS: "pass", Verdict.MARGINAL: "marginal", Verdict.FAIL: "fail", Verdict.NOT_CHECKED: "unchecked"}
TITLES = {"key", "maker", "series", "part_number", "source"}  # of a row, shown above its numbers
MOST_SHOWN = 8  # candidates a list; the file rejected.csv holds them all


@dataclass(frozen=True)
class CheckRow:
    """One check of one joint, or of the supply, as texts; ``information``: the text of a check without a verdict.

    Utilisation and instant [s] stand there as numbers for sorting too, -1 where there is none.
    """

    joint: str
    name: str
    required: str
    available: str
    unit: str
    utilisation: str
    information: str
    margin: str
    time: str
    source: str
    remark: str
    verdict: str
    css: str
    share: float
    seconds: float


@dataclass(frozen=True)
class JointCard:
    """One joint in the verdict box and in the navigation; ``share``: utilisation of the binding check."""

    name: str
    anchor: str
    verdict: str
    css: str
    motor: str
    gear: str
    motor_name: str
    gear_name: str
    sentence: str
    lead: str
    share: float
    colour: str


@dataclass(frozen=True)
class Part:
    """One catalogue row as used: (name, value, unit, meaning) of every known field, names of the others."""

    title: str
    key: str
    source: str
    cells: tuple[tuple[str, str, str, str], ...]
    missing: str


def chip(verdict: Verdict) -> Chip:
    return Chip(str(verdict), CSS[verdict])


def anchor(text: str) -> str:
    """A name that is valid in a link."""
    return "joint-" + re.sub(r"[^A-Za-z0-9]+", "-", text).strip("-")


def check_row(joint: str, check: Check, rows: tuple[str, ...] = ()) -> CheckRow:
    shown = common_unit(check)

    def text(value: float | None) -> str:
        digits = digits_near_limit(check.utilisation)
        return DASH if value is None else number(float(convert(value, check.unit, shown)), digits)

    margin = DASH
    if check.required is not None and check.available is not None and check.utilisation is not None:
        difference = float(convert(check.available, check.unit, shown) - convert(check.required, check.unit, shown))
        margin = ("+" if difference > 0 else "") + number(difference)
    source = check.source
    for row in rows:
        source = source.replace(f" ({row})", "") if row else source
    information = next((value for value in (check.required, check.available) if value is not None), None)
    share = check.utilisation if check.utilisation is not None and not math.isnan(check.utilisation) else -1.0
    return CheckRow(
        joint=joint,
        name=check.name,
        required=required_text(check, shown),
        available=text(check.available),
        unit=printed_unit(shown),
        utilisation=percent(check.utilisation),
        information=f"{text(information)} {printed_unit(shown) if information is not None else ''}".strip()
        if check.utilisation is None
        else "",
        margin=margin,
        time=DASH if check.time is None else f"{number(check.time)} s",
        source=source,
        remark="; ".join(text for text in (in_study_amperes(check), check.remark) if text),
        verdict=str(check.verdict),
        css=CSS[check.verdict],
        share=min(share, 1e9),
        seconds=-1.0 if check.time is None else check.time,
    )


def check_rows(evaluation: Evaluation) -> list[CheckRow]:
    """Every check of every joint and of the supply, in the arm's order."""
    rows = []
    for joint in evaluation.joints.values():
        sources = (joint.drive.motor.source, joint.drive.gear.source, joint.drive.motor.brake.source)
        rows += [check_row(joint.name, check, sources) for check in joint.checks]
    return rows + [check_row(shared_place(check), check) for check in evaluation.shared]


def joint_card(joint: JointResult, colour: str = "") -> JointCard:
    """A joint's verdict as texts."""
    share = 0.0 if joint.binding is None else joint.binding.utilisation or 0.0
    return JointCard(
        joint.name,
        anchor(joint.name),
        str(joint.verdict),
        CSS[joint.verdict],
        joint.motor,
        gear_name(joint.gear),
        identity(joint.drive.motor),
        identity(joint.drive.gear),
        joint_sentence(joint),
        f"{nearness(joint.binding).capitalize()}: {joint_sentence(joint)}.",
        min(share, 1e9),
        colour,
    )


def matrix(evaluation: Evaluation) -> list[tuple[str, list[CheckRow | None]]]:
    """Checks, in the order in which the joints list them, each with its row for every joint."""
    names: dict[str, None] = {}
    for joint in evaluation.joints.values():
        names |= dict.fromkeys(check.name for check in joint.checks)
    found = {(row.joint, row.name): row for row in check_rows(evaluation)}
    return [(name, [found.get((joint, name)) for joint in evaluation.joints]) for name in names]


def part(record: Motor | Gear | Brake) -> Part:
    """A catalogue row: every known number in SI."""
    listed = {Motor: MOTOR_COLUMNS, Gear: GEAR_COLUMNS, Brake: BRAKE_COLUMNS}[type(record)]
    columns = {column.name: column for column in listed}
    known, missing = [], []
    for name in (field.name for field in fields(record) if field.name in columns.keys() - TITLES):
        value, spoken = getattr(record, name), name.replace("_", " ")
        if value is None:
            missing.append(spoken)
        else:
            unit = {"degC": "°C", "C": "°C", "1": ""}.get(columns[name].unit, columns[name].unit)
            known.append((spoken, _cell(value), unit, columns[name].meaning))
    return Part(identity(record) or gear_name(record.key), record.key, record.source, tuple(known), ", ".join(missing))


def used_rows(joint: JointResult, study: Study) -> list[Part]:
    brake = joint.drive.motor.brake
    motor = study.catalog.motors.get(bare_key(joint.drive.motor), joint.drive.motor)
    gear = study.catalog.gears.get(joint.gear, joint.drive.gear)
    return [part(motor), *([part(brake)] if brake.key else []), *([part(gear)] if joint.gear else [])]


def passed_over(tasks: tuple[JointTask, ...]) -> list[tuple[str, tuple[str, ...]]]:
    """Rows that the rules of the study excluded from each table; joints with the same rules are combined."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for task in tasks:
        if task.passed_over:
            groups.setdefault(task.passed_over, []).append(task.name)
    every = len(groups) == 1 and len(tasks) == sum(map(len, groups.values()))
    return [("all joints" if every else ", ".join(names), lines) for lines, names in groups.items()]


def _cell(value: object) -> str:
    """A field's value, digits as they are used."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, int | float) else str(value)


def rejected_counts(
    counts: Mapping[tuple[str, str], int], joints: Iterable[str]
) -> tuple[list[str], list[tuple[str, int, list[int]]]]:
    """The rejecting checks, and joint by joint how many candidates there were and how many each check rejected."""
    totals: Counter[str] = Counter()
    for (_, check), count in counts.items():
        totals[check] += count
    checks = sorted(totals, key=lambda check: (-totals[check], check))
    rows = []
    for joint in joints:
        row = [counts.get((joint, check), 0) for check in checks]
        rows.append((joint, sum(row), row))
    return checks, rows


def nearest_misses(rejected: pd.DataFrame, joint: str, safety: Safety) -> list[tuple[str, ...]]:
    """Rejected candidates near to their limits: motor, gear, check, required, limit, unit, utilisation, objective."""
    factor, rows = factors(safety), list[tuple[str, ...]]()
    own = rejected[rejected["joint"] == joint]
    used = own["utilisation"].to_numpy(dtype=float)
    if len(used) > MOST_SHOWN:
        own = own[used <= np.partition(used, MOST_SHOWN - 1)[MOST_SHOWN - 1]]
    found = [RejectedPair(*values) for values in own[list(COLUMNS)].itertuples(index=False, name=None)]
    for one in sorted(found, key=lambda one: (one.utilisation, one.objective, one.motor, one.gear))[:MOST_SHOWN]:
        check = Check("", one.required, one.available, one.unit, one.utilisation, Verdict.FAIL,
                      factor=factor.get(one.check, 1.0))  # fmt: skip
        shown = common_unit(check)
        available = number(float(convert(one.available, one.unit, shown)), digits_near_limit(one.utilisation))
        rows.append((one.motor, one.gear, one.check, required_text(check, shown), available, printed_unit(shown),
                     percent(one.utilisation), number(one.objective)))  # fmt: skip
    return rows
