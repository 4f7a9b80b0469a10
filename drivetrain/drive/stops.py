"""Effects of a stop on a gear: braking at a current limit, overshoot of the spring, a blocked output.

T is the torque at the gear's output, w its speed, J the inertia at the gear's input, G the ratio. A joint whose load
turns as T = I w' + b is stopped by a motor that brakes with the torque its current limit allows: G tau = f T + G^2 J w'
with f = 1/eta where the motor drives the load and eta_back where the load drives the motor.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.drive.friction import direction, sliding_friction
from drivetrain.drive.gear import turning_drag
from drivetrain.jit import law
from drivetrain.records import known, known_or

HARDER = 2.2  # stiffness of the last over that of the first piece of a spring; 1.51 to 2.1 in 76 strain-wave gears
STIFFER = 1.3  # factor on the printed mean stiffness: a stiffer gear is loaded more in a jam


class StiffSpring(NamedTuple):
    """Stiffness of the three pieces [N m/rad], and torques between them [N m]."""

    slope_1: float
    slope_2: float
    slope_3: float
    torque_1: float
    torque_2: float


class Braking(NamedTuple):
    """State at the first instant of a stop."""

    torque: float  # at the gear's output [N m]
    acceleration: float  # acceleration of the gear's output [rad/s^2]


class StopRotor(NamedTuple):
    """Inertias of a rotor while its joint stops, at the gear's output [kg m^2]: the one that is accelerated through the
    gear, and the one whose reaction loads it.
    """

    turning: float
    loading: float


@law
def stop_rotor(ratio: Any, inertia: Any, rides: Any) -> StopRotor:
    """G^2 J for a stator on the link before the joint; for one on the moved link (``rides`` 1, else 0) G (G + 1) J,
    because the rotor turns by w' more, with the reaction (G + 1) J on the load.
    """
    return StopRotor(ratio * (ratio + rides) * inertia, rides * (ratio + 1.0) * inertia)


@law
def braking_push(mesh: Any, shaft: Any, factor: Any, inertia: Any, limit: Any, speed: Any, carrier: Any) -> Any:
    """Torque that decelerates the rotor in addition to the torque through the mesh, at the gear's output [N m]."""
    drag = abs(sliding_friction(shaft, mesh.ratio * speed) + turning_drag(mesh, factor, mesh.ratio * speed))
    return -direction(speed) * abs(mesh.ratio) * (limit + drag) - mesh.ratio * inertia * carrier


@law
def braked(driving: Any, driven: Any, rotor: Any, push: Any, static: Any, inertia: Any, sign: Any) -> Any:
    """Gear torque and acceleration of the joint while its motor brakes; for one sample."""
    through = rotor * static + inertia * push
    factor = driving if through * sign > 0.0 else driven
    whole = factor * inertia + rotor
    if whole <= 0.0:
        return Braking(math.inf, 0.0)
    return Braking(through / whole, (push - factor * static) / whole)


@law
def swing_spring(gear: Any) -> StiffSpring:
    """The spring of a gear for oscillations; a straight line if only one stiffness or none is given.

    The bends are NaN where the data sheet gives some of the pieces and bends, but not all.
    """
    if not known(gear.stiffness_2) and not known(gear.stiffness_3):
        return StiffSpring(1.0, 1.0, 1.0, 0.0, 0.0)
    if known(gear.stiffness_1 + gear.stiffness_2 + gear.stiffness_3):
        return StiffSpring(gear.stiffness_1, gear.stiffness_2, gear.stiffness_3, gear.torque_1, gear.torque_2)
    return StiffSpring(1.0, 1.0, HARDER, math.nan, math.nan)


@law
def swung_torque(spring: Any, before: Any, target: Any, share: Any) -> Any:
    """Peak torque of a spring's oscillation when its static torque steps from one value to another [N m].

    Without damping the oscillation is symmetric in energy: the integral of (T - target) dT/K is 0 from end to end. A
    straight line overshoots by the step; one that stiffens overshoots at most by the step times the square root of the
    ratio of stiffnesses. ``share``: of a step with a rise time, see ``overshoot``.
    """
    sign = 1.0 if target >= before else -1.0
    start, middle = sign * before, sign * target
    swing = middle - start
    if not known(spring.torque_1 + spring.torque_2):
        swing *= max(math.sqrt(spring.slope_3 / spring.slope_1), 1.0)
    elif swing < np.inf and (spring.slope_1 != spring.slope_2 or spring.slope_2 != spring.slope_3):
        energy, swung = 0.0, np.inf
        pieces = (
            (-spring.torque_2, spring.slope_3), (-spring.torque_1, spring.slope_2), (spring.torque_1, spring.slope_1),
            (spring.torque_2, spring.slope_2), (np.inf, spring.slope_3),
        )  # fmt: skip
        for end, slope in pieces:
            near, far = min(start, end), min(middle, end)
            energy += ((middle - near) ** 2 - (middle - far) ** 2) / (2.0 * slope)
            start = max(start, far)
        start = middle
        for end, slope in pieces:
            if end > start and swung == np.inf:
                reach = middle + math.sqrt((start - middle) ** 2 + 2.0 * slope * max(energy, 0.0))
                if reach <= end:
                    swung = reach
                energy -= ((end - middle) ** 2 - (start - middle) ** 2) / (2.0 * slope)
                start = end
        swing = max(swing, swung - middle)
    return target + sign * share * swing


