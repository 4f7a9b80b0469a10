"""The spring of a gear, of three pieces over its torque; and flanks that a spring and a damper press apart.

The torque of the flanks is given at an instant, and as a mean over a step. That mean is along the way that the twist
goes in the step, kinks and all, so that what it does is to the last digit what the spring stores: no step across a kink
gains energy, and none passes a flank without touching it.

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
    """A spring of three pieces; where there is no further one, the last goes on and what bounds it is infinite."""

    # [N m/rad]
    slope_1: float
    slope_2: float
    slope_3: float
    # between the pieces [N m]
    torque_1: float = math.inf
    torque_2: float = math.inf
    # twists there [rad]
    bend_1: float = math.inf
    bend_2: float = math.inf


def gear_spring(gear: Gear) -> Spring:
    """The spring of a gear; a piece whose start is unknown is not used, nor those after it."""
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
    """T1/K1 + (T2 - T1)/K2 + (T - T2)/K3, of the sign of the torque [rad]; play left out."""
    size = abs(torque)
    twist = size / spring.slope_1
    twist = twist + np.maximum(size - spring.torque_1, 0.0) * (1.0 / spring.slope_2 - 1.0 / spring.slope_1)
    twist = twist + np.maximum(size - spring.torque_2, 0.0) * (1.0 / spring.slope_3 - 1.0 / spring.slope_2)
    return np.copysign(twist, torque)


@law
def answer(spring: Any, twist: Any) -> tuple[Any, Any, Any]:
    """Torque of the sign of a twist [N m], slope, at a bend that before it [N m/rad], and stored energy [J]."""
    size, more, most = abs(twist), spring.slope_2 - spring.slope_1, spring.slope_3 - spring.slope_2
    over, beyond = np.maximum(size - spring.bend_1, 0.0), np.maximum(size - spring.bend_2, 0.0)
    torque = spring.slope_1 * size + more * over + most * beyond
    first, last = 1.0 * (size <= spring.bend_1), 1.0 * (size > spring.bend_2)
    slope = spring.slope_1 * first + spring.slope_2 * (1.0 - first - last) + spring.slope_3 * last
    energy = 0.5 * (spring.slope_1 * size * size + more * over * over + most * beyond * beyond)
    return np.copysign(torque, twist), slope, energy


def wind_up(gear: Gear, output_torque: Array) -> Array | None:
    """Twist between input and output under a torque, backlash left out: continuous, of the sign of the torque.

    Args:
        gear: The sheet; one stiffness gives a straight line, two or three give bends at ``torque_1`` and ``torque_2``.
        output_torque: [N m], any shape.

    Returns:
        Twist at the output [rad], that shape; None without a stiffness.
    """
    if gear.stiffness_1 is None:
        return None
    return np.asarray(twist_under(gear_spring(gear), np.asarray(output_torque, dtype=np.float64)))


def tangent_stiffness(gear: Gear, output_torque: Array) -> Array | None:
    """The slope of torque over wind-up at a torque: what a small vibration about it feels, backlash left out.

    Args:
        gear: The sheet.
        output_torque: [N m], any shape; its sign does not matter.

    Returns:
        [N m/rad] at the output, that shape; at a bend the softer piece before it. None without a stiffness.
    """
    twist = wind_up(gear, output_torque)
    return None if twist is None else np.asarray(answer(gear_spring(gear), twist)[1])


KINKS = 7  # flanks and bends of both sides, and where a damped flank lets go


@law
def touch(
    spring: Any, flanks: tuple[float, float], damping: float, twist: float, rate: float
) -> tuple[float, float, float]:
    """What two flanks answer that push and never pull."""
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
    if whole <= 0.0:  # the flanks part faster than the spring follows
        return 0.0, 0.0, 0.0
    return side * whole, slope, damping


@law
def _kink(spring: Any, flanks: tuple[float, float], loose: float, way: float, j: int) -> float:
    """Where the j-th kink lies; ``loose``: how deep a flank is where it lets go."""
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
    return low - loose if way > 0.0 else high + loose


# long kernel: one way along all kinks
@law
def mean_touch(
    spring: Any, flanks: tuple[float, float], damping: float, twist: float, rate: float, h: float
) -> tuple[float, float, float]:
    """What the flanks answer in the mean over a step, and how that grows."""
    at, end, glued = twist - 0.5 * h * rate, twist + 0.5 * h * rate, flanks[0] == flanks[1]
    length = end - at  # as rounding leaves it
    if length == 0.0:
        return touch(spring, flanks, damping, twist, rate)
    way = 1.0 if length > 0.0 else -1.0
    loose = twist_under(spring, damping * abs(rate))
    torque, slope, slowing = 0.0, 0.0, 0.0
    for _ in range(KINKS + 1):
        to = end
        for j in range(KINKS):
            kink = _kink(spring, flanks, loose, way, j)
            if (kink - at) * way > 0.0 and (to - kink) * way > 0.0:
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
        if not glued and to == (flanks[1] if way > 0.0 else flanks[0]):
            # Met at a speed, the damper sets in at once.
            slope += damping / h
            slowing += (to - twist) / length * damping
        at = to
    return torque, slope, slowing
