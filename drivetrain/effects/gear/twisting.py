"""What a spring between motor and link does to both, before it is simulated: twist, swing, and the loop's answer.

Behind a spring much stiffer than the position loop the motor holds still while the load swings beside its command
(``bounds.swinging``). Behind a softer one motor, loop and load swing together, and that is integrated as the linear
system that it is.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear
from drivetrain.drive.spring import wind_up
from drivetrain.effects.bounds import JUMP, bounded, swinging
from drivetrain.effects.effect import Place
from drivetrain.effects.estimate import Conditions, Estimate, TaskSeries

BESIDE = 1.25  # the load swings beside the command, and other springs with it
STIFF = 2.0  # times the loop: from there on the motor holds still beside it
SLOW = 25.0  # swings (in radians) a move from which on the motor's own law was measured
FINE, MOST_PARTS = 0.7, 50  # radians of the fastest swing a part of an interval, and parts at most


def twist(gear: Gear, torque: float) -> float:
    """How far a gear's spring is wound up.

    Args:
        torque: At its output [N m].

    Returns:
        [rad].
    """
    told = wind_up(gear, np.array(torque))
    return 0.0 if told is None else float(told)


def frequency(gear: Gear, conditions: Conditions) -> float:
    """Of the load on the softest spring, its other end held.

    Returns:
        [rad/s].
    """
    return math.sqrt((gear.stiffness_1 or math.inf) / max(conditions.inertia, 1e-300))


def swing(gear: Gear, damping: float, conditions: Conditions) -> Array:
    """How far the spring's torque swings beside that of the task.

    Args:
        damping: Along the spring [N m s/rad].

    Returns:
        Envelope [N m], (N,); a single zero where the task is not known.
    """
    if conditions.series is None:
        return np.zeros(1)
    own, stiffness = frequency(gear, conditions), gear.stiffness_1 or math.inf
    if outlasts_the_loop(gear, conditions):
        return swinging(conditions.series, own, 0.5 * damping * own / stiffness)
    return np.asarray(_together(gear, damping, conditions, conditions.series)[2])


def outlasts_the_loop(gear: Gear, conditions: Conditions) -> bool:
    """Whether the spring is twice as stiff as the position loop; where no loop is told, the motor holds."""
    loop = conditions.loop_stiffness
    return math.isinf(loop) or (gear.stiffness_1 or math.inf) >= STIFF * loop


def along(gear: Gear, damping: float, place: Place, conditions: Conditions, series: TaskSeries) -> Estimate:
    """What leaving a spring out changes.

    Args:
        damping: Along the spring [N m s/rad].
    """
    if outlasts_the_loop(gear, conditions):
        envelope = BESIDE * swing(gear, damping, conditions)
        most = BESIDE * twist(gear, float((np.abs(series.torque) + envelope).max()))
        error = envelope * conditions.mesh_share / (abs(place.ratio) * conditions.torque_constant)
        valid = frequency(gear, conditions) * conditions.move_time > SLOW
        return bounded(conditions, error, "swing of the load on the spring", deviation=most, valid=valid)
    away, answer, _ = _together(gear, damping, conditions, series)
    error = BESIDE * answer * conditions.mesh_share / (abs(place.ratio) * conditions.torque_constant)
    why = "motor on its loop and load on its spring, as one linear system along the task"
    return bounded(conditions, error, why, deviation=BESIDE * float(away.max()), valid=conditions.loop_damping > 0.0)


def _together(gear: Gear, damping: float, conditions: Conditions, series: TaskSeries) -> tuple[Array, Array, Array]:
    """The link's deviation, the loop's torque and the spring's swing, the largest of any stiffness that it has."""
    slopes = {gear.stiffness_1, *(one for one in (gear.stiffness_2, gear.stiffness_3) if one)} - {None}
    told = [_one(float(k), damping, conditions, series) for k in slopes if k]
    return tuple(np.max([one[i] for one in told], axis=0) for i in range(3))  # type: ignore[return-value]


def _one(stiffness: float, damping: float, conditions: Conditions, series: TaskSeries) -> tuple[Array, Array, Array]:
    """Along one stiffness: size of link's deviation [rad], of loop's torque and of spring's swing [N m], (N,) each.

    With T the torque of the task, e and d how far motor and link are from their command, both fed forward as if rigid:
    ``J e'' = T - Kp e - Kd e' - S`` and ``I d'' = S - T`` with ``S = K (e - d) + D (e' - d')``.
    """
    load, rotor = conditions.inertia, max(conditions.rotor_inertia, 1e-6 * conditions.inertia)
    kp, kd = conditions.loop_stiffness, conditions.loop_damping
    spring = np.array([stiffness, damping, -stiffness, -damping])
    loop = np.array([kp, kd, 0.0, 0.0])
    motion = np.zeros((6, 6))
    motion[0, 1] = motion[2, 3] = motion[4, 5] = 1.0
    motion[1, :4], motion[3, :4] = -(spring + loop) / rotor, spring / load
    motion[1, 4], motion[3, 4] = 1.0 / rotor, -1.0 / load
    fastest = math.sqrt((stiffness + kp) / rotor + stiffness / load)
    time, torque = series.time, series.torque
    state = np.array([0.0, 0.0, -torque[0] / stiffness, 0.0, torque[0], 0.0])
    steps: dict[float, Array] = {}
    sizes = np.zeros((3, len(time)))
    for k in range(len(time) - 1):
        span = float(time[k + 1] - time[k])
        state[4:] = torque[k], 0.0
        if span > JUMP:
            parts = min(max(1, math.ceil(span * fastest / FINE)), MOST_PARTS)
            state[5] = (torque[k + 1] - torque[k]) / span
            step = round(span / parts, 12)
            if step not in steps:
                steps[step] = _exponential(motion * step)
            for _ in range(parts):
                state = steps[step] @ state
                told = abs(state[2]), abs(loop @ state[:4]), abs(spring @ state[:4] - state[4])
                sizes[:, k] = np.maximum(sizes[:, k], told)
        sizes[:, k + 1] = abs(state[2]), abs(loop @ state[:4]), abs(spring @ state[:4] - torque[k + 1])
    return sizes[0], sizes[1], sizes[2]


def _exponential(matrix: Array) -> Array:
    """Of a small matrix: a power series of its share, squared again."""
    halvings = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1e-300)))) + 1
    share, total = matrix / 2.0**halvings, np.eye(len(matrix))
    term = total
    for k in range(1, 15):
        term = term @ share / k
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return np.asarray(total)
