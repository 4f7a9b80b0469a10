"""Tables over time, linear between rows, with a jump where two rows have the same time: for laws and as effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.effects.effect import Effect, Place
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

TINY = 1e-300  # avoids a division by zero [s]


def kinks(time: Array, values: Array, tolerance: float) -> list[float]:
    """Times at which a table has a kink larger than ``tolerance`` times its largest value [s].

    Samples of a smooth function have hardly any. The first and the last time are always included.
    """
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    interpolated = (values[:-2] * after + values[2:] * before) / np.maximum(before + after, TINY)
    deviation = np.abs(values[1:-1] - interpolated) > tolerance * np.abs(values).max()
    inner = time[1:-1][deviation & (before > 0.0) & (after > 0.0)]  # jumps are breakpoints, not knots
    return [float(time[0]), *inner.tolist(), float(time[-1])]


@law
def interval_of(table: Any, t: float) -> int:
    """Index of the last row of a table whose time is not later than t [s]; 0 before the first."""
    low, high = 0, len(table)
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle, 0] <= t:
            low = middle
        else:
            high = middle
    return low


@law
def repeated_time(period: float, last: float, t: float) -> float:
    """The time within a period at time t [s]; t itself if nothing is repeated (period 0), and from ``last`` on."""
    return t - period * np.floor(t / period) if period > 0.0 and t < last else t


@law
def table_value(table: Any, t: float, column: int = 1) -> float:
    """The value in a column of a table at time t [s]; constant before the first and after the last row."""
    low = interval_of(table, t)
    value = table[low, column]
    if low + 1 < len(table):
        begin, end = table[low, 0], table[low + 1, 0]
        if end > begin and t > begin:
            value += (table[low + 1, column] - value) * (t - begin) / (end - begin)
    return value


@dataclass
class Own:
    """Record of the effect, without fields. Table rows: time [s], value."""


@dataclass(frozen=True, eq=False)
class OverTime(Effect):
    """Base of the effects given by one value over time, linear between times; two rows at one time are a jump.

    Attributes:
        time: Times of the rows, not decreasing [s], (N,); before the first and after the last the value is constant.
        follows: Name of the field that holds the values.
    """

    time: Array

    follows: ClassVar[str] = ""

    def __post_init__(self) -> None:
        time, values = checked_array(self.time, (None,), "time"), checked_array(self.values, (None,), self.follows)
        if len(time) != len(values) or not len(time) or (np.diff(time) < 0.0).any():
            problem = f"must be instants that never decrease, one a {self.follows} [s]"
            raise InputError(Fault("time", problem, time[:5].tolist()))
        object.__setattr__(self, "time", time)
        object.__setattr__(self, self.follows, values)

    @property
    def values(self) -> Array:
        """The values at the times of ``time`` [SI], (N,)."""
        found: Array = getattr(self, self.follows)
        return found

    def table(self, place: Place) -> Array:
        return np.column_stack([self.time, self.values])

    def breakpoints(self) -> Sequence[float]:
        jumps = self.time[1:][self.time[1:] == self.time[:-1]]
        return [float(t) for t in (self.time[0], *np.unique(jumps), self.time[-1])]

    def knots(self, tolerance: float) -> Sequence[float]:
        return kinks(self.time, self.values, tolerance)
