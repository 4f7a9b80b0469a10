"""A current command given over time: feed-forward, or a current without any loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Place, Ports
from drivetrain.effects.laws import table_law
from drivetrain.effects.over_time import OverTime, Own
from drivetrain.effects.tables import table_value


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    joint.pin.command += table_value(table, t)


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
