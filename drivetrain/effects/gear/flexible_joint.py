"""A joint that gives way: the gear's spring in three pieces with damping, and the rotor moving on its own behind it.

The twist is a state of its own, never the difference of two large angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.gear import Gear
from drivetrain.drive.spring import Spring, answer, gear_spring, mean_touch, twist_under
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Role, Shape, Signal
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault, InputError


@dataclass
class Own:
    """What it keeps: the spring, its damping [N m s/rad]; energy [J], power lost [W]."""

    spring: Spring
    damping: float
    energy: float = 0.0
    power: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    gear = joint.spring
    if h > 0.0 and own.spring.bend_1 < math.inf:
        torque, slope, damping = mean_touch(own.spring, (0.0, 0.0), own.damping, gear.wind_up, gear.speed, h)
    else:
        torque, slope, _ = answer(own.spring, gear.wind_up)
        torque, damping = torque + own.damping * gear.speed, own.damping
    gear.torque += torque
    gear.damping += damping
    gear.stiffness += slope


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    gear = joint.spring
    _, _, own.energy = answer(own.spring, gear.wind_up)
    own.power = own.damping * gear.speed * gear.speed


@dataclass(frozen=True)
class FlexibleJoint(Effect):
    """The gear's wind-up between rotor and link.

    Attributes:
        gear: Its stiffnesses and the torques between them are taken.
        damping: Along the spring [N m s/rad].
    """

    gear: Gear
    damping: float = 0.0

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping < math.inf:
            raise InputError(Fault("FlexibleJoint.damping", "must not be negative [N m s/rad]", self.damping))
        gear_spring(self.gear)

    def ports(self, place: Place) -> Ports:
        energy, loss = Signal("spring_energy", "J", path="energy"), Signal("spring_damping_power", "W", path="power")
        return Ports(
            needs=(s.DEFLECTION, s.DEFLECTION_SPEED),
            contributes=(s.GEAR_TORQUE, s.GEAR_DAMPING, s.GEAR_STIFFNESS),
            outputs=(energy, loss),
            powers={loss.name: Role.LOSS},
            stores=(energy.name,),
        )

    def own(self, place: Place) -> Own:
        return Own(gear_spring(self.gear), self.damping)

    def shape(self, place: Place) -> Shape:
        return Shape(
            ratio=self.gear.ratio if place.turning[place.joint] else None, flexible=True, deflection=self._twist
        )

    def piecewise(self) -> bool:
        return gear_spring(self.gear).bend_1 < math.inf

    def _twist(self, torque: float) -> float:
        """Twist under a torque [rad]."""
        return float(twist_under(gear_spring(self.gear), torque))
