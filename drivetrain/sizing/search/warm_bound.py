"""How warm a pair at least gets while the torque of its joint lies in an interval, and the voltage of a warm motor.

The mean heat of a cycle can be bounded from below before any temperature is known; it warms the magnets, which then
need more current, and the winding, which then has more resistance, and both add to the heat. Each step of that ladder
is a lower bound, and the next one starts from it.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.periodic_heat import STEADY
from drivetrain.sizing.judge.compiling import njit_leaf, njit_loop, njit_part
from drivetrain.sizing.judge.packed_rows import (
    COPPER,
    COULOMB,
    HOUSING_CAPACITY,
    INDUCTANCE,
    INNER,
    MAGNET,
    MAX_WINDING,
    OUTER,
    RATIO,
    RESISTANCE,
    VISCOUS,
    WINDING_CAPACITY,
)
from drivetrain.sizing.judge.packed_task import (
    AMBIENT,
    CURVED,
    DURATION,
    RATE_AFTER,
    RATE_AT,
    RATE_BEFORE,
    SPEED,
    STEP_SPEED,
    STEP_SQUARE,
)
from drivetrain.sizing.judge.torque_kernels import constant_at, resistance
from drivetrain.sizing.judge.vector_max import larger, smaller

STEPS = 8  # of the ladder at most; each adds a few percent of the one before
ENOUGH = 1e-3  # of the rise: a step that adds less is the last


@njit_part
def _least_sum(speed: float, drop: float, weak: float, strong: float) -> float:
    """The least of speed k + drop / k for k from weak to strong: at an end, or between where one falls, one rises."""
    ends = smaller(speed * weak + drop / weak, speed * strong + drop / strong)
    between = (drop > speed * weak * weak) & (drop < speed * strong * strong) & (speed > 0.0)
    return 2.0 * math.sqrt(larger(speed * drop, 0.0)) if between else ends


@njit_loop
def least_warm_voltage(
    row: Array, m: Array, ratio: float, ohms: tuple[float, float], constants: tuple[float, float], least: Array,
    most: Array,
) -> float:  # fmt: skip
    """The voltage of a warm motor that cannot be undercut; the first and the last sample are left out.

    Args:
        row: The joint's series, (SERIES, N).
        constants: Torque constant of magnets at their warmest and at their coolest [N m/A].
        least, most: Ends of the interval of the motor's torque [N m], (N,).

    Returns:
        [V].
    """
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
        duration: Of the cycle [s].
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


@njit_leaf
def _least_rises(m: Array, limits: Array, copper: float, loss: float, parts: int) -> tuple[float, float]:
    """Mean rises of winding and housing that cannot be undercut, infinite in a runaway.

    Copper loss is s (r + r' x) with x the winding's rise and s the square of the current; y = x + r / r' follows
    C y' / y = s r' - 1 / R + (h + r / r') / (R y) with h the housing's rise, R between them. Its mean over a cycle
    that repeats is zero, so that mean of s and least h bound mean(1 / y), and that bounds mean(y). A housing cools by
    no more than its own rate within a cycle, which bounds its least rise by its mean.
    Of a mix of several parts only the losses at ambient temperature count.
    """
    inner, outer = m[INNER], m[OUTER]
    housing = outer * (copper + loss)
    winding = inner * copper + housing
    if parts == 1:
        above = resistance(m, limits[AMBIENT]) / (m[RESISTANCE] * m[COPPER])  # kelvins from no resistance at all
        flow = inner if inner > 0.0 else outer
        left = 1.0 - flow * copper / above
        if not left > 0.0:
            return np.inf, np.inf
        if inner == 0.0:
            winding = max(winding, above / left - above)
            return winding, winding
        kept = 1.0
        if not (np.isnan(m[HOUSING_CAPACITY]) or np.isnan(m[WINDING_CAPACITY])):
            kept = math.exp(-limits[DURATION] * (1.0 / inner + 1.0 / outer) / m[HOUSING_CAPACITY])
        elif not np.isnan(m[WINDING_CAPACITY]):
            kept = math.exp(-(1.0 + outer / inner) / STEADY)
        share, given = outer / (inner + outer), loss * inner * outer / (inner + outer)
        grows = kept * share / left
        if not grows < 1.0:
            return np.inf, np.inf
        winding = max(winding, ((kept * given + above) / left - above) / (1.0 - grows))
        housing = max(housing, share * winding + given)
    return winding, housing


@njit_leaf
def least_warmth(m: Array, g: Array, limits: Array, parts: int, between: float) -> tuple[float, float, float]:
    """Temperatures that no torque within an interval lets a motor stay below.

    Args:
        limits: The joint's numbers, (TASK,).
        between: Mean square of the motor's torque at the least [N^2 m^2], from ``least_figures``.

    Returns:
        Winding at any instant, magnets on average, hottest winding [C], infinite in a runaway. A motor without a limit
        of temperature is taken at ambient temperature, as one that runs away is judged; one of unknown heat has its
        winding at the limit.
    """
    ambient, limit = limits[AMBIENT], m[MAX_WINDING]
    if np.isnan(limit) or m[MAGNET] > 0.0:
        return ambient, ambient, ambient
    if np.isnan(m[INNER]):
        return limit, ambient, ambient
    share, loss = resting_share(m, parts, limits[DURATION]), 0.0
    if limits[CURVED] == 0.0:
        turning = abs(g[RATIO])
        loss = turning * (m[COULOMB] * limits[STEP_SPEED] + m[VISCOUS] * turning * limits[STEP_SQUARE])
    cold, copper, housing, winding = resistance(m, ambient), 0.0, 0.0, 0.0
    for _ in range(STEPS):
        constant, before = constant_at(m, ambient + housing), winding
        if not constant > 0.0:
            return ambient + share * m[OUTER] * copper, ambient + housing, np.inf
        square = between / (constant * constant)
        copper = square * resistance(m, ambient + share * m[OUTER] * copper)
        winding, housing = _least_rises(m, limits, square * cold, loss, parts)
        housing = max(housing, m[OUTER] * (copper + loss))
        winding = max(winding, m[INNER] * copper + housing)
        if not winding < np.inf:
            return ambient + share * m[OUTER] * copper, ambient, np.inf
        if winding - before <= ENOUGH * winding:
            break
    return ambient + share * m[OUTER] * copper, ambient + housing, ambient + winding
