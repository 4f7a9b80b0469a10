"""One pair of motor and gear at one joint, judged by compiled code with the numbers of ``judge.py``.

Order of use: ``load_joint`` sums up once what drives after a joint make of its work; ``judge_exact`` then judges any
pair of the joint against it. While the drives after it are open, ``bound_joint`` takes the interval of torque that
they leave, and ``may_hold`` rules out the pairs that no torque within it lets hold.
"""

from __future__ import annotations

from typing import NamedTuple

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_task import PackedTask

HOLDS, FALLS, ASK = 0, 1, 2  # ASK: too close to a limit for rounding to decide; the Python road is the authority

# Rows of the series and of the numbers of a load.
FORCE, DRIVING_LOAD, DRIVEN_LOAD, HELD_LOAD, START_LOAD, START_WAY, LOAD_SERIES = range(7)
PEAK_LOAD, TILT, PUSH, SIDE, MOST_INERTIA, LOAD_NUMBERS = range(6)  # then one average torque an exponent


class JointLoad(NamedTuple):
    """The work of one joint with the drives that load it in place; memory that is filled again and again.

    Attributes:
        series: Rows as above [N m], (LOAD_SERIES, N).
        numbers: Largest values and averages, as above, SI; NaN: not yet needed, (LOAD_NUMBERS + E,).
        drives: Numbers of the drives in place, (n, NUMBERS).
        scratch: (8, N).
    """

    series: Array
    numbers: Array
    drives: Array
    scratch: Array


class JointBounds(NamedTuple):
    """The interval in which a joint's torque lies; memory that is filled again and again.

    Attributes:
        low, high: Torque at the gear's output, joint friction not in it [N m], (N,).
        numbers: What is asked at least, as in ``JointLoad``, (LOAD_NUMBERS + E,).
        scratch: (8, N).
    """

    low: Array
    high: Array
    numbers: Array
    scratch: Array


def new_load(task: PackedTask) -> JointLoad:
    """Memory for the load of one joint.

    Args:
        task: The packed study.

    Returns:
        Nothing in it yet.
    """
    n, _, samples = task.series.shape
    count = LOAD_NUMBERS + len(task.exponents)
    return JointLoad(np.zeros((LOAD_SERIES, samples)), np.zeros(count), np.zeros((n, NUMBERS)), np.zeros((8, samples)))


def new_bounds(task: PackedTask) -> JointBounds:
    """Memory for the bounds of one joint.

    Args:
        task: The packed study.

    Returns:
        Nothing in it yet.
    """
    samples = task.series.shape[2]
    count = LOAD_NUMBERS + len(task.exponents)
    return JointBounds(np.zeros(samples), np.zeros(samples), np.zeros(count), np.zeros((8, samples)))


@nb.njit(cache=True, error_model="numpy", nogil=True)
def load_force(task: PackedTask, joint: int, drives: Array, force: Array) -> None:
    """The torque at a joint's gear, without what its own drive adds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        drives: Numbers of the drives in place, zeros where there is none, (n, NUMBERS).
        force: Takes it [N m], (N,).
    """
    force[:] = task.bare[joint]
    for k in range(drives.shape[0]):
        row = task.offsets[joint, k]
        if row >= 0 and k != joint:
            for i in range(NUMBERS):
                if drives[k, i] != 0.0:
                    force += drives[k, i] * task.force[row + i]


@nb.njit(cache=True, error_model="numpy", nogil=True)
def load_joint(task: PackedTask, joint: int, drives: Array, load: JointLoad) -> None:
    """What is asked of a joint with the drives after it in place.

    Args:
        task: The packed study.
        joint: Index of the joint.
        drives: Their numbers, zeros where there is none, (n, NUMBERS).
        load: Takes the result.
    """
    load.drives[:] = drives
    load_force(task, joint, drives, load.series[FORCE])


@nb.njit(cache=True, error_model="numpy", nogil=True)
def judge_exact(task: PackedTask, joint: int, pair: int, load: JointLoad) -> tuple[int, int, float]:
    """Whether a pair holds at a joint: every check of ``judge.py`` until one fails.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: From ``load_joint``.

    Returns:
        HOLDS, FALLS or ASK; the check that felled it or is too close, or that binds; its utilisation.
    """
    return ASK, 0, 1.0


@nb.njit(cache=True, error_model="numpy", nogil=True)
def pair_power(task: PackedTask, joint: int, pair: int, load: JointLoad, power: Array) -> float:
    """Electrical power of a pair that holds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: From ``load_joint``.
        power: Takes it at each sample, negative when regenerating [W], (N,).

    Returns:
        Energy over the cycle, what goes back credited [J].
    """
    power[:] = 0.0
    return np.nan


@nb.njit(cache=True, error_model="numpy", nogil=True)
def bound_joint(task: PackedTask, joint: int, low: Array, high: Array, bounds: JointBounds) -> None:
    """What is asked of a joint at least when its torque lies in an interval.

    Args:
        task: The packed study.
        joint: Index of the joint.
        low, high: Torque at the gear's output without joint friction and without what the joint's own drive adds
            [N m], (N,).
        bounds: Takes the result.
    """
    bounds.low[:] = low
    bounds.high[:] = high


@nb.njit(cache=True, error_model="numpy", nogil=True)
def may_hold(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """Whether a pair may hold with some torque history within bounds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        bounds: From ``bound_joint``.

    Returns:
        False only if no history with ``low <= torque <= high`` at each sample lets every check hold.
    """
    return True


@nb.njit(cache=True, error_model="numpy", nogil=True)
def least_energy(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> float:
    """A lower bound of a pair's electrical energy over the cycle with any torque history within bounds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        bounds: From ``bound_joint``.

    Returns:
        [J]; minus infinity where nothing is known.
    """
    return -np.inf


@nb.njit(cache=True, error_model="numpy", nogil=True)
def holds_speed(task: PackedTask, joint: int, pair: int) -> bool:
    """Whether a pair holds every limit of speed, which no other drive changes.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.

    Returns:
        False when one fails beyond rounding.
    """
    return True
