"""What a search holds, and the pass over one joint's candidates that rules out those that cannot matter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.compiling import njit_unit
from drivetrain.sizing.judge.judge_kernels import (
    JointBounds,
    JointLoad,
    judge_units,
    least_energy,
    may_hold,
    new_bounds,
    new_load,
)
from drivetrain.sizing.judge.packed_task import PackedTask, empty_task
from drivetrain.sizing.judge.units import address_of_unit
from drivetrain.sizing.search.bearing_bound import SomeWrenches, bearing_may_hold, some_wrenches
from drivetrain.sizing.search.energy_bound import least_energy_of_lines

Indices = NDArray[np.int64]


UNKNOWN = -1
BELOW = 1.0 - 2e-9  # a bound stays a bound though it is rounded
TESTED, JUDGED, PASSES, COUNTS = range(4)
SIEVE = 3  # after the units that judge


class Choices(NamedTuple):
    """The candidates that are left at each joint, and what is known of them; n joints.

    Attributes:
        pool: Pairs by joint, those of joint j from ``first[j]``, ``size[j]`` of them, those that were cheapest first.
        cost: What each costs at least, in the order of the pool.
        exact: Whether that is what it costs, and it holds: its load is decided, in the order of the pool.
        first, size: (n,).
        least: What each joint costs at least, (n,).
        known: Pair of each joint that is known to hold and to be the cheapest, its load decided, -1 for none, (n,).
        tested: How many candidates were held against the torque that is left possible: none (0), those that might be
            the cheapest (1), all (2), (n,).
    """

    pool: Indices
    cost: Array
    exact: NDArray[np.bool_]
    first: Indices
    size: Indices
    least: Array
    known: Indices
    tested: Indices


class Setting(NamedTuple):
    """What a search minimises, and what hangs together.

    Attributes:
        share: What each pair adds to the objective whatever it does, (P,).
        base: The same, and a trifle by which pairs of equal share are put in order, (P,).
        energy: What one joule a cycle adds.
        reserve: What a whole utilisation adds: a trifle, by which sets of equal objective are put in order.
        loads: Whether the drive of joint k changes what is asked of joint j, (j, k).
    """

    share: Array
    base: Array
    energy: float
    reserve: float
    loads: NDArray[np.bool_]


class Memory(NamedTuple):
    """Memory that every pass fills again.

    Attributes:
        low, high: Smallest and largest number of the drives left at each joint, (n, NUMBERS).
        torque: Ends of the interval on one joint [N m], (2, N).
        bounds: Of one joint.
        load: Of one joint.
        bearing: For what the output bearing of one joint carries at least.
        power: Of one drive [W], (N,).
        verdicts: What was judged of the pairs of joints that no other drive loads: HOLDS, FALLS or UNKNOWN, (P,).
        settled: What such a pair that holds costs, (P,).
        suspects: Pairs that once fell although the bounds let them pass, (P,).
        counts: Work done: candidates tested, candidates judged, passes, (COUNTS,).
        units: Addresses of kernels, by JUDGE, POWER, LOAD and SIEVE, (4,).
    """

    low: Array
    high: Array
    torque: Array
    bounds: JointBounds
    load: JointLoad
    bearing: SomeWrenches
    power: Array
    verdicts: Indices
    settled: Array
    suspects: NDArray[np.bool_]
    counts: Indices
    units: Indices


def new_memory(task: PackedTask) -> Memory:
    """Memory for the propagation of one task."""
    memory = _room(task)
    memory.units[:SIEVE] = judge_units(task, memory.load)
    memory.units[SIEVE] = _sieve_unit(task, memory)
    return memory


def _room(task: PackedTask) -> Memory:
    """Memory that no address stands in."""
    n, _, samples = task.series.shape
    empty = np.zeros((n, NUMBERS))
    counts = np.zeros(COUNTS, dtype=np.int64)
    load, power = new_load(task), np.zeros(samples)
    verdicts = np.full(len(task.pairs), UNKNOWN, dtype=np.int64)
    torque, suspects = np.zeros((2, samples)), np.zeros(len(task.pairs), dtype=np.bool_)
    bounds, bearing, units = new_bounds(task), some_wrenches(task), np.zeros(SIEVE + 1, dtype=np.int64)
    return Memory(
        empty, empty.copy(), torque, bounds, load, bearing, power, verdicts, np.zeros(len(task.pairs)), suspects,
        counts, units
    )  # fmt: skip


def _unused(task: PackedTask, memory: Memory) -> tuple[Setting, Choices]:
    """What tells compilers of which kind these are."""
    n, units, power, suspects = len(task.series), memory.units, memory.power, memory.suspects
    setting = Setting(power, power, 0.0, 0.0, np.zeros((n, n), dtype=np.bool_))
    return setting, Choices(units, power, suspects, units, units, power, units, units)


def _sieve_unit(task: PackedTask, memory: Memory) -> int:
    """The address of the sieve."""
    setting, choices = _unused(task, memory)
    return address_of_unit(f"{__name__}:compile_sieve", sieve, task, setting, choices, 0, 0.0, True, memory)


def compile_sieve() -> None:
    """Have the sieve compiled, if it is not in the disk cache."""
    task = empty_task()
    _sieve_unit(task, _room(task))


def empty_search() -> tuple[PackedTask, Setting, Choices, Memory]:
    """A search with nothing in it, which tells compilers what kind of arrays there are."""
    task = empty_task()
    memory = _room(task)
    return task, *_unused(task, memory), memory


# long kernel: one joint's candidates in one pass, with what was ruled out closed up in place
@njit_unit
def sieve(
    task: PackedTask, setting: Setting, choices: Choices, joint: int, limit: float, full: bool, memory: Memory
) -> bool:
    """Rule out the candidates of one joint that cannot be part of a set within a limit."""
    begin, end = choices.first[joint], choices.first[joint] + choices.size[joint]
    pool, cost, exact = choices.pool, choices.cost, choices.exact
    kept, least = begin, np.inf
    for at in range(begin, end):
        pair, asked, sure = pool[at], cost[at], exact[at]
        if asked >= limit:
            continue
        if (full or asked < least) and not sure:
            memory.counts[TESTED] += 1
            if not bearing_may_hold(task, joint, pair, memory.bearing.least):
                continue
            if not may_hold(task, joint, pair, memory.bounds):
                continue
            if setting.energy != 0.0:
                drawn = least_energy(task, joint, pair, memory.bounds)
                if setting.base[pair] + setting.energy * drawn < limit:
                    low, high = memory.low, memory.high
                    lines = least_energy_of_lines(task, setting.loads, joint, pair, low, high, memory.bounds)
                    drawn = max(drawn, lines)
                drawn *= BELOW if drawn > 0.0 else 1.0 / BELOW
                asked = max(asked, setting.base[pair] + setting.energy * drawn)
                if asked >= limit:
                    continue
            least = min(least, asked)
        elif sure:
            least = min(least, asked)
        pool[kept], cost[kept], exact[kept] = pair, asked, sure
        kept += 1
    choices.size[joint] = kept - begin
    return kept > begin
