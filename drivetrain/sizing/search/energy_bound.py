"""What a pair draws at least while other choices are open, from straight lines below its power at every sample.

A bound of each sample alone lets every sample have the torque that suits it best, as if drives after a joint were heavy
whenever they come down and light whenever they go up. Power grows with torque along a curve that a straight line bounds
from below; the sum of these lines is one straight function of the numbers of the drives that load the joint, and what
a weight takes on its way up it gives back on its way down.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.demand.load_kernels import JointBounds
from drivetrain.sizing.judge.compiling import njit_loop, njit_part
from drivetrain.sizing.judge.packed_rows import DRIVEN, DRIVING, RATIO
from drivetrain.sizing.judge.packed_task import LOSS_FRICTION, SPEED, WAY, WEIGHT, PackedTask
from drivetrain.sizing.judge.vector_max import larger, smaller
from drivetrain.sizing.search.bearing_bound import WIDER
from drivetrain.sizing.search.bound_kernels import LOW, OWN_HIGH, OWN_LOW, certain_loss

Mask = NDArray[np.bool_]

SLOPES = OWN_HIGH + 1  # row of the scratch of bounds


# long kernel: one pass over the samples
@njit_loop
def _lines(row: Array, g: Array, loss: float, low: Array, high: Array, least: Array, slopes: Array) -> float:
    """The energy that lines below the power of every sample add up to in the middle, and the slope of each.

    The motor's torque follows from the gear's along two straight lines that meet where the power through the mesh
    turns, so power is two parabolas. The line touches that of the middle, and is lowered by what it is above the other.
    """
    way, speed, weight, shift = row[WAY], row[SPEED], row[WEIGHT], row[LOSS_FRICTION]
    ratio, total = g[RATIO], 0.0
    driving, driven, hold = g[DRIVING] / ratio, g[DRIVEN] / ratio, max(g[DRIVEN], 0.0) / ratio
    for t in range(len(low)):
        a, b, turning = low[t] + shift[t], high[t] + shift[t], ratio * speed[t]
        middle, crossed = 0.5 * (a + b), (a < 0.0) & (b > 0.0)
        up = driving if way[t] > 0.0 else (driven if way[t] < 0.0 else hold)
        down = driven if way[t] > 0.0 else (driving if way[t] < 0.0 else hold)
        first = up * larger(a, 0.0) + down * smaller(a, 0.0)
        second = up * larger(b, 0.0) + down * smaller(b, 0.0)
        shaft = least[t] - smaller(smaller(first, second), 0.0 if crossed else first)  # of rotor and friction
        here, other = (up if middle > 0.0 else down), (down if middle > 0.0 else up)
        torque = shaft + here * middle
        value, slope = torque * (turning + loss * torque), here * (turning + 2.0 * loss * torque)
        near, far = (a if middle > 0.0 else 0.0), (0.0 if middle > 0.0 else b)
        curve = 2.0 * loss * other * other
        best = (slope - other * (turning + 2.0 * loss * shaft)) / curve if curve > 0.0 else near
        best = smaller(larger(best, near), far)
        x, y, z = shaft + other * near, shaft + other * best, shaft + other * far
        above = slope * (near - middle) - x * (turning + loss * x)
        above = larger(above, slope * (far - middle) - z * (turning + loss * z))
        above = larger(above, slope * (best - middle) - y * (turning + loss * y))
        total += weight[t] * (value - (larger(value + above, 0.0) if crossed else 0.0))
        slopes[t] = weight[t] * slope
    return total


@njit_loop
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for t in range(len(a)):
        total += a[t] * b[t]
    return total


@njit_part
def least_energy_of_lines(
    task: PackedTask, loads: Mask, joint: int, pair: int, low: Array, high: Array, bounds: JointBounds
) -> float:
    """A lower bound of a pair's electrical energy over the cycle, whatever the drives that load its joint are.

    Args:
        loads: Whether the drive of joint k changes what is asked of joint j, (j, k).
        low, high: Numbers of all joints' drives, (n, NUMBERS).

    Returns:
        [J].
    """
    m, g, scratch = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]], bounds.scratch
    own, slopes = task.offsets[joint, joint] >= 0, scratch[SLOPES]
    bottom, top = (scratch[OWN_LOW], scratch[OWN_HIGH]) if own else (bounds.low, bounds.high)
    energy = _lines(task.series[joint], g, certain_loss(m, bounds.figures), bottom, top, scratch[LOW], slopes)
    for k in range(low.shape[0]):
        if loads[joint, k]:
            for i in range(NUMBERS):
                half = 0.5 * (high[k, i] - low[k, i])
                if half > 0.0:
                    half += WIDER * (half + abs(high[k, i]))
                    energy -= half * abs(_dot(slopes, task.force[task.offsets[joint, k] + i]))
    return energy
