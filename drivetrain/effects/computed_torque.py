"""Computed torque: the controller knows the arm, and asks for the torque that its own equations of motion tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Signal
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    row = 2
    at = words[row]
    n, c, stiff, damp = int(numbers[at]), int(numbers[at + 1]), numbers[at + 2], numbers[at + 3]
    mass, joints, command = words[row + 1], row + 2, row + 2 + 6 * n
    for i in range(n):
        torque = signals[words[joints + 6 * i + 5]]
        diagonal = signals[mass + i * c + i]
        for k in range(n):
            own = joints + 6 * k
            pull = signals[words[own + 2]]
            pull += stiff * (signals[words[own]] - signals[words[own + 3]])
            pull += damp * (signals[words[own + 1]] - signals[words[own + 4]])
            torque += signals[mass + i * c + k] * pull
        scale = numbers[at + 4 + i]
        signals[words[command + 3 * i]] += torque * scale
        # Of the motor's own angle: the ratio is in the scale once more.
        turn = numbers[at + 4 + n + i]
        signals[words[command + 3 * i + 1]] += diagonal * damp * scale * turn
        signals[words[command + 3 * i + 2]] += diagonal * stiff * scale * turn


@dataclass(frozen=True)
class ComputedTorque(Effect):
    """Asks for ``M(q) (a + kd e' + kp e) + h(q, q')``, as current of each motor.

    Attributes:
        frequency: Of the error's decay, damped critically [rad/s]: kp is its square, kd twice it.
        torque_constants: By joint name [N m/A].
    """

    frequency: float
    torque_constants: tuple[tuple[str, float], ...]

    scope = "scene"
    compute = _compute

    def __post_init__(self) -> None:
        if not 0.0 < self.frequency < float("inf"):
            raise InputError(Fault("ComputedTorque.frequency", "must be positive [rad/s]", self.frequency))

    def ports(self, place: Place) -> Ports:
        added = (s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS)
        at = [replace(place, joint=index) for index in range(len(place.joints))]
        read = [(*s.commanded(one), *s.motion(one), s.BIAS_TORQUE) for one in at]
        own = tuple(
            Signal(f"{joint}:{signal.name}", signal.unit)
            for joint, signals in zip(place.joints, read, strict=True)
            for signal in signals
        )
        out = tuple(Signal(f"{joint}:{signal.name}", signal.unit) for joint in place.joints for signal in added)
        return Ports(needs=(Signal("scene.mass_matrix", "kg m^2"), *own), contributes=out)

    def numbers(self, place: Place) -> Sequence[float]:
        known = dict(self.torque_constants)
        missing = [joint for joint in place.joints if not known.get(joint, 0.0) > 0.0]
        if missing:
            raise InputError(Fault("ComputedTorque.torque_constants", f"must be positive for {', '.join(missing)}"))
        scales = [1.0 / (ratio * known[joint]) for joint, ratio in zip(place.joints, place.ratios, strict=True)]
        turns = [1.0 / ratio for ratio in place.ratios]
        gains = (self.frequency**2, 2.0 * self.frequency)
        return [len(place.joints), place.coordinates, *gains, *scales, *turns]
