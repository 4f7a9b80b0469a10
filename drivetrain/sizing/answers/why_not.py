"""Why a part was not chosen: which rule or check excludes it, what change would make it feasible, and its cost.

The smallest feasible change of one quantity is bracketed in steps from no change outwards and then found by bisection.
Both ends of the final bracket are evaluated in full.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetrain.catalog.read import compatible_pairs
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, bare_key
from drivetrain.errors import Fault, InputError, nearest, raise_faults, whole_name
from drivetrain.sizing.answers.ratio import NearGear, near_gears, partners
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.evaluate import NO_GEAR, Pair
from drivetrain.sizing.judge.missing import lacking_parts, row_of
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.judge.vary import (
    EDGE,
    MOST,
    Edge,
    Number,
    Setup,
    Vary,
    Worst,
    first_edge,
    lighter_work,
    named_drives,
    ratio_number,
    task_number,
    worst_of,
)
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.sizing.search.preconditions import same_study
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange
from drivetrain.study.model import JointTask, Study, pair_name
from drivetrain.study.parts.candidates import excluded_by, with_brakes
from drivetrain.study.parts.mounting import drive_mass, mass_counts
from drivetrain.study.parts.verdicts import Check, Verdict, worst

RATIO_STEPS = 64
SLOWEST = 1e4  # factor on the cycle time at which only weight and friction matter
AT_THE_OUTPUT = {
    "gear repeated peak torque", "gear momentary peak torque", "gear average torque", "output bearing tilting moment",
    "output bearing axial load", "output bearing radial load",
}  # fmt: skip


class Standing(StrEnum):
    """Status of a pair at a joint, given the other drives of the chosen set."""

    CHOSEN = "chosen"
    FEASIBLE = "feasible, not chosen"
    REJECTED = "rejected"
    NOT_JUDGED = "cannot be checked"
    NO_PARTNER = "has no partner"


@dataclass(frozen=True)
class SmallestChange:
    """The smallest change of one quantity that makes a drive feasible, or the reason why none does."""

    what: str  # ``gear ratio``, ``payload``, ``cycle time`` or ``supply voltage``
    unit: str  # unit of the values; empty for a ratio
    before: float
    after: float | None = None  # value at which it is feasible, by a full evaluation; None: no change helps
    short: float | None = None  # value just short of it, at which it is infeasible, by a full evaluation
    check: str = ""  # check that fails at ``short``; if no change helps, the one that still exceeds its limit
    utilisation: float = 0.0  # utilisation of that check, at ``short`` or at the largest change tried
    set_holds: bool = False  # whether the whole set of drives is feasible with the change
    reason: str = ""  # why no change helps
    gear: NearGear | None = None  # the feasible catalogue gear nearest in ratio


@dataclass(frozen=True, eq=False)
class PairAnswer:
    """The answer for one joint; the gear of a direct drive, or of a part without a partner, is ""."""

    joint: str
    motor: str
    gear: str
    standing: Standing
    passed_over: tuple[str, ...]  # rules of the study and missing data that exclude it, in sentences
    partners: int  # number of evaluated pairs with the part; 1 if a pair was named
    holding: int  # number of these that are feasible given the other chosen drives
    result: JointResult | None  # every check given the other chosen drives; None without a partner
    failed: Check | None  # the failed check with the highest utilisation
    lacking: tuple[str, ...]  # essential checks for which data are missing
    changes: tuple[SmallestChange, ...]  # one for each quantity; empty if the drive is feasible
    best: Selection | None  # the best set with a pair of the part; None if not requested, or if it is the chosen one


@dataclass(frozen=True, eq=False)
class WhyNot:
    """Why a part was not chosen.

    Attributes:
        study: The task.
        motor, gear: Keys of the part in question; None for one that is not specified.
        selection: The chosen set.
        answers: One answer for each joint in question.
    """

    study: Study
    motor: str | None
    gear: str | None
    selection: Selection
    answers: tuple[PairAnswer, ...]

    def __repr__(self) -> str:
        text = ", ".join(f"{one.joint} {one.standing}" for one in self.answers)
        pair = pair_name(self.motor or "any motor", "any gear" if self.gear is None else self.gear)
        return f"WhyNot({pair}: {text})"

    @property
    def holds(self) -> bool:
        """Whether the part is feasible at every joint in question."""
        return all(one.standing in (Standing.CHOSEN, Standing.FEASIBLE) for one in self.answers)


@dataclass(frozen=True, eq=False)
class _Question:
    """A motor, a gear or both in question, with the chosen set."""

    study: Study
    motor: str | None
    gear: str | None
    chosen: Mapping[str, Pair]
    family: WorkFamily
    setup: Setup


@dataclass(frozen=True, eq=False)
class _Tried:
    """Results of one pair in the chosen set."""

    keys: Pair
    setup: Setup
    result: JointResult

    @property
    def lacks(self) -> tuple[str, ...]:
        return tuple(check.name for check in self.result.lacking)

    @property
    def feasible(self) -> bool:
        return not self.lacks and self.result.verdict is not Verdict.FAIL

    @property
    def distance(self) -> float:
        """Largest utilisation; infinite if essential checks are missing."""
        return math.inf if self.lacks else worst_of(self.result.checks).utilisation

    @property
    def mass(self) -> float:
        mass = drive_mass(self.result.drive)
        return math.inf if mass is None else mass


def why_not(
    study: Study,
    joint: str | None = None,
    motor: str | None = None,
    gear: str | None = None,
    *,
    selection: Selection | None = None,
    cost: bool = True,
) -> WhyNot:
    """Why a motor, a gear or a pair was not chosen, at one joint or at every joint.

    The part replaces the chosen drive, and the other drives of the chosen set remain. If it is infeasible, the smallest
    changes of gear ratio, payload, cycle time, supply voltage and force at the tip that would make it feasible are
    found and evaluated. The best set with the part is found by a further search with the part fixed.

    Args:
        study: The task.
        joint: Name of the joint, or a part of it that no other name contains; None: all joints.
        motor: Key or part number; None: any motor compatible with the gear.
        gear: Key or part number, "" or "none" for a direct drive; None: any gear compatible with the motor.
        selection: Result of ``select``; None: the selection is made here.
        cost: Whether to search for the best set with the part.

    Returns:
        One answer per joint.

    Raises:
        InputError: Neither motor nor gear is named, or no joint, motor or gear has the name; all faults at once, with
        the nearest names; or the selection is one of another study.
    """
    joint, key, wheel = _named(study, joint, motor, gear)
    if selection is not None and not same_study(selection.study, study):
        raise InputError(Fault("selection", "is one of another study", selection.study.name))
    found = select(study) if selection is None else selection
    chosen, family = found.evaluation.drives, lighter_work(study)
    setup = Setup(family.at(TaskChange()), named_drives(study, chosen))
    question = _Question(study, key, wheel, chosen, family, setup)
    joints = [i for i, task in enumerate(study.joints) if joint in (None, task.name)]
    return WhyNot(study, key, wheel, found, tuple(_answer(question, i, cost) for i in joints))


def _named(study: Study, joint: str | None, motor: str | None, gear: str | None) -> tuple[str | None, ...]:
    """The joint and the catalogue keys by their names; InputError with all faults."""
    faults: list[Fault] = []
    if joint is not None:
        joint = whole_name("joint", "joint of the study", joint, study.joint_names, faults)
    if motor is None and gear is None:
        hint = "by its key or part number in the catalogue"
        faults.append(Fault("part", "name a motor, a gear or both", hint=hint))
    bare = {key: row for key, row in study.catalog.motors.items() if not row.brake.key}
    key = motor if motor in study.catalog.motors or motor is None else _key("motor", motor, bare, faults)
    wheel = "" if gear in NO_GEAR and gear is not None else gear
    if wheel:
        known = {key: row for key, row in study.catalog.gears.items() if not row.staged}
        wheel = wheel if wheel in study.catalog.gears else _key("gear", wheel, known, faults)
    raise_faults(faults)
    return joint, key, wheel


def _key(what: str, name: str, rows: Mapping[str, Motor] | Mapping[str, Gear], faults: list[Fault]) -> str:
    """The key of the row with this key or with this unique part number."""
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
    study, task = question.study, question.study.joints[joint]
    pairs, chosen = _pairs(question, task), question.chosen.get(task.name)
    if not pairs:
        words = excluded_by(task, study.catalog, question.motor, question.gear)
        words = words or ("nothing in the catalogue that the study allows goes with it",)
        motor, gear = question.motor or "", question.gear or ""
        return PairAnswer(task.name, motor, gear, Standing.NO_PARTNER, words, 0, 0, None, None, (), (), None)
    tried = [_tried(question, joint, pair) for pair in pairs]
    feasible = [one for one in tried if one.feasible]
    shown = min(feasible, key=lambda one: one.mass) if feasible else min(tried, key=lambda one: one.distance)
    shown = next((one for one in tried if one.keys == chosen), shown)
    failed = [check for check in shown.result.checks if check.verdict is Verdict.FAIL]
    furthest = worst_of(failed).check
    standing = Standing.NOT_JUDGED if shown.lacks else Standing.FEASIBLE if shown.feasible else Standing.REJECTED
    if shown.keys == chosen and shown.feasible:
        standing = Standing.CHOSEN
    return PairAnswer(
        task.name, *shown.keys, standing, _passed_over(question, joint, shown), len(pairs), len(feasible),
        shown.result, next((check for check in failed if check.name == furthest), None), shown.lacks,
        _smallest_changes(question, joint, shown.setup) if standing is Standing.REJECTED else (),
        _best_with(study, joint, pairs) if cost and standing in (Standing.FEASIBLE, Standing.REJECTED) else None,
    )  # fmt: skip


def _pairs(question: _Question, task: JointTask) -> tuple[Pair, ...]:
    """The pairs in question at a joint: those the study allows, else those the catalogue allows."""
    motor, catalog = question.motor, question.study.catalog
    gear = None if question.gear is None else task.staged.get(question.gear, question.gear)
    braked = [key for brake in task.brakes if (key := f"{motor}+{brake.key}") in catalog.motors]
    named = braked or (
        [] if motor is None else [motor]
    )  # if the joint needs a brake, a motor key stands for the motor with any of its brakes
    if motor is not None and gear is not None:
        return tuple((key, gear) for key in named)

    def meant(pairs: Iterable[Pair]) -> tuple[Pair, ...]:
        return tuple(pair for pair in pairs if (motor is None or pair[0] in named) and gear in (None, pair[1]))

    allowed = meant(task.pairs if task.drive is None else (*task.pairs, task.drive))
    if allowed or question.gear == "":
        return allowed
    # Published pairs name motors without brakes and gears without stages.
    rows, own = catalog.motors, {staged: key for key, staged in task.staged.items()}
    motors = sorted({bare_key(rows[one]) for one in (named or [pair[0] for pair in task.pairs])})
    gears = (
        sorted({own.get(pair[1], pair[1]) for pair in task.pairs if pair[1]}) if gear is None else [own.get(gear, gear)]
    )
    motors = motors or [key for key, row in rows.items() if not row.brake.key]
    found: Sequence[Pair] = compatible_pairs(catalog, motors, gears or None)
    found = with_brakes(catalog, found, task.brakes)[0] if task.brakes else found
    return tuple((key, task.staged.get(gear, gear)) for key, gear in found if not named or key in named)


def _tried(question: _Question, joint: int, pair: Pair) -> _Tried:
    setup = question.setup.with_keys(joint, *pair)
    return _Tried(pair, setup, setup.joint(joint))


def _passed_over(question: _Question, joint: int, shown: _Tried) -> tuple[str, ...]:
    """Rules of the study and missing data that exclude the shown pair."""
    study = question.study
    words = list(excluded_by(study.joints[joint], study.catalog, *shown.keys))
    for column in ("mass", "price"):
        for part in lacking_parts(shown.result.drive, column):
            counted = weight_of(study.wanted, column) != 0.0
            if counted or (column == "mass" and mass_counts(study, joint)):
                why = f"the study minimises the {column}" if counted else "it loads the joints before"
                words.append(f"its {column} is unknown ({part.key}, {row_of(study, part)}), and {why}")
    return tuple(words)


def _best_with(study: Study, joint: int, pairs: Sequence[Pair]) -> Selection:
    """The best set in which one joint has one of several pairs."""
    task = replace(study.joints[joint], drive=None, pairs=tuple(pairs))
    if len(pairs) == 1:
        task = replace(study.joints[joint], drive=pairs[0])
    joints = tuple(task if i == joint else other for i, other in enumerate(study.joints))
    return select(replace(study, joints=joints), advise=False)


def _smallest_changes(question: _Question, joint: int, setup: Setup) -> tuple[SmallestChange, ...]:
    """The smallest changes of ratio, payload, cycle time, voltage and force that make a joint's drive feasible."""
    study = question.study
    payload, pace, voltage, force = (
        task_number(question.family, setup.drives, vary)
        for vary in (Vary.PAYLOAD, Vary.CYCLE_TIME, Vary.VOLTAGE, Vary.FORCE)
    )
    slowest, held = _worst(pace, joint, pace.now * SLOWEST), ""
    if slowest.utilisation > 1.0 and study.arm is not None:
        held = f"; almost at standstill, {_needs(slowest)}"
    if study.arm is None:
        lighter = SmallestChange("payload", "kg", 0.0, reason="a load table gives the torques: it has no payload")
    elif payload.now == 0.0:
        lighter = SmallestChange("payload", "kg", 0.0, reason="nothing is carried")
    else:
        lighter = _smallest(payload, joint, Vary.PAYLOAD, f"without {question.family.payloads[0]}")
    weaker = (_smallest(force, joint, Vary.FORCE, "without a force at the tip"),) if force.now else ()
    return (
        _ratio(setup, joint), lighter,
        _smallest(pace, joint, Vary.CYCLE_TIME, f"in {MOST:g} times the time", held),
        _smallest(voltage, joint, Vary.VOLTAGE, f"with {MOST:g} times the voltage"), *weaker,
    )  # fmt: skip


