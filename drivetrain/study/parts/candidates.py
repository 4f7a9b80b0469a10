"""Which motor-gear pairs may drive a joint, and which rule of the study excludes the others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

import numpy as np

from drivetrain.catalog.read import Catalog, FramelessRule, compatible_pairs, fits
from drivetrain.catalog.schema import GEAR_COLUMNS, MOTOR_COLUMNS
from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, bare_key, braked
from drivetrain.errors import nearest
from drivetrain.study.document import Place
from drivetrain.study.faults import Ledger
from drivetrain.study.form import Form, given, made
from drivetrain.study.model import JointTask
from drivetrain.study.parts.rules import CandidatesForm, DriveForm
from drivetrain.units import PURE, Interval

DIRECT_DRIVE = "none"  # gear of a direct drive in study files; its key in results is ""

Pair = tuple[str, str]


def candidate_pairs(
    form: CandidatesForm, catalog: Catalog, ledger: Ledger, place: Place
) -> tuple[tuple[Pair, ...], tuple[str, ...]]:
    """The (motor key, gear key) pairs that may drive a joint, and texts on how many rows each rule excluded.

    The pairs are sorted by combined mass, then by keys; those of unknown mass are last.
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


def with_brakes(
    catalog: Catalog, pairs: Iterable[Pair], brakes: Iterable[Brake]
) -> tuple[tuple[Pair, ...], dict[str, Motor]]:
    """All combinations of the pairs with the brakes, and the motors with brakes by their keys."""
    listed, motors, keys = tuple(pairs), dict[str, Motor](), dict[str, list[str]]()
    for motor in dict.fromkeys(motor for motor, _ in listed):
        rows = [braked(catalog.motors[motor], brake) for brake in brakes]
        keys[motor] = [row.key for row in rows]
        motors |= {row.key: row for row in rows}
    return tuple((key, gear) for motor, gear in listed for key in keys[motor]), motors


def _lightest_first(catalog: Catalog, pairs: list[Pair]) -> tuple[Pair, ...]:
    """Pairs by combined mass, then by keys; rows of unknown mass last."""
    motors = {key: math.inf if row.mass is None else row.mass for key, row in catalog.motors.items()}
    gears = {key: math.inf if row.mass is None else row.mass for key, row in catalog.gears.items()} | {"": 0.0}
    ordered = sorted(pairs)
    masses = np.array([motors[motor] + gears[gear] for motor, gear in ordered])
    return tuple(ordered[i] for i in np.argsort(masses, kind="stable").tolist())


def known_pair(drive: DriveForm, catalog: Catalog, ledger: Ledger, place: Place) -> Pair | None:
    """The keys of a drive that the study names, gear "" for a direct drive; None when one is unknown."""
    gear = "" if drive.gear == DIRECT_DRIVE else drive.gear
    known = drive.motor in catalog.motors and (not gear or gear in catalog.gears)
    if known or ledger.spoiled(("catalogs",)):
        return (drive.motor, gear) if known else None
    written = {table: ledger.document.data.get(table) for table in ("motors", "gears")}  # faulty rows as well
    own = {table: rows if isinstance(rows, dict) else {} for table, rows in written.items()}
    ledger.known((*place, "motor"), "no motor has this key", drive.motor, {**catalog.motors, **own["motors"]})
    if gear and gear not in {*catalog.gears, *own["gears"]}:
        hint = nearest(gear, [*catalog.gears, *own["gears"], DIRECT_DRIVE])
        ledger.fault((*place, "gear"), "no gear has this key", gear, hint)
    return None


def _paired(
    form: CandidatesForm, catalog: Catalog, motors: list[str], gears: list[str], ledger: Ledger, place: Place
) -> list[Pair]:
    if not isinstance(form.pairs, str):
        listed = [known_pair(drive, catalog, ledger, (*place, "pairs", i)) for i, drive in enumerate(form.pairs)]
        return [one for one in dict.fromkeys(listed) if one and one[0] in motors and one[1] in ("", *gears)]
    if form.gears == DIRECT_DRIVE:
        return [(motor, "") for motor in motors]
    if form.pairs == "all":
        return list(product(motors, gears))
    rule = made(form.frameless_rule) if form.pairs == "compatible" else FramelessRule(kinds=())
    return compatible_pairs(catalog, motors, gears, rule)


