"""The candidates that are left at each joint, handled as a whole: parts of them, the cheapest, the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetrain.sizing.search.propagation import Choices, Indices, Setting

Mask = NDArray[np.bool_]

UNPRICED = -1e300  # least cost where none is known: below every cost, and sums of it stay finite


def all_choices(known: tuple[Indices, ...], setting: Setting) -> Choices:
    """All candidates, with nothing known of them."""
    count = np.array([len(pairs) for pairs in known], dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64)
    pool = np.concatenate(known).astype(np.int64)
    cost = setting.base[pool] if not setting.energy else np.full(len(pool), UNPRICED)
    least = np.array([cost[at] if size else UNPRICED for at, size in zip(first, count, strict=True)])
    nothing, none = np.full(len(known), -1, dtype=np.int64), np.zeros(len(known), dtype=np.int64)
    return Choices(pool, cost, np.zeros(len(pool), dtype=bool), first, count, least, nothing, none)


def segment(choices: Choices, joint: int) -> Indices:
    """The candidates of one joint."""
    first = choices.first[joint]
    return choices.pool[first : first + choices.size[joint]]


def cheapest(choices: Choices, joint: int) -> int:
    """The cheapest candidate of one joint."""
    first = choices.first[joint]
    return int(choices.pool[first + int(np.argmin(choices.cost[first : first + choices.size[joint]]))])


def least_cost(choices: Choices, joint: int) -> float:
    """What the cheapest candidate of one joint costs."""
    first = choices.first[joint]
    return float(choices.cost[first : first + choices.size[joint]].min())


def chosen(choices: Choices, joint: int, kept: Mask) -> Choices:
    """The same choices with fewer candidates at one joint."""
    parts = _parts(choices)
    parts[joint] = choices.first[joint] + np.flatnonzero(kept)
    tested = choices.tested.copy()
    if tested[joint] == 1:  # those left need not be the ones that were tested
        tested[joint] = 0
    return _taken(choices, parts, tested)


def closed_up(choices: Choices, *, in_order: bool = False) -> Choices:
    """The same choices in memory of their own, without gaps between the joints."""
    parts = _parts(choices)
    if in_order:
        parts = [part[np.argsort(choices.cost[part], kind="stable")] for part in parts]
    return _taken(choices, parts, choices.tested.copy())


def _parts(choices: Choices) -> list[Indices]:
    """Where the candidates of each joint stand."""
    ends = choices.first + choices.size
    return [np.arange(first, end) for first, end in zip(choices.first.tolist(), ends.tolist(), strict=True)]


def _taken(choices: Choices, parts: list[Indices], tested: Indices) -> Choices:
    """The candidates that stand at some places, by joint."""
    size = np.array([len(part) for part in parts], dtype=np.int64)
    first, at = np.zeros(len(parts), dtype=np.int64), np.concatenate(parts)
    np.cumsum(size[:-1], out=first[1:])
    pool, cost, exact = choices.pool[at], choices.cost[at], choices.exact[at]
    return Choices(pool, cost, exact, first, size, choices.least.copy(), choices.known.copy(), tested)


def others(choices: Choices) -> list[Choices]:
    """All sets but that of the cheapest candidates, in parts: each differs from it first at another joint."""
    parts = []
    for joint in range(len(choices.size) - 1, -1, -1):
        first = segment(choices, joint) == cheapest(choices, joint)
        if choices.size[joint] > 1:
            parts.append(chosen(choices, joint, ~first))
        choices = chosen(choices, joint, first)
    return parts


def answered(choices: Choices, joint: int, pair: int, holds: bool) -> None:
    """What the Python road said of one candidate, in place."""
    first, size = int(choices.first[joint]), int(choices.size[joint])
    part = slice(first, first + size)
    choices.known[joint] = pair if holds else -1
    if holds:
        choices.exact[part] |= choices.pool[part] == pair
        return
    kept = choices.pool[part] != pair
    left = int(kept.sum())
    for values in (choices.pool, choices.cost, choices.exact):
        values[first : first + left] = values[part][kept]
    choices.size[joint] = left
