"""Friction at a shaft: the six curves of Modern Robotics figure 8.13 as one family."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Friction:
    """A friction law at one shaft; positive numbers, signed by the speed when applied.

    ``positive`` and ``negative`` directions may differ; a value of None for the negative one means the same.

    Attributes:
        coulomb: Speed-independent [N m].
        coulomb_negative: The same at negative speed [N m], given as a positive number.
        viscous: [N m s/rad].
        viscous_negative: The same at negative speed [N m s/rad].
        static: Breakaway torque [N m]; None: equal to coulomb.
        stribeck_speed: Where the static excess has fallen to 1/e [rad/s].
        stribeck_exponent: Shape of that fall.
    """

    coulomb: float = 0.0
    coulomb_negative: float | None = None
    viscous: float = 0.0
    viscous_negative: float | None = None
    static: float | None = None
    stribeck_speed: float | None = None
    stribeck_exponent: float = 2.0
