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
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from scipy.special import betaln

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.judge.packed_task import pack
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.choices import chosen, segment
from drivetrain.sizing.search.given_drives import as_given, stands
from drivetrain.sizing.search.problem import problem
from drivetrain.sizing.search.propagation import Choices, Indices
from drivetrain.sizing.search.search_tree import Node, Tree
from drivetrain.sizing.tolerance.many_arms import judged
from drivetrain.sizing.tolerance.scatter import drawn
from drivetrain.sizing.tolerance.scatter_ground import Ground, ground
from drivetrain.sizing.tolerance.scatter_task import Bench, bench
from drivetrain.sizing.tolerance.uncertainty import Chance
from drivetrain.study.model import Study

FIRST, GROWTH = 256, 2  # arms of the first look, and how many more each time
PRIOR = 0.5  # both numbers of the beta law that the martingale mixes over
CONFIDENCE = 0.99
MOST_SAMPLES = 100_000
MOST_SETS = 1000
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
        words = f"{words}; of {near} better sets it could not be told" if near else words
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
    judge = _Judge(ground(study, work), wanted, confidence, start, most_sets)
    return _searched(judge) if sets is None else _in_order(judge, sets)


@dataclass
class _Judge:
    """Says of sets whether they hold often enough, and remembers what it said.

    Attributes:
        base: The study.
        wanted: Probability.
        confidence: Of all decisions together.
        seed: Of the random numbers.
        most: Sets that are tried at most.
        trials: All that were tried.
    """

    base: Ground
    wanted: float
    confidence: float
    seed: int
    most: int
    trials: list[Trial] = field(default_factory=list)

    @property
    def over(self) -> bool:
        """Whether no further set may be tried."""
        return len(self.trials) >= self.most

    def trial(self, ready: Bench, drives: DriveSet) -> Trial:
        """One set, its share of the error being what is left to it."""
        i = len(self.trials)
        error = (1.0 - self.confidence) / ((i + 1) * (i + 2))  # over all sets ever tried: 1 - confidence
        self.trials.append(tried(ready, drives, self.wanted, error, seed=self.seed))
        return self.trials[-1]


def _in_order(judge: _Judge, sets: Iterable[DriveSet]) -> RobustSelection:
    """The first of some sets that holds."""
    wanted, confidence, exhausted = judge.wanted, judge.confidence, True
    for one in sets:
        found = judge.trial(bench(judge.base.study, one.drives, on=judge.base), one)
        if found.decision is Decision.HOLDS:
            return RobustSelection(wanted, confidence, found, tuple(judge.trials), False)
        if judge.over:
            exhausted = False
            break
    bound = math.inf if exhausted else judge.trials[-1].drives.objective
    return RobustSelection(wanted, confidence, None, tuple(judge.trials), exhausted, bound=bound)


@dataclass
class _RobustTree(Tree):
    """A search in which a set must also hold often enough to be the best so far.

    Attributes:
        judge: Says whether it does.
        falling: Pairs that fall too often at a joint by themselves, by joint and the numbers of the drives loading it.
        passed: How often such a pair was taken out undrawn.
        accepted: What was found of each set that holds.
    """

    judge: _Judge | None = None
    falling: dict[tuple[int, bytes], set[int]] = field(default_factory=dict)
    passed: int = 0
    accepted: dict[tuple[int, ...], Trial] = field(default_factory=dict)

    def _narrowed(self, choices: Choices, full: int, above: Node | None) -> Node | None:
        node = super()._narrowed(choices, full, above)
        while node is not None and self.falling:
            left = self._without_falling(node)
            if left is node.choices:
                break
            node = super()._narrowed(left, full, node)
        return node

    def _without_falling(self, node: Node) -> Choices:
        """The candidates of a node without those that are known to fall with the loads that it has decided."""
        left = node.choices
        for joint in {joint for joint, _ in self.falling}:
            loading = self._loading(joint)
            if (node.low[loading] != node.high[loading]).any():
                continue
            fallen = self.falling.get((joint, node.low[loading].tobytes()), set())
            kept = np.array([pair not in fallen for pair in segment(left, joint).tolist()], dtype=np.bool_)
            if not kept.all():
                self.passed += int((~kept).sum())
                left = chosen(left, joint, kept)
        return left

    def _loading(self, joint: int) -> Indices:
        """The joints whose drives load a joint."""
        return np.flatnonzero(self.problem.setting.loads[joint])

    def _loads(self, joint: int, pairs: tuple[int, ...]) -> bytes:
        """The numbers of the drives that load a joint."""
        return self.problem.packed.task.numbers[[pairs[k] for k in self._loading(joint)]].tobytes()

    def _offer(self, node: Node) -> None:
        before = list(self.best)
        super()._offer(node)
        for found in [one for one in self.best if one not in before]:
            if not self._accepts(found.pairs):
                self.best = before
                self.excluded |= {found.pairs}

    def _accepts(self, pairs: tuple[int, ...]) -> bool:
        """Whether a set holds, with nominal numbers as with those that scatter."""
        judge = self.judge
        if judge is None or judge.over:
            return False
        ready = bench(judge.base.study, self.problem.keys(dict(enumerate(pairs))), on=judge.base)
        if not stands(ready.nominal):
            return False
        trial = judge.trial(ready, DriveSet(dict(ready.drives), ready.nominal.objective, ready.nominal.criteria))
        if trial.joint:
            joint = [task.name for task in judge.base.study.joints].index(trial.joint)
            self.falling.setdefault((joint, self._loads(joint, pairs)), set()).add(pairs[joint])
        if trial.decision is Decision.HOLDS:
            self.accepted[pairs] = trial
        return trial.decision is Decision.HOLDS


def _searched(judge: _Judge) -> RobustSelection:
    """The best set of all that holds, by one search."""
    study = judge.base.study
    wanted = replace(study.wanted, sets=1)
    packed = pack(replace(study, wanted=wanted), replace(judge.base.work, study=replace(study, wanted=wanted)))
    tree = _RobustTree(problem(as_given(packed), wanted), judge=judge)
    tree.begin()
    deadline = time.perf_counter() + wanted.time_limit
    while not (tree.finished or judge.over) and time.perf_counter() < deadline:
        tree.run(0.0, lambda done, total, text: None)  # one step at a time
    chosen = tree.accepted[tree.best[0].pairs] if tree.best else None
    trials = tuple(sorted(judge.trials, key=lambda one: (one.drives.objective, one is chosen)))
    bound = math.inf if tree.finished else tree.bound - tree.problem.trifle
    if chosen is not None and tree.finished:
        bound = chosen.drives.objective
    return RobustSelection(
        judge.wanted, judge.confidence, chosen, trials, tree.finished and chosen is None, tree.passed, bound
    )


def tried(ready: Bench, drives: DriveSet, wanted: float, error: float, *, seed: int) -> Trial:
    """One set, arms drawn until it is plain whether it holds often enough."""
    study, names = ready.study, [task.name for task in ready.study.joints]
    held = samples = look = 0
    by_joint = np.zeros(len(names), dtype=np.int64)
    count, decision = FIRST, Decision.OPEN
    while decision is Decision.OPEN and samples < MOST_SAMPLES:
        count = min(count, MOST_SAMPLES - samples)
        for found in judged(ready, drawn(study, count, (seed, look))):
            held += int(found.held.sum())
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
