"""Tables over time inside compiled laws: linear between instants, jumping where two stand at one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law

TINY = 1e-300  # [s]


def table_numbers(time: Array, values: Array) -> Sequence[float]:
    """A table as constants of a law.

    Args:
        time: Never falling [s], (N,).
        values: In their own unit, (N,).
    """
    return [float(len(time)), *(float(t) for t in time), *(float(value) for value in values)]


def bends(time: Array, values: Array, tolerance: float) -> list[float]:
    """Where a table bends so much that a step across would be off; samples of what is smooth hardly do.

    Args:
        time: Never falling [s], (N,).
        values: In their own unit, (N,).
        tolerance: How far a value may lie off the straight line between its neighbours, as a share of the largest [-].

    Returns:
        Instants, the first and the last among them [s].
    """
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    straight = (values[:-2] * after + values[2:] * before) / np.maximum(before + after, TINY)
    off = np.abs(values[1:-1] - straight) > tolerance * np.abs(values).max()
    inner = time[1:-1][off & (before > 0.0) & (after > 0.0)]  # where two stand at one instant it jumps: a breakpoint
    return [float(time[0]), *inner.tolist(), float(time[-1])]


@law
def interval_of(numbers: Any, at: int, size: int, t: float) -> int:
    """The last instant of a table that is not later; of two at one instant the second.

    Args:
        t: [s].
    """
    low, high = 0, size
    while high - low > 1:
        middle = (low + high) // 2
        if numbers[at + middle] <= t:
            low = middle
        else:
            high = middle
    return low


@law
def table_value(numbers: Any, at: int, t: float) -> float:
    """The value of a table at an instant; before the first and after the last it stays.

    Args:
        t: [s].
    """
    size = int(numbers[at])
    low = interval_of(numbers, at + 1, size, t)
    value = numbers[at + 1 + size + low]
    if low + 1 < size:
        begin, end = numbers[at + 1 + low], numbers[at + 2 + low]
        if end > begin and t > begin:
            value += (numbers[at + 2 + size + low] - value) * (t - begin) / (end - begin)
    return value
