"""What a supply must at least give, whatever is chosen of what is left: the power of all joints, instant by instant.

A drive takes at least what it gives to the link and to its rotor; losses only add to that. Where few candidates are
left at a joint the copper loss of the best of them is counted too.
"""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.bound_kernels import torque_range
from drivetrain.sizing.compiling import njit_entry, njit_leaf, njit_part
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_rows import INNER, MAGNET, MAX_WINDING, RATIO
from drivetrain.sizing.packed_task import ACCELERATION, AMBIENT, CARRIER, CURVED, FRICTION, SPEED, PackedTask
from drivetrain.sizing.propagation import Choices, Memory, Setting, interval
from drivetrain.sizing.torque_kernels import constant_at, resistance

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "units.py": 4239343723,
    "compiling.py": 2693116001,
    "packed_rows.py": 959813297,
    "packed_task.py": 1799634810,
    "vector_max.py": 2907682659,
    "load_loops.py": 4217972974,
    "load_kernels.py": 747351674,
    "torque_kernels.py": 3940003373,
    "check_numbers.py": 1283387322,
    "check_kernels.py": 1000668928,
    "bound_kernels.py": 4287468434,
    "judge_kernels.py": 2138536719,
    "warm_bound.py": 3791348865,
    "bearing_bound.py": 1668248093,
    "sieve_kernel.py": 1103702654,
    "propagation.py": 2907540935,
}

FEW = 24  # candidates of a joint whose copper loss is counted one by one


@njit_part
def _copper_factor(m: Array, ambient: float) -> float:
    """Copper loss over torque squared, at the least [W/(N m)^2]."""
    heated, limit, coolest = not np.isnan(m[INNER]), m[MAX_WINDING], ambient
    if heated and m[MAGNET] > 0.0:
        return 0.0  # warm magnets may be stronger without bound
    if not np.isnan(limit):
        coolest = min(ambient, limit) if heated else limit
    constant = constant_at(m, ambient)
    return resistance(m, coolest) / (constant * constant)


@njit_leaf
def _one_by_one(task: PackedTask, choices: Choices, joint: int, torque: Array, scratch: Array, least: Array) -> None:
    """The least power of a joint over its candidates, each with its losses [W], (N,)."""
    row, limits = task.series[joint], task.tasks[joint]
    low, high, first = scratch[0], scratch[1], choices.first[joint]
    for t in range(least.size):
        least[t] = np.inf
    for at in range(first, first + choices.size[joint]):
        m, g = task.motors[joint, task.pairs[choices.pool[at], 0]], task.gears[task.pairs[choices.pool[at], 1]]
        torque_range(row, m, g, False, torque[0], torque[1], low, high)
        factor = _copper_factor(m, limits[AMBIENT])
        for t in range(least.size):
            turning = g[RATIO] * row[SPEED, t]
            best = (low[t] if turning > 0.0 else high[t]) if factor == 0.0 else -0.5 * turning / factor
            best = max(low[t], min(high[t], best))
            least[t] = min(least[t], best * (turning + factor * best))


@njit_leaf
def _all_at_once(task: PackedTask, choices: Choices, joint: int, torque: Array, least: Array) -> None:
    """The least power that a joint's link and any of its rotors take, without losses [W], (N,)."""
    row, first = task.series[joint], choices.first[joint]
    squared_low, squared_high, single_low, single_high = np.inf, -np.inf, np.inf, -np.inf
    for at in range(first, first + choices.size[joint]):
        ratio, inertia = task.gears[task.pairs[choices.pool[at], 1], RATIO], task.numbers[choices.pool[at], 3]
        squared_low, squared_high = min(squared_low, inertia * ratio**2), max(squared_high, inertia * ratio**2)
        single_low, single_high = min(single_low, inertia * ratio), max(single_high, inertia * ratio)
    for t in range(least.size):
        speed = row[SPEED, t]
        link = (torque[0, t] if speed > 0.0 else torque[1, t]) + row[FRICTION, t]
        own, carried = row[ACCELERATION, t] * speed, row[CARRIER, t] * speed
        least[t] = link * speed + min(squared_low * own, squared_high * own)
        least[t] += min(single_low * carried, single_high * carried)


@njit_entry
def least_power(task: PackedTask, setting: Setting, choices: Choices, memory: Memory, total: Array) -> None:
    """A lower bound of the power of all joints together.

    Args:
        task: The packed study.
        setting: Which drives load which joints.
        choices: The candidates left.
        memory: The numbers that are left; the rest is filled again.
        total: Takes the bound at each sample [W], (N,).
    """
    least, scratch = memory.power, memory.bounds.scratch
    for t in range(total.size):
        total[t] = 0.0
    for joint in range(memory.low.shape[0]):
        interval(task, setting, joint, memory.low, memory.high, memory.torque)
        row = task.offsets[joint, joint]
        for i in range(NUMBERS if row >= 0 else 0):  # what its own drive asks, where it rides on the moved link
            for t in range(total.size):
                ends = memory.low[joint, i] * task.force[row + i, t], memory.high[joint, i] * task.force[row + i, t]
                memory.torque[0, t] += min(ends[0], ends[1])
                memory.torque[1, t] += max(ends[0], ends[1])
        if choices.size[joint] <= FEW and task.tasks[joint, CURVED] == 0.0:
            _one_by_one(task, choices, joint, memory.torque, scratch, least)
        else:
            _all_at_once(task, choices, joint, memory.torque, least)
        for t in range(total.size):
            total[t] += least[t]
