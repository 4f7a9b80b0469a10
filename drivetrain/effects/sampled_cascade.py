"""Position and speed loop as a digital controller runs them: at samples, on a measured angle, with a delay."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.cascade_loop import CascadeLoop
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, State, TimeScale
from drivetrain.effects.loop_gains import gain_faults
from drivetrain.errors import Fault, InputError

MOST_DELAY = 3  # samples


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        signals[words[row + 10]] += x[words[row + 1]]


@Compiled
def _sample(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        place, gain, rate, peak, ratio = numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3], numbers[at + 4]
        period, delay = numbers[at + 5], int(numbers[at + 6])
        measured = signals[words[row + 9]]
        speed = (measured - x[words[row + 2]]) / period
        x[words[row + 2]] = measured
        wanted = ratio * signals[words[row + 8]] + place * (ratio * signals[words[row + 7]] - measured)
        error = wanted - speed
        grown = period * gain * rate * error
        asked = gain * error + x[words[row + 3]] + grown
        if abs(asked) > peak:
            asked = peak if asked > 0.0 else -peak
            if asked * error > 0.0:
                grown = 0.0
        x[words[row + 3]] += grown
        # What is computed now is given out some samples later.
        x[words[row + 4 + delay]] = asked
        x[words[row + 1]] = x[words[row + 4]]
        for j in range(delay):
            x[words[row + 4 + j]] = x[words[row + 5 + j]]


@dataclass(frozen=True)
class SampledCascade(Effect):
    """``CascadeLoop`` with samples: the speed is the difference of two measured angles over the period.

    Attributes:
        position_gain: Of the outer loop [1/s].
        speed_gain: Of the inner one, at the motor [A s/rad].
        integral_time: In which the integral adds as much as the gain [s]; infinite: no integral.
        peak_current: At which command and integrator stop [A].
        every: Period [s].
        delay: Samples from measuring to giving out, 0 to 2.
    """

    position_gain: float
    speed_gain: float
    integral_time: float = math.inf
    peak_current: float = math.inf
    every: float = 1e-3
    delay: int = 1

    compute = _compute
    sample = _sample

    def __post_init__(self) -> None:
        faults = gain_faults(self)
        if not 0.0 < self.every < math.inf:
            faults.append(Fault("SampledCascade.every", "must be positive [s]", self.every))
        if self.delay not in range(MOST_DELAY):
            faults.append(Fault("SampledCascade.delay", "must be 0, 1 or 2 samples", self.delay))
        if faults:
            raise InputError(faults)

    @property
    def period(self) -> float:
        return self.every

    def ports(self, place: Place) -> Ports:
        waiting = tuple(State(f"waiting_current_{k + 1}", "A", memory=True) for k in range(MOST_DELAY))
        return Ports(
            states=(
                State("sampled_current", "A", memory=True),
                State("last_measured_position", "rad", memory=True),
                State("integrated_current", "A", memory=True),
                *waiting,
            ),
            needs=(*s.commanded(place)[:2], s.MEASURED_POSITION),
            contributes=(s.CURRENT_COMMAND,),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        rate = 1.0 / self.integral_time
        gains = (self.position_gain, self.speed_gain, rate, self.peak_current, place.ratio)
        return *gains, self.every, float(self.delay)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        measured = signals.get(f"{place.name}.{s.MEASURED_POSITION.name}", 0.0)
        speed = signals.get(f"{place.name}.{s.MOTOR_SPEED.name}", 0.0)
        return 0.0, measured - self.every * speed, 0.0, *(0.0,) * MOST_DELAY

    def quasi_static(self) -> Effect:
        return CascadeLoop(self.position_gain, self.speed_gain, self.integral_time, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("servo sample", self.every),)
