"""A gear with play: between its flanks nothing is carried, at them a spring and a damper push and never pull."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.gear import Gear
from drivetrain.drive.spring import Spring, answer, gear_spring, mean_touch, touch, twist_under
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Role, Shape, Signal
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law


@dataclass
class Own:
    """What it keeps: as ``FlexibleJoint``, half of the play [rad]; energy [J], power lost [W], torque [N m]."""

    spring: Spring
    damping: float
    half: float
    energy: float = 0.0
    power: float = 0.0
    torque: float = 0.0


@law
def _met(own: Any, gear: Any, h: float, damping: float) -> tuple[float, float, float]:
    """Torque, slope and damping at an instant, or in the mean over a step."""
    flanks = -own.half, own.half
    if h > 0.0:
        return mean_touch(own.spring, flanks, damping, gear.wind_up, gear.speed, h)
    return touch(own.spring, flanks, damping, gear.wind_up, gear.speed)


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    gear = joint.spring
    torque, slope, damping = _met(own, gear, h, own.damping)
    gear.torque += torque
    gear.damping += damping
    gear.stiffness += slope


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    gear = joint.spring
    own.torque, _, _ = _met(own, gear, h, own.damping)
    elastic, _, _ = _met(own, gear, h, 0.0)
    deep = max(abs(gear.wind_up) - own.half, 0.0)
    _, _, own.energy = answer(own.spring, deep)
    own.power = (own.torque - elastic) * gear.speed


@dataclass(frozen=True)
class Backlash(Effect):
    """The gear's spring with its play in the middle, and the rotor moving on its own behind it.

    Instead of ``FlexibleJoint``; without play it is the same joint.

    Attributes:
        gear: Its stiffnesses and its backlash are taken.
        damping: At the flanks in touch [N m s/rad].
    """

    gear: Gear
    damping: float = 0.0

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = []
        if self.gear.backlash is None:
            hint = "state one, or take FlexibleJoint"
            faults.append(Fault("Backlash.gear", "has no backlash in its catalogue row [rad]", self.gear.key, hint))
        if not 0.0 <= self.damping < math.inf:
            faults.append(Fault("Backlash.damping", "must not be negative [N m s/rad]", self.damping))
        if faults:
            raise InputError(faults)
        gear_spring(self.gear)

    def ports(self, place: Place) -> Ports:
        energy, loss = Signal("flank_energy", "J", path="energy"), Signal("flank_damping_power", "W", path="power")
        return Ports(
            needs=(s.DEFLECTION, s.DEFLECTION_SPEED),
            contributes=(s.GEAR_TORQUE, s.GEAR_DAMPING, s.GEAR_STIFFNESS),
            outputs=(energy, loss, Signal("flank_torque", "N m", path="torque")),
            powers={loss.name: Role.LOSS},
            stores=(energy.name,),
        )

    def own(self, place: Place) -> Own:
        return Own(gear_spring(self.gear), self.damping, 0.5 * (self.gear.backlash or 0.0))

    def shape(self, place: Place) -> Shape:
        return Shape(
            ratio=self.gear.ratio if place.turning[place.joint] else None, flexible=True, deflection=self._twist
        )

    def piecewise(self) -> bool:
        return True

    def _twist(self, torque: float) -> float:
        """Twist under a torque [rad]."""
        play = math.copysign(0.5 * (self.gear.backlash or 0.0), torque)
        return float(twist_under(gear_spring(self.gear), torque)) + play
