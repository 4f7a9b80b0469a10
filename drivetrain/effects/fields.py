"""Checks of an effect's fields: types according to their annotations, and the ranges that the effect states."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from drivetrain.drive.ranges import Range
from drivetrain.errors import LARGEST, Fault

Side = Literal["joint", "shaft", "motor"]


class OrInfinite(Range):
    """A range that includes infinity, which stands for "no limit"."""

    def holds(self, value: float) -> bool:
        return value == math.inf or super().holds(value)


def ranges(**named: Range) -> Mapping[str, Range]:
    """Ranges by the names of fields."""
    return named


def positive(unit: str) -> Range:
    """The range of positive, finite numbers."""
    return Range(f"must be positive [{unit}]", low=0.0)


def positive_or_infinite(unit: str) -> Range:
    """The range of positive numbers, infinity included."""
    return OrInfinite(f"must be positive [{unit}]", low=0.0)


def not_negative(unit: str) -> Range:
    """The range of finite numbers from 0."""
    return Range(f"must not be negative [{unit}]", low=0.0, low_included=True)


def finite(unit: str) -> Range:
    """The range of all finite numbers."""
    return Range(f"must be a finite number [{unit}]")


def kind_faults(effect: Any) -> list[Fault]:
    """Faults of fields whose type does not match their annotation."""
    name, hints = type(effect).__name__, _hints(effect.__class__)
    return [
        Fault(f"{name}.{field.name}", f"must be {_type_words(hints[field.name])}", getattr(effect, field.name))
        for field in fields(effect)
        if not _matches(getattr(effect, field.name), hints[field.name])
    ]


def range_faults(effect: Any) -> list[Fault]:
    """Faults of fields outside their ranges, of NaN and too large numbers, and of words that are no valid choice."""
    faults, hints = [], _hints(effect.__class__)
    for field in fields(effect):
        place, allowed = f"{type(effect).__name__}.{field.name}", effect.limits.get(field.name)
        value, hint = getattr(effect, field.name), hints[field.name]
        if get_origin(hint) is Literal and isinstance(value, str) and value not in get_args(hint):
            *first, last = get_args(hint)
            faults.append(Fault(place, f"must be {', '.join(first)} or {last}", value))
        for one in value if isinstance(value, tuple | list) else (value,):
            if not isinstance(one, numbers.Real) or isinstance(one, bool):
                continue
            if not (math.isinf(one) or abs(float(one)) <= LARGEST):
                faults.append(Fault(place, f"must be a number, up to {LARGEST:g} where it is finite", one))
            elif allowed is not None and not allowed.holds(float(one)):
                faults.append(Fault(place, allowed.words, one))
    return faults


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


_WORDS: dict[Any, str] = {float: "a number", int: "a whole number", str: "a text", NoneType: "None",
                          bool: "True or False"}  # fmt: skip


def _type_words(hint: Any) -> str:
    """What a message says of an expected type."""
    if _is_union(hint):
        return " or ".join(_type_words(part) for part in get_args(hint))
    if get_origin(hint) is Literal:
        return _WORDS[str]
    if get_origin(hint) is tuple:
        first, *others = get_args(hint)
        same = "several, each " if others == [...] else ""
        return same + " with ".join(_type_words(part) for part in (first, *others) if part is not ...)
    return _WORDS.get(hint) or (hint.__name__ if isinstance(hint, type) else str(hint))


def _is_union(hint: Any) -> bool:
    return get_origin(hint) in (Union, UnionType)


def _matches(value: Any, hint: Any) -> bool:
    """Whether a value matches an annotation; NaN does, since it is reported with the faults of the ranges."""
    parts, number = get_args(hint), isinstance(value, numbers.Real) and not isinstance(value, bool)
    if _is_union(hint):
        return any(_matches(value, part) for part in parts)
    if get_origin(hint) is Literal:
        return isinstance(value, str)
    if hint is float:
        return number
    if hint is int:
        return number and math.isfinite(value) and value == int(value)
    if get_origin(hint) is tuple:
        if not isinstance(value, Iterable) or isinstance(value, str | dict) or getattr(value, "ndim", 1) == 0:
            return False
        several = tuple(value)
        kinds = parts[:1] * len(several) if ... in parts else parts
        return len(several) == len(kinds) and all(map(_matches, several, kinds))
    return not isinstance(hint, type) or isinstance(value, hint)
