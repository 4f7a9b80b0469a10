"""What a supply must give or take back, whatever is chosen of what is left: the power of all joints, by the instant.

A drive takes at least what it gives to the link and to its rotor; losses only add to that. Where few candidates are
left at a joint the copper loss of the best of them is counted too. The most that it takes, which is the least that it
feeds back, needs the losses of every candidate: it is known where not too many are left, each no hotter than it may be.
"""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.compiling import njit_entry, njit_leaf, njit_part
from drivetrain.sizing.judge.packed_rows import INNER, MAGNET, MAX_WINDING, RATIO
from drivetrain.sizing.judge.packed_task import (
    ACCELERATION,
    AMBIENT,
    CARRIER,
    CURVED,
    FRICTION,
    SPEED,
    TEMPERATURE_MARGIN,
    PackedTask,
)
from drivetrain.sizing.judge.torque_kernels import constant_at, resistance
from drivetrain.sizing.search.bound_kernels import torque_range
from drivetrain.sizing.search.propagation import Choices, Memory, Setting, interval

FEW = 24  # candidates of a joint whose copper loss is counted one by one
SOME = 256  # candidates of a joint of which the largest power is looked for


@njit_part
def _least_loss(m: Array, ambient: float) -> float:
    """Copper loss over torque squared, at the least [W/(N m)^2]."""
    heated, limit, coolest = not np.isnan(m[INNER]), m[MAX_WINDING], ambient
    if heated and m[MAGNET] > 0.0:
        return 0.0  # warm magnets may be stronger without bound
    if not np.isnan(limit):
        coolest = min(ambient, limit) if heated else limit
    constant = constant_at(m, ambient)
    return resistance(m, coolest) / (constant * constant)


@njit_part
def _most_loss(m: Array, limits: Array) -> float:
    """Copper loss over torque squared of a drive that holds, at the most; infinite where nothing limits it."""
    ambient, limit = limits[AMBIENT], m[MAX_WINDING]
    if np.isnan(m[INNER]):
        constant, hottest = constant_at(m, ambient), ambient if np.isnan(limit) else limit
    else:
        hottest = max(limit - limits[TEMPERATURE_MARGIN], ambient)
        constant = constant_at(m, hottest if m[MAGNET] < 0.0 else ambient)
    return resistance(m, hottest) / (constant * constant) if constant > 0.0 and not np.isnan(hottest) else np.inf


@njit_leaf
def _one_by_one(task: PackedTask, choices: Choices, joint: int, memory: Memory, ends: Array, most: bool) -> None:
    """The least power of a joint over its candidates, or the most, each with its losses, into a row of ends [W]."""
    row, limits, torque = task.series[joint], task.tasks[joint], memory.torque
    low, high, first = memory.bounds.scratch[0], memory.bounds.scratch[1], choices.first[joint]
    least, largest, samples = ends[0], ends[1], row.shape[1]
    for t in range(samples):
        if most:
            largest[t] = -np.inf
        else:
            least[t] = np.inf
    for at in range(first, first + choices.size[joint]):
        m, g = task.motors[joint, task.pairs[choices.pool[at], 0]], task.gears[task.pairs[choices.pool[at], 1]]
        torque_range(row, m, g, False, torque[0], torque[1], low, high)
        factor = _most_loss(m, limits) if most else _least_loss(m, limits[AMBIENT])
        for t in range(samples):
            turning = g[RATIO] * row[SPEED, t]
            if most:
                a, b = low[t] * (turning + factor * low[t]), high[t] * (turning + factor * high[t])
                largest[t] = max(largest[t], np.inf if factor == np.inf else max(a, b))
            else:
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
def power_range(task: PackedTask, setting: Setting, choices: Choices, memory: Memory, most: bool, total: Array) -> None:
    """Bounds of the power of all joints together.

    Args:
        total: Takes the bounds at each sample [W], the upper one infinite where it is not known, (2, N).
    """
    ends, samples = memory.load.scratch, total.shape[1]
    for t in range(samples):
        total[0, t], total[1, t] = 0.0, 0.0 if most else np.inf
    for joint in range(memory.low.shape[0]):
        interval(task, setting, joint, memory.low, memory.high, memory.torque)
        row = task.offsets[joint, joint]
        for i in range(NUMBERS if row >= 0 else 0):  # what its own drive asks, where it rides on the moved link
            for t in range(samples):
                given = memory.low[joint, i] * task.force[row + i, t], memory.high[joint, i] * task.force[row + i, t]
                memory.torque[0, t] += min(given[0], given[1])
                memory.torque[1, t] += max(given[0], given[1])
        straight = task.tasks[joint, CURVED] == 0.0
        if choices.size[joint] <= FEW and straight:
            _one_by_one(task, choices, joint, memory, ends, False)
        else:
            _all_at_once(task, choices, joint, memory.torque, ends[0])
        known = most and choices.size[joint] <= SOME and straight
        if known:
            _one_by_one(task, choices, joint, memory, ends, True)
        for t in range(samples):
            total[0, t] += ends[0, t]
            total[1, t] += ends[1, t] if known else np.inf
