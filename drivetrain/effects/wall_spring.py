"""A spring and a damper from the joint to a wall, which may itself move at a steady speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, Signal
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        stretch = signals[words[row + 1]] - numbers[at + 2] - numbers[at + 3] * t
        speed = signals[words[row + 2]] - numbers[at + 3]
        signals[words[row + 3]] -= numbers[at] * stretch + numbers[at + 1] * speed
        signals[words[row + 4]] += numbers[at + 1]
        signals[words[row + 5]] += numbers[at]


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        stretch = signals[words[row + 1]] - numbers[at + 2] - numbers[at + 3] * t
        speed = signals[words[row + 2]] - numbers[at + 3]
        torque = numbers[at] * stretch + numbers[at + 1] * speed
        signals[words[row + 6]] = 0.5 * numbers[at] * stretch * stretch
        signals[words[row + 7]] = numbers[at + 1] * speed * speed
        # The wall is pulled along against the spring: work from outside.
        signals[words[row + 8]] = -torque * numbers[at + 3]


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
        energy, loss = Signal("wall_spring_energy", "J"), Signal("wall_damping_power", "W")
        work = Signal("wall_power", "W")
        return Ports(
            needs=(s.POSITION, s.SPEED),
            contributes=(s.JOINT_TORQUE, s.JOINT_DAMPING, s.JOINT_STIFFNESS),
            outputs=(energy, loss, work),
            powers={loss.name: Role.LOSS, work.name: Role.SOURCE},
            stores=(energy.name,),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        return self.stiffness, self.damping, self.rest, self.speed
