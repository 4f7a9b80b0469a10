"""Evaluates given drives, from the tip to the base, because each drive loads the joints before it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetrain.drive.drive import Drive, resting
from drivetrain.drive.gear import HOLDING, mesh_of
from drivetrain.errors import Fault, InputError, by_joint, nearest, raise_faults
from drivetrain.sizing.demand.demand import JointDemand, Workload, workload
from drivetrain.sizing.judge.arm_stops import stop_checks
from drivetrain.sizing.judge.cases import power_allowance
from drivetrain.sizing.judge.missing import massless
from drivetrain.sizing.judge.objectives import criteria, weighted
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.stiffness import arm_checks
from drivetrain.sizing.judge.verdicts import checks_of, placed, supply_checks
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.candidates import braked_key, gears_at, motors_at
from drivetrain.study.parts.verdicts import UNWEIGHED, Check, Verdict

Pair = tuple[str, str]
Given = tuple[str, str | None]
GIVE = "give the joint in the study a `drive: {motor: KEY, gear: KEY}`, or let `select` choose one"
HELD = {
    "least": "the smallest motor torque that holds with the help of the friction of the mesh",
    "lossless": "the motor torque that holds without help from the friction of the mesh",
    "most": "the largest motor torque at which the friction of the mesh still holds",
}
LOADED = 0.01  # torque at rest over the largest one; below it, a joint counts as not loaded at rest
NO_GEAR = ("", "none", None)  # accepted as the gear key of a direct drive


def evaluate(study: Study, drives: Mapping[str, Given] | Given | None = None) -> Evaluation:
    """Check every limit of the given drives.

    Args:
        study: The task.
        drives: Keys of (motor, gear) by joint name, or one such pair for all joints. The gear key of a direct drive is
            "", "none" or None. A joint that is not named keeps the drive that the study states.

    Returns:
        Every check of every joint and of the supply.

    Raises:
        InputError: Unknown joints, motors or gears, or a joint without a drive; all faults at once.
    """
    if not isinstance(study, Study):
        problem, hint = "must be a study", "load_study reads one from its file"
        raise InputError(Fault("study", problem, type(study).__name__, hint))
    return evaluated(workload(study), given_drives(study, drives or {}))


def evaluated(work: Workload, keys: Mapping[str, Pair], more: tuple[Check, ...] = ()) -> Evaluation:
    """Evaluate drives for a task whose work is already prepared."""
    study, filled_parts = work.study, FilledParts(work.study)
    tasks = {i: task for i, task in enumerate(study.joints) if task.name in keys}
    mounted = {i: filled_parts.drive(task, *keys[task.name]) for i, task in tasks.items()}
    results = {task.name: evaluate_joint(work, mounted, i, keys[task.name]) for i, task in tasks.items()}
    return evaluation_of(study, results, more + (shared_checks(study, results) if results else ()))


def evaluate_drives(study: Study, drives: Mapping[str, Drive]) -> Evaluation:
    """Evaluate drives that need not be in a catalogue.

    Args:
        study: The task.
        drives: By joint name, for every joint, with missing data filled in.

    Returns:
        Every check of every joint and of the supply.

    Raises:
        InputError: Unknown joints, or a joint without a drive.
    """
    names = study.joint_names
    unknown = [name for name in drives if name not in names]
    faults = [Fault(f"drives.{name}", "is no joint", name, nearest(name, names)) for name in unknown]
    faults += [Fault(f"joints.{name}", "has no drive") for name in names if name not in drives]
    raise_faults(faults)
    work, mounted = workload(study), {i: drives[name] for i, name in enumerate(names)}
    results = {
        name: evaluate_joint(work, mounted, i, (drives[name].motor.key, drives[name].gear.key))
        for i, name in enumerate(names)
    }
    return evaluation_of(study, results, shared_checks(study, results))


def holding_figures(evaluation: Evaluation) -> dict[str, dict[str, tuple[float | None, float | None]]]:
    """Motor torques at rest with least, lossless and most help of the mesh friction [N m]; for whole sets only."""
    found: dict[str, dict[str, tuple[float | None, float | None]]] = {}
    whole = len(evaluation.joints) == len(evaluation.study.joints)
    held = [name for name, joint in evaluation.joints.items() if whole and _holds(joint)]
    for choice, number in HOLDING.items() if held else ():
        drives = {
            name: replace(one.drive, gear=replace(one.drive.gear, holding=number))
            for name, one in evaluation.joints.items()
        }
        same = all(one.drive.gear.holding == number for one in evaluation.joints.values())
        chosen = evaluation if same else evaluate_drives(evaluation.study, drives)
        for name, joint in chosen.joints.items():
            actual = {check.name: check.actual for check in joint.checks}
            if name in held:
                found.setdefault(name, {})[choice] = (actual["motor RMS current"], actual["winding temperature"])
    return found


def _holds(joint: JointResult) -> bool:
    """Whether a geared drive holds a load at rest that exceeds rounding."""
    torque, at_rest = np.abs(joint.series.gear_torque), resting(joint.series.speed)
    return bool(joint.gear and np.max(torque[at_rest], initial=0.0) > 1e-6 * np.max(torque, initial=0.0))


def evaluation_of(study: Study, results: dict[str, JointResult], shared: tuple[Check, ...]) -> Evaluation:
    """The results of all joints as one evaluation, with its criteria; its study names the amplifiers."""
    study = with_chosen(study, results)
    found = criteria(study, results, shared)
    return Evaluation(study, results, shared, weighted(study.wanted, found), found)


def given_drives(study: Study, drives: Mapping[str, Given] | Given, *, every: bool = True) -> dict[str, Pair]:
    """The drive of every joint: the caller's, else the study's; ``every``: whether a joint must have one."""
    names = study.joint_names
    if isinstance(drives, tuple) and len(drives) == 2 and all(one is None or isinstance(one, str) for one in drives):
        drives = dict.fromkeys(names, drives)
    if not isinstance(drives, Mapping):
        problem = "must give (motor key, gear key) by joint name, or one such pair for all joints"
        raise InputError(Fault("drives", problem, drives))
    faults: list[Fault] = []
    drives = by_joint("drives", drives, names, faults)
    found: dict[str, Pair] = {}
    for task in study.joints:
        given = next((drives[name] for name in (task.name, *task.sharing) if name in drives), task.drive)
        if given is None and not every:
            continue
        if given is None:
            problem = "has no drive" + (": which of its brakes is left open" if task.brakes else "")
            faults.append(Fault(f"drives.{task.name}", problem, None, GIVE))
        elif not _is_pair(given):
            faults.append(Fault(f"drives.{task.name}", "must be a motor key and a gear key", given))
        else:
            gear = "" if given[1] in NO_GEAR else str(given[1])
            pair = (braked_key(task, study.catalog, given[0]), task.staged.get(gear, gear))
            faults += _unknown_keys(study, task, pair)
            found[task.name] = pair
            if found.get(task.axis_name, pair) != pair:
                problem = f"must be the drive of {task.axis_name}, with which it shares an axis"
                faults.append(Fault(f"drives.{task.name}", problem, given))
    raise_faults(faults)
    return found


def _is_pair(given: object) -> bool:
    """Whether it is a motor key with the key of a gear, or None for a direct drive."""
    if not isinstance(given, tuple | list) or len(given) != 2:
        return False
    return isinstance(given[0], str) and isinstance(given[1], str | None)


def evaluate_joint(work: Workload, mounted: Mapping[int, Drive], joint: int, keys: Pair) -> JointResult:
    """Result of one joint's drive with the first amplifier that fits, or else with the one of lowest utilisation.

    Among amplifiers with the same worst check, which then is not one of the amplifier, the next worst check decides.
    """
    study, demand, found = work.study, work.at(joint, mounted).demand(mounted[joint]), []
    task = study.joints[joint]
    for amplifier in task.amplifiers or (task.amplifier,):
        own = replace(task, amplifier=amplifier)
        one = study if amplifier is task.amplifier else with_joints(study, {joint: own})
        found.append(joint_result(Operation(demand, mounted[joint], one, joint), task.name, *keys))
        if found[-1].verdict is not Verdict.FAIL:
            return found[-1]
    return min(found, key=lambda one: sorted((check.utilisation or 0.0 for check in one.checks), reverse=True))


def with_chosen(study: Study, results: Mapping[str, JointResult]) -> Study:
    """A study with the amplifiers that were chosen."""
    chosen = {
        i: replace(task, amplifier=results[task.name].amplifier, amplifiers=())
        for i, task in enumerate(study.joints) if task.amplifiers and task.name in results
    }  # fmt: skip
    return with_joints(study, chosen) if chosen else study


def with_joints(study: Study, tasks: Mapping[int, JointTask]) -> Study:
    """A study with other tasks at some joints."""
    return replace(study, joints=tuple(tasks.get(i, task) for i, task in enumerate(study.joints)))


def joint_result(op: Operation, name: str, motor: str, gear: str) -> JointResult:
    """One joint's drive with every check and its series."""
    checks = tuple(placed(op.demand.cycle, check) for check in checks_of(op))
    loss, housing = op.number("figures.gear_loss"), op.number("figures.housing_temperature")
    (peak, mean), *_ = power_allowance(op.judgement.case.reshape(1)).tolist()
    return JointResult(
        name, motor, gear, op.drive, checks, op.series(), tuple(_remarks(op)),
        gear_loss=None if op.direct or math.isnan(loss) else loss,
        housing_temperature=housing if math.isfinite(housing) else None, amplifier=op.task.amplifier,
        power_allowance=(peak, mean),
    )  # fmt: skip


