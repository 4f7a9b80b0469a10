"""A spring and a damper from the joint to a wall, which may itself move at a steady speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault, InputError


@dataclass
class Own:
    """What it keeps: the fields of ``WallSpring``; energy [J], power lost in the damper and put in by the wall [W]."""

    stiffness: float
    damping: float
    rest: float
    speed: float
    energy: float = 0.0
    loss: float = 0.0
    work: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    load = joint.load
    stretch, speed = load.position - own.rest - own.speed * t, load.speed - own.speed
    load.torque -= own.stiffness * stretch + own.damping * speed
    load.damping += own.damping
    load.stiffness += own.stiffness


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    load = joint.load
    stretch, speed = load.position - own.rest - own.speed * t, load.speed - own.speed
    own.energy = 0.5 * own.stiffness * stretch * stretch
    own.loss = own.damping * speed * speed
    # The wall is pulled along against the spring: work from outside.
    own.work = -(own.stiffness * stretch + own.damping * speed) * own.speed


@dataclass(frozen=True)
class WallSpring(Effect):
    """Pulls the joint to a place on a wall.

    Attributes:
        stiffness: [N m/rad].
        damping: [N m s/rad].
        rest: Position of the joint at which the spring is at rest, at time 0 [rad].
        speed: At which that place moves [rad/s].
    """

    stiffness: float
    damping: float = 0.0
    rest: float = 0.0
    speed: float = 0.0

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = [
            Fault(f"WallSpring.{name}", "must not be negative", value)
            for name, value in (("stiffness", self.stiffness), ("damping", self.damping))
            if not 0.0 <= value < math.inf
        ]
        faults += [
            Fault(f"WallSpring.{name}", "must be a number", value)
            for name, value in (("rest", self.rest), ("speed", self.speed))
            if not math.isfinite(value)
        ]
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        energy, loss = Signal("wall_spring_energy", "J", path="energy"), Signal("wall_damping_power", "W", path="loss")
        work = Signal("wall_power", "W", path="work")
        return Ports(
            needs=(s.POSITION, s.SPEED),
            contributes=(s.JOINT_TORQUE, s.JOINT_DAMPING, s.JOINT_STIFFNESS),
            outputs=(energy, loss, work),
            powers={loss.name: Role.LOSS, work.name: Role.SOURCE},
            stores=(energy.name,),
        )

    def own(self, place: Place) -> Own:
        return Own(self.stiffness, self.damping, self.rest, self.speed)
