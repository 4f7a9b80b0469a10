"""Friction at a shaft: the six curves of Modern Robotics figure 8.13 as one family."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import NOT_NEGATIVE, POSITIVE, Range, range_faults
from drivetrain.errors import Fault, raise_faults
from drivetrain.jit import law
from drivetrain.records import known, known_or
from drivetrain.units import Factor, Share, Speed, Torque, ViscousFriction

_RANGES = {
    "coulomb": NOT_NEGATIVE,
    "coulomb_negative": NOT_NEGATIVE,
    "viscous": NOT_NEGATIVE,
    "viscous_negative": NOT_NEGATIVE,
    "static": NOT_NEGATIVE,
    "stribeck_speed": POSITIVE,
    "stribeck_exponent": POSITIVE,
    "tanh_speed": POSITIVE,
    "load_share": Range("must be 0 or more and below 1", 0.0, 0.999, low_included=True),
}


@dataclass(frozen=True)
class Friction:
    """A friction law at one shaft; positive numbers, signed by the speed when applied.

    ``positive`` and ``negative`` directions may differ; a value of None for the negative one means the same.
    The curves of figure 8.13: (a) ``viscous`` alone; (b) ``coulomb`` alone; (c) ``coulomb`` and ``viscous``;
    (d) ``static`` above ``coulomb``; (e) the same with ``viscous``; (f) the same with ``stribeck_speed``.

    Attributes:
        coulomb: Coulomb torque, independent of speed [N m].
        coulomb_negative: Coulomb torque at negative speed [N m], given as a positive number.
        viscous: Viscous coefficient [N m s/rad].
        viscous_negative: Viscous coefficient at negative speed [N m s/rad].
        static: Breakaway torque in both directions [N m]; None: equal to the Coulomb torque.
        stribeck_speed: Speed at which the static excess has dropped to 1/e [rad/s]; None: it vanishes as soon as the
            shaft moves.
        stribeck_exponent: Exponent of that drop over speed.
        tanh_speed: Speed w_s of a Coulomb torque that rises as tanh(w/w_s) [rad/s]; None: full torque at any speed. At
            rest the full torque can still hold. The sigmoid 2/(1 + exp(-w/w_s)) - 1 equals tanh(w/(2 w_s)), so its w_s
            counts twice here.
        load_share: Load-dependent friction over the joint's load: this share of all torque that the joint transmits,
            Coulomb torque included, acts in addition, against the motion.
    """

    coulomb: Torque = 0.0
    coulomb_negative: Torque | None = None
    viscous: ViscousFriction = 0.0
    viscous_negative: ViscousFriction | None = None
    static: Torque | None = None
    stribeck_speed: Speed | None = None
    stribeck_exponent: Factor = 2.0
    tanh_speed: Speed | None = None
    load_share: Share = 0.0

    def __post_init__(self) -> None:
        faults = range_faults(
            "friction", self, _RANGES, required=("coulomb", "viscous", "stribeck_exponent", "load_share")
        )
        if not faults and self.static is not None:
            sliding = max(self.coulomb, self.coulomb_negative or 0.0)
            if self.static < sliding:
                problem = f"must be at least the coulomb torque of either direction ({sliding:g} N m)"
                faults.append(Fault("friction.static", problem, self.static))
        if not faults and self.stribeck_speed is not None and self.static is None:
            hint = "give the static torque from which friction decreases, or leave the speed out"
            faults.append(Fault("friction.stribeck_speed", "says nothing without static", self.stribeck_speed, hint))
        if not faults and self.tanh_speed is not None and self.static is not None:
            faults.append(Fault("friction.tanh_speed", "does not go with static, which a smooth law has not"))
        raise_faults(faults)


FRICTIONLESS = Friction()


def book_curves(static: float, kinetic: float, viscous: float, stribeck_speed: float) -> dict[str, Friction]:
    """The six laws of figure 8.13 from one set of numbers, by the figure's letters.

    Args:
        static: Breakaway torque [N m]; in (b) and (c) also the sliding torque.
        kinetic: Torque of (d) to (f) while sliding, without its viscous part [N m]; smaller than ``static``.
        viscous: Viscous coefficient [N m s/rad].
        stribeck_speed: Speed in (f) at which the static excess has dropped to 1/e [rad/s].

    Returns:
        (a) viscous; (b) Coulomb; (c) static plus viscous; (d) static and kinetic; (e) static, kinetic and viscous;
        (f) the Stribeck effect.

    Raises:
        InputError: Negative numbers, or ``kinetic`` above ``static``.

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.13. For (d) its text asks ``tau_fric >= |b_static|`` to start;
        it is the magnitude of the torque that must reach b_static, in either direction.
    """
    return {
        "a": Friction(viscous=viscous),
        "b": Friction(coulomb=static),
        "c": Friction(coulomb=static, viscous=viscous),
        "d": Friction(coulomb=kinetic, static=static),
        "e": Friction(coulomb=kinetic, static=static, viscous=viscous),
        "f": Friction(coulomb=kinetic, static=static, viscous=viscous, stribeck_speed=stribeck_speed),
    }


class FrictionCurve(NamedTuple):
    """A friction law with explicit values for both directions."""

    # Coulomb torque [N m].
    forward: float
    backward: float
    # Viscous coefficients [N m s/rad].
    viscous_forward: float
    viscous_backward: float
    # Breakaway torques [N m].
    static_forward: float
    static_backward: float
    # Whether friction falls from its static torque over a range of speed (Stribeck) or rises smoothly (tanh).
    falls: bool
    # Speed and exponent of that fall [rad/s], [-].
    stribeck_speed: float
    stribeck_exponent: float
    tanh_speed: float  # speed of that rise [rad/s]; 0: full torque at any speed


@law
def direction(value: Any) -> Any:
    """Sign of a value: 1, 0 or -1."""
    return 1.0 * (value > 0.0) - 1.0 * (value < 0.0)  # comparisons can be recorded as C code


@law
def side(value: Any) -> Any:
    """1 or -1 by the sign of a value; 1 for 0."""
    return direction(value) + (value == 0.0)


@law
def friction_curve(friction: Any) -> Any:
    """The curve of a friction law: values missing in one direction equal the other's, static torque Coulomb's."""
    backward = known_or(friction.coulomb_negative, friction.coulomb)
    return FrictionCurve(
        friction.coulomb, backward, friction.viscous, known_or(friction.viscous_negative, friction.viscous),
        known_or(friction.static, friction.coulomb), known_or(friction.static, backward),
        (known(friction.static) and known(friction.stribeck_speed)) or known(friction.tanh_speed),
        known_or(friction.stribeck_speed, 1.0), friction.stribeck_exponent, known_or(friction.tanh_speed, 0.0),
    )  # fmt: skip


@law
def sliding_friction(curve: Any, speed: Any) -> Any:
    """tau_c + b |w| with the sign of the speed, 0 at rest [N m]; ``static_excess`` is added where friction falls or
    rises smoothly.

    Modern Robotics, figure 8.13 (a) to (e).
    """
    forward, backward = 1.0 * (speed > 0.0), 1.0 * (speed < 0.0)
    coulomb = curve.forward * forward - curve.backward * backward
    return coulomb + (curve.viscous_forward * forward + curve.viscous_backward * backward) * speed


@law
def smooth_lack(curve: Any, speed: Any) -> Any:
    """Coulomb torque of a smooth law minus the full one, tau_c tanh(|w|/w_s) - tau_c = -tau_c 2 e/(1 + e), e = exp(-2
    |w|/w_s), with the sign of the speed [N m].
    """
    fall = np.exp(-2.0 * abs(speed) / curve.tanh_speed)
    coulomb = curve.forward * (speed > 0.0) - curve.backward * (speed < 0.0)
    return -coulomb * 2.0 * fall / (1.0 + fall)


@law
def static_excess(curve: Any, speed: Any) -> Any:
    """(tau_s - tau_c) exp(-(|w|/w_s)^g) with the sign of the speed [N m]. Modern Robotics, figure 8.13 (f).

    For a smooth law it is ``smooth_lack``.
    """
    if curve.tanh_speed > 0.0:
        return smooth_lack(curve, speed)
    ahead, behind = 1.0 * (speed > 0.0), 1.0 * (speed < 0.0)
    excess = (curve.static_forward - curve.forward) * ahead - (curve.static_backward - curve.backward) * behind
    share, exponent = abs(speed) / curve.stribeck_speed, curve.stribeck_exponent
    # the usual exponent needs no power function
    return excess * np.exp(-(share * share if exponent == 2.0 else share**exponent))


@law
def tanh_slope(curve: Any, speed: Any) -> Any:
    """Slope of a smooth law over speed, without its viscous part [N m s/rad]."""
    fall = np.exp(-2.0 * abs(speed) / curve.tanh_speed)
    coulomb = curve.forward if speed >= 0.0 else curve.backward
    return coulomb / curve.tanh_speed * 4.0 * fall / (1.0 + fall) ** 2


@law
def friction_at(curve: Any, speed: Any) -> Any:
    """Friction torque of a turning shaft with the sign of the speed, 0 at rest [N m]."""
    sliding = sliding_friction(curve, speed)
    return sliding + static_excess(curve, speed) if curve.falls else sliding


@law
def breakaway_friction(curve: Any, sign: Any) -> Any:
    """Largest friction torque at rest against a motion in a direction, with its sign [N m]; 0 for no direction. Figure
    8.13 (b) to (f).
    """
    return curve.static_forward * (sign > 0.0) - curve.static_backward * (sign < 0.0)


@law
def stronger(first: Any, second: Any) -> Any:
    """The value of the larger magnitude."""
    return first + (second - first) * (abs(second) > abs(first))


@law
def loosening_load(curve: Any, load: Any, ahead: Any) -> Any:
    """A load at rest with the friction that must be overcome to break the shaft loose [N m].

    It acts against the load, or in the direction ``ahead`` of the next motion where that needs more.
    """
    return stronger(load + breakaway_friction(curve, load), load + breakaway_friction(curve, ahead))


def friction_torque(friction: Friction, speed: Array) -> Array:
    """Torque that sliding friction takes from the shaft, with the sign of the speed; 0 at exactly zero speed.

    At rest friction takes any value up to ``breakaway_torque``, which the speed does not determine.

    Args:
        friction: Friction law.
        speed: Speed of the shaft [rad/s], any shape.

    Returns:
        Torque that has to be overcome [N m], the shape of ``speed``.
    """
    return np.asarray(friction_at(friction_curve(friction), np.asarray(speed, dtype=np.float64)))


def breakaway_torque(friction: Friction, direction: Array) -> Array:
    """Largest torque that friction can hold at rest before the shaft starts to move in a direction.

    Args:
        friction: Friction law.
        direction: Its sign is the direction of the motion that would follow, any shape; 0 gives 0.

    Returns:
        Torque with the sign of the direction [N m], the shape of ``direction``.
    """
    return np.asarray(breakaway_friction(friction_curve(friction), np.asarray(direction, dtype=np.float64)))
