"""The loads of one joint as arrays for compiled code: its motion, its load, and the load per unit of linear amounts.

The load of a joint is linear in some amounts: the load parameters of drives, or payloads and the force at the tip. It
is kept as the load without them and the load per unit of each, so that one record serves every candidate and every
random sample.
Buffers are allocated once per joint; the judge overwrites them with each candidate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.thermal.periodic_heat import Losses, Periods, new_losses, new_parts, periods_of
from drivetrain.sizing.demand.demand import JointDemand, Workload
from drivetrain.sizing.demand.load_basis import PARAMETERS, rides

# Number of sections of the cycle. A candidate is first screened at the key samples: those of largest acceleration and
# of largest torque of each section. Most infeasible candidates fail there, at a fraction of the cost.
SECTIONS = 16


class Motion(NamedTuple):
    """Motion of a joint, whatever its drive; N samples."""

    # speed and acceleration of the gear's output, acceleration of the stator's link [rad/s], [rad/s^2]
    speed: Array
    acceleration: Array
    carrier_acceleration: Array
    loss_speed: Array  # speed whose direction decides the losses [rad/s]; see ``drive.loss_speed``
    weight: Array  # time that each sample represents in the cycle [s]
    # factors on a series at the sample before, itself and the sample after, whose sum is its rate of change [1/s], (3,
    # N); see ``difference_factors``
    rates: Array
    next_speed: Array  # ``loss_speed`` at the sample after, of which only the sign is used [rad/s]
    phase_ratio: Array  # current of the most loaded phase, relative to the RMS of all; see ``phase_ratio``
    rests: Any  # intervals in which the joint is at rest, first sample and the one after the last, (M, 2)
    # parts of the cycle that each repeat on their own, their shares of the operating time, and the time steps
    periods: Periods


class Load(NamedTuple):
    """Load of a joint at its gear's output, without joint friction; arrays without samples are not needed."""

    torque: Array  # torque [N m], (N,)
    wrench: Array  # moment [N m] and force [N] in the joint frame, (6, N) or (6, 0)
    inertia: Array  # inertia that the output accelerates [kg m^2], (N,) or (0,)
    stop: Array  # torque at the states of stops on a ramp [N m], (M,)
    static: Array  # torque that holds each position at rest [N m], (N,) or (0,)


class UnitLoads(NamedTuple):
    """Load per unit of each of K amounts: load parameters (PARAMETERS for each drive), or payloads and the force."""

    # As in ``Load``, (K, N), (K, 6, N), (K, N), (K, M), (K, N); (0, 0), (0, 6, 0) if K is 0.
    torque: Array
    wrench: Array
    inertia: Array
    stop: Array
    static: Array


def no_unit_loads(load: Load) -> UnitLoads:
    """Unit loads of no amounts at all, for a load."""
    rows = (np.zeros((0, *np.shape(values))) for values in load)
    return UnitLoads(*rows)


class SpeedPowers(NamedTuple):
    """Buffer for a power of the speed in the gear's drag, shared by gears with the same exponent."""

    exponent: Array  # exponent of the stored power, NaN if there is none yet, (1,)
    values: Array  # |w|^exponent, (N,)


def new_speed_powers(samples: int) -> SpeedPowers:
    return SpeedPowers(np.full(1, np.nan), np.zeros(samples))


class RampStops(NamedTuple):
    """Motion of a joint in stops on a ramp, of the gear's output and of the stator's link, and buffers, (M,) each."""

    # Speed and accelerations [rad/s], [rad/s^2].
    speed: Array
    acceleration: Array
    carrier_acceleration: Array
    # Buffers, as in ``Traces``.
    joint_excess: Array
    shaft_excess: Array
    drag: Array
    powers: SpeedPowers


def ramp_stops(speed: Array, acceleration: Array, carrier_acceleration: Array) -> RampStops:
    """Stops on a ramp with buffers of their own."""
    buffers: Any = (*np.zeros((3, len(speed))), new_speed_powers(len(speed)))
    return RampStops(speed, acceleration, carrier_acceleration, *buffers)


