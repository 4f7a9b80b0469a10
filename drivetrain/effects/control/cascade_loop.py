"""Position loop around speed loop, continuous: what most servo amplifiers do, as if they did it without samples."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.control.loop_gains import (
    Gains,
    asked_current,
    gain_faults,
    gains_of,
    integral_start,
    sag,
    speed_error,
)
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.laws import command_of, joint_law
from drivetrain.errors import InputError


@dataclass
class Own:
    """What it keeps: its gains, and the integrator [A]."""

    gains: Gains
    integrated_current: float = 0.0
    integrated_current_rate: float = 0.0


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    pin, gains, motor = joint.pin, own.gains, joint.motor
    wanted = command_of(joint, gains.coupled)
    error = speed_error(gains, wanted, motor.position, motor.speed)
    asked, grown, free = asked_current(gains, error, own.integrated_current, 0.5 * h)
    if free:
        pin.damping += gains.speed
        pin.stiffness += gains.speed * gains.position
    own.integrated_current_rate = grown
    pin.command += asked


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

    def own(self, place: Place) -> Own:
        return Own(gains_of(self, place))

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        return (integral_start(self, place, signals),)

    def sag(self, place: Place, signals: Mapping[str, float]) -> float:
        """How far the motor stays behind its command in equilibrium [rad]."""
        return sag(self, place, signals)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        outer = (TimeScale("position loop", 1.0 / self.position_gain),) if self.position_gain > 0.0 else ()
        return (*outer, TimeScale("integral", self.integral_time)) if self.integral_time < math.inf else outer
