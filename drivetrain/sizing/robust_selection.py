"""The best set of drives that holds with a wanted probability, when its numbers scatter.

Sets are tried in the order of their objective. How many arms are drawn of each is not fixed beforehand: they are drawn
until it is plain whether the set holds often enough. To look again and again and stop when it suits is honest only with
a test that allows it, so the bound is one that holds at every number of samples at once (a mixture martingale), and
what all tests together may err by is shared out among them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from scipy.special import betaln

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.many_arms import judged
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.scatter import Pair, drawn
from drivetrain.sizing.scatter_task import bench
from drivetrain.sizing.search import select
from drivetrain.sizing.uncertainty import Chance
from drivetrain.study.study import Study

FIRST, GROWTH = 256, 2  # arms of the first look, and how many more each time
PRIOR = 0.5  # both numbers of the beta law that the martingale mixes over
CONFIDENCE = 0.99
MOST_SAMPLES = 100_000
MOST_SETS = 64


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
    """

    drives: DriveSet
    chance: Chance
    decision: Decision


@dataclass(frozen=True)
class RobustSelection:
    """The best set of drives that holds often enough.

    Attributes:
        wanted: Probability with which the set must hold.
        confidence: With which every decision told here is right, all of them together.
        chosen: The first set that holds; None where none did among those tried.
        trials: All that were tried, in the order of their objective.
        exhausted: No further set holds with nominal numbers.
    """

    wanted: float
    confidence: float
    chosen: Trial | None
    trials: tuple[Trial, ...]
    exhausted: bool

    @property
    def proof(self) -> str:
        """What is known of the choice, in words."""
        before = [trial for trial in self.trials if trial is not self.chosen]
        near = sum(trial.decision is Decision.OPEN for trial in before)
        confidence = f"{100.0 * self.confidence:g} % confidence"
        asked = f"{100.0 * self.wanted:g} %"
        if self.chosen is None:
            if not self.trials:
                return "no set holds with nominal numbers"
            end = "and there are no others" if self.exhausted else "the search went no further"
            return f"none of {len(self.trials)} sets is known to hold with {asked} ({confidence}), {end}"
        words = f"holds with at least {asked}; {len(before) - near} better sets do not ({confidence})"
        return f"{words}; of {near} better sets it could not be told" if near else words


def sets_in_order(study: Study, *, first: int = 8) -> Iterator[DriveSet]:
    """The sets that hold with nominal numbers, best first.

    Args:
        study: The task and what is wanted.
        first: How many the first search asks for; the next ones ask for four times as many.

    Yields:
        Sets in rising order of the objective, until there are no more or a search ends unproven.
    """
    told, count = 0, first
    while True:
        selection = select(study, wanted=replace(study.wanted, sets=count))
        yield from selection.sets[told:]
        told = len(selection.sets)
        if told < count or selection.state is not None:
            return
        count *= 4


def robust_select(
    study: Study,
    *,
    sets: Iterable[DriveSet] | None = None,
    holds: float | None = None,
    confidence: float = CONFIDENCE,
    most_sets: int = MOST_SETS,
    seed: int | None = None,
) -> RobustSelection:
    """The best set that holds with a wanted probability, among those that hold with nominal numbers.

    Args:
        study: The task, its tolerances and what is wanted.
        sets: Best first; None: from the search, as they are asked for.
        holds: Probability; None: the study's ``wanted.holds``.
        confidence: With which all decisions together are right.
        most_sets: How many are tried at most.
        seed: Of the random numbers; None: the study's own.

    Returns:
        The choice, and every better set with what became of it.

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
    trials: list[Trial] = []
    for i, one in enumerate(sets_in_order(study) if sets is None else sets):
        error = (1.0 - confidence) / ((i + 1) * (i + 2))  # over all sets ever tried: 1 - confidence
        trials.append(tried(study, one, wanted, error, seed=(start, i)))
        if trials[-1].decision is Decision.HOLDS:
            return RobustSelection(wanted, confidence, trials[-1], tuple(trials), False)
        if len(trials) == most_sets:
            return RobustSelection(wanted, confidence, None, tuple(trials), False)
    return RobustSelection(wanted, confidence, None, tuple(trials), True)


def tried(study: Study, drives: DriveSet, wanted: float, error: float, *, seed: tuple[int, int]) -> Trial:
    """One set, arms drawn until it is plain whether it holds often enough.

    Args:
        study: The task.
        drives: The set.
        wanted: Probability.
        error: Probability of a wrong decision, at most.
        seed: Of the random numbers, and which set it is.

    Returns:
        What became of it; OPEN after ``MOST_SAMPLES``.
    """
    keys: Mapping[str, Pair] = drives.drives
    ready = bench(study, keys)
    held = samples = look = 0
    count, decision = FIRST, Decision.OPEN
    while decision is Decision.OPEN and samples < MOST_SAMPLES:
        count = min(count, MOST_SAMPLES - samples)
        for found in judged(ready, drawn(study, count, (*seed, look))):
            held += int(found.held.sum())
        samples, look, count = samples + count, look + 1, samples * (GROWTH - 1) + count
        decision = decided(Chance(held, samples), wanted, error)
    return Trial(drives, Chance(held, samples), decision)


def decided(chance: Chance, wanted: float, error: float) -> Decision:
    """Whether a probability is above or below a wanted one; may be asked after any sample.

    Args:
        chance: As counted so far.
        wanted: Probability between 0 and 1.
        error: Probability that a wrong answer is ever given, at most.

    Returns:
        HOLDS or FALLS where the count can hardly come from the wanted probability, OPEN otherwise.

    Reference:
        Ville's inequality for the likelihood ratio mixed over a beta law; Robbins, Ann. Math. Stat. 41 (1970) 1397.
    """
    hits, misses = chance.held, chance.samples - chance.held
    mixed = float(betaln(PRIOR + hits, PRIOR + misses) - betaln(PRIOR, PRIOR))
    if mixed - hits * math.log(wanted) - misses * math.log1p(-wanted) < -math.log(error):
        return Decision.OPEN
    return Decision.HOLDS if chance.probability > wanted else Decision.FALLS
