"""LuGre friction: a bristle model with a deflection state, for questions about the behaviour before sliding.

    z' = v - s0 |v| z / g(v),   torque = s0 z + s1 z' + s2 v,   g(v) = Fc + (Fs - Fc) exp(-(|v| / vs)^2)

Reference: Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.thermal.exponentials import first, second
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Signal, State, TimeScale
from drivetrain.effects.fields import Side, not_negative, positive, ranges
from drivetrain.effects.laws import MOTOR, flange_of, joint_law, side_of
from drivetrain.errors import Fault
from drivetrain.jit import law


@dataclass
class Own:
    side: int
    # constants of the law, as in ``LuGreFriction``
    stiffness: float
    damping: float
    viscous: float
    coulomb: float
    static: float
    stribeck_speed: float
    # deflection z of the bristles [rad], and its rate [rad/s]
    bend: float = 0.0
    bend_rate: float = 0.0
    torque: float = 0.0  # friction torque [N m]
    power: float = 0.0  # power lost [W]
    energy: float = 0.0  # elastic energy of the bristles [J]


@law
def _slip_torque(own: Any, speed: float) -> float:
    """Friction torque g(v) of steady slipping, without its viscous part [N m]."""
    share = speed / own.stribeck_speed
    return own.coulomb + (own.static - own.coulomb) * math.exp(-share * share)


@law
def _deflection_rate(own: Any, speed: float) -> tuple[float, float]:
    """Rate of the deflection z [rad/s], and its decay rate s0 |v| / g(v) [1/s]."""
    fade = own.stiffness * abs(speed) / _slip_torque(own, speed)
    return speed - fade * own.bend, fade


@law
def _mean_deflection(own: Any, speed: float, h: float) -> tuple[float, float]:
    """Mean deflection [rad] and mean rate [rad/s] over a step of length h [s].

    For a constant speed the equation of z is linear, so both are exact.
    """
    rate, fade = _deflection_rate(own, speed)
    grown = first(-fade * h)
    return own.bend + h * rate * second(-fade * h, grown), rate * grown


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    flange = flange_of(joint, own.side)
    speed = flange.speed - (joint.motor if own.side == MOTOR else joint.load).surface_speed
    if h == 0.0:
        own.bend_rate, _ = _deflection_rate(own, speed)
        flange.torque -= own.stiffness * own.bend + own.damping * own.bend_rate + own.viscous * speed
        return
    mean, rate = _mean_deflection(own, speed, h)
    own.bend_rate = rate
    flange.torque -= own.stiffness * mean + own.damping * rate + own.viscous * speed
    # Derivative of the mean torque by the speed, by a one-sided difference, since the law has a kink at rest.
    small = 1e-6 * own.stribeck_speed
    other_speed = speed + (small if speed >= 0.0 else -small)
    mean_other, rate_other = _mean_deflection(own, other_speed, h)
    slope = own.stiffness * (mean_other - mean) + own.damping * (rate_other - rate)
    slope = slope / (other_speed - speed) + own.viscous
    if slope > 0.0:
        flange.damping += slope


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    speed = flange_of(joint, own.side).speed - (joint.motor if own.side == MOTOR else joint.load).surface_speed
    mean, (rate, _) = own.bend, _deflection_rate(own, speed)
    if h > 0.0:
        mean, rate = _mean_deflection(own, speed, h)
        own.bend_rate = rate  # with the speed of the solution; ``compute`` knows only the guess
    own.torque = own.stiffness * mean + own.damping * rate + own.viscous * speed
    # Mechanical power minus the power stored in the bristles.
    own.power = own.torque * speed - own.stiffness * rate * (own.bend + 0.5 * h * rate)
    own.energy = 0.5 * own.stiffness * own.bend * own.bend


@dataclass(frozen=True)
class LuGreFriction(Effect):
    """LuGre friction: it deflects before it slides, lags behind the speed, and never holds exactly.

    ``DryFriction`` sticks exactly and needs less computing time; this one is for the behaviour before sliding.

    Attributes:
        stiffness: Stiffness s0 of the bristles [N m/rad].
        coulomb: Coulomb friction Fc [N m].
        static: Static friction Fs [N m]; None: as ``coulomb``.
        stribeck_speed: Stribeck speed vs [rad/s].
        damping: Damping s1 of the bristles [N m s/rad].
        viscous: Viscous friction s2 [N m s/rad].
        side: ``joint``, ``motor``, or ``shaft``: the gear's output shaft, where motors are coupled.
    """

    stiffness: float
    coulomb: float
    static: float | None = None
    stribeck_speed: float = 0.01
    damping: float = 0.0
    viscous: float = 0.0
    side: Side = "joint"

    limits = ranges(
        stiffness=positive("N m/rad"), coulomb=positive("N m"), stribeck_speed=positive("rad/s"),
        damping=not_negative("N m s/rad"), viscous=not_negative("N m s/rad"),
    )  # fmt: skip
    compute = _compute
    account = _account

    def faults(self) -> list[Fault]:
        if self.static is None or self.coulomb <= self.static < math.inf:
            return []
        return [Fault("LuGreFriction.static", "must be at least the coulomb torque [N m]", self.static)]

    def ports(self, place: Place) -> Ports:
        speed, torque, damping = s.of_side(self.side, place)
        return Ports(
            states=(State(f"{self.side}_bristle_bend", "rad", 1e-3 * self.coulomb / self.stiffness, path="bend"),),
            needs=(speed, s.MOTOR_SURFACE_SPEED if self.side == "motor" else s.SURFACE_SPEED),
            contributes=(torque, damping),
            outputs=(
                Signal(f"{self.side}_lugre_torque", "N m", path="torque"), s.loss(f"{self.side}_lugre_power"),
                s.store(f"{self.side}_bristle_energy"),
            ),
        )  # fmt: skip

    def own(self, place: Place) -> Own:
        static = self.coulomb if self.static is None else self.static
        law = (self.stiffness, self.damping, self.viscous, self.coulomb, static, self.stribeck_speed)
        return Own(side_of(self.side, place), *law)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        speed = s.read(place, signals, s.of_side(self.side, place)[0])
        if speed == 0.0:
            return (0.0,)
        return (math.copysign(_slip_torque(self.own(place), speed) / self.stiffness, speed),)

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("bristles slip", self.coulomb / (self.stiffness * self.stribeck_speed)),)
