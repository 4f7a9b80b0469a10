"""What the open choices of a search leave possible, compiled: intervals of torque, candidates ruled out, least costs.

The torque on a joint is a weighted sum over the numbers of the drives that load it. While these are open, each number
lies between the smallest and the largest of the candidates left, so each sample's torque lies in an interval; a
candidate that holds nowhere within it is out, whatever the other drives will be. Fewer candidates leave narrower
intervals, and these fewer candidates: the passes repeat, from the tip to the base, until nothing changes.

A joint whose load is decided has an interval without width; its cheapest candidate is then judged exactly.
"""

from __future__ import annotations

from functools import lru_cache

import numba as nb
import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.compiling import njit_entry, njit_leaf, njit_part
from drivetrain.sizing.judge.judge_kernels import ASK, EXACT, FALLS, HOLDS, JUDGE, LOAD, POWER, bound_joint
from drivetrain.sizing.judge.packed_task import PackedTask
from drivetrain.sizing.judge.units import call_judge, call_load, call_power, call_sieve
from drivetrain.sizing.search.bearing_bound import WIDER, least_bearing
from drivetrain.sizing.search.sieve_kernel import (
    JUDGED,
    PASSES,
    SIEVE,
    TESTED,
    UNKNOWN,
    Choices,
    Indices,
    Memory,
    Setting,
    empty_search,
    new_memory,
)

__all__ = [
    "ASKED", "EMPTY", "JUDGED", "OPEN", "PASSES", "TESTED", "TOO_DEAR", "Choices", "Indices", "Memory", "Setting",
    "interval", "new_memory", "propagate", "range_of_numbers", "set_power", "settle",
]  # fmt: skip


OPEN, EMPTY, TOO_DEAR, ASKED = range(4)


