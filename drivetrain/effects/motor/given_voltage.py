"""A voltage between the motor's terminals given over time: a motor at a battery, or a test."""

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
    joint.pin.voltage = table_value(table, t)


@dataclass(frozen=True, eq=False)
class GivenVoltage(OverTime):
    """The voltage follows a table, linear between its instants; two at one instant are a jump.

    Attributes:
        voltage: At the instants of ``time``, before the first and after the last as there [V], (N,).
    """

    voltage: Array

    follows = "voltage"
    compute = _compute

    def ports(self, place: Place) -> Ports:
        return Ports(provides=(s.VOLTAGE,))
