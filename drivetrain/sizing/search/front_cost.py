"""What the candidates of a box cost: exact where the drives that load a joint are decided, bounds otherwise.

The energy of a joint is bounded beside a line: at each sample the power less a multiple of the load is bounded over
the interval of loads, and the multiples, summed up, are linear in the numbers of the drives that load the joint. That
part goes to those drives. So a heavy drive pays for what it costs at the joints before it while these are still open,
and what is lost in the bound shrinks with the square of the interval.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.demand.load_kernels import bound_joint
from drivetrain.sizing.demand.load_loops import add_drive
from drivetrain.sizing.judge.compiling import njit_entry, njit_leaf, njit_loop, njit_part
from drivetrain.sizing.judge.judge_kernels import ASK, FALLS, JUDGE, LOAD, POWER, may_hold
from drivetrain.sizing.judge.judge_kernels import EXACT as VERDICT
from drivetrain.sizing.judge.packed_rows import (
    COULOMB,
    DIRECT_DRIVE,
    DRIVEN,
    DRIVING,
    INPUT_INERTIA,
    NO_LOAD,
    RATIO,
    ROTOR,
    TILTING,
    VISCOUS,
)
from drivetrain.sizing.judge.packed_task import (
    ACCELERATION,
    AMBIENT,
    CARRIER,
    CURVED,
    LOSS_FRICTION,
    LOSS_SPEED,
    PEAK_FACTOR,
    SPEED,
    WAY,
    WEIGHT,
    Indices,
    PackedTask,
)
from drivetrain.sizing.judge.torque_kernels import constant_at, curved_friction, resistance
from drivetrain.sizing.judge.units import call_judge, call_load, call_power
from drivetrain.sizing.judge.vector_max import larger, smaller
from drivetrain.sizing.search.bearing_bound import least_bearing
from drivetrain.sizing.search.front_kernels import BELOW, ENERGY, MASS, PRICE, USED, bound_used
from drivetrain.sizing.search.propagation import Memory, Setting, interval

OWN_LOW, OWN_HIGH, SHAFT = 3, 4, 5  # rows of the scratch of bounds
SAMPLED = 8  # candidates that a line is taken from
NARROWER = 0.7  # than when costs were found: then they are found anew
TINY = 1e-12  # what is open has some width, even where it changes no torque


class Known(NamedTuple):
    """What all boxes of a search share.

    Attributes:
        fixed: Mass [kg] and price of each pair, (P, 2).
        reach: Largest torque that one unit of each number of the drive of joint k makes on joint j, over the largest
            that the task alone asks there, (j, k, NUMBERS).
    """

    fixed: Array
    reach: Array


class Box(NamedTuple):
    """Some candidates at every joint, n joints, T candidates in all.

    Attributes:
        pool: Pairs by joint, (T,).
        cost: Mass, price, energy a cycle and utilisation of each, exact or bounds; of energy without what the drives
            that load a joint take over of it, (T, 4).
        doubt: Whether only the Python road can tell if a candidate holds, (T,).
        first, size: Where the candidates of each joint begin, and how many there are, (n,).
        decided: Whether the load of a joint is decided, (n,).
        stale: Whether the costs of a joint are to be found anew, (n,).
        low, high: Of the numbers of the candidates, (n, NUMBERS).
        width: Of what was open in the load of each joint when its costs were found, as a share of the largest, (n,).
        slope: Energy at joint j that a unit of each number of the drive of joint k answers for [J], (j, k, NUMBERS).
    """

    pool: Indices
    cost: Array
    doubt: NDArray[np.bool_]
    first: Indices
    size: Indices
    decided: NDArray[np.bool_]
    stale: NDArray[np.bool_]
    low: Array
    high: Array
    width: Array
    slope: Array


@njit_loop
def _power_slope(row: Array, m: Array, g: Array, loss: float, low: Array, high: Array, line: Array) -> None:
    """Adds how the power of a pair grows with the load, at the middle of the interval, lossless rotor left out."""
    ratio, inertia = g[RATIO], m[ROTOR] + g[INPUT_INERTIA]
    driving, driven = g[DRIVING] / ratio, g[DRIVEN] / ratio
    hold = max(g[DRIVEN], 0.0) / ratio
    way, friction, speed, acceleration = row[WAY], row[LOSS_FRICTION], row[SPEED], row[ACCELERATION]
    for t in range(len(line)):
        up = driving if way[t] > 0.0 else (driven if way[t] < 0.0 else hold)
        down = driven if way[t] > 0.0 else (driving if way[t] < 0.0 else hold)
        load = 0.5 * (low[t] + high[t]) + friction[t]
        share = up if load > 0.0 else down
        torque = share * load + inertia * ratio * acceleration[t]
        line[t] += share * (ratio * speed[t] + 2.0 * loss * torque)


@njit_loop
def _weighted(line: Array, weight: Array, unit: Array) -> float:
    """Sum of line times weight times unit."""
    total = 0.0
    for t in range(len(line)):
        total += line[t] * weight[t] * unit[t]
    return total


@njit_loop
def _least_beside(
    row: Array, m: Array, g: Array, loss: float, curved: bool, low: Array, high: Array, line: Array, shaft: Array
) -> float:
    """The least energy less the line times the load's distance from the middle of its interval.

    The motor's torque is one straight line for a positive load and another for a negative one, so the power is a
    parabola on each side, least at its vertex or at an end.
    """
    way, friction, ratio, inertia = row[WAY], row[LOSS_FRICTION], g[RATIO], m[ROTOR] + g[INPUT_INERTIA]
    driving, driven, hold = g[DRIVING] / ratio, g[DRIVEN] / ratio, max(g[DRIVEN], 0.0) / ratio
    sign, given = 1.0 if ratio > 0.0 else -1.0, 1.0 if curved else 0.0
    constant = sign * (g[NO_LOAD] if curved else m[COULOMB] + g[NO_LOAD])
    viscous, geared = 0.0 if curved else m[VISCOUS] * ratio, inertia * ratio
    acceleration, carrier, slow = row[ACCELERATION], row[CARRIER], row[LOSS_SPEED]
    speed, weight = row[SPEED], row[WEIGHT]
    total = 0.0
    for t in range(len(line)):
        up = driving if way[t] > 0.0 else (driven if way[t] < 0.0 else hold)
        down = driven if way[t] > 0.0 else (driving if way[t] < 0.0 else hold)
        own = (geared * acceleration[t] + inertia * carrier[t]) + (constant * way[t] + viscous * slow[t])
        own += given * shaft[t]
        a, b, turning, steep = low[t] + friction[t], high[t] + friction[t], ratio * speed[t], line[t]
        alone = own * (turning + loss * own) + steep * 0.5 * (a + b)
        begin, end = larger(a, 0.0), larger(b, 0.0)
        square, straight = loss * up * up, up * turning + 2.0 * loss * up * own - steep
        vertex = -straight / (2.0 * square) if square > 0.0 else (begin if straight > 0.0 else end)
        at = smaller(larger(vertex, begin), end)
        above = (square * at + straight) * at
        begin, end = smaller(a, 0.0), smaller(b, 0.0)
        square, straight = loss * down * down, down * turning + 2.0 * loss * down * own - steep
        vertex = -straight / (2.0 * square) if square > 0.0 else (begin if straight > 0.0 else end)
        at = smaller(larger(vertex, begin), end)
        below = (square * at + straight) * at
        least = smaller(above, below)
        least = above if a >= 0.0 else (below if b <= 0.0 else least)
        total += weight[t] * (least + alone)
    return total


@njit_leaf
def _line(task: PackedTask, joint: int, box: Box, low: Array, high: Array, line: Array) -> None:
    """How the power grows with the load at each sample [W/(N m)], the mean over some candidates."""
    for t in range(len(line)):
        line[t] = 0.0
    first, size, limits = box.first[joint], box.size[joint], task.tasks[joint]
    count = min(size, SAMPLED)
    for i in range(count):
        pair = box.pool[first + i * size // count]
        m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
        constant = constant_at(m, limits[AMBIENT])
        loss = resistance(m, limits[AMBIENT]) / (constant * constant)
        if loss < np.inf and g[DRIVING] < np.inf:
            _power_slope(task.series[joint], m, g, loss, low, high, line)
    for t in range(len(line)):
        line[t] = line[t] / count if abs(line[t]) < np.inf else 0.0


@njit_leaf
def _slopes(task: PackedTask, setting: Setting, joint: int, box: Box, line: Array) -> float:
    """What the drives that load a joint answer for; their share at the middle of their numbers [J]."""
    weight, taken = task.series[joint, WEIGHT], 0.0
    for k in range(len(box.size)):
        for i in range(NUMBERS):
            box.slope[joint, k, i] = 0.0
            if setting.loads[joint, k] and box.low[k, i] < box.high[k, i]:
                slope = _weighted(line, weight, task.force[task.offsets[joint, k] + i])
                box.slope[joint, k, i] = slope
                taken += slope * 0.5 * (box.low[k, i] + box.high[k, i])
    return taken


@njit_leaf
def _least_energy_beside(task: PackedTask, joint: int, pair: int, loss: float, line: Array, memory: Memory) -> float:
    """``_least_beside`` of a pair within the bounds of its joint."""
    m, g, bounds = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]], memory.bounds
    low, high, at, curved = bounds.low, bounds.high, task.offsets[joint, joint], task.tasks[joint, CURVED] != 0.0
    shaft = bounds.scratch[SHAFT]
    if at >= 0:
        low, high = bounds.scratch[OWN_LOW], bounds.scratch[OWN_HIGH]
        add_drive(bounds.low, task.force, at, task.numbers, pair, low)
        add_drive(bounds.high, task.force, at, task.numbers, pair, high)
    if curved:
        for t in range(len(shaft)):
            shaft[t] = 0.0
        curved_friction(m, g[RATIO], task.series[joint, LOSS_SPEED], shaft)
    return _least_beside(task.series[joint], m, g, loss, curved, low, high, line, shaft)


@njit_leaf
def _bearing_used(task: PackedTask, joint: int, pair: int, least: Array) -> float:
    """How near a pair's output bearing comes to its limits at least."""
    g, used = task.gears[task.pairs[pair, 1]], 0.0
    if g[DIRECT_DRIVE] == 0.0:
        for which in range(3):
            limit = g[TILTING + which]
            if limit > 0.0:
                used = max(used, task.tasks[joint, PEAK_FACTOR] * least[which] / limit)
    return used


