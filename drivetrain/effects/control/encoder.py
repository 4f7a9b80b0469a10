"""An encoder on the motor's shaft, which measures the angle in whole counts for digital controllers."""

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
    step: float  # angle of one count [rad]; 0: no quantisation


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    angle = joint.motor.position
    joint.measured_position = own.step * math.floor(angle / own.step) if own.step > 0.0 else angle


@dataclass(frozen=True)
class Encoder(Effect):
    """Measures the motor's angle; the joint position is computed from it through the ratio, as in most drives.

    Attributes:
        counts: Counts per turn, after quadrature; None: no quantisation.
    """

    counts: int | None = None

    limits = ranges(counts=Range("must be a whole number from 1", low=1.0, low_included=True))
    compute = _compute

    def ports(self, place: Place) -> Ports:
        return Ports(needs=(s.MOTOR_POSITION,), provides=(s.MEASURED_POSITION,))

    @property
    def step(self) -> float:
        """Angle of one count [rad]; 0: no quantisation."""
        return 0.0 if self.counts is None else 2.0 * math.pi / self.counts

    def quasi_static(self) -> Effect:
        return Encoder()
