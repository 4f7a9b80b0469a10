"""What a joint's angle alone does to its link: springs on levers, gas springs, biases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.counterbalance import Counterbalance, lever_torque
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.laws import table_law
from drivetrain.effects.tables import table_value
from drivetrain.jit import law


@dataclass
class Own:
    """What it keeps: the counterbalance, its power [W]; the table has rows (angle [rad], torque)."""

    balance: Counterbalance
    power: float = 0.0


@law
def _torque(own: Any, table: Any, angle: float) -> float:
    return lever_torque(own.balance, angle) + table_value(table, angle)


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    joint.load.torque += _torque(own, table, joint.load.position)


@table_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    own.power = _torque(own, table, joint.load.position) * joint.load.speed


@dataclass(frozen=True)
class CounterbalanceTorque(Effect):
    """The torque of a counterbalance on the link behind the joint; its mass is the arm's.

    Attributes:
        balance: What it is.
        number: Which of the joint's it is.
    """

    balance: Counterbalance
    number: int = 1

    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        power = s.source(f"counterbalance_{self.number}_power")
        return Ports(needs=(s.POSITION, s.SPEED), contributes=(s.JOINT_TORQUE,), outputs=(power,))

    def table(self, place: Place) -> Array:
        one = self.balance
        return np.column_stack([one.angles, one.torques]) if one.angles else np.zeros((1, 2))
