"""What the candidates of a joint cost at least while other choices are open, and which of them can still matter."""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.judge_kernels import ASK, FALLS, judge_exact, least_energy, load_joint, may_hold, pair_power
from drivetrain.sizing.load_kernels import PEAK_LOAD, bound_joint
from drivetrain.sizing.packed_rows import DIRECT_DRIVE, MAX_INPUT, MAX_SPEED, MOMENTARY, RATIO, REPEATED
from drivetrain.sizing.packed_task import FASTEST, PEAK_FACTOR, SPEED_FACTOR, Indices, PackedTask
from drivetrain.sizing.propagation import Memory, Setting, interval
from drivetrain.sizing.warm_bound import stays_cool

MASS, PRICE, ENERGY, USED = range(4)
OUT, BOUND, EXACT, UNSURE = range(4)
BELOW = 1.0 - 1e-9  # a bound stays a bound though it is rounded


# long kernel: one joint's candidates in one pass, bounds or exact figures
@nb.njit(cache=True, error_model="numpy", nogil=True)
def cost_joint(
    task: PackedTask, setting: Setting, joint: int, pool: Indices, fixed: Array, memory: Memory, costs: Array,
    states: Indices,
) -> bool:  # fmt: skip
    """The costs of a joint's candidates: exact where the drives that load it are decided, bounds otherwise.

    Args:
        task: The packed study.
        setting: Which drives load which joints.
        joint: Index of the joint.
        pool: Its candidates, (K,).
        fixed: Mass [kg] and price of each pair, (P, 2).
        memory: Its ``low`` and ``high`` hold the numbers of what is left at every joint.
        costs: Takes mass, price, energy a cycle [J] and utilisation, (K, 4).
        states: Takes OUT for a candidate that holds in no case, BOUND or EXACT, or UNSURE where only the Python road
            can tell whether it holds, its costs exact, (K,).

    Returns:
        Whether the load is decided.
    """
    decided = interval(task, setting, joint, memory.low, memory.high, memory.torque)
    if decided:
        load_joint(task, joint, memory.low, memory.load)
    else:
        bound_joint(task, joint, memory.torque[0], memory.torque[1], memory.bounds)
    limits = task.tasks[joint]
    for i in range(pool.size):
        pair = pool[i]
        costs[i, MASS], costs[i, PRICE] = fixed[pair, 0], fixed[pair, 1]
        if decided:
            code, _, used = judge_exact(task, joint, pair, memory.load)
            states[i] = OUT if code == FALLS else (UNSURE if code == ASK else EXACT)
            costs[i, USED] = used
            if code != FALLS:
                costs[i, ENERGY] = pair_power(task, joint, pair, memory.load, memory.power)
            continue
        states[i] = OUT
        if not (may_hold(task, joint, pair, memory.bounds) and stays_cool(task, joint, pair, memory.bounds)):
            continue
        states[i] = BOUND
        least = least_energy(task, joint, pair, memory.bounds)
        costs[i, ENERGY] = least * BELOW if least > 0.0 else least / BELOW
        m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
        used, turning = 0.0, limits[SPEED_FACTOR] * abs(g[RATIO]) * limits[FASTEST]
        if g[DIRECT_DRIVE] == 0.0 and task.offsets[joint, joint] < 0:
            peak = limits[PEAK_FACTOR] * memory.bounds.numbers[PEAK_LOAD]
            used = max(_share(peak, g[REPEATED]), _share(peak, g[MOMENTARY]))
        used = max(used, _share(turning, m[MAX_SPEED]), _share(turning, g[MAX_INPUT]))
        costs[i, USED] = used * BELOW
    return decided


@nb.njit(cache=True, error_model="numpy", nogil=True)
def _share(required: float, available: float) -> float:
    """Required over available; 0 where nothing limits it."""
    return required / available if available > 0.0 and required > 0.0 else 0.0


@nb.njit(cache=True, error_model="numpy", nogil=True)
def survivors(
    values: Array, rest: Array, used: Array, rest_used: float, zones: Array, zone_used: Array, kept: NDArray[np.bool_]
) -> int:
    """Which candidates may be part of a set that no known one matches.

    Args:
        values: Weighted costs of the candidates, one column a weighting, (K, W).
        rest: The least that the other joints add to each, (W,).
        used: Utilisation of the candidates, (K,).
        rest_used: The least utilisation that the other joints bring.
        zones: Weighted corners of the zones that no known set dominates, (Z, W).
        zone_used: Their utilisation, (Z,).
        kept: Takes the answer, (K,).

    Returns:
        How many.
    """
    count = 0
    for i in range(values.shape[0]):
        kept[i] = False
        worst = max(used[i], rest_used)
        for zone in range(zones.shape[0]):
            if not worst < zone_used[zone]:
                continue
            inside = True
            for k in range(rest.size):
                if not values[i, k] + rest[k] < zones[zone, k]:
                    inside = False
                    break
            if inside:
                kept[i] = True
                count += 1
                break
    return count
