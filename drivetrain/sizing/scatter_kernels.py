"""Many arms as they may be built, judged by compiled code: the utilisation of every check of each.

The torque of each motor is recomputed at every sample of the motion from the drawn numbers. What is dear is not: heat
is carried over blocks of samples by the first three moments of their losses (``scatter_heat.py``), and the winding's
temperature at an instant is looked up only where the largest voltage can be.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drivetrain.arrays import Array
from drivetrain.sizing.scatter_blocks import NO_HEAT, ONE_NODE, STEADY_HEAT, Blocks, HeatMemory, Indices
from drivetrain.sizing.scatter_heat import settle, temperature_in
from drivetrain.sizing.scatter_torque import (
    AMPLIFIER_CURRENT,
    AMPLIFIER_MEAN,
    AMPLIFIER_PEAK,
    AMPLIFIER_RMS,
    AVERAGE,
    AVERAGE_TORQUE,
    BACK,
    CHECKS,
    CONSTANT,
    COPPER,
    EFFICIENCY,
    EXPONENT,
    FORCE,
    HOTTEST,
    HOUSING_CAPACITY,
    INERTIA,
    INNER,
    KIND,
    LIFE,
    LIFE_SHARE,
    LOSS,
    LOSSLESS,
    MAGNET,
    MARGIN,
    MOMENTARY,
    MOMENTARY_PEAK,
    MOTOR_CURRENT,
    MOTOR_TORQUE,
    NO_LOAD,
    OUTER,
    PEAK_CURRENT,
    PEAK_FACTOR,
    PEAK_TORQUE,
    PRINTED,
    RATED,
    RATIO,
    REFERENCE,
    REPEATED,
    REPEATED_PEAK,
    RESISTANCE,
    RESTS,
    RMS_CURRENT,
    RMS_FACTOR,
    SHEET_AMBIENT,
    STALL_VOLTAGE,
    TEMPERATURE,
    TILTING,
    VOLTAGE,
    VOLTAGE_FACTOR,
    VOLTS,
    WINDING_CAPACITY,
    Memory,
    ScatterTask,
    add_power,
    at_rest,
    average_load,
    bearing_load,
    largest_of,
    largest_pair,
    mean_square,
    supply_use,
    torques,
    used_of,
    voltages,
    with_payload,
)

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {
    "drive/exponentials.py": 4137605713,
    "drive/periodic_rise.py": 2837073585,
    "sizing/scatter_blocks.py": 4073483484,
    "sizing/scatter_heat.py": 2156341510,
    "sizing/scatter_torque.py": 3970231427,
    "sizing/vector_max.py": 2907682659,
}


@njit(cache=True, error_model="numpy")
def _mesh(p: Array, efficiency: float, rubbing: float) -> tuple[float, float, float]:
    """``mesh_factors`` of a gear as built, and what holds at rest."""
    if p[LOSSLESS] != 0.0:
        loss, back = 1.0 / p[EFFICIENCY] - 1.0, p[BACK]
        share = 0.0 if np.isnan(p[RATED]) else p[NO_LOAD] * abs(p[RATIO]) / p[RATED]
        back = 1.0 - loss if np.isnan(back) else back
    else:
        loss = 1.0 / min(p[EFFICIENCY] * efficiency, 1.0) - 1.0
        back = p[BACK]
        if np.isnan(back):
            back = 1.0 - loss
        else:
            back = min(back * efficiency if back >= 0.0 else back / efficiency, 1.0)
        share = 0.0 if np.isnan(p[RATED]) else rubbing * p[NO_LOAD] * abs(p[RATIO]) / p[RATED]
    driven = min(back + share, 1.0)
    return max(1.0 + loss - share, 1.0), driven, max(driven, 0.0)


@njit(cache=True, error_model="numpy")
def _voltage(
    row: Array, p: Array, memory: Memory, blocks: Blocks, heat: HeatMemory, ohms: tuple[float, float], warm: float,
    cold: float,
) -> float:  # fmt: skip
    """The largest voltage at the terminals: warm, cold, and to start; ``ohms``: at ambient temperature, its slope."""
    low, high = np.inf, 0.0
    for k in range(len(blocks.length)):
        low, high = min(low, heat.low[k]), max(high, heat.high[k])
    peak = voltages(row, p, memory, (ohms[0], ohms[0] + ohms[1] * low, ohms[0] + ohms[1] * high), warm, cold)
    torque, volts, fixed = memory.torque, memory.volts, memory.fixed
    most = largest_of(volts)
    if high == low or most <= peak:
        return max(peak, most)
    for turn in range(2):  # the sample that asks most first, which rules nearly all others out
        for t in range(len(torque)):
            if volts[t] <= peak or (turn == 0 and volts[t] < most):
                continue
            block, current, start = blocks.of[t], torque[t] / warm, memory.start[t] / warm
            least, largest = ohms[0] + ohms[1] * heat.low[block], ohms[0] + ohms[1] * heat.high[block]
            if max(max(abs(fixed[t] + least * current), abs(fixed[t] + largest * current)), largest * start) <= peak:
                continue
            found = ohms[0] + ohms[1] * temperature_in(blocks, heat, memory.square, t)
            peak = max(peak, max(abs(fixed[t] + found * current), found * start))
    return peak


@njit(cache=True, error_model="numpy")
def _bearing(task: ScatterTask, joint: int, shares: Array, memory: Memory, used: Array) -> None:
    """Limits of the output bearing and of the inertia ratio, where the payload scatters."""
    limits, parts, first, second = task.bearing_limits[joint], task.bearing[joint], memory.volts, memory.fixed
    count = parts.shape[2]
    if count > 0:
        for group in range(3):
            if np.isnan(limits[group]):
                continue
            at = (0, 2, 3)[group]
            bearing_load(parts[at], shares, first)
            if group == 1:
                second[:count] = 0.0
            else:
                bearing_load(parts[at + 1], shares, second)
            used[TILTING + group] = used_of(largest_pair(first, second, count), limits[group])
    masses = task.inertia[joint]
    count = masses.shape[1]
    if count > 0 and masses[0, 0] != 0.0:
        bearing_load(masses, shares, first)
        second[:count] = 0.0
        used[INERTIA] = largest_pair(first, second, count)


@njit(cache=True, error_model="numpy")
def _currents(p: Array, peak: float, square: float, warm: float, ambient: float, ohms: Array, used: Array) -> None:
    """The limits of current; ``ohms``: resistance at reference temperature, thermal resistance, both as built."""
    used[MOTOR_CURRENT] = used_of(p[PEAK_FACTOR] * peak / warm, p[PEAK_CURRENT])
    used[AMPLIFIER_CURRENT] = used_of(p[PEAK_FACTOR] * peak / warm, p[AMPLIFIER_PEAK])
    rms = p[RMS_FACTOR] * math.sqrt(square) / warm
    limit, hot = p[PRINTED], p[HOTTEST]
    if not np.isnan(hot):
        room = max(hot - ambient, 0.0)
        if not np.isnan(limit) and hot > SHEET_AMBIENT and ambient != SHEET_AMBIENT:
            limit *= math.sqrt(room / (hot - SHEET_AMBIENT))
        if not np.isnan(ohms[1]):
            thermal = math.sqrt(room / (ohms[0] * (1.0 + p[COPPER] * (hot - p[REFERENCE])) * ohms[1]))
            limit = thermal if np.isnan(limit) else min(limit, thermal)
    used[RMS_CURRENT] = used_of(rms, limit)
    used[AMPLIFIER_RMS] = used_of(rms, p[AMPLIFIER_MEAN])


# long kernel: the chain from force to heat of one joint, each link of which is a function of its own
@njit(cache=True, error_model="numpy")
def _joint(
    task: ScatterTask, joint: int, factors: Array, ambient: float, shares: Array, blocks: Blocks, heat: HeatMemory,
    memory: Memory, used: Array, powered: bool,
) -> None:  # fmt: skip
    """All checks of one joint of one arm."""
    row, p = task.series[joint], task.numbers[joint]
    constant, resistance, rubbing = p[CONSTANT] * factors[0], p[RESISTANCE] * factors[1], factors[2]
    for check in range(CHECKS):
        used[check] = task.fixed[joint, check]
    with_payload(row[FORCE], task.payload[joint], shares, memory.force)
    mesh = _mesh(p, factors[3], rubbing)
    largest, peak = torques(row, mesh, p[RATIO], rubbing, memory)
    if p[RESTS] != 0.0:
        loose, start = at_rest(row, p, memory, mesh[0], rubbing)
        largest, peak = max(largest, loose), max(peak, start)
    else:
        memory.start[:] = 0.0
    load = p[PEAK_FACTOR] * largest
    used[REPEATED_PEAK], used[MOMENTARY_PEAK] = used_of(load, p[REPEATED]), used_of(load, p[MOMENTARY])
    if not (np.isnan(p[AVERAGE]) and np.isnan(p[LIFE_SHARE])):
        average = average_load(row, memory.force, rubbing, p[EXPONENT])
        used[AVERAGE_TORQUE] = used_of(average, p[AVERAGE])
        used[LIFE] = p[LIFE_SHARE] * (average / p[RATED]) ** p[EXPONENT]
    _bearing(task, joint, shares, memory, used)
    limit = p[PEAK_TORQUE]
    if np.isnan(limit):
        limit = constant * p[PEAK_CURRENT]
    if np.isnan(limit):
        limit = constant * p[STALL_VOLTAGE] / resistance
    used[MOTOR_TORQUE] = used_of(p[PEAK_FACTOR] * peak, limit)
    square = mean_square(task.weight, memory.torque)
    cold = constant * (1.0 + p[MAGNET] * (ambient - p[REFERENCE]))
    ohms = resistance * (1.0 + p[COPPER] * (ambient - p[REFERENCE]))
    slope = resistance * p[COPPER]
    found = (ambient, 0.0, 0.0)
    if p[KIND] != NO_HEAT:
        numbers = (
            p[INNER] * factors[4], p[OUTER] * factors[4], p[WINDING_CAPACITY], p[HOUSING_CAPACITY], ohms, slope,
            constant, p[MAGNET], p[REFERENCE], ambient,
        )  # fmt: skip
        found = settle(int(p[KIND]), numbers, (row[LOSS], task.loss[joint]), rubbing, memory.square, blocks, heat)
    runs_away = np.isinf(found[1])
    if p[KIND] == NO_HEAT or runs_away:
        rise = 0.0 if np.isnan(p[HOTTEST]) else p[HOTTEST] - ambient
        heat.low[:] = rise
        heat.high[:] = rise
    elif p[KIND] == STEADY_HEAT:
        heat.low[:] = found[1]
        heat.high[:] = found[1]
    if p[KIND] != NO_HEAT and not np.isnan(p[HOTTEST]):
        room = p[HOTTEST] - p[MARGIN] - ambient
        used[TEMPERATURE] = np.inf if runs_away or room <= 0.0 else found[1] / room
    magnets = ambient if p[KIND] == NO_HEAT or runs_away else found[0]
    warm = constant * (1.0 + p[MAGNET] * (magnets - p[REFERENCE]))
    both = np.array([resistance, (p[INNER] + p[OUTER]) * factors[4]])
    _currents(p, peak, square, warm, ambient, both, used)
    volts = _voltage(row, p, memory, blocks, heat, (ohms, slope), warm, cold)
    used[VOLTAGE] = used_of(p[VOLTAGE_FACTOR] * volts, p[VOLTS])
    if powered:
        if p[KIND] < ONE_NODE or runs_away:
            heat.rise[:] = heat.low[0]
        else:
            temperature_in(blocks, heat, memory.square, -1)
        add_power(row, memory, ohms / (warm * warm), slope / (warm * warm), heat.rise)


@njit(cache=True, error_model="numpy")
def judge_arms(
    task: ScatterTask, factors: Array, ambient: Array, shares: Array, blocks: Blocks, counts: Indices,
    heat: HeatMemory, memory: Memory, used: Array, supply: Array,
) -> None:  # fmt: skip
    """Every check of many arms.

    Args:
        task: The set of drives at its work.
        factors: On the numbers of each joint, (S, n, 5).
        ambient: Air temperature [C], (S,).
        shares: Of the payloads' masses, (S, P).
        blocks: Of samples, for heat: those of each joint, one row each.
        counts: How many blocks each joint has, (n,).
        heat, memory: Scratch.
        used: Takes the utilisations, NaN where not checked, (S, n, CHECKS).
        supply: Takes those of the supply, (S, 3).
    """
    powered = not (np.isnan(task.supply[0]) and np.isnan(task.supply[1]) and np.isnan(task.supply[2]))
    for s in range(len(ambient)):
        memory.power[:] = 0.0
        for joint in range(len(task.numbers)):
            count = counts[joint]
            own = Blocks(
                blocks.first[joint, : count + 1], blocks.length[joint, :count], blocks.of[joint], blocks.step[joint],
                blocks.offset[joint], blocks.spread[joint],
            )  # fmt: skip
            _joint(task, joint, factors[s, joint], ambient[s], shares[s], own, heat, memory, used[s, joint], powered)
        if powered:
            supply_use(task, memory.power, supply[s])
        else:
            supply[s, :] = np.nan
