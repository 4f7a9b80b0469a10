"""The best set of drives that is feasible with a required probability within the tolerances.

One branch and bound search tests every set that would become the incumbent against a chance constraint. A set that
fails it is excluded, and the search goes on. When it ends, every set of smaller objective was either ruled out with
nominal values or tested and found not to be feasible often enough.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass

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

    @property
    def proven(self) -> bool:
        """Whether every better set was tested and rejected, with none too close to decide."""
        if self.chosen is None:
            return self.exhausted
        near = any(trial.decision is Decision.OPEN for trial in self.better)
        return not near and self.bound >= self.chosen.drives.objective * (1.0 - EQUAL)

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
        before = self.better
        near = sum(trial.decision is Decision.OPEN for trial in before)
        confidence = f"{100.0 * self.confidence:g} % confidence"
        wanted_text = f"{100.0 * self.wanted:g} %"
        shared = ", nor do those with one of their drives and the same loads" if self.passed else ""
        if self.chosen is None:
            if not self.trials:
                return "no set meets all limits with nominal values"
            end = "and there are no others" if self.exhausted else "the search went no further"
            count = len(self.trials)
            words = f"no set is known to meet all limits with {wanted_text}: {count} tested ({confidence})"
            return f"{words}{shared}, {end}"
        words = f"meets all limits with at least {wanted_text}"
        words = f"{words}; {len(before) - near} better sets do not{shared} ({confidence})"
        words = f"{words}; {near} better sets are too near to decide" if near else words
        if self.bound < self.chosen.drives.objective * (1.0 - EQUAL):
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
    if faults or wanted is None:
        raise InputError(faults)
    base = nominal_of(study, work)
    if sets is None:
        return _search(base, wanted, confidence, start, most_sets)
    return _first_accepted(base, sets, wanted, confidence, start, most_sets)


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


def _search(base: Nominal, probability: float, confidence: float, seed: int, most_sets: int) -> RobustSelection:
    """The best of all sets that pass the test, by one search."""
    study = base.study
    problem = build_problem(build_candidates(study, base.work), study.wanted)
    constraint = ChanceConstraint(problem, base, probability, confidence, seed, most_sets)
    tree = Tree(problem, chance_constraint=constraint)
    tree.begin()
    deadline = time.perf_counter() + study.wanted.time_limit
    while not (tree.finished or constraint.exhausted) and time.perf_counter() < deadline:
        tree.run(0.0, lambda done, total, text: None)  # one node at a time
    passed = [constraint.trials[found.pairs] for found in tree.best]
    chosen = passed[0] if passed else None
    trials = tuple(sorted(constraint.trials.values(), key=lambda one: (one.drives.objective, one is chosen)))
    bound = math.inf if tree.finished else tree.bound
    if chosen is not None and tree.finished:
        bound = chosen.drives.objective
    exhausted = tree.finished and chosen is None
    return RobustSelection(
        probability, confidence, chosen, trials, exhausted, constraint.removed, bound,
        tuple(trial.drives for trial in passed),
    )  # fmt: skip
