"""The best set of drives that holds with a wanted probability, when its numbers scatter.

One search, best first, asks of every set that would be the best so far whether it holds often enough; one that does
not is passed over, and the search goes on where it is. When it ends, every set with a smaller objective was ruled out
with nominal numbers, or was judged and does not hold often enough.

How many arms are drawn of a set is not fixed beforehand: they are drawn until it is plain whether it holds often
enough. To look again and again and stop when it suits is honest only with a test that allows it, so the bound is one
that holds at every number of samples at once (a mixture martingale), and what all tests together may err by is shared
out among them. All sets are tried with the same random numbers, so that they differ by their drives alone; the shared
error does not ask for independence. Where the checks of one joint alone fall too often, every set with the same drive
at that joint and the same loads on it falls with it, and is not drawn again.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from scipy.special import betaln

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.asked import satisfied
from drivetrain.sizing.search.candidates import candidates
from drivetrain.sizing.search.domains import Domains, Indices, Mask, with_domain
from drivetrain.sizing.search.problem import Problem, problem
from drivetrain.sizing.search.propagate import Ranges
from drivetrain.sizing.search.tree import Tree
from drivetrain.sizing.tolerance.draws import Pair, drawn
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.sizing.tolerance.sampling import Candidate, Nominal, candidate, judged, nominal_of
from drivetrain.study.model import Study

FIRST, GROWTH = 256, 2  # arms of the first look, and how many more each time
PRIOR = 0.5  # both numbers of the beta law that the martingale mixes over
CONFIDENCE = 0.99
MOST_SAMPLES = 100_000
MOST_SETS = 1000
SAMPLES = 4096  # arms of a set, where no probability is wanted
EQUAL = 1e-9  # of an objective: sets that differ by less are equally good


class Decision(StrEnum):
    """Whether a probability is above the wanted one: HOLDS, FALLS, or OPEN where it is too near to tell."""

    HOLDS = "holds"
    FALLS = "falls"
    OPEN = "open"


@dataclass(frozen=True)
class Trial:
    """One set that was tried.

    Attributes:
        drives: The set.
        chance: That it holds, as far as it was counted.
        decision: What was decided.
        joint: The joint whose checks alone fall too often, where one does; else empty.
    """

    drives: DriveSet
    chance: Chance
    decision: Decision
    joint: str = ""


@dataclass(frozen=True)
class RobustSelection:
    """The best set of drives that holds often enough.

    Attributes:
        wanted: Probability with which the set must hold.
        confidence: With which every decision told here is right, all of them together.
        chosen: The best set that holds; None where none did among those tried.
        trials: All that were tried, in the order of their objective.
        exhausted: No further set holds with nominal numbers that was neither judged nor passed over.
        passed: How often a drive was passed over undrawn, as it is known to fall at its joint with the same loads.
        bound: No set that is left has a smaller objective; infinite where none is left.
    """

    wanted: float
    confidence: float
    chosen: Trial | None
    trials: tuple[Trial, ...]
    exhausted: bool
    passed: int = 0
    bound: float = math.inf

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
        asked = f"{100.0 * self.wanted:g} %"
        shared = ", nor do those with one of their drives and the same loads" if self.passed else ""
        if self.chosen is None:
            if not self.trials:
                return "no set holds with nominal numbers"
            end = "and there are no others" if self.exhausted else "the search went no further"
            return f"none of {len(self.trials)} sets is known to hold with {asked} ({confidence}){shared}, {end}"
        words = f"holds with at least {asked}; {len(before) - near} better sets do not{shared} ({confidence})"
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


@dataclass
class OftenEnough:
    """Says of sets whether they are feasible with a wanted probability, and remembers what it said.

    Attributes:
        problem: What they are chosen from.
        base: The study.
        wanted: Probability.
        confidence: Of all decisions together.
        seed: Of the random numbers.
        most: Sets that are tried at most.
        trials: What became of each set that was tried.
        failing: Pairs that fail too often at a joint by themselves, by joint and numbers of the drives that load it.
        passed: How often such a pair was taken out undrawn.
        counters: Work done.
    """

    problem: Problem
    base: Nominal
    wanted: float
    confidence: float = CONFIDENCE
    seed: int = 0
    most: int = 10**9
    trials: dict[tuple[int, ...], Trial] = field(default_factory=dict)
    failing: dict[tuple[int, bytes], set[int]] = field(default_factory=dict)
    passed: int = 0
    counters: Counter[str] = field(default_factory=Counter)

    @property
    def over(self) -> bool:
        """Whether no further set may be tried."""
        return len(self.trials) >= self.most

    def __call__(self, pairs: tuple[int, ...]) -> bool:
        """Whether a set is feasible often enough, with nominal numbers as with those that scatter."""
        if any(self.fails(joint, np.array([pair]), pairs)[0] for joint, pair in enumerate(pairs)):
            self.counters["sets with a drive that fails too often"] += 1
            return False
        if self.over:
            return False
        ready = candidate(self.base, self.problem.keys(dict(enumerate(pairs))))
        if not satisfied(ready.nominal):
            return False
        drives = DriveSet(dict(ready.drives), ready.nominal.objective, ready.nominal.criteria)
        trial = tried(ready, drives, self.wanted, share_of_error(self.confidence, len(self.trials)), seed=self.seed)
        self.trials[pairs] = trial
        self.counters["sets drawn"] += 1
        if trial.joint:
            joint = [task.name for task in self.base.study.joints].index(trial.joint)
            self.failing.setdefault((joint, self.problem.loads_of(joint, pairs)), set()).add(pairs[joint])
        self.counters["sets too near to decide"] += trial.decision is Decision.OPEN
        return trial.decision is Decision.HOLDS

    def fails(self, joint: int, pairs: Indices, lead: Sequence[int]) -> Mask:
        """Which candidates of a joint are known to fail too often by themselves, with loads as those of a set."""
        failing = self.failing.get((joint, self.problem.loads_of(joint, lead)), set())
        return np.isin(pairs, list(failing))

    def without_failing(self, domains: Domains, ranges: Ranges) -> Domains:
        """Domains without the candidates that are known to fail with loads that are decided; the same where none is."""
        lead = tuple(int(domain.pairs[0]) for domain in domains)
        for joint in {joint for joint, _ in self.failing}:
            if ranges.decided[self.problem.loads[joint]].all():
                failing = self.fails(joint, domains[joint].pairs, lead)
                if failing.any():
                    self.passed += int(failing.sum())
                    domains = with_domain(domains, joint, domains[joint].kept(~failing))
        return domains


def share_of_error(confidence: float, tried_before: int) -> float:
    """Of all decisions together that of the next one: over all sets ever tried they sum up to what is left."""
    return (1.0 - confidence) / ((tried_before + 1) * (tried_before + 2))


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
    asked = replace(base.study, wanted=replace(base.study.wanted, sets=1))
    what = problem(candidates(asked, replace(base.work, study=asked)), asked.wanted)
    often = OftenEnough(what, base, wanted, confidence, seed, most)
    tree = Tree(what, often=often)
    tree.begin()
    deadline = time.perf_counter() + asked.wanted.time_limit
    while not (tree.finished or often.over) and time.perf_counter() < deadline:
        tree.run(0.0, lambda done, total, text: None)  # one step at a time
    chosen = often.trials[tree.best[0].pairs] if tree.best else None
    trials = tuple(sorted(often.trials.values(), key=lambda one: (one.drives.objective, one is chosen)))
    bound = math.inf if tree.finished else tree.bound
    if chosen is not None and tree.finished:
        bound = chosen.drives.objective
    return RobustSelection(wanted, confidence, chosen, trials, tree.finished and chosen is None, often.passed, bound)


def tried(ready: Candidate, drives: DriveSet, wanted: float, error: float, *, seed: int) -> Trial:
    """One set, arms drawn until it is plain whether it holds often enough."""
    study, names = ready.study, [task.name for task in ready.study.joints]
    held = samples = look = 0
    by_joint = np.zeros(len(names), dtype=np.int64)
    count, decision = FIRST, Decision.OPEN
    while decision is Decision.OPEN and samples < MOST_SAMPLES:
        count = min(count, MOST_SAMPLES - samples)
        for found in judged(ready, drawn(study, count, (seed, look))):
            held += int(found.feasible.sum())
            by_joint += (~(found.joints > 1.0).any(axis=2)).sum(axis=0)
        samples, look, count = samples + count, look + 1, samples * (GROWTH - 1) + count
        decision = decided(Chance(held, samples), wanted, 0.5 * error)
    joint = ""
    if decision is Decision.FALLS:
        share = 0.5 * error / len(names)
        alone = [decided(Chance(int(one), samples), wanted, share) is Decision.FALLS for one in by_joint]
        joint = next((name for name, falls in zip(names, alone, strict=True) if falls), "")
    return Trial(drives, Chance(held, samples), decision, joint)


def decided(chance: Chance, wanted: float, error: float) -> Decision:
    """Whether a probability is above or below a wanted one; may be asked after any sample.

    Reference:
        Ville's inequality for the likelihood ratio mixed over a beta law; Robbins, Ann. Math. Stat. 41 (1970) 1397.
    """
    hits, misses = chance.held, chance.samples - chance.held
    mixed = float(betaln(PRIOR + hits, PRIOR + misses) - betaln(PRIOR, PRIOR))
    if mixed - hits * math.log(wanted) - misses * math.log1p(-wanted) < -math.log(error):
        return Decision.OPEN
    return Decision.HOLDS if chance.probability > wanted else Decision.FALLS


def scatters(study: Study) -> bool:
    """Whether anything in a study scatters."""
    return bool(study.tolerances.given)


def chance_of(base: Nominal, drives: dict[str, Pair], samples: int = SAMPLES) -> Chance:
    """The probability that a set holds, counted.

    Args:
        drives: Keys of (motor, gear) by joint name.
    """
    study, held = base.study, 0
    count = min(samples, study.tolerances.samples)
    ready = candidate(base, drives)
    for found in judged(ready, drawn(study, count, (study.tolerances.seed, 0))):
        held += int(found.feasible.sum())
    return Chance(held, count)
