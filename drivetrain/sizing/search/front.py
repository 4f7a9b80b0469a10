"""The exact Pareto front: what whole sets of drives offer between mass, price, energy a cycle and reserve."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from drivetrain.errors import Fault, InputError, nearest
from drivetrain.notebook import axes_of, shown
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.missing import missing_words
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.candidates import candidates
from drivetrain.sizing.search.chance_constraint import CONFIDENCE, ChanceConstraint, chance_of, scatters
from drivetrain.sizing.search.front_tree import NAMES, FrontTree
from drivetrain.sizing.search.preconditions import SHEET, lacking_of, same_study, words_of
from drivetrain.sizing.search.problem import problem
from drivetrain.sizing.search.tree import Report, searched
from drivetrain.sizing.tables import CRITERION_UNITS, set_table
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.sizing.tolerance.sampling import nominal_of
from drivetrain.study.model import Study

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

CRITERIA = ("mass", "energy")
TIME_LIMIT = 60.0  # s


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
        chances: With what probability each set holds, in the order of the points; empty where nothing scatters.
        proven: Whether every essential check of the sets could be made.
    """

    study: Study
    names: tuple[str, ...]
    left_out: dict[str, str]
    points: tuple[DriveSet, ...]
    complete: bool
    gap: float
    counters: dict[str, int]
    notes: tuple[str, ...] = ()
    state: FrontTree | None = None
    chances: tuple[Chance, ...] = ()
    proven: bool = True

    @property
    def table(self) -> pd.DataFrame:
        """The sets as a table, by their first criterion: criteria, then motor and gear of each joint."""
        return set_table(self.points, self.study).drop(columns="objective", errors="ignore")

    def __repr__(self) -> str:
        sets = "1 set" if len(self.points) == 1 else f"{len(self.points)} sets"
        return f"Front({self.study.name}: {sets} by {', '.join(self.names)}, {self.proof})"

    def _repr_html_(self) -> str:
        return shown(repr(self), self.table)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The first two criteria of each set, one over the other.

        Args:
            ax: Where to draw; None: a new figure.

        Returns:
            The axes.
        """
        ax, names = axes_of(ax), (*self.names, self.names[0])[:2]
        x, y = ([one.criteria[name] for one in self.points] for name in names)
        ax.step(x, y, where="post", marker="o")
        ax.set(xlabel=CRITERION_UNITS.get(names[0], names[0]), ylabel=CRITERION_UNITS.get(names[1], names[1]))
        return ax

    @property
    def feasible(self) -> bool:
        """Whether any set holds; not where a given drive, which all sets have, lacks data."""
        return bool(self.points) and self.proven

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
    criteria: Sequence[str] | str = CRITERIA,
    *,
    time_limit: float = TIME_LIMIT,
    resume: Front | None = None,
    progress: Report | None = None,
) -> Front:
    """The Pareto front of whole sets of drives that hold every check, exact.

    Where the study states tolerances and wants a probability (``holds``), of those that hold with it; where it states
    tolerances alone, each set is told with the probability that it holds.

    Args:
        study: The task, with the candidates of every joint; what its selection must respect (types, families) holds.
        criteria: Which to compare: ``mass``, ``price``, ``energy``, ``utilisation``; or as one text, ``"mass,energy"``.
        time_limit: Of the search [s]; what is left then is told, not hidden.
        resume: A front of the same study and criteria that its time limit stopped: the search goes on where it
            stopped, for another time limit.
        progress: Called with (done, total, text).

    Returns:
        The sets, evaluated; a criterion that no candidate of some joint has data for is left out.

    Raises:
        InputError: No criterion, one of another name, or none that candidates have data for.
    """
    if isinstance(criteria, str):
        criteria = [name.strip() for name in criteria.split(",")]
    _check(criteria, time_limit)
    if resume is not None:
        return _resumed(study, criteria, time_limit, resume, progress)
    names, left_out, notes = _known(study, criteria)  # told before anything is searched
    weights = tuple((name, 1.0) for name in names if name in ("mass", "price"))
    what = problem(candidates(study), replace(study.wanted, weights=weights or (("mass", 1.0),)))
    holds = study.wanted.holds if scatters(study) else None
    accepts = None
    if holds is not None:
        accepts = ChanceConstraint(what, nominal_of(study, what.candidates.work), holds, seed=study.tolerances.seed)
    search = FrontTree(what, accepts=accepts, names=names)
    return _searched(search, time_limit, progress, left_out, tuple(notes))


def check_criteria(study: Study, criteria: Sequence[str]) -> None:
    """Refuse a front that cannot be found, before anything is searched."""
    _check(criteria, TIME_LIMIT)
    _known(study, criteria)


def _resumed(
    study: Study, criteria: Sequence[str], time_limit: float, resume: Front, progress: Report | None
) -> Front:  # fmt: skip
    """A search that goes on."""
    if not same_study(resume.study, study):
        raise InputError(Fault("resume", "is a front of another study", resume.study.name))
    wanted = tuple(name for name in dict.fromkeys(criteria) if name not in resume.left_out)
    if wanted != resume.names:
        raise InputError(Fault("resume", "is a front of other criteria", ", ".join(resume.names)))
    if resume.state is None:
        return resume
    notes = tuple(note for note in resume.notes if note not in _chance_notes(resume.state, resume.chances))
    return _searched(resume.state.copied(), time_limit, progress, resume.left_out, notes)


def _searched(
    search: FrontTree, time_limit: float, progress: Report | None, left_out: dict[str, str], notes: tuple[str, ...]
) -> Front:
    """The front as far as a search comes."""
    report = progress or (lambda done, total, text: None)
    search.begin()  # what a first run compiles is no search
    end = time.perf_counter() + time_limit
    search, evaluations = searched(search, end, report)
    points = [
        DriveSet(search.problem.keys(dict(enumerate(pairs))), one.objective, one.criteria)
        for pairs, one in evaluations.items()
    ]
    points.sort(key=lambda one: tuple(one.criteria[name] for name in search.names))
    chances = _chances(search, points, report)
    counters = dict(search.counters) | (dict(search.accepts.counters) if search.accepts is not None else {})
    missing = missing_words(evaluated(search.problem.candidates.work, points[0].drives)) if points else ()
    remarks = dict.fromkeys((*notes, *missing, *_chance_notes(search, chances)))
    return Front(
        search.problem.candidates.study, tuple(search.names), left_out, tuple(points), search.finished, search.gap(),
        counters, tuple(remarks), None if search.finished else search, chances, not missing,
    )  # fmt: skip


def _chances(search: FrontTree, points: Sequence[DriveSet], report: Report) -> tuple[Chance, ...]:
    """With what probability each set holds; nothing where nothing scatters."""
    offered = search.problem.candidates
    if not scatters(offered.study):
        return ()
    if search.accepts is not None:
        by_keys = {
            tuple(search.problem.keys(dict(enumerate(p))).items()): one.chance
            for p, one in search.accepts.trials.items()
        }
        return tuple(by_keys[tuple(point.drives.items())] for point in points)
    base, found = nominal_of(offered.study, offered.work), []
    for done, point in enumerate(points):
        report(done, len(points), f"drawing arms of {len(points)} sets")
        found.append(chance_of(base, point.drives))
    return tuple(found)


def _chance_notes(search: FrontTree, chances: Sequence[Chance]) -> tuple[str, ...]:
    """What tolerances mean for the front, in words."""
    study = search.problem.candidates.study
    if not scatters(study):
        return ()
    if search.accepts is None:
        arms = chances[0].samples if chances else 0
        return (
            "the sets are those that hold with nominal numbers; with what probability each holds within the tolerances "
            f"is counted over {arms} arms (`selection: holds` asks for a front of sets that hold often enough)",
        )
    counters = search.accepts.counters
    near = counters["sets too near to decide"]
    text = f"every set holds with at least {100.0 * search.accepts.wanted:g} % ({100.0 * CONFIDENCE:g} % confidence)"
    left = f"; {near} sets left out are too near to decide" if near else ""
    return (f"{text}; of {counters['sets drawn']} sets arms were drawn{left}",)


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


def _known(study: Study, criteria: Sequence[str]) -> tuple[tuple[str, ...], dict[str, str], list[str]]:
    """The criteria that can be compared; those that cannot, with the reason; and what is left aside."""
    names, left_out, notes = [], {}, []
    for name in dict.fromkeys(criteria):
        text = words_of(study, name) if name in SHEET else ""
        if text:
            left_out[name] = text
            continue
        names.append(name)
        lacking = {joint: lacks for joint, (lacks, _) in lacking_of(study, name).items()} if name in SHEET else {}
        if any(lacking.values()):
            text = ", ".join(f"{count} at {joint}" for joint, count in lacking.items() if count)
            notes.append(f"candidates without a known {name} are left aside: {text}")
    if not names:
        raise InputError([Fault("criteria", text, name) for name, text in left_out.items()])
    return tuple(names), left_out, notes
