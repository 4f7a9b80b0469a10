"""The checks of ``checks_gear.py`` and ``checks_motor.py`` on packed rows: required, available and utilisation."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_state import GROWTH, MAGNETS, PEAK_WINDING, RUNAWAY, STATE
from drivetrain.sizing.demand.load_kernels import (
    PEAK_LOAD,
    TILT,
    JointLoad,
    average,
    bearing,
    bearing_base,
    bearing_reach,
    inertia_peak,
)
from drivetrain.sizing.judge.check_numbers import (
    AMPLIFIER_CURRENT,
    AMPLIFIER_RMS,
    AVAILABLE,
    AVERAGE_TORQUE,
    CLOSE,
    GEAR_LIFE,
    INERTIA_RATIO,
    MAXIMUM_INPUT,
    MEAN_INPUT_SPEED,
    MOMENTARY_PEAK,
    MOTOR_CURRENT,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    REPEATED_PEAK,
    REQUIRED,
    RMS_CURRENT,
    TEMPERATURE,
    TILTING_MOMENT,
    UNCHECKED,
    USED,
    VOLTAGE,
    held,
)
from drivetrain.sizing.judge.compiling import njit_entry, njit_leaf, njit_part
from drivetrain.sizing.judge.packed_rows import (
    AVERAGE,
    AXIAL,
    CONTINUOUS,
    DIRECT_DRIVE,
    EXPONENT,
    INNER,
    INPUT_INERTIA,
    MAX_INPUT,
    MAX_SPEED,
    MAX_WINDING,
    MEAN_INPUT,
    MOMENTARY,
    PEAK_CURRENT,
    PEAK_TORQUE,
    RADIAL,
    RATED_LIFE,
    RATED_SPEED,
    RATED_TORQUE,
    RATIO,
    REPEATED,
    ROTOR,
    TILTING,
)
from drivetrain.sizing.judge.packed_task import (
    AMBIENT,
    AMPLIFIER_CONTINUOUS,
    AMPLIFIER_PEAK,
    BEARING,
    CURVED,
    DURATION,
    FASTEST,
    INERTIA,
    LIFE,
    LOSS_SPEED,
    MEAN_SPEED,
    MOVES,
    PEAK_FACTOR,
    RATIO_LIMIT,
    RMS_FACTOR,
    SPEED,
    SPEED_FACTOR,
    TEMPERATURE_MARGIN,
    VOLTAGE_FACTOR,
    VOLTS,
    WEIGHT,
    PackedTask,
)
from drivetrain.sizing.judge.torque_kernels import (
    HEAT,
    TOTAL,
    WINDING,
    constant_at,
    curved_friction,
    heat_losses,
    heat_numbers,
    pair_torque,
    peak_and_square,
    resistance,
    start_torque,
    start_voltage,
    voltage_peak,
)
from drivetrain.solvers.compiled_function import call

HOUR = 3600.0  # s


@njit_part
def gear_checks(task: PackedTask, joint: int, pair: int, load: JointLoad, full: bool) -> float:
    """The gear's limits."""
    g, exponent = task.gears[task.pairs[pair, 1]], task.exponent_of[task.pairs[pair, 1]]
    if g[DIRECT_DRIVE] != 0.0:
        return UNCHECKED
    limits, checks = task.tasks[joint], load.checks
    peak = limits[PEAK_FACTOR] * load.numbers[PEAK_LOAD]
    worst = max(held(checks[REPEATED_PEAK], peak, g[REPEATED]), held(checks[MOMENTARY_PEAK], peak, g[MOMENTARY]))
    lives = not (np.isnan(g[RATED_LIFE]) or np.isnan(g[RATED_SPEED]) or np.isnan(g[RATED_TORQUE]))
    lives = lives and not np.isnan(limits[LIFE])
    if lives or not np.isnan(g[AVERAGE]):
        mean = average(task, joint, exponent, load)
        worst = max(worst, held(checks[AVERAGE_TORQUE], mean, g[AVERAGE]))
        if lives:
            worst = max(worst, held(checks[GEAR_LIFE], limits[LIFE] / HOUR, life(limits, g, mean) / HOUR))
    worst = max(worst, gear_speeds(limits, g, checks))
    if limits[BEARING] != 0.0 and not (np.isnan(g[TILTING]) and np.isnan(g[AXIAL]) and np.isnan(g[RADIAL])):
        bearing_base(task, joint, load)
        factor, most = limits[PEAK_FACTOR], UNCHECKED
        for which in range(3):
            reach = factor * bearing_reach(task, joint, pair, which, load)
            most = max(most, held(checks[TILTING_MOMENT + which], reach, g[TILTING + which]))
        if full or most > worst:
            bearing(task, joint, pair, load)
            for which in range(3):
                value = factor * load.numbers[TILT + which]
                worst = max(worst, held(checks[TILTING_MOMENT + which], value, g[TILTING + which]))
        else:
            for which in range(3):
                checks[TILTING_MOMENT + which, USED] = UNCHECKED
    return worst


