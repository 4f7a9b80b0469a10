"""What the candidates of a joint cost at least while other choices are open, and which of them can still matter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.bound_kernels import HIGH, LOW, least_energy, least_voltage
from drivetrain.sizing.compiling import njit_entry, njit_leaf, njit_part
from drivetrain.sizing.judge_kernels import ASK, FALLS, JUDGE, LOAD, POWER, may_hold
from drivetrain.sizing.judge_kernels import EXACT as VERDICT
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.load_kernels import (
    HOTTEST,
    PEAK,
    SQUARE,
    WARM_MAGNETS,
    bound_joint,
    least_average,
    least_peak,
)
from drivetrain.sizing.packed_rows import (
    AVERAGE,
    CONTINUOUS,
    DIRECT_DRIVE,
    INNER,
    MAGNET,
    MAX_INPUT,
    MAX_SPEED,
    MAX_WINDING,
    MEAN_INPUT,
    MOMENTARY,
    PEAK_CURRENT,
    PEAK_TORQUE,
    RATIO,
    REPEATED,
)
from drivetrain.sizing.packed_task import (
    AMBIENT,
    AMPLIFIER_CONTINUOUS,
    AMPLIFIER_PEAK,
    DURATION,
    FASTEST,
    MEAN_SPEED,
    PEAK_FACTOR,
    RMS_FACTOR,
    SPEED_FACTOR,
    TEMPERATURE_MARGIN,
    VOLTAGE_FACTOR,
    VOLTS,
    Indices,
    PackedTask,
)
from drivetrain.sizing.propagation import Memory, Setting, interval
from drivetrain.sizing.torque_kernels import constant_at, resistance
from drivetrain.sizing.units import call_judge, call_load, call_power

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
    "bearing_bound.py": 2792159485,
    "sieve_kernel.py": 3029491211,
    "propagation.py": 3661296086,
}

MASS, PRICE, ENERGY, USED = range(4)
OUT, BOUND, EXACT, UNSURE = range(4)
BELOW = 1.0 - 2e-9  # a bound stays a bound though it is rounded


# long kernel: one joint's candidates in one pass, bounds or exact figures
@njit_entry
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
        call_load(memory.units[LOAD], task, joint, memory.low, memory.load)
    else:
        bound_joint(task, joint, memory.torque[0], memory.torque[1], memory.bounds)
    for i in range(pool.size):
        pair = pool[i]
        costs[i, MASS], costs[i, PRICE] = fixed[pair, 0], fixed[pair, 1]
        if decided:
            code, _, used = call_judge(memory.units[JUDGE], task, joint, pair, memory.load, VERDICT)
            states[i] = OUT if code == FALLS else (UNSURE if code == ASK else EXACT)
            costs[i, USED] = used
            if code != FALLS:
                costs[i, ENERGY] = call_power(memory.units[POWER], task, joint, pair, memory.load, memory.power)
            continue
        states[i] = OUT
        if not may_hold(task, joint, pair, memory.bounds):
            continue
        figures = bound_candidate(task, joint, pair, memory)
        if figures[1] * BELOW > 1.0:
            continue
        states[i] = BOUND
        costs[i, ENERGY] = figures[0] * BELOW if figures[0] > 0.0 else figures[0] / BELOW
        costs[i, USED] = figures[1] * BELOW
    return decided


@njit_leaf
def _share(required: float, available: float) -> float:
    """Required over available; 0 where nothing limits it."""
    return required / available if available > 0.0 and required > 0.0 else 0.0


@njit_part
def bound_candidate(task: PackedTask, joint: int, pair: int, memory: Memory) -> tuple[float, float]:
    """What a candidate draws and how near it comes to its limits at least, whatever torque within the bounds it gives.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``, for which ``may_hold`` was just asked and said yes.
        memory: Its bounds as that left them; ``torque`` is filled again.

    Returns:
        Energy a cycle [J], and utilisation.
    """
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    row, limits, bounds = task.series[joint], task.tasks[joint], memory.bounds
    least, most, figures = bounds.scratch[LOW], bounds.scratch[HIGH], bounds.figures
    peak, square, hottest = figures[PEAK], figures[SQUARE], figures[HOTTEST]
    weak = constant_at(m, figures[WARM_MAGNETS])
    # Magnets that may be stronger without bound, or gone: no current is certain.
    sure = weak > 0.0 and not (m[MAGNET] > 0.0 and not np.isnan(m[INNER]))
    energy = least_energy(task, joint, pair, bounds)
    turning = limits[SPEED_FACTOR] * abs(g[RATIO])
    used = max(_share(turning * limits[FASTEST], m[MAX_SPEED]), _share(turning * limits[FASTEST], g[MAX_INPUT]))
    used = max(used, _share(turning * limits[MEAN_SPEED], g[MEAN_INPUT]))
    used = max(used, _share(limits[PEAK_FACTOR] * peak, m[PEAK_TORQUE]))
    if sure:
        current = limits[PEAK_FACTOR] * peak / weak
        rms = limits[RMS_FACTOR] * math.sqrt(square / limits[DURATION]) / weak
        used = max(used, _share(current, m[PEAK_CURRENT]), _share(current, limits[AMPLIFIER_PEAK]))
        used = max(used, _share(rms, m[CONTINUOUS]), _share(rms, limits[AMPLIFIER_CONTINUOUS]))
    room = m[MAX_WINDING] - limits[TEMPERATURE_MARGIN] - limits[AMBIENT]
    used = max(used, _share(hottest - limits[AMBIENT], room))
    cold = constant_at(m, limits[AMBIENT])
    volts = least_voltage(row, m, g[RATIO], resistance(m, limits[AMBIENT]), cold, least, most)
    used = max(used, _share(limits[VOLTAGE_FACTOR] * volts, limits[VOLTS]))
    if g[DIRECT_DRIVE] == 0.0:
        low, high, at = memory.torque[0], memory.torque[1], task.offsets[joint, joint]
        for t in range(len(low)):
            low[t], high[t] = bounds.low[t], bounds.high[t]
        if at >= 0:
            for i in range(NUMBERS):
                unit, number = task.force[at + i], task.numbers[pair, i]
                for t in range(len(low)):
                    low[t] += number * unit[t]
                    high[t] += number * unit[t]
        asked = limits[PEAK_FACTOR] * least_peak(row, limits, low, high)
        used = max(used, _share(asked, g[REPEATED]), _share(asked, g[MOMENTARY]))
        if not np.isnan(g[AVERAGE]):
            exponent = task.exponents[task.exponent_of[task.pairs[pair, 1]]]
            used = max(used, _share(least_average(row, exponent, low, high), g[AVERAGE]))
    return energy, used


@njit_entry
def survivors(values: Array, rest: Array, used: Array, zones: Array, zone_used: Array, kept: NDArray[np.bool_]) -> int:
    """Which candidates may be part of a set that no known one matches.

    Args:
        values: Weighted costs of the candidates, one column a weighting, (K, W).
        rest: The least that the other joints add to each, by candidates that stay below a zone's utilisation, (Z, W).
        used: Utilisation of the candidates, (K,).
        zones: Weighted corners of the zones that no known set dominates, (Z, W).
        zone_used: Their utilisation, (Z,).
        kept: Takes the answer, (K,).

    Returns:
        How many.
    """
    count = 0
    for i in range(values.shape[0]):
        kept[i] = False
        for zone in range(zones.shape[0]):
            if not used[i] < zone_used[zone]:
                continue
            inside = True
            for k in range(rest.shape[1]):
                if not values[i, k] + rest[zone, k] < zones[zone, k]:
                    inside = False
                    break
            if inside:
                kept[i] = True
                count += 1
                break
    return count
