"""Given drives held against a study: from the tip to the base, each loading the joints before it."""

from __future__ import annotations

from collections.abc import Mapping

from drivetrain.drive.drive import Drive
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.demand.demand import Workload, workload
from drivetrain.sizing.judge.checks import reported
from drivetrain.sizing.judge.checks_supply import supply_checks
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.judge import joint_result, placed
from drivetrain.sizing.judge.missing import massless
from drivetrain.sizing.judge.objectives import criteria, weighted
from drivetrain.sizing.judge.operation import operation
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import Study
from drivetrain.study.verdicts import UNWEIGHED, Check

Pair = tuple[str, str]
Given = tuple[str, str | None]
GIVE = "give the joint in the study a `drive: {motor: KEY, gear: KEY}`, or let `select` choose one"
NO_GEAR = ("", "none", None)  # what may stand for the gear of a direct drive


def evaluate(study: Study, drives: Mapping[str, Given] | None = None) -> Evaluation:
    """Every limit of every drive held against the task.

    Args:
        study: The task.
        drives: Keys of (motor, gear) by joint name, for a direct drive the gear key "", "none" or None; a joint that
            is not named keeps the drive that the study gives it.

    Returns:
        Every check of every joint and of the supply.

    Raises:
        InputError: Unknown joints, motors or gears, or a joint without a drive; all of them at once.
    """
    if not isinstance(study, Study):
        problem, hint = "must be a study", "load_study reads one from its file"
        raise InputError(Fault("study", problem, type(study).__name__, hint))
    return evaluated(workload(study), given_drives(study, drives or {}))


def evaluated(work: Workload, keys: Mapping[str, Pair], more: tuple[Check, ...] = ()) -> Evaluation:
    """Drives held against a task that is already prepared."""
    study, shelf = work.study, Shelf(work.study)
    tasks = {i: task for i, task in enumerate(study.joints) if task.name in keys}
    mounted = {i: shelf.drive(task, *keys[task.name]) for i, task in tasks.items()}
    results = {task.name: evaluate_joint(work, mounted, i, keys[task.name]) for i, task in tasks.items()}
    return evaluation_of(study, results, more + (shared_checks(study, results) if results else ()))


def evaluate_drives(study: Study, drives: Mapping[str, Drive]) -> Evaluation:
    """Drives that need be in no catalogue, held against the task.

    Args:
        study: The task.
        drives: By joint name, every joint, their unknowns filled.

    Returns:
        Every check of every joint and of the supply.

    Raises:
        InputError: Unknown joints, or a joint without a drive.
    """
    names = [task.name for task in study.joints]
    unknown = [name for name in drives if name not in names]
    faults = [Fault(f"drives.{name}", "is no joint", name, nearest(name, names)) for name in unknown]
    faults += [Fault(f"joints.{name}", "has no drive") for name in names if name not in drives]
    if faults:
        raise InputError(faults)
    work, mounted = workload(study), {i: drives[name] for i, name in enumerate(names)}
    results = {
        name: evaluate_joint(work, mounted, i, (drives[name].motor.key, drives[name].gear.key))
        for i, name in enumerate(names)
    }
    return evaluation_of(study, results, shared_checks(study, results))


def evaluation_of(study: Study, results: dict[str, JointResult], shared: tuple[Check, ...]) -> Evaluation:
    """The results of all joints as one evaluation, with what the set is worth."""
    found = criteria(study, results, shared)
    return Evaluation(study, results, shared, weighted(study.wanted, found), found)


def given_drives(study: Study, drives: Mapping[str, Given]) -> dict[str, Pair]:
    """The drive of every joint: the caller's, else the study's.

    Args:
        drives: Keys of (motor, gear) by joint name.

    Raises:
        InputError: Unknown joints, motors or gears, or a joint without a drive; all of them at once.
    """
    if not isinstance(drives, Mapping):
        raise InputError(Fault("drives", "must give (motor key, gear key) by joint name", drives))
    names = [task.name for task in study.joints]
    faults = [
        Fault(f"drives.{name}", "is no joint of the study", name, nearest(name, names))
        for name in drives
        if name not in names
    ]
    found: dict[str, Pair] = {}
    for task in study.joints:
        given = drives.get(task.name, task.drive)
        if given is None:
            faults.append(Fault(f"drives.{task.name}", "has no drive", None, GIVE))
        elif isinstance(given, str) or len(given) != 2:
            faults.append(Fault(f"drives.{task.name}", "must be a motor key and a gear key", given))
        else:
            pair = (given[0], "" if given[1] in NO_GEAR else str(given[1]))
            faults += _unknown_keys(study, task.name, pair)
            found[task.name] = pair
    if faults:
        raise InputError(faults)
    return found


def evaluate_joint(work: Workload, mounted: Mapping[int, Drive], joint: int, keys: Pair) -> JointResult:
    """One joint's drive with every check; the search judges by the same functions."""
    demand = work.at(joint, mounted).demand(mounted[joint])
    return joint_result(operation(work.study, joint, demand, mounted[joint]), work.study.joints[joint].name, *keys)


def shared_checks(study: Study, results: Mapping[str, JointResult]) -> tuple[Check, ...]:
    """The checks of all joints together.

    Returns:
        The supply's power [W]; and, where an unknown mass leaves joints too lightly loaded, that it was not checked.
    """
    lacking = [name for name, result in results.items() if not result.torque_known]
    found = supply_checks(
        study.supply, study.cycle.time, study.cycle.weights,
        {name: result.series.electrical_power for name, result in results.items()},
        reserve=study.safety.reserve, unknown=", ".join(lacking),
    )  # fmt: skip
    found = tuple(placed(study.cycle, check) for check in found)
    unknown = massless(study, results)
    if unknown:
        remark = f"unknown at {', '.join(unknown)}: the joints before are judged too lightly"
        found += (reported(UNWEIGHED, "kg", None, remark),)
    return found


def _unknown_keys(study: Study, joint: str, pair: Pair) -> list[Fault]:
    motor, gear = pair
    catalog, faults = study.catalog, []
    if motor not in catalog.motors:
        hint = nearest(motor, catalog.motors)
        faults.append(Fault(f"drives.{joint}.motor", "is not in the catalogue", motor, hint))
    if gear and gear not in catalog.gears:
        faults.append(Fault(f"drives.{joint}.gear", "is not in the catalogue", gear, nearest(gear, catalog.gears)))
    return faults
