"""The rejected candidates and the alternatives of a chosen set; if nothing is feasible, the nearest set and advice.

There may be half a million rejected candidates, so they are kept as arrays and become objects only when one is read.
Changes of the task that would fix an infeasible study are tried with the nearest set first, then by searches over all
candidates.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, overload

import numpy as np
import pandas as pd

from drivetrain.arrays import Array, Indices
from drivetrain.records import as_numbers
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.judge.arm_stops import needs_arm_stops
from drivetrain.sizing.judge.checks import CHECKS
from drivetrain.sizing.judge.missing import gaps, missing_words
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.judge.vary import (
    MOST,
    NOT_CHECKED,
    Vary,
    first_edge,
    lighter_work,
    named_drives,
    task_number,
)
from drivetrain.sizing.judge.words import AMPERES
from drivetrain.sizing.results import Evaluation, RejectedPair
from drivetrain.sizing.search.candidates import TABLE, build_candidates
from drivetrain.sizing.search.problem import Problem, build_problem
from drivetrain.sizing.search.tree import Tree, run_search
from drivetrain.study.change import heaviest
from drivetrain.study.model import Study, pair_name
from drivetrain.study.parts.mounting import mass_counts
from drivetrain.study.parts.verdicts import Check, Verdict, fails, lacking, shared_place

ALTERNATIVES = 5
FIRST_BATCH, MAX_BATCH = 64, 4096  # candidates judged in the first and in the largest batch
MARGIN = 1e-3  # relative, added to a change so that its printed digits are feasible too
CHANGE_STEPS = 8  # number of steps of a change for which all candidates are searched; bisection visits at most four
SEARCH_TIME = 5.0  # time limit of such a search [s]
SUPPLY = -1  # stands for the index of a joint: every joint has a feasible drive
FEASIBLE = -1
STOPS = ("gear momentary peak torque", "arm stop at full current")  # their remarks say how a gear is spared
LABELS = (*(c.name for c in CHECKS), *(c.name + NOT_CHECKED for c in CHECKS), "unknown mass", "unknown price")
UNITS = (*(c.unit for c in CHECKS), *(c.unit for c in CHECKS), "kg", "")

Alternatives = tuple[tuple[str, str, float], ...]


@dataclass(frozen=True, eq=False)
class GivenOthers:
    """Verdicts on candidates of one joint given the drives of other joints; K of them."""

    pairs: Indices  # indices into the pairs of the study, (K,)
    label: Indices  # index into LABELS of the check that rejects each; FEASIBLE if none does, (K,)
    figures: Array  # required, available and utilisation of that check, or of the binding one, (K, 3)

    @property
    def feasible(self) -> Indices:
        return self.pairs[self.label == FEASIBLE]


def given_others(problem: Problem, joint: int, pairs: Indices, chosen: Mapping[int, int]) -> GivenOthers:
    """Judge candidates; of the first failed stage of checks the check with the highest utilisation is reported."""
    if len(pairs) > MAX_BATCH:  # in batches, because records of a million candidates would fill the memory
        halves = np.array_split(pairs, 2)
        parts = [given_others(problem, joint, half, chosen) for half in halves]
        label, figures = (np.concatenate([getattr(one, name) for one in parts]) for name in ("label", "figures"))
        return GivenOthers(pairs, label, figures)
    found = problem.candidates.judge(joint, pairs, problem.candidates.parameters_of(chosen), until=1.0, quick=False)
    over = found.utilisation > 1.0
    lacking = ~over & (found.missing_check >= 0) & (not problem.candidates.joints[joint].is_fixed)
    check = np.where(lacking, found.missing_check, np.maximum(found.binding, 0))
    row, place, numbers = np.arange(len(pairs)), TABLE[check], as_numbers(found.cases)
    scale = np.array([one.scale for one in CHECKS])[check]
    required = numbers[row, place["required"]] * numbers[row, place["factor"]] * scale
    limit, least = numbers[row, place["limit"]], numbers[row, place["assumed_limit"]]
    available = np.where(lacking, math.nan, np.where(np.isnan(limit), least, limit) * scale)
    label = np.where(lacking, check + len(CHECKS), np.where(over, check, FEASIBLE))
    return GivenOthers(
        pairs, label, np.column_stack([required, available, np.where(lacking, math.inf, found.utilisation)])
    )


@dataclass(frozen=True, eq=False)
class Rejected(Sequence[RejectedPair]):
    """Every candidate that is rejected given a set of drives, judged on first access."""

    problem: Problem  # the selection problem
    chosen: Mapping[int, int]  # the set, pairs by joint; joints without one are left out

    @cached_property
    def _table(self) -> tuple[Indices, Indices, Indices, Array]:
        """Joint, pair and label of each, and required, available, utilisation and fixed cost, (rows, 4)."""
        problem, offered, parts = self.problem, self.problem.candidates, []
        for joint in sorted(self.chosen, reverse=True):
            found, unknown = (
                given_others(problem, joint, problem.eligible[joint], self.chosen),
                problem.lacking_data[joint],
            )
            out = found.label != FEASIBLE
            shares = problem.fixed_cost[found.pairs[out], np.newaxis]
            heavy = mass_counts(offered.study, joint) or weight_of(offered.study.wanted, "mass") != 0.0
            weightless = heavy & np.isnan(offered.mass[unknown])
            nothing = np.tile([math.nan, math.nan, math.inf, math.nan], (len(unknown), 1))
            pairs = np.concatenate([found.pairs[out], unknown])
            label = np.concatenate([found.label[out], np.where(weightless, len(LABELS) - 2, len(LABELS) - 1)])
            numbers = np.concatenate([np.hstack([found.figures[out], shares]), nothing])
            parts.append((np.full(len(pairs), joint), pairs, label, numbers))
        if not parts:
            none = np.zeros(0, dtype=np.int64)
            return none, none, none, np.zeros((0, 4))
        joints, every, labels, figures = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        return joints, every, labels, figures

    def __len__(self) -> int:
        return len(self._table[0])

    @overload
    def __getitem__(self, row: int) -> RejectedPair: ...

    @overload
    def __getitem__(self, row: slice) -> Sequence[RejectedPair]: ...

    def __getitem__(self, row: int | slice) -> RejectedPair | Sequence[RejectedPair]:
        """One candidate, or a list of them."""
        if isinstance(row, slice):
            return [self[i] for i in range(*row.indices(len(self)))]
        joint, pair, label, numbers = (column[row] for column in self._table)
        name, keys = self.problem.candidates.study.joints[joint].name, self.problem.candidates.keys(int(pair))
        required, available, used, share = (float(value) for value in numbers)
        return RejectedPair(name, *keys, LABELS[label], required, available, UNITS[label], used, share)

    def frame(self) -> pd.DataFrame:
        """All rejected candidates as a table."""
        joint, pair, label, numbers = self._table
        categories: Any = pd.Categorical.from_codes  # its annotations do not accept a list of names
        offered, units = self.problem.candidates, sorted(set(UNITS))
        motor, gear = offered.pairs[pair].T
        unit = np.array([units.index(one) for one in UNITS], dtype=np.int64)[label]
        required, available, used, share = numbers.T
        return pd.DataFrame(
            {
                "joint": categories(joint, offered.study.joint_names),
                "motor": categories(motor, list(offered.motors)), "gear": categories(gear, list(offered.gears)),
                "check": categories(label, list(LABELS)), "required": required, "available": available,
                "unit": categories(unit, units), "utilisation": used, "objective": share,
            }
        )  # fmt: skip


def alternatives(problem: Problem, chosen: Mapping[int, int]) -> dict[str, Alternatives]:
    """By joint name, the cheapest other candidates that are feasible given the drives after the joint."""
    found: dict[str, Alternatives] = {}
    for joint in sorted(chosen, reverse=True):
        others = problem.eligible[joint][problem.eligible[joint] != chosen[joint]]
        name = problem.candidates.study.joints[joint].name
        found[name] = tuple(
            (*problem.candidates.keys(int(one)), float(problem.fixed_cost[one]))
            for one in _first_feasible(problem, joint, others, chosen, ALTERNATIVES)
        )
    return found


def _first_feasible(problem: Problem, joint: int, pairs: Indices, chosen: Mapping[int, int], most: int) -> Indices:
    """The first feasible pairs of some pairs, at most ``most``."""
    found, size, start = np.zeros(0, dtype=np.int64), FIRST_BATCH, 0
    while start < len(pairs) and len(found) < most:
        part = given_others(problem, joint, pairs[start : start + size], chosen).feasible
        found, start, size = np.concatenate([found, part]), start + size, 2 * size
    return found[:most]


@dataclass(frozen=True, eq=False)
class Nearest:
    """The set of drives that is closest to feasible."""

    study: Study  # the task
    joint: int  # the joint nearest to the tip without a feasible candidate; SUPPLY: every joint has one
    pairs: dict[int, int]  # pair by joint, for joints with candidates
    keys: dict[str, tuple[str, str]]  # keys of (motor, gear) by joint name


def nearest_set(problem: Problem) -> Nearest:
    """Greedy set from the tip to the base: the cheapest feasible candidate, else the least overloaded one."""
    pairs: dict[int, int] = {}
    blocked = SUPPLY
    for joint in range(problem.n - 1, -1, -1):
        known = problem.eligible[joint]
        feasible = _first_feasible(problem, joint, known, pairs, 1)
        if not len(feasible) and blocked == SUPPLY:
            blocked = joint
        if len(known):
            pairs[joint] = int(feasible[0]) if len(feasible) else _nearest(problem, joint, pairs)
    return Nearest(problem.candidates.study, blocked, pairs, problem.keys(pairs))


def _nearest(problem: Problem, joint: int, chosen: Mapping[int, int]) -> int:
    """The least overloaded candidate: smallest maximum of the finite utilisations, no essential check missing.

    Thermal runaway has an infinite utilisation; the RMS current shows how far it is.
    """
    eligible, parameters, overload = problem.eligible[joint], problem.candidates.parameters_of(chosen), []
    for batch in np.array_split(eligible, range(MAX_BATCH, len(eligible), MAX_BATCH)):
        found = problem.candidates.judge(joint, batch, parameters, until=math.inf, quick=False, all_checks=True)
        used = np.where(np.isfinite(found.checks), found.checks, 0.0).max(axis=1, initial=0.0)
        overload.append(np.where(found.missing_check >= 0, math.inf, used))
    return int(eligible[np.argmin(np.concatenate(overload))])


def advice_on(evaluation: Evaluation, near: Nearest) -> tuple[str, ...]:
    """Why the nearest set is infeasible, and each single change of the task that would fix it, in words."""
    words = [_summary(evaluation, near), *_binding(evaluation, near)]
    if gaps(evaluation):
        return (*words, *missing_words(evaluation))
    family = lighter_work(near.study)
    tried = [_changed(near, family, vary) for vary in (Vary.CYCLE_TIME, Vary.PAYLOAD, Vary.VOLTAGE, Vary.FORCE)]
    found = [text for text in tried if text]
    if not found:
        pressing = near.study.cycle.tip_wrench is not None
        less = ["payload"] * _has_payload(near) + ["force at the tip"] * pressing
        lighter = "".join(f", nor less {one}" for one in less) + "," * bool(less)
        found = [
            f"With these drives neither a slower cycle (up to {MOST:g} times as long){lighter} nor more supply voltage "
            f"(up to {MOST:g} times) is enough by itself."
        ]
    paced = bool(tried[0]) or near.study.base is not None  # a moving base has a time of its own
    slower = (
        "" if paced else _smallest_for_others(near, family, Vary.CYCLE_TIME, np.geomspace(1.0, MOST, CHANGE_STEPS + 1))
    )
    lighter = (
        ""
        if tried[1] or not _has_payload(near)
        else _smallest_for_others(near, family, Vary.PAYLOAD, np.linspace(1, 0, CHANGE_STEPS + 1))
    )
    return (*words, *found, *(text for text in (slower, lighter) if text))


def _summary(evaluation: Evaluation, near: Nearest) -> str:
    """Where the nearest set is infeasible, in words."""
    if near.joint == SUPPLY:
        names = dict.fromkeys(one.name for one in evaluation.shared if one.verdict is Verdict.FAIL or lacking([one]))
        if names:
            return f"Every joint has a drive that meets its limits; together they do not pass: {', '.join(names)}."
        soft = ", or are not as stiff as wished" if near.study.stiffness.stated else ""
        hard = ", or load their gears too much as all stop at once" if needs_arm_stops(near.study) else ""
        return f"Every joint has a drive that meets its limits; together they need too much of the supply{soft}{hard}."
    name = near.study.joints[near.joint].name
    return f"No candidate at {name} meets all limits; the closest is {pair_name(*near.keys[name])}."


def _binding(evaluation: Evaluation, near: Nearest) -> list[str]:
    """The most exceeded check of each place: from the joint where the search stopped to the base, then the others."""
    found = []
    places = [(name, joint.checks) for name, joint in evaluation.joints.items()]
    shared = [(shared_place(check), (check,)) for check in evaluation.shared]
    for place, checks in [*places[near.joint :: -1], *places, *shared]:
        failed = [check for check in checks if fails(check)]
        if failed:
            check = max(failed, key=_excess)
            cause = f" Cause: {check.remark}." if check.name in STOPS and check.remark else ""
            found.append(f"Binding at {place}: {check.name}, {_figures(check)}.{cause}")
    return list(dict.fromkeys(found))


def _excess(check: Check) -> float:
    """Utilisation for ordering; thermal runaway (infinite) comes last, as other checks say how far it is."""
    used = check.utilisation or 0.0
    return used if math.isfinite(used) else 0.0


def _figures(check: Check) -> str:
    """Required and available value of a check, in words."""
    found = [check.entered(name) for name in ("required", "available")]
    required, available = (math.nan if value is None else value for value in found)
    over = 100.0 * ((required / available if check.utilisation is None else check.utilisation) - 1.0)
    excess = f"{over:.3g} % over" if math.isfinite(over) else "without bound"
    factor = "" if check.factor == 1.0 else f"; safety factor {check.factor:g} included"
    unit = f"A {AMPERES[check.current_basis]}" if check.unit == "A" else check.unit
    return f"{required:.4g} of {available:.4g} {unit} ({excess}{factor})"


def _changed(near: Nearest, family: WorkFamily, vary: Vary) -> str:
    """The smallest change of one number that makes the nearest set feasible, in words; empty if none does."""
    if (vary is Vary.PAYLOAD and not _has_payload(near)) or (vary is Vary.CYCLE_TIME and near.study.base is not None):
        return ""
    number = task_number(family, named_drives(near.study, near.keys), vary)
    if not number.now:  # no force
        return ""
    found = first_edge(lambda value: number.put(value).holds(), number.now * vary.outwards)
    if found is None:
        return ""
    factor = found.inside / number.now
    factor = max(factor + MARGIN * (factor - 1.0), 0.0)
    now, after = number.now, factor * number.now
    if not number.put(after).proven().feasible:
        return ""
    if vary is Vary.PAYLOAD:
        return f"With these drives less payload is enough: {_mass(near, factor)}."
    if vary is Vary.FORCE:
        return f"With these drives less force at the tip is enough: {after:.3g} % of that of the study."
    if vary is Vary.VOLTAGE:
        return f"With these drives more supply voltage is enough: {after:.4g} V instead of {now:g} V."
    kept = "" if near.study.arm is not None else ", at the table's torques"
    return (
        f"With these drives a slower motion is enough: a cycle of {after:.4g} s instead of {now:.4g} s, "
        f"{100.0 * (factor - 1.0):.3g} % longer{kept}."
    )


def _has_payload(near: Nearest) -> bool:
    return bool(heaviest(near.study))


def _mass(near: Nearest, share: float) -> str:
    """The payload at a share of its mass, in words."""
    [one] = heaviest(near.study)
    return f"{one.name} {one.mass * share:.4g} kg instead of {one.mass:.3g} kg"


def _smallest_for_others(near: Nearest, family: WorkFamily, vary: Vary, factors: Array) -> str:
    """The smallest of some changes at which any set is feasible, in words, by bisection from the largest."""
    found, is_final = _best_with(near, family, vary, factors[-1])
    works, fails, drives = len(factors) - 1, 0, found
    while drives and works - fails > 1 and is_final:
        middle = (works + fails) // 2
        found, is_final = _best_with(near, family, vary, factors[middle])
        works, fails, drives = (middle, fails, found) if found else (works, middle, drives)
    paced = vary is Vary.CYCLE_TIME
    length, factor, before = near.study.cycle.duration, factors[works], factors[fails]
    if not drives:
        even = f"even with a cycle {factor:g} times as long" if paced else f"even without {family.payloads[0]}"
        return f"None of the other candidates meets all limits either, {even}: all were searched." if is_final else ""
    what = f"a cycle of {length * factor:.4g} s instead of {length:.4g} s" if paced else _mass(near, factor)
    least = f"{length * before:.4g} s" if paced else f"{100.0 * before:.3g} % of the payload"
    limit = "" if fails == 0 or not is_final else f"; with {least} none do"
    named = ", ".join(f"{name} {pair_name(*pair)}" for name, pair in drives.items())
    return f"Other candidates meet all limits with {what}{limit}: {named}."


def _best_with(
    near: Nearest, family: WorkFamily, vary: Vary, factor: float
) -> tuple[dict[str, tuple[str, str]], bool]:  # fmt: skip
    """The best set of all candidates with a change, empty if there is none, and whether the answer is final."""
    payload = next(iter(family.payloads), "")
    work = family.at(vary.change(near.study, float(factor) * vary.now(near.study, payload), payload))
    study = replace(work.study, wanted=replace(near.study.wanted, sets=1))
    tree = Tree(build_problem(build_candidates(study, replace(work, study=study)), study.wanted))
    tree, _ = run_search(tree, time.perf_counter() + min(SEARCH_TIME, study.wanted.time_limit), lambda *_: None)
    return (tree.problem.keys(dict(enumerate(tree.found[0]))), True) if tree.best else ({}, tree.finished)
