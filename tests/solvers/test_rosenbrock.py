"""RODAS and RODAS5P: their tables against the conditions of order, their order, stiff references, counts."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from compiled_cases import STIFF, counted, python_rates

from drivetrain.errors import InputError
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince853, Rodas4, Rodas5P
from drivetrain.solvers.tableaux import RODAS4, RODAS5P

START = [1.0, 0.2]
METHODS = pytest.mark.parametrize(("solver", "method", "order"), [(Rodas4, RODAS4, 4), (Rodas5P, RODAS5P, 5)])


def exact(times: np.ndarray) -> np.ndarray:
    return integrate(DormandPrince853(1e-13, 1e-13), python_rates(counted()), START, times).states


def classical(method: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Alpha_ij, Gamma_ij and b_i of the method, from the tables without matrix products."""
    gamma = np.linalg.inv(np.eye(len(method.c)) / method.gamma - method.c)
    return method.a[:-1] @ gamma, gamma, method.a[-1] @ gamma


def conditions(method: Any, order: int) -> list[tuple[np.ndarray, int, int]]:
    """Of each condition its tree, what that weighs, and its order; Hairer, Wanner II, theorem IV.7.3.

    Trees whose vertices have one branch take beta = alpha + gamma there, all others alpha.
    """
    alpha, gamma, _ = classical(method)
    beta, start = alpha + gamma, alpha.sum(axis=1)
    row = beta.sum(axis=1)
    trees = {
        1: [(np.ones(len(row)), 1)],
        2: [(row, 2)],
        3: [(start**2, 3), (beta @ row, 6)],
        4: [(start**3, 4), (start * (alpha @ row), 8), (beta @ start**2, 12), (beta @ beta @ row, 24)],
        5: [
            (start**4, 5), (start**2 * (alpha @ row), 10), ((alpha @ row) ** 2, 20), (start * (alpha @ start**2), 15),
            (start * (alpha @ beta @ row), 30), (beta @ start**3, 20), (beta @ (start * (alpha @ row)), 40),
            (beta @ beta @ start**2, 60), (beta @ beta @ beta @ row, 120),
        ],
    }  # fmt: skip
    return [(tree, size, p) for p in range(1, order + 1) for tree, size in trees[p]]


@METHODS
def test_conditions_of_order(solver: Any, method: Any, order: int) -> None:
    alpha, gamma, b = classical(method)

    def missed(weights: np.ndarray, order: int) -> float:
        return max(abs(float(weights @ tree) - 1.0 / size) for tree, size, _ in conditions(method, order))

    assert missed(b, order) < 1e-12
    np.testing.assert_allclose(alpha.sum(axis=1), method.times, atol=1e-12)
    np.testing.assert_allclose(gamma.sum(axis=1), method.gammas, atol=1e-12)
    np.testing.assert_allclose((alpha + gamma)[-1], b, atol=1e-12)  # stiffly accurate
    embedded = (method.a[-1] - method.error[0]) @ gamma
    assert missed(embedded, order - 1) < 1e-12
    assert missed(embedded, order) > 1e-4  # else it would check nothing


@METHODS
def test_dense_output_is_of_one_order_less(solver: Any, method: Any, order: int) -> None:
    _, gamma, b = classical(method)
    curve = method.curve @ gamma
    np.testing.assert_allclose(curve.sum(axis=0), 0.0, atol=1e-12)
    curve[0] += b  # the rise from end to end
    for s in (0.2, 0.5, 0.9):
        weights = s ** np.arange(1, 5) @ curve
        for tree, size, p in conditions(method, order - 1):
            assert weights @ tree == pytest.approx(s**p / size, abs=1e-11)


@METHODS
def test_l_stable(solver: Any, method: Any, order: int) -> None:
    """The stability function 1 + z b (1 - z beta)^-1 1 stays below 1 on the imaginary axis and vanishes at infinity."""
    alpha, gamma, b = classical(method)
    one = np.ones(len(b))

    def grows(z: complex) -> float:
        return abs(1.0 + z * b @ np.linalg.solve(np.diag(one) - z * (alpha + gamma), one))

    assert max(grows(1j * w) for w in np.logspace(-2, 6, 200)) <= 1.0 + 1e-12
    assert grows(-1e9) < 1e-6


@pytest.mark.parametrize(
    ("solver", "jacobian", "longest", "least"), [(Rodas4, False, 0.05, 3.7), (Rodas5P, True, 0.1, 4.6)]
)
def test_order_on_a_smooth_problem(solver: Any, jacobian: bool, longest: float, least: float) -> None:
    """At steps of fixed length, by which power of them the error falls; a wrong df/dt or Jacobian would show."""
    times, steps = np.array([0.0, 1.5]), longest / np.array([1.0, 2.0, 4.0])
    errors = []
    for h in steps:
        forced = solver(1.0, 1.0, largest_step=h, first_step=h)
        found = integrate_compiled(counted(jacobian), forced, START, times).states[-1]
        errors.append(np.abs(found - exact(times)[-1]).max())
        if not jacobian:  # a right-hand side in Python: the same loop
            assert (integrate(forced, python_rates(counted()), START, times).states[-1] == found).all()
    assert least < np.polyfit(np.log(steps), np.log(errors), 1)[0] < least + 0.8


@pytest.mark.parametrize("name", STIFF)
def test_stiff_references(name: str) -> None:
    problem, start, end, wanted = STIFF[name]
    atol = {"Robertson": (1e-14, 1e-18, 1e-14)}.get(name, 1e-12)
    fourth, fifth = (integrate_compiled(problem, kind(1e-8, atol), start, [0.0, end]) for kind in (Rodas4, Rodas5P))
    for found in (fourth, fifth):
        assert found.stopped == ""
        np.testing.assert_allclose(found.final, wanted, rtol=2e-6)
    assert fourth.work.steps < 12_000 and fifth.work.steps < 0.7 * fourth.work.steps


@pytest.mark.parametrize("jacobian", [False, True])
@METHODS
def test_counts_are_calls(solver: Any, method: Any, order: int, jacobian: bool) -> None:
    times = np.linspace(0.0, 2.0, 77)
    found = integrate_compiled(counted(jacobian), solver(1e-6), START, times, breakpoints=[0.3, 1.1])
    work, tried = found.work, found.work.steps + found.work.rejected
    assert found.checkpoint.words[0] == work.rates
    assert work.factorisations == tried and work.jacobians == work.steps
    differences = 0 if jacobian else 3  # two columns and time
    stages = len(method.c) - 1  # beside the one that a step begins with
    assert work.rates == stages * tried + work.steps + differences * work.jacobians + 1  # and one to choose the first
    assert np.abs(found.states - exact(times)).max() < 1e-5


@METHODS
def test_tighter_is_better(solver: Any, method: Any, order: int) -> None:
    times = np.array([0.0, 3.0])
    errors = [
        np.abs(integrate_compiled(counted(), solver(rtol, rtol * 1e-3), START, times).final - exact(times)[-1]).max()
        for rtol in 10.0 ** -np.arange(3.0, 15.0 - order)
    ]
    assert all(later < before for before, later in pairwise(errors))
    assert errors[3] < 20.0 * 1e-6 and errors[-1] < 2e-9


def test_settings_are_told_by_its_own_name() -> None:
    with pytest.raises(InputError, match=r"Rodas5P\.rtol"):
        Rodas5P(rtol=-1.0)
