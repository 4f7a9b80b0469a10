"""Why a part, or a pair of parts, is not among those that may drive a joint: the rule that put it aside."""

from __future__ import annotations

from drivetrain.catalog.read import Catalog, FramelessRule, fits
from drivetrain.catalog.schema import GEAR_COLUMNS, MOTOR_COLUMNS
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.study.candidates import DIRECT_DRIVE, frameless_rule, keeps, limits_in_words
from drivetrain.study.form import Form
from drivetrain.study.schema_parts import CandidatesForm
from drivetrain.study.study import JointTask
from drivetrain.units import PURE


def put_aside(task: JointTask, catalog: Catalog, motor: str | None, gear: str | None) -> tuple[str, ...]:
    """By which rules of the study a part or a pair may not drive a joint.

    Args:
        motor: Key; None: only the gear is asked after.
        gear: Key, "" for a direct drive; None: only the motor is asked after.
    """
    if (motor, gear) in task.pairs or (motor, gear) == task.drive:
        return ()
    if task.rules is None:
        return () if task.pairs else (f"the study gives {task.name} its drive and considers no other",)
    words: list[str] = []
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
    """The rules for rows of one table that a row does not keep."""
    units = {column.name: column.unit for column in columns}  # type: ignore[attr-defined]
    found = []
    for name in type(rules).model_fields:
        wanted = getattr(rules, name)
        if not rules.given(name) or keeps(name, wanted, key, row):
            continue
        unit = units.get(name, "")
        value = key if name == "keys" else getattr(row, name)
        has = "unknown" if value is None else _shown(value, unit)
        found.append(f"{what}s rule '{name}: {limits_in_words(wanted, unit)}': of {what} {key} it is {has}")
    return found


def _shown(value: object, unit: str) -> str:
    """A value of a row in words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float | int):
        return f"{value:g} {unit if unit not in PURE else ''}".strip()
    return str(value)


def _unpaired(rules: CandidatesForm, catalog: Catalog, motor: str, gear: str) -> list[str]:
    """Why motor and gear may not be put together."""
    if not isinstance(rules.pairs, str):
        listed = any((pair.motor, pair.gear) == (motor, gear) for pair in rules.pairs)
        return [] if listed else ["the study lists the pairs that may be used, and this is none of them"]
    if rules.pairs == "all" or gear in catalog.pairs.get(motor, ()):
        return []
    row, wheel = catalog.motors[motor], catalog.gears[gear]
    if rules.pairs == "published" or not row.frameless:
        return [f"nobody publishes that {motor} and {gear} fit each other"]
    rule = frameless_rule(rules)
    return [] if fits(row, wheel, rule) else [f"{motor} does not fit around {gear}: {_room(row, wheel, rule)}"]


def _room(motor: Motor, gear: Gear, rule: FramelessRule) -> str:
    """What the geometric rule says of a frameless motor and a gear."""
    if gear.kind not in rule.kinds:
        return f"a {gear.kind} gear is not built around a frameless motor"
    if motor.diameter is None:
        return "the motor's diameter is unknown"
    if gear.pitch_diameter is None:
        return "the gear's diameters are unknown" if gear.diameter is None else "it is wider than the gear"
    share = motor.diameter / gear.pitch_diameter
    span = f"{rule.min_diameter_ratio:g} to {rule.max_diameter_ratio:g}"
    return f"its diameter is {share:.3g} of the gear's pitch diameter, {span} is allowed"
