"""A spring and a damper between the joint and a wall, which may move with a constant speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import finite, not_negative, ranges
from drivetrain.effects.laws import joint_law


@dataclass
class Own:
    # as in ``WallSpring``
    stiffness: float
    damping: float
    rest: float
    speed: float
    energy: float = 0.0  # elastic energy [J]
    loss: float = 0.0  # power lost in the damper [W]
    work: float = 0.0  # power supplied by the moving wall [W]


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
    # The wall is moved against the force of spring and damper: power from outside.
    own.work = -(own.stiffness * stretch + own.damping * speed) * own.speed


@dataclass(frozen=True)
class WallSpring(Effect):
    """Spring and damper between the joint and a fixed or moving point.

    Attributes:
        stiffness: Stiffness of the spring [N m/rad].
        damping: Damping of the damper [N m s/rad].
        rest: Joint position at which the spring is relaxed, at time 0 [rad].
        speed: Speed with which that position moves [rad/s].
    """

    stiffness: float
    damping: float = 0.0
    rest: float = 0.0
    speed: float = 0.0

    limits = ranges(
        stiffness=not_negative("N m/rad"), damping=not_negative("N m s/rad"), rest=finite("rad"),
        speed=finite("rad/s"),
    )  # fmt: skip
    compute = _compute
    account = _account

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(s.POSITION, s.SPEED),
            contributes=(s.JOINT_TORQUE, s.JOINT_DAMPING, s.JOINT_STIFFNESS),
            outputs=(
                s.store("wall_spring_energy"), s.loss("wall_damping_power", "loss"), s.source("wall_power", "work"),
            ),
        )  # fmt: skip
