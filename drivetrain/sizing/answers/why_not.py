"""Why a part was not chosen: by which rule, by which check, what would let it pass, and what it would cost."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from drivetrain.catalog.read import compatible_pairs
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.answers.smallest_change import smallest_changes
from drivetrain.sizing.answers.why_not_results import PairAnswer, SmallestChange, Standing, WhyNot
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import NO_GEAR, Pair, joint_result
from drivetrain.sizing.judge.missing import lacking_parts, row_of
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.results import JointResult, Selection
from drivetrain.sizing.search.search import select
from drivetrain.sizing.tolerance.bench import Bench, worst_of
from drivetrain.study.mounting import drive_mass, mass_counts
from drivetrain.study.put_aside import put_aside
from drivetrain.study.study import JointTask, Study
from drivetrain.study.verdicts import Verdict


@dataclass(frozen=True, eq=False)
class _Question:
    """What is asked: a motor, a gear or both, beside a chosen set."""

    study: Study
    motor: str | None
    gear: str | None
    chosen: Mapping[str, Pair]
    family: WorkFamily


@dataclass(frozen=True, eq=False)
class _Tried:
    """One pair judged beside the chosen set."""

    keys: Pair
    result: JointResult
    lacks: tuple[str, ...]

    @property
    def holds(self) -> bool:
        return not self.lacks and self.result.verdict is not Verdict.FAIL

    @property
    def distance(self) -> float:
        """How far from holding; last what cannot be judged."""
        return math.inf if self.lacks else worst_of(self.result.checks).utilisation


def why_not(
    study: Study,
    joint: str | None = None,
    motor: str | None = None,
    gear: str | None = None,
    *,
    selection: Selection | None = None,
    cost: bool = True,
) -> WhyNot:
    """Why a motor, a gear or a pair of both was not chosen, at one joint or at every one.

    It is put in the place of the chosen drive, the other drives of the chosen set left as they are. Where it falls,
    the smallest change of gear ratio, payload, cycle time and supply voltage that would let it pass is found and
    evaluated. Whether it is chosen in any set, and what that set is worth, is a search of its own with the part fixed.

    Args:
        study: The task.
        joint: Name of the joint; None: all of them.
        motor: Key or part number; None: any that goes with the gear.
        gear: Key or part number, "" or "none" for a direct drive; None: any that goes with the motor.
        selection: From ``select``; None: selected here.
        cost: Look for the best set that has the part.

    Returns:
        One answer a joint.

    Raises:
        InputError: Neither motor nor gear is named, or no joint, motor or gear has the name; all of them at once, with
            the nearest names.
    """
    key, wheel = _named(study, joint, motor, gear)
    found = select(study) if selection is None else selection
    chosen = {name: (one.motor, one.gear) for name, one in found.evaluation.joints.items()}
    question = _Question(study, key, wheel, chosen, WorkFamily(study))
    joints = [i for i, task in enumerate(study.joints) if joint in (None, task.name)]
    return WhyNot(study, key, wheel, found, tuple(_answer(question, i, cost) for i in joints))


def _named(
    study: Study, joint: str | None, motor: str | None, gear: str | None
) -> tuple[str | None, str | None]:  # fmt: skip
    """The keys of the rows that are meant."""
    faults: list[Fault] = []
    names = [task.name for task in study.joints]
    if joint is not None and joint not in names:
        faults.append(Fault("joint", "is no joint of the study", joint, nearest(joint, names)))
    if motor is None and gear is None:
        hint = "keys of the catalogue: --motor KEY, --gear KEY"
        faults.append(Fault("part", "name a motor, a gear or both", hint=hint))
    key = None if motor is None else _key("motor", motor, study.catalog.motors, faults)
    wheel = "" if gear in NO_GEAR and gear is not None else gear
    if wheel:
        wheel = _key("gear", wheel, study.catalog.gears, faults)
    if faults:
        raise InputError(faults)
    return key, wheel


def _key(what: str, name: str, rows: Mapping[str, Motor] | Mapping[str, Gear], faults: list[Fault]) -> str:
    """The key of a row that has this key, or alone has this part number."""
    if name in rows:
        return name
    folded = name.casefold()
    same = [key for key, row in rows.items() if folded in (key.casefold(), row.part_number.casefold())]
    if len(same) == 1:
        return same[0]
    if same:
        faults.append(Fault(what, "several rows have this part number: name one by its key", name, ", ".join(same)))
    else:
        known = [*rows, *(row.part_number for row in rows.values() if row.part_number)]
        faults.append(Fault(what, "no row of the catalogue has this key or part number", name, nearest(name, known)))
    return name


def _answer(question: _Question, joint: int, cost: bool) -> PairAnswer:
    """One joint."""
    study, task = question.study, question.study.joints[joint]
    pairs = _pairs(question, task)
    if not pairs:
        words = put_aside(task, study.catalog, question.motor, question.gear)
        words = words or ("nothing in the catalogue that the study allows goes with it",)
        motor, gear = question.motor or "", question.gear or ""
        return PairAnswer(
            task.name, motor, gear, Standing.NO_PARTNER, words, 0, 0, None, None, (), (), None
        )  # fmt: skip
    tried = [_tried(question, joint, pair) for pair in pairs]
    holding = [one for one in tried if one.holds]
    shown = min(holding, key=lambda one: _weight(one.result)) if holding else min(tried, key=lambda one: one.distance)
    if question.chosen[task.name] in pairs:
        shown = next(one for one in tried if one.keys == question.chosen[task.name])
    failed = [check for check in shown.result.checks if check.verdict is Verdict.FAIL]
    furthest = worst_of(failed).check
    standing = _standing(question, shown, task)
    return PairAnswer(
        task.name, *shown.keys, standing, _passed_over(question, task, shown), len(pairs), len(holding),
        shown.result, next((check for check in failed if check.name == furthest), None), shown.lacks,
        _changes(question, joint, shown) if standing is Standing.FALLS else (),
        _best_with(study, joint, pairs) if cost and standing in (Standing.HOLDS, Standing.FALLS) else None,
    )  # fmt: skip


def _pairs(question: _Question, task: JointTask) -> tuple[Pair, ...]:
    """The pairs that are asked after at a joint: as the study allows them, else as the catalogue does."""
    motor, gear, catalog = question.motor, question.gear, question.study.catalog
    if motor is not None and gear is not None:
        return ((motor, gear),)

    def meant(pairs: Iterable[Pair]) -> tuple[Pair, ...]:
        return tuple(pair for pair in pairs if motor in (None, pair[0]) and gear in (None, pair[1]))

    allowed = meant(task.pairs if task.drive is None else (*task.pairs, task.drive))
    if allowed or gear == "":
        return allowed
    motors = sorted({pair[0] for pair in task.pairs}) if motor is None else [motor]
    gears = sorted({pair[1] for pair in task.pairs if pair[1]}) if gear is None else [gear]
    return tuple(compatible_pairs(catalog, motors or None, gears or None))


def _bench(question: _Question, joint: int, pair: Pair) -> Bench:
    return Bench(question.family, {**question.chosen, question.study.joints[joint].name: pair})


def _tried(question: _Question, joint: int, pair: Pair) -> _Tried:
    op = _bench(question, joint, pair).run(joint)
    result = joint_result(op, question.study.joints[joint].name, *pair)
    return _Tried(pair, result, tuple(check.name for check in result.lacking))


def _weight(result: JointResult) -> float:
    mass = drive_mass(result.drive)
    return math.inf if mass is None else mass


def _standing(question: _Question, shown: _Tried, task: JointTask) -> Standing:
    if shown.keys == question.chosen[task.name] and shown.holds:
        return Standing.CHOSEN
    if shown.lacks:
        return Standing.NOT_JUDGED
    return Standing.HOLDS if shown.holds else Standing.FALLS


def _passed_over(question: _Question, task: JointTask, shown: _Tried) -> tuple[str, ...]:
    """Rules of the study and missing data for which the shown pair may not be chosen."""
    study = question.study
    words = list(put_aside(task, study.catalog, *shown.keys))
    drive, joint = shown.result.drive, [one.name for one in study.joints].index(task.name)
    for column in ("mass", "price"):
        for part in lacking_parts(drive, column):
            counted = weight_of(study.wanted, column) != 0.0
            if counted or (column == "mass" and mass_counts(study, joint)):
                why = f"the study minimises the {column}" if counted else "it loads the joints before"
                words.append(f"its {column} is unknown ({part.key}, {row_of(study, part)}), and {why}")
    return tuple(words)


def _changes(question: _Question, joint: int, shown: _Tried) -> tuple[SmallestChange, ...]:
    task = question.study.joints[joint]
    allowed = [gear for motor, gear in task.pairs if motor == shown.keys[0]]
    published = sorted(question.study.catalog.pairs.get(shown.keys[0], ()))
    return smallest_changes(_bench(question, joint, shown.keys), joint, allowed or published)


def _best_with(study: Study, joint: int, pairs: Sequence[Pair]) -> Selection:
    """The best set in which one joint has one of some pairs."""
    task = replace(study.joints[joint], drive=None, pairs=tuple(pairs))
    if len(pairs) == 1:
        task = replace(study.joints[joint], drive=pairs[0])
    joints = tuple(task if i == joint else other for i, other in enumerate(study.joints))
    return select(replace(study, joints=joints))
