"""A voltage between the motor's terminals given over time: a motor at a battery, or a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports
from drivetrain.effects.field_types import checked_table
from drivetrain.effects.tables import bends, table_numbers, table_value

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {"effects/tables.py": 3375627061}


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        signals[words[row + 1]] = table_value(numbers, words[row], t)


@dataclass(frozen=True, eq=False)
class GivenVoltage(Effect):
    """The voltage follows a table, linear between its instants; two at one instant are a jump.

    Attributes:
        time: Never falling [s], (N,); before the first and after the last the voltage stays.
        voltage: [V], (N,).
    """

    time: Array
    voltage: Array

    compute = _compute

    def __post_init__(self) -> None:
        time, voltage = checked_table(self.time, self.voltage, "voltage")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "voltage", voltage)

    def ports(self, place: Place) -> Ports:
        """Gives the voltage.

        Args:
            place: Where it stands.

        Returns:
            Its ports.
        """
        return Ports(gives=(s.VOLTAGE,))

    def numbers(self, place: Place) -> Sequence[float]:
        """The table.

        Args:
            place: Where it stands.

        Returns:
            Its length, instants [s], voltages [V].
        """
        return table_numbers(self.time, self.voltage)

    def breakpoints(self) -> Sequence[float]:
        """Where the table jumps.

        Returns:
            Instants at which two entries stand [s], the first and the last.
        """
        jumps = self.time[1:][np.diff(self.time) == 0.0]
        return [float(t) for t in (self.time[0], *np.unique(jumps), self.time[-1])]

    def knots(self, tolerance: float) -> Sequence[float]:
        """Where the table bends.

        Args:
            tolerance: Share of the largest value that does not matter [-].

        Returns:
            Instants [s].
        """
        return bends(self.time, self.voltage, tolerance)
