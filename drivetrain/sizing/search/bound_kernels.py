"""What a pair at one joint must at least bear while the torque of the joint lies in an interval at every sample.

The motor's torque is a function of the gear's torque at each sample: two straight lines that meet where the power
through the mesh turns. Its range over an interval is that of the ends, and of the bend where it lies between them,
whether the mesh locks itself or not. Every figure is bounded sample by sample: what holds is never ruled out.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_kernels import (
    COOLEST,
    HOTTEST,
    LOAD_NUMBERS,
    PEAK,
    PEAK_LOAD,
    SQUARE,
    WARM_MAGNETS,
    JointBounds,
)
from drivetrain.sizing.demand.load_loops import add_drive, least_average, least_figures, least_peak
from drivetrain.sizing.judge.check_kernels import fast_enough, life
from drivetrain.sizing.judge.check_numbers import CLOSE, essential_lack, gear_too_weak
from drivetrain.sizing.judge.compiling import njit_face, njit_leaf, njit_loop, njit_part
from drivetrain.sizing.judge.packed_rows import (
    AVERAGE,
    CONTINUOUS,
    COULOMB,
    DIRECT_DRIVE,
    DRIVEN,
    DRIVING,
    INDUCTANCE,
    INNER,
    INPUT_INERTIA,
    MAGNET,
    MAX_WINDING,
    MOMENTARY,
    NO_LOAD,
    PEAK_CURRENT,
    PEAK_TORQUE,
    RATED_LIFE,
    RATED_SPEED,
    RATED_TORQUE,
    RATIO,
    REPEATED,
    ROTOR,
    VISCOUS,
)
from drivetrain.sizing.judge.packed_task import (
    ACCELERATION,
    AMBIENT,
    AMPLIFIER_CONTINUOUS,
    AMPLIFIER_PEAK,
    BREAK_BACK,
    BREAK_FORWARD,
    CARRIER,
    CURVED,
    DURATION,
    LIFE,
    LOSS_FRICTION,
    LOSS_SPEED,
    MOVES,
    PEAK_FACTOR,
    RATE_AFTER,
    RATE_AT,
    RATE_BEFORE,
    RMS_FACTOR,
    SPEED,
    TEMPERATURE_MARGIN,
    VOLTAGE_FACTOR,
    VOLTS,
    WAY,
    WEIGHT,
    Indices,
    PackedTask,
)
from drivetrain.sizing.judge.torque_kernels import breakaway, constant_at, curved_friction, first_look, resistance
from drivetrain.sizing.judge.vector_max import larger, smaller
from drivetrain.sizing.search.warm_bound import least_warm_voltage, least_warmth

# Rows of the scratch of bounds.
LOW, HIGH, OWN_LOW, OWN_HIGH = 1, 2, 3, 4
OVER = 1.0 + CLOSE


@njit_loop
def torque_range(
    row: Array, m: Array, g: Array, curved: bool, low: Array, high: Array, least: Array, most: Array
) -> None:
    """The interval of the motor's torque at every sample.

    Args:
        row: The joint's series, (SERIES, N).
        low, high: Torque at the gear's output [N m], (N,).
        least, most: Take the interval [N m], (N,).
    """
    way, loss, ratio, inertia = row[WAY], row[LOSS_FRICTION], g[RATIO], m[ROTOR] + g[INPUT_INERTIA]
    driving, driven, hold = g[DRIVING] / ratio, g[DRIVEN] / ratio, max(g[DRIVEN], 0.0) / ratio
    sign, given = 1.0 if ratio > 0.0 else -1.0, 1.0 if curved else 0.0
    constant = sign * (g[NO_LOAD] if curved else m[COULOMB] + g[NO_LOAD])
    viscous, geared = 0.0 if curved else m[VISCOUS] * ratio, inertia * ratio
    acceleration, carrier, slow = row[ACCELERATION], row[CARRIER], row[LOSS_SPEED]
    for t in range(len(low)):
        # Factors of a positive and of a negative load.
        up = driving if way[t] > 0.0 else (driven if way[t] < 0.0 else hold)
        down = driven if way[t] > 0.0 else (driving if way[t] < 0.0 else hold)
        a, b = low[t] + loss[t], high[t] + loss[t]
        first = up * larger(a, 0.0) + down * smaller(a, 0.0)
        second = up * larger(b, 0.0) + down * smaller(b, 0.0)
        bend = 0.0 if (a < 0.0) & (b > 0.0) else first
        shaft = (geared * acceleration[t] + inertia * carrier[t]) + (constant * way[t] + viscous * slow[t])
        shaft += given * least[t]
        least[t] = smaller(smaller(first, second), bend) + shaft
        most[t] = larger(larger(first, second), bend) + shaft


@njit_leaf
def _least_start(row: Array, limits: Array, rests: Indices, m: Array, g: Array, low: Array, high: Array) -> float:
    """The torque to start at the samples at rest that cannot be undercut."""
    ratio, inertia, peak = g[RATIO], m[ROTOR] + g[INPUT_INERTIA], 0.0
    sign = 1.0 if ratio > 0.0 else -1.0
    for i in range(len(rests)):
        t = rests[i]
        if t < 0:
            break
        if not (low[t] > 0.0 or high[t] < 0.0):
            continue
        way, loose = (1.0, limits[BREAK_FORWARD]) if low[t] > 0.0 else (-1.0, -limits[BREAK_BACK])
        shaft = breakaway(m, sign * way) + g[NO_LOAD] * sign * way
        shaft += inertia * (ratio * row[ACCELERATION, t] + row[CARRIER, t])
        first, second = g[DRIVING] * (low[t] + loose) / ratio + shaft, g[DRIVING] * (high[t] + loose) / ratio + shaft
        if first * second > 0.0:
            peak = max(peak, min(abs(first), abs(second)))
    return peak


@njit_loop
def least_voltage(row: Array, m: Array, ratio: float, ohms: float, constant: float, least: Array, most: Array) -> float:
    """The voltage at fixed temperatures that cannot be undercut; the first and the last sample are left out.

    Args:
        row: The joint's series, (SERIES, N).
        constant: Torque constant [N m/A].
        least, most: Ends of the interval of the motor's torque [N m], (N,).

    Returns:
        [V].
    """
    speed, behind, at, ahead = row[SPEED], row[RATE_BEFORE], row[RATE_AT], row[RATE_AFTER]
    peak, turning, inverse, inductance = 0.0, constant * ratio, 1.0 / constant, m[INDUCTANCE]
    l0, l1, l2, h0, h1, h2 = least[:-2], least[1:-1], least[2:], most[:-2], most[1:-1], most[2:]
    s, r0, r1, r2 = speed[1:-1], behind[1:-1], at[1:-1], ahead[1:-1]
    for t in range(len(s)):
        own, before, after = ohms + inductance * r1[t], inductance * r0[t], inductance * r2[t]
        low = smaller(own * l1[t], own * h1[t]) + smaller(before * l0[t], before * h0[t])
        high = larger(own * l1[t], own * h1[t]) + larger(before * l0[t], before * h0[t])
        low += smaller(after * l2[t], after * h2[t])
        high += larger(after * l2[t], after * h2[t])
        emf = turning * s[t]
        peak = larger(peak, larger(emf + inverse * low, -(emf + inverse * high)))
    return peak


@njit_part
def _gear_may_hold(task: PackedTask, joint: int, gear: int, bounds: JointBounds) -> bool:
    """The gear's limits of torque and life."""
    g, limits, numbers = task.gears[gear], task.tasks[joint], bounds.numbers
    peak = limits[PEAK_FACTOR] * numbers[PEAK_LOAD]
    holds = not (peak > g[REPEATED] * OVER or peak > g[MOMENTARY] * OVER)
    lives = not (np.isnan(g[RATED_LIFE]) or np.isnan(g[RATED_SPEED]) or np.isnan(g[RATED_TORQUE]))
    lives = lives and not np.isnan(limits[LIFE])
    if holds and (lives or not np.isnan(g[AVERAGE])):
        at = LOAD_NUMBERS + task.exponent_of[gear]
        if np.isnan(numbers[at]):
            exponent = task.exponents[task.exponent_of[gear]]
            numbers[at] = least_average(task.series[joint], exponent, bounds.low, bounds.high)
        holds = not numbers[at] > g[AVERAGE] * OVER
        if holds and lives:
            holds = not limits[LIFE] > life(limits, g, numbers[at]) * OVER
    return holds


