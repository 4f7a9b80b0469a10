"""Numbers of a dataclass as a numpy record for compiled code, such as ``motor.resistance``; NaN if unknown.

The record of a dataclass has the same field names: eight bytes for every number, a record for every dataclass and a row
for every array in it; texts are left out. A law accepts either, as long as it does not compute with a value of None.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np

from drivetrain.jit import law

UNKNOWN = math.nan
_NUMBERS = (float, float | None, int | None)


@law
def known(value: Any) -> Any:
    """Whether a value is given: neither None nor NaN."""
    return not (value is None or math.isnan(value))


@law
def known_or(value: Any, otherwise: Any) -> Any:
    """The value, or ``otherwise`` if it is unknown."""
    return value if known(value) else otherwise


@cache
def record_type(described: type, whole: Any = np.float64) -> Any:
    """The record type of a dataclass; ``whole`` is the type of integers.

    Arrays must state their lengths, such as ``Annotated[Array, 3]``.
    """
    hints, annotated, columns = get_type_hints(described), get_type_hints(described, include_extras=True), []
    for name in (field.name for field in fields(described)):
        hint = hints[name]
        if is_dataclass(hint):
            columns.append((name, record_type(hint, whole)))  # type: ignore[arg-type]
        elif hint is int or hint in _NUMBERS:
            columns.append((name, np.dtype(whole if hint is int else np.float64)))
        elif get_origin(annotated[name]) is Annotated:
            columns.append((name, np.dtype((np.float64, (get_args(annotated[name])[1],)))))
    return np.dtype((np.record, columns))


def as_record(values: Any) -> Any:
    return as_records([values])[0]


def as_records(values: Sequence[Any], described: type | None = None) -> Any:
    """Dataclass objects of one type as an array of records, (len(values),); the type is needed if there may be none."""
    records = np.zeros(len(values), record_type(described or type(values[0])))
    fill(records, values, records.dtype.names)
    return records


def fill(records: Any, values: Sequence[Any], names: Sequence[str]) -> None:
    """Copy the fields ``names`` of dataclass objects to records; None becomes NaN."""
    if not names:  # numpy would take an empty list as all fields
        return
    some = records if tuple(names) == records.dtype.names else records[list(names)]
    wanted = _names_of(some.dtype)
    some[:] = [_numbers_of(one, wanted) for one in values]


@cache
def _names_of(dtype: Any) -> Any:
    """The field names of a record type, each with those of the record in it; None for a number."""
    return tuple((name, _names_of(dtype[name])) for name in dtype.names) if dtype.names else None


def _numbers_of(value: Any, wanted: Any) -> Any:
    """Values of the fields ``wanted`` as nested tuples, from which numpy fills a record at once."""
    return tuple([
        getattr(value, name) if inner is None else _numbers_of(getattr(value, name), inner) for name, inner in wanted
    ])  # fmt: skip


def columns(dtype: Any, prefix: str = "") -> dict[str, int]:
    """Index of every number of a record among its floats, by full name such as ``motor.resistance``."""
    found: dict[str, int] = {}
    for name in dtype.names or ():
        inner, offset = dtype.fields[name][:2]
        below = columns(inner, f"{prefix}{name}.") if inner.names else {f"{prefix}{name}": 0}
        found |= {full: offset // 8 + place for full, place in below.items()}
    return found


def as_numbers(records: Any) -> Any:
    """The same memory as plain floats, one row per record."""
    return records.view(np.float64).reshape(len(records), records.dtype.itemsize // 8)


def copied(records: Any) -> Any:
    """A copy; numpy copies records field by field, which takes ten times as long."""
    return as_numbers(records).copy().view(records.dtype).reshape(len(records))