def _worst(number: Number, joint: int, value: float) -> Worst:
    return worst_of(number.put(value).joint(joint).checks)


def _smallest(number: Number, joint: int, vary: Vary, furthest: str, held: str = "") -> SmallestChange:
    """The smallest feasible change of a quantity; or the check that fails at the largest change."""
    values = number.now * vary.outwards
    found = first_edge(lambda value: _worst(number, joint, value).utilisation <= 1.0, values)
    if found is not None:
        return _proven(number, joint, found)
    left, now = _worst(number, joint, float(values[-1])), _worst(number, joint, number.now)
    words = f"even {furthest}, {_needs(left)}"
    if left.check == now.check and not left.undecided and math.isclose(left.utilisation, now.utilisation, rel_tol=1e-9):
        words = f"{left.check} does not depend on it: needs {_percent(left)} of the limit"
    return SmallestChange(number.name, number.unit, number.now, check=left.check, utilisation=left.utilisation,
                          reason=words + held)  # fmt: skip


def _ratio(setup: Setup, joint: int) -> SmallestChange:
    number = ratio_number(setup, joint)
    if not setup.joint(joint).gear:
        return SmallestChange("gear ratio", "", number.now, reason="a direct drive has no ratio to change")
    up, down = (number.now * np.geomspace(1.0, end, RATIO_STEPS) for end in (MOST, 1.0 / MOST))
    found = [first_edge(lambda value: _worst(number, joint, value).utilisation <= 1.0, steps) for steps in (up, down)]
    known, gear = [one for one in found if one is not None], _nearest_gear(setup, joint)
    if known:
        nearer = min(known, key=lambda one: abs(math.log(one.inside / number.now)))
        return replace(_proven(number, joint, nearer), gear=gear)
    tried = {float(value): _worst(number, joint, float(value)) for value in (*down[:0:-1], *up)}
    there = min(tried, key=lambda value: (tried[value].utilisation, value))
    stays = tried[there]
    reason = f"no ratio from a tenth to ten times as large lets it pass: at the best, {there:.4g}, {_needs(stays)}"
    if stays.check in AT_THE_OUTPUT:
        reason = f"{stays.check} acts at the gear's output, whatever the ratio: {_percent(stays)} of the limit"
    return SmallestChange("gear ratio", "", number.now, check=stays.check, utilisation=stays.utilisation,
                          reason=reason, gear=gear)  # fmt: skip


