"""Tolerance sampling: drawn samples of one set of drives, every one judged as ``evaluate`` judges the nominal set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.records import as_numbers
from drivetrain.sizing.demand.demand import Workload, at_rest, workload
from drivetrain.sizing.demand.load_basis import load_basis
from drivetrain.sizing.demand.series import Added, Load, Work, new_traces, work_of
from drivetrain.sizing.demand.stops import stop_basis
from drivetrain.sizing.judge.cases import cases_of
from drivetrain.sizing.judge.checks import CHECKS, SUPPLY_CHECKS, table
from drivetrain.sizing.judge.evaluate import evaluated, given_drives
from drivetrain.sizing.judge.judge import judge_cases
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.verdicts import supply_figures
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.draws import CONSTANT, DRAG, EFFICIENCY, FRICTION, RESISTANCE, THERMAL, Draws, Pair
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.model import Study

NAMES = tuple(check.name for check in CHECKS)
SUPPLY_NAMES = tuple(check.name for check in SUPPLY_CHECKS)
BLOCK = 64  # samples judged at once: their power over the cycle is a megabyte
PATHS = ("resistance_winding_housing", "resistance_housing_ambient", "resistance_winding_ambient")
TIMES = ("winding_time_constant", "housing_time_constant")  # heat capacities stay
DRAGS = ("drag_torque", "seal_drag_torque", "starting_torque")
TORQUES = ("coulomb", "coulomb_negative", "viscous", "viscous_negative", "static")


@dataclass(frozen=True, eq=False)
class Nominal:
    """A study with nominal numbers, prepared for any set of drives."""

    study: Study  # the task
    work: Workload  # of all joints
    payloads: tuple[Added, ...]  # what the whole of each payload asks of each joint


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of drives, ready for drawn samples."""

    study: Study  # the nominal task
    drives: Mapping[str, Pair]  # keys of (motor, gear) by joint name
    nominal: Evaluation  # with nominal numbers
    lossy: tuple[bool, ...]  # whether a joint's gear is more than an ideal one, which loses nothing however it is built
    cases: tuple[Any, ...]  # one a joint, with nominal numbers
    works: tuple[Work, ...]  # one a joint; the payloads are what cases add
    checks: Any  # the table, for compiled code
    limits: Array  # of the supply, in the order of ``SUPPLY_NAMES``, NaN where there is none or the power is not known


@dataclass(frozen=True, eq=False)
class Samples:
    """Utilisations of some samples, NaN where a check was not made."""

    joints: Array  # in the order of ``NAMES``, (S, n, checks)
    supply: Array  # in the order of ``SUPPLY_NAMES``, (S, checks of the supply)
    judged: bool  # whether every essential check could be made

    @property
    def feasible(self) -> Array:
        """Whether every check of a sample is satisfied, (S,)."""
        over = (self.joints > 1.0).any(axis=(1, 2)) | (self.supply > 1.0).any(axis=1)
        return np.asarray(~over & self.judged)


def nominal_of(study: Study, work: Workload | None = None) -> Nominal:
    """A study prepared for any set of drives."""
    own = workload(study) if work is None else replace(work, study=study)
    return Nominal(study, own, tuple(_payload_rows(study, own)))


def _payload_rows(study: Study, work: Workload) -> Iterator[Added]:
    """What the whole of each payload asks of each joint; nothing where payloads are known exactly."""
    bodies = [body for body in study.payloads if body.mass > 0.0 and "payload" in study.tolerances.given]
    bare = {body.name: changed(study, TaskChange(payload=0.0, payloads=(body.name,))) for body in bodies}
    without = {name: load_basis(one) for name, one in bare.items()}
    still = {name: load_basis(at_rest(one), forces_only=True) for name, one in bare.items() if work.resting}
    lighter = {name: stop_basis(one) for name, one in bare.items()}
    samples, rows = len(study.cycle.time), len(study.payloads) if without and work.basis else 0
    for joint, task in enumerate(study.joints):
        stops = None if task.stop.ramp is None else work.stops
        states = 0 if stops is None else len(stops.first)
        if not rows:
            nothing = (
                np.zeros((0, samples)),
                np.zeros((0, 6, 0)),
                np.zeros((0, 0)),
                np.zeros((0, states)),
                np.zeros((0, 0)),
            )
            yield Added(*nothing)
            continue
        full, travel = work.basis[joint], task.travel_per_turn or 1.0
        added = Added(
            np.zeros((rows, samples)), np.zeros((rows, 6, samples if full.told else 0)), np.zeros((rows, samples)),
            np.zeros((rows, states)), np.zeros((rows, samples if task.brakes else 0)),
        )  # fmt: skip
        for row, body in enumerate(study.payloads):
            if body.name not in without:
                continue
            empty = without[body.name][joint].bare
            added.torque[row] = travel * (full.bare.force - empty.force)
            added.inertia[row] = travel**2 * (full.bare.inertia - empty.inertia)
            less = lighter[body.name]
            if stops is not None and less is not None:
                added.stop[row] = travel * (stops.joints[joint].bare.force - less.joints[joint].bare.force)
            if task.brakes:
                full_still, empty_still = work.resting[joint].bare, still[body.name][joint].bare
                added.static[row] = travel * (full_still.force - empty_still.force)
            if full.told:
                added.wrench[row] = (full.bare.wrench - empty.wrench).T
        yield added


