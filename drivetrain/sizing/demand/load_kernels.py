"""The work of one joint with the drives after it in place, summed up once for all pairs that are judged against it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.heat_state import ROWS, SHARES, STATE
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.demand.load_loops import (
    FORCE,
    LOAD_SERIES,
    add_drive,
    bearing_peaks,
    gather,
    large_instants,
    least_average,
    least_peak,
    magnitude,
    split,
)
from drivetrain.sizing.judge.compiling import njit_entry, njit_face, njit_leaf, njit_loop, njit_part, njit_unit
from drivetrain.sizing.judge.packed_task import INSTANTS, Indices, PackedTask

# Numbers of a load; then one average torque an exponent. NaN: not needed so far.
PEAK_LOAD, TILT, PUSH, SIDE, MOST_INERTIA, LOAD_NUMBERS = range(6)

# Figures of bounds: largest torque [N m], sum of weight times square [N^2 m^2 s], coolest winding, magnets, hottest [C]
PEAK, SQUARE, COOLEST, WARM_MAGNETS, HOTTEST, BOUNDS = range(6)

SCRATCH = 3 + ROWS  # torque_kernels.py says what they hold
CHECKS = 18


compiled, fast, part = njit_leaf, njit_loop, njit_part  # as other kernels of the search name them


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
        heat: What ``heat_state`` finds, then the numbers of the motor that it asks for, (STATE + SHARES + parts,).
    """

    series: Array
    numbers: Array
    drives: Array
    checks: Array
    scratch: Array
    base: Array
    kept: Array
    instants: Indices
    heat: Array


class JointBounds(NamedTuple):
    """The interval in which a joint's torque lies; memory that is filled again and again.

    Attributes:
        low, high: Torque at the gear's output, joint friction not in it [N m], (N,).
        numbers: What is asked at least, as in ``JointLoad``, (LOAD_NUMBERS + E,).
        scratch: (SCRATCH, N).
        instants: Samples that ask much at least, (INSTANTS,).
        own: ``numbers`` where the joint's own drive adds to the torque.
        figures: What no torque within the interval undercuts, of the pair asked about last, as above, (BOUNDS,).
    """

    low: Array
    high: Array
    numbers: Array
    scratch: Array
    instants: Indices
    own: Array
    figures: Array


def new_load(task: PackedTask) -> JointLoad:
    """Memory for the load of one joint."""
    n, _, samples = task.series.shape
    count = LOAD_NUMBERS + len(task.exponents)
    return JointLoad(
        np.zeros((LOAD_SERIES, samples)), np.zeros(count), np.zeros((n, NUMBERS)), np.zeros((CHECKS, 3)),
        np.zeros((SCRATCH, samples)), np.zeros((8, samples)), np.zeros((1 + NUMBERS, 3)),
        np.zeros(INSTANTS, dtype=np.int64), np.zeros(STATE + SHARES + len(task.shares)),
    )  # fmt: skip


def new_bounds(task: PackedTask) -> JointBounds:
    """Memory for the bounds of one joint."""
    samples = task.series.shape[2]
    count = LOAD_NUMBERS + len(task.exponents)
    instants, scratch = np.zeros(INSTANTS, dtype=np.int64), np.zeros((SCRATCH, samples))
    return JointBounds(
        np.zeros(samples), np.zeros(samples), np.zeros(count), scratch, instants, np.zeros(count), np.zeros(BOUNDS)
    )


@njit_part
def load_force(task: PackedTask, joint: int, drives: Array, force: Array) -> None:
    """The torque at a joint's gear.

    Args:
        drives: Numbers of the drives in place, zeros where there is none, (n, NUMBERS); the joint's own counts where
            it rides on the link that it moves.
        force: Takes it [N m], (N,).
    """
    gather(task.bare[joint], task.force, task.offsets[joint], drives, force)


@njit_part
def sum_up(task: PackedTask, joint: int, load: JointLoad) -> None:
    """What follows from the force of a load."""
    force, row, limits = load.series[FORCE], task.series[joint], task.tasks[joint]
    split(row, limits, task.rests[joint], load.series)
    for i in range(len(load.numbers)):
        load.numbers[i] = np.nan
    load.numbers[PEAK_LOAD] = least_peak(row, limits, force, force)


