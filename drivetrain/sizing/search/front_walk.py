"""The sets of a small box one by one: from the tip to the base, each joint judged beside the drives already chosen.

What is not chosen yet is bounded by the costs that the box has found, so that a branch is left as soon as no zone can
be reached.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.compiling import njit_entry, njit_leaf, njit_part
from drivetrain.sizing.judge.judge_kernels import ASK, EXACT, FALLS, HOLDS, JUDGE, LOAD, POWER
from drivetrain.sizing.judge.packed_task import Indices, PackedTask
from drivetrain.sizing.judge.units import call_judge, call_load, call_power
from drivetrain.sizing.search.front_cost import Box
from drivetrain.sizing.search.front_kernels import ENERGY, MASS, PRICE, USED
from drivetrain.sizing.search.front_prune import Reach
from drivetrain.sizing.search.propagation import Memory


class Walk(NamedTuple):
    """Memory of a walk through a box of T candidates at n joints, W weightings; and the M sets that it may find.

    Attributes:
        least: Least of each weighting over the joints before each, (n + 1, W).
        height: Least utilisation of the joints before each, (n + 1,).
        exact: Costs of candidates beside those chosen, (T, 4).
        state: Verdicts on them, (T,).
        at: Candidate looked at of each joint, (n,).
        spent: Costs of what is chosen from each joint on, (n + 1, 4).
        doubt: Whether a verdict among them is open, (n + 1,).
        total: (W,).
        pairs: Of the sets found, (M, n).
        costs: Of the sets found, (M, 4).
        doubts: Whether the Python road is to be asked of a set, (M,).
        work: Candidates judged, (1,).
    """

    least: Array
    height: Array
    exact: Array
    state: Indices
    at: Indices
    spent: Array
    doubt: NDArray[np.bool_]
    total: Array
    pairs: Indices
    costs: Array
    doubts: NDArray[np.bool_]
    work: Indices


def new_walk(box: Box, weightings: int, sets: int) -> Walk:
    """Memory for a walk."""
    n, count = len(box.size), len(box.pool)
    return Walk(
        np.zeros((n + 1, weightings)), np.zeros(n + 1), np.zeros((count, 4)), np.zeros(count, dtype=np.int64),
        np.zeros(n, dtype=np.int64), np.zeros((n + 1, 4)), np.zeros(n + 1, dtype=np.bool_), np.zeros(weightings),
        np.zeros((sets, n), dtype=np.int64), np.zeros((sets, 4)), np.zeros(sets, dtype=np.bool_),
        np.zeros(1, dtype=np.int64),
    )  # fmt: skip


@njit_leaf
def _answered(task: PackedTask, box: Box, walk: Walk, joint: int, before: int) -> float:
    """Energy at the first joints that the drives chosen from a joint on answer for [J]."""
    total = 0.0
    for k in range(joint, len(box.size)):
        pair = box.pool[walk.at[k]]
        for j in range(min(before, k)):
            for i in range(NUMBERS):
                total += box.slope[j, k, i] * task.numbers[pair, i]
    return total


@njit_leaf
def _reaches(reach: Reach, walk: Walk, joint: int, answered: float) -> bool:
    """Whether the sets that begin with what is chosen may reach a zone."""
    spent, total = walk.spent[joint], walk.total
    height = max(spent[USED], walk.height[joint])
    for w in range(len(total)):
        own = reach.weights[w, 0] * spent[MASS] + reach.weights[w, 1] * spent[PRICE]
        total[w] = own + reach.weights[w, 2] * (spent[ENERGY] + answered) + walk.least[joint, w]
    for zone in range(len(reach.used)):
        if not height < reach.used[zone]:
            continue
        inside = True
        for w in range(len(total)):
            if not total[w] < reach.values[zone, w]:
                inside = False
                break
        if inside:
            return True
    return False


@njit_leaf
def _spend(walk: Walk, joint: int, cost: Array) -> None:
    """Add what a candidate of a joint costs to what is spent after it."""
    for i in range(3):
        walk.spent[joint, i] = walk.spent[joint + 1, i] + cost[i]
    walk.spent[joint, USED] = max(walk.spent[joint + 1, USED], cost[USED])


@njit_part
def _judged(
    task: PackedTask, box: Box, reach: Reach, memory: Memory, walk: Walk, joint: int
) -> None:  # fmt: skip
    """Verdicts and costs of the candidates of a joint beside those chosen after it; FALLS also where none matters.

    Judging takes a hundred times longer than a look at the bounds, and so do energies; so each has to be worth it.
    """
    loaded, exact = False, box.decided[joint]
    for at in range(box.first[joint], box.first[joint] + box.size[joint]):
        pair, walk.at[joint] = box.pool[at], at
        for i in range(4):
            walk.exact[at, i] = box.cost[at, i]
        walk.state[at] = ASK if box.doubt[at] else HOLDS
        if exact:
            continue
        _spend(walk, joint, box.cost[at])
        walk.state[at] = FALLS
        answered = _answered(task, box, walk, joint, joint + 1)
        if not _reaches(reach, walk, joint, answered):
            continue
        if not loaded:
            for k in range(len(box.size)):
                for i in range(NUMBERS):
                    memory.low[k, i] = task.numbers[box.pool[walk.at[k]], i] if k > joint else 0.0
            call_load(memory.units[LOAD], task, joint, memory.low, memory.load)
            loaded = True
        walk.work[0] += 1
        code, _, used = call_judge(memory.units[JUDGE], task, joint, pair, memory.load, EXACT)
        walk.spent[joint, USED] = max(walk.spent[joint, USED], used)
        if code == FALLS or not _reaches(reach, walk, joint, answered):
            continue
        walk.state[at], walk.exact[at, USED] = code, used
        power = call_power(memory.units[POWER], task, joint, pair, memory.load, memory.power)
        walk.exact[at, ENERGY] = power
    walk.at[joint] = box.first[joint] - 1


@njit_entry
def walk_box(task: PackedTask, box: Box, reach: Reach, memory: Memory, walk: Walk) -> int:
    """The sets of a box that hold at every joint and reach a zone."""
    n, sets = len(box.size), 0
    joint = n - 1
    for i in range(4):
        walk.spent[n, i] = 0.0
    walk.doubt[n] = False
    _judged(task, box, reach, memory, walk, joint)
    while joint < n and sets < len(walk.pairs):
        walk.at[joint] += 1
        at = walk.at[joint]
        if at == box.first[joint] + box.size[joint]:
            joint += 1
            continue
        if walk.state[at] == FALLS:
            continue
        _spend(walk, joint, walk.exact[at])
        walk.doubt[joint] = walk.doubt[joint + 1] or walk.state[at] == ASK
        if not _reaches(reach, walk, joint, _answered(task, box, walk, joint, joint)):
            continue
        if joint > 0:
            joint -= 1
            _judged(task, box, reach, memory, walk, joint)
            continue
        for k in range(n):
            walk.pairs[sets, k] = box.pool[walk.at[k]]
        for i in range(4):
            walk.costs[sets, i] = walk.spent[0, i]
        walk.doubts[sets] = walk.doubt[0]
        sets += 1
    return sets