def _rule_words(form: CandidatesForm, frameless: bool) -> str:
    if not isinstance(form.pairs, str):
        return "are listed in the study"
    if form.gears == DIRECT_DRIVE:
        return "are considered, without a gear"
    if form.pairs == "all":
        return "are considered: the study states that they fit"
    if form.pairs == "published" or not frameless:
        return "are published as fitting"
    rule = made(form.frameless_rule)
    return (
        "are published as fitting, or fit by the rule for frameless motors "
        f"(diameter {rule.min_diameter_ratio:g} to {rule.max_diameter_ratio:g} of the gear's pitch diameter)"
    )


def _kept(
    part: str, rows: Mapping[str, Motor] | Mapping[str, Gear], rules: Form, ledger: Ledger, place: Place
) -> tuple[list[str], str]:
    """Keys of the rows that satisfy all rules, in catalogue order, and a text with the counts."""
    kept = list(rows)
    aside: list[str] = []
    units = {column.name: column.unit for column in (MOTOR_COLUMNS if part == "motors" else GEAR_COLUMNS)}
    for name in type(rules).model_fields:
        if not given(rules, name):
            continue
        wanted = getattr(rules, name)
        if isinstance(wanted, tuple) and wanted and isinstance(wanted[0], str):
            _check_names(name, wanted, rows, ledger, (*place, name))
        held = [key for key in kept if keeps(name, wanted, key, rows[key])]
        if len(held) < len(kept):
            aside.append(f"{len(kept) - len(held)} by '{name}: {limits_in_words(wanted, units.get(name, ''))}'")
        kept = held
    counted = f"{part}: {len(kept)} of {len(rows)} considered"
    return kept, counted + (f"; filtered out {', '.join(aside)}" if aside else "")


def keeps(name: str, wanted: object, key: str, row: Motor | Gear) -> bool:
    """Whether a row satisfies a rule (a range in SI, names, or a bool); a row whose value is unknown does not."""
    value: Any = key if name == "keys" else getattr(row, name)
    if isinstance(wanted, bool):
        return bool(value) is wanted
    if (ends := _range(wanted)) is not None:
        low, high = ends
        return value is not None and (low is None or abs(value) >= low) and (high is None or abs(value) <= high)
    return isinstance(wanted, tuple) and str(value).casefold() in {str(word).casefold() for word in wanted}


def _range(wanted: object) -> Interval | None:
    """The ends of a rule that is a range; None for any other rule."""
    ends = isinstance(wanted, tuple) and len(wanted) == 2 and not any(isinstance(end, str) for end in wanted)
    return wanted if ends else None  # type: ignore[return-value]


def _check_names(
    name: str, wanted: Iterable[str], rows: Mapping[str, Motor] | Mapping[str, Gear], ledger: Ledger, place: Place
) -> None:
    """Report names that no row has as faults, because they would silently exclude all rows."""
    known = set(rows) if name == "keys" else {str(getattr(row, name)) for row in rows.values()}
    folded = {word.casefold() for word in known}
    for word in wanted:
        if word.casefold() not in folded and not ledger.spoiled(("catalogs",)):
            problem = f"no row of the catalogue has this {name.removesuffix('s')}"
            ledger.fault(place, problem, word, nearest(word, known))


def limits_in_words(wanted: object, unit: str) -> str:
    """What a rule (a range in SI, names, or a bool) allows, as text."""
    if (ends := _range(wanted)) is not None:
        (low, high), behind = ends, "" if unit in PURE else f" {unit}"
        if low is None:
            return "any" if high is None else f"at most {high:g}{behind}"
        return f"at least {low:g}{behind}" if high is None else f"{low:g} to {high:g}{behind}"
    return " or ".join(map(str, wanted)) if isinstance(wanted, tuple) else _shown(wanted, unit)


def gears_at(task: JointTask, catalog: Catalog) -> list[str]:
    """Keys of all gears of the catalogue at a joint: combined with its stages, if it has any."""
    if task.staged:
        return [key for own, key in task.staged.items() if own]
    return [key for key, row in catalog.gears.items() if not row.staged]


