"""What effects that follow a table over time have in common: the table, where it jumps, and where it bends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects.effect import Effect, Place
from drivetrain.effects.field_types import checked_table
from drivetrain.effects.tables import bends


@dataclass
class Own:
    """What it keeps: nothing; the table has rows (instant [s], value)."""


@dataclass(frozen=True, eq=False)
class OverTime(Effect):
    """One value over time, linear between its instants; two at one instant are a jump.

    Attributes:
        time: Never falling [s], (N,); before the first and after the last the value stays.
        follows: Name of the field that holds the values.
    """

    time: Array

    follows: ClassVar[str] = ""

    def __post_init__(self) -> None:
        time, values = checked_table(self.time, getattr(self, self.follows), self.follows)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, self.follows, values)

    @property
    def values(self) -> Array:
        """What it follows [SI], (N,)."""
        return np.asarray(getattr(self, self.follows))

    def own(self, place: Place) -> Any:
        return Own()

    def table(self, place: Place) -> Array:
        return np.column_stack([self.time, self.values])

    def breakpoints(self) -> Sequence[float]:
        jumps = self.time[1:][self.time[1:] == self.time[:-1]]
        return [float(t) for t in (self.time[0], *np.unique(jumps), self.time[-1])]

    def knots(self, tolerance: float) -> Sequence[float]:
        return bends(self.time, self.values, tolerance)
