"""What a joint's angle alone does to its link: springs on levers, gas springs, biases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.counterbalance import Counterbalance, lever_torque
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal
from drivetrain.effects.laws import table_law
from drivetrain.effects.tables import table_value


@dataclass
class Own:
    """What it keeps: the numbers of ``Counterbalance``, its power [W]; the table has rows (angle [rad], torque)."""

    stiffness: float
    free_length: float
    gas_force: float
    extended_length: float
    stroke: float
    progression: float
    exponent: float
    lever_carrier: float
    lever_link: float
    dead_centre: float
    torque: float
    power: float = 0.0


@table_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    joint.load.torque += lever_torque(own, joint.load.position) + table_value(table, joint.load.position)


@table_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any, table: Any) -> None:
    torque = lever_torque(own, joint.load.position) + table_value(table, joint.load.position)
    own.power = torque * joint.load.speed


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
        power = Signal(f"counterbalance_{self.number}_power", "W", path="power")
        return Ports(
            needs=(s.POSITION, s.SPEED),
            contributes=(s.JOINT_TORQUE,),
            outputs=(power,),
            powers={power.name: Role.SOURCE},
        )

    def own(self, place: Place) -> Own:
        one = self.balance
        return Own(
            one.stiffness, one.free_length, one.gas_force, one.extended_length, one.stroke, one.progression,
            one.exponent, one.lever_carrier, one.lever_link, one.dead_centre, one.torque,
        )  # fmt: skip

    def table(self, place: Place) -> Array:
        one = self.balance
        return np.column_stack([one.angles, one.torques]) if one.angles else np.zeros((1, 2))