@njit_leaf
def _width(setting: Setting, joint: int, box: Box, reach: Array) -> float:
    """How much of the load of a joint is open."""
    width = 0.0
    for k in range(len(box.size)):
        if setting.loads[joint, k]:
            for i in range(NUMBERS):
                if box.low[k, i] < box.high[k, i]:
                    width += 0.5 * (box.high[k, i] - box.low[k, i]) * reach[joint, k, i] + TINY
    return width


@njit_part
def _update(task: PackedTask, setting: Setting, box: Box, joint: int) -> None:
    """The range of a joint's numbers; where it changed the costs of what it loads are stale."""
    changed = False
    for i in range(NUMBERS):
        low, high = np.inf, -np.inf
        for at in range(box.first[joint], box.first[joint] + box.size[joint]):
            value = task.numbers[box.pool[at], i]
            low, high = min(low, value), max(high, value)
        changed = changed or low != box.low[joint, i] or high != box.high[joint, i]
        box.low[joint, i], box.high[joint, i] = low, high
    for other in range(len(box.size)):
        if changed and setting.loads[other, joint]:
            box.stale[other] = True


@njit_leaf
def take_out(box: Box, joint: int, kept: NDArray[np.bool_]) -> None:
    """Close up the candidates of a joint.

    Args:
        kept: Whether a candidate stays, (T,).
    """
    to = box.first[joint]
    for at in range(box.first[joint], box.first[joint] + box.size[joint]):
        if kept[at]:
            box.pool[to], box.doubt[to] = box.pool[at], box.doubt[at]
            for i in range(4):
                box.cost[to, i] = box.cost[at, i]
            to += 1
    box.size[joint] = to - box.first[joint]


