"""Drag of a gear at its input: depending on speed and temperature in motion, and the starting torque at rest.

It contributes bounds of set-valued friction, as ``DryFriction`` does; the law is that of ``drive/gear.py``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from drivetrain.drive.gear import DRAG_REFERENCE, Gear, drag_torque, mesh
from drivetrain.drive.ranges import TEMPERATURE
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import ranges
from drivetrain.effects.laws import joint_law

CREEP = 1e-9  # speed at which the drag of a gear at rest is evaluated [rad/s]


@dataclass
class Own:
    # parameters of the drag, as in ``drive.gear.Mesh``
    drag: float
    exponent: float
    cooling: float
    bend: float
    seal: float
    starting: float
    follows: int  # whether its temperature is that of the housing
    temperature: float  # its temperature otherwise [C]
    torque: float = 0.0  # drag in motion [N m]


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    motor = joint.motor
    temperature = joint.heat.gear if own.follows else own.temperature
    own.torque = drag_torque(own, max(abs(motor.speed), CREEP), temperature)
    motor.slide_forward += own.torque
    motor.slide_backward += own.torque
    at_rest = max(own.starting, drag_torque(own, CREEP, temperature))
    motor.hold_forward += at_rest
    motor.hold_backward += at_rest


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    # If the motor comes to rest within the step, dry friction dissipates less than its bound times the speed.
    joint.heat.drag_power = min(own.torque * abs(joint.motor.speed), max(joint.motor.friction_power, 0.0))


@dataclass(frozen=True)
class GearDrag(Effect):
    """Load-independent loss of a gear: grease and seals, and at rest the starting torque.

    Attributes:
        gear: Data of the gear, of which drag, seals and starting torque are used; its mesh is ``MeshLoss``.
        temperature: Temperature of the gear if it does not follow the housing, or if no effect provides that [C].
        follows: Whether the gear has the temperature of the motor's housing, if an effect provides it.
    """

    gear: Gear
    temperature: float = DRAG_REFERENCE
    follows: bool = True

    limits = ranges(temperature=TEMPERATURE)
    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        mesh(self.gear)  # raises if the loss is unknown

    def ports(self, place: Place) -> Ports:
        warm = (replace(s.GEAR_TEMPERATURE, default=self.temperature),) if self.follows else ()
        return Ports(
            needs=(s.MOTOR_SPEED, *warm),
            contributes=s.MOTOR_BOUNDS,
            outputs=(s.GEAR_DRAG_POWER,),
        )

    def own(self, place: Place) -> Own:
        loss = mesh(self.gear)
        law = (loss.drag, loss.exponent, loss.cooling, loss.bend, loss.seal, loss.starting)
        return Own(*law, int(self.follows), self.temperature)
