"""Checks before a search, with all faults reported at once: options, missing data, joints without candidates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from numbers import Real

import numpy as np

from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.sizing.judge.checks import STOP_CHECKS, SUPPLY_CHECKS
from drivetrain.sizing.judge.missing import cells_to_fill, massless
from drivetrain.sizing.judge.objectives import TERMS, weight_of
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.problem import Problem
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.selection import SelectionOptions
from drivetrain.study.parts.verdicts import Check, Verdict

SHEET = ("mass", "price")  # values of data sheets; energy and utilisation are computed
MOST_NAMED = 3


def check_options(study: Study, wanted: SelectionOptions | None) -> None:
    """Raise InputError for options that no search can satisfy; a study from a file has passed this already.

    ``wanted``: options that replace those of the study; None: those of the study.
    """
    if not isinstance(study, Study):
        raise InputError(Fault("study", "must be a study", type(study).__name__, "load_study reads one from its file"))
    options = study.wanted if wanted is None else wanted
    if not isinstance(options, SelectionOptions):
        raise InputError(Fault("wanted", "must be SelectionOptions", type(options).__name__))
    raise_faults([*_of_numbers(options), *_of_weights(options), *_of_groups(study, options)])


def same_study(one: Study, other: Study) -> bool:
    """Whether two studies are equal, so that a search of one can be resumed with the other."""
    return one is other or (one.digest, one.catalog) == (other.digest, other.catalog)


def check_keys(study: Study) -> None:
    """Raise InputError for drives and candidates that are not in the catalogue; called once a key was not found."""
    raise_faults(fault for task in study.joints for fault in _of_keys(study, task))


def _of_numbers(options: SelectionOptions) -> Iterator[Fault]:
    for name in ("sets", "most_motor_types", "most_gear_types"):
        value = getattr(options, name)
        if value is not None and not (isinstance(value, int | np.integer) and value >= 1):
            yield Fault(f"wanted.{name}", "must be a whole number, 1 or more", value)
    if options.holds is not None and not (isinstance(options.holds, Real) and 0.0 < options.holds < 1.0):
        yield Fault("wanted.holds", "must be a probability between 0 and 1", options.holds, "such as 0.99")
    if not (isinstance(options.time_limit, Real) and options.time_limit >= 0.0):
        yield Fault("wanted.time_limit", "must be 0 or more [s]", options.time_limit)


def _of_weights(options: SelectionOptions) -> Iterator[Fault]:
    if not isinstance(options.weights, tuple | list) or not all(map(_is_weight, options.weights)):
        hint = 'such as (("mass", 1.0),)'
        yield Fault("wanted.weights", "must be pairs of a term and its weight", options.weights, hint)
        return
    if not any(weight > 0.0 for _, weight in options.weights):
        yield Fault("wanted.weights", "needs a weight above 0", options.weights, f"for one of {', '.join(TERMS)}")
    for name, weight in options.weights:
        if name not in TERMS:
            yield Fault("wanted.weights", "is no term of an objective", name, nearest(str(name), TERMS))
        elif not 0.0 <= weight < math.inf:
            yield Fault(f"wanted.weights.{name}", "must be 0 or more, and finite", weight)


def _is_weight(pair: object) -> bool:
    return isinstance(pair, tuple | list) and len(pair) == 2 and isinstance(pair[1], Real)


def _of_groups(study: Study, options: SelectionOptions) -> Iterator[Fault]:
    names = study.joint_names
    for group in options.same_family:
        if isinstance(group, str):
            yield Fault("wanted.same_family", "must be groups of joints", group, 'such as (("joint_1", "joint_2"),)')
            continue
        for name in group:
            if name not in names:
                yield Fault("wanted.same_family", "is no joint of the study", name, nearest(str(name), names))


def _of_keys(study: Study, task: JointTask) -> Iterator[Fault]:
    """Faults of the first pair with an unknown motor and of the first with an unknown gear."""
    motors, gears = study.catalog.motors, study.catalog.gears
    motor = next((one for one, _ in task.choices if one not in motors), None)
    gear = next((one for _, one in task.choices if one and one not in gears), None)
    if motor is not None:
        yield Fault(f"joints.{task.name}", "no motor has this key", motor, nearest(motor, motors))
    if gear is not None:
        yield Fault(f"joints.{task.name}", "no gear has this key", gear, nearest(gear, gears))


# Missing masses and prices of candidates.


def lacking_of(study: Study, name: str) -> dict[str, tuple[int, int]]:
    """By joint, how many candidates have no known mass or price, and how many candidates there are."""
    found = {}
    for task in study.joints:
        pairs = task.choices
        lacks = sum(any(getattr(row, name) is None for row in _rows(study, *pair)) for pair in pairs)
        lacks = len(pairs) if _unpriced(task, name) else lacks
        found[task.name] = (lacks, len(pairs))
    return found


def words_of(study: Study, name: str) -> str:
    """The joints at which no candidate has a known mass or price, in words; empty if there are none."""
    bare = {joint: count for joint, (lacks, count) in lacking_of(study, name).items() if count and lacks == count}
    if not bare:
        return ""
    joints = ", ".join(f"{count} at {joint}" for joint, count in bare.items())
    parts = []
    for kind, keys in zip(("motors", "gears", "amplifiers"), _keys(study, name, bare), strict=True):
        if keys:
            some = ", ".join(sorted(keys)[:MOST_NAMED]) + (", ..." if len(keys) > MOST_NAMED else "")
            parts.append(f"{len(keys)} {kind} ({some})")
    return f"no candidate has a known {name}: {joints}; without one are the rows of {' and '.join(parts)}"


def unknown_terms(study: Study) -> list[Fault]:
    """Faults for terms of the objective that are unknown for all candidates of some joint without a given drive."""
    found = []
    study = replace(study, joints=tuple(task for task in study.joints if task.drive is None))
    for name in TERMS:
        words = words_of(study, name) if name in SHEET and weight_of(study.wanted, name) else ""
        if words:
            hint = f"fill the column {name} of the catalogue, or minimise something else"
            found.append(Fault("objective", words, name, hint))
    return found


def _unpriced(task: JointTask, name: str) -> bool:
    """Whether the term is the price and none of the joint's amplifiers has one."""
    return name == "price" and bool(task.amplifiers) and all(one.price is None for one in task.amplifiers)


