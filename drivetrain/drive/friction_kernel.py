"""The friction curve for compiled code: the law of ``friction.py`` with its unknowns filled in."""

from __future__ import annotations

import math

from drivetrain.drive.friction import Friction
from drivetrain.jit import law


def friction_numbers(friction: Friction) -> tuple[float, float, float, float, float, float]:
    """The constants of a friction law's dry part.

    Returns:
        Coulomb torque forward and backward, breakaway torque forward and backward [N m]; speed of the fall between
        them [rad/s], 0 where there is none; its exponent [-].
    """
    forward = friction.coulomb
    backward = forward if friction.coulomb_negative is None else friction.coulomb_negative
    static = friction.static
    hold = (forward, backward) if static is None else (static, static)
    falls = static is not None and friction.stribeck_speed is not None
    speed = friction.stribeck_speed if falls and friction.stribeck_speed is not None else 0.0
    return forward, backward, *hold, speed, friction.stribeck_exponent


@law
def sliding_torque(coulomb: float, static: float, fall: float, exponent: float, speed: float) -> float:
    """Dry friction while sliding in one direction, a positive number.

    Args:
        coulomb: Far from rest [N m].
        static: Close to rest [N m]; only where there is a fall.
        fall: Speed at which the excess over ``coulomb`` has fallen to 1/e [rad/s]; 0: there is none.
        exponent: Of that fall [-].
        speed: Magnitude [rad/s].

    Returns:
        [N m].

    Reference:
        As ``friction.friction_torque``.
    """
    if fall <= 0.0:
        return coulomb
    if speed == 0.0:
        return static
    share = speed / fall
    power = share * share if exponent == 2.0 else share**exponent
    if power > 700.0:  # numbers too small for their full digits take processors a hundred times as long
        return coulomb
    return coulomb + (static - coulomb) * math.exp(-power)