# long kernel: all candidates of a box in one pass, bounds or exact figures
@njit_entry
def cost_box(
    task: PackedTask, setting: Setting, known: Known, box: Box, memory: Memory, kept: NDArray[np.bool_], work: Indices
) -> bool:
    """Costs of the candidates of all joints whose costs are stale; those that hold in no case are taken out.

    Args:
        kept: Scratch, (T,).
        work: Its first counts the candidates looked at, (1,).
    """
    n = len(box.size)
    for joint in range(n):
        _update(task, setting, box, joint)
    for joint in range(n - 1, -1, -1):
        if not box.stale[joint]:
            continue
        width = _width(setting, joint, box, known.reach)
        if width > NARROWER * box.width[joint]:
            continue  # what was found still bounds the costs, nearly as well
        box.stale[joint], box.width[joint] = False, width
        for k in range(n):
            for i in range(NUMBERS):
                memory.low[k, i], memory.high[k, i] = box.low[k, i], box.high[k, i]
        decided = interval(task, setting, joint, memory.low, memory.high, memory.torque)
        box.decided[joint] = decided
        taken, line = 0.0, memory.power
        if decided:
            call_load(memory.units[LOAD], task, joint, memory.low, memory.load)
            for k in range(n):
                for i in range(NUMBERS):
                    box.slope[joint, k, i] = 0.0
        else:
            bound_joint(task, joint, memory.torque[0], memory.torque[1], memory.bounds)
            least_bearing(task, setting.loads, joint, memory.low, memory.high, memory.bearing)
            _line(task, joint, box, memory.bounds.low, memory.bounds.high, line)
            taken = _slopes(task, setting, joint, box, line)
        for at in range(box.first[joint], box.first[joint] + box.size[joint]):
            pair, kept[at] = box.pool[at], False
            work[0] += 1
            box.cost[at, MASS], box.cost[at, PRICE], box.doubt[at] = known.fixed[pair, 0], known.fixed[pair, 1], False
            if decided:
                code, _, used = call_judge(memory.units[JUDGE], task, joint, pair, memory.load, VERDICT)
                if code != FALLS:
                    kept[at], box.doubt[at], box.cost[at, USED] = True, code == ASK, used
                    box.cost[at, ENERGY] = call_power(memory.units[POWER], task, joint, pair, memory.load, line)
                continue
            bearing = _bearing_used(task, joint, pair, memory.bearing.least)
            if bearing * BELOW > 1.0 or not may_hold(task, joint, pair, memory.bounds):
                continue
            used, loss = bound_used(task, joint, pair, memory)
            used = max(used, bearing)
            if used * BELOW > 1.0:
                continue
            energy = _least_energy_beside(task, joint, pair, loss, line, memory)
            kept[at], box.cost[at, USED] = True, used * BELOW
            box.cost[at, ENERGY] = energy - taken - (1.0 - BELOW) * (abs(energy) + abs(taken))
        take_out(box, joint, kept)
        if box.size[joint] == 0:
            return False
        _update(task, setting, box, joint)
    return True
