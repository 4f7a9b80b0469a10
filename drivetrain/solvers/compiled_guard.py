"""Is a right-hand side that resists every step discontinuous? A search along the step answers with certainty."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_steps import rates
from drivetrain.solvers.layout import (
    AFTER,
    ARGUMENT,
    BEFORE,
    CULPRIT,
    F1,
    INNER,
    JUMP_AT,
    LIMIT,
    NEXT,
    PROBE,
    RATES_AT,
    STAGE,
    TIME,
    TOLERANCE,
    X,
)

_HALVINGS = 52
_SMOOTH = 0.05  # a change that has shrunk to this share shrinks with the interval: no jump


@law
def _at(address: int, share: float, h: float, goal: int, block: Array, data: Any, clock: Array, count: Any) -> None:
    """Rates on the straight line from X to NEXT."""
    for j in range(block.shape[1]):
        block[STAGE, j] = block[X, j] + share * (block[NEXT, j] - block[X, j])
    rates(address, min(clock[TIME] + share * h, clock[LIMIT]), STAGE, goal, block, data, count)


@law
def find_jump(address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> bool:
    """Whether a rate jumps between the ends of a refused step; count and clock say which, where and by how much.

    The interval in which it changes most is halved until it is empty. A continuous rate, however steep, changes less
    and less; one that jumps does not. The rows RATES_AT, PROBE, F1 and INNER are overwritten.

    Args:
        h: The refused step [s]; its end is row NEXT.
    """
    n = block.shape[1]
    for j in range(n):
        if not np.isfinite(block[NEXT, j]):
            return False
    _at(address, 0.0, h, PROBE, block, data, clock, count)
    _at(address, 1.0, h, F1, block, data, clock, count)
    worst, i = 0.0, -1
    for j in range(n):
        change = h * abs(block[F1, j] - block[PROBE, j]) / block[TOLERANCE, j]
        if change > worst:
            worst, i = change, j
    if i < 0 or not worst < np.inf:
        return False
    low, high, left, right = 0.0, 1.0, block[PROBE, i], block[F1, i]
    whole = abs(right - left)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        _at(address, middle, h, RATES_AT, block, data, clock, count)
        value = block[RATES_AT, i]
        if abs(value - left) >= abs(right - value):
            high, right = middle, value
        else:
            low, left = middle, value
        if abs(right - left) < _SMOOTH * whole:
            return False
    clock[BEFORE], clock[AFTER], clock[JUMP_AT] = left, right, clock[TIME] + high * h
    count[CULPRIT], count[ARGUMENT] = i, _argument(address, i, low, high, h, block, data, clock, count)
    return True


@law
def _argument(
    address: int, i: int, low: float, high: float, h: float, block: Array, data: Any, clock: Array, count: Any
) -> int:
    """Which state, moved alone across the jump, makes rate i jump; -1: none, it is time."""
    change = clock[AFTER] - clock[BEFORE]
    _at(address, low, h, PROBE, block, data, clock, count)
    for j in range(block.shape[1]):
        kept = block[STAGE, j]
        block[STAGE, j] = block[X, j] + high * (block[NEXT, j] - block[X, j])
        if block[STAGE, j] != kept:
            rates(address, min(clock[TIME] + low * h, clock[LIMIT]), STAGE, INNER, block, data, count)
            if abs(block[INNER, i] - block[PROBE, i]) > 0.5 * abs(change):
                return j
        block[STAGE, j] = kept
    return -1
