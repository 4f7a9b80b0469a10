"""The work of one joint as series for compiled code: its motion, what it carries, and what amounts add to that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import loss_speed
from drivetrain.drive.thermal.periodic_heat import Losses, Periods, new_losses, new_parts, periods_of
from drivetrain.sizing.demand.demand import JointDemand, Workload
from drivetrain.sizing.demand.load_basis import NUMBERS

STRETCHES = 16  # of the cycle, of each of which a first look takes the sharpest samples


class Motion(NamedTuple):
    """What a joint does, whatever drives it; N samples.

    Attributes:
        speed, acceleration, carrier_acceleration: Of the gear's output and of the stator's link [rad/s], [rad/s^2].
        loss_speed: Whose direction decides the losses [rad/s]; see ``drive.loss_speed``.
        weight: Time each sample stands for in the mean use [s].
        rate_before, rate_at, rate_after: The rate of a series at a sample is their sum with the sample before, itself
            and the one after [1/s].
        next_way: Speed at the sample after, of which the sign counts [rad/s].
        phase: What the current of one phase may be over that of all; see ``one_phase``.
        rests: Stretches in which the joint stands still, first sample and the one after the last, (M, 2).
        periods: Parts, shares and steps.
    """

    speed: Array
    acceleration: Array
    carrier_acceleration: Array
    loss_speed: Array
    weight: Array
    rate_before: Array
    rate_at: Array
    rate_after: Array
    next_way: Array
    phase: Array
    rests: Any
    periods: Periods


class Load(NamedTuple):
    """What a joint carries at its gear's output, joint friction not in it; rows without samples where nobody asks."""

    torque: Array  # [N m], (N,)
    wrench: Array  # moment [N m] and force [N] in the joint frame, (6, N) or (6, 0)
    inertia: Array  # that the output accelerates [kg m^2], (N,) or (0,)
    stop: Array  # torque in the states of stops on a ramp [N m], (M,)
    static: Array  # torque that holds each position still [N m], (N,) or (0,)


class Added(NamedTuple):
    """What a unit of each of K amounts adds to a load: of drives (five numbers each), or of payloads (their masses)."""

    # as in ``Load``, (K, N), (K, 6, N), (K, N), (K, M), (K, N); (0, 0), (0, 6, 0) where K is 0
    torque: Array
    wrench: Array
    inertia: Array
    stop: Array
    static: Array


def nothing_added(load: Load) -> Added:
    """No amounts at all, for a load."""
    rows = (np.zeros((0, *np.shape(values))) for values in load)
    return Added(*rows)


class Powers(NamedTuple):
    """Speeds that decide the losses, to one power, kept from gear to gear: a power function costs most of a pass."""

    exponent: Array  # of the power, NaN: none is there, (1,)
    values: Array  # |w|^p, (N,)


def new_powers(samples: int) -> Powers:
    """Room for them."""
    return Powers(np.full(1, np.nan), np.zeros(samples))


class Stopping(NamedTuple):
    """What stops on a ramp ask beside the load's torque, of the gear's output and of the stator's link, (M,) each."""

    # [rad/s], [rad/s^2]
    speed: Array
    acceleration: Array
    carrier_acceleration: Array
    # memory, as in ``Traces``
    joint_excess: Array
    shaft_excess: Array
    drag: Array
    powers: Powers


def stopping_of(speed: Array, acceleration: Array, carrier_acceleration: Array) -> Stopping:
    """Stops with memory of their own."""
    memory: Any = (*np.zeros((3, len(speed))), new_powers(len(speed)))
    return Stopping(speed, acceleration, carrier_acceleration, *memory)


