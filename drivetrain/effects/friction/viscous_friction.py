"""Friction that grows with speed, at the joint or at the motor's shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.drive.friction import Friction
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal
from drivetrain.effects.field_types import side_faults
from drivetrain.effects.laws import MOTOR, flange_of, joint_law, side_of
from drivetrain.errors import InputError


@dataclass
class Own:
    """What it keeps: its side, damping either way [N m s/rad], power [W]."""

    side: int
    forward: float
    backward: float
    power: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    flange = flange_of(joint, own.side)
    damping = own.forward if flange.speed >= 0.0 else own.backward
    flange.torque -= damping * flange.speed
    flange.damping += damping


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    speed = flange_of(joint, own.side).speed
    own.power = (own.forward if speed >= 0.0 else own.backward) * speed * speed
    if own.side == MOTOR:
        joint.heat.viscous_power = own.power


@dataclass(frozen=True)
class ViscousFriction(Effect):
    """A torque against the motion, proportional to speed.

    Attributes:
        friction: Of which ``viscous`` and ``viscous_negative`` are taken; dry friction is an effect of its own.
        side: ``joint``, ``motor``, or ``shaft``: behind the gear, where motors are coupled.
    """

    friction: Friction
    side: str = "joint"

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = side_faults(self)
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        speed, torque, damping = s.of_side(self.side, place)
        loss = Signal(f"{self.side}_viscous_power", "W", path="power")
        return Ports(
            needs=(speed,),
            contributes=(torque, damping),
            outputs=(loss,),
            powers={loss.name: Role.LOSS},
        )

    def own(self, place: Place) -> Own:
        law = self.friction
        backward = law.viscous if law.viscous_negative is None else law.viscous_negative
        return Own(side_of(self.side, place), law.viscous, backward)
