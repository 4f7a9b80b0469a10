"""Motors and gears written into the study file itself: sheets that no catalogue has, each with its source.

The names are those of the catalogue's columns; every value carries its own unit, and what is unknown is left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model

from drivetrain.catalog.schema import CHOICE, GEAR_COLUMNS, MOTOR_COLUMNS, NUMBER, YES_NO, Column
from drivetrain.study import fields as f
from drivetrain.study.form import Form


def _row_form(title: str, doc: str, columns: tuple[Column, ...]) -> type[Form]:
    """A form whose names are the columns that the catalogue's reader keeps; the key stands before it in the file."""
    kept = [column for column in columns if not column.lint_only and column.name != "key"]
    names: dict[str, Any] = {column.name: _field(column) for column in kept}
    return create_model(title, __base__=Form, __doc__=doc, **names)


def _field(column: Column) -> tuple[Any, Any]:
    """Type and default of one column; a sheet in a study must say where it is from."""
    needed = column.needed or column.name == "source"
    kind: Any = f.Name
    if column.content == NUMBER:
        kind = Annotated[float, f.Quantity("" if column.unit == "1" else column.unit, column.low, column.high)]
    elif column.content == CHOICE:
        kind = bool if column.choices == YES_NO else Literal[column.choices]
    if needed:
        return kind, Field(description=column.why_needed or column.meaning)
    return kind | None, Field(default=None, description=column.meaning)


if TYPE_CHECKING:
    MotorRow = Form
    GearRow = Form
else:
    MotorRow = _row_form("MotorRow", "A motor's sheet, with its source.", MOTOR_COLUMNS)
    GearRow = _row_form("GearRow", "A gear's sheet, with its source.", GEAR_COLUMNS)
