"""The work of one joint with the drives after it in place, summed up once for all pairs that are judged against it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_state import ROWS
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.packed_task import (
    AT_REST,
    BREAK_BACK,
    BREAK_FORWARD,
    FRICTION,
    INSTANTS,
    LOSS_FRICTION,
    MOVES,
    NEXT_WAY,
    SPEED,
    WAY,
    WEIGHT,
    Indices,
    PackedTask,
)
from drivetrain.sizing.vector_max import larger

# Numba's disk cache looks at this file alone: see the same constant in ``dynamics/kernels.py``.
SOURCES = {"heat_state.py": 3313927286, "packed_task.py": 789668293, "vector_max.py": 2907682659}

# Rows of a load's series; the last two hold the samples at rest alone, one after another.
FORCE, DRIVING_LOAD, DRIVEN_LOAD, HELD_LOAD, START_LOAD, START_WAY, LOAD_SERIES = range(7)

# Numbers of a load; then one average torque an exponent. NaN: not needed so far.
PEAK_LOAD, TILT, PUSH, SIDE, MOST_INERTIA, LOAD_NUMBERS = range(6)

SCRATCH = 3 + ROWS  # torque_kernels.py says what they hold
CHECKS = 18

entry = nb.njit(cache=True, error_model="numpy", nogil=True)  # called from Python
compiled = nb.njit(error_model="numpy", nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
part = nb.njit(error_model="numpy", nogil=True, inline="always")  # glue: compiled with whoever uses it
# A loop over samples: compiled once, called by others only.
fast = nb.njit(
    error_model="numpy", nogil=True, fastmath={"contract", "reassoc", "nsz"}, no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
)  # fmt: skip


class JointLoad(NamedTuple):
    """The work of one joint with the drives that load it in place; memory that is filled again and again.

    Attributes:
        series: Rows as above [N m], (LOAD_SERIES, N).
        numbers: Largest values and averages, as above, SI, (LOAD_NUMBERS + E,).
        drives: Numbers of the drives in place, (n, NUMBERS).
        checks: Required, available and utilisation of every check of the last pair judged, (CHECKS, 3).
        scratch: (SCRATCH, N).
        base: Force, wrench (six rows) and inertia without what the joint's own drive adds, (8, N).
        kept: Largest bearing loads of ``base``, then what a unit of each number of the joint's own drive adds to each
            at most; NaN: not needed so far, (1 + NUMBERS, 3).
        instants: Samples of large torque, (INSTANTS,).
    """

    series: Array
    numbers: Array
    drives: Array
    checks: Array
    scratch: Array
    base: Array
    kept: Array
    instants: Indices


class JointBounds(NamedTuple):
    """The interval in which a joint's torque lies; memory that is filled again and again.

    Attributes:
        low, high: Torque at the gear's output, joint friction not in it [N m], (N,).
        numbers: What is asked at least, as in ``JointLoad``, (LOAD_NUMBERS + E,).
        scratch: (SCRATCH, N).
        instants: Samples that ask much at least, (INSTANTS,).
    """

    low: Array
    high: Array
    numbers: Array
    scratch: Array
    instants: Indices


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
        np.zeros((SCRATCH, samples)), np.zeros((8, samples)), np.zeros((1 + NUMBERS, 3)),
        np.zeros(INSTANTS, dtype=np.int64),
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
    instants = np.zeros(INSTANTS, dtype=np.int64)
    return JointBounds(np.zeros(samples), np.zeros(samples), np.zeros(count), np.zeros((SCRATCH, samples)), instants)


@fast
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


@fast
def add_drive(start: Array, rows: Array, at: int, drives: Array, k: int, out: Array) -> None:
    """A start and what one drive adds to it.

    Args:
        start: Any unit, (N,).
        rows: What a unit of each number of each drive adds, (R, N).
        at: First row of the drive.
        drives: Numbers of drives, (n, NUMBERS).
        k: Which of them.
        out: Takes the sum, (N,).
    """
    a, b, c, d, e = drives[k, 0], drives[k, 1], drives[k, 2], drives[k, 3], drives[k, 4]
    r0, r1, r2, r3, r4 = rows[at], rows[at + 1], rows[at + 2], rows[at + 3], rows[at + 4]
    for t in range(len(out)):
        out[t] = start[t] + (a * r0[t] + b * r1[t] + c * r2[t] + d * r3[t] + e * r4[t])


@compiled
def large_instants(row: Array, low: Array, high: Array, instants: Indices) -> None:
    """In each of INSTANTS stretches the sample whose interval of torque is furthest from zero.

    Args:
        row: The joint's series, (SERIES, N).
        low, high: Torque at the gear's output [N m], (N,); both the same for one history.
        instants: Takes the samples.
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


