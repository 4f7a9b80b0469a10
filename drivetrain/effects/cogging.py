"""Cogging: the magnets pull towards the teeth, a torque of the motor's angle alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.effects import signals as s
from drivetrain.effects.bounds import OVERSHOOT, bounded
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Signal
from drivetrain.effects.estimate import Conditions, Estimate, TaskSeries
from drivetrain.errors import Fault, InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        for j in range(int(numbers[at])):
            size, order, phase = numbers[at + 1 + 3 * j], numbers[at + 2 + 3 * j], numbers[at + 3 + 3 * j]
            # The mean of a sine over what the rotor turns in the step: teeth that fly past leave nothing.
            half = 0.5 * h * order * signals[words[row + 2]]
            mean = math.sin(half) / half if abs(half) > 1e-4 else 1.0 - half * half / 6.0
            angle = order * signals[words[row + 1]] + phase
            signals[words[row + 3]] -= size * mean * math.sin(angle)
            pull = size * mean * order * math.cos(angle)
            if pull > 0.0:
                signals[words[row + 4]] += pull


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        energy = 0.0
        for j in range(int(numbers[at])):
            size, order, phase = numbers[at + 1 + 3 * j], numbers[at + 2 + 3 * j], numbers[at + 3 + 3 * j]
            energy += size / order * (1.0 - math.cos(order * signals[words[row + 1]] + phase))
        signals[words[row + 5]] = energy


@dataclass(frozen=True)
class Cogging(Effect):
    """A torque ``-a sin(k angle + phase)`` for each harmonic; over a turn it does no work.

    Attributes:
        amplitudes: [N m], one a harmonic.
        orders: Periods a turn: the least common multiple of teeth and poles, and multiples of it.
        phases: [rad], one a harmonic; empty: all zero.
    """

    amplitudes: tuple[float, ...]
    orders: tuple[int, ...]
    phases: tuple[float, ...] = ()

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = []
        count = len(self.amplitudes)
        if not count or len(self.orders) != count or len(self.phases) not in (0, count):
            faults.append(Fault("Cogging", "needs as many orders (and phases) as amplitudes", self.orders))
        faults += [
            Fault("Cogging.amplitudes", "must be finite [N m]", a) for a in self.amplitudes if not math.isfinite(a)
        ]
        faults += [
            Fault("Cogging.orders", "must be whole numbers from 1", k) for k in self.orders if k != int(k) or k < 1
        ]
        faults += [Fault("Cogging.phases", "must be finite [rad]", p) for p in self.phases if not math.isfinite(p)]
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        energy = Signal("cogging_energy", "J")
        return Ports(
            needs=(s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.MOTOR_TORQUE, s.MOTOR_STIFFNESS),
            outputs=(energy,),
            stores=(energy.name,),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        phases = self.phases or (0.0,) * len(self.orders)
        listed = zip(self.amplitudes, self.orders, phases, strict=True)
        return [float(len(self.orders)), *(float(v) for harmonic in listed for v in harmonic)]

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        if conditions.series is not None:
            return self._along(place, conditions, conditions.series)
        size = abs(place.ratio) * sum(abs(a) for a in self.amplitudes)
        square = 0.5 * sum((place.ratio * a) ** 2 for a in self.amplitudes)
        peak = size / max(conditions.peak_torque, 1e-300)
        # Out of step with the load over a turn, so squares add; a joint that rests on a tooth feels all of it.
        rms = math.sqrt(1.0 + square / max(conditions.rms_torque, 1e-300) ** 2) - 1.0
        return Estimate(
            peak, rms, 2.0 * rms, 0.0, conditions.free, "sum of all harmonics on the peak, squares on the RMS"
        )

    def _along(self, place: Place, conditions: Conditions, series: TaskSeries) -> Estimate:
        """All amplitudes at once, all the time, as a joint may rest on a tooth.

        Where that is no small share of the current the loop may swing with the teeth: not valid.
        """
        size = sum(abs(a) for a in self.amplitudes)
        current = OVERSHOOT * size / conditions.torque_constant
        away = size * abs(place.ratio) / conditions.loop_stiffness
        error, small = np.full(len(series.time), current), current < 0.2 * conditions.rms_current
        return bounded(conditions, error, "sum of all harmonics", deviation=away, valid=small)
