"""What a cascade does with its gains, continuous or sampled, and what gains may be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.effects.effect import Place
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class Gains:
    """Of a cascade: [1/s], [A s/rad], 1/integral time [1/s], peak current [A], ratio, whether its motor is coupled."""

    position: float
    speed: float
    rate: float
    peak: float
    ratio: float
    coupled: int


def gains_of(loop: Any, place: Place) -> Gains:
    """The gains of a cascade at a joint."""
    integral = 1.0 / loop.integral_time
    return Gains(loop.position_gain, loop.speed_gain, integral, loop.peak_current, place.ratio, place.coupled)


@law
def speed_error(gains: Any, wanted: Any, place: float, speed: float) -> float:
    """Wanted less true speed of a motor that the loop knows at a place [rad] and a speed [rad/s]."""
    return gains.ratio * wanted.speed + gains.position * (gains.ratio * wanted.position - place) - speed


@law
def asked_current(gains: Any, error: float, gathered: float, span: float) -> Any:
    """What a cascade asks for, and how its integrator grows.

    Args:
        error: Of the speed [rad/s].
        gathered: By the integrator [A].
        span: For which it goes on until the current is asked for [s].

    Returns:
        Current [A]; growth of the integrator [A/s]; whether the current is between its limits.
    """
    grown = gains.speed * gains.rate * error
    asked = gains.speed * error + gathered + span * grown
    if not abs(asked) > gains.peak:
        return asked, grown, True
    # At the limit the integrator only goes back: what it gathered there would have to be undone.
    asked = gains.peak if asked > 0.0 else -gains.peak
    return asked, 0.0 if asked * error > 0.0 else grown, False


def gain_faults(loop: Any) -> list[Fault]:
    """What is wrong with the gains of a cascade, continuous or sampled."""
    kind = type(loop).__name__
    faults = [
        Fault(f"{kind}.{name}", "must not be negative and finite", getattr(loop, name))
        for name in ("position_gain", "speed_gain")
        if not 0.0 <= getattr(loop, name) < math.inf
    ]
    faults += [
        Fault(f"{kind}.{name}", f"must be positive [{unit}]", getattr(loop, name))
        for name, unit in (("integral_time", "s"), ("peak_current", "A"))
        if not getattr(loop, name) > 0.0
    ]
    return faults
