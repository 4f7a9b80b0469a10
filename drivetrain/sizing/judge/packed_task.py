"""A study packed into plain arrays, as the compiled judge and the compiled search take it.

Everything that does not depend on the choice of drives is computed here once: the basis of every joint, its motion,
the catalogue rows, and the numbers through which each pair of motor and gear loads the joints before it. No object is
made for a pair.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import available_voltage
from drivetrain.drive.drive import Drive, loss_speed
from drivetrain.drive.friction import Friction, breakaway_torque, friction_torque
from drivetrain.drive.gear import Gear
from drivetrain.drive.heat_state import steady_state
from drivetrain.drive.motor import Motor
from drivetrain.sizing.demand.demand import JointDemand, Workload, workload
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.fill import DIRECT, Shelf
from drivetrain.sizing.judge.packed_rows import (
    AXIAL,
    EXPONENT,
    GEAR_COLUMNS,
    MOTOR_COLUMNS,
    RADIAL,
    TILTING,
    gear_row,
    motor_row,
    rows,
)
from drivetrain.study.model import DriveMass, JointTask, Study
from drivetrain.study.mounting import cylinder_inertia

Indices = NDArray[np.int64]

# Rows of a joint's series, each (N,).
(
    SPEED, ACCELERATION, CARRIER, LOSS_SPEED, WAY, FRICTION, LOSS_FRICTION, AT_REST, NEXT_WAY, WEIGHT,
    RATE_BEFORE, RATE_AT, RATE_AFTER, STEP, STEP_SHARE, SERIES,
) = range(16)  # fmt: skip

# Numbers of a joint.
(
    PEAK_FACTOR, RMS_FACTOR, SPEED_FACTOR, VOLTAGE_FACTOR, TEMPERATURE_MARGIN, RATIO_LIMIT, LIFE, AMBIENT, VOLTS,
    AMPLIFIER_PEAK, AMPLIFIER_CONTINUOUS, TRAVEL, MOVES, FASTEST, MEAN_SPEED, BREAK_FORWARD, BREAK_BACK, BEARING,
    INERTIA, CURVED, DURATION, STEP_SPEED, STEP_SQUARE, TASK,
) = range(24)  # fmt: skip

INSTANTS = 16  # that a first look takes
NOBODY = Drive(Motor("", 1.0, 1.0), DIRECT)  # weighs nothing and turns nothing


class PackedTask(NamedTuple):
    """A study for compiled code; n joints, N samples, R rows of all bases, P pairs of all joints.

    Attributes:
        series: Motion at the gear's output and what follows from it alone, rows as above, SI, (n, SERIES, N).
        tasks: Limits and factors of each joint, columns as above, SI, (n, TASK).
        bare: Torque at the gear's output without drives [N m], (n, N).
        force: What a unit of each number of a drive adds to it, (R, N).
        bare_inertia: At the gear's output [kg m^2], (n, N).
        inertia: What a unit of each number adds, (R, N).
        bare_wrench: Moment [N m] and force [N] in the joint frame, (n, 6, N); zeros where no bearing is judged.
        wrench: What a unit of each number adds, (6, R, N).
        offsets: First of the rows of ``force``, ``inertia`` and ``wrench`` that hold what the drive of joint k does to
            joint j, -1 for nothing, (n, n).
        motors: Rows of ``packed_rows``, one table a joint, (n, motors, MOTOR_COLUMNS).
        gears: Rows of ``packed_rows``; the first is that of a direct drive, (gears, GEAR_COLUMNS).
        exponents: Those with which torque wears the gears, (E,).
        exponent_of: Index of each gear's exponent, (gears,).
        first: Pairs of joint j are ``first[j]`` to ``first[j + 1]``, (n + 1,).
        pairs: Row of the motor and of the gear of each pair, (P, 2).
        numbers: Through which each pair loads the joints before it, the units of ``drive_numbers``, (P, NUMBERS).
        rests: Samples at which each joint is at rest, -1 after the last, (n, N).
        mix: How many samples, how many parts of a mix, first sample of each, how many samples, (parts + 3,).
        shares: Of the parts in the time of use, (parts,).
        heat: Address of ``heat_state.steady_state``.
        sharp: The sample of largest acceleration in each of INSTANTS stretches of the cycle, (n, INSTANTS).
    """

    series: Array
    tasks: Array
    bare: Array
    force: Array
    bare_inertia: Array
    inertia: Array
    bare_wrench: Array
    wrench: Array
    offsets: Indices
    motors: Array
    gears: Array
    exponents: Array
    exponent_of: Indices
    first: Indices
    pairs: Indices
    numbers: Array
    rests: Indices
    mix: Indices
    shares: Array
    heat: int
    sharp: Indices


def empty_task() -> PackedTask:
    """A task of one joint and two samples with nothing in it, which tells compilers what kind of arrays there are."""
    whole = {"offsets": 2, "exponent_of": 1, "first": 1, "pairs": 2, "rests": 2, "mix": 1, "sharp": 2}
    real = {"series": 3, "bare_wrench": 3, "wrench": 3, "motors": 3, "exponents": 1, "shares": 1}
    arrays: dict[str, Any] = {name: np.zeros((1,) * whole[name], dtype=np.int64) for name in whole}
    arrays |= {name: np.zeros((1,) * real.get(name, 2)) for name in PackedTask._fields if name not in (*whole, "heat")}
    return PackedTask(heat=0, **arrays)


@dataclass(frozen=True, eq=False)
class Packed:
    """A packed study with the names that compiled code does not need.

    Attributes:
        study: The task.
        work: Its joints' work, as the Python road takes it.
        task: For compiled code.
        motors, gears: Catalogue keys by row.
        mass: Of each pair [kg], NaN where unknown, (P,).
        price: Of each pair, NaN where unknown, (P,).
        power_known: Whether every given drive's power is known, as far as it is to be held against the supply.
    """

    study: Study
    work: Workload
    task: PackedTask
    motors: tuple[str, ...]
    gears: tuple[str, ...]
    mass: Array
    price: Array
    power_known: bool = True

    def keys(self, pair: int) -> tuple[str, str]:
        """The catalogue keys of a pair."""
        motor, gear = self.task.pairs[pair]
        return self.motors[motor], self.gears[gear]


def pack(study: Study, work: Workload | None = None) -> Packed:
    """A study as plain arrays."""
    work = workload(study) if work is None else work
    shelf = Shelf(study)
    motor_keys, gear_keys, first, pairs = _pairs(study)
    motors, gears = [shelf.motor(key) for key in motor_keys], [shelf.gear(key) for key in gear_keys]
    gear_table = rows([gear_row(gear) for gear in gears], GEAR_COLUMNS)
    exponents, exponent_of = np.unique(gear_table[:, EXPONENT], return_inverse=True)
    numbers, mass, price = _pair_numbers(study, motors, gears, first, pairs)
    demands = [work.at(joint, {}).demand(NOBODY) for joint in range(len(study.joints))]
    offsets, force, inertia, wrench = _bases(work, gear_table, first, pairs)
    task = PackedTask(
        series=np.array([_series(study, demand) for demand in demands]),
        tasks=np.array([_task(study, one, demand) for one, demand in zip(study.joints, demands, strict=True)]),
        bare=np.array([demand.gear_torque for demand in demands]),
        force=force,
        bare_inertia=np.array([_or_zeros(demand.load_inertia, demand.speed) for demand in demands]),
        inertia=inertia,
        bare_wrench=np.array([_wrench(demand) for demand in demands]),
        wrench=wrench,
        offsets=offsets,
        motors=_motor_tables(study, motors),
        gears=gear_table,
        exponents=exponents,
        exponent_of=exponent_of.reshape(-1),
        first=first,
        pairs=pairs,
        numbers=numbers,
        rests=np.array([_rests(demand) for demand in demands]),
        mix=_mix(study),
        shares=np.array(study.cycle.shares, dtype=np.float64),
        heat=int(steady_state().address or 0),
        sharp=np.array([_sharp(demand) for demand in demands]),
    )
    return Packed(study, work, task, motor_keys, gear_keys, mass, price)


def _pairs(study: Study) -> tuple[tuple[str, ...], tuple[str, ...], Indices, Indices]:
    """Keys of the motors and gears that occur, and of all joints' pairs the rows; the direct drive comes first."""
    lists = [task.pairs if task.drive is None else (task.drive,) for task in study.joints]
    motors = tuple(dict.fromkeys(motor for one in _different(lists) for motor, _ in one))
    gears = tuple(dict.fromkeys(["", *(gear for one in _different(lists) for _, gear in one)]))
    motor_row_of = {key: row for row, key in enumerate(motors)}
    gear_row_of = {key: row for row, key in enumerate(gears)}
    known: dict[int, Indices] = {}
    for one in lists:
        if id(one) not in known:
            left = np.fromiter((motor_row_of[motor] for motor, _ in one), np.int64, len(one))
            right = np.fromiter((gear_row_of[gear] for _, gear in one), np.int64, len(one))
            order = np.sort(np.unique(left * len(gears) + right, return_index=True)[1])
            known[id(one)] = np.stack([left[order], right[order]], axis=1)
    parts = [known[id(one)] for one in lists]
    first = np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)
    return motors, gears, first, np.concatenate(parts) if parts else np.zeros((0, 2), dtype=np.int64)


