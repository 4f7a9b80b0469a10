"""RODAS5P: its tables against the conditions of order, its order, stiff references, counts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from compiled_cases import STIFF, counted, python_rates

from drivetrain.errors import InputError
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince853, Rodas4, Rodas5P
from drivetrain.solvers.tableaux import RODAS5P as METHOD

START = [1.0, 0.2]


def exact(times: np.ndarray) -> np.ndarray:
    return integrate(DormandPrince853(1e-13, 1e-13), python_rates(counted()), START, times).states


def classical() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Alpha_ij, Gamma_ij and b_i of the method, from the tables without matrix products."""
    gamma = np.linalg.inv(np.eye(8) / METHOD.gamma - METHOD.c)
    return METHOD.a[:-1] @ gamma, gamma, METHOD.a[-1] @ gamma


def conditions(weights: np.ndarray, order: int) -> list[float]:
    """What each condition of order misses; Hairer, Wanner, Solving Ordinary Differential Equations II, theorem IV.7.3.

    Trees whose vertices have one branch take beta = alpha + gamma there, all others alpha.
    """
    alpha, gamma, _ = classical()
    beta, start = alpha + gamma, alpha.sum(axis=1)
    row = beta.sum(axis=1)
    trees = {
        1: [(np.ones(8), 1)],
        2: [(row, 2)],
        3: [(start**2, 3), (beta @ row, 6)],
        4: [(start**3, 4), (start * (alpha @ row), 8), (beta @ start**2, 12), (beta @ beta @ row, 24)],
        5: [
            (start**4, 5), (start**2 * (alpha @ row), 10), ((alpha @ row) ** 2, 20), (start * (alpha @ start**2), 15),
            (start * (alpha @ beta @ row), 30), (beta @ start**3, 20), (beta @ (start * (alpha @ row)), 40),
            (beta @ beta @ start**2, 60), (beta @ beta @ beta @ row, 120),
        ],
    }  # fmt: skip
    return [float(weights @ tree - 1.0 / size) for p in range(1, order + 1) for tree, size in trees[p]]


def test_conditions_of_order_five() -> None:
    alpha, gamma, b = classical()
    assert np.abs(conditions(b, 5)).max() < 1e-12
    np.testing.assert_allclose(alpha.sum(axis=1), METHOD.times, atol=1e-12)
    np.testing.assert_allclose(gamma.sum(axis=1), METHOD.gammas, atol=1e-12)
    np.testing.assert_allclose((alpha + gamma)[-1], b, atol=1e-12)  # stiffly accurate
    embedded = (METHOD.a[-1] - METHOD.error[0]) @ gamma
    assert np.abs(conditions(embedded, 4)).max() < 1e-12
    assert np.abs(conditions(embedded, 5)).max() > 1e-4  # else it would check nothing


def test_dense_output_is_of_order_four() -> None:
    alpha, gamma, b = classical()
    beta, start = alpha + gamma, alpha.sum(axis=1)
    row = beta.sum(axis=1)
    curve = METHOD.curve @ gamma
    np.testing.assert_allclose(curve.sum(axis=0), 0.0, atol=1e-12)
    curve[0] += b  # the rise from end to end
    for s in (0.2, 0.5, 0.9):
        weights = s ** np.arange(1, 5) @ curve
        trees = [np.ones(8), row, start**2, beta @ row, start**3, start * (alpha @ row), beta @ start**2]
        found = [weights @ tree for tree in [*trees, beta @ beta @ row]]
        wanted = [s, s**2 / 2, s**3 / 3, s**3 / 6, s**4 / 4, s**4 / 8, s**4 / 12, s**4 / 24]
        np.testing.assert_allclose(found, wanted, atol=1e-11)


def test_l_stable() -> None:
    alpha, gamma, b = classical()

    def grows(z: complex) -> float:
        return abs(1.0 + z * b @ np.linalg.solve(np.eye(8) - z * (alpha + gamma), np.ones(8)))

    assert max(grows(1j * w) for w in np.logspace(-2, 6, 200)) <= 1.0 + 1e-12
    assert grows(-1e9) < 1e-6


def test_order_on_a_smooth_problem() -> None:
    times, steps = np.array([0.0, 1.5]), [0.1, 0.05, 0.025]
    errors = []
    for h in steps:
        solver = Rodas5P(1.0, 1.0, largest_step=h, first_step=h)
        found = integrate_compiled(counted(True), solver, START, times).states[-1]
        errors.append(np.abs(found - exact(times)[-1]).max())
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 4.6


@pytest.mark.parametrize("name", STIFF)
def test_stiff_references(name: str) -> None:
    problem, start, end, wanted = STIFF[name]
    atol = {"Robertson": (1e-14, 1e-18, 1e-14)}.get(name, 1e-12)
    found = integrate_compiled(problem, Rodas5P(1e-8, atol), start, [0.0, end])
    fourth = integrate_compiled(problem, Rodas4(1e-8, atol), start, [0.0, end])
    assert found.stopped == ""
    np.testing.assert_allclose(found.final, wanted, rtol=2e-6)
    assert found.work.steps < 0.7 * fourth.work.steps


@pytest.mark.parametrize("jacobian", [False, True])
def test_counts_are_calls(jacobian: bool) -> None:
    times = np.linspace(0.0, 2.0, 77)
    found = integrate_compiled(counted(jacobian), Rodas5P(1e-6), START, times, breakpoints=[0.3])
    work, tried = found.work, found.work.steps + found.work.rejected
    assert found.checkpoint.words[0] == work.rates
    assert work.factorisations == tried and work.jacobians == work.steps
    differences = 0 if jacobian else 3  # two columns and time
    assert work.rates == 7 * tried + work.steps + differences * work.jacobians + 1  # and one to choose the first
    assert np.abs(found.states - exact(times)).max() < 1e-5


def test_tighter_is_better() -> None:
    times = np.array([0.0, 3.0])
    errors = [
        np.abs(
            integrate_compiled(counted(True), Rodas5P(rtol, rtol * 1e-3), START, times).final - exact(times)[-1]
        ).max()
        for rtol in 10.0 ** -np.arange(3.0, 10.0)
    ]
    assert all(later < before for before, later in pairwise(errors))
    assert errors[-1] < 2e-9


def test_settings_are_told_by_its_own_name() -> None:
    with pytest.raises(InputError, match=r"Rodas5P\.rtol"):
        Rodas5P(rtol=-1.0)