@njit_face
def load_joint(task: PackedTask, joint: int, drives: Array, load: JointLoad) -> None:
    """What is asked of a joint with the drives after it in place.

    Args:
        drives: Their numbers, zeros where there is none, (n, NUMBERS); the joint's own is left out.
    """
    load_unit(task, joint, drives, load)


@njit_unit
def load_unit(task: PackedTask, joint: int, drives: Array, load: JointLoad) -> None:
    """``load_joint``, to be called by its address.

    Args:
        drives: Numbers of the drives in place, (n, NUMBERS).
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


@njit_part
def own_load(task: PackedTask, joint: int, pair: int, load: JointLoad) -> None:
    """Add what the joint's own drive asks of it, where it rides on the link that it moves."""
    if task.offsets[joint, joint] >= 0:
        add_drive(load.base[0], task.force, task.offsets[joint, joint], task.numbers, pair, load.series[FORCE])
        sum_up(task, joint, load)


@njit_part
def average(task: PackedTask, joint: int, which: int, load: JointLoad) -> float:
    """The average load torque as wear sees it, computed when first asked for.

    Returns:
        [N m].
    """
    at = LOAD_NUMBERS + which
    if np.isnan(load.numbers[at]):
        force = load.series[FORCE]
        load.numbers[at] = least_average(task.series[joint], task.exponents[which], force, force)
    return load.numbers[at]


@njit_part
def bearing_base(task: PackedTask, joint: int, load: JointLoad) -> None:
    """The loads on the output bearing without the joint's own drive, computed when first asked for."""
    if np.isnan(load.kept[0, 0]):
        for component in range(6):
            to = load.base[1 + component]
            gather(task.bare_wrench[joint, component], task.wrench[component], task.offsets[joint], load.drives, to)
        base = load.base
        bearing_peaks(base[1], base[2], base[4], base[5], base[6], load.kept[0])
        at = task.offsets[joint, joint]
        for i in range(NUMBERS if at >= 0 else 0):
            row, unit = at + i, task.wrench
            bearing_peaks(unit[0, row], unit[1, row], unit[3, row], unit[4, row], unit[5, row], load.kept[1 + i])


@njit_part
def bearing_reach(task: PackedTask, joint: int, pair: int, which: int, load: JointLoad) -> float:
    """What a load on the output bearing is at most; exact where the joint's own drive does not load it.

    Args:
        which: 0 for the tilting moment [N m], 1 and 2 for forces along and across the axis [N].

    Returns:
        [N m] or [N].
    """
    reach = load.kept[0, which]
    if task.offsets[joint, joint] >= 0:
        for i in range(NUMBERS):
            reach += abs(task.numbers[pair, i]) * load.kept[1 + i, which]
    return reach


@njit_part
def bearing(task: PackedTask, joint: int, pair: int, load: JointLoad) -> None:
    """The largest loads on the output bearing."""
    at = task.offsets[joint, joint]
    if at < 0:
        for which in range(3):
            load.numbers[TILT + which] = load.kept[0, which]
    elif np.isnan(load.numbers[TILT]):
        for component in range(6):
            to = load.scratch[component]
            add_drive(load.base[1 + component], task.wrench[component], at, task.numbers, pair, to)
        own = load.scratch
        bearing_peaks(own[0], own[1], own[3], own[4], own[5], load.numbers[TILT : TILT + 3])


@njit_part
def inertia_peak(task: PackedTask, joint: int, pair: int, load: JointLoad) -> float:
    """The largest inertia that the gear's output accelerates, computed when first asked for.

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


@njit_entry
def bound_joint(task: PackedTask, joint: int, low: Array, high: Array, bounds: JointBounds) -> None:
    """What is asked of a joint at least when its torque lies in an interval.

    Args:
        low, high: Torque at the gear's output without joint friction and without what the joint's own drive adds
            [N m], (N,).
    """
    for t in range(len(low)):
        bounds.low[t], bounds.high[t] = low[t], high[t]
    for i in range(len(bounds.numbers)):
        bounds.numbers[i] = np.nan
    bounds.numbers[PEAK_LOAD] = least_peak(task.series[joint], task.tasks[joint], low, high)
    large_instants(task.series[joint], low, high, bounds.instants)
