"""What an output bearing at least carries while the drives after it are open."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.compiling import njit_leaf, njit_loop, njit_part
from drivetrain.sizing.judge.packed_rows import AXIAL, DIRECT_DRIVE, RADIAL, TILTING
from drivetrain.sizing.judge.packed_task import BEARING, PEAK_FACTOR, PackedTask
from drivetrain.sizing.search.bound_kernels import OVER

Mask = NDArray[np.bool_]

STRIDE = 8  # samples
WIDER = 1e-12  # of an interval's width and middle: rounding of the sums that make it


class SomeWrenches(NamedTuple):
    """The wrenches of a task at every few samples, M of them, which tell enough for a bound.

    Attributes:
        bare: As in the task, (n, 6, M).
        units: As ``wrench`` of the task, (6, R, M).
        middle, half: Memory: the interval of each component, (6, M).
        least: What the output bearing of the joint at work carries at least: the tilting moment [N m], the axial and
            the radial force [N], (3,).
    """

    bare: Array
    units: Array
    middle: Array
    half: Array
    least: Array


def some_wrenches(task: PackedTask) -> SomeWrenches:
    """The wrenches of a task at every few samples."""
    bare, units = (np.ascontiguousarray(rows[:, :, ::STRIDE]) for rows in (task.bare_wrench, task.wrench))
    middle = np.zeros((6, bare.shape[2]))
    return SomeWrenches(bare, units, middle, middle.copy(), np.zeros(3))


@njit_loop
def _widen(unit: Array, at: float, wide: float, middle: Array, half: Array) -> None:
    """Add what lies between two numbers of a drive to an interval."""
    for t in range(len(middle)):
        middle[t] += at * unit[t]
        half[t] += wide * abs(unit[t])


@njit_leaf
def least_bearing(task: PackedTask, loads: Mask, joint: int, low: Array, high: Array, some: SomeWrenches) -> None:
    """The loads on a joint's output bearing that open choices cannot undercut; every few samples tell enough.

    Args:
        loads: Whether the drive of joint k changes what is asked of joint j, (j, k).
        low, high: Numbers of all joints' drives, its own included, (n, NUMBERS).
    """
    least, middle, half = some.least, some.middle, some.half
    least[0] = least[1] = least[2] = 0.0
    if task.tasks[joint, BEARING] == 0.0:
        return
    for part in (0, 1, 3, 4, 5):
        for t in range(middle.shape[1]):
            middle[part, t], half[part, t] = some.bare[joint, part, t], 0.0
        for k in range(low.shape[0]):
            row = task.offsets[joint, k]
            if row < 0 or not (k == joint or loads[joint, k]):
                continue
            for i in range(NUMBERS):
                if low[k, i] != 0.0 or high[k, i] != 0.0:
                    wide = 0.5 * (high[k, i] - low[k, i]) + WIDER * abs(high[k, i])
                    _widen(some.units[part, row + i], 0.5 * (low[k, i] + high[k, i]), wide, middle[part], half[part])
    for t in range(middle.shape[1]):
        for part in (0, 1, 3, 4, 5):
            middle[part, t] = max(abs(middle[part, t]) - half[part, t], 0.0)
        least[0] = max(least[0], math.sqrt(middle[0, t] * middle[0, t] + middle[1, t] * middle[1, t]))
        least[1] = max(least[1], middle[5, t])
        least[2] = max(least[2], math.sqrt(middle[3, t] * middle[3, t] + middle[4, t] * middle[4, t]))


@njit_part
def bearing_may_hold(task: PackedTask, joint: int, pair: int, least: Array) -> bool:
    """Whether a pair's output bearing may hold.

    Args:
        least: From ``least_bearing``, (3,).
    """
    g, factor = task.gears[task.pairs[pair, 1]], task.tasks[joint, PEAK_FACTOR]
    if g[DIRECT_DRIVE] != 0.0:
        return True
    over = factor * least[0] > g[TILTING] * OVER or factor * least[1] > g[AXIAL] * OVER
    return not (over or factor * least[2] > g[RADIAL] * OVER)
