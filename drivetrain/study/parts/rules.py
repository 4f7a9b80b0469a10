"""The forms of parts in a study file: its own data sheets, and the rules that select candidates for a joint.

The names are those of the catalogue's columns; every value has its own unit, and unknown values are omitted.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from drivetrain import units as f
from drivetrain.catalog.read import FramelessRule
from drivetrain.catalog.schema import BRAKE_COLUMNS, CHOICE, GEAR_COLUMNS, MOTOR_COLUMNS, NUMBER, YES_NO, Column
from drivetrain.study.form import Entry, Form, Shaped


def _row(columns: tuple[Column, ...]) -> type[Form]:
    """Form of a data sheet with the columns of a catalogue table except the key; ``source`` is required."""
    kept = [column for column in columns if not column.lint_only and column.name != "key"]
    cells: dict[str, Any] = {one.name: _cell(one, one.needed or one.name == "source") for one in kept}
    return create_model("Row", __base__=Form, **cells)


def _cell(column: Column, needed: bool) -> tuple[Any, Any]:
    kind: Any = f.Name
    if column.content == NUMBER:
        kind = Annotated[float, f.Quantity("" if column.unit == "1" else column.unit, column.low, column.high)]
    elif column.content == CHOICE:
        kind = bool if column.choices == YES_NO else Literal[column.choices]
    if needed:
        return kind, Field(description=column.why_needed or column.meaning)
    return kind | None, Field(default=None, description=column.meaning)


def _filter(columns: tuple[Column, ...], *names: str) -> type[Form]:
    """Form of rules for the rows of a table: ranges of numbers, allowed texts, booleans; and keys."""
    known = {column.name: column for column in columns}
    rules: dict[str, Any] = {name: (_rule(known[name]) | None, None) for name in names}
    return create_model("Filter", __base__=Form, keys=(f.Names | None, None), **rules)


def _rule(column: Column) -> Any:
    if column.content == NUMBER:
        return Annotated[f.Interval, f.Between("" if column.unit == "1" else column.unit)]
    return bool if column.choices == YES_NO else f.Names


class MotorRow(_row(MOTOR_COLUMNS)):  # type: ignore[misc]
    """A motor's data sheet, with its source."""


class GearRow(_row(GEAR_COLUMNS)):  # type: ignore[misc]
    """A gear's data sheet, with its source."""


class BrakeRow(_row(BRAKE_COLUMNS)):  # type: ignore[misc]
    """A holding brake's data sheet, with its source."""


_BOTH = ("mass", "price", "diameter", "length")
_MOTOR_RULES = ("maker", "series", "kind", "frameless", "nominal_voltage", "nominal_torque", *_BOTH)
_GEAR_RULES = ("maker", "series", "kind", "ratio", "size", "stages", "continuous_torque", "backlash", *_BOTH)


class MotorFilter(_filter(MOTOR_COLUMNS, *_MOTOR_RULES)):  # type: ignore[misc]
    """Rules for the motors that may be considered; a motor must satisfy all of them."""


class GearFilter(_filter(GEAR_COLUMNS, *_GEAR_RULES)):  # type: ignore[misc]
    """Rules for the gears that may be considered; a gear must satisfy all of them."""


class DriveForm(Form):
    """A given drive: keys of the catalogue or of the file's own rows; gear: none is a direct drive."""

    motor: f.Name
    gear: f.Name


class CandidatesForm(Form):
    """Which motors and gears may drive a joint, and how they are paired; gears: none are direct drives."""

    motors: MotorFilter = MotorFilter()
    gears: Annotated[GearFilter | Literal["none"], Shaped(str)] = GearFilter()
    pairs: Annotated[Literal["compatible", "published", "all"] | list[DriveForm], Shaped(list)] = "compatible"
    frameless_rule: Entry[FramelessRule] = FramelessRule()
