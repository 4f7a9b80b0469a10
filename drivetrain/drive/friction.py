"""Friction at a shaft: the six curves of Modern Robotics figure 8.13 as one family."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import NOT_NEGATIVE, POSITIVE, range_faults
from drivetrain.errors import Fault, InputError
from drivetrain.units import Factor, Speed, Torque, ViscousFriction

_RANGES = {
    "coulomb": NOT_NEGATIVE,
    "coulomb_negative": NOT_NEGATIVE,
    "viscous": NOT_NEGATIVE,
    "viscous_negative": NOT_NEGATIVE,
    "static": NOT_NEGATIVE,
    "stribeck_speed": POSITIVE,
    "stribeck_exponent": POSITIVE,
}


@dataclass(frozen=True)
class Friction:
    """A friction law at one shaft; positive numbers, signed by the speed when applied.

    ``positive`` and ``negative`` directions may differ; a value of None for the negative one means the same.
    The curves of figure 8.13: (a) ``viscous`` alone; (b) ``coulomb`` alone; (c) ``coulomb`` and ``viscous``;
    (d) ``static`` above ``coulomb``; (e) the same with ``viscous``; (f) the same with ``stribeck_speed``.

    Attributes:
        coulomb: Speed-independent [N m].
        coulomb_negative: The same at negative speed [N m], given as a positive number.
        viscous: [N m s/rad].
        viscous_negative: The same at negative speed [N m s/rad].
        static: Breakaway torque in both directions [N m]; None: equal to coulomb.
        stribeck_speed: Where the static excess has fallen to 1/e [rad/s]; None: it is gone at any speed.
        stribeck_exponent: Shape of that fall.
    """

    coulomb: Torque = 0.0
    coulomb_negative: Torque | None = None
    viscous: ViscousFriction = 0.0
    viscous_negative: ViscousFriction | None = None
    static: Torque | None = None
    stribeck_speed: Speed | None = None
    stribeck_exponent: Factor = 2.0

    def __post_init__(self) -> None:
        faults = range_faults("friction", self, _RANGES, required=("coulomb", "viscous", "stribeck_exponent"))
        if not faults and self.static is not None:
            sliding = max(self.coulomb, self.coulomb_negative or 0.0)
            if self.static < sliding:
                problem = f"must be at least the coulomb torque of either direction ({sliding:g} N m)"
                faults.append(Fault("friction.static", problem, self.static))
        if not faults and self.stribeck_speed is not None and self.static is None:
            hint = "give the static torque from which friction falls, or leave the speed out"
            faults.append(Fault("friction.stribeck_speed", "says nothing without static", self.stribeck_speed, hint))
        if faults:
            raise InputError(faults)


FRICTIONLESS = Friction()


def book_curves(static: float, kinetic: float, viscous: float, stribeck_speed: float) -> dict[str, Friction]:
    """The six laws of figure 8.13 from one set of numbers, by the figure's letters.

    Args:
        static: Torque that starts the motion [N m]; in (b) and (c) it also slides.
        kinetic: Torque of (d) to (f) while sliding, without its viscous part [N m]; smaller than ``static``.
        viscous: [N m s/rad].
        stribeck_speed: Of (f), where the static excess has fallen to 1/e [rad/s].

    Returns:
        (a) viscous; (b) Coulomb; (c) static plus viscous; (d) static and kinetic; (e) static, kinetic and viscous;
        (f) the Stribeck effect.

    Raises:
        InputError: Negative numbers, or ``kinetic`` above ``static``.

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.13. For (d) its text asks "tau_fric >= |b_static|" to start;
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


def friction_torque(friction: Friction, speed: Array) -> Array:
    """The torque that sliding friction takes from the shaft: of the sign of the speed, 0 at exactly zero speed.

    At rest friction is whatever holds, up to ``breakaway_torque``; which value it takes is not a matter of speed.

    Args:
        friction: The law.
        speed: Of the shaft [rad/s], any shape.

    Returns:
        Torque to be overcome [N m], the shape of ``speed``.

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.13; the fall from static to sliding friction as
        tau_c + (tau_s - tau_c) exp(-(|w|/w_s)^gamma).
    """
    speed = np.asarray(speed, dtype=np.float64)
    backward = speed < 0.0
    magnitude = np.abs(speed)
    coulomb = np.where(backward, _negative(friction.coulomb, friction.coulomb_negative), friction.coulomb)
    viscous = np.where(backward, _negative(friction.viscous, friction.viscous_negative), friction.viscous)
    sliding = coulomb
    if friction.static is not None and friction.stribeck_speed is not None:
        fall = np.exp(-((magnitude / friction.stribeck_speed) ** friction.stribeck_exponent))
        sliding = coulomb + (friction.static - coulomb) * fall
    return np.asarray(np.sign(speed) * (sliding + viscous * magnitude))


def breakaway_torque(friction: Friction, direction: Array) -> Array:
    """The torque friction can hold at rest before the shaft starts to move in a direction.

    Args:
        friction: The law.
        direction: Its sign is the direction of the motion that would follow, any shape; 0 gives 0.

    Returns:
        Torque of the sign of the direction [N m], the shape of ``direction``.

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.13 (b) to (f) at zero speed.
    """
    direction = np.asarray(direction, dtype=np.float64)
    if friction.static is not None:
        return np.asarray(np.sign(direction) * friction.static)
    backward = _negative(friction.coulomb, friction.coulomb_negative)
    return np.asarray(np.sign(direction) * np.where(direction < 0.0, backward, friction.coulomb))


def _negative(positive: float, negative: float | None) -> float:
    """The value at negative speed."""
    return positive if negative is None else negative