def _different(lists: list[tuple[tuple[str, str], ...]]) -> list[tuple[tuple[str, str], ...]]:
    """Each list of pairs once, as joints often share one."""
    return list({id(one): one for one in lists}.values())


def _pair_numbers(
    study: Study, motors: list[Motor], gears: list[Gear], first: Indices, pairs: Indices
) -> tuple[Array, Array, Array]:
    """``drive_numbers`` of all pairs at once, with mass and price of each."""
    left, right = pairs[:, 0], pairs[:, 1]
    bodies = [np.array([_body(part) for part in parts]).reshape(-1, 3) for parts in (motors, gears)]
    mass, across, along = (bodies[0][left] + bodies[1][right]).T
    rotor = np.array([motor.rotor_inertia or 0.0 for motor in motors])[left]
    spinning = rotor + np.array([gear.inertia or 0.0 for gear in gears])[right]
    travel = np.repeat([task.travel_per_turn or 1.0 for task in study.joints], np.diff(first))
    ratio = np.array([gear.ratio for gear in gears])[right] / travel
    if study.drive_mass is DriveMass.INCLUDED:
        moved = [np.zeros(len(pairs))] * 3
    else:
        moved = [mass, across, along - np.minimum(rotor, along)]
    weighed = [0.0 if gear.kind == "ideal" and gear.mass is None else gear.mass for gear in gears]
    priced = [0.0 if gear.key == "" else gear.price for gear in gears]
    return (
        np.ascontiguousarray(np.stack([*moved, spinning, spinning * ratio], axis=1)).reshape(-1, NUMBERS),
        _known([motor.mass for motor in motors])[left] + _known(weighed)[right],
        _known([motor.price for motor in motors])[left] + _known(priced)[right],
    )


