"""Whether the fields of an effect hold what their annotations say, told before any law looks at them."""

from __future__ import annotations

import math
import numbers
import sys
from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.errors import LARGEST, Fault, InputError


def type_faults(effect: Any) -> list[Fault]:
    """What is wrong with the kinds of an effect's fields."""
    kind = type(effect)
    module = sys.modules.get(kind.__module__)
    names = vars(module) if module else {}
    faults = []
    for field in fields(effect):
        said = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", str(field.type))
        value = getattr(effect, field.name)
        if not any(_is(value, part.strip(), names) for part in _parts(said)):
            faults.append(Fault(f"{kind.__name__}.{field.name}", f"must be {_wanted(said)}", value))
    return faults


def side_faults(effect: Any) -> list[Fault]:
    """A side that is none."""
    if effect.side in ("joint", "shaft", "motor"):
        return []
    return [Fault(f"{type(effect).__name__}.side", "must be joint, shaft or motor", effect.side)]


def checked_table(time: Any, values: Any, name: str) -> tuple[Array, Array]:
    """Instants and the values that stand at them."""
    instants, found = checked_array(time, (None,), "time"), checked_array(values, (None,), name)
    if len(instants) != len(found) or not len(instants) or (np.diff(instants) < 0.0).any():
        raise InputError(
            Fault("time", f"must be instants that never decrease, one a {name} [s]", instants[:5].tolist())
        )
    return instants, found


def nan_faults(effect: Any) -> list[Fault]:
    """Numbers among the fields that are none, or too large to calculate with: what an effect's own checks let pass."""
    told = [(field.name, getattr(effect, field.name)) for field in fields(effect)]
    return [
        Fault(f"{type(effect).__name__}.{name}", f"must be a number, up to {LARGEST:g} where it is finite", value)
        for name, value in told
        if any(isinstance(one, numbers.Real) and not _usable(float(one)) for one in _inside(value))
    ]


def _usable(value: float) -> bool:
    return math.isinf(value) or abs(value) <= LARGEST


def _inside(value: Any) -> Iterable[Any]:
    return value if isinstance(value, tuple | list) else (value,)


def _parts(said: str) -> list[str]:
    """Alternatives of an annotation; those inside of brackets belong together."""
    return said.split("|") if "[" not in said else [said]


def _wanted(said: str) -> str:
    words = {"float": "a number", "int": "a whole number", "str": "a text", "None": "None", "bool": "True or False"}
    return " or ".join(words.get(part.strip(), part.strip()) for part in _parts(said))


def _is(value: Any, part: str, names: dict[str, Any]) -> bool:
    """Whether a value is of a kind."""
    simple: dict[str, Callable[[Any], bool]] = {
        "float": _number, "int": _whole, "None": lambda one: one is None, "str": lambda one: isinstance(one, str),
        "bool": lambda one: isinstance(one, bool),
    }  # fmt: skip
    if part in simple:
        return simple[part](value)
    if part.startswith("tuple[") and "[" not in part[6:-1]:
        kinds = [one.strip() for one in part[6:-1].split(",")]
        inside = kinds[0]
        if any(one not in (inside, "...") for one in kinds):
            return True
        if isinstance(value, str | dict) or not isinstance(value, Iterable) or getattr(value, "ndim", 1) == 0:
            return False
        return all(_is(one, inside, names) for one in value)
    wanted = names.get(part)
    return isinstance(value, wanted) if isinstance(wanted, type) else True


def _number(value: Any) -> bool:
    """A real number; NaN too, so that it comes together with what else is out of range."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _whole(value: Any) -> bool:
    return _number(value) and math.isfinite(value) and value == int(value)
