"""What a stop does to a gear: braking at a current limit, the spring's overshoot, an output that jams.

T is the torque at the gear's output, w its speed, J the inertia at the gear's input, G the ratio. A joint whose load
turns as T = I w' + b stops by a motor that pushes against its motion as hard as its current allows:
G tau = f T + G^2 J w' with f = 1/eta where the motor drives the load and eta_back where the load drives the motor.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.drive.friction import direction, sliding_friction
from drivetrain.drive.gear import turning_drag
from drivetrain.jit import law
from drivetrain.records import known, known_or

STIFFER = 1.3  # of the printed stiffness: makers print a mean, and a stiffer gear is loaded more in a jam


class StiffSpring(NamedTuple):
    """Slopes of the pieces [N m/rad], and where the first two end [N m]."""

    slope_1: float
    slope_2: float
    slope_3: float
    torque_1: float
    torque_2: float


class Braking(NamedTuple):
    """The first instant of a stop."""

    torque: float  # at the gear's output [N m]
    acceleration: float  # of the gear's output [rad/s^2]


class StopRotor(NamedTuple):
    """A rotor while its joint stops, at the gear's output [kg m^2]: that turns behind the gear, and that loads it."""

    turning: float
    loading: float


@law
def stop_rotor(ratio: Any, inertia: Any, rides: Any) -> StopRotor:
    """G^2 J of a stator on the link before the joint. One that rides on the moved link (rides 1, else 0) turns the
    rotor by w' more, G (G + 1) J, and has its reaction on the load, (G + 1) J.
    """
    return StopRotor(ratio * (ratio + rides) * inertia, rides * (ratio + 1.0) * inertia)


@law
def braking_push(mesh: Any, shaft: Any, factor: Any, inertia: Any, limit: Any, speed: Any, carrier: Any) -> Any:
    """Torque that slows the rotor in addition to the mesh's, at the output [N m]."""
    drag = abs(sliding_friction(shaft, mesh.ratio * speed) + turning_drag(mesh, factor, mesh.ratio * speed))
    return -direction(speed) * abs(mesh.ratio) * (limit + drag) - mesh.ratio * inertia * carrier


@law
def braked(driving: Any, driven: Any, rotor: Any, push: Any, static: Any, inertia: Any, way: Any) -> Any:
    """The torque of a gear while its motor brakes, and how the joint slows down; one sample."""
    through = rotor * static + inertia * push
    factor = driving if through * way > 0.0 else driven
    whole = factor * inertia + rotor
    if whole <= 0.0:
        return Braking(math.inf, 0.0)
    return Braking(through / whole, (push - factor * static) / whole)


def braking_limit(driving: Any, driven: Any, rotor: Any, torque: Any, static: Any, inertia: Any, way: Any) -> Any:
    """The push on the rotor with which the gear's torque is a wanted one: ``braked`` the other way round; arrays."""
    factor = np.where(torque * way > 0.0, driving, driven)
    return (torque * (factor * inertia + rotor) - rotor * static) / inertia


@law
def overshoot(stiffness: Any, inertia: Any, rotor: Any, rise: Any) -> Any:
    """By what share of a step of torque a gear's spring swings beyond it: |sin(x)/x|, x = pi f rise; undamped.

    f is that of load and rotor on the spring, free at both ends. 1 where the torque comes at once, or the stiffness is
    unknown.
    """
    if not known(stiffness) or rise <= 0.0 or inertia <= 0.0 or rotor <= 0.0:
        return 1.0
    turns = 0.5 * math.sqrt(stiffness * (1.0 / inertia + 1.0 / rotor)) * rise
    return abs(math.sin(turns) / turns)


@law
def struck(stiffness: Any, inertia: Any, speed: Any, static: Any, torque: Any) -> Any:
    """Largest torque in a gear's spring if its rotor, turning with the load, is stopped in any time [N m].

    The load swings on the spring about b with the amplitude w sqrt(K I), as if the rotor stood at once, on top of what
    it swung already. Infinite where the stiffness is unknown.
    """
    if not known(stiffness):
        return math.inf
    return abs(static) + abs(torque - static) + abs(speed) * (0.5 * stiffness * (inertia + abs(inertia))) ** 0.5


@law
def rotor_energy(motor: Any, gear: Any, speed: Any) -> Any:
    """Of rotor and gear's input at a speed of the output [J]; NaN where the rotor's inertia is unknown."""
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
    """The spring of a gear as stiff as it may be: STIFFER than printed, and where a bend is unknown stiff from 0 on.

    NaN slopes where the sheet prints no stiffness.
    """
    first = known_or(gear.stiffness_1, known_or(gear.stiffness_2, known_or(gear.stiffness_3, math.nan)))
    second = known_or(gear.stiffness_2, first)
    third = known_or(gear.stiffness_3, second)
    lower, upper = known_or(gear.torque_1, 0.0), known_or(gear.torque_2, 0.0)
    upper = max(upper, lower)
    return StiffSpring(STIFFER * first, STIFFER * second, STIFFER * third, lower, upper)
