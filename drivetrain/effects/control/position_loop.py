"""A continuous position loop: proportional and derivative, on the motor's own angle, as a current command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.control.loop_gains import missing_current
from drivetrain.effects.effect import Effect, Place, Ports, TimeScale
from drivetrain.effects.laws import command_of, joint_law
from drivetrain.errors import Fault, InputError


@dataclass
class Own:
    """What it keeps: gains in current [A/rad], [A s/rad], and the ratio."""

    stiffness: float
    damping: float
    ratio: float
    coupled: int


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin, wanted, motor = joint.pin, command_of(joint, own.coupled), joint.motor
    late, slow = own.ratio * wanted.position - motor.position, own.ratio * wanted.speed - motor.speed
    pin.command += own.stiffness * late + own.damping * slow
    pin.damping += own.damping
    pin.stiffness += own.stiffness


@dataclass(frozen=True)
class PositionLoop(Effect):
    """Pulls the motor to the commanded position, as a spring and a damper at the joint would.

    Attributes:
        stiffness: Of that spring, at the joint [N m/rad].
        damping: Of that damper, at the joint [N m s/rad].
        torque_constant: That the controller believes in [N m/A].
    """

    stiffness: float
    damping: float
    torque_constant: float

    compute = _compute

    def __post_init__(self) -> None:
        faults = [
            Fault(f"PositionLoop.{name}", "must not be negative", value)
            for name, value in (("stiffness", self.stiffness), ("damping", self.damping))
            if not 0.0 <= value < float("inf")
        ]
        if not 0.0 < self.torque_constant < float("inf"):
            faults.append(Fault("PositionLoop.torque_constant", "must be positive [N m/A]", self.torque_constant))
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(*s.commanded(place)[:2], s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS),
        )

    def own(self, place: Place) -> Own:
        scale = 1.0 / (self.torque_constant * place.ratio**2)
        return Own(self.stiffness * scale, self.damping * scale, place.ratio, place.coupled)

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """How far the motor stays behind its command in equilibrium [rad]."""
        stiffness = self.own(place).stiffness
        return missing_current(place, signals) / stiffness if stiffness > 0.0 else 0.0

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("error decays", self.damping / self.stiffness),) if self.stiffness > 0.0 else ()
