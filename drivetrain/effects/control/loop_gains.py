"""What a cascade does with its gains, continuous or sampled, and what gains may be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drivetrain.effects import signals as s
from drivetrain.effects.effect import Place
from drivetrain.errors import Fault
from drivetrain.jit import law

MOST_DELAY = 3  # samples


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
    """What a cascade asks for, and how its integrator grows."""
    grown = gains.speed * gains.rate * error
    asked = gains.speed * error + gathered + span * grown
    if not abs(asked) > gains.peak:
        return asked, grown, True
    # At the limit the integrator only goes back: what it gathered there would have to be undone.
    asked = gains.peak if asked > 0.0 else -gains.peak
    return asked, 0.0 if asked * error > 0.0 else grown, False


def missing_current(place: Place, signals: Mapping[str, float]) -> float:
    """What a loop must ask for at the start so that the load is held: what is not fed forward [A].

    Nothing where the command begins under way and a current is fed forward, as that is then the motion's.
    """
    fed = signals.get(f"{place.name}.{s.FED_CURRENT}", 0.0)
    under_way = any(signals.get(f"{place.name}.{one.name}", 0.0) != 0.0 for one in s.commanded(place)[1:])
    if fed != 0.0 and under_way:
        return 0.0
    return signals.get(f"{place.name}.{s.HOLDING_CURRENT}", 0.0) - fed


def integral_start(loop: Any, place: Place, signals: Mapping[str, float]) -> float:
    """What a cascade's integrator holds in equilibrium [A]; 0 where it has none."""
    if math.isinf(loop.integral_time):
        return 0.0
    return min(max(missing_current(place, signals), -loop.peak_current), loop.peak_current)


def sag(loop: Any, place: Place, signals: Mapping[str, float]) -> float:
    """How far a motor stays behind its command where no integrator of its cascade holds the load [rad]."""
    stiffness = loop.position_gain * loop.speed_gain
    if math.isfinite(loop.integral_time) or stiffness == 0.0:
        return 0.0
    return missing_current(place, signals) / stiffness


def sampling_faults(loop: Any) -> list[Fault]:
    """What is wrong with the period and the delay of a sampled controller."""
    kind, faults = type(loop).__name__, []
    if not 0.0 < loop.every < math.inf:
        faults.append(Fault(f"{kind}.every", "must be positive [s]", loop.every))
    if loop.delay not in range(MOST_DELAY):
        faults.append(Fault(f"{kind}.delay", "must be 0, 1 or 2 samples", loop.delay))
    return faults


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
