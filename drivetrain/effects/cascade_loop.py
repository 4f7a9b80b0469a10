"""Position loop around speed loop, continuous: what most servo amplifiers do, as if they did it without samples."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, State, TimeScale
from drivetrain.effects.loop_gains import gain_faults
from drivetrain.errors import InputError


@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        place, gain, rate, peak, ratio = numbers[at], numbers[at + 1], numbers[at + 2], numbers[at + 3], numbers[at + 4]
        wanted = ratio * signals[words[row + 3]] + place * (ratio * signals[words[row + 2]] - signals[words[row + 4]])
        error = wanted - signals[words[row + 5]]
        grown = gain * rate * error
        middle = x[words[row + 1]] + 0.5 * h * grown
        asked = gain * error + middle
        if abs(asked) > peak:
            # At the limit the integrator only goes back: what it gathered there would have to be undone.
            asked = peak if asked > 0.0 else -peak
            if asked * error > 0.0:
                grown = 0.0
        else:
            signals[words[row + 7]] += gain
            signals[words[row + 8]] += gain * place
        rates[words[row + 1]] = grown
        signals[words[row + 6]] += asked


@dataclass(frozen=True)
class CascadeLoop(Effect):
    """Speed wanted = commanded speed + gain x position error; current = gain x speed error and its integral.

    Attributes:
        position_gain: Of the outer loop [1/s].
        speed_gain: Of the inner one, at the motor [A s/rad].
        integral_time: In which the integral adds as much as the gain [s]; infinite: no integral.
        peak_current: At which command and integrator stop [A].
    """

    position_gain: float
    speed_gain: float
    integral_time: float = math.inf
    peak_current: float = math.inf

    compute = _compute

    def __post_init__(self) -> None:
        faults = gain_faults(self)
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State("integrated_current", "A", 1e-6),),
            needs=(*s.commanded(place)[:2], s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        rate = 1.0 / self.integral_time
        return self.position_gain, self.speed_gain, rate, self.peak_current, place.ratio

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        return (0.0,)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        outer = (TimeScale("position loop", 1.0 / self.position_gain),) if self.position_gain > 0.0 else ()
        return (*outer, TimeScale("integral", self.integral_time)) if self.integral_time < math.inf else outer
