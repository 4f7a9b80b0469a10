"""What the open choices of a search leave possible, compiled: intervals of torque, candidates ruled out, least costs.

The torque on a joint is a weighted sum over the numbers of the drives that load it. While these are open, each number
lies between the smallest and the largest of the candidates left, so each sample's torque lies in an interval; a
candidate that holds nowhere within it is out, whatever the other drives will be. Fewer candidates leave narrower
intervals, and these fewer candidates: the passes repeat, from the tip to the base, until nothing changes.

A joint whose load is decided has an interval without width; its cheapest candidate is then judged exactly.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.bearing_bound import WIDER, bearing_may_hold, least_bearing
from drivetrain.sizing.compiling import njit_entry, njit_leaf, njit_part, njit_unit
from drivetrain.sizing.judge_kernels import (
    ASK,
    EXACT,
    FALLS,
    JUDGE,
    LOAD,
    POWER,
    JointBounds,
    JointLoad,
    bound_joint,
    judge_units,
    least_energy,
    may_hold,
    new_bounds,
    new_load,
)
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_task import PackedTask
from drivetrain.sizing.units import address_of_unit, call_judge, call_load, call_power, call_sieve
from drivetrain.sizing.warm_bound import stays_cool

Indices = NDArray[np.int64]

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "units.py": 562543157,
    "compiling.py": 557889461,
    "packed_rows.py": 959813297,
    "packed_task.py": 1550225454,
    "vector_max.py": 2907682659,
    "load_loops.py": 2873394249,
    "load_kernels.py": 1892452345,
    "torque_kernels.py": 3451220589,
    "check_numbers.py": 3525281127,
    "check_kernels.py": 4398126,
    "bound_kernels.py": 1655275469,
    "judge_kernels.py": 3376758834,
    "warm_bound.py": 2558181749,
    "bearing_bound.py": 1668248093,
}

OPEN, EMPTY, TOO_DEAR, ASKED = range(4)
UNKNOWN = -1
TESTED, JUDGED, PASSES, COUNTS = range(4)


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
        units: Addresses of the kernels that judge, (3,).
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
    bounds, bearing = new_bounds(task), np.zeros(3)
    return Memory(empty, empty.copy(), torque, bounds, load, bearing, power, verdicts, suspects, suspects.copy(), counts, judge_units(task, load))


@njit_leaf
def range_of_numbers(task: PackedTask, choices: Choices, joint: int, low: Array, high: Array) -> bool:
    """The smallest and largest numbers of the candidates left at a joint.

    Args:
        task: The packed study.
        choices: The candidates.
        joint: Index of the joint.
        low, high: Take the numbers, in the units of ``drive_numbers``, (n, NUMBERS).

    Returns:
        Whether they changed.
    """
    changed = False
    begin, end = choices.first[joint], choices.first[joint] + choices.size[joint]
    for i in range(NUMBERS):
        least, most = np.inf, -np.inf
        for at in range(begin, end):
            value = task.numbers[choices.pool[at], i]
            least = min(least, value)
            most = max(most, value)
        changed = changed or least != low[joint, i] or most != high[joint, i]
        low[joint, i], high[joint, i] = least, most
    return changed


@njit_leaf
def interval(task: PackedTask, setting: Setting, joint: int, low: Array, high: Array, torque: Array) -> bool:
    """The interval of torque that open choices leave on a joint, without what its own drive adds.

    Args:
        task: The packed study.
        setting: Which drives load which joints.
        joint: Index of the joint.
        low, high: Numbers of all joints' drives, (n, NUMBERS).
        torque: Takes both ends, at the gear's output, joint friction not in it [N m], (2, N).

    Returns:
        Whether it has no width: every drive that loads the joint is decided.
    """
    bottom, top = torque[0], torque[1]
    bare = task.bare[joint]
    for t in range(bottom.size):
        bottom[t] = top[t] = bare[t]
    decided = True
    for k in range(low.shape[0]):
        if not setting.loads[joint, k]:
            continue
        row = task.offsets[joint, k]
        for i in range(NUMBERS):
            unit = task.force[row + i]
            middle, half = 0.5 * (low[k, i] + high[k, i]), 0.5 * (high[k, i] - low[k, i])
            if half == 0.0:
                if middle != 0.0:
                    for t in range(unit.size):
                        bottom[t] += middle * unit[t]
                        top[t] += middle * unit[t]
                continue
            decided = False
            half += WIDER * (half + abs(middle))
            for t in range(unit.size):
                at, wide = middle * unit[t], half * abs(unit[t])
                bottom[t] += at - wide
                top[t] += at + wide
    return decided


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


@njit_leaf
def _close_up(choices: Choices, joint: int) -> None:
    """Take out the candidates of a joint that cost infinitely much."""
    begin, end = choices.first[joint], choices.first[joint] + choices.size[joint]
    kept = begin
    for at in range(begin, end):
        if choices.cost[at] < np.inf:
            choices.pool[kept], choices.cost[kept] = choices.pool[at], choices.cost[at]
            kept += 1
    choices.size[joint] = kept - begin


@njit_leaf
def settle(task: PackedTask, setting: Setting, choices: Choices, joint: int, alone: bool, memory: Memory) -> int:
    """Judge the cheapest candidates of a joint whose load is decided, until one holds.

    Args:
        task: The packed study.
        setting: What pairs cost, and which drives load which joints.
        choices: The candidates; those of the joint that fall are taken out, where energy counts the costs of those
            that hold become exact.
        joint: Index of the joint, its load in memory.
        alone: Whether no other drive loads it, so that what is judged holds for good.
        memory: The load.

    Returns:
        OPEN, EMPTY, or ASKED: then ``known`` holds -2 less the pair that is to be asked of the Python road.
    """
    begin, end = choices.first[joint], choices.first[joint] + choices.size[joint]
    pool, cost, known = choices.pool, choices.cost, choices.known
    exact, best, found = memory.exact, begin, OPEN
    for at in range(end - begin):
        exact[at] = False
    while True:
        if setting.energy != 0.0:
            best = begin
            for at in range(begin, end):
                if cost[at] < cost[best]:
                    best = at
        if best == end or cost[best] == np.inf:
            break
        if exact[best - begin]:
            known[joint] = pool[best]
            break
        pair = pool[best]
        if pair != known[joint]:
            code = memory.verdicts[pair] if alone else UNKNOWN
            if code == UNKNOWN:
                memory.counts[JUDGED] += 1
                code, _, _ = call_judge(memory.units[JUDGE], task, joint, pair, memory.load, EXACT)
                memory.verdicts[pair] = code if alone and code != ASK else UNKNOWN
            if code == ASK:
                known[joint], found = -2 - pair, ASKED
                break
            if code == FALLS:
                memory.suspects[pair] = True
                cost[best] = np.inf
                best += 1
                continue
        known[joint], exact[best - begin] = pair, True
        if setting.energy != 0.0:
            drawn = call_power(memory.units[POWER], task, joint, pair, memory.load, memory.power)
            cost[best] = setting.share[pair] + setting.energy * drawn
    _close_up(choices, joint)
    return EMPTY if choices.size[joint] == 0 else found


@njit_part
def _least(choices: Choices, joint: int) -> float:
    begin, least = choices.first[joint], np.inf
    for at in range(begin, begin + choices.size[joint]):
        least = min(least, choices.cost[at])
    return least


@njit_part
def _sum(values: Array) -> float:
    total = 0.0
    for value in values:
        total += value
    return total


@njit_part
def _loaded(loads: NDArray[np.bool_], joint: int) -> bool:
    """Whether any other drive loads a joint."""
    for k in range(loads.shape[1]):
        if loads[joint, k]:
            return True
    return False


@njit_part
def _loading(loads: NDArray[np.bool_], k: int) -> bool:
    """Whether a drive loads any other joint."""
    for joint in range(loads.shape[0]):
        if loads[joint, k]:
            return True
    return False


@njit_part
def _all_decided(setting: Setting, memory: Memory) -> bool:
    """Whether no drive that loads another joint is open."""
    for k in range(memory.low.shape[0]):
        if _loading(setting.loads, k):
            for i in range(NUMBERS):
                if memory.low[k, i] != memory.high[k, i]:
                    return False
    return True


def propagate(
    task: PackedTask, setting: Setting, choices: Choices, limit: float, full: int, passes: int, memory: Memory
) -> tuple[int, int]:
    """Rule out candidates until nothing changes.

    Args:
        task: The packed study.
        setting: What pairs cost, and which drives load which joints.
        choices: The candidates; they are closed up, their least costs brought up to date.
        limit: Sets that cost as much or more are of no interest.
        full: Joints with at most so many candidates have all of them tested.
        passes: At most so many.
        memory: Filled again; afterwards it holds the numbers that are left.

    Returns:
        OPEN; EMPTY and the joint at which nothing is left; TOO_DEAR; ASKED and the joint.
    """
    sieves = address_of_unit(sieve, task, setting, choices, 0, limit, True, memory)
    code, joint = _propagate(sieves, task, setting, choices, limit, full, passes, memory)
    return code, joint


@njit_entry
def _propagate(
    sieves: int, task: PackedTask, setting: Setting, choices: Choices, limit: float, full: int, passes: int,
    memory: Memory,
) -> tuple[int, int]:  # fmt: skip
    """``propagate``, with the address of ``sieve``."""
    n = task.first.size - 1
    for joint in range(n):
        range_of_numbers(task, choices, joint, memory.low, memory.high)
    for _ in range(passes):
        memory.counts[PASSES] += 1
        changed = False
        for joint in range(n - 1, -1, -1):
            decided = interval(task, setting, joint, memory.low, memory.high, memory.torque)
            bound_joint(task, joint, memory.torque[0], memory.torque[1], memory.bounds)
            least_bearing(task, setting.loads, joint, memory.low, memory.high, memory.bearing)
            room = limit - (_sum(choices.least) - choices.least[joint])
            tested = choices.size[joint] <= full
            if not call_sieve(sieves, task, setting, choices, joint, room, tested, memory):
                return EMPTY, joint
            alone = not _loaded(setting.loads, joint)
            # Short of a whole set the bounds are nearly as good as a judgement, and hundreds of times cheaper.
            doubted = memory.suspects[choices.pool[choices.first[joint]]]
            if decided and (alone or doubted or _all_decided(setting, memory)):
                call_load(memory.units[LOAD], task, joint, memory.low, memory.load)
                code = settle(task, setting, choices, joint, alone, memory)
                if code != OPEN:
                    return code, joint
            least = _least(choices, joint)
            changed = changed or least > choices.least[joint]
            choices.least[joint] = max(choices.least[joint], least)
            if _sum(choices.least) >= limit:
                return TOO_DEAR, joint
            changed = range_of_numbers(task, choices, joint, memory.low, memory.high) or changed
        if not changed:
            break
    return OPEN, 0


@njit_entry
def set_power(task: PackedTask, pairs: Indices, memory: Memory, total: Array) -> None:
    """Electrical power of all drives of a set that holds.

    Args:
        task: The packed study.
        pairs: One a joint, (n,).
        memory: Filled again.
        total: Takes it at each sample, negative when regenerating [W], (N,).
    """
    for t in range(total.size):
        total[t] = 0.0
    for joint in range(pairs.size):
        for i in range(NUMBERS):
            memory.low[joint, i] = task.numbers[pairs[joint], i]
    for joint in range(pairs.size):
        call_load(memory.units[LOAD], task, joint, memory.low, memory.load)
        call_power(memory.units[POWER], task, joint, pairs[joint], memory.load, memory.power)
        for t in range(total.size):
            total[t] += memory.power[t]
