"""An encoder on the motor's shaft: the angle in whole steps, which is all that a digital controller sees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        step, angle = numbers[words[row]], signals[words[row + 1]]
        signals[words[row + 2]] = step * math.floor(angle / step) if step > 0.0 else angle


@dataclass(frozen=True)
class Encoder(Effect):
    """Measures the motor's angle; the arm's own position comes from it through the ratio, as in most drives.

    Attributes:
        counts: Steps a turn, after quadrature; None: as fine as numbers are.
    """

    counts: int | None = None

    compute = _compute

    def __post_init__(self) -> None:
        if self.counts is not None and (self.counts != int(self.counts) or self.counts < 1):
            raise InputError(Fault("Encoder.counts", "must be a whole number from 1", self.counts))

    def ports(self, place: Place) -> Ports:
        """Reads the angle, gives the measured one.

        Args:
            place: Where it stands.

        Returns:
            Its ports.
        """
        return Ports(needs=(s.MOTOR_POSITION,), gives=(s.MEASURED_POSITION,))

    def numbers(self, place: Place) -> Sequence[float]:
        """The step.

        Args:
            place: Where it stands.

        Returns:
            [rad]; 0 for none.
        """
        return (0.0 if self.counts is None else 2.0 * math.pi / self.counts,)
