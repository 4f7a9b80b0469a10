"""The best set of drives that holds with a wanted probability, when its numbers scatter.

One search, best first, asks of every set that would be the best so far whether it holds often enough; one that does
not is passed over, and the search goes on where it is. When it ends, every set with a smaller objective was ruled out
with nominal numbers, or was judged and does not hold often enough.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.candidates import candidates
from drivetrain.sizing.search.chance_constraint import (
    CONFIDENCE,
    ChanceConstraint,
    Decision,
    Trial,
    share_of_error,
    tried,
)
from drivetrain.sizing.search.problem import problem
from drivetrain.sizing.search.tree import Tree
from drivetrain.sizing.tolerance.sampling import Nominal, candidate, nominal_of
from drivetrain.study.model import Study

MOST_SETS = 1000
EQUAL = 1e-9  # of an objective: sets that differ by less are equally good


@dataclass(frozen=True)
class RobustSelection:
    """The best set of drives that holds often enough."""

    wanted: float  # probability with which the set must hold
    confidence: float  # with which every decision told here is right, all of them together
    chosen: Trial | None  # the best set that holds; None where none did among those tried
    trials: tuple[Trial, ...]  # all that were tried, in the order of their objective
    exhausted: bool  # no further set holds with nominal numbers that was neither judged nor passed over
    # how often a drive was passed over undrawn, as it is known to fall at its joint with the same loads
    passed: int = 0
    bound: float = math.inf  # no set that is left has a smaller objective; infinite where none is left

    @property
    def proven(self) -> bool:
        """Whether every better set was judged and does not hold, none of them too near to tell."""
        if self.chosen is None:
            return self.exhausted
        near = any(trial.decision is Decision.OPEN for trial in self.better)
        return not near and self.bound >= self.chosen.drives.objective * (1.0 - EQUAL)

    @property
    def better(self) -> tuple[Trial, ...]:
        """The sets tried that would be chosen rather than the chosen one, if they held."""
        best = self.chosen
        if best is None:
            return self.trials
        most = best.drives.objective * (1.0 + EQUAL)
        return tuple(one for one in self.trials if one.decision is not Decision.HOLDS and one.drives.objective <= most)

    @property
    def proof(self) -> str:
        """What is known of the choice, in words."""
        before = self.better
        near = sum(trial.decision is Decision.OPEN for trial in before)
        confidence = f"{100.0 * self.confidence:g} % confidence"
        wanted_text = f"{100.0 * self.wanted:g} %"
        shared = ", nor do those with one of their drives and the same loads" if self.passed else ""
        if self.chosen is None:
            if not self.trials:
                return "no set holds with nominal numbers"
            end = "and there are no others" if self.exhausted else "the search went no further"
            return f"none of {len(self.trials)} sets is known to hold with {wanted_text} ({confidence}){shared}, {end}"
        words = f"holds with at least {wanted_text}; {len(before) - near} better sets do not{shared} ({confidence})"
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
    """The best set that holds with a wanted probability, among those that hold with nominal numbers.

    Args:
        study: The task, its tolerances and what is wanted; its time limit is that of the search with all its draws.
        sets: Best first, to be tried in this order; None: those of the search.
        holds: Probability; None: the study's ``wanted.holds``.
        confidence: With which all decisions together are right.
        most_sets: How many are tried at most.
        seed: Of the random numbers; None: the study's own.
        work: Of the study, where it is already prepared.

    Returns:
        The choice, and every set that was tried with what became of it.

    Raises:
        InputError: No tolerance or no probability is stated, or numbers out of range.
    """
    wanted = study.wanted.holds if holds is None else holds
    start = study.tolerances.seed if seed is None else seed
    faults = []
    if not study.tolerances.given:
        faults.append(Fault("tolerances", "the study states none, so nothing scatters"))
    if wanted is None or not 0.0 < wanted < 1.0:
        faults.append(Fault("holds", "must be a probability between 0 and 1", wanted, "such as 0.99"))
    if not 0.5 <= confidence < 1.0:
        faults.append(Fault("confidence", "must lie between 0.5 and 1", confidence))
    if faults or wanted is None:
        raise InputError(faults)
    base = nominal_of(study, work)
    if sets is None:
        return _searched(base, wanted, confidence, start, most_sets)
    return _in_order(base, sets, wanted, confidence, start, most_sets)


def _in_order(
    base: Nominal, sets: Iterable[DriveSet], wanted: float, confidence: float, seed: int, most: int
) -> RobustSelection:  # fmt: skip
    """The first of some sets that is feasible often enough."""
    trials: list[Trial] = []
    for one in sets:
        ready = candidate(base, one.drives)
        trials.append(tried(ready, one, wanted, share_of_error(confidence, len(trials)), seed=seed))
        if trials[-1].decision is Decision.HOLDS:
            return RobustSelection(wanted, confidence, trials[-1], tuple(trials), False)
        if len(trials) >= most:
            return RobustSelection(wanted, confidence, None, tuple(trials), False, bound=one.objective)
    return RobustSelection(wanted, confidence, None, tuple(trials), True)


def _searched(base: Nominal, wanted: float, confidence: float, seed: int, most: int) -> RobustSelection:
    """The best set of all that is feasible often enough, by one search."""
    wanted_text = replace(base.study, wanted=replace(base.study.wanted, sets=1))
    what = problem(candidates(wanted_text, replace(base.work, study=wanted_text)), wanted_text.wanted)
    accepts = ChanceConstraint(what, base, wanted, confidence, seed, most)
    tree = Tree(what, accepts=accepts)
    tree.begin()
    deadline = time.perf_counter() + wanted_text.wanted.time_limit
    while not (tree.finished or accepts.over) and time.perf_counter() < deadline:
        tree.run(0.0, lambda done, total, text: None)  # one step at a time
    chosen = accepts.trials[tree.best[0].pairs] if tree.best else None
    trials = tuple(sorted(accepts.trials.values(), key=lambda one: (one.drives.objective, one is chosen)))
    bound = math.inf if tree.finished else tree.bound
    if chosen is not None and tree.finished:
        bound = chosen.drives.objective
    return RobustSelection(wanted, confidence, chosen, trials, tree.finished and chosen is None, accepts.passed, bound)
