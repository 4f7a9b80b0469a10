"""The candidates of every joint: pairs of motor and gear with the joint's load, ready for bounds and for the judge.

Everything that does not depend on the choice of drives is computed here once: the joint's motion and load without
drives, the load per unit of each drive's load parameters, and the catalogue records. The load parameters of a drive
(PARAMETERS of them: mass, inertia across and along the axis, rotor inertia, rotor inertia times ratio) determine how it
loads other joints, and the loads are linear in them. No Python object is made for a pair.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array, Indices, Mask
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import NO_GEAR, unknown_loss
from drivetrain.records import as_numbers, as_records, copied
from drivetrain.sizing.demand.demand import JointDemand, Workload, workload
from drivetrain.sizing.demand.load_basis import PARAMETERS
from drivetrain.sizing.demand.series import (
    SECTIONS,
    JointSeries,
    Load,
    UnitLoads,
    at_samples,
    is_loaded_by,
    joint_series,
    load_of,
    no_unit_loads,
    unit_loads_of,
)
from drivetrain.sizing.judge.cases import paired, put_amplifier, rests_on_gear
from drivetrain.sizing.judge.checks import table
from drivetrain.sizing.judge.judge import judge_cases
from drivetrain.sizing.judge.objectives import amplifier_price
from drivetrain.sizing.judge.parts import Parts, parts_of
from drivetrain.sizing.search.affine_loads import (
    NO_LOADS,
    AffineLoads,
    affine_loads,
    bearing_loads,
    min_cross,
    min_magnitude,
)
from drivetrain.sizing.search.bounds import (
    BoundData,
    CaseNumbers,
    CurrentStops,
    bound_candidates,
    energy_of_slope,
    fill_key_samples,
    load_interval,
    mean_power_slope,
    section_peaks,
    torque_interval_of,
)
from drivetrain.study.model import JointTask, Study

TABLE = table()


@dataclass(frozen=True, eq=False)
class Judged:
    """Verdicts on candidates of one joint; K of them."""

    cases: Any  # records of ``cases.Case``, (K,)
    utilisation: Array  # largest utilisation of all checks, (K,)
    binding: Indices  # index of that check, -1 for none, (K,)
    missing_check: Indices  # first essential check that could not be made, -1 for none, (K,)
    extra_price: Array  # price of the amplifier above the joint's cheapest one, infinite where unknown, (K,)
    checks: Array  # utilisation of every check, NaN where it was not made, (K, checks); (0, 0) unless requested


@dataclass(frozen=True, eq=False)
class CaseRecords:
    """The records of which the case of a candidate is composed."""

    template: Any  # a case of the joint with any motor and gear, (1,)
    motors: Any  # records of motors, and of the friction of their shafts
    shafts: Any
    gears: Any  # records of gears, and whether there is none (direct drive)
    direct: Array


@dataclass(frozen=True, eq=False)
class JointCandidates:
    """One joint: its load without drives, the influence of the drives on it, and the records of its candidates."""

    work: Workload  # loads of all joints
    joint: int  # index of the joint
    demand: JointDemand  # without drives
    # the demand as arrays for compiled code; its amounts are the load parameters of the joint's own drive, if that
    # is carried by the link that it moves
    series: JointSeries
    loading_joints: tuple[int, ...]  # other joints whose drives load this one
    unit_loads: UnitLoads  # load per unit of each load parameter of each of their drives, without wrenches
    bearing: AffineLoads  # wrench on the output bearing [N m, N], (6, M)
    holding: AffineLoads  # torque that holds a position at rest [N m], (M,)
    ramp_stops: AffineLoads  # torque during stops on a ramp [N m], (M,)
    inertia: AffineLoads  # load inertia at all samples [kg m^2], (N,), where a resonance frequency is required
    # torque, static torque and inertia, (3, M), where stops at the current limit are checked; without the own drive
    current_stops: AffineLoads
    key_series: JointSeries  # buffers for the key samples of the screening
    records: CaseRecords  # the candidates
    bound_data: BoundData  # the candidates and the buffers of the bounds, for compiled code
    acceleration_peaks: Indices  # sample of largest acceleration of each section of the cycle, (SECTIONS,)
    is_fixed: bool  # whether the study fixes the drive, which then stays even if it lacks data
    # Each candidate takes the first feasible one of the task's amplifiers; if there are none, that of the records.
    task: JointTask

    def cases(self, parts: Indices) -> Any:
        """Records of ``cases.Case`` of pairs, (K,); parts: rows of motor and gear, (K, 2)."""
        records, cases, (left, right) = self.records, np.repeat(self.records.template, len(parts)), parts.T
        cases["motor"], cases["shaft"] = records.motors[left], records.shafts[left]
        cases["gear"], cases["direct"] = records.gears[right], records.direct[right]
        return cases

    def own_parameters(self, parameters: Array) -> Array:
        """The load parameters of candidates if they load their own joint, (K, PARAMETERS), else (K, 0)."""
        return np.ascontiguousarray(parameters[:, : len(self.series.unit_loads.torque)])

    def torque_interval(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Interval of the joint's torque without the contribution of its own drive [N m], (N,) each, for ranges of the
        load parameters of all joints' drives, (n, PARAMETERS).

        The interval, and those of the other loads, are also stored in the records for the bounds computed next.
        """
        data, full = self.bound_data, self.bound_data.full
        others = list(self.loading_joints)
        load_interval(data.load, data.unit_torque, low[others], high[others], full.low, full.high, data.half_width)
        found = full.least_loads
        if self.bearing.base.size:
            bottom, top = self.bearing.bounds(low, high)
            tilting, axial, radial = bearing_loads(min_magnitude(bottom, top))
            found[:3] = tilting.max(), axial.max(), radial.max()
            full.bearing_products[:] = tilting**2, radial**2, min_cross(bottom, top)
        for at, loads in ((3, self.holding), (4, self.inertia), (5, self.ramp_stops)):
            if loads.base.size:
                found[at] = loads.min_magnitude(low, high).max()
        if self.current_stops.base.size:
            buffers = self.bound_data.stops
            bottom, top = self.current_stops.bounds(low, high)
            for ends, *interval in zip((buffers.torque, buffers.static, buffers.inertia), bottom, top, strict=True):
                ends[:] = interval
        return full.low, full.high

    def torque_interval_at(self, sample: int, low: Array, high: Array) -> tuple[Array, Array]:
        """Interval of the torque at one sample, joint friction and own drive included [N m], (1,) each."""
        load, unit, own = self.series.load.torque, self.unit_loads.torque, self.series.unit_loads.torque
        drives, friction = (*self.loading_joints, self.joint), self.bound_data.full.friction[sample]
        loads = affine_loads(load[[sample]], np.concatenate([unit[:, [sample]], own[:, [sample]]]), drives)
        bottom, top = loads.bounds(low, high)
        return bottom + friction, top + friction

    def bound(
        self, pairs: Indices, base: Array, cost: Array, exact: Mask, *, until: float, with_energy: bool,
        energy_weight: float = 0.0, cost_limit: float = math.inf, test_all: bool = True,
    ) -> tuple[int, Array, Array, Array]:  # fmt: skip
        """Lower bounds for candidates while the torque lies in the interval; arguments as ``bound_candidates``.

        Returns how many were tested, lower bounds on utilisation and energy [J], (K,) each, and the slope of the power
        over the load [W/(N m)], (N,).
        """
        data, slope = self.bound_data, np.zeros(len(self.bound_data.load))
        full, motion, open_energy = data.full, data.full.motion, 0.0
        fill_key_samples(data.key, full, self.acceleration_peaks)
        if with_energy:
            load = 0.5 * (full.low + full.high) + full.loss_friction
            moved = motion.speed, motion.loss_speed, motion.acceleration
            mean_power_slope(data.cases, moved, load, pairs, energy_weight != 0.0, slope)
            open_energy = energy_of_slope(data.half_width, data.unit_torque, slope * motion.weight)
        utilisation, energy = np.zeros(len(pairs)), np.zeros(len(pairs))
        count = bound_candidates(
            data, TABLE, pairs, exact, until, not self.is_fixed, cost_limit, test_all, with_energy,
            energy_weight, open_energy, base, cost, utilisation, energy, slope,
        )  # fmt: skip
        return count, utilisation, energy, slope

    def judge(
        self, parts: Indices, own: Array, parameters: Array, *, until: float, quick: bool, power: Array | None = None,
        all_checks: bool = False,
    ) -> Judged:  # fmt: skip
        """Judge candidates given the other drives, each with its first feasible, else least overloaded, amplifier.

        ``parts`` are the rows of motor and gear, (K, 2), ``own`` and ``parameters`` the load parameters of the
        candidates and of all joints' drives. The electrical power and its lower bound are added to ``power``, (1, 2, N)
        or (K, 2, N).
        """
        series = self._series_with(parameters, quick)
        power = np.zeros((0, 2, len(series.load.torque))) if power is None else power

        def judged(rows: Indices, amplifier: Amplifier | None) -> Judged:
            cases, count = self.cases(parts[rows]), len(rows)
            if amplifier is not None:
                put_amplifier(cases, amplifier, self.task)
            used, binding, missing = np.zeros(count), np.zeros(count, np.int64), np.zeros(count, np.int64)
            checks = np.zeros((count, len(TABLE)) if all_checks else (0, 0))
            judge_cases(
                cases, as_numbers(cases), TABLE, series, self.own_parameters(own[rows]), until, quick, power, checks,
                used, binding, missing,
            )  # fmt: skip
            return Judged(cases, used, binding, missing, np.zeros(count), checks)

        every = np.arange(len(parts))
        if not self.task.amplifiers or len(power):  # the power does not depend on the amplifier
            return judged(every, None)
        found, extra_prices = judged(every, self.task.amplifiers[0]), self.extra_prices
        found.extra_price[:] = extra_prices[0]
        for amplifier, extra_price in zip(self.task.amplifiers[1:], extra_prices[1:], strict=True):
            left = np.flatnonzero(found.utilisation > 1.0)
            if len(left):
                again = judged(left, amplifier)
                better = np.flatnonzero(again.utilisation < found.utilisation[left])
                found.extra_price[left[better]] = extra_price
                columns = ("cases", "utilisation", "binding", "missing_check", *(["checks"] if all_checks else []))
                for name in columns:
                    getattr(found, name)[left[better]] = getattr(again, name)[better]
        return found

    def _series_with(self, parameters: Array, quick: bool) -> JointSeries:
        """The joint's series with the other drives in place, and at the key samples if candidates are to be screened.

        ``parameters``: load parameters of all joints' drives, (n, PARAMETERS).
        """
        bare, unit, others = self.series.load, self.unit_loads, np.zeros_like(parameters)
        others[list(self.loading_joints)] = parameters[list(self.loading_joints)]
        amounts = others[list(self.loading_joints)].ravel()
        load = Load(
            bare.torque + amounts @ unit.torque,
            bare.wrench + self.work.wrench(self.joint, others) if bare.wrench.size and len(amounts) else bare.wrench,
            bare.inertia + amounts @ unit.inertia if bare.inertia.size else bare.inertia,
            bare.stop + amounts @ unit.stop if bare.stop.size else bare.stop,
            bare.static + amounts @ unit.static if bare.static.size else bare.static,
        )
        if not quick:
            return self.series._replace(load=load, at_key_samples=None)
        samples = np.concatenate([self.acceleration_peaks, section_peaks(np.abs(load.torque))])
        motion, own = self.series.motion, np.ascontiguousarray(self.series.unit_loads.torque[:, samples])
        rows = {name: getattr(motion, name).take(samples, axis=-1) for name in motion._fields[:-2]}
        key = self.key_series._replace(
            motion=self.key_series.motion._replace(**rows),
            load=self.key_series.load._replace(torque=load.torque[samples]),
            unit_loads=self.key_series.unit_loads._replace(torque=own),
        )
        return self.series._replace(load=load, at_key_samples=key)

    @property
    def extra_prices(self) -> Array:
        """Price of each amplifier above the cheapest, infinite where unknown, but 0 at a given drive, (A,)."""
        prices = np.array([math.inf if one.price is None else one.price for one in self.task.amplifiers])
        extra = prices - min(prices.min(), np.finfo(float).max)
        return np.where(np.isinf(extra), 0.0, extra) if self.is_fixed else extra

    def amplifiers_by_extra_price(self) -> list[tuple[float, Amplifier | None]]:
        """The priced amplifiers in the order tried, each with the smallest extra price of it and of those after it.

        A task without amplifiers gives one entry with None.
        """
        amplifiers = self.task.amplifiers
        smallest = np.minimum.accumulate(self.extra_prices[::-1])[::-1] if amplifiers else np.zeros(0)
        priced = [(float(price), one) for price, one in zip(smallest, amplifiers, strict=True) if price < math.inf]
        return [*priced] or [(0.0, None)]

    def use_amplifier(self, amplifier: Amplifier | None) -> None:
        """Set the amplifier of the bounds; None: an envelope that permits what any of the task's amplifiers permits."""
        if self.task.amplifiers:
            put_amplifier(self.records.template, amplifier or self.task.amplifier, self.task)
            # the envelope brakes hardest, but a real amplifier may brake less, so stops stay undecided
            if amplifier is None:
                self.records.template["setting"]["stop_current"] = math.nan


