"""The preload of two motors on one axis, which push against each other so that the play of their gears is closed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.drive.motor import Motor, torque_constant
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Shape
from drivetrain.effects.fields import finite, ranges
from drivetrain.effects.laws import joint_law


@dataclass
class Own:
    """What it keeps: the current of the preload [A]."""

    current: float


@joint_law(Own)
def _push(t: Any, h: Any, own: Any, joint: Any) -> None:
    joint.pin.command += own.current


@dataclass(frozen=True)
class Preload(Effect):
    """Constant torque with which one of the two motors of an axis pushes against the other.

    The motor's angle counts from where the preload alone winds up its gear, so that its loop does not work against it.

    Attributes:
        motor: Its torque constant is taken.
        torque: At the gear's output [N m]; of the other motor the opposite.
    """

    motor: Motor
    torque: float

    limits = ranges(torque=finite("N m"))
    compute = _push

    def ports(self, place: Place) -> Ports:
        return Ports(contributes=(s.CURRENT_COMMAND,))

    def own(self, place: Place) -> Own:
        return Own(self.current(place.ratio))

    def shape(self, place: Place) -> Shape:
        return Shape(preload=self.torque)

    def current(self, ratio: float) -> float:
        """Of the preload, losses left out [A], the motor's angle ``ratio`` times the joint's."""
        return self.torque / (ratio * float(torque_constant(self.motor, self.motor.reference_temperature)))
