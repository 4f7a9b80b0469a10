"""The solution with the factors of the stages' matrix, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.solvers.linear import factor, solve


@pytest.mark.parametrize("width", [1, 2, 5, 9, 14])
@pytest.mark.parametrize("small", [False, True])  # whether pivots are so small that rows must be exchanged
def test_factors_solve(width: int, small: bool) -> None:
    rng = np.random.default_rng(10 * width + small)
    n, diagonal = width, 0.0 if small and width > 1 else 3.0
    full = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.6) + np.roll(np.eye(n), 1, axis=0) * 2.0
    if small and width > 1:
        np.fill_diagonal(full, 1e-9)
    pivots = np.zeros(n, dtype=np.uint64)
    matrix, goal = np.zeros((n, n)), rng.normal(size=n)
    wanted = np.linalg.solve(diagonal * np.eye(n) - full, goal)
    factor(full.T.copy(), diagonal, matrix, pivots)
    solve(matrix, pivots, goal, np.zeros(n))
    assert diagonal != 0.0 or not np.array_equal(pivots, np.arange(n))  # rows were exchanged
    # Both lose up to the condition number times rounding; these matrices have one of some hundreds.
    np.testing.assert_allclose(goal, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
