"""Which motor-gear pairs may drive a joint, and how many rows each rule of the study put aside."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from drivetrain.catalog.read import Catalog, FramelessRule, compatible_pairs
from drivetrain.catalog.schema import GEAR_COLUMNS, MOTOR_COLUMNS
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import nearest
from drivetrain.study.document import Place
from drivetrain.study.fields import Interval
from drivetrain.study.form import Form
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema_parts import CandidatesForm, DriveForm
from drivetrain.units import PURE

DIRECT_DRIVE = "none"  # what a study calls the gear of a direct drive; its key in results is ""

Pair = tuple[str, str]


def candidate_pairs(
    form: CandidatesForm, catalog: Catalog, ledger: Ledger, place: Place
) -> tuple[tuple[Pair, ...], tuple[str, ...]]:
    """The pairs that may drive a joint, lightest first, and what was put aside.

    Returns:
        (motor key, gear key) by combined mass, then by keys, rows of unknown mass last; and in words how many rows
        each rule put aside.
    """
    motors, motor_words = _kept("motors", catalog.motors, form.motors, ledger, (*place, "motors"))
    words = [motor_words]
    gears: list[str] = []
    if not isinstance(form.gears, str):
        gears, gear_words = _kept("gears", catalog.gears, form.gears, ledger, (*place, "gears"))
        words.append(gear_words)
    pairs = _paired(form, catalog, motors, gears, ledger, place)
    frameless = any(catalog.motors[key].frameless for key in motors)
    possible = len(motors) * (1 if form.gears == DIRECT_DRIVE else len(gears))
    words.append(f"pairs: {len(pairs)} of {possible} combinations {_rule_words(form, frameless)}")
    return _lightest_first(catalog, pairs), tuple(words)


def _lightest_first(catalog: Catalog, pairs: list[Pair]) -> tuple[Pair, ...]:
    """Pairs by combined mass, then by keys; rows of unknown mass last."""
    motors = {key: math.inf if row.mass is None else row.mass for key, row in catalog.motors.items()}
    gears = {key: math.inf if row.mass is None else row.mass for key, row in catalog.gears.items()} | {"": 0.0}
    ordered = sorted(pairs)
    masses = np.array([motors[motor] + gears[gear] for motor, gear in ordered])
    return tuple(ordered[i] for i in np.argsort(masses, kind="stable").tolist())


def frameless_rule(form: CandidatesForm) -> FramelessRule:
    """The geometric rule with the study's changes."""
    return replace(FramelessRule(), **form.frameless_rule.model_dump(exclude_none=True))


def known_pair(drive: DriveForm, catalog: Catalog, ledger: Ledger, place: Place) -> Pair | None:
    """The keys of a drive that the study names, when the catalogue has them.

    Returns:
        (motor key, gear key), gear "" for a direct drive; None when one is unknown.
    """
    gear = "" if drive.gear == DIRECT_DRIVE else drive.gear
    known = drive.motor in catalog.motors and (not gear or gear in catalog.gears)
    if known or ledger.spoiled(("catalogs",)):
        return (drive.motor, gear) if known else None
    written = {table: ledger.document.data.get(table) for table in ("motors", "gears")}  # faulty rows as well
    own = {table: rows if isinstance(rows, dict) else {} for table, rows in written.items()}
    if drive.motor not in {*catalog.motors, *own["motors"]}:
        hint = nearest(drive.motor, [*catalog.motors, *own["motors"]])
        ledger.fault((*place, "motor"), "no motor has this key", drive.motor, hint)
    if gear and gear not in {*catalog.gears, *own["gears"]}:
        hint = nearest(gear, [*catalog.gears, *own["gears"], DIRECT_DRIVE])
        ledger.fault((*place, "gear"), "no gear has this key", gear, hint)
    return None