@dataclass(frozen=True, eq=False)
class Candidates:
    """The candidate pairs of all joints, P of them; n joints."""

    study: Study  # the task
    work: Workload  # loads of all joints
    motors: tuple[str, ...]  # catalogue keys by row
    gears: tuple[str, ...]  # the same; the first row is that of a direct drive
    first_pair: Indices  # pairs of joint j are ``first_pair[j]`` to ``first_pair[j + 1]``, (n + 1,)
    pairs: Indices  # row of the motor and of the gear of each pair, (P, 2)
    parameters: Array  # load parameters of each pair, units as ``load_parameters``, (P, PARAMETERS)
    ratio: Array  # gear ratio of each pair, (P,)
    mass: Array  # mass of each pair [kg], NaN where unknown, (P,)
    price: Array  # price of each pair with the joint's cheapest amplifier, NaN where unknown, (P,)
    joints: tuple[JointCandidates, ...]  # by joint
    power_known: bool  # whether the power of every fixed drive can be computed

    def keys(self, pair: int) -> tuple[str, str]:
        """The catalogue keys of (motor, gear) of a pair."""
        motor, gear = self.pairs[pair]
        return self.motors[motor], self.gears[gear]

    def parameters_of(self, chosen: Mapping[int, int]) -> Array:
        """Load parameters of chosen pairs by joint, zeros where none is chosen, (n, PARAMETERS)."""
        parameters = np.zeros((len(self.joints), PARAMETERS))
        for joint, pair in chosen.items():
            parameters[joint] = self.parameters[pair]
        return parameters

    def judge(self, joint: int, pairs: Indices, parameters: Array, **options: Any) -> Judged:
        """Judge candidates of one joint given the other drives; options as ``JointCandidates.judge``."""
        return self.joints[joint].judge(self.pairs[pairs], self.parameters[pairs], parameters, **options)