def _remarks(op: Operation) -> list[str]:
    """Remarks on the drive as a whole."""
    demand = op.demand
    remarks = []
    if op.task.coupled:
        others = ", ".join(op.task.coupled)
        remarks.append(f"drives {others} together with others: torque, speed and position are its shaft's")
    if op.task.sharing:
        remarks.append(_shared(op))
    if op.missing:
        remarks.append(f"{op.missing} unknown: motor torque, current and power are shown without it, for information")
    holds = bool(np.any(demand.gear_torque[demand.at_rest == 1] != 0.0))
    if holds and demand.moves:
        remarks.append(
            f"at rest: heat is that of {HELD[op.study.holding]}; "
            "peaks are those of the larger torque that starts the motion"
        )
    elif holds:
        remarks.append(f"the joint never moves: its torque is {HELD[op.study.holding]}")
    locks = mesh_of(op.judgement.case.gear).driven <= 0.0
    if _loaded_at_rest(demand) and not locks and not op.drive.motor.brake.key:
        remarks.append(
            "holds a load at rest and has no brake: with the power off, only friction holds it; `brake: true` adds one"
        )
    if locks:
        remarks.append("the gear locks itself: the load cannot drive the motor, which must help it down")
    if not op.figures.heat_converged:
        remarks.append("magnet and housing temperature could not be matched: temperatures are approximate")
    return remarks


