"""What stands beside a chosen set of drives: the candidates that fell, and the next best that would hold as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np
import pandas as pd

from drivetrain.sizing.results import Fallen
from drivetrain.sizing.search.fallen import FallenTable, beside, fallen_table
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.search.propagation import Indices

ALTERNATIVES = 5
AT_ONCE = 64  # candidates judged before it is seen whether they are enough

Alternatives = tuple[tuple[str, str, float], ...]


@dataclass(frozen=True, eq=False)
class FallenBeside(Sequence[Fallen]):
    """Every candidate that falls beside a set of drives, judged when first asked for.

    Attributes:
        problem: What was chosen from.
        pairs: The set, by joint; joints that have none are not told.
    """

    problem: Problem
    pairs: Mapping[int, int]

    @cached_property
    def table(self) -> FallenTable:
        """All of them."""
        problem, joints = self.problem, sorted(self.pairs, reverse=True)
        parts = [beside(problem.packed, joint, problem.known[joint], self.pairs) for joint in joints]
        unknown = {joint: problem.unknown[joint] for joint in joints}
        return fallen_table(problem.packed, parts, problem.setting.share, unknown)

    def __len__(self) -> int:
        return len(self.table)

    @overload
    def __getitem__(self, row: int) -> Fallen: ...

    @overload
    def __getitem__(self, row: slice) -> Sequence[Fallen]: ...

    def __getitem__(self, row: int | slice) -> Fallen | Sequence[Fallen]:
        """One candidate, or some."""
        return self.table[row]

    def frame(self) -> pd.DataFrame:
        """All of them as a table."""
        return self.table.frame()


def alternatives(problem: Problem, pairs: Mapping[int, int]) -> dict[str, Alternatives]:
    """The next best candidates of each joint that hold beside the drives after it."""
    found: dict[str, Alternatives] = {}
    for joint in sorted(pairs, reverse=True):
        others = problem.known[joint][problem.known[joint] != pairs[joint]]
        held = first_held(problem, joint, others, pairs, ALTERNATIVES)
        name = problem.packed.study.joints[joint].name
        found[name] = tuple((*problem.packed.keys(int(one)), float(problem.setting.share[one])) for one in held)
    return found


def first_held(problem: Problem, joint: int, pairs: Indices, chosen: Mapping[int, int], most: int) -> Indices:
    """The first of some pairs that hold."""
    held, size, start = np.zeros(0, dtype=np.int64), AT_ONCE, 0
    while start < len(pairs) and len(held) < most:
        part = beside(problem.packed, joint, pairs[start : start + size], chosen).held
        held, start, size = np.concatenate([held, part]), start + size, 2 * size
    return held[:most]