@njit_part
def _motor_may_hold(task: PackedTask, joint: int, m: Array, g: Array, bounds: JointBounds) -> bool:
    """The motor's and the amplifier's limits, LOW and HIGH filled."""
    limits, row, least, most = task.tasks[joint], task.series[joint], bounds.scratch[LOW], bounds.scratch[HIGH]
    peak, square, between = least_figures(row, least, most)
    if limits[MOVES] != 0.0:
        peak = max(peak, _least_start(row, limits, task.rests[joint], m, g, bounds.low, bounds.high))
    holds = not limits[PEAK_FACTOR] * peak > m[PEAK_TORQUE] * OVER
    ambient, heated = limits[AMBIENT], not np.isnan(m[INNER])
    constant, ohms = constant_at(m, ambient), resistance(m, ambient)
    winding, magnets, hottest = least_warmth(m, g, limits, len(task.shares), between)
    bounds.figures[PEAK], bounds.figures[SQUARE], bounds.figures[COOLEST] = peak, square, winding
    bounds.figures[WARM_MAGNETS], bounds.figures[HOTTEST] = magnets, hottest
    weakest, hot = constant_at(m, magnets), m[MAX_WINDING] - limits[TEMPERATURE_MARGIN]  # above it the pair falls
    holds = holds and not (hottest - ambient > (hot - ambient) * OVER) and weakest > 0.0
    if holds and (m[MAGNET] <= 0.0 or not heated):
        current = limits[PEAK_FACTOR] * peak / weakest
        rms = limits[RMS_FACTOR] * math.sqrt(square / limits[DURATION]) / weakest
        holds = holds and not (current > m[PEAK_CURRENT] * OVER or current > limits[AMPLIFIER_PEAK] * OVER)
        holds = holds and not (rms > m[CONTINUOUS] * OVER or rms > limits[AMPLIFIER_CONTINUOUS] * OVER)
    room = limits[VOLTS] * OVER / limits[VOLTAGE_FACTOR]
    if holds:
        holds = least_voltage(row, m, g[RATIO], ohms, constant, least, most) <= room
    if holds and not heated and not np.isnan(m[MAX_WINDING]):
        holds = least_voltage(row, m, g[RATIO], resistance(m, m[MAX_WINDING]), constant, least, most) <= room
    if holds and heated and hottest > ambient and constant_at(m, hot) > 0.0:
        warm = resistance(m, winding), resistance(m, hot)
        constants = constant_at(m, hot), weakest
        holds = least_warm_voltage(row, m, g[RATIO], warm, constants, least, most) <= room
    return holds


