"""A moving belt: the joint's dry friction acts against a surface with constant speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import finite, ranges
from drivetrain.effects.laws import joint_law


@dataclass
class Own:
    """Record of the effect: speed of the belt [rad/s], power that drives it [W]."""

    speed: float
    power: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    joint.load.surface_speed += own.speed


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    own.power = -own.speed * joint.load.friction


@dataclass(frozen=True)
class MovingBelt(Effect):
    """Moves the surface against which the joint's dry friction acts.

    Attributes:
        speed: Speed of the belt [rad/s].
    """

    speed: float

    limits = ranges(speed=finite("rad/s"))
    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        return Ports(needs=(s.JOINT_FRICTION,), contributes=(s.SURFACE_SPEED,), outputs=(s.source("belt_power"),))
