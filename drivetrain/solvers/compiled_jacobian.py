"""The Jacobian of a compiled right-hand side: its own, or by differences in groups of columns that share no row."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers.compiled_function import call_rows
from drivetrain.solvers.compiled_steps import rates
from drivetrain.solvers.layout import (
    AFTER,
    ARGUMENT,
    BEFORE,
    CULPRIT,
    DIFFERENCES,
    F0,
    FT,
    INNER,
    JACOBIANS,
    LIMIT,
    PROBE,
    RATES,
    RATES_AT,
    STAGE,
    TIME,
    TOLERANCE,
    X,
)

_SMALL = float(np.sqrt(np.finfo(np.float64).eps))
_LOOK = 16  # every so many Jacobians one column that looks too steep is looked at again
_MATTERS = 1e3  # a jump within a step matters when it moves a state by so many tolerances


@law
def increments(h: float, block: Array, atol: Array, rtol: float) -> None:
    """Row PROBE gets the increment of each state, in the direction in which it moves.

    Args:
        h: Step that will be tried [s].
    """
    for j in range(block.shape[1]):
        size = max(abs(block[X, j]), h * abs(block[F0, j]))
        floor = atol[j] / rtol
        size = max(size, floor) if floor < np.inf else max(size, 1e-3)
        step = _SMALL * size if block[F0, j] >= 0.0 else -_SMALL * size
        block[PROBE, j] = (block[X, j] + step) - block[X, j]


@law
def by_differences(
    address: int, h: float, block: Array, jacobian: Array, pattern: Any, data: Any, clock: Array, count: Any
) -> bool:
    """Fill the Jacobian by differences; False when the rates jump at this very state.

    Args:
        h: Step that will be tried [s].
    """
    starts, columns, row_starts, rows, _, ranks = pattern
    n, t, look = block.shape[1], clock[TIME], count[JACOBIANS] % _LOOK == 1
    for j in range(n):
        block[STAGE, j] = block[X, j]
    for group in range(len(starts) - 1):
        for k in range(starts[group], starts[group + 1]):
            block[STAGE, columns[k]] = block[X, columns[k]] + block[PROBE, columns[k]]
        rates(address, t, STAGE, RATES_AT, block, data, count)
        for k in range(starts[group], starts[group + 1]):
            j = columns[k]
            inverse, worst, culprit = 1.0 / block[PROBE, j], 0.0, -1
            for e in range(row_starts[j], row_starts[j + 1]):
                i = rows[e]
                change = block[RATES_AT, i] - block[F0, i]
                jacobian[ranks[i], ranks[j]] = change * inverse
                if look and abs(change) * h > worst * block[TOLERANCE, i]:
                    worst, culprit = abs(change) * h / block[TOLERANCE, i], i
            block[STAGE, j] = block[X, j]
            if worst > _MATTERS and _jumps(address, j, culprit, block, data, clock, count):
                return False
    return True


@law
def _jumps(address: int, j: int, i: int, block: Array, data: Any, clock: Array, count: Any) -> bool:
    """Whether rate i changes by the same, however little state j is moved."""
    change = block[RATES_AT, i] - block[F0, i]
    for part in (16.0, 256.0):
        block[STAGE, j] = block[X, j] + block[PROBE, j] / part
        rates(address, clock[TIME], STAGE, INNER, block, data, count)
        if block[STAGE, j] == block[X, j] or not abs(block[INNER, i] - block[F0, i] - change) < 0.1 * abs(change):
            block[STAGE, j] = block[X, j]
            return False
    block[STAGE, j] = block[X, j]
    count[CULPRIT], count[ARGUMENT] = i, j
    clock[BEFORE], clock[AFTER] = block[F0, i], block[RATES_AT, i]
    return True


@law
def time_derivative(address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> None:
    """Row FT gets df/dt, by a difference that stays within the step.

    Args:
        h: Step that will be tried [s].
    """
    t = clock[TIME]
    later = min(t + min(h, _SMALL * max(abs(t), h)), clock[LIMIT])
    rates(address, later, X, RATES_AT, block, data, count)
    span = later - t
    for i in range(block.shape[1]):
        block[FT, i] = (block[RATES_AT, i] - block[F0, i]) / span if span > 0.0 else 0.0


@law
def fill_jacobian(
    addresses: Any,
    h: float,
    block: Array,
    jacobian: Array,
    exact: Array,
    pattern: Any,
    atol: Array,
    rtol: float,
    data: Any,
    clock: Array,
    count: Any,
) -> bool:
    """Fill the Jacobian and df/dt at row X; False when the rates jump there.

    Args:
        h: Step that will be tried [s].
    """
    n, states = block.shape[1], pattern[4]
    count[JACOBIANS] += 1
    if addresses[1]:
        call_rows(addresses[1], clock[TIME], block, X, exact, 0, data)
        for i in range(n):
            block[FT, i] = exact[n, i]
            state = np.uint64(states[i])  # indices without a sign are not looked at whether they count from the end
            for j in range(n):
                jacobian[i, j] = exact[np.uint64(states[j]), state]
        if count[DIFFERENCES]:
            count[RATES] += count[DIFFERENCES] - 1
            time_derivative(addresses[0], h, block, data, clock, count)
        return True
    increments(h, block, atol, rtol)
    time_derivative(addresses[0], h, block, data, clock, count)
    return by_differences(addresses[0], h, block, jacobian, pattern, data, clock, count)