def _loaded_at_rest(demand: JointDemand) -> bool:
    """Whether the joint must hold a load while all joints are at rest, or itself is, if the others never are with it.

    Only then does the load remain if the power fails: joints that accelerate load those at rest too.
    """
    cycle, torque = demand.cycle, np.abs(demand.gear_torque)
    still = np.all([resting(speed) for speed in cycle.velocity.T], axis=0) & ~np.any(cycle.acceleration, axis=1)
    held = torque[still if np.any(still) else demand.at_rest]
    return bool(np.max(held, initial=0.0) > LOADED * np.max(torque, initial=0.0))


def _shared(op: Operation) -> str:
    """Remark on two motors that share an axis."""
    torque, preload = op.demand.gear_torque, op.task.preload or 0.0
    text = f"one of two motors of {op.task.sharing[0]}: half of the load"
    if preload == 0.0:
        return f"{text}, without a preload"
    text = f"{text} {'plus' if preload > 0.0 else 'minus'} {abs(preload):.4g} N m of preload"
    half = np.abs(torque - preload)
    if half.max() < abs(preload):
        return f"{text}, which keeps the backlash closed"
    share = 100.0 * op.demand.mean(np.where(half >= abs(preload), 1.0, 0.0))
    return f"{text}; for {share:.3g} % of the time the backlash is open: above {half.max():.4g} N m it stays closed"


def shared_checks(study: Study, results: Mapping[str, JointResult], *, quick: bool = False) -> tuple[Check, ...]:
    """The checks of all joints together; with ``quick``, stops of the arm are integrated until the first violation."""
    study, lacking = with_chosen(study, results), [name for name, one in results.items() if not one.torque_known]
    every = [result.series for result in results.values()]
    power = np.sum([(one.electrical_power, one.least_power) for one in every], axis=0)
    more = np.sum([one.power_allowance for one in results.values()], axis=0)
    checks = supply_checks(study, power, unknown=", ".join(lacking), more=more)
    found = tuple(placed(study.cycle, check) for check in checks)
    torque, drives = np.column_stack([one.gear_torque for one in every]), {k: one.drive for k, one in results.items()}
    found += tuple(placed(study.cycle, check) for check in arm_checks(study, drives, torque))
    if len(drives) == len(study.joints):
        found += tuple(placed(study.cycle, check) for check in stop_checks(study, drives, quick=quick))
    unknown = massless(study, results)
    if unknown:
        remark = f"unknown at {', '.join(unknown)}: the joints before are checked with too little load"
        found += (Check(UNWEIGHED, None, None, "kg", None, Verdict.NOT_CHECKED, remark=remark, essential=True),)
    return found


def _unknown_keys(study: Study, task: JointTask, pair: Pair) -> list[Fault]:
    (motor, gear), catalog, faults = pair, study.catalog, list[Fault]()
    brakes = [brake.key for brake in task.brakes]
    if motor not in catalog.motors:
        hint = nearest(motor, motors_at(task, catalog))
        faults.append(Fault(f"drives.{task.name}.motor", "is not in the catalogue", motor, hint))
    elif brakes and catalog.motors[motor].brake.key not in brakes:
        hint = f"such as {motor}+{brakes[0]}"
        faults.append(Fault(f"drives.{task.name}.motor", "needs the key of a brake beside its own", motor, hint))
    if gear and gear not in catalog.gears:
        faults.append(
            Fault(f"drives.{task.name}.gear", "is not in the catalogue", gear, nearest(gear, gears_at(task, catalog)))
        )
    return faults
