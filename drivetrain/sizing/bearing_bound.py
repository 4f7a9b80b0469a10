"""What an output bearing at least carries while the drives after it are open."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.bound_kernels import OVER
from drivetrain.sizing.compiling import njit_leaf, njit_part
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_rows import AXIAL, DIRECT_DRIVE, RADIAL, TILTING
from drivetrain.sizing.packed_task import BEARING, PEAK_FACTOR, PackedTask

Mask = NDArray[np.bool_]

STRIDE = 8  # samples
WIDER = 1e-12  # of an interval's width and middle: rounding of the sums that make it


# long kernel: five components of a wrench, each a sum over all open and decided drives
@njit_leaf
def least_bearing(task: PackedTask, loads: Mask, joint: int, low: Array, high: Array, least: Array) -> None:
    """The loads on a joint's output bearing that open choices cannot undercut; every few samples tell enough.

    Args:
        task: The packed study.
        loads: Whether the drive of joint k changes what is asked of joint j, (j, k).
        joint: Index of the joint.
        low, high: Numbers of all joints' drives, its own included, (n, NUMBERS).
        least: Takes the tilting moment [N m], the axial and the radial force [N], (3,).
    """
    least[0] = least[1] = least[2] = 0.0
    if task.tasks[joint, BEARING] == 0.0:
        return
    for t in range(0, task.bare_wrench.shape[2], STRIDE):
        mx = my = fx = fy = fz = 0.0
        for part in range(6):
            if part == 2:
                continue
            middle, half = task.bare_wrench[joint, part, t], 0.0
            for k in range(low.shape[0]):
                row = task.offsets[joint, k]
                if row < 0 or not (k == joint or loads[joint, k]):
                    continue
                for i in range(NUMBERS):
                    unit = task.wrench[part, row + i, t]
                    middle += 0.5 * (low[k, i] + high[k, i]) * unit
                    half += (0.5 * (high[k, i] - low[k, i]) + WIDER * abs(high[k, i])) * abs(unit)
            end = max(abs(middle) - half, 0.0)
            if part == 0:
                mx = end
            elif part == 1:
                my = end
            elif part == 3:
                fx = end
            elif part == 4:
                fy = end
            else:
                fz = end
        least[0] = max(least[0], math.sqrt(mx * mx + my * my))
        least[1] = max(least[1], fz)
        least[2] = max(least[2], math.sqrt(fx * fx + fy * fy))


@njit_part
def bearing_may_hold(task: PackedTask, joint: int, pair: int, least: Array) -> bool:
    """Whether a pair's output bearing may hold.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        least: From ``least_bearing``, (3,).

    Returns:
        False only if a limit is passed whatever is chosen.
    """
    g, factor = task.gears[task.pairs[pair, 1]], task.tasks[joint, PEAK_FACTOR]
    if g[DIRECT_DRIVE] != 0.0:
        return True
    over = factor * least[0] > g[TILTING] * OVER or factor * least[1] > g[AXIAL] * OVER
    return not (over or factor * least[2] > g[RADIAL] * OVER)
