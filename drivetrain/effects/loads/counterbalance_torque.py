"""Torque of a counterbalance, which depends on the joint angle only: springs on levers, gas springs, tables."""

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
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law


@dataclass
class Own:
    """Record of the effect: the counterbalance, its power [W]. Table rows: angle [rad], torque [N m]."""

    balance: Counterbalance
    power: float = 0.0


@law
def _torque(own: Any, table: Any, angle: float) -> float:
    """Torque at an angle: that of the lever plus that of the table [N m]."""
    return lever_torque(own.balance, angle) + table_value(table, angle)


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    joint.load.torque += _torque(own, table, joint.load.position)


@table_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    own.power = _torque(own, table, joint.load.position) * joint.load.speed


@dataclass(frozen=True)
class CounterbalanceTorque(Effect):
    """The torque of a counterbalance on the link after the joint; its mass belongs to the arm.

    Attributes:
        balance: Data of the counterbalance.
        number: Its number among those of the joint, for the name of its power.
    """

    balance: Counterbalance
    number: int = 1

    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        if not place.turning[place.joint]:
            hint = "GivenTorque is a constant force too"
            raise InputError(Fault("CounterbalanceTorque", "acts at revolute joints only", place.name, hint))
        power = s.source(f"counterbalance_{self.number}_power")
        return Ports(needs=(s.POSITION, s.SPEED), contributes=(s.JOINT_TORQUE,), outputs=(power,))

    def table(self, place: Place) -> Array:
        one = self.balance
        return np.column_stack([one.angles, one.torques]) if one.angles else np.zeros((1, 2))
