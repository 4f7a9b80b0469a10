"""What a study file may say of parts: sheets of its own, and the rules by which parts may drive a joint.

The names are those of the catalogue's columns; every value carries its own unit, and what is unknown is left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import Field, create_model

from drivetrain import units as f
from drivetrain.catalog.read import FramelessRule
from drivetrain.catalog.schema import BRAKE_COLUMNS, CHOICE, GEAR_COLUMNS, MOTOR_COLUMNS, NUMBER, YES_NO, Column
from drivetrain.study.form import Entry, Form, Shaped


def _row(columns: tuple[Column, ...]) -> dict[str, Any]:
    """What a sheet in the study may state: the columns that the catalogue's reader keeps, each value with its unit.

    The key stands before it in the file; a sheet in a study must say where it is from.
    """
    kept = [column for column in columns if not column.lint_only and column.name != "key"]
    return {column.name: _cell(column, column.needed or column.name == "source") for column in kept}


def _cell(column: Column, needed: bool) -> tuple[Any, Any]:
    kind: Any = f.Name
    if column.content == NUMBER:
        kind = Annotated[float, f.Quantity("" if column.unit == "1" else column.unit, column.low, column.high)]
    elif column.content == CHOICE:
        kind = bool if column.choices == YES_NO else Literal[column.choices]
    if needed:
        return kind, Field(description=column.why_needed or column.meaning)
    return kind | None, Field(default=None, description=column.meaning)


def _filter(columns: tuple[Column, ...], *names: str) -> dict[str, Any]:
    """Rules for rows: a range of a number, the words allowed in a text, yes or no; and keys."""
    known = {column.name: column for column in columns}
    return {"keys": (f.Names | None, None)} | {name: (_rule(known[name]) | None, None) for name in names}


def _rule(column: Column) -> Any:
    if column.content == NUMBER:
        return Annotated[f.Interval, f.Between("" if column.unit == "1" else column.unit)]
    return bool if column.choices == YES_NO else f.Names


def _form(title: str, doc: str, entries: dict[str, Any]) -> Any:
    return create_model(title, __base__=Form, __doc__=doc, **entries)


if TYPE_CHECKING:
    MotorRow: TypeAlias = Form
    GearRow: TypeAlias = Form
    BrakeRow: TypeAlias = Form
    MotorFilter: TypeAlias = Form
    GearFilter: TypeAlias = Form
else:
    MotorRow = _form("MotorRow", "A motor's data sheet, with its source.", _row(MOTOR_COLUMNS))
    GearRow = _form("GearRow", "A gear's data sheet, with its source.", _row(GEAR_COLUMNS))
    BrakeRow = _form("BrakeRow", "A holding brake's data sheet, with its source.", _row(BRAKE_COLUMNS))
    MotorFilter = _form(
        "MotorFilter", "Which motors may be considered; every line must hold.",
        _filter(MOTOR_COLUMNS, "maker", "series", "kind", "frameless", "nominal_voltage", "nominal_torque", "mass",
                "diameter", "length"),
    )  # fmt: skip
    GearFilter = _form(
        "GearFilter", "Which gears may be considered; every line must hold.",
        _filter(GEAR_COLUMNS, "maker", "series", "kind", "ratio", "size", "stages", "continuous_torque", "backlash",
                "mass", "diameter", "length"),
    )  # fmt: skip


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
