"""Tolerance sampling: the checks of ``evaluate`` applied to random samples of one set of drives, in compiled blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.gear import bearing_arm, moment_square
from drivetrain.records import as_numbers
from drivetrain.sizing.demand.demand import Workload, workload
from drivetrain.sizing.demand.series import (
    JointSeries,
    Load,
    UnitLoads,
    joint_series,
    load_of,
    new_traces,
    no_unit_loads,
    ramp_stops,
)
from drivetrain.sizing.judge.cases import cases_of, power_allowance
from drivetrain.sizing.judge.checks import ARM_CHECKS, CHECKS, SUPPLY_CHECKS, table
from drivetrain.sizing.judge.evaluate import evaluated, given_drives
from drivetrain.sizing.judge.judge import in_doubt, judge_cases
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.stiffness import arm_checks
from drivetrain.sizing.judge.verdicts import supply_figures
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.draws import (
    CONSTANT,
    DRAG,
    EFFICIENCY,
    FRICTION,
    RESISTANCE,
    THERMAL,
    Draws,
    Pair,
    from_uniform,
    sources,
)
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import Check, Verdict

NAMES = tuple(check.name for check in CHECKS)
SUPPLY_NAMES = tuple(check.name for check in SUPPLY_CHECKS)
ARM_NAMES = tuple(check.name for check in ARM_CHECKS)
SHARED = {"supply": SUPPLY_NAMES, "arm": ARM_NAMES}  # checks of all joints together that are drawn
# probabilities of a smaller deviation, at which a payload has the masses for which the arm's stiffness is computed
LEVELS = np.array([0.001, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0])
BLOCK = 1024  # samples evaluated by a thread at a time
AT_ONCE = 64  # samples evaluated in one call: their power over the cycle takes a megabyte
PATHS = ("resistance_winding_housing", "resistance_housing_ambient", "resistance_winding_ambient")
TIMES = ("winding_time_constant", "housing_time_constant")  # scaled with the resistances: heat capacities stay
DRAGS = ("drag_torque", "seal_drag_torque", "starting_torque")
TORQUES = ("coulomb", "coulomb_negative", "viscous", "viscous_negative", "static")


@dataclass(frozen=True, eq=False)
class Nominal:
    """A study with nominal values, prepared for any set of drives."""

    study: Study  # the task
    work: Workload  # loads of all joints
    scattering: tuple[UnitLoads, ...]  # load of each whole payload and of the forces at the tip, by joint
    # by index of a payload: factors on its mass, (K,), and the loads of all joints with it and all others light
    weighted: Mapping[int, tuple[Array, tuple[Workload, ...]]]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of drives, prepared for random samples."""

    study: Study  # the nominal task
    drives: Mapping[str, Pair]  # keys of (motor, gear) by joint name
    nominal: Evaluation  # with nominal values
    lossy: tuple[bool, ...]  # whether each joint has a real gear; an ideal one has no losses in any sample
    cases: tuple[Any, ...]  # nominal case by joint
    works: tuple[JointSeries, ...]  # loads by joint; the amounts added to them are deviations of ``Draws.loads``
    checks: Any  # table of checks for compiled code
    # limits of the supply, in the order of ``SUPPLY_NAMES``, NaN if there is none or the power is unknown
    limits: Array
    # by index of a payload: factors on its mass, (K,), and utilisations in the order of ``ARM_NAMES``, (K, checks)
    stiffness: Mapping[int, tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class Samples:
    """Utilisations of S samples, NaN where a check was not made."""

    joints: Array  # in the order of ``NAMES``, (S, n, checks)
    supply: Array  # in the order of ``SUPPLY_NAMES``, (S, checks of the supply)
    arm: Array  # in the order of ``ARM_NAMES``, with the drawn payloads and else nominal values, (S, checks of the arm)
    # whether a check of a joint, the supply or the arm that ``evaluate`` needs could not be made, (S, n + 2)
    lacking: Array
    proven: bool  # whether every essential check could be made, and the arm's stops hold with nominal values

    @property
    def failed(self) -> Array:
        """Whether the checks of each joint, then of the supply and of the arm, are not all satisfied, (S, n + 2)."""
        over = (self.joints > 1.0).any(axis=2), (self.supply > 1.0).any(axis=1), (self.arm > 1.0).any(axis=1)
        return np.logical_or(np.column_stack(over), self.lacking)

    @property
    def feasible(self) -> Array:
        """Whether every check of a sample is satisfied, (S,)."""
        return np.asarray(~self.failed.any(axis=1) & self.proven)


def nominal_of(study: Study, work: Workload | None = None) -> Nominal:
    """A study prepared for any set of drives."""
    without, doubled = {}, None  # loads without each payload that has a tolerance, and with twice the force
    for source in sources(study):
        if source.quantity == "payload":
            without[source.place] = workload(changed(study, TaskChange(payload=0.0, payloads=(source.place,))))
        elif source.quantity == "force":
            doubled = workload(changed(study, TaskChange(force=2.0)))
    own = workload(study) if work is None else replace(work, study=study)
    rows = tuple(_scattering_rows(own, without, doubled, joint) for joint in range(len(study.joints)))
    return Nominal(study, own, rows, _weighted(study) if study.stiffness.stated else {})


def _weighted(study: Study) -> dict[int, tuple[Array, tuple[Workload, ...]]]:
    """By index of each payload with a tolerance: factors on its mass, (K,), and the loads with all others light."""
    factors = from_uniform(study, np.repeat(LEVELS[:, None], len(sources(study)), axis=1)).loads[:, :-1]
    found = {}
    for i in np.flatnonzero(np.ptp(factors, axis=0) > 0.0).tolist():
        rows = np.repeat(factors[:1], len(LEVELS), axis=0)
        rows[:, i] = factors[:, i]
        found[i] = rows[:, i], tuple(workload(_with_payloads(study, row)) for row in rows)
    return found


def _with_payloads(study: Study, factors: Array) -> Study:
    """The study with a factor on the mass of each payload, (payloads,)."""
    for body, factor in zip(study.payloads, factors.tolist(), strict=True):
        study = changed(study, TaskChange(payload=factor, payloads=(body.name,)))
    return study


def _stiffness(work: Workload, drives: Mapping[str, Pair]) -> Array:
    """Utilisations of the checks of the arm's stiffness, NaN where one is not made, (checks,)."""
    study, filled_parts = work.study, FilledParts(work.study)
    mounted = {i: filled_parts.drive(task, *drives[task.name]) for i, task in enumerate(study.joints)}
    torque = np.column_stack([work.at(i, mounted).demand(drive).load_torque for i, drive in mounted.items()])
    named = {study.joints[i].name: drive for i, drive in mounted.items()}
    used = {check.name: check.utilisation for check in arm_checks(study, named, torque)}
    return np.array([used.get(name) for name in ARM_NAMES], dtype=np.float64)  # None becomes NaN


def _stiffness_at(ready: Candidate, loads: Array) -> Array:
    """Utilisations of the checks of the arm's stiffness with drawn payloads, interpolated, (S, checks).

    Each phase of the cycle carries one payload at most, so that the worst of all payloads counts, each with all others
    light.

    Args:
        ready: The set of drives.
        loads: As in ``Draws``, (S, payloads + 1).
    """
    if not ready.stiffness:
        return np.repeat(figures_of(ready.nominal)[2][None], len(loads), axis=0)
    found = [
        [np.interp(loads[:, i], factors, used) for used in rows.T] for i, (factors, rows) in ready.stiffness.items()
    ]
    return np.asarray(np.max(found, axis=0).T)


def _scattering_rows(
    work: Workload, without: Mapping[str, Workload], doubled: Workload | None, joint: int
) -> UnitLoads:
    """Load of each whole payload and of the forces at the tip on a joint; empty if none of them has a tolerance."""
    full = load_of(work.at(joint, {}).fixed)
    if not without and doubled is None:
        return no_unit_loads(full)
    rows = []
    for body in work.study.payloads:
        empty = load_of(without[body.name].at(joint, {}).fixed) if body.name in without else full
        rows.append([with_it - bare for with_it, bare in zip(full, empty, strict=True)])
    if doubled is not None:
        twice = load_of(doubled.at(joint, {}).fixed)
        rows.append([more - once for more, once in zip(twice, full, strict=True)])
    return UnitLoads(*(np.stack(column) for column in zip(*rows, strict=True)))


def candidate(nominal: Nominal, drives: Mapping[str, Pair]) -> Candidate:
    """A set of drives, prepared for random samples; drives: keys of (motor, gear) by joint name.

    Each joint has the amplifier that is chosen with nominal values, because that one is installed.
    """
    evaluation = evaluated(nominal.work, given_drives(nominal.study, drives))
    study, filled_parts = evaluation.study, FilledParts(nominal.study)
    mounted = {i: filled_parts.drive(task, *drives[task.name]) for i, task in enumerate(study.joints)}
    cases, works = [], []
    for joint, unit_loads in enumerate(nominal.scattering):
        demand = nominal.work.at(joint, mounted).demand(mounted[joint])
        cases.append(cases_of(study, joint, demand, [mounted[joint]]))
        works.append(joint_series(demand, unit_loads))
    known = all(result.torque_known for result in evaluation.joints.values())
    stated = [getattr(study.supply, check.limit) if known else None for check in SUPPLY_CHECKS]
    limits = np.array(stated, dtype=np.float64)  # None becomes NaN
    lossy = tuple(mounted[i].gear.kind != "ideal" for i in range(len(study.joints)))
    stiffness = {
        i: (factors, np.array([_stiffness(work, drives) for work in works]))
        for i, (factors, works) in nominal.weighted.items()
    }
    return Candidate(study, drives, evaluation, lossy, tuple(cases), tuple(works), table(), limits, stiffness)


def as_built(study: Study, nominal: Any, lossy: bool, factors: Array, ambient: Array) -> Any:
    """Cases of one joint with sampled values; limits printed on data sheets stay, derived ones follow the values.

    Args:
        study: The task.
        nominal: The nominal case, (1,).
        lossy: Whether the gear is a real one.
        factors: Factors on the nominal values, in the order of ``draws.PARTS``, (S, 6).
        ambient: Ambient temperature [C], (S,).
    """
    cases = np.repeat(nominal, len(ambient))
    motor, gear, setting = cases["motor"], cases["gear"], cases["setting"]
    if study.safety.life is None:  # bearing life is not checked, and takes as long as all other checks
        gear["bearing_dynamic_rating"] = np.nan
    unprinted = np.isnan(motor["nominal_current"])
    motor["nominal_current"][unprinted] = (motor["nominal_torque"] / motor["torque_constant"])[unprinted]
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
        for name in ("efficiency", "mesh_efficiency"):  # above 1 the law of the mesh takes it as without loss
            gear[name] *= better
        # For a negative efficiency (self-locking) a better gear is one that locks less.
        gear["backdriving_efficiency"] = np.where(back < 0.0, back / better, back * better)
        gear["no_load_torque"] *= factors[:, FRICTION]
        for name in DRAGS:
            gear[name] *= factors[:, DRAG]
    return cases


def judged(ready: Candidate, draws: Draws, *, threads: int = 1) -> Iterator[Samples]:
    """Evaluate samples block by block; the results do not depend on blocks or threads."""
    parts = [slice(first, min(first + BLOCK, len(draws))) for first in range(0, len(draws), BLOCK)]
    threads = max(min(threads, len(parts)), 1)
    deviation = np.abs(draws.loads - 1.0).max(axis=0)
    life = ready.study.safety.life is not None
    spare = [
        tuple(_peaks_kept(*one, deviation, life) for one in zip(ready.works, ready.cases, strict=True))
        for _ in range(threads)
    ]

    def one(part: slice) -> Samples:
        works = spare.pop()
        try:
            return _block(ready, works, draws, part)
        finally:
            spare.append(works)

    if threads == 1:
        yield from map(one, parts)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(one, parts)


def _peaks_kept(series: JointSeries, case: Any, most: Array, life: bool) -> JointSeries:
    """A copy of the loads with its own buffers, without samples of the cycle at which a load cannot peak.

    Bearing, brake and inertia checks need the largest load only, so the samples are kept at which it may occur within
    these deviations. Bearing life, and stops at the current limit, need all samples.

    Args:
        series: Loads of one joint.
        case: Its nominal case, (1,).
        most: Largest relative deviation of each payload and of the forces, (payloads + 1,).
        life: Whether bearing life is checked.
    """
    load, unit, most = series.load, series.unit_loads, most[: len(series.unit_loads.torque)]
    lever = np.nan_to_num(bearing_arm(case["gear"][0]))

    def kept(values: Array, rows: Array, *magnitudes: Callable[[Array], Array]) -> tuple[Array, Array]:
        counts = np.zeros(values.shape[-1], dtype=np.bool_)
        for magnitude in magnitudes:
            size, more = magnitude(values), most @ magnitude(rows)
            counts |= size + more >= (size - more).max(initial=-np.inf)
        return values[..., counts].copy(order="C"), rows[..., counts].copy(order="C")

    wrench, inertia = (load.wrench, unit.wrench), (load.inertia, unit.inertia)
    if not life:
        wrench = kept(
            *wrench, lambda w: np.sqrt(moment_square(lever, w[..., 0, :], w[..., 1, :], w[..., 3, :], w[..., 4, :])),
            lambda w: np.hypot(w[..., 3, :], w[..., 4, :]), lambda w: np.abs(w[..., 5, :]),
        )  # fmt: skip
    if case["setting"]["ramped"][0] != 0.0:
        inertia = kept(*inertia, np.abs)
    static = kept(load.static, unit.static, np.abs)
    pairs = ((load.torque, unit.torque), wrench, inertia, (load.stop, unit.stop), static)
    load, unit = Load(*(one for one, _ in pairs)), UnitLoads(*(more for _, more in pairs))
    traces = new_traces(len(series.motion.speed), len(series.traces.parts))
    total, stops = Load(*(row.copy() for row in load)), ramp_stops(*series.stops[:3])
    return series._replace(load=load, unit_loads=unit, total=total, traces=traces, stops=stops, at_key_samples=None)


def _block(ready: Candidate, works: tuple[JointSeries, ...], draws: Draws, part: slice) -> Samples:
    """Judge a block of consecutive samples."""
    count, power = part.stop - part.start, np.empty((AT_ONCE, 2, len(works[0].motion.weight)))
    used = np.empty((len(works), count, len(CHECKS)))
    found, binding, lacking = np.zeros(count), np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    cases = [
        as_built(ready.study, ready.cases[joint], ready.lossy[joint], draws.factors[part, joint], draws.ambient[part])
        for joint in range(len(works))
    ]
    required = np.empty((count, len(SUPPLY_CHECKS)))
    unmade = np.zeros((count, len(works) + len(SHARED)), dtype=np.bool_)
    for first in range(0, count, AT_ONCE):
        some = slice(first, min(first + AT_ONCE, count))
        drawn = power[: some.stop - first]
        drawn[:] = 0.0
        for joint, series in enumerate(works):
            amounts = draws.loads[part][some, : len(series.unit_loads.torque)] - 1.0
            own = cases[joint][some]
            judge_cases(
                own, as_numbers(own), ready.checks, series, np.ascontiguousarray(amounts), np.inf, False, drawn,
                used[joint, some], found[some], binding[some], lacking[some],
            )  # fmt: skip
            unmade[some, joint] = lacking[some] >= 0
        figures = supply_figures(ready.study, drawn)
        required[some] = np.stack([figures[row.required] for row in SUPPLY_CHECKS], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        supply = np.where(ready.limits > 0.0, required / ready.limits, np.where(required > 0.0, np.inf, 0.0))
    hidden = np.sum([power_allowance(own) for own in cases], axis=0)
    for name, more in zip(("peak_power", "mean_power"), hidden.T, strict=True):
        column = [row.required for row in SUPPLY_CHECKS].index(name)
        share, limit = supply[:, column], ready.limits[column]
        doubtful = np.array([in_doubt(one, add, limit) for one, add in zip(share, more, strict=True)], dtype=np.bool_)
        unmade[:, len(works)] |= doubtful
        share[doubtful] = np.nan
    supply[:, np.isnan(ready.limits)] = np.nan
    proven = not (ready.nominal.lacking or failed_undrawn(ready.nominal))
    arm = _stiffness_at(ready, draws.loads[part])
    return Samples(np.swapaxes(used, 0, 1), supply, arm, unmade, proven)


def undrawn(evaluation: Evaluation) -> tuple[Check, ...]:
    """The checks of the arm's stops, which are made with nominal values alone."""
    made = (check for check in evaluation.shared if check.utilisation is not None)
    return tuple(check for check in made if check.name not in (*SUPPLY_NAMES, *ARM_NAMES))


def failed_undrawn(evaluation: Evaluation) -> tuple[str, ...]:
    """Names of the checks of the arm's stops that fail, in which case no sample counts as feasible."""
    return tuple(check.name for check in undrawn(evaluation) if check.verdict is Verdict.FAIL)


def figures_of(evaluation: Evaluation) -> tuple[Array, Array, Array]:
    """Utilisations of an evaluation as one sample of ``Samples``: of joints (n, checks), supply and arm (checks,)."""
    joints = np.full((len(evaluation.joints), len(NAMES)), np.nan)
    for row, result in zip(joints, evaluation.joints.values(), strict=True):
        for check in result.checks:
            if check.utilisation is not None:
                row[NAMES.index(check.name)] = check.utilisation
    used = {check.name: check.utilisation for check in evaluation.shared}
    supply, arm = (np.array([used.get(name) for name in names], dtype=np.float64) for names in SHARED.values())
    return joints, supply, arm
