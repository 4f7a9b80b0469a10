"""An encoder on the motor's shaft: the angle in whole steps, which is all that a digital controller sees."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.ranges import Range
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.fields import ranges
from drivetrain.effects.laws import joint_law


@dataclass
class Own:
    """What it keeps: the angle of one count [rad], 0 for none."""

    step: float


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    angle = joint.motor.position
    joint.measured_position = own.step * math.floor(angle / own.step) if own.step > 0.0 else angle


@dataclass(frozen=True)
class Encoder(Effect):
    """Measures the motor's angle; the joint position is computed from it through the ratio, as in most drives.

    Attributes:
        counts: Steps a turn, after quadrature; None: as fine as numbers are.
    """

    counts: int | None = None

    limits = ranges(counts=Range("must be a whole number from 1", low=1.0, low_included=True))
    compute = _compute

    def ports(self, place: Place) -> Ports:
        return Ports(needs=(s.MOTOR_POSITION,), provides=(s.MEASURED_POSITION,))

    @property
    def step(self) -> float:
        """Angle of one count [rad]; 0 for none."""
        return 0.0 if self.counts is None else 2.0 * math.pi / self.counts

    def quasi_static(self) -> Effect:
        return Encoder()
