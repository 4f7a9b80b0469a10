"""Numbers of a description as a numpy record, for compiled code: ``motor.resistance``, and NaN where nobody knows.

A description is a frozen dataclass. Its record has a float for every number and a record for every dataclass in it,
under the same names; texts stay outside. A law takes either, as long as it does not compute with what is None.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, get_type_hints

import numpy as np

from drivetrain.jit import law

UNKNOWN = math.nan
_NUMBERS = (float, float | None, int, int | None)


@law
def known(value: Any) -> Any:
    """Whether somebody says it."""
    return not (value is None or math.isnan(value))


@law
def known_or(value: Any, otherwise: Any) -> Any:
    """The value, or what stands for it where it is unknown."""
    return value if known(value) else otherwise


@cache
def record_type(described: type) -> Any:
    """The record of a dataclass."""
    hints, columns = get_type_hints(described), []
    for field in fields(described):
        hint = hints[field.name]
        if is_dataclass(hint):
            columns.append((field.name, record_type(hint)))  # type: ignore[arg-type]
        elif hint in _NUMBERS:
            columns.append((field.name, np.dtype(np.float64)))
    return np.dtype((np.record, columns))


def as_record(values: Any) -> Any:
    """A description as a record."""
    return as_records([values])[0]


def as_records(values: Sequence[Any], described: type | None = None) -> Any:
    """Descriptions of one kind as an array of records, (len(values),); the kind is needed where there may be none."""
    records = np.zeros(len(values), record_type(described or type(values[0])))
    _fill(records, values)
    return records


def _fill(records: Any, values: Sequence[Any]) -> None:
    for name in records.dtype.names:
        column = [getattr(one, name) for one in values]
        if records.dtype[name].names:
            _fill(records[name], column)
        else:
            records[name] = np.array(column, dtype=np.float64)  # None becomes NaN


def columns(dtype: Any, prefix: str = "") -> dict[str, int]:
    """Place of every number of a record among its floats, by its full name such as ``motor.resistance``."""
    found: dict[str, int] = {}
    for name in dtype.names or ():
        inner, offset = dtype.fields[name][:2]
        below = columns(inner, f"{prefix}{name}.") if inner.names else {f"{prefix}{name}": 0}
        found |= {full: offset // 8 + place for full, place in below.items()}
    return found


def as_numbers(records: Any) -> Any:
    """The same memory as plain floats, one row a record."""
    return records.view(np.float64).reshape(len(records), records.dtype.itemsize // 8)