def motors_at(task: JointTask, catalog: Catalog) -> list[str]:
    """Keys of all motors of the catalogue at a joint: combined with its brakes, if it must have one."""
    brakes = {brake.key for brake in task.brakes} or {""}
    return [key for key, row in catalog.motors.items() if row.brake.key in brakes]


def braked_key(task: JointTask, catalog: Catalog, motor: str) -> str:
    """Key of a motor with the only brake of a joint; the given key if the motor has one, or the joint has several."""
    key = f"{motor}+{task.brakes[0].key}" if len(task.brakes) == 1 else motor
    return key if key in catalog.motors else motor


def excluded_by(task: JointTask, catalog: Catalog, motor: str | None, gear: str | None) -> tuple[str, ...]:
    """The rules of the study by which a part or a pair may not drive a joint, as texts.

    With a key of None only the other part is checked; gear "" is a direct drive.
    """
    if (motor, gear) in task.pairs or (motor, gear) == task.drive:
        return ()
    if task.rules is None:
        return () if task.pairs else (f"the study gives {task.name} its drive and considers no other",)
    words: list[str] = []
    # The rules apply to the motor without brake and to the gear without stages.
    motor = None if motor is None else bare_key(catalog.motors[motor])
    gear = next((own for own, key in task.staged.items() if key == gear), gear)
    if motor is not None:
        words += _broken("motor", motor, catalog.motors[motor], task.rules.motors, MOTOR_COLUMNS)
    if gear == "" and task.rules.gears != DIRECT_DRIVE:
        words.append(f"direct drives are not considered at {task.name}")
    if gear and isinstance(task.rules.gears, str):
        words.append(f"only direct drives are considered at {task.name}")
    elif gear and not isinstance(task.rules.gears, str):
        words += _broken("gear", gear, catalog.gears[gear], task.rules.gears, GEAR_COLUMNS)
    if motor is not None and gear:
        words += _unpaired(task.rules, catalog, motor, gear)
    return tuple(words)


def _broken(what: str, key: str, row: Motor | Gear, rules: Form, columns: tuple[object, ...]) -> list[str]:
    """The rules for rows of one table that a row does not satisfy, as texts."""
    units = {column.name: column.unit for column in columns}  # type: ignore[attr-defined]
    found = []
    for name in type(rules).model_fields:
        wanted = getattr(rules, name)
        if not given(rules, name) or keeps(name, wanted, key, row):
            continue
        unit = units.get(name, "")
        value = key if name == "keys" else getattr(row, name)
        has = "unknown" if value is None else _shown(value, unit)
        found.append(f"{what}s rule '{name}: {limits_in_words(wanted, unit)}': that of {key} is {has}")
    return found


def _shown(value: object, unit: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float | int):
        return f"{value:g} {unit if unit not in PURE else ''}".strip()
    return str(value)


def _unpaired(rules: CandidatesForm, catalog: Catalog, motor: str, gear: str) -> list[str]:
    if not isinstance(rules.pairs, str):
        listed = any((pair.motor, pair.gear) == (motor, gear) for pair in rules.pairs)
        return [] if listed else ["the study lists the pairs that may be used, and this is none of them"]
    if rules.pairs == "all" or gear in catalog.pairs.get(motor, ()):
        return []
    row, wheel = catalog.motors[motor], catalog.gears[gear]
    if rules.pairs == "published" or not row.frameless:
        return [f"{motor} and {gear} are not published as a fitting pair"]
    rule = made(rules.frameless_rule)
    return [] if fits(row, wheel, rule) else [f"{motor} does not fit around {gear}: {_room(row, wheel, rule)}"]


def _room(motor: Motor, gear: Gear, rule: FramelessRule) -> str:
    """Why the geometric rule rejects a frameless motor with a gear."""
    if gear.kind not in rule.kinds:
        return f"a {gear.kind} gear is not built around a frameless motor"
    if motor.diameter is None:
        return "the motor's diameter is unknown"
    if gear.pitch_diameter is None:
        return "the gear's diameters are unknown" if gear.diameter is None else "it is wider than the gear"
    share = motor.diameter / gear.pitch_diameter
    span = f"{rule.min_diameter_ratio:g} to {rule.max_diameter_ratio:g}"
    return f"its diameter is {share:.3g} of the gear's pitch diameter, {span} is allowed"
