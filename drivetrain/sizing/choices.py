"""The candidates that are left at each joint, handled as a whole: parts of them, the cheapest, the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetrain.sizing.propagation import Choices, Indices, Setting

Mask = NDArray[np.bool_]

UNPRICED = -1e300  # least cost where none is known: below every cost, and sums of it stay finite


def all_choices(known: tuple[Indices, ...], setting: Setting) -> Choices:
    """All candidates, with nothing known of them.

    Args:
        known: Pairs by joint, cheapest first.
        setting: What they cost.

    Returns:
        The choices; with energy counted their least costs are still unknown.
    """
    count = np.array([len(pairs) for pairs in known], dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64)
    pool = np.concatenate(known).astype(np.int64)
    cost = setting.share[pool].copy()
    dear = [UNPRICED if setting.energy or not size else cost[at] for at, size in zip(first, count, strict=True)]
    least = np.array(dear)
    return Choices(pool, cost, first, count, least, np.full(len(known), -1, dtype=np.int64))


def segment(choices: Choices, joint: int) -> Indices:
    """The candidates of one joint.

    Args:
        choices: Of all joints.
        joint: Index of the joint.

    Returns:
        Pairs.
    """
    first = choices.first[joint]
    return choices.pool[first : first + choices.size[joint]]


def cheapest(choices: Choices, joint: int) -> int:
    """The cheapest candidate of one joint.

    Args:
        choices: Of all joints.
        joint: Index of the joint.

    Returns:
        The pair.
    """
    first = choices.first[joint]
    return int(choices.pool[first + int(np.argmin(choices.cost[first : first + choices.size[joint]]))])


def chosen(choices: Choices, joint: int, kept: Mask) -> Choices:
    """The same choices with fewer candidates at one joint.

    Args:
        choices: Of all joints.
        joint: Index of the joint.
        kept: True for those that stay.

    Returns:
        New choices, without gaps.
    """
    masks = [np.ones(size, dtype=bool) for size in choices.size]
    masks[joint] = kept
    parts = [slice(first, first + size) for first, size in zip(choices.first, choices.size, strict=True)]
    pool = np.concatenate([choices.pool[part][mask] for part, mask in zip(parts, masks, strict=True)])
    cost = np.concatenate([choices.cost[part][mask] for part, mask in zip(parts, masks, strict=True)])
    count = np.array([int(mask.sum()) for mask in masks], dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64)
    return Choices(pool, cost, first, count, choices.least, choices.known)


def closed_up(choices: Choices) -> Choices:
    """The same choices without gaps between the joints.

    Args:
        choices: Of all joints.

    Returns:
        New choices.
    """
    return chosen(choices, 0, np.ones(choices.size[0], dtype=bool))


def copied(choices: Choices) -> Choices:
    """The same choices in memory of their own.

    Args:
        choices: Of all joints.

    Returns:
        New choices.
    """
    return Choices(
        choices.pool.copy(), choices.cost.copy(), choices.first.copy(), choices.size.copy(), choices.least.copy(),
        choices.known.copy(),
    )  # fmt: skip


def others(choices: Choices) -> list[Choices]:
    """All sets but that of the cheapest candidates, in parts: each differs from it first at another joint.

    Args:
        choices: Of all joints.

    Returns:
        The parts; no set is in two of them.
    """
    parts = []
    for joint in range(len(choices.size) - 1, -1, -1):
        first = segment(choices, joint) == cheapest(choices, joint)
        if choices.size[joint] > 1:
            parts.append(chosen(choices, joint, ~first))
        choices = chosen(choices, joint, first)
    return parts


def without(choices: Choices, joint: int, pair: int) -> None:
    """Take one candidate out, in place.

    Args:
        choices: Of all joints; those of the joint are closed up.
        joint: Index of the joint.
        pair: That goes.
    """
    first, size = int(choices.first[joint]), int(choices.size[joint])
    part = slice(first, first + size)
    kept = choices.pool[part] != pair
    left = int(kept.sum())
    choices.pool[first : first + left] = choices.pool[part][kept]
    choices.cost[first : first + left] = choices.cost[part][kept]
    choices.size[joint] = left
