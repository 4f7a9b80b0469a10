"""Whether sets of drives are feasible often enough while their numbers scatter: drawn until that is plain.

How many arms are drawn of a set is not fixed beforehand: they are drawn until it is plain whether it holds often
enough. To look again and again and stop when it suits is honest only with a test that allows it, so the bound is one
that holds at every number of samples at once (a mixture martingale), and what all tests together may err by is shared
out among them. All sets are tried with the same random numbers, so that they differ by their drives alone; the shared
error does not ask for independence. Where the checks of one joint alone fall too often, every set with the same drive
at that joint and the same loads on it falls with it, and is not drawn again.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.candidates import Domains, Indices, Mask, with_domain
from drivetrain.sizing.search.preconditions import satisfied
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.tolerance.draws import Pair, drawn
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.sizing.tolerance.sampling import Candidate, Nominal, candidate, judged
from drivetrain.study.model import Study

FIRST, GROWTH = 256, 2  # arms of the first look, and how many more each time
PRIOR = 0.5  # both numbers of the beta law that the martingale mixes over
CONFIDENCE = 0.99
MOST_SAMPLES = 100_000
SAMPLES = 4096  # arms of a set, where no probability is wanted


class Decision(StrEnum):
    """Whether a probability is above the wanted one: HOLDS, FALLS, or OPEN where it is too near to tell."""

    HOLDS = "holds"
    FALLS = "falls"
    OPEN = "open"


@dataclass(frozen=True)
class Trial:
    """One set that was tried."""

    drives: DriveSet  # the set
    chance: Chance  # that it holds, as far as it was counted
    decision: Decision  # what was decided
    joint: str = ""  # the joint whose checks alone fall too often, where one does; else empty


@dataclass
class ChanceConstraint:
    """Says of sets whether they are feasible with a wanted probability, and remembers what it said."""

    problem: Problem  # what they are chosen from
    base: Nominal  # the study
    wanted: float  # probability
    confidence: float = CONFIDENCE  # of all decisions together
    seed: int = 0  # of the random numbers
    most: int = 10**9  # sets that are tried at most
    trials: dict[tuple[int, ...], Trial] = field(default_factory=dict)  # what became of each set that was tried
    # pairs that fail too often at a joint by themselves, by joint and numbers of the drives that load it
    failing: dict[tuple[int, bytes], set[int]] = field(default_factory=dict)
    passed: int = 0  # how often such a pair was taken out undrawn
    counters: Counter[str] = field(default_factory=Counter)  # work done

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

    def without_failing(self, domains: Domains, decided: Mask) -> Domains:
        """Domains without the candidates that are known to fail; the same where none is.

        ``decided``: whether the load of each joint is, (n,).
        """
        lead = tuple(int(domain.pairs[0]) for domain in domains)
        for joint in {joint for joint, _ in self.failing}:
            failing = decided[joint] & self.fails(joint, domains[joint].pairs, lead)
            if failing.any():
                self.passed += int(failing.sum())
                domains = with_domain(domains, joint, domains[joint].kept(~failing))
        return domains


def share_of_error(confidence: float, tried_before: int) -> float:
    """Of all decisions together that of the next one: over all sets ever tried they sum up to what is left."""
    return (1.0 - confidence) / ((tried_before + 1) * (tried_before + 2))


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
    from scipy.special import betaln  # takes long to import, and few ask for probabilities

    hits, misses = chance.held, chance.samples - chance.held
    mixed = float(betaln(PRIOR + hits, PRIOR + misses) - betaln(PRIOR, PRIOR))
    if mixed - hits * math.log(wanted) - misses * math.log1p(-wanted) < -math.log(error):
        return Decision.OPEN
    return Decision.HOLDS if chance.probability > wanted else Decision.FALLS


def scatters(study: Study) -> bool:
    """Whether anything in a study scatters."""
    return bool(study.tolerances.given)


def chance_of(base: Nominal, drives: dict[str, Pair], samples: int = SAMPLES) -> Chance:
    """The probability that a set holds, counted; drives: keys of (motor, gear) by joint name."""
    study, held = base.study, 0
    count = min(samples, study.tolerances.samples)
    ready = candidate(base, drives)
    for found in judged(ready, drawn(study, count, (study.tolerances.seed, 0))):
        held += int(found.feasible.sum())
    return Chance(held, count)