class Traces(NamedTuple):
    """Time series that the judge computes, which reports draw, and its other buffers; (N,) each.

    ``torque`` has one more sample, 0, at each end.
    """

    load: Array  # torque at the gear's output, joint friction included [N m]
    gear_load: Array  # its magnitude, with what stages behind the gear add [N m]
    torque: Array  # electromagnetic torque [N m]
    # Friction above the sum of Coulomb and viscous friction [N m], (3, N): of the joint at ``Motion.speed``, of the
    # joint and of the motor's shaft at ``Motion.loss_speed``.
    excess: Array
    drag: Array  # drag torque of the gear, at its input [N m]
    powers: SpeedPowers  # for the drag
    starting: Array  # magnitude of the torque at rest, breakaway of the joint included [N m]
    friction_loss: Array  # power lost in the motor's housing at its shaft, in a brake's coil and in an amplifier [W]
    # Loss in mesh and seals, and of the drag as at 20 C [W].
    mesh_loss: Array
    drag_loss: Array
    stop: Array  # torque at the gear's output in a stop at the current limit that begins at the sample [N m]
    power: Array  # electrical power and its lower bound, if no other array is given for them [W], (2, N)
    losses: Losses  # input of the temperatures
    parts: Any  # thermal states, one for each part of the periods


class JointSeries(NamedTuple):
    """Motion and load of one joint for any drive, and the buffers of its judgement."""

    motion: Motion
    load: Load  # load without the amounts
    unit_loads: UnitLoads  # load per unit of each amount
    # Buffers: load with the amounts of a candidate, and the series computed from it.
    total: Load
    traces: Traces
    stops: RampStops
    at_key_samples: JointSeries | None = None  # the same at the key samples, for screening; None: no screening


def joint_series(demand: JointDemand, unit_loads: UnitLoads | None = None, *, screening: bool = True) -> JointSeries:
    """The series of a joint.

    ``unit_loads``: load per unit of each amount; None: there are no amounts. ``screening``: many candidates will be
    judged, so that screening at key samples saves time.
    """
    motion, load, stop, parts = motion_of(demand), load_of(demand), demand.stop, len(demand.cycle.parts)
    stops = ramp_stops(_row(stop.speed), _row(stop.acceleration), _row(stop.carrier_acceleration))
    buffers = Load(*(row.copy() for row in load)), new_traces(len(demand.time), parts)
    series = JointSeries(motion, load, no_unit_loads(load) if unit_loads is None else unit_loads, *buffers, stops)
    return series._replace(at_key_samples=at_samples(series, _key_samples(demand))) if screening else series


def at_samples(series: JointSeries, samples: Any) -> JointSeries:
    """Motion and torque of a joint at some samples; loads that only the full judgement needs are omitted."""
    motion, load, unit_loads = series.motion, series.load, series.unit_loads
    periods = motion.periods._replace(step=np.zeros(len(samples)))
    rows = {name: getattr(motion, name).take(samples, axis=-1) for name in motion._fields[:-2]}
    chosen = motion._replace(rests=motion.rests[:0], periods=periods, **rows)
    none, count = np.zeros(0), len(unit_loads.torque)
    nothing = (np.zeros((6, 0)), none, none, none)
    torque = np.ascontiguousarray(unit_loads.torque[:, samples])
    return JointSeries(
        chosen, Load(np.ascontiguousarray(load.torque[samples]), *nothing),
        UnitLoads(torque, *(np.zeros((count, *values.shape)) for values in nothing)),
        Load(np.zeros(len(samples)), *nothing), new_traces(len(samples), len(series.traces.parts)),
        ramp_stops(none, none, none),
    )  # fmt: skip


def new_traces(samples: int, parts: int) -> Traces:
    load, at_gear, drag, starting, friction, mesh, turning, stop = np.zeros((8, samples))
    excess, power = np.zeros((3, samples)), np.zeros((2, samples))
    return Traces(
        load, at_gear, np.zeros(samples + 2), excess, drag, new_speed_powers(samples), starting, friction, mesh,
        turning, stop, power, new_losses(samples), new_parts(parts),
    )  # fmt: skip


def motion_of(demand: JointDemand) -> Motion:
    """The motion of a joint; all arrays are contiguous: numba compiles again for other layouts, which are slower."""
    cycle, at_rest, speed = demand.cycle, demand.at_rest, demand.loss_speed
    edges = np.flatnonzero(np.diff(at_rest.astype(np.int8), prepend=0, append=0)).astype(np.int64).reshape(-1, 2)
    weight = demand.weights if demand.weights.sum() > 0.0 else np.full(len(speed), 1.0 / len(speed))
    periods = periods_of(cycle.time, cycle.parts, cycle.shares)
    return Motion(
        _row(demand.speed), _row(demand.acceleration), _row(demand.carrier_acceleration), _row(speed), _row(weight),
        difference_factors(demand), _row(speed[cycle.after]),
        phase_ratio(at_rest, periods), edges, periods,
    )  # fmt: skip


