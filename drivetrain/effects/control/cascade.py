"""Position and speed loops that command a current: a spring-damper law, a continuous and a sampled cascade."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.loops.servo_axis import Notch, notch_filter
from drivetrain.drive.ranges import Range
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.fields import not_negative, positive, positive_or_infinite, ranges
from drivetrain.effects.laws import command_of, joint_law
from drivetrain.errors import Fault
from drivetrain.jit import law

MOST_DELAY = 3  # length of the queue of delayed commands, in samples
# Band above the current limit, as a share of it, in which a continuous integrator is slowed down to rest. A rate that
# jumped there would make the right-hand side discontinuous.
SOFT_BAND = 1e-3
DELAY = Range("must be 0, 1 or 2 samples", 0.0, MOST_DELAY - 1.0, low_included=True)
NOTCH_DAMPING = Range("must be above 0 and at most 10 [-]", 0.0, 10.0)


@dataclass
class Gains:
    """Gains and limit of a cascade."""

    position: float  # position gain [1/s]
    speed: float  # speed gain, at the motor [A s/rad]
    rate: float  # 1 / integral time [1/s]
    peak: float  # peak current [A]
    ratio: float  # motor angle over joint coordinate [- or rad/m]
    coupled: int  # whether the motor is coupled to others


@law
def speed_error(gains: Any, command: Any, position: float, speed: float) -> float:
    """Speed error of a cascade at the motor [rad/s]: commanded speed plus position gain x position error, minus speed.

    ``position`` and ``speed`` are the measured ones of the motor [rad], [rad/s].
    """
    return gains.ratio * command.speed + gains.position * (gains.ratio * command.position - position) - speed


@law
def demanded_current(gains: Any, error: float, integrator: float, lead: float, soft: float) -> Any:
    """Current command of a cascade within its limit [A], rate of its integrator [A/s], and whether it is not limited.

    ``error`` is the speed error [rad/s], ``lead`` the time over which the integrator advances before its value is used
    [s], ``soft`` the band above the limit, as a share of it, in which the integrator slows down to rest.
    """
    rate = gains.speed * gains.rate * error
    demanded = gains.speed * error + integrator + lead * rate
    excess, band = abs(demanded) - gains.peak, soft * gains.peak
    if not excess > 0.0:
        return demanded, rate, True
    # Anti-windup: at the limit the integrator may only move away from it.
    demanded = gains.peak if demanded > 0.0 else -gains.peak
    if demanded * error > 0.0:
        rate = rate * (1.0 - excess / band) if excess < band else 0.0
    return demanded, rate, False


def loop_holding_current(place: Place, signals: Mapping[str, float]) -> float:
    """Current that a loop must command at the start to hold the load, beyond the feed-forward [A].

    Zero where the command begins in motion and a current is fed forward, since that one then includes the motion.
    """
    fed = signals.get(f"{place.name}.{s.FED_CURRENT}", 0.0)
    under_way = any(s.read(place, signals, one) != 0.0 for one in s.commanded(place)[1:])
    if fed != 0.0 and under_way:
        return 0.0
    return signals.get(f"{place.name}.{s.HOLDING_CURRENT}", 0.0) - fed


@dataclass
class PositionOwn:
    stiffness: float  # current per motor angle [A/rad]
    damping: float  # current per motor speed [A s/rad]
    ratio: float  # motor angle over joint coordinate [- or rad/m]
    coupled: int  # whether the motor is coupled to others


@joint_law(PositionOwn)
def _position_loop(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Contribute the current of the spring-damper law, and its derivatives."""
    pin, command, motor = joint.pin, command_of(joint, own.coupled), joint.motor
    lag, speed_lag = own.ratio * command.position - motor.position, own.ratio * command.speed - motor.speed
    pin.command += own.stiffness * lag + own.damping * speed_lag
    pin.damping += own.damping
    pin.stiffness += own.stiffness


