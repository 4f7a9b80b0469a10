"""A set of drives at its work as plain arrays, for the compiled judge of many arms."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import available_voltage
from drivetrain.drive.drive import drive_inertia, loss_speed, shaft_friction
from drivetrain.drive.friction import Friction, breakaway_torque, friction_torque
from drivetrain.drive.gear import torque_exponent
from drivetrain.drive.motor import copper_coefficient
from drivetrain.drive.motor_limits import thermal_resistances
from drivetrain.drive.thermal_network import thermal_network
from drivetrain.sizing.demand.demand import JointDemand
from drivetrain.sizing.judge.check_numbers import NAMES
from drivetrain.sizing.judge.evaluate import evaluated, given_drives
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.operation import Operation, operation
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance import scatter_numbers as k
from drivetrain.sizing.tolerance.lanes import WIDTH
from drivetrain.sizing.tolerance.scatter import Draws, Pair
from drivetrain.sizing.tolerance.scatter_blocks import (
    NO_HEAT,
    ONE_NODE,
    STEADY_HEAT,
    TWO_NODES,
    blocks_of,
    loss_moments,
)
from drivetrain.sizing.tolerance.scatter_ground import Ground, bearing_rows, ground, loads_scatter
from drivetrain.study.model import Study

Indices = NDArray[np.int64]
ROUNDING = 1e-9  # of the largest value: peaks that near may be exchanged by rounding


@dataclass(frozen=True, eq=False)
class Bench:
    """A set of drives at its work, ready for many arms.

    Attributes:
        study: The nominal task.
        drives: Keys of (motor, gear) by joint name.
        nominal: Results by joint name, and checks of the supply, with nominal numbers.
        slow: Why only ``evaluate`` can judge it; empty: compiled code can.
        task: For compiled code.
        wrench: Loads on each output bearing: two of the tilting moment, axial, two radial, then what the payloads add,
            (n, 5, 1 + P, N).
        inertia: Of load over rotor and limit, then what the payloads add, (n, 1 + P, N).
    """

    study: Study
    drives: Mapping[str, Pair]
    nominal: Evaluation
    slow: str
    task: k.ScatterTask
    wrench: Array
    inertia: Array

    def memory(self) -> k.Memory:
        """What one run writes into."""
        samples, parts = len(self.task.weight), len(self.task.share)
        rows = (
            k.ROWS, self.task.payload.shape[1], samples, samples, samples, 4 * self.task.loss.shape[1],
            k.HEAT_ROWS * parts, 4 * parts, k.CHECKS,
        )  # fmt: skip
        return k.Memory(*(np.zeros((count, WIDTH)) for count in rows))


def bench(study: Study, drives: Mapping[str, Pair], *, on: Ground | None = None) -> Bench:
    """A set of drives made ready for many arms.

    Args:
        drives: Keys of (motor, gear) by joint name.
    """
    base = ground(study) if on is None else on
    nominal, shelf = evaluated(base.work, given_drives(study, drives)), Shelf(study)
    mounted = {i: shelf.drive(task, *drives[task.name]) for i, task in enumerate(study.joints)}
    ops = [
        operation(study, i, base.work.at(i, mounted).demand(mounted[i]), mounted[i]) for i in range(len(study.joints))
    ]
    numbers, series = np.array([_numbers(op) for op in ops]), np.array([_series(op) for op in ops])
    cycle, supply, added = study.cycle, study.supply, base.added
    blocks = blocks_of(cycle.time, cycle.parts, [_fastest(row) for row in numbers])
    known = all(result.torque_known for result in nominal.joints.values())
    limits = (supply.peak_power, supply.mean_power, supply.regenerated_power) if known else (None, None, None)
    task = k.ScatterTask(
        series=series,
        numbers=numbers,
        weight=cycle.weights / cycle.weights.sum(),
        share=np.array(cycle.shares, dtype=np.float64),
        blocks=blocks,
        loss=np.array([loss_moments(blocks, i, motion[k.LOSS]) for i, motion in enumerate(series)]),
        payload=added.force,
        bearing=np.zeros((len(ops), 5, 1 + added.force.shape[1], 0)),
        inertia=np.zeros((len(ops), 1 + added.force.shape[1], 0)),
        counts=np.zeros((len(ops), 2), dtype=np.int64),
        bearing_limits=np.array([_bearing_limits(op) for op in ops]),
        fixed=_fixed(nominal, loads_scatter(study)),
        made=_made(nominal),
        supply=np.array([math.nan if limit is None else limit for limit in limits]),
    )
    wrench = np.array([_with_added(bearing_rows(op.demand.wrench), added.wrench[i]) for i, op in enumerate(ops)])
    inertia = np.array([_inertia(op, added.inertia[i]) for i, op in enumerate(ops)])
    return Bench(study, drives, nominal, _slow(study, ops), task, wrench, inertia)


def aimed(ready: Bench, draws: Draws) -> k.ScatterTask:
    """The task with the samples at which bearing loads can be largest for some arms."""
    if not loads_scatter(ready.study):
        return ready.task
    reach = np.abs(draws.payload - 1.0).max(axis=0, initial=0.0)
    wrench, bearings = _kept(ready.wrench, reach)
    inertia, masses = _kept(ready.inertia[:, np.newaxis], reach)
    counts = np.array([bearings, [0 if not one.any() else count for one, count in zip(inertia, masses, strict=True)]]).T
    return ready.task._replace(bearing=wrench, inertia=inertia[:, 0], counts=np.ascontiguousarray(counts))


def _kept(parts: Array, reach: Array) -> tuple[Array, list[int]]:
    """The samples at which one of some loads can be largest, first of each row; parts (n, C, 1 + P, N)."""
    kept = []
    groups = ([0, 1], [2], [3, 4]) if parts.shape[1] == 5 else ([0],)
    for own in parts:
        places: set[int] = set()
        for group in groups:
            norms = np.linalg.norm(own[group], axis=0)
            change = reach @ norms[1:]
            found = possible_peaks(np.maximum(norms[0] - change, 0.0), norms[0] + change)
            places |= set(found.tolist())
        kept.append(sorted(places))
    most = max(len(places) for places in kept)
    rows = [own[:, :, np.resize(places, most)] for own, places in zip(parts, kept, strict=True)]
    return np.ascontiguousarray(np.array(rows)), [len(places) for places in kept]


def possible_peaks(low: Array, high: Array) -> Indices:
    """The samples at which the largest of some magnitudes can be.

    Args:
        low, high: Between which each magnitude lies, any unit, (N,).
    """
    most = float(np.max(low))
    return np.flatnonzero(high >= most * (1.0 - ROUNDING)).astype(np.int64)


def _with_added(own: Array, added: Array) -> Array:
    return np.concatenate([np.broadcast_to(own[:, np.newaxis], (5, 1, added.shape[2])), added], axis=1)


def _inertia(op: Operation, added: Array) -> Array:
    """Load over rotor over limit; zeros where it is not judged."""
    own, limit = op.demand.load_inertia, op.safety.inertia_ratio
    if own is None or limit is None or op.drive.motor.rotor_inertia is None:
        return np.zeros((1 + len(added), len(op.demand.time)))
    return np.concatenate([own[np.newaxis], added]) / (op.drive.gear.ratio**2 * drive_inertia(op.drive) * limit)


def _bearing_limits(op: Operation) -> list[float]:
    gear = op.drive.gear
    limits = (gear.tilting_moment_limit, gear.axial_load_limit, gear.radial_load_limit)
    unknown = op.demand.bearing is None
    return [math.nan if limit is None or unknown else limit / op.safety.peak_torque for limit in limits]


_SCATTERING = {
    k.REPEATED_PEAK, k.MOMENTARY_PEAK, k.AVERAGE_TORQUE, k.LIFE, k.MOTOR_TORQUE, k.MOTOR_CURRENT, k.AMPLIFIER_CURRENT,
    k.VOLTAGE, k.RMS_CURRENT, k.TEMPERATURE, k.AMPLIFIER_RMS,
}  # fmt: skip


def _fixed(nominal: Evaluation, payload: bool) -> Array:
    """Utilisations of checks that do not scatter."""
    scattering = _SCATTERING | ({k.TILTING, k.AXIAL, k.RADIAL, k.INERTIA} if payload else set())
    found = np.full((len(nominal.joints), k.CHECKS), math.nan)
    for joint, result in enumerate(nominal.joints.values()):
        for check in result.checks:
            at = NAMES.index(check.name)
            if at not in scattering and check.utilisation is not None:
                found[joint, at] = check.utilisation
    return found


def _made(nominal: Evaluation) -> Array:
    """1, and NaN for the checks that lack data of a drive whose torque cannot be computed."""
    found = np.ones((len(nominal.joints), k.CHECKS))
    for row, result in zip(found, nominal.joints.values(), strict=True):
        if not result.torque_known:
            made = {check.name for check in result.checks if check.utilisation is not None}
            row[[name not in made for name in NAMES]] = math.nan
    return found


def _slow(study: Study, ops: list[Operation]) -> str:
    """Why compiled code cannot judge a set of drives."""
    instant = any(one.stop - one.start < 2 for one in study.cycle.parts)
    return "a task of one instant has no heat in blocks" if instant else ""


def _fastest(row: Array) -> float:
    """Sum of the rates of heat flow that the blocks must follow [1/s]."""
    inner, outer, winding = row[k.INNER], row[k.OUTER], row[k.WINDING_CAPACITY]
    if row[k.KIND] == ONE_NODE:
        return float(1.0 / (outer * winding))
    if row[k.KIND] != TWO_NODES:
        return 0.0
    housing = row[k.HOUSING_CAPACITY]
    slow = 0.0 if math.isnan(housing) else (1.0 / inner + 1.0 / outer) / housing
    return float(1.0 / (inner * winding) + slow)


def _series(op: Operation) -> Array:
    """Rows of one joint."""
    demand, drive, cycle = op.demand, op.drive, op.demand.cycle
    slow = loss_speed(demand.speed, demand.acceleration, demand.at_rest, parts=cycle.parts)
    ratio, shaft = drive.gear.ratio, shaft_friction(drive)
    running = (drive.gear.no_load_torque or 0.0) * np.sign(ratio * slow)
    rubbing = friction_torque(shaft, op.motor_speed) * op.motor_speed
    travel = np.abs(demand.speed) * demand.weights
    return np.array([
        demand.gear_torque, friction_torque(demand.friction, demand.speed), friction_torque(drive.joint_friction, slow),
        np.sign(slow), drive_inertia(drive) * (ratio * demand.acceleration + demand.carrier_acceleration),
        friction_torque(shaft, ratio * slow) + running, op.motor_speed, travel / (travel.sum() or 1.0),
        *_rate_factors(demand), np.append(0.5 * (rubbing[1:] + rubbing[:-1]), 0.0), demand.at_rest.astype(float),
        np.sign(slow[cycle.after]),
    ])  # fmt: skip


def _rate_factors(demand: JointDemand) -> tuple[Array, Array, Array]:
    """``current_rate`` as factors on the sample before, itself and after: what it makes of unit currents."""
    steps = np.diff(demand.time)
    way = np.where(demand.at_rest, 0.0, np.sign(demand.speed))
    smooth = (steps > 0.0) & (way[1:] == way[:-1]) & (demand.payload[1:] == demand.payload[:-1])
    slope = np.where(smooth, 1.0 / np.where(smooth, steps, 1.0), 0.0)
    ahead, behind = np.append(slope, 0.0), np.concatenate([[0.0], slope])
    sides = np.maximum((ahead > 0.0).astype(float) + (behind > 0.0), 1.0)
    return -behind / sides, (behind - ahead) / sides, ahead / sides


def _numbers(op: Operation) -> list[float]:
    """Numbers of one joint, in the order of the columns."""
    motor, gear, safety = op.drive.motor, op.drive.gear, op.safety
    network = thermal_network(motor, op.ambient, housing_to_ambient=op.task.housing_to_ambient)
    inner, outer, winding, housing, kind = (math.nan,) * 4 + (float(NO_HEAT),)
    if network is not None:
        inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
        winding, housing = _or_nan(network.winding_capacity), _or_nan(network.housing_capacity)
        kind = float(STEADY_HEAT if math.isnan(winding) else ONE_NODE if inner == 0.0 else TWO_NODES)
    friction, shaft = op.task.friction, shaft_friction(op.drive)
    ideal = gear.kind == "ideal"
    stall, direct = _stall(op), gear.key == ""
    running = gear.no_load_torque or 0.0
    rated = gear.continuous_torque
    life = 0.0
    if None not in (safety.life, gear.rated_life, gear.rated_speed, rated):
        life = _or_nan(safety.life) * abs(gear.ratio) * op.demand.mean_speed / (
            _or_nan(gear.rated_speed) * _or_nan(gear.rated_life)
        )  # fmt: skip
    else:
        life = math.nan
    repeated = gear.repeated_peak_torque if gear.repeated_peak_torque is not None else rated
    average = gear.average_torque_limit if gear.average_torque_limit is not None else rated
    nothing = math.nan
    return [
        gear.ratio, _efficiency(op), _or_nan(gear.backdriving_efficiency), float(ideal), running,
        _or_nan(rated) if running else nothing if rated is None else rated, motor.torque_constant, motor.resistance,
        copper_coefficient(motor.reference_temperature), motor.reference_temperature, motor.magnet_coefficient,
        motor.inductance or 0.0, inner, outer, winding, housing, kind, _or_nan(motor.max_winding_temperature),
        safety.temperature_margin, _printed(op), float(op.demand.moves),
        _loose(friction, 1.0), _loose(friction, -1.0),
        _loose(shaft, 1.0) + running, _loose(shaft, -1.0) + running, nothing if direct else _or_nan(repeated),
        nothing if direct else _or_nan(gear.momentary_torque), nothing if direct else _or_nan(average),
        torque_exponent(gear), nothing if direct else life, *stall,
        available_voltage(op.task.amplifier, op.supply.voltage), _or_nan(op.task.amplifier.peak_current),
        _or_nan(op.task.amplifier.continuous_current), safety.peak_torque, safety.rms, safety.voltage,
    ]  # fmt: skip


def _loose(law: Friction, way: float) -> float:
    return abs(float(breakaway_torque(law, np.array(way))))


def _efficiency(op: Operation) -> float:
    given = op.computed.gear.efficiency
    return 1.0 if given is None else given


def _stall(op: Operation) -> tuple[float, float, float]:
    """Printed short-time torque, printed peak current, voltage at which a blocked motor makes the limit."""
    motor = op.drive.motor
    current = _or_nan(motor.peak_current)
    if motor.peak_torque is not None:
        return motor.peak_torque, current, math.nan
    if motor.peak_current is not None:
        return math.nan, current, math.nan
    return _or_nan(motor.stall_torque), math.nan, _or_nan(motor.nominal_voltage)


def _printed(op: Operation) -> float:
    """The sheet's continuous current at 25 C, in this mounting [A]."""
    motor, mounting = op.drive.motor, op.task.housing_to_ambient
    current = motor.nominal_current
    if current is None and motor.nominal_torque is not None:
        current = motor.nominal_torque / motor.torque_constant
    if current is None:
        return math.nan
    sheet, mounted = thermal_resistances(motor), thermal_resistances(motor, mounting)
    if mounting is not None and sheet is not None and mounted is not None:
        current *= math.sqrt(sum(sheet) / sum(mounted))
    return current


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
