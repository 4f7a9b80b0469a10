"""The work of one joint with the drives after it in place, summed up once for all pairs that are judged against it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_task import (
    AT_REST,
    BREAK_BACK,
    BREAK_FORWARD,
    FRICTION,
    LOSS_FRICTION,
    MOVES,
    NEXT_WAY,
    SPEED,
    WAY,
    WEIGHT,
    PackedTask,
)
from drivetrain.sizing.vector_max import larger

# Rows of a load's series; the last two hold the samples at rest alone, one after another.
FORCE, DRIVING_LOAD, DRIVEN_LOAD, HELD_LOAD, START_LOAD, START_WAY, LOAD_SERIES = range(7)

# Numbers of a load; then one average torque an exponent. NaN: not needed so far.
PEAK_LOAD, TILT, PUSH, SIDE, MOST_INERTIA, LOAD_NUMBERS = range(6)

SCRATCH = 10
CHECKS = 18

compiled = nb.njit(cache=True, error_model="numpy", nogil=True)
fast = nb.njit(cache=True, error_model="numpy", nogil=True, fastmath={"contract", "reassoc", "nsz"})


class JointLoad(NamedTuple):
    """The work of one joint with the drives that load it in place; memory that is filled again and again.

    Attributes:
        series: Rows as above [N m], (LOAD_SERIES, N).
        numbers: Largest values and averages, as above, SI, (LOAD_NUMBERS + E,).
        drives: Numbers of the drives in place, (n, NUMBERS).
        checks: Required, available and utilisation of every check of the last pair judged, (CHECKS, 3).
        scratch: (SCRATCH, N).
    """

    series: Array
    numbers: Array
    drives: Array
    checks: Array
    scratch: Array


class JointBounds(NamedTuple):
    """The interval in which a joint's torque lies; memory that is filled again and again.

    Attributes:
        low, high: Torque at the gear's output, joint friction not in it [N m], (N,).
        numbers: What is asked at least, as in ``JointLoad``, (LOAD_NUMBERS + E,).
        scratch: (SCRATCH, N).
    """

    low: Array
    high: Array
    numbers: Array
    scratch: Array


def new_load(task: PackedTask) -> JointLoad:
    """Memory for the load of one joint.

    Args:
        task: The packed study.

    Returns:
        Nothing in it yet.
    """
    n, _, samples = task.series.shape
    count = LOAD_NUMBERS + len(task.exponents)
    return JointLoad(
        np.zeros((LOAD_SERIES, samples)), np.zeros(count), np.zeros((n, NUMBERS)), np.zeros((CHECKS, 3)),
        np.zeros((SCRATCH, samples)),
    )  # fmt: skip


def new_bounds(task: PackedTask) -> JointBounds:
    """Memory for the bounds of one joint.

    Args:
        task: The packed study.

    Returns:
        Nothing in it yet.
    """
    samples = task.series.shape[2]
    count = LOAD_NUMBERS + len(task.exponents)
    return JointBounds(np.zeros(samples), np.zeros(samples), np.zeros(count), np.zeros((SCRATCH, samples)))


@fast
def load_force(task: PackedTask, joint: int, drives: Array, force: Array) -> None:
    """The torque at a joint's gear.

    Args:
        task: The packed study.
        joint: Index of the joint.
        drives: Numbers of the drives in place, zeros where there is none, (n, NUMBERS); the joint's own counts where
            it rides on the link that it moves.
        force: Takes it [N m], (N,).
    """
    samples = len(force)
    force[:] = task.bare[joint]
    for k in range(drives.shape[0]):
        row = task.offsets[joint, k]
        if row < 0:
            continue
        a, b, c, d, e = drives[k, 0], drives[k, 1], drives[k, 2], drives[k, 3], drives[k, 4]
        f0, f1, f2 = task.force[row], task.force[row + 1], task.force[row + 2]
        f3, f4 = task.force[row + 3], task.force[row + 4]
        if a != 0.0 or b != 0.0 or c != 0.0:
            for t in range(samples):
                force[t] += a * f0[t] + b * f1[t] + c * f2[t] + d * f3[t] + e * f4[t]
        elif d != 0.0 or e != 0.0:
            for t in range(samples):
                force[t] += d * f3[t] + e * f4[t]


@compiled
def load_joint(task: PackedTask, joint: int, drives: Array, load: JointLoad) -> None:
    """What is asked of a joint with the drives after it in place.

    Args:
        task: The packed study.
        joint: Index of the joint.
        drives: Their numbers, zeros where there is none, (n, NUMBERS); the joint's own is left out.
        load: Takes the result.
    """
    load.drives[:] = drives
    load.drives[joint] = 0.0
    load_force(task, joint, load.drives, load.series[FORCE])
    sum_up(task, joint, load)


@fast
def sum_up(task: PackedTask, joint: int, load: JointLoad) -> None:
    """What follows from a joint's torque, whatever pair is to bear it.

    Args:
        task: The packed study.
        joint: Index of the joint.
        load: Its FORCE is read, the rest is filled.
    """
    series, row = load.series, task.series[joint]
    force, driving, driven, held = series[FORCE], series[DRIVING_LOAD], series[DRIVEN_LOAD], series[HELD_LOAD]
    way, friction, loss, still = row[WAY], row[FRICTION], row[LOSS_FRICTION], row[AT_REST]
    forward, back = task.tasks[joint, BREAK_FORWARD], task.tasks[joint, BREAK_BACK]
    moves = task.tasks[joint, MOVES] != 0.0
    if not moves:
        forward = back = 0.0
    peak = 0.0
    for t in range(len(force)):
        load_torque = force[t] + loss[t]
        drives = load_torque if load_torque * way[t] > 0.0 else 0.0
        rest = load_torque if way[t] == 0.0 else 0.0
        driving[t] = drives
        held[t] = load_torque - drives
        driven[t] = load_torque - drives - rest
        shown = force[t] + friction[t]
        loose = forward if shown > 0.0 else (back if shown < 0.0 else 0.0)
        peak = larger(peak, abs(shown) + still[t] * loose)
    load.numbers[:] = np.nan
    load.numbers[PEAK_LOAD] = peak
    if moves:
        _starts(task, joint, load)


@compiled
def _starts(task: PackedTask, joint: int, load: JointLoad) -> None:
    """The load against which, and the way in which, the joint would start at each sample at rest."""
    rests, after = task.rests[joint], task.series[joint, NEXT_WAY]
    forward, back = task.tasks[joint, BREAK_FORWARD], task.tasks[joint, BREAK_BACK]
    for i in range(len(rests)):
        if rests[i] < 0:
            break
        force = load.series[FORCE, rests[i]]
        way = np.sign(force) if force != 0.0 else after[rests[i]]
        load.series[START_LOAD, i] = force + (forward if way > 0.0 else (-back if way < 0.0 else 0.0))
        load.series[START_WAY, i] = way


@compiled
def average(task: PackedTask, joint: int, which: int, load: JointLoad) -> float:
    """The average load torque as wear sees it, computed when first asked for.

    Args:
        task: The packed study.
        joint: Index of the joint.
        which: Index of the exponent.
        load: The joint's.

    Returns:
        [N m].
    """
    at = LOAD_NUMBERS + which
    if np.isnan(load.numbers[at]):
        force, friction = load.series[FORCE], task.series[joint, FRICTION]
        magnitude = load.scratch[0]
        for t in range(len(force)):
            magnitude[t] = abs(force[t] + friction[t])
        load.numbers[at] = mean_power(task, joint, task.exponents[which], magnitude)
    return float(load.numbers[at])


@fast
def mean_power(task: PackedTask, joint: int, exponent: float, magnitude: Array) -> float:
    """``average_torque`` of magnitudes.

    Args:
        task: The packed study.
        joint: Index of the joint.
        exponent: Of torque.
        magnitude: Of the load torque [N m], (N,).

    Returns:
        [N m].
    """
    speed, weight = task.series[joint, SPEED], task.series[joint, WEIGHT]
    travel, total = 0.0, 0.0
    if exponent == 3.0:
        for t in range(len(magnitude)):
            share = abs(speed[t]) * weight[t]
            travel += share
            total += share * magnitude[t] * magnitude[t] * magnitude[t]
    else:
        for t in range(len(magnitude)):
            share = abs(speed[t]) * weight[t]
            travel += share
            total += share * magnitude[t] ** exponent
    return (total / travel) ** (1.0 / exponent) if travel > 0.0 else 0.0


@fast
def bearing_peaks(task: PackedTask, joint: int, load: JointLoad) -> None:
    """The largest loads on the output bearing, computed when first asked for.

    Args:
        task: The packed study.
        joint: Index of the joint.
        load: The joint's; takes TILT, PUSH and SIDE.
    """
    if not np.isnan(load.numbers[TILT]):
        return
    tilt, push, side = 0.0, 0.0, 0.0
    parts = load.scratch
    samples = len(parts[0])
    for component in range(6):
        if component == 2:
            continue
        total = parts[component]
        total[:] = task.bare_wrench[joint, component]
        for k in range(load.drives.shape[0]):
            row = task.offsets[joint, k]
            for i in range(NUMBERS):
                factor = load.drives[k, i]
                if row >= 0 and factor != 0.0:
                    unit = task.wrench[row + i, component]
                    for t in range(samples):
                        total[t] += factor * unit[t]
    mx, my, fx, fy, fz = parts[0], parts[1], parts[3], parts[4], parts[5]
    for t in range(samples):
        tilt = larger(tilt, mx[t] * mx[t] + my[t] * my[t])
        side = larger(side, fx[t] * fx[t] + fy[t] * fy[t])
        push = larger(push, abs(fz[t]))
    load.numbers[TILT], load.numbers[PUSH], load.numbers[SIDE] = math.sqrt(tilt), push, math.sqrt(side)


@fast
def inertia_peak(task: PackedTask, joint: int, load: JointLoad) -> float:
    """The largest inertia that the gear's output accelerates, computed when first asked for.

    Args:
        task: The packed study.
        joint: Index of the joint.
        load: The joint's.

    Returns:
        [kg m^2].
    """
    if np.isnan(load.numbers[MOST_INERTIA]):
        total = load.scratch[0]
        total[:] = task.bare_inertia[joint]
        for k in range(load.drives.shape[0]):
            row = task.offsets[joint, k]
            for i in range(NUMBERS):
                factor = load.drives[k, i]
                if row >= 0 and factor != 0.0:
                    unit = task.inertia[row + i]
                    for t in range(len(total)):
                        total[t] += factor * unit[t]
        peak = 0.0
        for t in range(len(total)):
            peak = larger(peak, abs(total[t]))
        load.numbers[MOST_INERTIA] = peak
    return float(load.numbers[MOST_INERTIA])


@fast
def bound_joint(task: PackedTask, joint: int, low: Array, high: Array, bounds: JointBounds) -> None:
    """What is asked of a joint at least when its torque lies in an interval.

    Args:
        task: The packed study.
        joint: Index of the joint.
        low, high: Torque at the gear's output without joint friction and without what the joint's own drive adds
            [N m], (N,).
        bounds: Takes the result.
    """
    row = task.series[joint]
    friction, still = row[FRICTION], row[AT_REST]
    forward, back = task.tasks[joint, BREAK_FORWARD], task.tasks[joint, BREAK_BACK]
    if task.tasks[joint, MOVES] == 0.0:
        forward = back = 0.0
    least = bounds.scratch[0]
    to_low, to_high = bounds.low, bounds.high
    peak = 0.0
    for t in range(len(low)):
        a, b = low[t], high[t]
        to_low[t] = a
        to_high[t] = b
        a, b = a + friction[t], -(b + friction[t])
        loose = forward if a > 0.0 else (back if b > 0.0 else 0.0)
        magnitude = larger(larger(a, b), 0.0)
        least[t] = magnitude
        peak = larger(peak, magnitude + still[t] * loose)
    bounds.numbers[:] = np.nan
    bounds.numbers[PEAK_LOAD] = peak


@compiled
def least_average(task: PackedTask, joint: int, which: int, bounds: JointBounds) -> float:
    """The least average load torque within bounds, computed when first asked for.

    Args:
        task: The packed study.
        joint: Index of the joint.
        which: Index of the exponent.
        bounds: The joint's.

    Returns:
        [N m].
    """
    at = LOAD_NUMBERS + which
    if np.isnan(bounds.numbers[at]):
        friction, least = task.series[joint, FRICTION], bounds.scratch[0]
        for t in range(len(friction)):
            shift = friction[t]
            least[t] = larger(larger(bounds.low[t] + shift, -(bounds.high[t] + shift)), 0.0)
        bounds.numbers[at] = mean_power(task, joint, task.exponents[which], least)
    return float(bounds.numbers[at])