def build_candidates(study: Study, work: Workload | None = None) -> Candidates:
    """The candidates of a study; ``work``: its loads if they are known already."""
    work, parts = workload(study) if work is None else work, parts_of(study)
    shafts: dict[Any, Any] = {}
    power_known = True
    for joint, task in enumerate(study.joints):
        law = task.motor_friction
        if law not in shafts:
            shafts[law] = as_records(
                [shaft_friction(Drive(motor, NO_GEAR, motor_friction=law)) for motor in parts.motors], Friction
            )
        if task.drive is not None:
            motor, gear = parts.pairs[joint][0]
            row = parts.gear_rows[0][gear]
            inertia = parts.motor_rows["rotor_inertia"][motor] + row.inertia
            power_known &= not np.isnan(inertia + unknown_loss(row))
    pairs, parameters = np.concatenate(parts.pairs), np.concatenate(parts.amounts)
    joints = tuple(
        _joint_candidates(work, parts, joint, shafts[task.motor_friction], (pairs, parameters))
        for joint, task in enumerate(study.joints)
    )
    first_pair = np.concatenate([[0], np.cumsum([len(some) for some in parts.pairs])]).astype(np.int64)
    ratio = np.array([gear.ratio for gear in parts.gears])[pairs[:, 1]]
    price = np.concatenate(list(map(_with_amplifier_price, study.joints, parts.price)))
    return Candidates(
        study, work, parts.motor_keys, parts.gear_keys, first_pair, pairs, parameters, ratio,
        np.concatenate(parts.mass), price, joints, bool(power_known),
    )  # fmt: skip


