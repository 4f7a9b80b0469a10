"""LuGre friction: bristles that bend before they slip, where what happens before sliding matters.

    z' = v - s0 |v| z / g(v),   torque = s0 z + s1 z' + s2 v,   g(v) = Fc + (Fs - Fc) exp(-(|v| / vs)^2)

Reference: Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.drive.exponentials import first, second
from drivetrain.effects import signals as s
from drivetrain.effects.bounds import LARGEST_ANSWER, bounded
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, Role, Signal, State, TimeScale
from drivetrain.effects.estimate import Conditions, Estimate
from drivetrain.effects.field_types import side_faults
from drivetrain.errors import Fault, InputError


# long kernel: the law at an instant, and over a step with its slope
@Compiled
def _compute(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        bend, speed = x[words[row + 1]], signals[words[row + 2]] - signals[words[row + 3]]
        stiff, damp, viscous = numbers[at], numbers[at + 1], numbers[at + 2]
        slip = numbers[at + 3] + (numbers[at + 4] - numbers[at + 3]) * math.exp(-((speed / numbers[at + 5]) ** 2))
        fade = stiff * abs(speed) / slip
        rate = speed - fade * bend
        if h == 0.0:
            rates[words[row + 1]] = rate
            signals[words[row + 4]] -= stiff * bend + damp * rate + viscous * speed
            continue
        # With the speed held z is linear in time, and its exponential the step.
        grown = first(-fade * h)
        mean = bend + h * rate * second(-fade * h, grown)
        rates[words[row + 1]] = rate * grown
        signals[words[row + 4]] -= stiff * mean + damp * rate * grown + viscous * speed
        # How the mean torque grows with the speed, by a small difference: the law has a kink at rest.
        small = 1e-6 * numbers[at + 5]
        other = speed + (small if speed >= 0.0 else -small)
        slip = numbers[at + 3] + (numbers[at + 4] - numbers[at + 3]) * math.exp(-((other / numbers[at + 5]) ** 2))
        fade = stiff * abs(other) / slip
        shifted = other - fade * bend
        grown_too = first(-fade * h)
        mean_too = bend + h * shifted * second(-fade * h, grown_too)
        slope = stiff * (mean_too - mean) + damp * (shifted * grown_too - rate * grown)
        slope = slope / (other - speed) + viscous
        if slope > 0.0:
            signals[words[row + 5]] += slope


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        at = words[row]
        bend, speed = x[words[row + 1]], signals[words[row + 2]] - signals[words[row + 3]]
        stiff, damp, viscous = numbers[at], numbers[at + 1], numbers[at + 2]
        slip = numbers[at + 3] + (numbers[at + 4] - numbers[at + 3]) * math.exp(-((speed / numbers[at + 5]) ** 2))
        fade = stiff * abs(speed) / slip
        rate, mean = speed - fade * bend, bend
        if h > 0.0:
            grown = first(-fade * h)
            mean += h * rate * second(-fade * h, grown)
            rate *= grown
            rates[words[row + 1]] = rate  # now that the speed is known: the law has seen a guess of it
        torque = stiff * mean + damp * rate + viscous * speed
        signals[words[row + 6]] = torque
        # What goes in less what bends the bristles.
        stored = stiff * rate * (bend + 0.5 * h * rate)
        signals[words[row + 7]] = torque * speed - stored
        signals[words[row + 8]] = 0.5 * stiff * bend * bend


@dataclass(frozen=True)
class LuGreFriction(Effect):
    """Friction with a state: it bends before it slides, lags behind the speed, and never holds exactly.

    ``DryFriction`` sticks exactly and costs less; this one is for questions about what happens before sliding.

    Attributes:
        stiffness: s0 of the bristles [N m/rad].
        coulomb: Fc [N m].
        static: Fs [N m]; None: as ``coulomb``.
        stribeck_speed: vs [rad/s].
        damping: s1 of the bristles [N m s/rad].
        viscous: s2 [N m s/rad].
        side: ``joint``, ``motor``, or ``shaft``: behind the gear, where motors are coupled.
    """

    stiffness: float
    coulomb: float
    static: float | None = None
    stribeck_speed: float = 0.01
    damping: float = 0.0
    viscous: float = 0.0
    side: str = "joint"

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = [
            Fault(f"LuGreFriction.{name}", "must be positive", getattr(self, name))
            for name in ("stiffness", "coulomb", "stribeck_speed")
            if not 0.0 < getattr(self, name) < math.inf
        ]
        faults += [
            Fault(f"LuGreFriction.{name}", "must not be negative [N m s/rad]", getattr(self, name))
            for name in ("damping", "viscous")
            if not 0.0 <= getattr(self, name) < math.inf
        ]
        if self.static is not None and not self.coulomb <= self.static < math.inf:
            faults.append(Fault("LuGreFriction.static", "must be at least the coulomb torque [N m]", self.static))
        faults += side_faults(self)
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        speed, torque, damping = s.of_side(self.side, place)
        loss, energy = Signal(f"{self.side}_lugre_power", "W"), Signal(f"{self.side}_bristle_energy", "J")
        return Ports(
            states=(State(f"{self.side}_bristle_bend", "rad", 1e-3 * self.coulomb / self.stiffness),),
            needs=(speed, s.MOTOR_SURFACE_SPEED if self.side == "motor" else s.SURFACE_SPEED),
            contributes=(torque, damping),
            outputs=(Signal(f"{self.side}_lugre_torque", "N m"), loss, energy),
            powers={loss.name: Role.LOSS},
            stores=(energy.name,),
        )

    def numbers(self, place: Place) -> Sequence[float]:
        static = self.coulomb if self.static is None else self.static
        return self.stiffness, self.damping, self.viscous, self.coulomb, static, self.stribeck_speed

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        name = s.of_side(self.side, place)[0].name
        speed = signals.get(f"{place.name}.{name}", 0.0)
        if speed == 0.0:
            return (0.0,)
        _, _, _, low, high, stribeck = self.numbers(place)
        slip = low + (high - low) * math.exp(-(min(abs(speed / stribeck), 1e3) ** 2))
        return (math.copysign(slip / self.stiffness, speed),)

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        """All that its bristles can take, as a torque that the loop answers.

        The bend never leaves Fs / s0, so the bristles' torque never leaves Fs: at rest it may be anything up to that;
        sliding it is the curve, and within the first Fs / s0 of a motion what damps the bristles comes on top. It is
        not fed forward, so the loop answers all of it, however it varies: in current by no more than
        ``LARGEST_ANSWER`` times, in position by no more than bound over stiffness.
        """
        series = conditions.series
        if series is None:
            return Estimate(valid=False, why="the task is not known: keep it")
        motor, ratio = self.side == "motor", abs(place.ratio)
        speed = np.abs(series.speed) * (ratio if motor else 1.0)
        rise = float(np.abs(series.acceleration).max()) * (ratio if motor else 1.0)
        stiff, damp, viscous, low, high, fall = self.numbers(place)
        torque = low + (high - low) * np.exp(-(np.minimum(speed / fall, 30.0) ** 2)) + viscous * speed
        # Over the first bend the speed comes to sqrt(2 a Fs / s0), and that much of the damping is felt.
        first_bend = math.sqrt(2.0 * rise * high / stiff)
        torque += np.where(speed < 3.0 * first_bend, damp * np.minimum(speed, first_bend), 0.0)
        torque = np.where(series.resting, high, torque)
        at_motor = torque if motor else torque / ratio * conditions.mesh_share
        away = float(at_motor.max()) * ratio / conditions.loop_stiffness
        error = LARGEST_ANSWER * at_motor / conditions.torque_constant
        power = torque * speed if motor else None
        held = math.isfinite(conditions.loop_stiffness)
        why = "all that the bristles take, answered by the loop"
        return bounded(conditions, error, why, deviation=away, power=power, valid=held)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("bristles slip", self.coulomb / (self.stiffness * self.stribeck_speed)),)
