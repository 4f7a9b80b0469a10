"""Spring of a gear with three ranges of stiffness; contact of flanks pressed together by a spring and a damper.

The contact torque is given at an instant and as a mean over a step. The mean is taken along the twist of the step,
including all kinks, so that its work equals the change of the spring's energy to rounding: no step across a kink gains
energy, and none misses a contact.

Reference: K1 up to T1, K2 from T1 to T2, K3 above T2, continuous (Harmonic Drive catalogues). McLachlan, Quispel and
Robidoux, Geometric integration using discrete gradients, Phil. Trans. R. Soc. A 357 (1999) 1021: the mean of the force
along the step keeps the energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law


@dataclass(frozen=True)
class Spring:
    """A piecewise linear spring of up to three pieces; missing pieces are infinite."""

    # Stiffness of each piece [N m/rad].
    slope_1: float
    slope_2: float
    slope_3: float
    # Torques between the pieces [N m].
    torque_1: float = math.inf
    torque_2: float = math.inf
    # Twists between the pieces [rad].
    bend_1: float = math.inf
    bend_2: float = math.inf


def gear_spring(gear: Gear) -> Spring:
    """The spring of a gear; a piece whose first torque is unknown is omitted with all that follow."""
    first, second, third = gear.stiffness_1, gear.stiffness_2, gear.stiffness_3
    lower, upper = gear.torque_1, gear.torque_2
    if first is None:
        hint = "state one, or leave the spring out"
        raise InputError(Fault(f"gear {gear.key}.stiffness_1", "is unknown, so it has no spring", None, hint))
    if lower is None or second is None:
        return Spring(first, first, first)
    if upper is None or third is None:
        third, upper = second, math.inf
    bent = Spring(first, second, third, lower, upper)
    bends = (float(twist_under(bent, torque)) if torque < math.inf else math.inf for torque in (lower, upper))
    return Spring(first, second, third, lower, upper, *bends)


@law
def twist_under(spring: Any, torque: Any) -> Any:
    """Twist T1/K1 + (T2 - T1)/K2 + (T - T2)/K3 with the sign of the torque [rad]; without backlash."""
    size = abs(torque)
    twist = size / spring.slope_1
    twist = twist + np.maximum(size - spring.torque_1, 0.0) * (1.0 / spring.slope_2 - 1.0 / spring.slope_1)
    twist = twist + np.maximum(size - spring.torque_2, 0.0) * (1.0 / spring.slope_3 - 1.0 / spring.slope_2)
    return np.copysign(twist, torque)


@law
def answer(spring: Any, twist: Any) -> tuple[Any, Any, Any]:
    """Torque with the sign of a twist [N m], slope (at a bend that of the piece below) [N m/rad], stored energy [J]."""
    size, change_1, change_2 = abs(twist), spring.slope_2 - spring.slope_1, spring.slope_3 - spring.slope_2
    above_1, above_2 = np.maximum(size - spring.bend_1, 0.0), np.maximum(size - spring.bend_2, 0.0)
    torque = spring.slope_1 * size + change_1 * above_1 + change_2 * above_2
    first, last = 1.0 * (size <= spring.bend_1), 1.0 * (size > spring.bend_2)
    slope = spring.slope_1 * first + spring.slope_2 * (1.0 - first - last) + spring.slope_3 * last
    energy = 0.5 * (spring.slope_1 * size * size + change_1 * above_1 * above_1 + change_2 * above_2 * above_2)
    return np.copysign(torque, twist), slope, energy


def wind_up(gear: Gear, output_torque: Array) -> Array | None:
    """Twist between input and output under a torque, without backlash: continuous, with the sign of the torque.

    Args:
        gear: Data sheet; one stiffness gives a straight line, two or three give bends at ``torque_1`` and ``torque_2``.
        output_torque: Torque at the output [N m], any shape.

    Returns:
        Twist at the output [rad], same shape; None without a stiffness.
    """
    if gear.stiffness_1 is None:
        return None
    return np.asarray(twist_under(gear_spring(gear), np.asarray(output_torque, dtype=np.float64)))


def tangent_stiffness(gear: Gear, output_torque: Array) -> Array | None:
    """Slope of torque over wind-up at a torque, for small vibrations about it; without backlash.

    Args:
        gear: Data sheet.
        output_torque: Torque at the output [N m], any shape; its sign does not matter.

    Returns:
        Stiffness at the output [N m/rad], same shape; at a bend that of the softer piece below it. None without a
        stiffness.
    """
    twist = wind_up(gear, output_torque)
    return None if twist is None else np.asarray(answer(gear_spring(gear), twist)[1])


KINKS = 7  # both flanks, the bends on both sides, and the points where a damped flank separates


@law
def touch(
    spring: Any, flanks: tuple[float, float], damping: float, twist: float, rate: float
) -> tuple[float, float, float]:
    """Contact torque of two flanks that only push [N m], and its slopes over twist [N m/rad] and rate [N m s/rad]."""
    low, high = flanks
    if low == high:
        torque, slope, _ = answer(spring, twist - high)
        return torque + damping * rate, slope, damping
    side, deep = 0.0, 0.0
    if twist > high:
        side, deep = 1.0, twist - high
    elif twist < low:
        side, deep = -1.0, low - twist
    if side == 0.0:
        return 0.0, 0.0, 0.0
    push, slope, _ = answer(spring, deep)
    whole = push + damping * side * rate
    if whole <= 0.0:  # the flanks separate faster than the spring can follow
        return 0.0, 0.0, 0.0
    return side * whole, slope, damping


@law
def _kink(spring: Any, flanks: tuple[float, float], loose: float, sign: float, j: int) -> float:
    """Position of the j-th kink [rad]; ``loose``: depth of a flank at which it separates [rad]."""
    low, high = flanks
    if j == 0:
        return low
    if j == 1:
        return high
    if j == 2:
        return high + spring.bend_1
    if j == 3:
        return high + spring.bend_2
    if j == 4:
        return low - spring.bend_1
    if j == 5:
        return low - spring.bend_2
    return low - loose if sign > 0.0 else high + loose


# A long kernel: a single walk along all kinks.
@law
def mean_touch(
    spring: Any, flanks: tuple[float, float], damping: float, twist: float, rate: float, h: float
) -> tuple[float, float, float]:
    """Mean of the contact torque over a step ``h`` [N m], and its slopes over twist [N m/rad] and rate [N m s/rad]."""
    at, end, glued = twist - 0.5 * h * rate, twist + 0.5 * h * rate, flanks[0] == flanks[1]
    length = end - at  # the rounded difference, which decides below
    if length == 0.0:
        return touch(spring, flanks, damping, twist, rate)
    sign = 1.0 if length > 0.0 else -1.0
    loose = twist_under(spring, damping * abs(rate))
    torque, slope, slowing = 0.0, 0.0, 0.0
    for _ in range(KINKS + 1):
        to = end
        for j in range(KINKS):
            kink = _kink(spring, flanks, loose, sign, j)
            if (kink - at) * sign > 0.0 and (to - kink) * sign > 0.0:
                to = kink
        share, middle = (to - at) / length, 0.5 * (at + to)
        if share == 1.0:
            return touch(spring, flanks, damping, twist, rate)
        push, steep, damp = touch(spring, flanks, damping, middle, rate)
        torque += share * push
        slope += share * steep
        slowing += share * (damp + (middle - twist) / length * h * steep)
        if to == end:
            break
        if not glued and to == (flanks[1] if sign > 0.0 else flanks[0]):
            # At a contact with an initial speed the damper acts at once.
            slope += damping / h
            slowing += (to - twist) / length * damping
        at = to
    return torque, slope, slowing
