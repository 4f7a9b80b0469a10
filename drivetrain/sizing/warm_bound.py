"""How warm a pair at least gets while the torque of its joint lies in an interval, and what warmth makes of its limits.

The mean heat of a cycle can be bounded from below before any temperature is known; it warms the magnets, which then
need more current, and the winding, which then has more resistance, and both add to the heat. Each step of that ladder
is a lower bound, and the next one starts from it.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.bound_kernels import HIGH, LOW, OVER
from drivetrain.sizing.compiling import njit_leaf, njit_loop, njit_part
from drivetrain.sizing.load_kernels import JointBounds
from drivetrain.sizing.load_loops import least_figures
from drivetrain.sizing.packed_rows import (
    CONTINUOUS,
    COULOMB,
    HOUSING_CAPACITY,
    INDUCTANCE,
    INNER,
    MAGNET,
    MAX_WINDING,
    OUTER,
    PEAK_CURRENT,
    RATIO,
    VISCOUS,
    WINDING_CAPACITY,
)
from drivetrain.sizing.packed_task import (
    AMBIENT,
    AMPLIFIER_CONTINUOUS,
    AMPLIFIER_PEAK,
    CURVED,
    DURATION,
    PEAK_FACTOR,
    RATE_AFTER,
    RATE_AT,
    RATE_BEFORE,
    RMS_FACTOR,
    SPEED,
    STEP_SPEED,
    STEP_SQUARE,
    TEMPERATURE_MARGIN,
    VOLTAGE_FACTOR,
    VOLTS,
    PackedTask,
)
from drivetrain.sizing.torque_kernels import constant_at, resistance
from drivetrain.sizing.vector_max import larger, smaller

STEPS = 8  # of the ladder; each adds a few percent of the one before


@njit_part
def _least_sum(speed: float, drop: float, weak: float, strong: float) -> float:
    """The least of speed k + drop / k for k from weak to strong: at an end, or between where one falls, one rises."""
    ends = smaller(speed * weak + drop / weak, speed * strong + drop / strong)
    between = (drop > speed * weak * weak) & (drop < speed * strong * strong) & (speed > 0.0)
    return 2.0 * math.sqrt(larger(speed * drop, 0.0)) if between else ends


@njit_loop
def _least_warm_voltage(
    row: Array, m: Array, ratio: float, ohms: tuple[float, float], constants: tuple[float, float], least: Array,
    most: Array,
) -> float:  # fmt: skip
    """The voltage of a warm motor that cannot be undercut; the first and the last sample are left out."""
    speed, behind, at, ahead, inductance = row[SPEED], row[RATE_BEFORE], row[RATE_AT], row[RATE_AFTER], m[INDUCTANCE]
    cool, hot, weak, strong, peak = ohms[0], ohms[1], constants[0], constants[1], 0.0
    l0, l1, l2, h0, h1, h2 = least[:-2], least[1:-1], least[2:], most[:-2], most[1:-1], most[2:]
    s, r0, r1, r2 = speed[1:-1], behind[1:-1], at[1:-1], ahead[1:-1]
    for t in range(len(s)):
        own, before, after = inductance * r1[t], inductance * r0[t], inductance * r2[t]
        low = smaller(own * l1[t], own * h1[t]) + smaller(before * l0[t], before * h0[t])
        high = larger(own * l1[t], own * h1[t]) + larger(before * l0[t], before * h0[t])
        low += smaller(after * l2[t], after * h2[t]) + smaller(cool * l1[t], hot * l1[t])
        high += larger(after * l2[t], after * h2[t]) + larger(cool * h1[t], hot * h1[t])
        emf = ratio * s[t]
        peak = larger(peak, _least_sum(emf, low, weak, strong))
        peak = larger(peak, _least_sum(-emf, -high, weak, strong))
    return peak


@njit_leaf
def resting_share(m: Array, parts: int, duration: float) -> float:
    """The share of its mean rise below which the housing never falls while the winding's heat comes unevenly.

    The answer of the housing to a short burst of heat in the winding, repeated with the cycle, is the difference of
    two exponentials: least just when the burst comes. No distribution of the same heat keeps it cooler.

    Args:
        m: Row of the motor.
        parts: Of the mix.
        duration: Of the cycle [s].

    Returns:
        0 to 1; 1 where the temperatures are taken as means, 0 where it is not known.
    """
    winding, housing, inner, outer = m[WINDING_CAPACITY], m[HOUSING_CAPACITY], m[INNER], m[OUTER]
    if np.isnan(winding):
        return 1.0
    if parts > 1 or np.isnan(housing) or inner == 0.0:
        return 0.0
    a, c, d = 1.0 / (inner * winding), 1.0 / (inner * housing), (1.0 / inner + 1.0 / outer) / housing
    middle, spread = 0.5 * (a + d), math.sqrt(0.25 * (a - d) ** 2 + a * c)
    slow, quick = (a * d - a * c) / (middle + spread), middle + spread
    left = 1.0 / -math.expm1(-slow * duration) - 1.0 / -math.expm1(-quick * duration)
    return min(max(duration * slow * quick / (quick - slow) * left, 0.0), 1.0)


@njit_part
def stays_cool(task: PackedTask, joint: int, pair: int, bounds: JointBounds) -> bool:
    """Whether a pair may hold the limits of heat and current with some torque history within bounds.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``, for which ``may_hold`` was just asked.
        bounds: As it left them, with the interval of the motor's torque.

    Returns:
        False only if no history within them lets these checks hold.
    """
    m, g, limits = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]], task.tasks[joint]
    if np.isnan(m[INNER]) or np.isnan(m[MAX_WINDING]) or m[MAGNET] > 0.0:
        return True
    peak, square, between = least_figures(task.series[joint], bounds.scratch[LOW], bounds.scratch[HIGH])
    share, loss, ambient = resting_share(m, len(task.shares), limits[DURATION]), 0.0, limits[AMBIENT]
    if limits[CURVED] == 0.0:
        turning = abs(g[RATIO])
        loss = turning * (m[COULOMB] * limits[STEP_SPEED] + m[VISCOUS] * turning * limits[STEP_SQUARE])
    copper, magnets = 0.0, ambient
    for _ in range(STEPS):
        constant = constant_at(m, magnets)
        if not constant > 0.0:
            return False
        copper = resistance(m, ambient + share * m[OUTER] * copper) * between / (constant * constant)
        magnets = ambient + m[OUTER] * (copper + loss)
    constant = constant_at(m, magnets)
    hottest = ambient + (m[INNER] + m[OUTER]) * copper + m[OUTER] * loss
    if not constant > 0.0 or hottest - ambient > (m[MAX_WINDING] - limits[TEMPERATURE_MARGIN] - ambient) * OVER:
        return False
    hot = m[MAX_WINDING] - limits[TEMPERATURE_MARGIN]  # above it the pair falls anyway
    ohms = resistance(m, ambient + share * m[OUTER] * copper), resistance(m, hot)
    constants = constant_at(m, hot), constant
    least, most = bounds.scratch[LOW], bounds.scratch[HIGH]
    if constants[0] > 0.0:
        volts = _least_warm_voltage(task.series[joint], m, g[RATIO], ohms, constants, least, most)
        if limits[VOLTAGE_FACTOR] * volts > limits[VOLTS] * OVER:
            return False
    current = limits[PEAK_FACTOR] * peak / constant
    rms = limits[RMS_FACTOR] * math.sqrt(square / limits[DURATION]) / constant
    if current > m[PEAK_CURRENT] * OVER or current > limits[AMPLIFIER_PEAK] * OVER:
        return False
    return not (rms > m[CONTINUOUS] * OVER or rms > limits[AMPLIFIER_CONTINUOUS] * OVER)
