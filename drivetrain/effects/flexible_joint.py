"""A joint that gives way: the gear's spring in three pieces with damping, and the rotor moving on its own behind it.

The twist is a state of its own, never the difference of two large angles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear
from drivetrain.drive.spring_kernel import mean_touch, spring, spring_numbers
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, Shape, Signal, TimeScale
from drivetrain.effects.estimate import Conditions, Estimate
from drivetrain.effects.twisting import along, swing, twist
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law


@law
def _answer(numbers: Any, at: int, twist: float, rate: float, h: float) -> tuple[float, float, float]:
    """Torque of spring and damper, slope and damping, at an instant or in the mean over a step."""
    if h > 0.0 and numbers[at + 3] < math.inf:
        pieces = numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3], numbers[at + 4]
        return mean_touch(pieces, (0.0, 0.0), numbers[at + 5], twist, rate, h)
    torque, slope, _ = spring(numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3], numbers[at + 4], twist)
    return torque + numbers[at + 5] * rate, slope, numbers[at + 5]


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        torque, slope, damping = _answer(numbers, words[row], signals[words[row + 1]], signals[words[row + 2]], h)
        signals[words[row + 3]] += torque
        signals[words[row + 4]] += damping
        signals[words[row + 5]] += slope


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        _, _, energy = spring(
            numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3], numbers[at + 4], signals[words[row + 1]]
        )
        rate = signals[words[row + 2]]
        signals[words[row + 6]] = energy
        signals[words[row + 7]] = numbers[at + 5] * rate * rate


@dataclass(frozen=True)
class FlexibleJoint(Effect):
    """The gear's wind-up between rotor and link.

    Attributes:
        gear: Its stiffnesses and the torques between them are taken.
        damping: Along the spring [N m s/rad].
    """

    gear: Gear
    damping: float = 0.0

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping < math.inf:
            raise InputError(Fault("FlexibleJoint.damping", "must not be negative [N m s/rad]", self.damping))
        spring_numbers(self.gear)

    def ports(self, place: Place) -> Ports:
        energy, loss = Signal("spring_energy", "J"), Signal("spring_damping_power", "W")
        return Ports(
            needs=(s.DEFLECTION, s.DEFLECTION_SPEED),
            adds=(s.GEAR_TORQUE, s.GEAR_DAMPING, s.GEAR_STIFFNESS),
            tells=(energy, loss),
            powers={loss.name: Role.LOSS},
            stores=(energy.name,),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        return *spring_numbers(self.gear), self.damping

    def shape(self, place: Place) -> Shape:
        return Shape(
            ratio=self.gear.ratio if place.turning[place.joint] else None, flexible=True, deflection=self._twist
        )

    def kinked(self) -> bool:
        return spring_numbers(self.gear)[3] < math.inf

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return ()

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        if conditions.series is not None:
            return along(self.gear, self.damping, place, conditions, conditions.series)
        stiffness = self.gear.stiffness_1 or math.inf
        frequency = math.sqrt(stiffness / max(conditions.inertia, 1e-300))
        slow = 1.0 / (frequency * max(conditions.move_time, 1e-300))
        share = 376.0 * slow**2
        why = "twist of the peak torque; current 376 (1 / (w T))^2 at most, w of the link on a still rotor"
        valid = conditions.free and slow < 0.04
        return Estimate(share, share, 2.0 * share, self._twist(conditions.peak_torque), valid, why)

    def swing(self, conditions: Conditions) -> Array:
        """How far the spring's torque swings beside that of the task.

        Args:
            conditions: The joint's task.

        Returns:
            Envelope [N m], (N,); a single zero where the task is not known.
        """
        return swing(self.gear, self.damping, conditions)

    def _twist(self, torque: float) -> float:
        """Twist under a torque [rad]."""
        return twist(self.gear, torque)