@njit_leaf
def life(limits: Array, g: Array, mean: float) -> float:
    """``gear_life``.

    Args:
        mean: Average torque [N m].

    Returns:
        [s].
    """
    load = (abs(g[RATIO]) * limits[MEAN_SPEED] / g[RATED_SPEED]) * (mean / g[RATED_TORQUE]) ** g[EXPONENT]
    return np.inf if load == 0.0 else float(g[RATED_LIFE] / load)


@njit_leaf
def gear_speeds(limits: Array, g: Array, checks: Array) -> float:
    """The gear's limits of speed.

    Args:
        checks: Takes the figures, (CHECKS, 3).
    """
    factor = limits[SPEED_FACTOR] * abs(g[RATIO])
    largest = held(checks[MAXIMUM_INPUT], factor * limits[FASTEST], g[MAX_INPUT])
    return max(largest, held(checks[MEAN_INPUT_SPEED], factor * limits[MEAN_SPEED], g[MEAN_INPUT]))


@njit_part
def speed_checks(task: PackedTask, joint: int, pair: int, load: JointLoad) -> float:
    """The motor's limits that need no torque."""
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    limits, checks = task.tasks[joint], load.checks
    worst = held(checks[MOTOR_SPEED], limits[SPEED_FACTOR] * abs(g[RATIO]) * limits[FASTEST], m[MAX_SPEED])
    if limits[INERTIA] != 0.0 and not np.isnan(limits[RATIO_LIMIT]) and not np.isnan(m[ROTOR]):
        ratio = inertia_peak(task, joint, pair, load) / (g[RATIO] ** 2 * (m[ROTOR] + g[INPUT_INERTIA]))
        worst = max(worst, held(checks[INERTIA_RATIO], ratio, limits[RATIO_LIMIT]))
    return worst


@njit_leaf
def fast_enough(limits: Array, m: Array, g: Array) -> bool:
    """Whether every limit of speed holds, to rounding."""
    input_speed = limits[SPEED_FACTOR] * abs(g[RATIO])
    fastest, mean, over = input_speed * limits[FASTEST], input_speed * limits[MEAN_SPEED], 1.0 + CLOSE
    gear = fastest > g[MAX_INPUT] * over or mean > g[MEAN_INPUT] * over
    return not (fastest > m[MAX_SPEED] * over or (gear and g[DIRECT_DRIVE] == 0.0))


@njit_entry
def holds_speed(task: PackedTask, joint: int, pair: int) -> bool:
    """Whether a pair holds every limit of speed, which no other drive changes."""
    return fast_enough(task.tasks[joint], task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]])


@njit_part
def torque_check(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad) -> tuple[float, float, float]:
    """The motor's torque into TOTAL, and its peak held against the short-time limit.

    Returns:
        The largest torque with starting [N m], the sum of weight times square [N^2 m^2 s], the utilisation.
    """
    limits, row, total = task.tasks[joint], task.series[joint], load.scratch[TOTAL]
    curved = limits[CURVED] != 0.0
    pair_torque(row, m, g, curved, load.series, total)
    if curved:
        curved_friction(m, g[RATIO], row[LOSS_SPEED], total)
    peak, square = peak_and_square(row[WEIGHT], total)
    if limits[MOVES] != 0.0:
        peak = max(peak, start_torque(row, task.rests[joint], m, g, load.series, load.scratch))
    return peak, square, held(load.checks[MOTOR_TORQUE], limits[PEAK_FACTOR] * peak, m[PEAK_TORQUE])