@njit_part
def _torque_bounds(task: PackedTask, joint: int, m: Array, g: Array, bounds: JointBounds) -> None:
    """The interval of the motor's torque into LOW and HIGH."""
    row, curved, least = task.series[joint], task.tasks[joint, CURVED] != 0.0, bounds.scratch[LOW]
    if curved:
        for t in range(len(least)):
            least[t] = 0.0
        curved_friction(m, g[RATIO], row[LOSS_SPEED], least)
    torque_range(row, m, g, curved, bounds.low, bounds.high, least, bounds.scratch[HIGH])


@njit_part
def _first_look_holds(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """Whether gear and motor bear what a few samples ask at least."""
    gear, at = task.pairs[pair, 1], task.offsets[joint, joint]
    m, g, limits, row = task.motors[joint, task.pairs[pair, 0]], task.gears[gear], task.tasks[joint], task.series[joint]
    curved, enough, strong = limits[CURVED] != 0.0, m[PEAK_TORQUE] * OVER / limits[PEAK_FACTOR], np.inf
    if g[DIRECT_DRIVE] == 0.0:
        strong = (min(g[REPEATED], g[MOMENTARY]) if g[MOMENTARY] > 0.0 else g[REPEATED]) * OVER / limits[PEAK_FACTOR]
    for samples in (bounds.instants, task.sharp[joint]):
        asked = first_look(row, m, g, curved, bounds.low, bounds.high, task.force, at, task.numbers, pair, samples)
        if asked[0] > strong or asked[1] > enough:
            return False
    return True


@njit_part
def _own_bounds(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> JointBounds:
    """The bounds with what the joint's own drive asks, where it rides on the link that it moves."""
    at = task.offsets[joint, joint]
    if at < 0:
        return bounds
    low, high = bounds.scratch[OWN_LOW], bounds.scratch[OWN_HIGH]
    add_drive(bounds.low, task.force, at, task.numbers, pair, low)
    add_drive(bounds.high, task.force, at, task.numbers, pair, high)
    own = JointBounds(low, high, bounds.own, bounds.scratch, bounds.instants, bounds.own, bounds.figures)
    for i in range(len(own.numbers)):
        own.numbers[i] = np.nan
    own.numbers[PEAK_LOAD] = least_peak(task.series[joint], task.tasks[joint], low, high)
    return own


@njit_leaf
def _may_hold(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """``may_hold``."""
    if gear_too_weak(task.pairs, task.gears, task.offsets, task.tasks, joint, pair, bounds.numbers[PEAK_LOAD]):
        return False
    gear = task.pairs[pair, 1]
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[gear]
    if essential_lack(m, g) >= 0 or not fast_enough(task.tasks[joint], m, g):
        return False
    if not _first_look_holds(task, joint, pair, bounds):
        return False
    own = _own_bounds(task, joint, pair, bounds)
    if g[DIRECT_DRIVE] == 0.0 and not _gear_may_hold(task, joint, gear, own):
        return False
    _torque_bounds(task, joint, m, g, own)
    return _motor_may_hold(task, joint, m, g, own)


@njit_face
def may_hold(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """Whether a pair may hold with some torque history within bounds."""
    return _may_hold(task, joint, pair, bounds)


@njit_part
def least_energy(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> float:
    """A lower bound of a pair's electrical energy over the cycle with any torque history within bounds.

    Returns:
        [J].
    """
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    loss, scratch = certain_loss(m, bounds.figures), bounds.scratch
    return least_drawn(task.series[joint], g[RATIO], loss, scratch[LOW], scratch[HIGH])


@njit_leaf
def certain_loss(m: Array, figures: Array) -> float:
    """Copper loss over torque squared that no temperature within bounds lets a motor undercut.

    Returns:
        [W/(N m)^2]; 0 where warm magnets may be stronger without bound, or gone.
    """
    weakest = constant_at(m, figures[WARM_MAGNETS])
    if not weakest > 0.0 or (m[MAGNET] > 0.0 and not np.isnan(m[INNER])):
        return 0.0
    return resistance(m, figures[COOLEST]) / (weakest * weakest)


@njit_loop
def least_drawn(row: Array, ratio: float, loss: float, least: Array, most: Array) -> float:
    """The least integral of torque times speed plus loss times torque squared.

    Args:
        row: The joint's series, (SERIES, N).
        loss: Over torque squared [W/(N m)^2].
        least, most: Ends of the interval of the motor's torque [N m], (N,).

    Returns:
        [J].
    """
    speed, weight = row[SPEED], row[WEIGHT]
    total, inverse = 0.0, -0.5 / loss if loss > 0.0 else 0.0
    for t in range(len(least)):
        turning = ratio * speed[t]
        best = inverse * turning if loss > 0.0 else (-np.inf if turning > 0.0 else np.inf)
        torque = smaller(larger(best, least[t]), most[t])
        total += weight[t] * torque * (turning + loss * torque)
    return total