def _with_amplifier_price(task: JointTask, price: Array) -> Array:
    """Prices of pairs plus that of the cheapest amplifier; a single amplifier without a price counts as 0."""
    if not task.amplifiers:
        return price + (amplifier_price(task.amplifier) or 0.0)
    return price + min((one.price for one in task.amplifiers if one.price is not None), default=math.nan)


def _joint_candidates(
    work: Workload, parts: Parts, joint: int, shafts: Any, every: tuple[Indices, Array]
) -> JointCandidates:
    """The candidates of one joint; ``shafts``: friction records of the motors; ``every``: all pairs, parameters."""
    study, cycle, task = work.study, work.study.cycle, work.study.joints[joint]
    demand, gears = work.at(joint, {}).fixed, parts.gear_rows
    if task.friction.load_share > 0.0:
        gears = gears[0].copy(), gears[1]
        gears[0]["load_friction"] = task.friction.load_share
    if not rests_on_gear(task, demand):
        demand = replace(demand, wrench=None)
    basis = work.basis[joint] if work.basis else None
    loading = () if basis is None else basis.drives
    others = [k for k in loading if k != joint and is_loaded_by(work, joint, k)]
    itself = [joint] if joint in loading else []
    if basis is None:
        unit = own = no_unit_loads(load_of(demand))
    else:
        unit, own = (unit_loads_of(work, joint, some) for some in (others, itself))
    if demand.wrench is not None:
        own = own._replace(wrench=work.unit_wrenches(joint, itself))
    series = joint_series(demand, own, screening=False)
    drives = (*others, *itself)

    def at_peaks(name: str, *magnitudes: Array) -> AffineLoads:
        """A load at the samples where some magnitudes peak in each section of the cycle."""
        at = np.unique([section_peaks(one) for one in magnitudes])
        load, of_others, of_own = (getattr(one, name)[..., at] for one in (series.load, unit, own))
        return affine_loads(load, np.concatenate([of_others, of_own]), drives)

    bearing = NO_LOADS
    if demand.wrench is not None:
        at = np.unique([section_peaks(one) for one in bearing_loads(series.load.wrench)])
        bearing = affine_loads(series.load.wrench[:, at], work.unit_wrenches(joint, drives, at), drives)
    holding = NO_LOADS if demand.static_torque is None else at_peaks("static", np.abs(demand.static_torque))
    ramp_stops = at_peaks("stop", np.abs(series.load.stop)) if len(demand.stop.torque) else NO_LOADS
    stops, current_stops = _current_stops(series, unit, others, ramped=task.stop.ramp is not None)
    size = 2 * SECTIONS
    key = at_samples(series, np.zeros(size, dtype=np.int64))
    steps = series.motion.periods.step
    share = np.zeros(len(steps))
    for part, weight in zip(cycle.parts, cycle.shares, strict=True):
        if part.stop > part.start + 1:
            share[part] = weight * steps[part] / steps[part].sum()
    template = paired(
        study, joint, demand, (parts.motor_rows, shafts), gears, np.zeros((min(len(shafts), 1), 2), dtype=np.int64)
    )
    case, (gear_rows, direct), (pairs, parameters) = copied(template), gears, every
    bearing_samples = bearing.base.shape[-1] if bearing.base.size else 0
    records = CaseRecords(template, parts.motor_rows, shafts, gear_rows, direct)
    data = BoundData(
        CaseNumbers(
            as_numbers(template), as_numbers(case), case, as_numbers(parts.motor_rows), as_numbers(shafts),
            as_numbers(gear_rows), direct, pairs,
        ), parameters, series.load.torque,
        unit.torque.reshape(len(others), PARAMETERS, len(cycle.time)), np.zeros((len(others), PARAMETERS)),
        torque_interval_of(key.motion, task.friction, np.zeros((len(own.torque), size)), np.zeros(size), 0),
        torque_interval_of(series.motion, task.friction, own.torque, share, bearing_samples),
        stops,
    )  # fmt: skip
    inertia = NO_LOADS
    if template["setting"]["resonance"].any() and series.load.inertia.size:
        inertia = affine_loads(series.load.inertia, np.concatenate([unit.inertia, own.inertia]), drives)
    found = JointCandidates(
        work, joint, demand, series, tuple(others), unit, bearing, holding, ramp_stops, inertia, current_stops, key,
        records, data, section_peaks(np.abs(demand.acceleration)), task.drive is not None, task,
    )  # fmt: skip
    found.use_amplifier(None)
    return found


