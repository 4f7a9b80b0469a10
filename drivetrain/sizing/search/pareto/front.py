"""The exact Pareto front of whole sets of drives between mass, price, energy per cycle and utilisation."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.notebook import axes_of, shown
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.missing import missing_words
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.constraints.chance import CONFIDENCE, ChanceConstraint, chance_of, has_tolerances
from drivetrain.sizing.search.pareto.front_tree import NAMES, FrontTree
from drivetrain.sizing.search.preconditions import SHEET, lacking_of, same_study, words_of
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.tree import Report, run_search
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
    """The nondominated sets of drives: none is better than another in all criteria.

    Attributes:
        study: The task.
        names: Criteria that are minimised: ``mass`` [kg], ``price``, ``energy`` per cycle [J] and ``utilisation``, the
            largest of all checks (the reserve is 1 less it).
        left_out: Requested criteria that cannot be compared, with the reason.
        points: The sets, by their first criterion; of sets that are equal in all criteria (to 1e-9) the first found.
        complete: Whether it is proven that no other set belongs to the front.
        gap: Largest relative amount by which a set not found may improve on a set found in all criteria at once; 0 if
            complete, infinite if nothing is known.
        counters: Work done.
        notes: Remarks for the reader.
        state: The stopped search, to be resumed; None if it is finished.
        chances: Probability that each set is feasible, in the order of the points; empty without tolerances.
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
        """Plot the second criterion of each set over the first.

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
        """Whether any set is feasible; False if a fixed drive, which all sets share, lacks data."""
        return bool(self.points) and self.proven

    @property
    def proof(self) -> str:
        """How far the front is proven to be complete, in words."""
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
    """The exact Pareto front of the feasible sets of drives.

    With tolerances and a required probability (``holds``), sets must be feasible with that probability. With tolerances
    alone, the probability of each set is estimated.

    Args:
        study: The task with the candidates of every joint; the constraints of its selection (types, families) apply.
        criteria: Any of ``mass``, ``price``, ``energy``, ``utilisation``; or as one text, ``"mass,energy"``.
        time_limit: Time limit of the search [s]; the remaining gap is reported.
        resume: A front of the same study and criteria that was stopped by its time limit; the search continues from
            there.
        progress: Called with (steps done, total, text).

    Returns:
        The evaluated sets; a criterion that is unknown for all candidates of some joint is left out.

    Raises:
        InputError: There is no criterion, an unknown one, or none for which the candidates have data.
    """
    if isinstance(criteria, str):
        criteria = [name.strip() for name in criteria.split(",")]
    _check(criteria, time_limit)
    if resume is not None:
        return _resumed(study, criteria, time_limit, resume, progress)
    names, left_out, notes = _known(study, criteria)
    weights = tuple((name, 1.0) for name in names if name in ("mass", "price"))
    problem = build_problem(build_candidates(study), replace(study.wanted, weights=weights or (("mass", 1.0),)))
    probability = study.wanted.holds if has_tolerances(study) else None
    constraint = None
    if probability is not None:
        nominal = nominal_of(study, problem.candidates.work)
        constraint = ChanceConstraint(problem, nominal, probability, seed=study.tolerances.seed)
    tree = FrontTree(problem, chance_constraint=constraint, names=names)
    return _run(tree, time_limit, progress, left_out, tuple(notes))


def check_criteria(study: Study, criteria: Sequence[str]) -> None:
    """Raise InputError for a front that cannot be searched for."""
    _check(criteria, TIME_LIMIT)
    _known(study, criteria)


def _resumed(
    study: Study, criteria: Sequence[str], time_limit: float, resume: Front, progress: Report | None
) -> Front:  # fmt: skip
    if not same_study(resume.study, study):
        raise InputError(Fault("resume", "is a front of another study", resume.study.name))
    wanted = tuple(name for name in dict.fromkeys(criteria) if name not in resume.left_out)
    if wanted != resume.names:
        raise InputError(Fault("resume", "is a front of other criteria", ", ".join(resume.names)))
    if resume.state is None:
        return resume
    notes = tuple(note for note in resume.notes if note not in _chance_notes(resume.state, resume.chances))
    return _run(resume.state.copy(), time_limit, progress, resume.left_out, notes)


def _run(
    tree: FrontTree, time_limit: float, progress: Report | None, left_out: dict[str, str], notes: tuple[str, ...]
) -> Front:
    """Run a search and collect its front."""
    report = progress or (lambda done, total, text: None)
    tree.begin()  # compilation in a first run does not count
    end = time.perf_counter() + time_limit
    tree, evaluations = run_search(tree, end, report)
    points = [
        DriveSet(tree.problem.keys(dict(enumerate(pairs))), one.objective, one.criteria)
        for pairs, one in evaluations.items()
    ]
    points.sort(key=lambda one: tuple(one.criteria[name] for name in tree.names))
    chances = _chances(tree, points, report)
    counters = dict(tree.counters) | (
        dict(tree.chance_constraint.counters) if tree.chance_constraint is not None else {}
    )
    missing = missing_words(evaluated(tree.problem.candidates.work, points[0].drives)) if points else ()
    remarks = dict.fromkeys((*notes, *missing, *_chance_notes(tree, chances)))
    return Front(
        tree.problem.candidates.study, tuple(tree.names), left_out, tuple(points), tree.finished, tree.gap(),
        counters, tuple(remarks), None if tree.finished else tree, chances, not missing,
    )  # fmt: skip


def _chances(tree: FrontTree, points: Sequence[DriveSet], report: Report) -> tuple[Chance, ...]:
    """Probability that each set is feasible; empty without tolerances."""
    offered = tree.problem.candidates
    if not has_tolerances(offered.study):
        return ()
    if tree.chance_constraint is not None:
        by_keys = {
            tuple(tree.problem.keys(dict(enumerate(p))).items()): one.chance
            for p, one in tree.chance_constraint.trials.items()
        }
        return tuple(by_keys[tuple(point.drives.items())] for point in points)
    base, found = nominal_of(offered.study, offered.work), []
    for done, point in enumerate(points):
        report(done, len(points), f"drawing arms of {len(points)} sets")
        found.append(chance_of(base, point.drives))
    return tuple(found)


def _chance_notes(tree: FrontTree, chances: Sequence[Chance]) -> tuple[str, ...]:
    """Remarks on tolerances."""
    study = tree.problem.candidates.study
    if not has_tolerances(study):
        return ()
    if tree.chance_constraint is None:
        arms = chances[0].samples if chances else 0
        return (
            "the sets are those that meet all limits with nominal values; the probability that each meets them within "
            f"the tolerances is computed with {arms} sampled arms (`selection: holds` requires a probability)",
        )
    constraint = tree.chance_constraint
    counters = constraint.counters
    near = counters["sets too near to decide"]
    sure = f"({100.0 * CONFIDENCE:g} % confidence)"
    text = f"every set meets all limits with at least {100.0 * constraint.probability:g} % {sure}"
    left = f"; {near} sets left out are too near to decide" if near else ""
    return (f"{text}; of {counters['sets drawn']} sets arms were drawn{left}",)


def _check(criteria: Sequence[str], time_limit: float) -> None:
    """Raise InputError for unknown criteria or a time limit that is not positive."""
    faults = [
        Fault("criteria", "is none that sets can be compared by", name, nearest(name, NAMES))
        for name in criteria
        if name not in NAMES
    ]
    if not criteria:
        faults.append(Fault("criteria", "name one or more", hint=", ".join(NAMES)))
    if not time_limit > 0.0:
        faults.append(Fault("time_limit", "must be positive [s]", time_limit))
    raise_faults(faults)


def _known(study: Study, criteria: Sequence[str]) -> tuple[tuple[str, ...], dict[str, str], list[str]]:
    """The criteria that can be compared, those that cannot with the reason, and notes on candidates left out."""
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