def _rows(study: Study, motor: str, gear: str) -> list[Motor | Gear]:
    """The catalogue rows of a pair, as far as they exist."""
    catalog = study.catalog
    rows: list[Motor | Gear] = [catalog.motors[motor]] if motor in catalog.motors else []
    return rows + ([catalog.gears[gear]] if gear in catalog.gears else [])


def _keys(study: Study, name: str, joints: dict[str, int]) -> tuple[set[str], set[str], set[str]]:
    """Keys of motors, gears and amplifiers that lack a value, among the candidates of some joints."""
    motors: set[str] = set()
    gears: set[str] = set()
    amplifiers: set[str] = set()
    for task in study.joints:
        if task.name in joints and _unpriced(task, name):
            amplifiers |= {one.key for one in task.amplifiers}
        for motor, gear in task.choices if task.name in joints else ():
            for keys, key, rows in ((motors, motor, study.catalog.motors), (gears, gear, study.catalog.gears)):
                if key in rows and getattr(rows[key], name) is None:
                    keys.add(key)
    return motors, gears, amplifiers


# Joints without a candidate.


def nothing_to_choose(problem: Problem) -> tuple[Check, ...]:
    """A failed check, without a utilisation, for every joint that has no candidate."""
    return tuple(
        Check(
            f"candidates of {task.name}", 1.0, 0.0, "1", None, Verdict.FAIL,
            remark=_with_joints(_reason(problem, joint)[0], [task.name]),
        )
        for joint, task in enumerate(problem.candidates.study.joints) if not len(problem.eligible[joint])
    )  # fmt: skip


def why_nothing(problem: Problem) -> tuple[tuple[str, str], ...]:
    """Why joints have no candidate, and what would fix it, in words; joints are grouped by reason."""
    joints: dict[tuple[str, str], list[str]] = {}
    for joint, task in enumerate(problem.candidates.study.joints):
        if not len(problem.eligible[joint]):
            joints.setdefault(_reason(problem, joint), []).append(task.name)
    return tuple((_with_joints(reason, names), fix) for (reason, fix), names in joints.items())


def _reason(problem: Problem, joint: int) -> tuple[str, str]:
    """Why a joint has no candidate, with a placeholder for its name, and what would fix it."""
    offered, pairs, task = problem.candidates, problem.lacking_data[joint], problem.candidates.study.joints[joint]
    if not len(pairs):
        return "{} neither a given drive nor a candidate", "" if task.pairs else "; ".join(task.passed_over)
    terms, cells = [], []
    for term, values in (("mass", offered.mass), ("price", offered.price)):
        if np.isnan(values[pairs]).any() and (term == "mass" or weight_of(problem.options, term)):
            terms.append(term)
            some = task.amplifiers if _unpriced(task, term) else ()
            cells.append(cells_to_fill(offered.study, [offered.keys(pair) for pair in pairs], term, some))
    return f"none of the {len(pairs)} candidates of {{}} has a known {' and '.join(terms)}", "; ".join(cells)


def _with_joints(reason: str, names: list[str]) -> str:
    """A reason with the names of its joints filled in."""
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    if reason.startswith("{} "):
        return reason.format(f"{listed} {'has' if len(names) == 1 else 'have'}")
    return reason.format(listed)


# Fixed drives.


def satisfied(evaluation: Evaluation) -> bool:
    """Whether a set is feasible; a drive that the study fixes may lack data.

    Data may not be missing for checks of the whole set: for a stop of all joints, and for the supply if no drive is
    fixed.
    """
    if evaluation.feasible:
        return True
    given = evaluation.study.given_drives.keys()
    lacking = {name for name, joint in evaluation.joints.items() if joint.lacking}
    lacking |= set(massless(evaluation.study, evaluation.joints))
    rows = STOP_CHECKS if given else (*STOP_CHECKS, *SUPPLY_CHECKS)
    of_set = {check.name for check in evaluation.lacking} & {row.name for row in rows}
    return evaluation.verdict is not Verdict.FAIL and lacking <= given and not of_set
