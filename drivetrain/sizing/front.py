"""The exact Pareto front: what whole sets of drives offer between mass, price, energy a cycle and reserve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.evaluate import evaluate
from drivetrain.sizing.front_search import NAMES, FrontSearch
from drivetrain.sizing.packed_task import Indices, pack
from drivetrain.sizing.problem import Problem, problem
from drivetrain.sizing.results import DriveSet
from drivetrain.study.study import Study, Wanted, family

CRITERIA = ("mass", "energy")
TIME_LIMIT = 60.0  # s

Tell = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Front:
    """Sets of drives of which none beats another in all criteria.

    Attributes:
        study: The task.
        names: Criteria that are compared, each to be small: ``mass`` [kg], ``price``, ``energy`` of a cycle [J] and
            ``utilisation``, the largest of any judged check (the reserve is 1 less it).
        left_out: Criteria that were asked for and cannot be compared, with the reason.
        points: The sets, by their first criterion; of sets equal in all criteria one.
        complete: Whether it is proven that no other set belongs to it.
        gap: Share by which a set that was not found may at most beat one that was, in all criteria at once; 0 when
            complete, infinite when nothing is known.
        counters: Work done.
        notes: What a reader should know.
    """

    study: Study
    names: tuple[str, ...]
    left_out: dict[str, str]
    points: tuple[DriveSet, ...]
    complete: bool
    gap: float
    counters: dict[str, int]
    notes: tuple[str, ...] = ()

    @property
    def feasible(self) -> bool:
        """Whether any set holds."""
        return bool(self.points)

    @property
    def proof(self) -> str:
        """How far the front is proven, in words."""
        if self.complete:
            return "complete: every set of drives was found or ruled out"
        if math.isinf(self.gap):
            return "not complete: the time was up before anything was known"
        share = f"{100.0 * self.gap:.3g} %"
        return f"not complete: sets that beat one of these by up to {share} in all criteria are not ruled out"


def pareto_front(
    study: Study,
    criteria: Sequence[str] = CRITERIA,
    *,
    time_limit: float = TIME_LIMIT,
    progress: Tell | None = None,
) -> Front:
    """The Pareto front of whole sets of drives that hold every check, exact.

    Args:
        study: The task, with the candidates of every joint; what its selection must respect (types, families) holds.
        criteria: Which to compare: ``mass``, ``price``, ``energy``, ``utilisation``.
        time_limit: Of the search [s]; what is left then is told, not hidden.
        progress: Called with (done, total, text).

    Returns:
        The sets, evaluated; a criterion that no candidate of some joint has data for is left out.

    Raises:
        InputError: No criterion, or one of another name.
    """
    _check(criteria, time_limit)
    packed = pack(study)
    names, left_out, notes = _known(study, packed.task.first, packed.mass, packed.price, criteria)
    weights = tuple((name, 1.0) for name in names if name in ("mass", "price"))
    asked = replace(study.wanted, weights=weights or (("mass", 1.0),))
    what = problem(packed, asked)
    search = FrontSearch(what, names, lambda pairs: _allowed(what, study.wanted, pairs))
    search.run(time_limit, progress or (lambda done, total, text: None))
    points = [_evaluated(study, what, key) for key in search.zones.keys]
    points.sort(key=lambda one: tuple(one.criteria[name] for name in names))
    return Front(
        study, names, left_out, tuple(points), not search.open, search.gap(), dict(search.counters), tuple(notes)
    )  # fmt: skip


def _check(criteria: Sequence[str], time_limit: float) -> None:
    faults = [
        Fault("criteria", "is none that sets can be compared by", name, nearest(name, NAMES))
        for name in criteria
        if name not in NAMES
    ]
    if not criteria:
        faults.append(Fault("criteria", "name one or more", hint=", ".join(NAMES)))
    if not time_limit > 0.0:
        faults.append(Fault("time_limit", "must be positive [s]", time_limit))
    if faults:
        raise InputError(faults)


def _known(
    study: Study, first: Indices, mass: Array, price: Array, criteria: Sequence[str]
) -> tuple[tuple[str, ...], dict[str, str], list[str]]:
    """The criteria that can be compared; those that cannot, with the reason; and what is left aside."""
    names, left_out, notes = [], {}, []
    for name in dict.fromkeys(criteria):
        if name not in ("mass", "price"):
            names.append(name)
            continue
        values = mass if name == "mass" else price
        lacking = {
            task.name: int(np.isnan(values[first[j] : first[j + 1]]).sum()) for j, task in enumerate(study.joints)
        }
        bare = [task.name for j, task in enumerate(study.joints) if lacking[task.name] == first[j + 1] - first[j]]
        if bare:
            left_out[name] = f"no candidate at {', '.join(bare)} has a known {name}"
            continue
        names.append(name)
        if any(lacking.values()):
            told = ", ".join(f"{count} at {joint}" for joint, count in lacking.items() if count)
            notes.append(f"candidates without a known {name} are left aside: {told}")
    return tuple(names), left_out, notes


def _allowed(what: Problem, wanted: Wanted, pairs: Sequence[int]) -> bool:
    """Whether a set keeps to the number of types and to the families that are wanted."""
    catalog, keys = what.packed.study.catalog, what.keys(dict(enumerate(pairs)))
    motors, gears = {motor for motor, _ in keys.values()}, {gear for _, gear in keys.values() if gear}
    if wanted.most_motor_types is not None and len(motors) > wanted.most_motor_types:
        return False
    if wanted.most_gear_types is not None and len(gears) > wanted.most_gear_types:
        return False
    for group in wanted.same_family:
        if len({family(catalog.motors[keys[name][0]]) for name in group}) > 1:
            return False
        if len({family(catalog.gears[keys[name][1]]) if keys[name][1] else "" for name in group}) > 1:
            return False
    return True


def _evaluated(study: Study, what: Problem, pairs: Sequence[int]) -> DriveSet:
    """A set as the authority sees it."""
    drives = what.keys(dict(enumerate(pairs)))
    evaluation = evaluate(study, drives)
    return DriveSet(drives, evaluation.objective, evaluation.criteria)
