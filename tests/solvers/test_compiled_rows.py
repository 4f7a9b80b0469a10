"""Sums of rows and the solution with factors, against numpy."""

from __future__ import annotations

import numba as nb
import numpy as np
import pytest

from drivetrain.solvers.compiled_rows import mix
from drivetrain.solvers.compiled_steps import factor, solve


@nb.njit
def _mixed(block, factors):  # type: ignore[no-untyped-def]
    mix(block, 1, (1, 0, 3), (factors[0], factors[1], factors[2]))


@pytest.mark.parametrize("width", range(1, 14))
def test_a_row_becomes_a_sum_it_stands_in(width: int) -> None:
    rng = np.random.default_rng(width)
    block, factors = rng.normal(size=(5, width)), rng.normal(size=3)
    wanted = block.copy()
    wanted[1] = factors[0] * block[1] + factors[1] * block[0] + factors[2] * block[3]
    _mixed(block, factors)
    np.testing.assert_array_equal(block, wanted)  # the same products and sums, in the same order


@pytest.mark.parametrize("width", [1, 2, 5, 9, 14])
@pytest.mark.parametrize("small", [False, True])  # whether pivots are so small that rows must be exchanged
def test_factors_solve_in_any_order_of_elimination(width: int, small: bool) -> None:
    rng = np.random.default_rng(10 * width + small)
    n, diagonal = width, 0.0 if small and width > 1 else 3.0
    full = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.6) + np.roll(np.eye(n), 1, axis=0) * 2.0
    if small and width > 1:
        np.fill_diagonal(full, 1e-9)
    states = rng.permutation(n)
    order = np.concatenate([np.zeros(n * n + 2 * n + 1, dtype=np.int64), states])
    packed, block = np.zeros(n * n), rng.normal(size=(2, n))
    factor(full[np.ix_(states, states)].copy(), diagonal, np.zeros((n, n)), packed, order)
    solve(packed, order, block, 0, 1)
    assert diagonal != 0.0 or not np.array_equal(order[:n], states)  # rows were exchanged
    wanted = np.linalg.solve(diagonal * np.eye(n) - full, block[0])
    # Both lose up to the condition number times rounding; these matrices have one of some hundreds.
    np.testing.assert_allclose(block[1], wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