def _nearest_gear(setup: Setup, joint: int) -> NearGear | None:
    """The feasible gear nearest in ratio; of ties, one of the same series and size first."""
    study, own, rows = setup.study, setup.drives[joint].gear, setup.study.catalog.gears
    motor = setup.drives[joint].motor.key

    def other(key: str) -> bool:
        row = rows[key]
        return (row.maker, row.series, row.size) != (own.maker, own.series, own.size)

    known = [key for key in partners(study, study.joints[joint], motor) if key in rows and key != own.key]
    for found, result in near_gears(setup, joint, motor, known, abs(own.ratio), last=other):
        if result.torque_known and result.binding is not None and result.verdict is not Verdict.FAIL:
            return replace(found, verdict=worst(check.verdict for check in result.checks), inside=True)
    return None


def _proven(number: Number, joint: int, found: Edge) -> SmallestChange:
    """Full evaluations on both sides of an edge, moved apart while rounding makes them contradict it."""
    passes, fails = found
    step = math.copysign(EDGE * max(abs(passes), abs(fails)), passes - fails)
    good, bad = number.put(passes).proven(), number.put(fails).proven()
    joints = good.study.joints
    name = joints[joint].name

    def rejected(evaluation: Evaluation) -> bool:
        return evaluation.joints[name].verdict in (Verdict.FAIL, Verdict.NOT_CHECKED)

    for _ in range(8):
        if rejected(good):
            passes += step
            good = number.put(passes).proven()
        if not rejected(bad):
            fails -= step
            bad = number.put(fails).proven()
    worst = worst_of(bad.joints[name].checks)
    return SmallestChange(
        number.name, number.unit, number.now, passes, fails, worst.check, worst.utilisation,
        good.feasible and len(good.joints) == len(joints),
    )  # fmt: skip


def _needs(found: Worst) -> str:
    """What a check that is not satisfied needs, in words."""
    if found.undecided:
        return f"{found.check} lacks data"
    return f"{found.check} needs {_percent(found)} of the limit"


def _percent(found: Worst) -> str:
    return f"{100.0 * found.utilisation:.4g} %" if math.isfinite(found.utilisation) else "without bound"
