"""The exact Pareto front: what whole sets of drives offer between mass, price, energy a cycle and reserve."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.sizing.evaluate import evaluate_joint, evaluation_of, shared_checks
from drivetrain.sizing.fill import Shelf
from drivetrain.sizing.front_search import NAMES, FrontSearch
from drivetrain.sizing.given_drives import as_given, stands
from drivetrain.sizing.packed_task import Indices, pack
from drivetrain.sizing.problem import problem
from drivetrain.sizing.results import DriveSet, JointResult
from drivetrain.study.study import Study

CRITERIA = ("mass", "energy")
TIME_LIMIT = 60.0  # s
TELL_EVERY = 64  # sets

Tell = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Front:
    """Sets of drives of which none beats another in all criteria.

    Attributes:
        study: The task.
        names: Criteria that are compared, each to be small: ``mass`` [kg], ``price``, ``energy`` of a cycle [J] and
            ``utilisation``, the largest of any judged check (the reserve is 1 less it).
        left_out: Criteria that were asked for and cannot be compared, with the reason.
        points: The sets, by their first criterion. Numbers are the same within a billionth of themselves: of sets the
            same in all criteria one is told, the first found.
        complete: Whether it is proven that no other set belongs to it.
        gap: Share by which a set that was not found may at most beat one that was, in all criteria at once; 0 when
            complete, infinite when nothing is known.
        counters: Work done.
        notes: What a reader should know.
        state: Of a search that its time limit stopped, to go on with; None when it is finished.
    """

    study: Study
    names: tuple[str, ...]
    left_out: dict[str, str]
    points: tuple[DriveSet, ...]
    complete: bool
    gap: float
    counters: dict[str, int]
    notes: tuple[str, ...] = ()
    state: FrontSearch | None = None

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
    resume: Front | None = None,
    progress: Tell | None = None,
) -> Front:
    """The Pareto front of whole sets of drives that hold every check, exact.

    Args:
        study: The task, with the candidates of every joint; what its selection must respect (types, families) holds.
        criteria: Which to compare: ``mass``, ``price``, ``energy``, ``utilisation``.
        time_limit: Of the search [s]; what is left then is told, not hidden.
        resume: A front of the same study and criteria that its time limit stopped: the search goes on where it
            stopped, for another time limit.
        progress: Called with (done, total, text).

    Returns:
        The sets, evaluated; a criterion that no candidate of some joint has data for is left out.

    Raises:
        InputError: No criterion, or one of another name.
    """
    _check(criteria, time_limit)
    if resume is not None:
        return _resumed(study, criteria, time_limit, resume, progress)
    packed = as_given(pack(study))
    names, left_out, notes = _known(study, packed.task.first, packed.mass, packed.price, criteria)
    weights = tuple((name, 1.0) for name in names if name in ("mass", "price"))
    what = problem(packed, replace(study.wanted, weights=weights or (("mass", 1.0),)))
    search = FrontSearch(what, names)
    return _searched(search, time_limit, progress, left_out, tuple(notes))


def _resumed(
    study: Study, criteria: Sequence[str], time_limit: float, resume: Front, progress: Tell | None
) -> Front:  # fmt: skip
    """A search that goes on."""
    before = resume.study
    if before is not study and (before.digest, before.catalog) != (study.digest, study.catalog):
        raise InputError(Fault("resume", "is a front of another study", before.name))
    asked = tuple(name for name in dict.fromkeys(criteria) if name not in resume.left_out)
    if asked != resume.names:
        raise InputError(Fault("resume", "is a front of other criteria", ", ".join(resume.names)))
    if resume.state is None:
        return resume
    return _searched(resume.state.copied(), time_limit, progress, resume.left_out, resume.notes)


def _searched(
    search: FrontSearch, time_limit: float, progress: Tell | None, left_out: dict[str, str], notes: tuple[str, ...]
) -> Front:
    """The front as far as a search comes."""
    tell = progress or (lambda done, total, text: None)
    end = time.perf_counter() + time_limit
    search.run(time_limit, tell)
    points, wrong = _evaluated(search, tell)
    while wrong:  # compiled code and evaluation disagree on a set: an error in here, which must not hide other sets
        search = FrontSearch(search.problem, search.names, search.excluded | wrong)
        search.counters["disagreements"] = len(search.excluded)
        search.run(max(end - time.perf_counter(), 0.1 * time_limit), tell)
        points, wrong = _evaluated(search, tell)
    points.sort(key=lambda one: tuple(one.criteria[name] for name in search.names))
    return Front(
        search.problem.packed.study, search.names, left_out, tuple(points), search.finished, search.gap(),
        dict(search.counters), notes, None if search.finished else search,
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


def _evaluated(search: FrontSearch, tell: Tell) -> tuple[list[DriveSet], frozenset[tuple[int, ...]]]:
    """The sets as the authority sees them, and those of which it says that they do not hold.

    What a joint shares with the set before, its own drive and those that load it, is not judged again.
    """
    packed, keys = search.problem.packed, sorted(search.zones.keys, key=lambda pairs: pairs[::-1])
    study, loads = packed.study, packed.task.offsets >= 0
    shelf, before = Shelf(study), dict[int, tuple[tuple[int, ...], JointResult]]()
    sets, wrong = [], set()
    for done, pairs in enumerate(keys):
        if done % TELL_EVERY == 0:
            tell(done, len(keys), f"evaluating {len(keys)} sets")
        drives = search.problem.keys(dict(enumerate(pairs)))
        mounted = {i: shelf.drive(task, *drives[task.name]) for i, task in enumerate(study.joints)}
        results = {}
        for joint, task in enumerate(study.joints):
            same = tuple(pair for k, pair in enumerate(pairs) if k == joint or loads[joint, k])
            if joint not in before or before[joint][0] != same:
                before[joint] = same, evaluate_joint(packed.work, mounted, joint, drives[task.name])
            results[task.name] = before[joint][1]
        found = evaluation_of(study, results, shared_checks(study, results))
        if stands(found):
            sets.append(DriveSet(drives, found.objective, found.criteria))
        else:
            wrong.add(pairs)
    return sets, frozenset(wrong)
