"""Loops of position and speed around the current: one spring, a continuous cascade, and that with samples."""

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

MOST_DELAY = 3  # samples
SOFT = 1e-3  # of the limit, within which a continuous integrator comes to rest: a rate that jumped would have no step
DELAY = Range("must be 0, 1 or 2 samples", 0.0, MOST_DELAY - 1.0, low_included=True)
NOTCH_DAMPING = Range("must be above 0 and at most 10 [-]", 0.0, 10.0)


@dataclass
class Gains:
    """Of a cascade: [1/s], [A s/rad], 1/integral time [1/s], peak current [A], ratio, whether its motor is coupled."""

    position: float
    speed: float
    rate: float
    peak: float
    ratio: float
    coupled: int


@law
def speed_error(gains: Any, wanted: Any, place: float, speed: float) -> float:
    """Wanted less true speed of a motor as measured at a position [rad] and a speed [rad/s]."""
    return gains.ratio * wanted.speed + gains.position * (gains.ratio * wanted.position - place) - speed


@law
def demanded_current(gains: Any, error: float, gathered: float, span: float, soft: float) -> Any:
    """What a cascade asks for, and how its integrator grows; beyond the limit less, within a soft share of it not."""
    grown = gains.speed * gains.rate * error
    demanded = gains.speed * error + gathered + span * grown
    beyond, band = abs(demanded) - gains.peak, soft * gains.peak
    if not beyond > 0.0:
        return demanded, grown, True
    # At the limit the integrator only goes back: what it gathered there would have to be undone.
    demanded = gains.peak if demanded > 0.0 else -gains.peak
    if demanded * error > 0.0:
        grown = grown * (1.0 - beyond / band) if beyond < band else 0.0
    return demanded, grown, False


def missing_current(place: Place, signals: Mapping[str, float]) -> float:
    """What a loop must ask for at the start so that the load is held: what is not fed forward [A].

    Nothing where the command begins under way and a current is fed forward, as that is then the motion's.
    """
    fed = signals.get(f"{place.name}.{s.FED_CURRENT}", 0.0)
    under_way = any(s.read(place, signals, one) != 0.0 for one in s.commanded(place)[1:])
    if fed != 0.0 and under_way:
        return 0.0
    return signals.get(f"{place.name}.{s.HOLDING_CURRENT}", 0.0) - fed


@dataclass
class PositionOwn:
    """What it keeps: gains in current [A/rad], [A s/rad], and the ratio."""

    stiffness: float
    damping: float
    ratio: float
    coupled: int


@joint_law(PositionOwn)
def _pull(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin, wanted, motor = joint.pin, command_of(joint, own.coupled), joint.motor
    late, slow = own.ratio * wanted.position - motor.position, own.ratio * wanted.speed - motor.speed
    pin.command += own.stiffness * late + own.damping * slow
    pin.damping += own.damping
    pin.stiffness += own.stiffness


@dataclass(frozen=True)
class PositionLoop(Effect):
    """Position controller that acts like a spring and a damper at the joint.

    Attributes:
        stiffness: Of that spring, at the joint [N m/rad].
        damping: Of that damper, at the joint [N m s/rad].
        torque_constant: That the controller believes in [N m/A].
    """

    stiffness: float
    damping: float
    torque_constant: float

    limits = ranges(
        stiffness=not_negative("N m/rad"), damping=not_negative("N m s/rad"),
        torque_constant=positive("N m/A"),
    )  # fmt: skip
    compute = _pull

    def ports(self, place: Place) -> Ports:
        return Ports(
            needs=(*s.commanded(place)[:2], s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS),
        )

    def own(self, place: Place) -> PositionOwn:
        scale = 1.0 / (self.torque_constant * place.ratio**2)
        return PositionOwn(self.stiffness * scale, self.damping * scale, place.ratio, place.coupled)

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """How far the motor stays behind its command in equilibrium [rad]."""
        stiffness = self.own(place).stiffness
        return missing_current(place, signals) / stiffness if stiffness > 0.0 else 0.0

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("error decays", self.damping / self.stiffness),) if self.stiffness > 0.0 else ()


@dataclass
class CascadeOwn:
    """What it keeps: its gains, and the integrator [A]."""

    gains: Gains
    integrated_current: float = 0.0
    integrated_current_rate: float = 0.0