def _body(part: Motor | Gear) -> tuple[float, float, float]:
    """Mass, inertia across and along the axis; of an unknown mass nothing."""
    return part.mass or 0.0, *cylinder_inertia(part.mass, part.diameter, part.length)


def _known(values: list[float | None]) -> Array:
    return np.array([math.nan if value is None else value for value in values])


def _motor_tables(study: Study, motors: list[Motor]) -> Array:
    """One table a joint; joints with the same mounting share the work."""
    tables: dict[tuple[float | None, Friction | None], Array] = {}
    for task in study.joints:
        mounting = (task.housing_to_ambient, task.motor_friction)
        if mounting not in tables:
            tables[mounting] = rows([motor_row(motor, study.ambient, *mounting) for motor in motors], MOTOR_COLUMNS)
    return np.array([tables[task.housing_to_ambient, task.motor_friction] for task in study.joints])


def _series(study: Study, demand: JointDemand) -> Array:
    cycle = study.cycle
    slow = loss_speed(demand.speed, demand.acceleration, demand.at_rest, parts=cycle.parts)
    before, at, after = _rates(study, demand)
    steps, step_shares = _steps(study)
    return np.array(
        [
            demand.speed, demand.acceleration, demand.carrier_acceleration, slow, np.sign(slow),
            friction_torque(demand.friction, demand.speed), friction_torque(demand.friction, slow),
            demand.at_rest.astype(float), np.sign(slow[cycle.after]), demand.weights, before, at, after, steps,
            step_shares,
        ]
    )  # fmt: skip


def _steps(study: Study) -> tuple[Array, Array]:
    """From each sample to the next of its part [s], and the share of the time of use that lies between them."""
    cycle = study.cycle
    steps = np.append(np.diff(cycle.time), 0.0)
    steps[[part.stop - 1 for part in cycle.parts]] = 0.0
    shares = np.zeros_like(steps)
    for part, share in zip(cycle.parts, cycle.shares, strict=True):
        length = float(steps[part].sum())
        shares[part] = share * steps[part] / length if length > 0.0 else 0.0
    return steps, shares


def _sharp(demand: JointDemand) -> Indices:
    """Where a rotor asks most; a look at these samples alone rules out most motors that are too weak."""
    magnitude, samples = np.abs(demand.acceleration), len(demand.time)
    edges = np.linspace(0, samples, INSTANTS + 1).astype(np.int64)
    parts = [(a, b) if b > a else (min(a, samples - 1), a + 1) for a, b in itertools.pairwise(edges.tolist())]
    return np.array([a + int(np.argmax(magnitude[a:b])) for a, b in parts], dtype=np.int64)