def candidate(nominal: Nominal, drives: Mapping[str, Pair]) -> Candidate:
    """A set of drives made ready for drawn samples; drives: keys of (motor, gear) by joint name."""
    study, filled_parts = nominal.study, FilledParts(nominal.study)
    mounted = {i: filled_parts.drive(task, *drives[task.name]) for i, task in enumerate(study.joints)}
    cases, works = [], []
    for joint, added in enumerate(nominal.payloads):
        demand = nominal.work.at(joint, mounted).demand(mounted[joint])
        cases.append(cases_of(study, joint, demand, [mounted[joint]]))
        works.append(work_of(demand, added))
    evaluation = evaluated(nominal.work, given_drives(study, drives))
    known = all(result.torque_known for result in evaluation.joints.values())
    told = [getattr(study.supply, check.limit) if known else None for check in SUPPLY_CHECKS]
    limits = np.array(told, dtype=np.float64)  # None becomes NaN
    lossy = tuple(mounted[i].gear.kind != "ideal" for i in range(len(study.joints)))
    return Candidate(study, drives, evaluation, lossy, tuple(cases), tuple(works), table(), limits)


def as_built(study: Study, nominal: Any, lossy: bool, factors: Array, ambient: Array) -> Any:
    """Cases of one joint with drawn numbers: printed limits stay, what is computed from the numbers follows them.

    Args:
        study: The nominal task.
        nominal: The case as the sheets have it, (1,).
        lossy: Whether its gear loses anything.
        factors: On its numbers, in the order of ``draws.PARTS``, (S, 6).
        ambient: [C], (S,).
    """
    cases = np.repeat(nominal, len(ambient))
    motor, gear, setting = cases["motor"], cases["gear"], cases["setting"]
    if study.safety.life is None:  # no limit holds the life of bearings, which takes as long as all the rest
        gear["bearing_dynamic_rating"] = np.nan
    told = np.isnan(motor["nominal_current"])
    motor["nominal_current"][told] = (motor["nominal_torque"] / motor["torque_constant"])[told]
    motor["torque_constant"] *= factors[:, CONSTANT]
    motor["resistance"] *= factors[:, RESISTANCE]
    for name in (*PATHS, *TIMES):
        motor[name] *= factors[:, THERMAL]
    setting["mounting"] *= factors[:, THERMAL]
    setting["ambient"], setting["gear_temperature"] = ambient, study.drag_temperature(ambient)
    for shaft in ("joint", "shaft"):
        for name in TORQUES:
            cases[shaft][name] *= factors[:, FRICTION]
    if lossy:
        better, back = factors[:, EFFICIENCY], gear["backdriving_efficiency"]
        for name in ("efficiency", "mesh_efficiency"):
            gear[name] = np.minimum(gear[name] * better, 1.0)
        # A negative one (self-locking) is a loss too: a better gear locks less.
        gear["backdriving_efficiency"] = np.minimum(np.where(back < 0.0, back / better, back * better), 1.0)
        gear["no_load_torque"] *= factors[:, FRICTION]
        for name in DRAGS:
            gear[name] *= factors[:, DRAG]
    return cases


def judged(ready: Candidate, draws: Draws, *, threads: int = 1) -> Iterator[Samples]:
    """The samples judged, block by block; no number depends on blocks or threads."""
    parts = [slice(first, min(first + BLOCK, len(draws))) for first in range(0, len(draws), BLOCK)]
    if threads <= 1 or len(parts) <= 1:
        yield from (_block(ready, ready.works, draws, part) for part in parts)
        return
    spare = [tuple(_with_own_memory(work) for work in ready.works) for _ in range(threads)]

    def one(part: slice) -> Samples:
        works = spare.pop()
        try:
            return _block(ready, works, draws, part)
        finally:
            spare.append(works)

    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(one, parts)


def _with_own_memory(work: Work) -> Work:
    """The same work with memory that nobody else writes into."""
    few = None if work.few is None else _with_own_memory(work.few)
    traces = new_traces(len(work.motion.speed), len(work.traces.parts))
    return work._replace(sum=Load(*(row.copy() for row in work.sum)), traces=traces, few=few)


def _block(ready: Candidate, works: tuple[Work, ...], draws: Draws, part: slice) -> Samples:
    """Some samples that follow one another."""
    count, weight = part.stop - part.start, works[0].motion.weight
    joints, power = np.empty((count, len(works), len(CHECKS))), np.zeros((count, 2, len(weight)))
    found, binding, lacking = np.zeros(count), np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    for joint, work in enumerate(works):
        cases = as_built(
            ready.study, ready.cases[joint], ready.lossy[joint], draws.factors[part, joint], draws.ambient[part]
        )
        amounts = np.ascontiguousarray(draws.payload[part, : len(work.added.torque)] - 1.0)
        used = np.empty((count, len(CHECKS)))
        judge_cases(
            cases, as_numbers(cases), ready.checks, work, amounts, np.inf, False, power, used, found, binding, lacking
        )
        joints[:, joint] = used
    figures = supply_figures(ready.study, power)
    asked = np.stack([figures[row.required] for row in SUPPLY_CHECKS], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        supply = np.where(ready.limits > 0.0, asked / ready.limits, np.where(asked > 0.0, np.inf, 0.0))
    supply[:, np.isnan(ready.limits)] = np.nan
    return Samples(joints, supply, not ready.nominal.lacking)


def figures_of(evaluation: Evaluation) -> tuple[Array, Array]:
    """Utilisations of an evaluation, as one sample in ``Samples``: (n, checks) and (checks of the supply,)."""
    joints, supply = np.full((len(evaluation.joints), len(NAMES)), np.nan), np.full(len(SUPPLY_NAMES), np.nan)
    for row, result in zip(joints, evaluation.joints.values(), strict=True):
        for check in result.checks:
            if check.utilisation is not None:
                row[NAMES.index(check.name)] = check.utilisation
    for check in evaluation.shared:
        if check.name in SUPPLY_NAMES and check.utilisation is not None:
            supply[SUPPLY_NAMES.index(check.name)] = check.utilisation
    return joints, supply
