"""Many arms as they may be built, judged by compiled code, some at once: the utilisation of every check of each.

The torque of each motor is recomputed at every sample of the motion from the drawn numbers. The magnets' temperature is
found by heat that is carried over blocks of samples (``scatter_heat.py``); the winding's is then followed from sample
to sample, beside voltage and power.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.tolerance import scatter_numbers as k
from drivetrain.sizing.tolerance.lanes import WIDTH, highest, njit_arm, njit_arms, njit_lanes, put, row, spread
from drivetrain.sizing.tolerance.scatter_blocks import NO_HEAT
from drivetrain.sizing.tolerance.scatter_heat import settle
from drivetrain.sizing.tolerance.scatter_numbers import Memory, ScatterTask
from drivetrain.sizing.tolerance.scatter_torque import masses, work
from drivetrain.sizing.tolerance.scatter_watch import watch

SHEET_AMBIENT = 25.0  # C, at which makers print continuous values


@njit_arm
def _used(required: float, available: float) -> float:
    """A requirement over a limit: 1 at the limit, NaN where it is not known."""
    if np.isnan(available):
        return np.nan
    if available > 0.0:
        return required / available
    return 0.0 if required <= 0.0 else np.inf


@njit_arm
def _mesh(p: Array, efficiency: float, rubbing: float) -> tuple[float, float, float]:
    """``mesh_factors`` of a gear as built, and what holds at rest."""
    if p[k.LOSSLESS] != 0.0:
        loss, back = 1.0 / p[k.EFFICIENCY] - 1.0, p[k.BACK]
        share = 0.0 if np.isnan(p[k.RATED]) else p[k.NO_LOAD] * abs(p[k.RATIO]) / p[k.RATED]
        back = 1.0 - loss if np.isnan(back) else back
    else:
        loss = 1.0 / min(p[k.EFFICIENCY] * efficiency, 1.0) - 1.0
        back = p[k.BACK]
        if np.isnan(back):
            back = 1.0 - loss
        else:
            back = min(back * efficiency if back >= 0.0 else back / efficiency, 1.0)
        share = 0.0 if np.isnan(p[k.RATED]) else rubbing * p[k.NO_LOAD] * abs(p[k.RATIO]) / p[k.RATED]
    driven = min(back + share, 1.0)
    return max(1.0 + loss - share, 1.0), driven, max(driven, 0.0)


@njit_arm
def _prepare(p: Array, factors: Array, ambient: float, lane: Array, at: int) -> None:
    """The numbers of one joint of one arm."""
    constant, resistance, rubbing = p[k.CONSTANT] * factors[0], p[k.RESISTANCE] * factors[1], factors[2]
    driving, driven, held = _mesh(p, factors[3], rubbing)
    lane[k.RUBBING, at], lane[k.TORQUE_CONSTANT, at] = rubbing, constant
    lane[k.DRIVING, at], lane[k.DRIVEN, at] = driving / p[k.RATIO], driven / p[k.RATIO]
    lane[k.HELD, at], lane[k.THERMAL, at], lane[k.AMBIENT, at] = held / p[k.RATIO], factors[4], ambient
    lane[k.OHMS, at] = resistance * (1.0 + p[k.COPPER] * (ambient - p[k.REFERENCE]))
    lane[k.SLOPE, at] = resistance * p[k.COPPER]
    lane[k.COLD, at] = constant * (1.0 + p[k.MAGNET] * (ambient - p[k.REFERENCE]))


@njit_arm
def _currents(p: Array, lane: Array, at: int, resistance: float, used: Array) -> None:
    """The limits of current of one arm; resistance: at reference temperature, as built [ohm]."""
    peak, ambient, warm = lane[k.PEAK, at], lane[k.AMBIENT, at], lane[k.WARM, at]
    used[k.MOTOR_CURRENT, at] = _used(p[k.PEAK_FACTOR] * peak / warm, p[k.PEAK_CURRENT])
    used[k.AMPLIFIER_CURRENT, at] = _used(p[k.PEAK_FACTOR] * peak / warm, p[k.AMPLIFIER_PEAK])
    rms = p[k.RMS_FACTOR] * math.sqrt(lane[k.SQUARE, at]) / warm
    limit, hot, thermal = p[k.PRINTED], p[k.HOTTEST], (p[k.INNER] + p[k.OUTER]) * lane[k.THERMAL, at]
    if not np.isnan(hot):
        room = max(hot - ambient, 0.0)
        if not np.isnan(limit) and hot > SHEET_AMBIENT and ambient != SHEET_AMBIENT:
            limit *= math.sqrt(room / (hot - SHEET_AMBIENT))
        if not np.isnan(thermal):
            carried = math.sqrt(room / (resistance * (1.0 + p[k.COPPER] * (hot - p[k.REFERENCE])) * thermal))
            limit = carried if np.isnan(limit) else min(limit, carried)
    used[k.RMS_CURRENT, at] = _used(rms, limit)
    used[k.AMPLIFIER_RMS, at] = _used(rms, p[k.AMPLIFIER_MEAN])


@njit_arm
def _loads(task: ScatterTask, joint: int, lane: Array, at: int, used: Array) -> None:
    """The limits of gear, bearing and inertia of one arm."""
    p, limits = task.numbers[joint], task.bearing_limits[joint]
    load = p[k.PEAK_FACTOR] * lane[k.LARGEST, at]
    used[k.REPEATED_PEAK, at], used[k.MOMENTARY_PEAK, at] = _used(load, p[k.REPEATED]), _used(load, p[k.MOMENTARY])
    if not (np.isnan(p[k.AVERAGE]) and np.isnan(p[k.LIFE_SHARE])):
        wear = lane[k.WEAR, at]
        used[k.AVERAGE_TORQUE, at] = _used(wear, p[k.AVERAGE])
        used[k.LIFE, at] = p[k.LIFE_SHARE] * (wear / p[k.RATED]) ** p[k.EXPONENT]
    if task.counts[joint, 0] > 0:
        for group in range(3):
            if not np.isnan(limits[group]):
                used[k.TILTING + group, at] = _used(lane[k.TILT + group, at], limits[group])
    if task.counts[joint, 1] > 0:
        used[k.INERTIA, at] = lane[k.MASSES, at]


@njit_arm
def _check(task: ScatterTask, joint: int, factors: Array, at: int, memory: Memory) -> None:
    """All checks of one joint of one arm, from what was found."""
    p, lane, used = task.numbers[joint], memory.lane, memory.used
    for check in range(k.CHECKS):
        used[check, at] = task.fixed[joint, check]
    _loads(task, joint, lane, at, used)
    constant, resistance = lane[k.TORQUE_CONSTANT, at], p[k.RESISTANCE] * factors[1]
    limit = p[k.PEAK_TORQUE]
    if np.isnan(limit):
        limit = constant * p[k.PEAK_CURRENT]
    if np.isnan(limit):
        limit = constant * p[k.STALL_VOLTAGE] / resistance
    used[k.MOTOR_TORQUE, at] = _used(p[k.PEAK_FACTOR] * lane[k.PEAK, at], limit)
    _currents(p, lane, at, resistance, used)
    if p[k.KIND] != NO_HEAT and not np.isnan(p[k.HOTTEST]):
        room = p[k.HOTTEST] - p[k.MARGIN] - lane[k.AMBIENT, at]
        over = lane[k.RUNS_AWAY, at] != 0.0 or room <= 0.0
        used[k.TEMPERATURE, at] = np.inf if over else lane[k.RISE, at] / room
    used[k.VOLTAGE, at] = _used(p[k.VOLTAGE_FACTOR] * lane[k.TERMINAL, at], p[k.VOLTS])
    for check in range(k.CHECKS):
        used[check, at] *= task.made[joint, check]


@njit_lanes
def _supply(task: ScatterTask, memory: Memory) -> None:
    """What all joints together ask of the supply; utilisations go to the first rows of ``used``."""
    peak = drawn = back = spread(0.0)
    for t in range(len(task.weight)):
        power = row(memory.power, t)
        forth = highest(power, 0.0)
        peak = highest(peak, forth)
        drawn = drawn + task.weight[t] * forth
        back = back + task.weight[t] * (forth - power)
    put(memory.used, k.SUPPLY_PEAK, peak)
    put(memory.used, k.SUPPLY_MEAN, drawn)
    put(memory.used, k.SUPPLY_BACK, back)


@njit_arms
def judge_arms(
    task: ScatterTask, factors: Array, ambient: Array, shares: Array, memory: Memory, used: Array, supply: Array
) -> None:
    """Every check of many arms.

    Args:
        factors: On the numbers of each joint, (S, n, 5).
        ambient: Air temperature [C], (S,).
        shares: Of the payloads' masses, (S, P).
        used: Takes the utilisations, NaN where not checked, (S, n, CHECKS).
        supply: Takes those of the supply, (S, 3).
    """
    powered = not (np.isnan(task.supply[0]) and np.isnan(task.supply[1]) and np.isnan(task.supply[2]))
    count = len(ambient)
    for first in range(0, count, WIDTH):
        for t in range(len(memory.power)):
            put(memory.power, t, spread(0.0))
        for at in range(WIDTH):  # what is left at the end is the last arm again
            for q in range(shares.shape[1]):
                memory.shares[q, at] = shares[min(first + at, count - 1), q] - 1.0
        for joint in range(len(task.numbers)):
            for at in range(WIDTH):
                s = min(first + at, count - 1)
                _prepare(task.numbers[joint], factors[s, joint], ambient[s], memory.lane, at)
            work(task, joint, memory)
            masses(task, joint, memory)
            settle(task, joint, memory)
            watch(task, joint, powered, memory)
            for at in range(min(WIDTH, count - first)):
                _check(task, joint, factors[first + at, joint], at, memory)
                for check in range(k.CHECKS):  # an assignment of rows would have its shapes' message compiled
                    used[first + at, joint, check] = memory.used[check, at]
        if powered:
            _supply(task, memory)
        for at in range(min(WIDTH, count - first)):
            for check in range(k.SUPPLY):
                supply[first + at, check] = _used(memory.used[check, at], task.supply[check]) if powered else np.nan