def _mix(study: Study) -> Indices:
    parts, samples = study.cycle.parts, len(study.cycle.time)
    return np.array([samples, len(parts), *(part.start for part in parts), samples], dtype=np.int64)


def _rests(demand: JointDemand) -> Indices:
    found = np.full(len(demand.time), -1, dtype=np.int64)
    still = np.flatnonzero(demand.at_rest)
    found[: len(still)] = still
    return found


def _rates(study: Study, demand: JointDemand) -> tuple[Array, Array, Array]:
    """``current_rate`` as a sum over the sample before, the sample itself and the one after it [1/s]."""
    steps = np.diff(demand.time)
    way = np.where(demand.at_rest, 0.0, np.sign(demand.speed))
    smooth = (steps > 0.0) & (way[1:] == way[:-1]) & (demand.payload[1:] == demand.payload[:-1])
    for part in study.cycle.parts[1:]:
        smooth[part.start - 1] = False
    slope = np.where(smooth, 1.0 / np.where(smooth, steps, 1.0), 0.0)
    ahead, behind = np.append(slope, 0.0), np.concatenate([[0.0], slope])
    sides = np.maximum((ahead > 0.0).astype(float) + (behind > 0.0), 1.0)
    return -behind / sides, (behind - ahead) / sides, ahead / sides


def _task(study: Study, task: JointTask, demand: JointDemand) -> Array:
    between = _steps(study)[1][:-1]
    speed = np.abs(demand.speed)
    safety, amplifier = study.safety, task.amplifier
    law = task.motor_friction
    curved = law is not None and (
        law.stribeck_speed is not None or law.coulomb_negative is not None or law.viscous_negative is not None
    )
    values: tuple[float | None, ...] = (
        safety.peak_torque, safety.rms, safety.speed, safety.voltage, safety.temperature_margin, safety.inertia_ratio,
        safety.life, study.ambient, available_voltage(amplifier, study.supply.voltage), amplifier.peak_current,
        amplifier.continuous_current, task.travel_per_turn or 1.0, float(demand.moves), demand.fastest.value,
        demand.mean_speed, float(breakaway_torque(task.friction, np.array(1.0))),
        -float(breakaway_torque(task.friction, np.array(-1.0))), float(demand.wrench is not None),
        float(demand.load_inertia is not None), float(curved), float(demand.weights.sum()),
        float(between @ (speed[1:] + speed[:-1])) / 2.0, float(between @ (speed[1:] ** 2 + speed[:-1] ** 2)) / 2.0,
    )  # fmt: skip
    return _known(list(values))


def _bases(work: Workload, gears: Array, first: Indices, pairs: Indices) -> tuple[Indices, Array, Array, Array]:
    """Where each drive's rows on each joint begin, and the rows, at the gear's output."""
    study = work.study
    n, samples = len(study.joints), len(study.cycle.time)
    offsets = np.full((n, n), -1, dtype=np.int64)
    count = sum(len(basis.force) for basis in work.basis)
    force, inertia, wrench = np.zeros((count, samples)), np.zeros((count, samples)), np.zeros((6, count, samples))
    at = 0
    for joint, basis in enumerate(work.basis):
        travel = study.joints[joint].travel_per_turn or 1.0
        block = slice(at, at + len(basis.force))
        for position, k in enumerate(basis.drives):
            offsets[joint, k] = at + NUMBERS * position
        force[block], inertia[block] = travel * basis.force, travel**2 * basis.inertia
        used = gears[np.unique(pairs[first[joint] : first[joint + 1], 1])]
        if not np.isnan(used[:, [TILTING, AXIAL, RADIAL]]).all():
            wrench[:, block] = basis.wrench.reshape(-1, samples, 6).transpose(2, 0, 1)
        at = block.stop
    return offsets, force, inertia, wrench


def _wrench(demand: JointDemand) -> Array:
    if demand.wrench is None:
        return np.zeros((6, len(demand.time)))
    return np.ascontiguousarray(demand.wrench.T)


def _or_zeros(values: Array | None, like: Array) -> Array:
    return np.zeros_like(like) if values is None else values


def chosen_numbers(packed: Packed, chosen: Mapping[int, int]) -> Array:
    """The numbers of chosen pairs, for ``load_joint``.

    Returns:
        (n, NUMBERS), the units of ``drive_numbers``; zeros where nothing is chosen.
    """
    numbers = np.zeros((len(packed.study.joints), NUMBERS))
    for joint, pair in chosen.items():
        numbers[joint] = packed.task.numbers[pair]
    return numbers
