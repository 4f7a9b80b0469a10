"""Friction that increases smoothly with the speed, at the joint or at the motor's shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.drive.friction import Friction, friction_curve, sliding_friction, smooth_lack, tanh_slope
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import Side
from drivetrain.effects.laws import MOTOR, flange_of, joint_law, side_of
from drivetrain.jit import law


@dataclass
class Own:
    side: int
    # damping by direction [N m s/rad]
    viscous_forward: float
    viscous_backward: float
    # Coulomb friction by direction [N m] of a law that rises as tanh(speed / tanh_speed); 0 without one
    forward: float
    backward: float
    tanh_speed: float  # [rad/s]
    power: float = 0.0  # power lost [W]


@law
def _torque(own: Any, speed: float) -> float:
    """Friction torque at a speed [N m]: viscous part, and the tanh part if there is one."""
    torque = sliding_friction(own, speed)
    return torque + smooth_lack(own, speed) if own.tanh_speed > 0.0 else torque


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    flange = flange_of(joint, own.side)
    flange.torque -= _torque(own, flange.speed)
    flange.damping += own.viscous_forward if flange.speed >= 0.0 else own.viscous_backward
    if own.tanh_speed > 0.0:
        flange.damping += tanh_slope(own, flange.speed)


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    speed = flange_of(joint, own.side).speed
    own.power = _torque(own, speed) * speed
    if own.side == MOTOR:
        joint.heat.viscous_power = own.power


@dataclass(frozen=True)
class ViscousFriction(Effect):
    """Torque against the motion, proportional to the speed or increasing smoothly with it.

    Attributes:
        friction: Friction law, of which ``viscous`` and ``viscous_negative`` are used, and Coulomb friction where it
            rises as tanh; dry friction is an effect of its own.
        side: ``joint``, ``motor``, or ``shaft``: the gear's output shaft, where motors are coupled.
    """

    friction: Friction
    side: Side = "joint"

    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        speed, torque, damping = s.of_side(self.side, place)
        return Ports(needs=(speed,), contributes=(torque, damping), outputs=(s.loss(f"{self.side}_viscous_power"),))

    def own(self, place: Place) -> Own:
        curve = friction_curve(self.friction)
        forward, backward = (curve.forward, curve.backward) if curve.tanh_speed else (0.0, 0.0)
        viscous = curve.viscous_forward, curve.viscous_backward
        return Own(side_of(self.side, place), *viscous, forward, backward, curve.tanh_speed)
