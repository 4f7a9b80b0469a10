"""Position and speed loop as a digital controller runs them: at samples, on a measured angle, with a delay."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.loops.servo_axis import Notch, notch_filter
from drivetrain.effects import signals as s
from drivetrain.effects.control.cascade_loop import CascadeLoop
from drivetrain.effects.control.loop_gains import (
    MOST_DELAY,
    Gains,
    asked_current,
    gain_faults,
    gains_of,
    integral_start,
    missing_current,
    sag,
    sampling_faults,
    speed_error,
)
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.laws import command_of, joint_law
from drivetrain.errors import Fault, InputError


@dataclass
class Own:
    """What it keeps: as ``CascadeLoop``, period [s] and delay; currents [A] given out, integrated, and waiting.

    And the notch, zeros over poles: its coefficients, and what it carries from sample to sample [rad/s].
    """

    gains: Gains
    period: float
    delay: int
    zeros: Annotated[Array, 3]
    poles: Annotated[Array, 3]
    sampled_current: float = 0.0
    last_measured_position: float = 0.0
    integrated_current: float = 0.0
    waiting_current: Annotated[Array, MOST_DELAY] = field(default_factory=lambda: np.zeros(MOST_DELAY))
    notched_once: float = 0.0
    notched_twice: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    joint.pin.command += own.sampled_current


@joint_law(Own)
def _sample(t: Any, h: Any, own: Any, joint: Any) -> None:
    wanted, measured = command_of(joint, own.gains.coupled), joint.measured_position
    speed = (measured - own.last_measured_position) / own.period
    own.last_measured_position = measured
    whole = speed_error(own.gains, wanted, measured, speed)
    zeros, poles = own.zeros, own.poles
    error = zeros[0] * whole + own.notched_once
    own.notched_once = zeros[1] * whole - poles[1] * error + own.notched_twice
    own.notched_twice = zeros[2] * whole - poles[2] * error
    asked, grown, _ = asked_current(own.gains, error, own.integrated_current, own.period)
    own.integrated_current += own.period * grown
    # What is computed now is given out some samples later.
    waiting = own.waiting_current
    waiting[own.delay] = asked
    own.sampled_current = waiting[0]
    for k in range(own.delay):
        waiting[k] = waiting[k + 1]


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
        notch: Middle of a notch filter in the speed's error [rad/s]; 0: none.
        notch_zeros, notch_poles: Its damping ratios [-]: how deep it is, and how wide.
    """

    position_gain: float
    speed_gain: float
    integral_time: float = math.inf
    peak_current: float = math.inf
    every: float = 1e-3
    delay: int = 1
    notch: float = 0.0
    notch_zeros: float = 0.1
    notch_poles: float = 0.7

    compute = _compute
    sample = _sample

    def __post_init__(self) -> None:
        faults = [*gain_faults(self), *sampling_faults(self)]
        if not 0.0 <= self.notch < math.inf or (self.every > 0.0 and self.notch * self.every >= math.pi):
            hint = "a sampled filter reaches half of the sampling rate"
            faults.append(Fault("SampledCascade.notch", "must be from 0 to below pi / every [rad/s]", self.notch, hint))
        faults += [
            Fault(f"SampledCascade.{name}", "must be above 0 and at most 10 [-]", getattr(self, name))
            for name in ("notch_zeros", "notch_poles")
            if not 0.0 < getattr(self, name) <= 10.0
        ]
        if faults:
            raise InputError(faults)

    @property
    def period(self) -> float:
        return self.every

    def ports(self, place: Place) -> Ports:
        waiting = tuple(
            State(f"waiting_current_{k + 1}", "A", memory=True, path=f"waiting_current.{k}") for k in range(MOST_DELAY)
        )
        return Ports(
            states=(
                State("sampled_current", "A", memory=True),
                State("last_measured_position", "rad", memory=True),
                State("integrated_current", "A", memory=True),
                *waiting,
                State("notched_once", "rad/s", memory=True),
                State("notched_twice", "rad/s", memory=True),
            ),
            needs=(*s.commanded(place)[:2], s.MEASURED_POSITION),
            contributes=(s.CURRENT_COMMAND,),
        )

    def own(self, place: Place) -> Own:
        zeros = poles = np.array([1.0, 0.0, 0.0])
        if self.notch > 0.0:
            zeros, poles = notch_filter(Notch(self.notch, self.notch_zeros, self.notch_poles), self.every)
        return Own(gains_of(self, place), self.every, self.delay, zeros, poles)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        measured = signals.get(f"{place.name}.{s.MEASURED_POSITION.name}", 0.0)
        speed = signals.get(f"{place.name}.{s.MOTOR_SPEED.name}", 0.0)
        asked = min(max(missing_current(place, signals), -self.peak_current), self.peak_current)
        waiting = (asked,) * self.delay + (0.0,) * (MOST_DELAY - self.delay)
        return asked, measured - self.every * speed, integral_start(self, place, signals), *waiting, 0.0, 0.0

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """How far the motor stays behind its command in equilibrium [rad]."""
        return sag(self, place, signals)

    def quasi_static(self) -> Effect:
        return CascadeLoop(self.position_gain, self.speed_gain, self.integral_time, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("servo sample", self.every),)
