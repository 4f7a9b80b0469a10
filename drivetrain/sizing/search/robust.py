"""The best set of drives that is feasible with a required probability within the tolerances.

One branch and bound search tests every set that would become the incumbent against a chance constraint. A set that
fails it is excluded, and the search goes on. When it ends, every set of smaller objective was either ruled out with
nominal values or tested and found not to be feasible often enough.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, field

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.constraints.chance import (
    CONFIDENCE,
    ChanceConstraint,
    Decision,
    Trial,
    run_trial,
    share_of_error,
)
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.tree import Tree
from drivetrain.sizing.tolerance.draws import check_seed
from drivetrain.sizing.tolerance.sampling import Nominal, candidate, nominal_of
from drivetrain.study.model import Study

MOST_SETS = 1000
EQUAL = 1e-9  # relative difference below which objectives are equal


@dataclass(frozen=True)
class RobustSelection:
    """The best set of drives that is feasible with a required probability."""

    wanted: float  # required probability
    confidence: float  # probability that all decisions together are right
    chosen: Trial | None  # the best set that passed; None if none of those tested did
    trials: tuple[Trial, ...]  # all tested sets, by their objective
    exhausted: bool  # whether every set that is feasible with nominal values was tested or ruled out
    # Number of drives ruled out without samples, because they fail too often at their joint under the same loads.
    passed: int = 0
    bound: float = math.inf  # lower bound on the objective of sets that were not tested; infinite if there are none
    best_sets: tuple[DriveSet, ...] = ()  # the best sets that passed, best first: as many as the study asks for
    # the search that was stopped by its time limit; None if there is nothing to resume
    state: Tree | None = field(default=None, repr=False)

    @property
    def proven(self) -> bool:
        """Whether every better set was tested and rejected, with none too close to decide."""
        if self.near:
            return False
        return self.exhausted if self.chosen is None else not self._stopped_early

    @property
    def near(self) -> tuple[Trial, ...]:
        """Those of the better sets that are too close to decide."""
        return tuple(one for one in self.better if one.decision is Decision.OPEN)

    @property
    def least(self) -> float:
        """Lower bound on the objective of sets with the required probability; infinite if there are none."""
        chosen = [] if self.chosen is None else [self.chosen.drives.objective]
        return min([self.bound, *(one.drives.objective for one in self.near), *chosen])

    @property
    def _stopped_early(self) -> bool:
        """Whether sets that may be better than the chosen one were not tested."""
        return self.chosen is not None and self.bound < self.chosen.drives.objective * (1.0 - EQUAL)

    @property
    def better(self) -> tuple[Trial, ...]:
        """The rejected or undecided sets whose objective is no larger than that of the chosen set."""
        best = self.chosen
        if best is None:
            return self.trials
        most = best.drives.objective * (1.0 + EQUAL)
        return tuple(one for one in self.trials if one.decision is not Decision.HOLDS and one.drives.objective <= most)

    @property
    def proof(self) -> str:
        """What is proven about the choice, in words."""
        before, near = self.better, len(self.near)
        confidence = f"{100.0 * self.confidence:g} % confidence"
        wanted_text = f"{100.0 * self.wanted:g} %"
        shared = ", nor do those with one of their drives and the same loads" if self.passed else ""
        if self.chosen is None:
            if not self.trials and self.exhausted:
                return "no set meets all limits with nominal values"
            end = "and there are no others" if self.exhausted else "the search went no further"
            end = f"{near} of them too near to decide, {end}" if near else end
            count, start = len(self.trials), "" if self.proven else "not proven: "
            words = f"{start}no set is known to meet all limits with {wanted_text}: {count} tested ({confidence})"
            return f"{words}{shared}, {end}"
        words = f"meets all limits with at least {wanted_text}"
        words = f"{words}; {len(before) - near} better sets do not{shared} ({confidence})"
        words = f"{words}; {near} better sets are too near to decide" if near else words
        if self._stopped_early:
            words = f"{words}; the search was stopped: sets from an objective of {self.bound:.4g} on are left"
        return words


def robust_select(
    study: Study,
    *,
    sets: Iterable[DriveSet] | None = None,
    holds: float | None = None,
    confidence: float = CONFIDENCE,
    most_sets: int = MOST_SETS,
    seed: int | None = None,
    work: Workload | None = None,
) -> RobustSelection:
    """The best set that is feasible with a required probability, among those feasible with nominal values.

    Args:
        study: The task with tolerances and selection options; its time limit includes the sampling.
        sets: Sets to test in this order, best first; None: those of the search.
        holds: Required probability; None: the study's ``wanted.holds``.
        confidence: Probability that all decisions together are right.
        most_sets: Largest number of sets that are tested.
        seed: Seed of the random numbers; None: that of the study.
        work: Loads of the study, if they are known already.

    Returns:
        The chosen set and all tests.

    Raises:
        InputError: No tolerance or no probability is stated, or a value is out of range.
    """
    wanted = study.wanted.holds if holds is None else holds
    start = study.tolerances.seed if seed is None else seed
    faults = check_seed(start)
    if not study.tolerances.given:
        faults.append(Fault("tolerances", "the study states none, so nothing scatters"))
    if wanted is None or not 0.0 < wanted < 1.0:
        faults.append(Fault("holds", "must be a probability between 0 and 1", wanted, "such as 0.99"))
    if not 0.5 <= confidence < 1.0:
        faults.append(Fault("confidence", "must lie between 0.5 and 1", confidence))
    if most_sets < 1:
        faults.append(Fault("most_sets", "must be 1 or more", most_sets))
    given = None if sets is None else list(sets)
    wrong = next((one for one in given or () if not isinstance(one, DriveSet)), None)
    if wrong is not None:
        hint = "as in select(study).best_sets, or dt.DriveSet(drives, objective, criteria)"
        faults.append(Fault("sets", "must be sets of drives (DriveSet)", wrong, hint))
    if faults or wanted is None:
        raise InputError(faults)
    base = nominal_of(study, work)
    if given is not None:
        return _first_accepted(base, given, wanted, confidence, start, most_sets)
    problem = build_problem(build_candidates(study, base.work), study.wanted)
    constraint = ChanceConstraint(problem, base, wanted, confidence, start, most_sets)
    return robust_search(Tree(problem, chance_constraint=constraint), constraint, study.wanted.time_limit)


def _first_accepted(
    base: Nominal, sets: Iterable[DriveSet], probability: float, confidence: float, seed: int, most_sets: int
) -> RobustSelection:  # fmt: skip
    """The first of some sets that passes the test."""
    trials: list[Trial] = []
    for one in sets:
        ready = candidate(base, one.drives)
        trials.append(run_trial(ready, one, probability, share_of_error(confidence, len(trials)), seed=seed))
        if trials[-1].decision is Decision.HOLDS:
            return RobustSelection(probability, confidence, trials[-1], tuple(trials), False, best_sets=(one,))
        if len(trials) >= most_sets:
            return RobustSelection(probability, confidence, None, tuple(trials), False, bound=one.objective)
    return RobustSelection(probability, confidence, None, tuple(trials), True)


def robust_search(tree: Tree, constraint: ChanceConstraint, time_limit: float) -> RobustSelection:
    """The best of all sets that pass the test, by one search, which may have been stopped before.

    Args:
        tree: The search, with the test as its chance constraint.
        constraint: The test.
        time_limit: Time limit, sampling included [s]; at least one node is processed.
    """
    tree.begin()
    deadline = time.perf_counter() + time_limit
    while not (tree.finished or constraint.exhausted):
        tree.run(0.0, lambda done, total, text: None)  # one node at a time
        if time.perf_counter() >= deadline:
            break
    passed = [constraint.trials[found.pairs] for found in tree.best]
    chosen = passed[0] if passed else None
    trials = tuple(sorted(constraint.trials.values(), key=lambda one: (one.drives.objective, one is chosen)))
    bound = math.inf if tree.finished else tree.bound
    if chosen is not None and tree.finished:
        bound = chosen.drives.objective
    return RobustSelection(
        constraint.probability, constraint.confidence, chosen, trials, tree.finished and chosen is None,
        constraint.removed, bound, tuple(trial.drives for trial in passed),
        None if tree.finished or constraint.exhausted else tree,
    )  # fmt: skip