@njit_leaf
def current_checks(
    task: PackedTask, joint: int, m: Array, load: JointLoad, peak: float, square: float, constant: float
) -> float:
    """The limits of current with one torque constant.

    Args:
        peak: Largest torque, starting included [N m].
        square: Sum of weight times square of the torque [N^2 m^2 s].
        constant: Torque constant [N m/A].
    """
    limits, checks = task.tasks[joint], load.checks
    largest = limits[PEAK_FACTOR] * peak / abs(constant)
    rms = limits[RMS_FACTOR] * math.sqrt(square / limits[DURATION]) / abs(constant)
    worst = max(
        held(checks[MOTOR_CURRENT], largest, m[PEAK_CURRENT]),
        held(checks[AMPLIFIER_CURRENT], largest, limits[AMPLIFIER_PEAK]),
    )
    worst = max(worst, held(checks[RMS_CURRENT], rms, m[CONTINUOUS]))
    return max(worst, held(checks[AMPLIFIER_RMS], rms, limits[AMPLIFIER_CONTINUOUS]))


@njit_part
def warm_up(task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad) -> None:
    """The temperatures of the pair at work, those of the winding into WINDING."""
    ambient, known, state = task.tasks[joint, AMBIENT], not np.isnan(m[INNER]), load.heat
    state[MAGNETS], state[RUNAWAY] = ambient, 0.0
    if known:
        row, ratio, scratch, curved = task.series[joint], g[RATIO], load.scratch, task.tasks[joint, CURVED] != 0.0
        if curved:
            friction = scratch[HEAT + GROWTH]
            for t in range(len(friction)):
                friction[t] = 0.0
            curved_friction(m, ratio, row[SPEED], friction)
        heat_losses(row, m, ratio, curved, scratch)
        numbers = state[STATE:]
        heat_numbers(m, ambient, task.shares, numbers)
        call(task.heat, 0.0, numbers, state, scratch[HEAT:], task.mix)
    if not known or state[RUNAWAY] != 0.0:
        state[MAGNETS] = ambient
        rest = ambient if np.isnan(m[MAX_WINDING]) else m[MAX_WINDING]
        winding = load.scratch[WINDING]
        for t in range(len(winding)):
            winding[t] = rest


@njit_part
def electric_checks(
    task: PackedTask, joint: int, m: Array, g: Array, load: JointLoad, torque: tuple[float, float, float]
) -> float:
    """The limits of current, voltage and heat of the warm motor."""
    limits, checks, ambient, state = task.tasks[joint], load.checks, task.tasks[joint, AMBIENT], load.heat
    known = not np.isnan(m[INNER])
    warm_up(task, joint, m, g, load)
    warm, cold = constant_at(m, state[MAGNETS]), constant_at(m, ambient)
    worst = current_checks(task, joint, m, load, torque[0], torque[1], warm)
    volts = max(
        voltage_peak(task.series[joint], m, g[RATIO], load.scratch, warm, cold, resistance(m, ambient)),
        start_voltage(task.rests[joint], m, load.scratch, warm, limits[MOVES] != 0.0),
    )
    worst = max(worst, held(checks[VOLTAGE], limits[VOLTAGE_FACTOR] * volts, limits[VOLTS]))
    if known and not np.isnan(m[MAX_WINDING]):
        allowed = m[MAX_WINDING] - limits[TEMPERATURE_MARGIN]
        used = np.inf
        if state[RUNAWAY] == 0.0 and allowed > ambient:
            used = (state[PEAK_WINDING] - ambient) / (allowed - ambient)
        hottest = np.inf if state[RUNAWAY] != 0.0 else state[PEAK_WINDING]
        checks[TEMPERATURE, REQUIRED], checks[TEMPERATURE, AVAILABLE] = hottest, allowed
        checks[TEMPERATURE, USED] = used
        worst = max(worst, used)
    return worst