@dataclass(frozen=True)
class PositionLoop(Effect):
    """Position controller that acts like a spring and a damper at the joint.

    Attributes:
        stiffness: Stiffness of that spring, at the joint [N m/rad].
        damping: Damping of that damper, at the joint [N m s/rad].
        torque_constant: Torque constant that the controller assumes [N m/A].
    """

    stiffness: float
    damping: float
    torque_constant: float

    limits = ranges(
        stiffness=not_negative("N m/rad"), damping=not_negative("N m s/rad"),
        torque_constant=positive("N m/A"),
    )  # fmt: skip
    compute = _position_loop

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(*s.commanded(place)[:2], s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS),
        )

    def own(self, place: Place) -> PositionOwn:
        scale = 1.0 / (self.torque_constant * place.ratio**2)
        return PositionOwn(self.stiffness * scale, self.damping * scale, place.ratio, place.coupled)

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """Position error of the motor in equilibrium, with which the loop holds the load [rad]."""
        stiffness = self.own(place).stiffness
        return loop_holding_current(place, signals) / stiffness if stiffness > 0.0 else 0.0

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("error decays", self.damping / self.stiffness),) if self.stiffness > 0.0 else ()


@dataclass
class CascadeOwn:
    """Record of the effect: its gains, and the integrator with its rate [A], [A/s]."""

    gains: Gains
    integrated_current: float = 0.0
    integrated_current_rate: float = 0.0


