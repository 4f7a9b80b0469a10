"""When no set holds: the set of drives that comes nearest to what is asked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivetrain.sizing.judge.exact_road import judged
from drivetrain.sizing.judge.judge_kernels import LACKS
from drivetrain.sizing.search.beside_set import first_held
from drivetrain.sizing.search.fallen import beside
from drivetrain.sizing.search.problem import Problem
from drivetrain.study.model import Study

SUPPLY = -1  # what stands in place of a joint where every joint has a drive that holds


@dataclass(frozen=True, eq=False)
class Nearest:
    """The set of drives that comes nearest to what is asked.

    Attributes:
        study: What is asked.
        joint: Index of the joint nearest to the tip at which no candidate holds; SUPPLY: every joint has one.
        pairs: Packed pair of each joint that has a candidate at all.
        keys: Of motor and gear, by joint name.
    """

    study: Study
    joint: int
    pairs: dict[int, int]
    keys: dict[str, tuple[str, str]]


def nearest_set(problem: Problem) -> Nearest:
    """From the tip to the base the first candidate that holds, where none does the nearest one."""
    pairs: dict[int, int] = {}
    blocked = SUPPLY
    for joint in range(problem.n - 1, -1, -1):
        if len(problem.known[joint]) == 0:
            blocked = joint if blocked == SUPPLY else blocked
            continue
        held = first_held(problem, joint, problem.known[joint], pairs, 1)
        if len(held) == 0:
            blocked = joint if blocked == SUPPLY else blocked
        pairs[joint] = int(held[0]) if len(held) else _nearest(problem, joint, pairs)
    return Nearest(problem.packed.study, blocked, pairs, problem.keys(pairs))


def _nearest(problem: Problem, joint: int, pairs: dict[int, int]) -> int:
    """The candidate that is least far over its limits; the stage where the first failed bounds the rest from below."""
    found = beside(problem.packed, joint, problem.known[joint], pairs)
    used = found.numbers[:, 2]
    # Heat that runs away has no number of its own, so it bounds nothing; nor does a check that could not be made.
    used = np.where(np.isfinite(used), used, np.where(found.codes >= LACKS, math.inf, 1.0))
    nearest, least = int(found.pairs[0]), math.inf
    for at in np.argsort(used, kind="stable"):
        if used[at] >= least:
            break
        distance = judged(problem.packed, joint, int(found.pairs[at]), pairs).distance
        if distance < least:
            nearest, least = int(found.pairs[at]), distance
    return nearest
