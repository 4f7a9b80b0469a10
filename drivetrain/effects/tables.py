"""Tables over time inside compiled laws: linear between instants, jumping where two stand at one."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law

TINY = 1e-300  # [s]


def bends(time: Array, values: Array, tolerance: float) -> list[float]:
    """Where a table bends so much that a step across would be off; samples of what is smooth hardly do."""
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    straight = (values[:-2] * after + values[2:] * before) / np.maximum(before + after, TINY)
    off = np.abs(values[1:-1] - straight) > tolerance * np.abs(values).max()
    inner = time[1:-1][off & (before > 0.0) & (after > 0.0)]  # where two stand at one instant it jumps: a breakpoint
    return [float(time[0]), *inner.tolist(), float(time[-1])]


@law
def interval_of(table: Any, t: float) -> int:
    """The last row of a table that is not later than an instant [s]; of two at one instant the second."""
    low, high = 0, len(table)
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] <= t:
            low = middle
        else:
            high = middle
    return low


@law
def table_value(table: Any, t: float) -> float:
    """The value of a table at an instant [s]; before the first and after the last it stays."""
    low = interval_of(table, t)
    value = table[low, 1]
    if low + 1 < len(table):
        begin, end = table[low, 0], table[low + 1, 0]
        if end > begin and t > begin:
            value += (table[low + 1, 1] - value) * (t - begin) / (end - begin)
    return value
