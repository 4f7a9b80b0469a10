"""A current command, or a voltage between the motor's terminals, given as a function of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.arrays import Array
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Place, Ports
from drivetrain.effects.laws import table_law
from drivetrain.effects.tables import OverTime, Own, table_value


@table_law(Own)
def _current(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    joint.pin.command += table_value(table, t)


@table_law(Own)
def _voltage(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    joint.pin.voltage = table_value(table, t)


@dataclass(frozen=True, eq=False)
class GivenCurrent(OverTime):
    """Adds a table of current over time to the current command: feed-forward, or a current without a loop.

    Attributes:
        current: Currents at the times of ``time`` [A], (N,); constant before the first and after the last.
    """

    current: Array

    follows = "current"
    compute = _current

    def ports(self, place: Place) -> Ports:
        return Ports(contributes=(s.CURRENT_COMMAND,))


@dataclass(frozen=True, eq=False)
class GivenVoltage(OverTime):
    """Voltage from a table, for example of a motor on a battery, or of a test.

    Attributes:
        voltage: Voltages at the times of ``time`` [V], (N,); constant before the first and after the last.
    """

    voltage: Array

    follows = "voltage"
    compute = _voltage

    def ports(self, place: Place) -> Ports:
        return Ports(provides=(s.VOLTAGE,))
