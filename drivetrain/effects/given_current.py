"""A current command given over time: feed-forward, or a current without any loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Place, Ports
from drivetrain.effects.over_time import OverTime
from drivetrain.effects.tables import table_value


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        signals[words[row + 1]] += table_value(numbers, words[row], t)


@dataclass(frozen=True, eq=False)
class GivenCurrent(OverTime):
    """Adds a table to the current command, linear between its instants; two at one instant are a jump.

    Attributes:
        current: At the instants of ``time``, before the first and after the last as there [A], (N,).
    """

    current: Array

    follows = "current"
    compute = _compute

    def ports(self, place: Place) -> Ports:
        return Ports(contributes=(s.CURRENT_COMMAND,))