@law
def overshoot(stiffness: Any, inertia: Any, rotor: Any, rise: Any) -> Any:
    """Overshoot of a gear's spring as a share of a torque step with a rise time: |sin(x)/x|, x = pi f rise; undamped.

    f is the natural frequency of load and rotor on the spring, free at both ends. 1 for a step without rise time or an
    unknown stiffness.
    """
    if not known(stiffness) or rise <= 0.0 or inertia <= 0.0 or rotor <= 0.0:
        return 1.0
    turns = 0.5 * math.sqrt(stiffness * (1.0 / inertia + 1.0 / rotor)) * rise
    return abs(math.sin(turns) / turns)


@law
def struck(stiffness: Any, inertia: Any, speed: Any, static: Any, torque: Any) -> Any:
    """Largest torque in a gear's spring if its rotor, turning with the load, is stopped within any time [N m].

    The load oscillates about b with the amplitude w sqrt(K I), as if the rotor stopped at once, in addition to the
    oscillation before. Infinite where the stiffness is unknown.
    """
    if not known(stiffness):
        return math.inf
    return abs(static) + abs(torque - static) + abs(speed) * (0.5 * stiffness * (inertia + abs(inertia))) ** 0.5


@law
def stop_swing(
    spring: Any, stiffness: Any, share: Any, found: Any, static: Any, before: Any, inertia: Any, speed: Any
) -> Any:
    """Largest torque of a gear's spring in a stop [N m]: at its start, or at its end when the deceleration ends.

    ``found``: from ``braked``; ``before``: gear torque in the cycle; ``stiffness``: the largest one, as for ``struck``.
    """
    begun = abs(swung_torque(spring, before, found.torque, share))
    ended = abs(swung_torque(spring, found.torque, static, share))
    return min(max(begun, ended), struck(stiffness, inertia, speed, static, before))


@law
def rotor_energy(motor: Any, gear: Any, speed: Any) -> Any:
    """Kinetic energy of rotor and gear input at a speed of the output [J]; NaN where the rotor's inertia is unknown."""
    return 0.5 * (motor.rotor_inertia + known_or(gear.inertia, 0.0)) * (gear.ratio * speed) ** 2


@law
def jam_torque(spring: Any, energy: Any, push: Any) -> Any:
    """Largest torque of a gear whose output is held fast: ``energy`` of the rotor [J] and ``push`` of its motor, at the
    output [N m], into the spring: U(T) = energy + push phi(T). Lossless, from no torque.

    On a piece of slope K that begins at T0 with the rest E of the energy, T = P + sqrt((P - T0)^2 + 2 K E).
    """
    begin, rest = 0.0, energy
    for slope, end in (
        (spring.slope_1, spring.torque_1), (spring.slope_2, spring.torque_2), (spring.slope_3, math.inf),
    ):  # fmt: skip
        torque = push + math.sqrt(max((push - begin) * (push - begin) + 2.0 * slope * rest, 0.0))
        if torque <= end:
            return torque
        rest += (push * (end - begin) - 0.5 * (end * end - begin * begin)) / slope
        begin = end
    return torque


@law
def stiff_spring(gear: Any) -> Any:
    """The spring of a gear with the largest plausible stiffness: STIFFER times the printed one; the stiffest piece from
    0 on where a bend is unknown.

    NaN slopes where the data sheet gives no stiffness.
    """
    first = known_or(gear.stiffness_1, known_or(gear.stiffness_2, known_or(gear.stiffness_3, math.nan)))
    second = known_or(gear.stiffness_2, first)
    third = known_or(gear.stiffness_3, second)
    lower, upper = known_or(gear.torque_1, 0.0), known_or(gear.torque_2, 0.0)
    upper = max(upper, lower)
    return StiffSpring(STIFFER * first, STIFFER * second, STIFFER * third, lower, upper)