@fast
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


@fast
def least_average(row: Array, exponent: float, low: Array, high: Array) -> float:
    """The average load torque as wear sees it (``average_torque``) that an interval leaves at least.

    Args:
        row: The joint's series, (SERIES, N).
        exponent: Of torque.
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


@fast
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


@fast
def bearing_peaks(wrench: Array, numbers: Array) -> None:
    """The largest loads on the output bearing.

    Args:
        wrench: Moments and forces across and along the axis, rows as in ``PackedTask.wrench``, (6, N).
        numbers: Takes tilting moment [N m], force along and across the axis [N], (3,).
    """
    mx, my, fx, fy, fz = wrench[0], wrench[1], wrench[3], wrench[4], wrench[5]
    tilt, push, side = 0.0, 0.0, 0.0
    for t in range(len(mx)):
        tilt = larger(tilt, mx[t] * mx[t] + my[t] * my[t])
        side = larger(side, fx[t] * fx[t] + fy[t] * fy[t])
        push = larger(push, abs(fz[t]))
    numbers[0], numbers[1], numbers[2] = math.sqrt(tilt), push, math.sqrt(side)


@fast
def magnitude(values: Array) -> float:
    """The largest magnitude.

    Args:
        values: Any unit, (N,).

    Returns:
        In that unit.
    """
    peak = 0.0
    for t in range(len(values)):
        peak = larger(peak, abs(values[t]))
    return peak


@part
def load_force(task: PackedTask, joint: int, drives: Array, force: Array) -> None:
    """The torque at a joint's gear.

    Args:
        task: The packed study.
        joint: Index of the joint.
        drives: Numbers of the drives in place, zeros where there is none, (n, NUMBERS); the joint's own counts where
            it rides on the link that it moves.
        force: Takes it [N m], (N,).
    """
    gather(task.bare[joint], task.force, task.offsets[joint], drives, force)


@part
def sum_up(task: PackedTask, joint: int, load: JointLoad) -> None:
    """What follows from the force of a load.

    Args:
        task: The packed study.
        joint: Index of the joint.
        load: Its FORCE is read, series and numbers are filled.
    """
    force, row, limits = load.series[FORCE], task.series[joint], task.tasks[joint]
    split(row, limits, task.rests[joint], load.series)
    for i in range(len(load.numbers)):
        load.numbers[i] = np.nan
    load.numbers[PEAK_LOAD] = least_peak(row, limits, force, force)


@entry
def load_joint(task: PackedTask, joint: int, drives: Array, load: JointLoad) -> None:
    """What is asked of a joint with the drives after it in place.

    Args:
        task: The packed study.
        joint: Index of the joint.
        drives: Their numbers, zeros where there is none, (n, NUMBERS); the joint's own is left out.
        load: Takes the result.
    """
    for k in range(len(drives)):
        for i in range(NUMBERS):
            load.drives[k, i] = drives[k, i] if k != joint else 0.0
    for i in range(1 + NUMBERS):
        load.kept[i, 0] = np.nan
    base, force = load.base[0], load.series[FORCE]
    gather(task.bare[joint], task.force, task.offsets[joint], load.drives, base)
    for t in range(len(base)):
        force[t] = base[t]
    sum_up(task, joint, load)
    large_instants(task.series[joint], base, base, load.instants)


@part
def own_load(task: PackedTask, joint: int, pair: int, load: JointLoad) -> None:
    """Add what the joint's own drive asks of it, where it rides on the link that it moves.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: From ``load_joint``.
    """
    if task.offsets[joint, joint] >= 0:
        add_drive(load.base[0], task.force, task.offsets[joint, joint], task.numbers, pair, load.series[FORCE])
        sum_up(task, joint, load)


@part
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
        force = load.series[FORCE]
        load.numbers[at] = least_average(task.series[joint], task.exponents[which], force, force)
    return load.numbers[at]


@part
def bearing_base(task: PackedTask, joint: int, load: JointLoad) -> None:
    """The loads on the output bearing without the joint's own drive, computed when first asked for.

    Args:
        task: The packed study.
        joint: Index of the joint.
        load: The joint's; takes wrench and largest loads into ``base`` and ``kept``.
    """
    if np.isnan(load.kept[0, 0]):
        for component in range(6):
            to = load.base[1 + component]
            gather(task.bare_wrench[joint, component], task.wrench[component], task.offsets[joint], load.drives, to)
        bearing_peaks(load.base[1:7], load.kept[0])
        at = task.offsets[joint, joint]
        for i in range(NUMBERS if at >= 0 else 0):
            bearing_peaks(task.wrench[:, at + i], load.kept[1 + i])


@part
def bearing_reach(task: PackedTask, joint: int, pair: int, which: int, load: JointLoad) -> float:
    """What a load on the output bearing is at most; exact where the joint's own drive does not load it.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        which: 0 for the tilting moment [N m], 1 and 2 for forces along and across the axis [N].
        load: The joint's, after ``bearing_base``.

    Returns:
        [N m] or [N].
    """
    reach = load.kept[0, which]
    if task.offsets[joint, joint] >= 0:
        for i in range(NUMBERS):
            reach += abs(task.numbers[pair, i]) * load.kept[1 + i, which]
    return reach


@part
def bearing(task: PackedTask, joint: int, pair: int, load: JointLoad) -> None:
    """The largest loads on the output bearing.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: The joint's, after ``bearing_base``; takes TILT, PUSH and SIDE.
    """
    at = task.offsets[joint, joint]
    if at < 0:
        for which in range(3):
            load.numbers[TILT + which] = load.kept[0, which]
    elif np.isnan(load.numbers[TILT]):
        for component in range(6):
            to = load.scratch[component]
            add_drive(load.base[1 + component], task.wrench[component], at, task.numbers, pair, to)
        bearing_peaks(load.scratch, load.numbers[TILT : TILT + 3])


@part
def inertia_peak(task: PackedTask, joint: int, pair: int, load: JointLoad) -> float:
    """The largest inertia that the gear's output accelerates, computed when first asked for.

    Args:
        task: The packed study.
        joint: Index of the joint.
        pair: Index into ``task.pairs``.
        load: The joint's.

    Returns:
        [kg m^2].
    """
    if np.isnan(load.numbers[MOST_INERTIA]):
        total, at = load.scratch[0], task.offsets[joint, joint]
        gather(task.bare_inertia[joint], task.inertia, task.offsets[joint], load.drives, total)
        if at >= 0:
            add_drive(total, task.inertia, at, task.numbers, pair, load.scratch[1])
            total = load.scratch[1]
        load.numbers[MOST_INERTIA] = magnitude(total)
    return load.numbers[MOST_INERTIA]


@entry
def bound_joint(task: PackedTask, joint: int, low: Array, high: Array, bounds: JointBounds) -> None:
    """What is asked of a joint at least when its torque lies in an interval.

    Args:
        task: The packed study.
        joint: Index of the joint.
        low, high: Torque at the gear's output without joint friction and without what the joint's own drive adds
            [N m], (N,).
        bounds: Takes the result.
    """
    for t in range(len(low)):
        bounds.low[t], bounds.high[t] = low[t], high[t]
    for i in range(len(bounds.numbers)):
        bounds.numbers[i] = np.nan
    bounds.numbers[PEAK_LOAD] = least_peak(task.series[joint], task.tasks[joint], low, high)
    large_instants(task.series[joint], low, high, bounds.instants)
