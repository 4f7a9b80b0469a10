"""Spoils one number of a call, as a slip, a bad file or another program would: the same spoils for the same seed."""

from __future__ import annotations

import copy
import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drivetrain.errors import InputError, PhysicsWarning

NUMBERS: tuple[Any, ...] = (
    math.nan,
    math.inf,
    -math.inf,
    1e308,
    -1e308,
    1e200,
    0.0,
    1e12,
    -1e30,
    1e59,
    1e-200,
    -1e-310,
    1e-30,
)
OTHERS: tuple[Any, ...] = (None, "three", [], [[]], {}, 1 + 2j, np.array("x"))


def spoiled_number(value: float, rng: np.random.Generator) -> Any:
    """What may stand in place of one number."""
    choice = rng.integers(10)
    if choice < 6:
        return NUMBERS[rng.integers(len(NUMBERS))]
    if choice < 8:
        return -value if value else -1.0
    return OTHERS[rng.integers(len(OTHERS))]


def spoiled_array(value: np.ndarray, rng: np.random.Generator) -> Any:
    """What may stand in place of an array: an entry spoiled, or the shape, or the kind."""
    choice = rng.integers(10)
    if choice < 7:
        result = np.array(value, dtype=float)
        result.flat[rng.integers(result.size)] = (*NUMBERS, -1.0)[rng.integers(len(NUMBERS) + 1)]
        return result
    if choice == 7:
        return value[:-1] if value.ndim else value[None]
    if choice == 8:
        return value[None]
    return (*OTHERS, value.astype(complex), [[1.0], [1.0, 2.0]])[rng.integers(len(OTHERS) + 2)]


def spoiled(value: Any, rng: np.random.Generator) -> Any:
    """A value with one thing wrong somewhere in it."""
    if isinstance(value, np.ndarray):
        return spoiled_array(value, rng)
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return value
    if isinstance(value, (int, float)):
        return spoiled_number(float(value), rng)
    if isinstance(value, Mapping) and value:
        result = dict(value)
        key = list(result)[rng.integers(len(result))]
        return {**result, key: spoiled(result[key], rng)}
    if isinstance(value, (list, tuple)) and value:
        parts = list(value)
        place = rng.integers(len(parts))
        parts[place] = spoiled(parts[place], rng)
        return type(value)(parts)
    return value


def spoiled_call(arguments: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Arguments with one of them spoiled, sometimes two."""
    result = {name: copy.copy(value) for name, value in arguments.items()}
    several = min(len(result), 1 + int(rng.random() < 0.2))
    for name in rng.choice(list(result), several, replace=False):
        result[name] = spoiled(result[name], rng)
    return result


def holds_nan(value: Any, depth: int = 0) -> bool:
    """Whether a NaN stands anywhere in a result."""
    if depth > 6 or value is None or isinstance(value, (str, bytes, bool, int)):
        return False
    if isinstance(value, float):
        return math.isnan(value)
    if isinstance(value, np.ndarray):
        return value.dtype.kind == "f" and bool(np.isnan(value).any())
    if isinstance(value, Mapping) and value:
        return any(holds_nan(part, depth + 1) for part in value.values())
    if isinstance(value, (list, tuple)):
        return any(holds_nan(part, depth + 1) for part in value)
    if dataclasses.is_dataclass(value):
        return any(holds_nan(getattr(value, field.name), depth + 1) for field in dataclasses.fields(value))
    return False


def verdict(call: Callable[[], Any]) -> str:
    """``refused``, ``answered``, or what is wrong: a NaN that comes out, or another exception than InputError."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", PhysicsWarning)
        try:
            result = call()
        except InputError as error:
            return "refused" if str(error) else "an error without words"
        except Exception as error:  # the point of the test
            return f"{type(error).__name__}: {str(error)[:200]}"
    return "a NaN comes out" if holds_nan(result) else "answered"
