"""The gear's spring for compiled code: torque, slope and energy of a twist, the inverse of ``gear.wind_up``.

And flanks that a spring and a damper press apart: what they answer at an instant, and in the mean over a step. That
mean is along the way that the twist goes in the step, kinks and all, so that what it does is to the last digit what the
spring stores: no step across a kink gains energy, and none passes a flank without touching it.


Reference: McLachlan, Quispel and Robidoux, Geometric integration using discrete gradients, Phil. Trans. R. Soc. A 357
(1999) 1021: the mean of the force along the step keeps the energy.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.drive.gear import Gear, wind_up
from drivetrain.drive.gear_stiffness import tangent_stiffness
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law


def spring_numbers(gear: Gear) -> tuple[float, float, float, float, float]:
    """The constants of a gear's spring.

    Returns:
        The three slopes [N m/rad] and the two twists between them [rad]; infinite where there is no further piece.

    Raises:
        InputError: The gear has no stiffness.
    """
    if gear.stiffness_1 is None:
        hint = "state one, or leave the spring out"
        raise InputError(Fault(f"gear {gear.key}.stiffness_1", "is unknown, so it has no spring", None, hint))
    slopes, bends = [gear.stiffness_1], []
    for torque in (gear.torque_1, gear.torque_2):
        above = None if torque is None else tangent_stiffness(gear, np.array(torque * (1.0 + 1e-9)))
        twist = None if torque is None else wind_up(gear, np.array(torque))
        if above is None or twist is None or float(above) == slopes[-1]:
            break
        slopes.append(float(above))
        bends.append(float(twist))
    return (
        *(slopes + [slopes[-1]] * 2)[:3],
        *(bends + [math.inf] * 2)[:2],
    )  # type: ignore[return-value]


@law
def spring(k1: float, k2: float, k3: float, bend1: float, bend2: float, twist: float) -> tuple[float, float, float]:
    """What a spring of three pieces answers.

    Args:
        k1, k2, k3: Slopes [N m/rad].
        bend1, bend2: Twists between them [rad].
        twist: [rad].

    Returns:
        Torque [N m], slope [N m/rad] and stored energy [J].

    Reference:
        K1, K2, K3 of the Harmonic Drive catalogues, continuous.
    """
    size = abs(twist)
    torque, slope, energy = k1 * size, k1, 0.5 * k1 * size * size
    if size > bend1:
        over = size - bend1
        torque += (k2 - k1) * over
        energy += 0.5 * (k2 - k1) * over * over
        slope = k2
    if size > bend2:
        over = size - bend2
        torque += (k3 - k2) * over
        energy += 0.5 * (k3 - k2) * over * over
        slope = k3
    return (torque if twist >= 0.0 else -torque), slope, energy


Pieces = tuple[float, float, float, float, float]
KINKS = 7  # flanks and bends of both sides, and where a damped flank lets go


@law
def touch(
    pieces: Pieces, flanks: tuple[float, float], damping: float, twist: float, rate: float
) -> tuple[float, float, float]:
    """What two flanks answer that push and never pull.

    Args:
        flanks: Twists at which the lower and the upper one are met [rad]; two that are equal are glued, and pull too.
        damping: In touch [N m s/rad].
        twist: [rad].
        rate: [rad/s].

    Returns:
        Torque [N m], slope [N m/rad], damping [N m s/rad].
    """
    low, high = flanks
    if low == high:
        torque, slope, _ = spring(pieces[0], pieces[1], pieces[2], pieces[3], pieces[4], twist - high)
        return torque + damping * rate, slope, damping
    side, deep = 0.0, 0.0
    if twist > high:
        side, deep = 1.0, twist - high
    elif twist < low:
        side, deep = -1.0, low - twist
    if side == 0.0:
        return 0.0, 0.0, 0.0
    push, slope, _ = spring(pieces[0], pieces[1], pieces[2], pieces[3], pieces[4], deep)
    whole = push + damping * side * rate
    if whole <= 0.0:  # the flanks part faster than the spring follows
        return 0.0, 0.0, 0.0
    return side * whole, slope, damping


@law
def depth(pieces: Pieces, torque: float) -> float:
    """The twist at which a spring answers with a torque.

    Args:
        torque: Not negative [N m].

    Returns:
        [rad].
    """
    k1, k2, k3, bend1, bend2 = pieces
    at = torque / k1
    if at > bend1:
        at = bend1 + (torque - k1 * bend1) / k2
        if at > bend2:
            at = bend2 + (torque - k1 * bend1 - k2 * (bend2 - bend1)) / k3
    return at


@law
def _kink(pieces: Pieces, flanks: tuple[float, float], loose: float, way: float, j: int) -> float:
    """Where the j-th kink lies; ``loose``: how deep a flank is where it lets go."""
    low, high = flanks
    if j == 0:
        return low
    if j == 1:
        return high
    if j == 2:
        return high + pieces[3]
    if j == 3:
        return high + pieces[4]
    if j == 4:
        return low - pieces[3]
    if j == 5:
        return low - pieces[4]
    return low - loose if way > 0.0 else high + loose


# long kernel: one way along all kinks
@law
def mean_touch(
    pieces: Pieces, flanks: tuple[float, float], damping: float, twist: float, rate: float, h: float
) -> tuple[float, float, float]:
    """What the flanks answer in the mean over a step, and how that grows.

    Args:
        twist: In the middle of the step [rad].
        rate: Of the whole step [rad/s].
        h: Step [s].

    Returns:
        Torque [N m]; how it grows with the twist [N m/rad] and with the rate [N m s/rad]. It never falls with the rate
        while the twist at the beginning of the step stays.
    """
    at, end, glued = twist - 0.5 * h * rate, twist + 0.5 * h * rate, flanks[0] == flanks[1]
    length = end - at  # as rounding leaves it
    if length == 0.0:
        return touch(pieces, flanks, damping, twist, rate)
    way = 1.0 if length > 0.0 else -1.0
    loose = depth(pieces, damping * abs(rate))
    torque, slope, slowing = 0.0, 0.0, 0.0
    for _ in range(KINKS + 1):
        to = end
        for j in range(KINKS):
            kink = _kink(pieces, flanks, loose, way, j)
            if (kink - at) * way > 0.0 and (to - kink) * way > 0.0:
                to = kink
        share, middle = (to - at) / length, 0.5 * (at + to)
        if share == 1.0:
            return touch(pieces, flanks, damping, twist, rate)
        push, steep, damp = touch(pieces, flanks, damping, middle, rate)
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
