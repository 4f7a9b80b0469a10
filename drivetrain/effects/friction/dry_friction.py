"""Set-valued dry friction with exact sticking (Coulomb, static, Stribeck), at the joint or at the motor's shaft.

It contributes bounds, not a torque: at rest friction is the torque that keeps the joint at rest, and this is known only
from the solution of the equations of all joints. The friction curve is that of ``drive/friction.py``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.drive.friction import Friction, friction_curve, static_excess
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import Side
from drivetrain.effects.laws import MOTOR, flange_of, joint_law, side_of


@dataclass
class Own:
    """Record of the effect: its side, and the fields of ``FrictionCurve`` that ``static_excess`` reads."""

    side: int
    forward: float
    backward: float
    static_forward: float
    static_backward: float
    falls: int
    stribeck_speed: float
    stribeck_exponent: float
    tanh_speed: float


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    # Dry friction at the gear's output shaft of coupled motors is counted in the bounds of ``load``.
    levels = joint.motor if own.side == MOTOR else joint.load
    levels.hold_forward += own.static_forward
    levels.hold_backward += own.static_backward
    levels.slide_forward += own.forward
    levels.slide_backward += own.backward
    if own.falls:
        speed = flange_of(joint, own.side).speed - levels.surface_speed
        levels.slide_forward += static_excess(own, speed) if speed > 0.0 else own.static_forward - own.forward
        levels.slide_backward -= static_excess(own, speed) if speed < 0.0 else own.backward - own.static_backward


@dataclass(frozen=True)
class DryFriction(Effect):
    """Dry friction: holds up to its static torque, and slides with its sliding torque.

    Attributes:
        friction: Friction law, of which all but the viscous part is used.
        side: ``joint``, ``motor``, or ``shaft``: the gear's output shaft, where motors are coupled.
    """

    friction: Friction
    side: Side = "joint"

    compute = _compute

    def ports(self, place: Place) -> Ports:
        if self.side == "motor":
            return Ports(needs=(s.MOTOR_SPEED, s.MOTOR_SURFACE_SPEED), contributes=s.MOTOR_BOUNDS)
        return Ports(needs=(s.of_side(self.side, place)[0], s.SURFACE_SPEED), contributes=s.JOINT_BOUNDS)

    def own(self, place: Place) -> Own:
        curve = friction_curve(self.friction)
        levels = (curve.forward, curve.backward, curve.static_forward, curve.static_backward)
        fall = (curve.falls, curve.stribeck_speed, curve.stribeck_exponent, 0.0)
        return Own(side_of(self.side, place), *levels, *fall)
