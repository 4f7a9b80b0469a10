"""A continuous position loop: proportional and derivative, on the motor's own angle, as a current command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, TimeScale
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        stiff, damp, ratio = numbers[at], numbers[at + 1], numbers[at + 2]
        error = ratio * signals[words[row + 1]] - signals[words[row + 3]]
        slow = ratio * signals[words[row + 2]] - signals[words[row + 4]]
        signals[words[row + 5]] += stiff * error + damp * slow
        signals[words[row + 6]] += damp
        signals[words[row + 7]] += stiff


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

    def numbers(self, place: Place) -> Sequence[float]:
        scale = 1.0 / (self.torque_constant * place.ratio**2)
        return self.stiffness * scale, self.damping * scale, place.ratio

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("error falls", self.damping / self.stiffness),) if self.stiffness > 0.0 else ()