class Traces(NamedTuple):
    """Memory of a judgement, and what a report draws, (N,) each; ``torque`` has one sample more at each end, 0."""

    load: Array  # torque at the gear's output, joint friction in it [N m]
    torque: Array  # electromagnetic [N m]
    # of falling friction above its straight lines [N m]
    joint_excess: Array
    loss_excess: Array
    shaft_excess: Array
    drag: Array  # of the gear, at its input [N m]
    powers: Powers  # for the drag
    starting: Array  # magnitude of the torque at rest, what starts the joint included [N m]
    friction_loss: Array  # power lost in the motor's housing at its shaft, in a brake's coil and in an amplifier [W]
    # in mesh and seals, and of the drag as at 20 C [W]
    mesh_loss: Array
    drag_loss: Array
    stop: Array  # torque at the gear's output where a stop at a current limit begins [N m]
    power: Array  # electrical, and the least, where nobody asks for them [W], (2, N)
    losses: Losses  # for the temperatures, which it takes
    parts: Any  # their states, one a part of the periods


class Work(NamedTuple):
    """What one joint asks of any drive, and the memory of its judgement."""

    motion: Motion  # series
    # what it carries, and what amounts add
    load: Load
    added: Added
    # memory
    sum: Load
    traces: Traces
    stopping: Stopping  # stops on a ramp
    few: Work | None = None  # the same at some samples that ask much, for a first look; None of these themselves


def work_of(demand: JointDemand, added: Added | None = None, *, first_look: bool = True) -> Work:
    """The work of a joint; a ``first_look`` is for judging many drives."""
    motion, load, stop, parts = motion_of(demand), load_of(demand), demand.stop, len(demand.cycle.parts)
    stopping = stopping_of(_row(stop.speed), _row(stop.acceleration), _row(stop.carrier_acceleration))
    memory = Load(*(row.copy() for row in load)), new_traces(len(demand.time), parts)
    work = Work(motion, load, nothing_added(load) if added is None else added, *memory, stopping)
    return work._replace(few=_at_sharp(work, _sharp(demand))) if first_look else work


def _at_sharp(work: Work, pick: Array) -> Work:
    """The work at the samples that ask much, as far as peaks need it."""
    motion, load, added = work.motion, work.load, work.added
    periods = motion.periods._replace(step=np.zeros(len(pick)))
    rows = {name: np.ascontiguousarray(getattr(motion, name)[pick]) for name in motion._fields[:-2]}
    some = motion._replace(rests=motion.rests[:0], periods=periods, **rows)
    none, count = np.zeros(0), len(added.torque)
    nothing = (np.zeros((6, 0)), none, none, none)
    torque = np.ascontiguousarray(added.torque[:, pick])
    return Work(
        some, Load(np.ascontiguousarray(load.torque[pick]), *nothing),
        Added(torque, *(np.zeros((count, *values.shape)) for values in nothing)), Load(np.zeros(len(pick)), *nothing),
        new_traces(len(pick), len(work.traces.parts)), stopping_of(none, none, none),
    )  # fmt: skip


def new_traces(samples: int, parts: int) -> Traces:
    """Empty memory."""
    load, joint, loss, shaft, drag, starting, friction, gear, turning, stop = np.zeros((10, samples))
    power = np.zeros((2, samples))
    return Traces(
        load, np.zeros(samples + 2), joint, loss, shaft, drag, new_powers(samples), starting, friction, gear, turning,
        stop, power, new_losses(samples), new_parts(parts),
    )  # fmt: skip


def motion_of(demand: JointDemand) -> Motion:
    """The series of a joint that no drive changes; all of one layout, as each other is compiled anew, and slower."""
    cycle, at_rest = demand.cycle, demand.at_rest
    slow = loss_speed(demand.speed, demand.acceleration, at_rest, parts=cycle.parts)
    edges = np.flatnonzero(np.diff(at_rest.astype(np.int8), prepend=0, append=0)).astype(np.int64).reshape(-1, 2)
    weight = demand.weights if demand.weights.sum() > 0.0 else np.full(len(slow), 1.0 / len(slow))
    before, at, after = rates(demand)
    periods = periods_of(cycle.time, cycle.parts, cycle.shares)
    return Motion(
        _row(demand.speed), _row(demand.acceleration), _row(demand.carrier_acceleration), _row(slow), _row(weight),
        _row(before), _row(at), _row(after), _row(slow[cycle.after]),
        one_phase(at_rest, periods), edges, periods,
    )  # fmt: skip


