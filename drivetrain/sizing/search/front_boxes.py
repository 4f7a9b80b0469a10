"""Boxes of choices as wholes: all sets, fewer of them, two parts; and the weightings that bound them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.search.front_cost import Box
from drivetrain.sizing.search.problem import Problem

Mask = NDArray[np.bool_]
STEPS = {0: 1, 1: 1, 2: 12, 3: 6}  # of weightings between two criteria, by how many of them are added up


@dataclass(frozen=True, eq=False)
class Part:
    """A part of all sets.

    Attributes:
        box: Its candidates.
        bound: The least of each weighting, (W,).
        used: The least utilisation.
    """

    box: Box
    bound: Array
    used: float


def all_sets(problem: Problem) -> Box:
    """All candidates, their costs not known yet."""
    n = problem.n
    size = np.array([len(pairs) for pairs in problem.known], dtype=np.int64)
    pool = np.concatenate(problem.known).astype(np.int64)
    ranges = np.zeros((2, n, NUMBERS))
    return Box(
        pool, np.zeros((len(pool), 4)), np.zeros(len(pool), dtype=np.bool_), np.cumsum(size) - size, size,
        np.zeros(n, dtype=np.bool_), np.ones(n, dtype=np.bool_), ranges[0], ranges[1], np.full(n, math.inf),
        np.zeros((n, n, NUMBERS)),
    )  # fmt: skip


def weightings(columns: Sequence[int], spans: Array) -> Array:
    """Weightings of the additive criteria: each alone, and mixtures of all.

    Args:
        spans: By which each is scaled, (4,).

    Returns:
        (W, 4).
    """
    rows, steps = [], STEPS[len(columns)]
    for parts in itertools.product(range(steps + 1), repeat=len(columns)):
        if sum(parts) == steps:
            row = np.zeros(4)
            for column, part in zip(columns, parts, strict=True):
                row[column] = part / steps / spans[column]
            rows.append(row)
    return np.array(rows) if columns else np.zeros((0, 4))


def only(box: Box, kept: Mask) -> Box:
    """A box of its own with some of the candidates; what their numbers change is found when costs are.

    Args:
        kept: Whether each stays, (T,).
    """
    inside = np.zeros(len(kept), dtype=np.bool_)
    for first, size in zip(box.first, box.size, strict=True):
        inside[first : first + size] = True
    kept = kept & inside
    size = np.array([int(kept[a : a + k].sum()) for a, k in zip(box.first, box.size, strict=True)], dtype=np.int64)
    return Box(
        box.pool[kept], box.cost[kept], box.doubt[kept], np.cumsum(size) - size, size, box.decided.copy(),
        box.stale.copy(), box.low.copy(), box.high.copy(), box.width.copy(), box.slope.copy(),
    )  # fmt: skip


def closed_up(box: Box) -> Box:
    """The same candidates without gaps between the joints."""
    return only(box, np.ones(len(box.pool), dtype=np.bool_))


def halves(part: Part) -> list[Part]:
    """A part in two, each with half the candidates of the joint that has most."""
    box, masks = part.box, []
    joint = int(np.argmax(box.size))
    first, size = int(box.first[joint]), int(box.size[joint])
    for own in (slice(first, first + size // 2), slice(first + size // 2, first + size)):
        mask = np.ones(len(box.pool), dtype=np.bool_)
        mask[own] = False
        masks.append(mask)
    return [Part(only(box, mask), part.bound, part.used) for mask in masks]


def parted(box: Box, numbers: Array, joint: int, number: int) -> list[Box]:
    """A box in two, parted in the middle of one number of a joint's drives.

    Args:
        numbers: By which drives load joints, of every pair, (P, NUMBERS).
    """
    first, size = int(box.first[joint]), int(box.size[joint])
    values = numbers[box.pool[first : first + size], number]
    below = values <= 0.5 * (values.min() + values.max())
    found = []
    for own in (below, ~below):
        kept = np.ones(len(box.pool), dtype=np.bool_)
        kept[first : first + size] = own
        found.append(only(box, kept))
    return found