@njit_leaf
def range_of_numbers(task: PackedTask, choices: Choices, joint: int, low: Array, high: Array) -> bool:
    """The smallest and largest numbers of the candidates left at a joint.

    Args:
        low, high: Take the numbers, in the units of ``drive_numbers``, (n, NUMBERS).
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
        low, high: Numbers of all joints' drives, (n, NUMBERS).
        torque: Takes both ends, at the gear's output, joint friction not in it [N m], (2, N).
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


@njit_leaf
def _close_up(choices: Choices, joint: int, limit: float) -> None:
    """Take out the candidates of a joint that cost as much as a limit or more."""
    begin, end = choices.first[joint], choices.first[joint] + choices.size[joint]
    kept = begin
    for at in range(begin, end):
        if choices.cost[at] < limit:
            choices.pool[kept], choices.cost[kept] = choices.pool[at], choices.cost[at]
            choices.exact[kept] = choices.exact[at]
            kept += 1
    choices.size[joint] = kept - begin


@njit_leaf
def _cheapest(choices: Choices, joint: int) -> int:
    """Where in the pool the cheapest candidate of a joint stands."""
    begin, best = choices.first[joint], choices.first[joint]
    for at in range(begin, begin + choices.size[joint]):
        if choices.cost[at] < choices.cost[best]:
            best = at
    return best


@njit_leaf
def settle(task: PackedTask, setting: Setting, choices: Choices, joint: int, alone: bool, memory: Memory) -> int:
    """Judge the cheapest candidates of a joint whose load is decided, until the cheapest is known to hold."""
    pool, cost, exact, found, loaded = choices.pool, choices.cost, choices.exact, OPEN, False
    choices.known[joint] = -1
    while True:
        best = _cheapest(choices, joint)
        if cost[best] == np.inf:
            break
        pair = pool[best]
        if exact[best]:
            choices.known[joint] = pair
            break
        code = memory.verdicts[pair] if alone else UNKNOWN
        if code == HOLDS:
            cost[best], exact[best] = memory.settled[pair], True
            continue
        if code == UNKNOWN:
            if not loaded:
                call_load(memory.units[LOAD], task, joint, memory.low, memory.load)
                loaded = True
            memory.counts[JUDGED] += 1
            code, _, used = call_judge(memory.units[JUDGE], task, joint, pair, memory.load, EXACT)
            if code != FALLS:
                cost[best] = setting.base[pair] + setting.reserve * max(used, 0.0)
                if setting.energy != 0.0:
                    drawn = call_power(memory.units[POWER], task, joint, pair, memory.load, memory.power)
                    cost[best] += setting.energy * drawn
                memory.settled[pair] = cost[best]
            memory.verdicts[pair] = code if alone and code != ASK else UNKNOWN
        if code == ASK:
            choices.known[joint], found = -2 - pair, ASKED
            break
        if code == FALLS:
            memory.suspects[pair] = True
            cost[best] = np.inf
        exact[best] = True
    _close_up(choices, joint, np.inf)
    return EMPTY if choices.size[joint] == 0 else found


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


@njit_part
def _decided(setting: Setting, memory: Memory, joint: int) -> bool:
    """Whether every drive that loads a joint is decided."""
    for k in range(memory.low.shape[0]):
        if setting.loads[joint, k]:
            for i in range(NUMBERS):
                if memory.low[k, i] != memory.high[k, i]:
                    return False
    return True


@njit_leaf
def _new_range(task: PackedTask, setting: Setting, choices: Choices, joint: int, memory: Memory) -> bool:
    """The range of the numbers left at a joint; where it changes, candidates that it loads are to be tested again."""
    if not range_of_numbers(task, choices, joint, memory.low, memory.high):
        return False
    for other in range(memory.low.shape[0]):
        if setting.loads[other, joint]:
            choices.tested[other] = 0
    return True


# long kernel: one pass after another over all joints, each with its own way out
@njit_entry
def propagate(
    task: PackedTask, setting: Setting, choices: Choices, limit: float, full: int, passes: int, memory: Memory
) -> tuple[int, int]:
    """Rule out candidates until nothing changes."""
    n = task.first.size - 1
    for joint in range(n):
        _new_range(task, setting, choices, joint, memory)
    for _ in range(passes):
        memory.counts[PASSES] += 1
        changed = False
        for joint in range(n - 1, -1, -1):
            before, room = choices.size[joint], limit - (_sum(choices.least) - choices.least[joint])
            wanted = 2 if before <= full else 1
            if choices.tested[joint] < wanted:
                interval(task, setting, joint, memory.low, memory.high, memory.torque)
                bound_joint(task, joint, memory.torque[0], memory.torque[1], memory.bounds)
                least_bearing(task, setting.loads, joint, memory.low, memory.high, memory.bearing)
                choices.tested[joint] = wanted
                if not call_sieve(memory.units[SIEVE], task, joint, (setting, choices, room, wanted == 2), memory):
                    return EMPTY, joint
            else:
                _close_up(choices, joint, room)
                if choices.size[joint] == 0:
                    return EMPTY, joint
            best = _cheapest(choices, joint)
            if not choices.exact[best] and _decided(setting, memory, joint):
                alone = not _loaded(setting.loads, joint)
                # Short of a whole set the bounds are nearly as good as a judgement, and hundreds of times cheaper.
                if alone or memory.suspects[choices.pool[best]] or _all_decided(setting, memory):
                    code = settle(task, setting, choices, joint, alone, memory)
                    if code != OPEN:
                        return code, joint
                    best = _cheapest(choices, joint)
            choices.known[joint] = choices.pool[best] if choices.exact[best] else -1
            least = choices.cost[best]
            changed = changed or least > choices.least[joint]
            choices.least[joint] = max(choices.least[joint], least)
            if _sum(choices.least) >= limit:
                return TOO_DEAR, joint
            if choices.size[joint] != before:
                changed = _new_range(task, setting, choices, joint, memory) or changed
        if not changed:
            break
    return OPEN, 0


@njit_entry
def set_power(task: PackedTask, pairs: Indices, memory: Memory, total: Array) -> None:
    """Electrical power of all drives of a set that holds.

    Args:
        pairs: One a joint, (n,).
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


@lru_cache(maxsize=1)
def compile_propagate() -> None:
    """Have the passes compiled, if they are not in the disk cache."""
    task, setting, choices, memory = empty_search()
    propagate.compile(tuple(nb.typeof(one) for one in (task, setting, choices, 0.0, 0, 0, memory)))


@lru_cache(maxsize=1)
def compile_set_power() -> None:
    """Have the power of a set compiled, if it is not in the disk cache."""
    task, _, choices, memory = empty_search()
    set_power.compile(tuple(nb.typeof(one) for one in (task, choices.pool, memory, memory.power)))
