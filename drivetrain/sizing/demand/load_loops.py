"""Loops over the samples of one joint's load, each compiled once for all kernels that use it."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.judge.compiling import njit_leaf, njit_loop
from drivetrain.sizing.judge.packed_task import (
    AT_REST,
    BREAK_BACK,
    BREAK_FORWARD,
    FRICTION,
    INSTANTS,
    LOSS_FRICTION,
    MOVES,
    NEXT_WAY,
    SPEED,
    STEP_SHARE,
    WAY,
    WEIGHT,
    Indices,
)
from drivetrain.sizing.judge.vector_max import larger, smaller

# Rows of a load's series; the last two hold the samples at rest alone, one after another.
FORCE, DRIVING_LOAD, DRIVEN_LOAD, HELD_LOAD, START_LOAD, START_WAY, LOAD_SERIES = range(7)


@njit_loop
def gather(bare: Array, rows: Array, offsets: Indices, drives: Array, out: Array) -> None:
    """A start and what drives add to it.

    Args:
        bare: Of the arm alone, any unit, (N,).
        rows: What a unit of each number of each drive adds, (R, N).
        offsets: First row of each drive, -1 where it adds nothing, (n,).
        drives: Numbers of the drives, (n, NUMBERS).
        out: Takes the sum, (N,).
    """
    for t in range(len(out)):
        out[t] = bare[t]
    for k in range(len(drives)):
        at = offsets[k]
        if at < 0:
            continue
        a, b, c, d, e = drives[k, 0], drives[k, 1], drives[k, 2], drives[k, 3], drives[k, 4]
        r0, r1, r2, r3, r4 = rows[at], rows[at + 1], rows[at + 2], rows[at + 3], rows[at + 4]
        if a != 0.0 or b != 0.0 or c != 0.0:
            for t in range(len(out)):
                out[t] += a * r0[t] + b * r1[t] + c * r2[t] + d * r3[t] + e * r4[t]
        elif d != 0.0 or e != 0.0:
            for t in range(len(out)):
                out[t] += d * r3[t] + e * r4[t]


@njit_loop
def add_drive(start: Array, rows: Array, at: int, drives: Array, k: int, out: Array) -> None:
    """A start and what one drive adds to it.

    Args:
        start: Any unit, (N,).
        rows: What a unit of each number of each drive adds, (R, N).
        drives: Numbers of drives, (n, NUMBERS).
        out: Takes the sum, (N,).
    """
    a, b, c, d, e = drives[k, 0], drives[k, 1], drives[k, 2], drives[k, 3], drives[k, 4]
    r0, r1, r2, r3, r4 = rows[at], rows[at + 1], rows[at + 2], rows[at + 3], rows[at + 4]
    for t in range(len(out)):
        out[t] = start[t] + (a * r0[t] + b * r1[t] + c * r2[t] + d * r3[t] + e * r4[t])


@njit_leaf
def large_instants(row: Array, low: Array, high: Array, instants: Indices) -> None:
    """In each of INSTANTS stretches the sample whose interval of torque is furthest from zero.

    Args:
        row: The joint's series, (SERIES, N).
        low, high: Torque at the gear's output [N m], (N,); both the same for one history.
    """
    samples, friction = len(low), row[FRICTION]
    for i in range(INSTANTS):
        first, last = i * samples // INSTANTS, (i + 1) * samples // INSTANTS
        found, most = min(first, samples - 1), -np.inf
        for t in range(first, last):
            a, b = low[t] + friction[t], -(high[t] + friction[t])
            least = a if a > b else b
            if least > most:
                found, most = t, least
        instants[i] = found


@njit_loop
def least_peak(row: Array, limits: Array, low: Array, high: Array) -> float:
    """The largest load torque, breakaway at rest included, that an interval leaves at least.

    Args:
        row: The joint's series, (SERIES, N).
        limits: The joint's numbers, (TASK,).
        low, high: Torque at the gear's output [N m], (N,); both the same for one history.

    Returns:
        [N m].
    """
    friction, still = row[FRICTION], row[AT_REST]
    forward, back = limits[BREAK_FORWARD] * limits[MOVES], limits[BREAK_BACK] * limits[MOVES]
    peak = 0.0
    for t in range(len(low)):
        a, b = low[t] + friction[t], -(high[t] + friction[t])
        loose = forward if a > 0.0 else (back if b > 0.0 else 0.0)
        peak = larger(peak, larger(larger(a, b), 0.0) + still[t] * loose)
    return peak


@njit_loop
def least_average(row: Array, exponent: float, low: Array, high: Array) -> float:
    """The average load torque as wear sees it (``average_torque``) that an interval leaves at least.

    Args:
        row: The joint's series, (SERIES, N).
        low, high: Torque at the gear's output [N m], (N,); both the same for one history.

    Returns:
        [N m].
    """
    speed, weight, friction = row[SPEED], row[WEIGHT], row[FRICTION]
    travel, total, cubic = 0.0, 0.0, exponent == 3.0
    if cubic:
        for t in range(len(low)):
            share, shift = abs(speed[t]) * weight[t], friction[t]
            magnitude = larger(larger(low[t] + shift, -(high[t] + shift)), 0.0)
            travel += share
            total += share * magnitude * magnitude * magnitude
    else:
        for t in range(len(low)):
            share, shift = abs(speed[t]) * weight[t], friction[t]
            travel += share
            total += share * larger(larger(low[t] + shift, -(high[t] + shift)), 0.0) ** exponent
    return (total / travel) ** (1.0 / exponent) if travel > 0.0 else 0.0


@njit_loop
def split(row: Array, limits: Array, rests: Indices, series: Array) -> None:
    """What follows from a joint's torque, whatever pair is to bear it.

    Args:
        row: The joint's series, (SERIES, N).
        limits: The joint's numbers, (TASK,).
        rests: Samples at rest, -1 after the last, (N,).
        series: The load's; FORCE is read, the rest is filled, (LOAD_SERIES, N).
    """
    force, driving, driven, held = series[FORCE], series[DRIVING_LOAD], series[DRIVEN_LOAD], series[HELD_LOAD]
    way, loss, after = row[WAY], row[LOSS_FRICTION], row[NEXT_WAY]
    for t in range(len(force)):
        load = force[t] + loss[t]
        drives = load if load * way[t] > 0.0 else 0.0
        rest = load if way[t] == 0.0 else 0.0
        driving[t] = drives
        held[t] = load - drives
        driven[t] = load - drives - rest
    start, ways = series[START_LOAD], series[START_WAY]
    if limits[MOVES] == 0.0:
        return
    for i in range(len(rests)):
        at = rests[i]
        if at < 0:
            break
        torque = force[at]
        to = 1.0 if torque > 0.0 else (-1.0 if torque < 0.0 else after[at])
        start[i] = torque + (limits[BREAK_FORWARD] if to > 0.0 else (-limits[BREAK_BACK] if to < 0.0 else 0.0))
        ways[i] = to


@njit_loop
def bearing_peaks(mx: Array, my: Array, fx: Array, fy: Array, fz: Array, numbers: Array) -> None:
    """The largest loads on the output bearing.

    Args:
        mx, my: Moments across the axis [N m], (N,).
        fx, fy, fz: Forces across and along it [N], (N,).
        numbers: Takes tilting moment [N m], force along and across the axis [N], (3,).
    """
    tilt, push, side = 0.0, 0.0, 0.0
    for t in range(len(mx)):
        tilt = larger(tilt, mx[t] * mx[t] + my[t] * my[t])
        side = larger(side, fx[t] * fx[t] + fy[t] * fy[t])
        push = larger(push, abs(fz[t]))
    numbers[0], numbers[1], numbers[2] = math.sqrt(tilt), push, math.sqrt(side)


@njit_loop
def magnitude(values: Array) -> float:
    """The largest magnitude.

    Args:
        values: Any unit, (N,).
    """
    peak = 0.0
    for t in range(len(values)):
        peak = larger(peak, abs(values[t]))
    return peak


@njit_loop
def least_figures(row: Array, least: Array, most: Array) -> tuple[float, float, float]:
    """Largest magnitude, sum of weight times square, and mean square between samples that cannot be undercut.

    Args:
        row: The joint's series, (SERIES, N).
        least, most: Ends of the interval of the motor's torque [N m], (N,).

    Returns:
        [N m], [N^2 m^2 s], [N^2 m^2].
    """
    weight, share, peak, square, between = row[WEIGHT], row[STEP_SHARE], 0.0, 0.0, 0.0
    for t in range(len(least)):
        magnitude = larger(larger(least[t], -most[t]), 0.0)
        peak = larger(peak, magnitude)
        square += weight[t] * magnitude * magnitude
    low, high, low_after, high_after = least[:-1], most[:-1], least[1:], most[1:]
    for t in range(len(low)):
        a = larger(low[t], 0.0) + smaller(high[t], 0.0)
        b = larger(low_after[t], 0.0) + smaller(high_after[t], 0.0)
        same = (a * a + a * b + b * b) * (1.0 / 3.0)
        turned = 0.25 * larger(a * a, b * b)  # the least of the same sum over one of the two
        between += share[t] * (same if a * b > 0.0 else turned)
    return peak, square, between
