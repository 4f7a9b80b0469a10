"""Candidates that fell, as columns: every pair of a joint judged beside the drives chosen after it, by compiled code.

There may be half a million of them, so they are kept as arrays and become objects only when one is looked at.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

import numpy as np
import pandas as pd

from drivetrain.arrays import Array
from drivetrain.sizing.judge.check_numbers import NAMES, UNITS
from drivetrain.sizing.judge.exact_road import judged
from drivetrain.sizing.judge.judge_kernels import ASKED, HELD, LACKS, judge_all, new_load
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.judge.packed_task import Indices, Packed, chosen_numbers
from drivetrain.sizing.results import Fallen
from drivetrain.study.mounting import mass_counts

NOT_CHECKED, NOT_KNOWN = " (not checked)", " (not known)"


@dataclass(frozen=True, eq=False)
class Beside:
    """Pairs of one joint, judged beside the drives chosen after it.

    Attributes:
        joint: Index of the joint.
        pairs: Indices into the packed pairs, (K,).
        codes: The check that felled each, LACKS more where it could not be made, HELD for those that hold, (K,).
        numbers: Required, available and utilisation of that check, or of the one that binds, (K, 3).
    """

    joint: int
    pairs: Indices
    codes: Indices
    numbers: Array

    @property
    def held(self) -> Indices:
        """The pairs that hold."""
        return self.pairs[self.codes == HELD]


def beside(packed: Packed, joint: int, pairs: Indices, chosen: Mapping[int, int]) -> Beside:
    """Every pair judged; the first stage that fails one tells the check of highest utilisation in it.

    Args:
        pairs: Indices into the packed pairs of that joint, (K,).
    """
    codes, numbers = np.empty(len(pairs), dtype=np.int64), np.empty((len(pairs), 3))
    drives = chosen_numbers(packed, chosen)
    judge_all(packed.task, joint, np.ascontiguousarray(pairs), drives, new_load(packed.task), codes, numbers)
    for at in np.flatnonzero(codes == ASKED):
        codes[at], numbers[at] = _asked(packed, joint, int(pairs[at]), chosen)
    return Beside(joint, pairs, codes, numbers)


def _asked(packed: Packed, joint: int, pair: int, chosen: Mapping[int, int]) -> tuple[int, tuple[float, float, float]]:
    """The same for one pair by the functions of an evaluation."""
    found = judged(packed, joint, pair, chosen, stop_at_fail=True)
    if not found.failed and found.lacking:
        first = found.lacking[0]
        return NAMES.index(first.name) + LACKS, (_number(first.required), math.nan, math.inf)
    counted = found.failed or [check for check in found.checks if check.utilisation is not None]
    worst = max(counted, key=lambda one: one.utilisation or 0.0)
    figures = _number(worst.required), _number(worst.available), _number(worst.utilisation)
    return (NAMES.index(worst.name) if found.failed else HELD), figures


@dataclass(frozen=True, eq=False)
class FallenTable(Sequence[Fallen]):
    """Candidates that fell, row by row as ``Fallen``, held as columns.

    Attributes:
        packed: The study.
        joint: Index of the joint of each row, (rows,).
        pair: Index of the pair of each row, (rows,).
        label: Index into ``labels`` and ``units`` of what felled it, (rows,).
        labels: Names of checks and of what is lacking.
        units: Of each label.
        numbers: Required, available, utilisation and share of the objective, (rows, 4).
    """

    packed: Packed
    joint: Indices
    pair: Indices
    label: Indices
    labels: tuple[str, ...]
    units: tuple[str, ...]
    numbers: Array

    def __len__(self) -> int:
        return len(self.pair)

    @overload
    def __getitem__(self, row: int) -> Fallen: ...

    @overload
    def __getitem__(self, row: slice) -> FallenTable: ...

    def __getitem__(self, row: int | slice) -> Fallen | FallenTable:
        """One candidate, or some rows."""
        if isinstance(row, slice):
            parts = (self.joint[row], self.pair[row], self.label[row])
            return FallenTable(self.packed, *parts, self.labels, self.units, self.numbers[row])
        keys = self._joint_names[self.joint[row]], *self.packed.keys(int(self.pair[row]))
        required, available, used, share = (float(value) for value in self.numbers[row])
        label = self.label[row]
        return Fallen(*keys, self.labels[label], required, available, self.units[label], used, share)

    @cached_property
    def _joint_names(self) -> list[str]:
        return [task.name for task in self.packed.study.joints]

    def frame(self) -> pd.DataFrame:
        """All rows as a table."""
        categories: Any = pd.Categorical.from_codes  # whose annotations do not take a list of names
        motor, gear = self.packed.task.pairs[self.pair].T
        gears = list(dict.fromkeys(self.packed.gears))
        row_of = {key: row for row, key in enumerate(gears)}  # a given gear may have a second row
        gear = np.array([row_of[key] for key in self.packed.gears], dtype=np.int64)[gear]
        required, available, used, share = self.numbers.T
        units = sorted(set(self.units))
        unit = np.array([units.index(one) for one in self.units], dtype=np.int64)[self.label]
        return pd.DataFrame(
            {
                "joint": categories(self.joint, self._joint_names),
                "motor": categories(motor, list(self.packed.motors)),
                "gear": categories(gear, gears),
                "check": categories(self.label, list(self.labels)),
                "required": required, "available": available,
                "unit": categories(unit, units), "utilisation": used, "objective": share,
            }
        )  # fmt: skip


def fallen_table(packed: Packed, parts: Sequence[Beside], share: Array, unknown: Mapping[int, Indices]) -> FallenTable:
    """The pairs that fell at all joints.

    Args:
        share: What each pair adds to the objective, (P,).
    """
    joints, pairs, labels, numbers = [], [], [], []
    for part in parts:
        felled = part.codes != HELD
        codes = part.codes[felled]
        lacking = codes >= LACKS
        found = np.where(lacking, codes - LACKS + len(NAMES), codes)
        figures = np.column_stack([part.numbers[felled], share[part.pairs[felled]]])
        figures[lacking, 1], figures[lacking, 2] = math.nan, math.inf
        unshared = unknown.get(part.joint, np.zeros(0, dtype=np.int64))
        nothing = np.full((len(unshared), 4), math.nan)
        nothing[:, 2] = math.inf
        heavy = mass_counts(packed.study, part.joint) or weight_of(packed.study.wanted, "mass") != 0.0
        weightless = heavy & np.isnan(packed.mass[unshared])
        pairs += [part.pairs[felled], unshared]
        labels += [found, np.where(weightless, 2 * len(NAMES), 2 * len(NAMES) + 1)]
        numbers += [figures, nothing]
        joints.append(np.full(len(codes) + len(unshared), part.joint))
    names = (*NAMES, *(name + NOT_CHECKED for name in NAMES), "mass" + NOT_KNOWN, "price" + NOT_KNOWN)
    units = (*UNITS, *UNITS, "kg", "")
    return FallenTable(
        packed, _joined(joints), _joined(pairs), _joined(labels), names, units,
        np.concatenate(numbers) if numbers else np.zeros((0, 4)),
    )  # fmt: skip


def _joined(parts: list[Indices]) -> Indices:
    return np.concatenate(parts).astype(np.int64) if parts else np.zeros(0, dtype=np.int64)


def _number(value: float | None) -> float:
    return math.nan if value is None else value