def one_phase(at_rest: Array, periods: Periods) -> Array:
    """The current that heats one phase over the RMS of all, at every sample.

    Turning, every phase carries the amplitude for an instant; at rest one of them may carry it all the time, sqrt(2)
    times its RMS, and the same one in every round of the cycle. Brushed motors, whose brushes then load the same bars,
    are counted alike.
    """
    step, first = periods.step, periods.edges[:-1]
    still = step * at_rest * np.roll(at_rest, -1)
    alone = first[np.diff(periods.edges) == 1]
    still[alone] = step[alone] * at_rest[alone]
    before, rested = np.roll(step, 1), np.roll(still, 1)
    before[first], rested[first] = 0.0, 0.0
    whole = step + before
    return np.sqrt(1.0 + np.divide(still + rested, whole, out=np.zeros_like(whole), where=whole > 0.0))


def load_of(demand: JointDemand) -> Load:
    """What a joint carries."""
    wrench = np.zeros((6, 0)) if demand.wrench is None else np.array(demand.wrench.T, order="C")
    inertia, static = (np.zeros(0) if row is None else _row(row) for row in (demand.load_inertia, demand.static_torque))
    return Load(_row(demand.gear_torque), wrench, inertia, _row(demand.stop.torque), static)


def added_by(work: Workload, joint: int, drives: Sequence[int]) -> Added:
    """What a unit of each number of some drives of a joint's basis adds, NUMBERS rows a drive, in their order."""
    every = work.basis[joint].drives
    first = every.index(drives[0]) if drives else 0
    rows: Any = slice(NUMBERS * first, NUMBERS * (first + len(drives)))
    if every[first : first + len(drives)] != tuple(drives):  # which takes a copy
        rows = np.concatenate([np.r_[work.basis[joint].rows(drive)] for drive in drives])
    return Added(*(series[rows] for series in _by_drives(work, joint)))


def loads_by(work: Workload, joint: int, drive: int) -> bool:
    """Whether any number of a drive changes what a joint carries."""
    return any(series[work.basis[joint].rows(drive)].any() for series in _by_drives(work, joint))


def _by_drives(work: Workload, joint: int) -> Added:
    """What a unit of each number of every drive in a joint's basis adds; empty where unasked."""
    basis, task = work.basis[joint], work.study.joints[joint]
    nothing = np.zeros((len(basis.force), 0))
    stop = nothing if task.stop.ramp is None or work.stops is None else work.stops.joints[joint].force
    return Added(basis.force, basis.wrench, basis.inertia, stop, work.resting[joint].force if task.brakes else nothing)


def rates(demand: JointDemand) -> tuple[Array, Array, Array]:
    """Rate of change within smooth stretches, as factors on the sample before, itself and the one after [1/s].

    Where two samples share an instant, where the direction of motion changes (friction and mesh loss step there) and
    where the payload changes, the model's current steps; a real one needs some electrical time constants for it,
    which no voltage of the model tells. There the slope of the nearer side is taken.
    """
    steps = np.diff(demand.time)
    way = np.where(demand.at_rest, 0.0, np.sign(demand.speed))
    smooth = (steps > 0.0) & (way[1:] == way[:-1]) & (demand.payload[1:] == demand.payload[:-1])
    smooth[[part.start - 1 for part in demand.cycle.parts[1:]]] = False
    slope = np.where(smooth, 1.0 / np.where(smooth, steps, 1.0), 0.0)
    ahead, behind = np.append(slope, 0.0), np.concatenate([[0.0], slope])
    sides = np.maximum((ahead > 0.0).astype(float) + (behind > 0.0), 1.0)
    return -behind / sides, (behind - ahead) / sides, ahead / sides


def _sharp(demand: JointDemand) -> Any:
    """In each stretch the samples of largest acceleration and of largest torque."""
    parts = [part for part in np.array_split(np.arange(len(demand.time)), STRETCHES) if len(part)]
    series = (np.abs(demand.acceleration), np.abs(demand.gear_torque))
    return np.unique([part[np.argmax(row[part])] for part in parts for row in series])


def _row(values: Array) -> Array:
    return np.array(values, dtype=np.float64, order="C")
