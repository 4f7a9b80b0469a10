"""A belt under the joint: its dry friction rubs on what moves at a steady speed."""

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
        signals[words[row + 2]] += numbers[words[row]]


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        signals[words[row + 3]] = -numbers[words[row]] * signals[words[row + 1]]


@dataclass(frozen=True)
class MovingBelt(Effect):
    """Moves what the joint's dry friction rubs on.

    Attributes:
        speed: Of the belt [rad/s].
    """

    speed: float

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        if not math.isfinite(self.speed):
            raise InputError(Fault("MovingBelt.speed", "must be a number [rad/s]", self.speed))

    def ports(self, place: Place) -> Ports:
        work = Signal("belt_power", "W")
        return Ports(
            needs=(s.JOINT_FRICTION,), contributes=(s.SURFACE_SPEED,), outputs=(work,), powers={work.name: Role.SOURCE}
        )

    def numbers(self, place: Place) -> Sequence[float]:
        return (self.speed,)
