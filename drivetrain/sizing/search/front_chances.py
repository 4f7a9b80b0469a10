"""With what probability the sets of a front hold, and which of them hold often enough."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drivetrain.sizing.judge.packed_task import Indices
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.given_drives import stands
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.tolerance.many_arms import judged
from drivetrain.sizing.tolerance.robust_selection import CONFIDENCE, Decision, tried
from drivetrain.sizing.tolerance.scatter import Pair, drawn
from drivetrain.sizing.tolerance.scatter_ground import Ground, ground
from drivetrain.sizing.tolerance.scatter_task import bench
from drivetrain.sizing.tolerance.uncertainty import Chance
from drivetrain.study.model import Study

SAMPLES = 4096  # arms of a set, where no probability is wanted


def scatters(study: Study) -> bool:
    """Whether anything in a study scatters."""
    return bool(study.tolerances.given)


def chance_of(base: Ground, drives: dict[str, Pair], samples: int = SAMPLES) -> Chance:
    """The probability that a set holds, counted.

    Args:
        drives: Keys of (motor, gear) by joint name.
    """
    study, held = base.study, 0
    count = min(samples, study.tolerances.samples)
    ready = bench(study, drives, on=base)
    for found in judged(ready, drawn(study, count, (study.tolerances.seed, 0))):
        held += int(found.held.sum())
    return Chance(held, count)


@dataclass
class OftenEnough:
    """Says of sets whether they hold with the wanted probability, and remembers what it said.

    Attributes:
        problem: What they are chosen from.
        wanted: Probability.
        told: What became of each set.
        falling: Pairs that fall too often at a joint by themselves, by joint and numbers of the drives that load it.
        counters: Work done.
    """

    problem: Problem
    wanted: float
    told: dict[tuple[int, ...], Chance] = field(default_factory=dict)
    falling: set[tuple[int, int, bytes]] = field(default_factory=set)
    counters: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        """What all sets share is made once."""
        packed = self.problem.packed
        self._base = ground(packed.study, packed.work)

    def __call__(self, pairs: tuple[int, ...]) -> bool:
        """Whether a set holds often enough."""
        if any((joint, pair, self._loads(joint, pairs)) in self.falling for joint, pair in enumerate(pairs)):
            self.counters["sets with a drive that falls too often"] += 1
            return False
        drives = self.problem.keys(dict(enumerate(pairs)))
        ready = bench(self._base.study, drives, on=self._base)
        if not stands(ready.nominal):
            return False
        i = self.counters["sets drawn"]
        self.counters["sets drawn"] += 1
        error = (1.0 - CONFIDENCE) / ((i + 1) * (i + 2))  # over all sets ever tried: 1 - confidence
        one = DriveSet(drives, ready.nominal.objective, ready.nominal.criteria)
        trial = tried(ready, one, self.wanted, error, seed=self._base.study.tolerances.seed)
        if trial.joint:
            joint = [task.name for task in self._base.study.joints].index(trial.joint)
            self.falling.add((joint, pairs[joint], self._loads(joint, pairs)))
        if trial.decision is Decision.OPEN:
            self.counters["sets too near to tell"] += 1
        self.told[pairs] = trial.chance
        return trial.decision is Decision.HOLDS

    def falls(self, joint: int, pool: Indices, lead: tuple[int, ...]) -> NDArray[np.bool_]:
        """Which candidates of a joint are known to fall too often by themselves.

        Args:
            pool: Pairs of it, (K,).

        Returns:
            (K,).
        """
        loads = self._loads(joint, lead)
        return np.array([(joint, int(pair), loads) in self.falling for pair in pool], dtype=np.bool_)

    def _loads(self, joint: int, pairs: tuple[int, ...]) -> bytes:
        """The numbers of the drives that load a joint."""
        loading = np.flatnonzero(self.problem.setting.loads[joint])
        return self.problem.packed.task.numbers[[pairs[k] for k in loading]].tobytes()
