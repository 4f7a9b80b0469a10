"""Every check of many arms as they may be built: by compiled code, and where that cannot, by ``evaluate``."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.judge.check_numbers import NAMES
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.scatter import Draws, built
from drivetrain.sizing.tolerance.scatter_kernels import judge_arms
from drivetrain.sizing.tolerance.scatter_numbers import CHECKS, ScatterTask
from drivetrain.sizing.tolerance.scatter_task import Bench, aimed

SUPPLY_NAMES = ("supply peak power", "supply mean power", "supply regenerated power")
CHUNK = 4096  # arms judged at once: 4 MB of figures
CLOSE = 1e-6  # of a utilisation to 1: nearer than that ``evaluate`` decides


@dataclass(frozen=True, eq=False)
class Figures:
    """Utilisations of some arms, NaN where a check was not made.

    Attributes:
        joints: In the order of ``NAMES``, (S, n, CHECKS).
        supply: In the order of ``SUPPLY_NAMES``, (S, 3).
        judged: Whether every essential check could be made, (S,).
    """

    joints: Array
    supply: Array
    judged: Array

    @property
    def held(self) -> Array:
        """Whether every check of an arm holds, (S,)."""
        over = (self.joints > 1.0).any(axis=(1, 2)) | (self.supply > 1.0).any(axis=1)
        return np.asarray(~over & (self.judged > 0.0))


def judged(ready: Bench, draws: Draws, *, threads: int = 1) -> Iterator[Figures]:
    """The arms judged, chunk by chunk."""
    task = ready.task if ready.slow else aimed(ready, draws)
    parts = [slice(first, min(first + CHUNK, len(draws))) for first in range(0, len(draws), CHUNK)]
    if threads <= 1 or len(parts) <= 1:
        yield from (_chunk(ready, task, draws, part) for part in parts)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(lambda part: _chunk(ready, task, draws, part), parts)


def _chunk(ready: Bench, task: ScatterTask, draws: Draws, part: slice) -> Figures:
    """Some arms that follow one another."""
    count, n, proven = part.stop - part.start, len(ready.study.joints), float(not ready.nominal.lacking)
    found = Figures(np.full((count, n, CHECKS), np.nan), np.full((count, 3), np.nan), np.full(count, proven))
    again = np.arange(count)
    if not ready.slow:
        judge_arms(
            task, draws.factors[part], draws.ambient[part], draws.payload[part], ready.memory(), found.joints,
            found.supply,
        )  # fmt: skip
        near = (np.abs(found.joints - 1.0) < CLOSE).any(axis=(1, 2))
        again = np.flatnonzero(near | (np.abs(found.supply - 1.0) < CLOSE).any(axis=1))
    for sample in again:
        _slowly(ready, draws, part.start + int(sample), found, int(sample))
    return found


def _slowly(ready: Bench, draws: Draws, sample: int, found: Figures, at: int) -> None:
    """One arm by ``evaluate``."""
    evaluation = evaluate(built(ready.study, ready.drives, draws, sample))
    joints, supply = figures_of(evaluation)
    found.joints[at], found.supply[at] = joints, supply
    found.judged[at] = float(not evaluation.lacking)


def figures_of(evaluation: Evaluation) -> tuple[Array, Array]:
    """Utilisations of an evaluation.

    Returns:
        As one arm in ``Figures``: (n, CHECKS) and (3,).
    """
    joints = np.full((len(evaluation.joints), CHECKS), np.nan)
    supply = np.full(3, np.nan)
    for row, result in zip(joints, evaluation.joints.values(), strict=True):
        for check in result.checks:
            if check.utilisation is not None:
                row[NAMES.index(check.name)] = check.utilisation
    for check in evaluation.shared:
        if check.name in SUPPLY_NAMES and check.utilisation is not None:
            supply[SUPPLY_NAMES.index(check.name)] = check.utilisation
    return joints, supply
