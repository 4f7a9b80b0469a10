"""Preload of two motors on one axis: they act against each other, so that the backlash of their gears is closed."""

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
    """Record of the effect: the current of the preload [A]."""

    current: float


@joint_law(Own)
def _push(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Contribute the current of the preload to the command."""
    joint.pin.command += own.current


@dataclass(frozen=True)
class Preload(Effect):
    """Constant torque with which one of the two motors of an axis pushes against the other.

    The motor's angle is zero where the preload alone winds up its gear, so that the position loop does not act against
    the preload.

    Attributes:
        motor: The motor, of which the torque constant is used.
        torque: Preload at the gear's output [N m]; that of the other motor has the opposite sign.
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
        """Current of the preload without losses [A], for a ratio of motor angle over joint coordinate."""
        return self.torque / (ratio * float(torque_constant(self.motor, self.motor.reference_temperature)))
