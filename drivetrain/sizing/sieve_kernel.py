"""What a search holds, and the pass over one joint's candidates that rules out those that cannot matter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.bearing_bound import bearing_may_hold
from drivetrain.sizing.compiling import njit_unit
from drivetrain.sizing.judge_kernels import (
    JointBounds,
    JointLoad,
    judge_units,
    least_energy,
    may_hold,
    new_bounds,
    new_load,
)
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_task import PackedTask
from drivetrain.sizing.units import address_of_unit
from drivetrain.sizing.warm_bound import stays_cool

Indices = NDArray[np.int64]

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "units.py": 4239343723,
    "compiling.py": 2693116001,
    "packed_rows.py": 959813297,
    "packed_task.py": 1550225454,
    "vector_max.py": 2907682659,
    "load_loops.py": 4217972974,
    "load_kernels.py": 2531705965,
    "torque_kernels.py": 3940003373,
    "check_numbers.py": 1283387322,
    "check_kernels.py": 1820890624,
    "bound_kernels.py": 3999289047,
    "judge_kernels.py": 2399876618,
    "warm_bound.py": 285983250,
    "bearing_bound.py": 1668248093,
}

UNKNOWN = -1
TESTED, JUDGED, PASSES, COUNTS = range(4)
SIEVE = 3  # after the units that judge


class Choices(NamedTuple):
    """The candidates that are left at each joint, and what is known of them; n joints.

    Attributes:
        pool: Pairs by joint, those of joint j from ``first[j]``, ``size[j]`` of them, cheapest first.
        cost: What each costs at least, in the order of the pool.
        first, size: (n,).
        least: What each joint costs at least, (n,).
        known: Pair of each joint that is known to hold with its load decided, -1 for none, (n,).
    """

    pool: Indices
    cost: Array
    first: Indices
    size: Indices
    least: Array
    known: Indices


class Setting(NamedTuple):
    """What a search minimises, and what hangs together.

    Attributes:
        share: What each pair adds to the objective whatever it does, (P,).
        energy: What one joule a cycle adds.
        loads: Whether the drive of joint k changes what is asked of joint j, (j, k).
    """

    share: Array
    energy: float
    loads: NDArray[np.bool_]


class Memory(NamedTuple):
    """Memory that every pass fills again.

    Attributes:
        low, high: Smallest and largest number of the drives left at each joint, (n, NUMBERS).
        torque: Ends of the interval on one joint [N m], (2, N).
        bounds: Of one joint.
        load: Of one joint.
        bearing: What the output bearing of one joint carries at least, (3,).
        power: Of one drive [W], (N,).
        verdicts: What was judged of the pairs of joints that no other drive loads: HOLDS, FALLS or UNKNOWN, (P,).
        suspects: Pairs that once fell although the bounds let them pass, (P,).
        exact: Whether a cost is that of the candidate at work, while costs are settled, (P,).
        counts: Work done: candidates tested, candidates judged, passes, (COUNTS,).
        units: Addresses of kernels, by JUDGE, POWER, LOAD and SIEVE, (4,).
    """

    low: Array
    high: Array
    torque: Array
    bounds: JointBounds
    load: JointLoad
    bearing: Array
    power: Array
    verdicts: Indices
    suspects: NDArray[np.bool_]
    exact: NDArray[np.bool_]
    counts: Indices
    units: Indices


def new_memory(task: PackedTask) -> Memory:
    """Memory for the propagation of one task.

    Args:
        task: The packed study.

    Returns:
        Nothing in it yet.
    """
    n, _, samples = task.series.shape
    empty = np.zeros((n, NUMBERS))
    counts = np.zeros(COUNTS, dtype=np.int64)
    load, power = new_load(task), np.zeros(samples)
    verdicts = np.full(len(task.pairs), UNKNOWN, dtype=np.int64)
    torque, suspects = np.zeros((2, samples)), np.zeros(len(task.pairs), dtype=np.bool_)
    bounds, bearing, units = new_bounds(task), np.zeros(3), np.append(judge_units(task, load), 0)
    memory = Memory(
        empty, empty.copy(), torque, bounds, load, bearing, power, verdicts, suspects, suspects.copy(), counts, units
    )
    setting = Setting(power, 0.0, np.zeros((n, n), dtype=np.bool_))
    choices = Choices(units, power, units, units, power, units)
    units[SIEVE] = address_of_unit(sieve, task, setting, choices, 0, 0.0, True, memory)
    return memory


# long kernel: one joint's candidates in one pass, with what was ruled out closed up in place
@njit_unit
def sieve(
    task: PackedTask, setting: Setting, choices: Choices, joint: int, limit: float, full: bool, memory: Memory
) -> bool:
    """Rule out the candidates of one joint that cannot be part of a set within a limit.

    Args:
        task: The packed study.
        setting: What pairs cost, and which drives load which joints.
        choices: The candidates; those of the joint are closed up.
        joint: Index of the joint, its bounds in memory.
        limit: Candidates that cost as much or more are out.
        full: Test all candidates; else, where energy does not count, only those up to the cheapest that may hold.
        memory: Bounds.

    Returns:
        Whether any is left.
    """
    begin, end = choices.first[joint], choices.first[joint] + choices.size[joint]
    pool, cost = choices.pool, choices.cost
    kept, lazy = begin, not full and setting.energy == 0.0
    for at in range(begin, end):
        pair = pool[at]
        asked = setting.share[pair]
        if setting.energy == 0.0 and asked >= limit:
            break
        if kept == begin or not lazy:
            memory.counts[TESTED] += 1
            if not bearing_may_hold(task, joint, pair, memory.bearing):
                continue
            if not (may_hold(task, joint, pair, memory.bounds) and stays_cool(task, joint, pair, memory.bounds)):
                continue
            if setting.energy != 0.0:
                asked += setting.energy * least_energy(task, joint, pair, memory.bounds)
                if asked >= limit:
                    continue
        pool[kept], cost[kept] = pair, asked
        kept += 1
    choices.size[joint] = kept - begin
    return kept > begin