def _current_stops(
    series: JointSeries, unit: UnitLoads, others: Sequence[int], *, ramped: bool
) -> tuple[CurrentStops, AffineLoads]:
    """Buffers and loads for stops at the current limit; empty if stops follow a ramp.

    Stops begin at the samples of largest kinetic energy, torque and speed of each section of the cycle. The loads are
    torque, static torque and inertia, (3, M).
    """
    motion, load, own = series.motion, series.load, series.unit_loads
    at = np.zeros(0, dtype=np.int64)
    if load.inertia.size and motion.speed.any() and not ramped:
        moves = motion.loss_speed != 0.0
        energy = motion.speed**2 * np.abs(load.inertia)
        at = np.unique(
            [section_peaks(energy), section_peaks(moves * np.abs(load.torque)), section_peaks(np.abs(motion.speed))]
        )
        at = at[moves[at]]
    acceleration = motion.acceleration[at]

    def stacked(torque: Array, inertia: Array) -> Array:
        """Torque, static torque and inertia."""
        return np.stack([torque, torque - inertia * acceleration, inertia], axis=-2)

    stops = CurrentStops(
        motion.speed[at], motion.loss_speed[at], acceleration, motion.carrier_acceleration[at],
        np.ascontiguousarray(own.torque[:, at]), np.ascontiguousarray(own.inertia[:, at]), *np.zeros((3, 2, len(at))),
    )  # fmt: skip
    base = stacked(load.torque[at], load.inertia[at])
    return stops, affine_loads(base, stacked(unit.torque[:, at], unit.inertia[:, at]), others)