@joint_law(CascadeOwn)
def _cascade(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Contribute the current of the cascade, with its derivatives while it is not limited; fill the integrator rate."""
    pin, gains, motor = joint.pin, own.gains, joint.motor
    command = command_of(joint, gains.coupled)
    error = speed_error(gains, command, motor.position, motor.speed)
    demanded, rate, free = demanded_current(gains, error, own.integrated_current, 0.5 * h, SOFT_BAND)
    if free:
        pin.damping += gains.speed
        pin.stiffness += gains.speed * gains.position
    own.integrated_current_rate = rate
    pin.command += demanded


@dataclass(frozen=True)
class CascadeLoop(Effect):
    """Desired speed = commanded speed + gain x position error; current = gain x (speed error and its integral).

    Attributes:
        position_gain: Gain of the position loop [1/s].
        speed_gain: Gain of the speed loop, at the motor [A s/rad].
        integral_time: Integral time of the speed loop [s]; infinite: no integrator.
        peak_current: Limit of the current command, with anti-windup [A].
    """

    position_gain: float
    speed_gain: float
    integral_time: float = math.inf
    peak_current: float = math.inf

    limits = ranges(
        position_gain=not_negative("1/s"), speed_gain=not_negative("A s/rad"),
        integral_time=positive_or_infinite("s"), peak_current=positive_or_infinite("A"),
    )  # fmt: skip
    compute = _cascade

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State("integrated_current", "A", 1e-6),),
            needs=(*s.commanded(place)[:2], s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS),
        )

    def own(self, place: Place) -> Any:
        return CascadeOwn(self.gains(place))

    def gains(self, place: Place) -> Gains:
        """The gains as a record for the laws."""
        integral = 1.0 / self.integral_time
        return Gains(self.position_gain, self.speed_gain, integral, self.peak_current, place.ratio, place.coupled)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        """The integrator in equilibrium [A]; 0 where there is none."""
        return (0.0 if math.isinf(self.integral_time) else self._within(loop_holding_current(place, signals)),)

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """Position error of the motor in equilibrium, where no integrator holds the load [rad]."""
        stiffness = self.position_gain * self.speed_gain
        if math.isfinite(self.integral_time) or stiffness == 0.0:
            return 0.0
        return loop_holding_current(place, signals) / stiffness

    def _within(self, current: float) -> float:
        return min(max(current, -self.peak_current), self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        outer = (TimeScale("position loop", 1.0 / self.position_gain),) if self.position_gain > 0.0 else ()
        return (*outer, TimeScale("integral", self.integral_time)) if self.integral_time < math.inf else outer


@dataclass
class SampledOwn:
    gains: Gains
    period: float  # sampling period [s]
    delay: int  # samples from measuring to output
    # coefficients of the notch filter: numerator and denominator
    zeros: Annotated[Array, 3]
    poles: Annotated[Array, 3]
    sampled_current: float = 0.0  # output [A]
    last_measured_position: float = 0.0  # [rad]
    integrated_current: float = 0.0  # integrator [A]
    waiting_current: Annotated[Array, MOST_DELAY] = field(default_factory=lambda: np.zeros(MOST_DELAY))  # delayed [A]
    # state of the notch filter [rad/s]
    notched_once: float = 0.0
    notched_twice: float = 0.0


@joint_law(SampledOwn)
def _output(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Contribute the current of the last sample."""
    joint.pin.command += own.sampled_current


@joint_law(SampledOwn)
def _sample(t: Any, h: Any, own: Any, joint: Any) -> None:
    """One sample of the controller: speed from measured angles, notch filter, cascade, delay."""
    command, measured = command_of(joint, own.gains.coupled), joint.measured_position
    speed = (measured - own.last_measured_position) / own.period
    own.last_measured_position = measured
    unfiltered = speed_error(own.gains, command, measured, speed)
    zeros, poles = own.zeros, own.poles
    error = zeros[0] * unfiltered + own.notched_once
    own.notched_once = zeros[1] * unfiltered - poles[1] * error + own.notched_twice
    own.notched_twice = zeros[2] * unfiltered - poles[2] * error
    demanded, rate, _ = demanded_current(own.gains, error, own.integrated_current, own.period, 0.0)
    own.integrated_current += own.period * rate
    # The computed current is output after the delay.
    waiting = own.waiting_current
    waiting[own.delay] = demanded
    own.sampled_current = waiting[0]
    for k in range(own.delay):
        waiting[k] = waiting[k + 1]


@dataclass(frozen=True)
class SampledCascade(CascadeLoop):
    """Sampled ``CascadeLoop``: the speed is the difference of two measured angles divided by the period.

    A sampled current loop that samples at the same instant still reads the command before it.

    Attributes:
        every: Sampling period [s].
        delay: Number of samples from measuring to output, 0 to 2.
        notch: Centre frequency of a notch filter for the speed error [rad/s]; 0: none.
        notch_zeros, notch_poles: Damping ratios of its numerator and denominator [-], which give its depth and width.
    """

    every: float = 1e-3
    delay: int = 1
    notch: float = 0.0
    notch_zeros: float = 0.1
    notch_poles: float = 0.7

    limits = ranges(
        **CascadeLoop.limits, every=positive("s"), delay=DELAY,
        notch_zeros=NOTCH_DAMPING, notch_poles=NOTCH_DAMPING,
    )  # fmt: skip
    compute = _output
    sample = _sample

    def faults(self) -> list[Fault]:
        if 0.0 <= self.notch < math.inf and self.notch * self.every < math.pi:
            return []
        hint = "a sampled filter reaches half of the sampling rate"
        return [Fault("SampledCascade.notch", "must be from 0 to below pi / every [rad/s]", self.notch, hint)]

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

    def own(self, place: Place) -> Any:
        zeros = poles = np.array([1.0, 0.0, 0.0])
        if self.notch > 0.0:
            zeros, poles = notch_filter(Notch(self.notch, self.notch_zeros, self.notch_poles), self.every)
        return SampledOwn(self.gains(place), self.every, self.delay, zeros, poles)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        measured = s.read(place, signals, s.MEASURED_POSITION)
        demanded, gathered = self._within(loop_holding_current(place, signals)), super().start(place, signals)
        waiting = (demanded,) * self.delay + (0.0,) * (MOST_DELAY - self.delay)
        last = measured - self.every * s.read(place, signals, s.MOTOR_SPEED)
        return demanded, last, *gathered, *waiting, 0.0, 0.0

    def quasi_static(self) -> Effect | None:
        return CascadeLoop(self.position_gain, self.speed_gain, self.integral_time, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("servo sample", self.every),)