@joint_law(CascadeOwn)
def _follow(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin, gains, motor = joint.pin, own.gains, joint.motor
    wanted = command_of(joint, gains.coupled)
    error = speed_error(gains, wanted, motor.position, motor.speed)
    demanded, grown, free = demanded_current(gains, error, own.integrated_current, 0.5 * h, SOFT)
    if free:
        pin.damping += gains.speed
        pin.stiffness += gains.speed * gains.position
    own.integrated_current_rate = grown
    pin.command += demanded


@dataclass(frozen=True)
class CascadeLoop(Effect):
    """Desired speed = commanded speed + gain x position error; current = gain x (speed error and its integral).

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

    limits = ranges(
        position_gain=not_negative("1/s"), speed_gain=not_negative("A s/rad"),
        integral_time=positive_or_infinite("s"), peak_current=positive_or_infinite("A"),
    )  # fmt: skip
    compute = _follow

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(State("integrated_current", "A", 1e-6),),
            needs=(*s.commanded(place)[:2], s.MOTOR_POSITION, s.MOTOR_SPEED),
            contributes=(s.CURRENT_COMMAND, s.CURRENT_DAMPING, s.CURRENT_STIFFNESS),
        )

    def own(self, place: Place) -> Any:
        return CascadeOwn(self.gains(place))

    def gains(self, place: Place) -> Gains:
        """As the laws read them."""
        integral = 1.0 / self.integral_time
        return Gains(self.position_gain, self.speed_gain, integral, self.peak_current, place.ratio, place.coupled)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        """What its integrator holds in equilibrium [A]; 0 where it has none."""
        return (0.0 if math.isinf(self.integral_time) else self._within(missing_current(place, signals)),)

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """How far the motor stays behind its command in equilibrium, where no integrator holds the load [rad]."""
        stiffness = self.position_gain * self.speed_gain
        if math.isfinite(self.integral_time) or stiffness == 0.0:
            return 0.0
        return missing_current(place, signals) / stiffness

    def _within(self, current: float) -> float:
        return min(max(current, -self.peak_current), self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        outer = (TimeScale("position loop", 1.0 / self.position_gain),) if self.position_gain > 0.0 else ()
        return (*outer, TimeScale("integral", self.integral_time)) if self.integral_time < math.inf else outer


@dataclass
class SampledOwn:
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


@joint_law(SampledOwn)
def _give_out(t: Any, h: Any, own: Any, joint: Any) -> None:
    joint.pin.command += own.sampled_current


@joint_law(SampledOwn)
def _sample(t: Any, h: Any, own: Any, joint: Any) -> None:
    wanted, measured = command_of(joint, own.gains.coupled), joint.measured_position
    speed = (measured - own.last_measured_position) / own.period
    own.last_measured_position = measured
    whole = speed_error(own.gains, wanted, measured, speed)
    zeros, poles = own.zeros, own.poles
    error = zeros[0] * whole + own.notched_once
    own.notched_once = zeros[1] * whole - poles[1] * error + own.notched_twice
    own.notched_twice = zeros[2] * whole - poles[2] * error
    demanded, grown, _ = demanded_current(own.gains, error, own.integrated_current, own.period, 0.0)
    own.integrated_current += own.period * grown
    # What is computed now is given out some samples later.
    waiting = own.waiting_current
    waiting[own.delay] = demanded
    own.sampled_current = waiting[0]
    for k in range(own.delay):
        waiting[k] = waiting[k + 1]


@dataclass(frozen=True)
class SampledCascade(CascadeLoop):
    """Sampled ``CascadeLoop``: the speed is the difference of two measured angles divided by the period.

    Attributes:
        every: Period [s].
        delay: Samples from measuring to giving out, 0 to 2.
        notch: Middle of a notch filter in the speed's error [rad/s]; 0: none.
        notch_zeros, notch_poles: Its damping ratios [-]: how deep it is, and how wide.
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
    compute = _give_out
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
        demanded, gathered = self._within(missing_current(place, signals)), super().start(place, signals)
        waiting = (demanded,) * self.delay + (0.0,) * (MOST_DELAY - self.delay)
        last = measured - self.every * s.read(place, signals, s.MOTOR_SPEED)
        return demanded, last, *gathered, *waiting, 0.0, 0.0

    def quasi_static(self) -> Effect | None:
        return CascadeLoop(self.position_gain, self.speed_gain, self.integral_time, self.peak_current)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("servo sample", self.every),)
