"""Chance constraint: whether a set of drives is feasible with a required probability within the tolerances.

The number of Monte Carlo samples is not fixed: samples are drawn until the decision is clear. Testing repeatedly and
stopping early is valid only with a sequential test, so the test is a mixture martingale, whose error bound holds at all
sample counts at once. The total error is shared out among all sets ever tested. All sets use the same random numbers,
so that they differ by their drives alone; the shared error does not require independence. If the checks of one joint
alone fail too often, every set with the same drive at that joint and the same loads on it fails as well and is
rejected without samples.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from drivetrain.arrays import Indices, Mask
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.domains import Domains, Pairs, replace_domain
from drivetrain.sizing.search.preconditions import satisfied
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.tolerance.draws import Pair, drawn
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.sizing.tolerance.sampling import Candidate, Nominal, candidate, judged
from drivetrain.study.model import Study

FIRST_SAMPLES, GROWTH = 64, 2  # samples of the first test, and the growth of the total from test to test
PRIOR = 0.5  # both parameters of the beta distribution that the martingale mixes over
CONFIDENCE = 0.99
MAX_SAMPLES = 100_000
SAMPLES = 4096  # number of samples for a set, if no probability is required


class Decision(StrEnum):
    """Whether a probability is above the required one (HOLDS), below it (FALLS) or too close to tell (OPEN)."""

    HOLDS = "holds"
    FALLS = "falls"
    OPEN = "open"


@dataclass(frozen=True)
class Trial:
    """The test of one set."""

    drives: DriveSet  # the set
    chance: Chance  # estimate of its probability to be feasible
    decision: Decision  # result of the test
    joint: str = ""  # name of a joint whose checks alone fail too often; empty if there is none


@dataclass
class ChanceConstraint:
    """Tests whether sets of drives are feasible with a required probability, and keeps all tests."""

    problem: Problem  # the selection problem
    base: Nominal  # the study with its tolerances
    probability: float  # required probability
    confidence: float = CONFIDENCE  # probability that all decisions together are right
    seed: int = 0  # seed of the random numbers
    max_sets: int = 10**9  # largest number of sets that are tested
    trials: dict[Pairs, Trial] = field(default_factory=dict)  # the tests by set
    # pairs that fail too often at a joint by themselves; the key is the joint and ``Problem.load_key``
    failing: dict[tuple[int, bytes], set[int]] = field(default_factory=dict)
    removed: int = 0  # number of removals of a failing pair from a domain without samples
    counters: Counter[str] = field(default_factory=Counter)  # work done

    def copy(self) -> ChanceConstraint:
        """An independent copy, for a search that is resumed."""
        failing = {key: set(pairs) for key, pairs in self.failing.items()}
        return replace(self, trials=dict(self.trials), failing=failing, counters=Counter(self.counters))

    @property
    def exhausted(self) -> bool:
        """Whether the number of tested sets has reached its limit."""
        return len(self.trials) >= self.max_sets

    def satisfied(self, pairs: Pairs, objective: float = math.nan) -> bool:
        """Whether a set is feasible with nominal values and with the required probability.

        ``objective``: that of the set in the search, used if its own is unknown because a given drive lacks data.
        """
        if any(self.fails(joint, np.array([pair]), pairs)[0] for joint, pair in enumerate(pairs)):
            self.counters["sets with a drive that fails too often"] += 1
            return False
        if self.exhausted:
            return False
        ready = candidate(self.base, self.problem.keys(dict(enumerate(pairs))))
        if not satisfied(ready.nominal):
            return False
        known = ready.nominal.objective
        drives = DriveSet(dict(ready.drives), objective if math.isnan(known) else known, ready.nominal.criteria)
        error = share_of_error(self.confidence, len(self.trials))
        trial = run_trial(ready, drives, self.probability, error, seed=self.seed)
        self.trials[pairs] = trial
        self.counters["sets drawn"] += 1
        if trial.joint:
            joint = self.base.study.joint_names.index(trial.joint)
            self.failing.setdefault((joint, self.problem.load_key(joint, pairs)), set()).add(pairs[joint])
        self.counters["sets too near to decide"] += trial.decision is Decision.OPEN
        return trial.decision is Decision.HOLDS

    def fails(self, joint: int, pairs: Indices, reference: Sequence[int]) -> Mask:
        """Which candidates of a joint are known to fail too often by themselves, (K,).

        ``reference``: a set whose drives load the joint as they load it here, one pair a joint.
        """
        failing = self.failing.get((joint, self.problem.load_key(joint, reference)), set())
        return np.isin(pairs, list(failing))

    def without_failing(self, domains: Domains, load_decided: Mask) -> Domains:
        """The domains without candidates known to fail; the same object if there are none.

        ``load_decided``: whether the load of each joint is decided, (n,).
        """
        reference = tuple(int(domain.pairs[0]) for domain in domains)
        for joint in {joint for joint, _ in self.failing}:
            failing = load_decided[joint] & self.fails(joint, domains[joint].pairs, reference)
            if failing.any():
                self.removed += int(failing.sum())
                domains = replace_domain(domains, joint, domains[joint].subset(~failing))
        return domains


def share_of_error(confidence: float, tested_before: int) -> float:
    """Error probability of the next decision; over all decisions ever made they sum up to 1 - confidence."""
    return (1.0 - confidence) / ((tested_before + 1) * (tested_before + 2))


def run_trial(ready: Candidate, drives: DriveSet, probability: float, error: float, *, seed: int) -> Trial:
    """Test one set: draw samples until it is decided whether it is feasible with a required probability.

    Half of the error probability is for the set, the other half for its joints.
    """
    study, names = ready.study, ready.study.joint_names
    feasible = samples = tests = 0
    feasible_by_joint = np.zeros(len(names), dtype=np.int64)
    count, decision = FIRST_SAMPLES, Decision.OPEN
    while decision is Decision.OPEN and samples < MAX_SAMPLES:
        count = min(count, MAX_SAMPLES - samples)
        for found in judged(ready, drawn(study, count, (seed, tests))):
            feasible += int(found.feasible.sum())
            feasible_by_joint += (~(found.joints > 1.0).any(axis=2)).sum(axis=0)
        samples, tests, count = samples + count, tests + 1, samples * (GROWTH - 1) + count
        decision = decide(Chance(feasible, samples), probability, 0.5 * error)
    joint = ""
    if decision is Decision.FALLS:
        share = 0.5 * error / len(names)
        decisions = [decide(Chance(int(count), samples), probability, share) for count in feasible_by_joint]
        joint = next((name for name, one in zip(names, decisions, strict=True) if one is Decision.FALLS), "")
    return Trial(drives, Chance(feasible, samples), decision, joint)


def decide(chance: Chance, probability: float, error: float) -> Decision:
    """Sequential test of a probability against a required one; valid however often it is repeated: Ville's inequality
    for the likelihood ratio mixed over a beta distribution (Robbins, Ann. Math. Stat. 41 (1970) 1397).
    """
    from scipy.special import betaln  # slow to import, and needed with tolerances only

    hits, misses = chance.held, chance.samples - chance.held
    mixed = float(betaln(PRIOR + hits, PRIOR + misses) - betaln(PRIOR, PRIOR))
    if mixed - hits * math.log(probability) - misses * math.log1p(-probability) < -math.log(error):
        return Decision.OPEN
    return Decision.HOLDS if chance.probability > probability else Decision.FALLS


def has_tolerances(study: Study) -> bool:
    """Whether a study states any tolerance."""
    return bool(study.tolerances.given)


def chance_of(base: Nominal, drives: dict[str, Pair], samples: int = SAMPLES) -> Chance:
    """Monte Carlo estimate of the probability that a set is feasible; drives: keys of (motor, gear) by joint name."""
    study = base.study
    count = min(samples, study.tolerances.samples)
    ready = candidate(base, drives)
    draws = drawn(study, count, (study.tolerances.seed, 0))
    return Chance(sum(int(found.feasible.sum()) for found in judged(ready, draws)), count)
