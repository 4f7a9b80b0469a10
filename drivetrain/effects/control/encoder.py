"""An encoder on the motor's shaft: the angle in whole steps, which is all that a digital controller sees."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.effects import signals as s
from drivetrain.effects.bounds import OVERSHOOT, bounded
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.estimate import Conditions, Estimate
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault, InputError


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
        return Ports(needs=(s.MOTOR_POSITION,), provides=(s.MEASURED_POSITION,))

    def own(self, place: Place) -> Own:
        return Own(self.step)

    @property
    def step(self) -> float:
        """Angle of one count [rad]; 0 for none."""
        return 0.0 if self.counts is None else 2.0 * math.pi / self.counts

    def quasi_static(self) -> Effect:
        return Encoder()

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        """What one count more or less makes of the current.

        The angle is off by less than a count, and so is the difference of two angles over a sample: in current the
        gains times both. As long as that is a small share of the current the loop does not hunt between two counts.
        """
        series, kt = conditions.series, conditions.torque_constant
        if series is None or not conditions.sample_period > 0.0:
            return Estimate(valid=False, why="no sampled loop is known to read it: keep it")
        gains = conditions.loop_stiffness + conditions.loop_damping / conditions.sample_period
        current = OVERSHOOT * gains * self.step / (place.ratio**2 * kt)
        away = self.step / abs(place.ratio)
        error = np.full(len(series.time), current)
        why = "gains times a count, and times a count a sample"
        return bounded(conditions, error, why, deviation=away, valid=current < 0.2 * conditions.rms_current)