def _paired(
    form: CandidatesForm, catalog: Catalog, motors: list[str], gears: list[str], ledger: Ledger, place: Place
) -> list[Pair]:
    """The pairs of the rows that were kept."""
    if not isinstance(form.pairs, str):
        listed = [known_pair(drive, catalog, ledger, (*place, "pairs", i)) for i, drive in enumerate(form.pairs)]
        return [
            pair for pair in dict.fromkeys(listed) if pair and pair[0] in motors and (not pair[1] or pair[1] in gears)
        ]
    if form.gears == DIRECT_DRIVE:
        return [(motor, "") for motor in motors]
    if form.pairs == "all":
        return list(product(motors, gears))
    rule = frameless_rule(form) if form.pairs == "compatible" else FramelessRule(kinds=())
    return compatible_pairs(catalog, motors, gears, rule)


def _rule_words(form: CandidatesForm, frameless: bool) -> str:
    if not isinstance(form.pairs, str):
        return "are listed in the study"
    if form.gears == DIRECT_DRIVE:
        return "are considered, as direct drives"
    if form.pairs == "all":
        return "are considered: the study vouches that they fit"
    if form.pairs == "published" or not frameless:
        return "are published as fitting"
    rule = frameless_rule(form)
    return (
        "are published as fitting, or fit by the rule for frameless motors "
        f"(diameter {rule.min_diameter_ratio:g} to {rule.max_diameter_ratio:g} of the gear's pitch diameter)"
    )


def _kept(
    part: str, rows: Mapping[str, Motor] | Mapping[str, Gear], rules: Form, ledger: Ledger, place: Place
) -> tuple[list[str], str]:
    """Keys of the rows that every rule keeps, in catalogue order; and the count in words."""
    kept = list(rows)
    aside: list[str] = []
    units = {column.name: column.unit for column in (MOTOR_COLUMNS if part == "motors" else GEAR_COLUMNS)}
    for name in type(rules).model_fields:
        if not rules.given(name):
            continue
        wanted = getattr(rules, name)
        if isinstance(wanted, tuple) and wanted and isinstance(wanted[0], str):
            _check_names(name, wanted, rows, ledger, (*place, name))
        held = [key for key in kept if keeps(name, wanted, key, rows[key])]
        if len(held) < len(kept):
            aside.append(f"{len(kept) - len(held)} by '{name}: {limits_in_words(wanted, units.get(name, ''))}'")
        kept = held
    counted = f"{part}: {len(kept)} of {len(rows)} considered"
    return kept, counted + (f"; put aside {', '.join(aside)}" if aside else "")


def keeps(name: str, wanted: object, key: str, row: Motor | Gear) -> bool:
    """Whether a row keeps one rule; a row whose value is unknown does not.

    Args:
        wanted: What the study allows there: a range in SI, names, or yes and no.
    """
    value: Any = key if name == "keys" else getattr(row, name)
    if isinstance(wanted, bool):
        return bool(value) is wanted
    if isinstance(wanted, tuple) and len(wanted) == 2 and not any(isinstance(end, str) for end in wanted):
        return value is not None and _inside(abs(value), wanted)
    return isinstance(wanted, tuple) and str(value).casefold() in {str(word).casefold() for word in wanted}


def _inside(value: float, interval: Interval) -> bool:
    low, high = interval
    return (low is None or value >= low) and (high is None or value <= high)


def _check_names(
    name: str, wanted: Iterable[str], rows: Mapping[str, Motor] | Mapping[str, Gear], ledger: Ledger, place: Place
) -> None:
    """Names that no row has are faults: they would silently put everything aside."""
    known = set(rows) if name == "keys" else {str(getattr(row, name)) for row in rows.values()}
    folded = {word.casefold() for word in known}
    for word in wanted:
        if word.casefold() not in folded and not ledger.spoiled(("catalogs",)):
            ledger.fault(
                place, f"no row of the catalogue has this {name.removesuffix('s')}", word, nearest(word, known)
            )


def limits_in_words(wanted: object, unit: str) -> str:
    """What a rule allows, as words.

    Args:
        wanted: A range in SI, names, or yes and no.
    """
    if isinstance(wanted, bool):
        return "yes" if wanted else "no"
    if isinstance(wanted, tuple) and len(wanted) == 2 and not any(isinstance(end, str) for end in wanted):
        low, high = ("open" if end is None else f"{end:g}" for end in wanted)
        return f"{low} to {high} {unit if unit not in PURE else ''}".strip()
    return " or ".join(map(str, wanted)) if isinstance(wanted, tuple) else str(wanted)