def phase_ratio(at_rest: Array, periods: Periods) -> Array:
    """The current that heats one phase relative to the RMS of all phases, at every sample, (N,).

    While the motor turns, every phase carries the amplitude for an instant only, and all have the same RMS. At rest one
    phase may carry the amplitude all the time, sqrt(2) times the RMS, and the same one in every repetition of the
    cycle. A sample counts as resting by the share of the adjacent intervals that are at rest. Brushed motors, whose
    brushes then load the same bars, are treated alike.
    """
    step, first = periods.step, periods.edges[:-1]
    resting = step * at_rest * np.roll(at_rest, -1)
    alone = first[np.diff(periods.edges) == 1]
    resting[alone] = step[alone] * at_rest[alone]
    before, resting_before = np.roll(step, 1), np.roll(resting, 1)
    before[first], resting_before[first] = 0.0, 0.0
    total = step + before
    share = np.divide(resting + resting_before, total, out=np.zeros_like(total), where=total > 0.0)
    return np.sqrt(1.0 + share)


def load_of(demand: JointDemand) -> Load:
    wrench = np.zeros((6, 0)) if demand.wrench is None else np.array(demand.wrench.T, order="C")
    inertia, static = (np.zeros(0) if row is None else _row(row) for row in (demand.load_inertia, demand.static_torque))
    return Load(_row(demand.gear_torque), wrench, inertia, _row(demand.stop.torque), static)


def unit_loads_of(work: Workload, joint: int, drives: Sequence[int]) -> UnitLoads:
    """Load of a joint per unit of each load parameter of some drives of its basis, in their order, without wrenches."""
    every = work.basis[joint].drives
    first = every.index(drives[0]) if drives else 0
    rows: Any = slice(PARAMETERS * first, PARAMETERS * (first + len(drives)))
    if every[first : first + len(drives)] != tuple(drives):  # not adjacent: makes a copy
        rows = np.concatenate([np.r_[work.basis[joint].rows(drive)] for drive in drives])
    return UnitLoads(*(series[rows] for series in _all_unit_loads(work, joint)))


def is_loaded_by(work: Workload, joint: int, drive: int) -> bool:
    """Whether any load parameter of a drive changes the load of a joint."""
    if work.basis[joint].on_bearing and rides(work.study, joint, drive):
        return True
    return any(series[work.basis[joint].rows(drive)].any() for series in _all_unit_loads(work, joint))


def _all_unit_loads(work: Workload, joint: int) -> UnitLoads:
    """Load of a joint per unit of each load parameter of its basis, without wrenches; arrays not needed are empty."""
    basis, task = work.basis[joint], work.study.joints[joint]
    nothing = np.zeros((len(basis.torque), 0))
    stop = nothing if task.stop.ramp is None or work.stops is None else work.stops.joints[joint].torque
    static = work.resting[joint].torque if task.brakes else nothing
    return UnitLoads(basis.torque, np.zeros((len(basis.torque), 6, 0)), basis.inertia, stop, static)


def difference_factors(demand: JointDemand) -> Array:
    """Factors on the sample before, itself and the one after, whose sum is the rate of change [1/s], (3, N).

    The rate is the mean of the slopes on both sides. Where two samples have the same time, where the direction of
    motion changes (friction and mesh loss step there) and where the payload changes, the current of the model steps;
    a real current takes some electrical time constants for it, which the voltage of the model does not include. There
    the slope of the other side is used.
    """
    steps = np.diff(demand.time)
    direction = np.where(demand.at_rest, 0.0, np.sign(demand.speed))
    smooth = (steps > 0.0) & (direction[1:] == direction[:-1]) & (demand.payload[1:] == demand.payload[:-1])
    smooth[[part.start - 1 for part in demand.cycle.parts[1:]]] = False
    slope = np.where(smooth, 1.0 / np.where(smooth, steps, 1.0), 0.0)
    ahead, behind = np.append(slope, 0.0), np.concatenate([[0.0], slope])
    sides = np.maximum((ahead > 0.0).astype(float) + (behind > 0.0), 1.0)
    return np.stack([-behind, behind - ahead, ahead]) / sides


def _key_samples(demand: JointDemand) -> Any:
    """The samples of largest acceleration and of largest torque of each section of the cycle."""
    sections = [part for part in np.array_split(np.arange(len(demand.time)), SECTIONS) if len(part)]
    series = (np.abs(demand.acceleration), np.abs(demand.gear_torque))
    return np.unique([part[np.argmax(row[part])] for part in sections for row in series])


def _row(values: Array) -> Array:
    return np.array(values, dtype=np.float64, order="C")
