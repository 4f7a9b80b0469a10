"""Runs of a few steps whose every call can be counted by hand: hooks, pauses, first steps, Jacobians, jumps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from drivetrain.solvers.compiled_function import compiled
from drivetrain.solvers.compiled_problem import CompiledProblem, Events, Hooks
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince54, Rodas4, Rodas5P, RungeKutta4


@compiled
def _cubic(t, x, dx, p, w):
    dx[0], dx[1] = 3.0 * t * t, 1.0
    w[0] += 1


@compiled
def _weighed(t, x, weight, p, w):
    p[0] += weight[0]
    p[1] += weight[0] * x[0]
    p[2 + w[1]], w[1] = t, w[1] + 1


@compiled
def _written(t, x, row, p, w):
    row[0], row[1], row[2] = t, x[0] + x[1], p[0]


@compiled
def _begun(t, x, nothing, p, w):
    x[1] += 100.0
    w[2] += 1


@pytest.mark.parametrize("solver", [RungeKutta4(0.4), Rodas4(1e-5, 1e-5)], ids=repr)
def test_hooks_are_called_at_gauss_points_and_written_in_order_of_time(solver: Any) -> None:
    """The integral of t^3 by two Gauss points is exact on every piece; a row ends the piece before it."""
    hooks = Hooks(_weighed, _written, 3, _begun)
    problem = CompiledProblem(_cubic, 2, np.zeros(4000), np.zeros(3, np.int64), hooks=hooks)
    times = [0.0, 0.3, 1.0, 1.7]
    found = integrate_compiled(problem, solver, [0.0, 0.0], times, breakpoints=[1.0])
    numbers, words = found.checkpoint.numbers, found.checkpoint.words
    assert numbers[:2] == pytest.approx([1.7, 1.7**4 / 4.0], rel=1e-9)
    assert words[2] == 3  # the beginning, the breakpoint, the end
    assert (np.diff(numbers[2 : 2 + words[1]]) > 0.0).all()
    jumped = [100.0, 100.0, 200.0, 300.0]
    np.testing.assert_allclose(found.states[:, 0], times, rtol=1e-12)
    np.testing.assert_allclose(found.states[:, 1], [t**3 + t + more for t, more in zip(times, jumped, strict=True)])
    np.testing.assert_allclose(found.states[:, 2], times, rtol=1e-9, atol=1e-15)
    if isinstance(
        solver, RungeKutta4
    ):  # 0.4, 0.8, 1.0; 1.4, 1.7: four calls a step and one a beginning; two looks at a piece
        assert found.work.steps == 5 and words[0] == 22 and words[1] == 2 * 6
        where = numbers[2:4] - 0.15
        np.testing.assert_allclose(where, [-0.15 / math.sqrt(3.0), 0.15 / math.sqrt(3.0)], rtol=1e-12)


@pytest.mark.parametrize("solver", [RungeKutta4(0.25), DormandPrince54(1e-6, 1e-6), Rodas5P(1e-6, 1e-6)], ids=repr)
def test_a_paused_run_has_taken_as_many_steps_as_it_may(solver: Any) -> None:
    problem = CompiledProblem(_cubic, 2, words=np.zeros(1, np.int64))
    whole, times = integrate_compiled(problem, solver, [0.0, 0.0], [0.0, 2.0]), [0.0, 2.0]
    tried, kept = whole.work.steps + whole.work.rejected, None
    assert tried > 4
    for done in range(3, tried, 3):
        part = integrate_compiled(problem, solver, [0.0, 0.0], times, pause_after=3, resume=kept)
        kept = part.checkpoint
        assert part.stopped.startswith("paused") and part.work.steps + part.work.rejected == done
    rest = integrate_compiled(problem, solver, [0.0, 0.0], times, resume=kept)
    assert rest.work == whole.work and (rest.final == whole.final).all() and rest.stopped == ""
    cut = integrate_compiled(problem, solver, [0.0, 0.0], times, most_steps=whole.work.steps - 1)
    assert cut.work.steps == whole.work.steps - 1 and "steps taken" in cut.stopped
    assert integrate_compiled(problem, solver, [0.0, 0.0], times, most_steps=whole.work.steps).stopped == ""


def first_of(rates: Any, start: Any, rtol: float, atol: float, end: float = 10.0, **options: Any) -> float:
    """Length of the first step tried by DormandPrince54, whose second stage is at a fifth of it."""
    asked = []

    def seen(t: float, y: np.ndarray) -> np.ndarray:
        asked.append(t)
        return np.asarray(rates(t, y))

    integrate(DormandPrince54(rtol, atol, **options), seen, start, [0.0, end])
    return 5.0 * asked[2]


def test_the_first_step() -> None:
    """Hairer, Norsett, Wanner I, II.4: 1 % of |y| / |y'|; then (0.01 / max(|y'|, |y''|))^(1/4), to a hundredfold."""
    # At rest in the origin: 1e-6 s, and a hundred times that.
    assert first_of(lambda t, y: [1.0], [0.0], 1e-6, 1e-6) == pytest.approx(1e-4, rel=1e-9)
    # A constant rate of 2, over the tolerance 1e-3 * (1 + 8).
    wanted = (0.01 / (2.0 / 9e-3)) ** 0.25
    assert first_of(lambda t, y: [2.0], [8.0], 1e-3, 1e-3) == pytest.approx(wanted, rel=1e-9)
    # A rate that bends: y' = t, so y'' = 1, over the tolerance 1e-3 * (1 + 5).
    wanted = (0.01 / (1.0 / 6e-3)) ** 0.25
    assert first_of(lambda t, y: [t], [5.0], 1e-3, 1e-3) == pytest.approx(min(wanted, 1e-4), rel=1e-6)
    # Nothing moves: 1e-3 of the first guess or 1e-6, at least.
    assert first_of(lambda t, y: [0.0], [5.0], 1e-3, 1e-3) == pytest.approx(1e-6, rel=1e-9)
    assert first_of(lambda t, y: [1.0], [0.0], 1e-6, 1e-6, end=1e-7) == pytest.approx(1e-7, rel=1e-9)
    assert first_of(lambda t, y: [2.0], [8.0], 1e-3, 1e-3, largest_step=1e-3, end=0.02) == pytest.approx(1e-3, rel=1e-9)


@compiled
def _own_differences(t, x, columns, p, w):
    for k in range(6):
        columns[k] = 0.0
    w[0] += 3


def test_a_jacobian_that_counts_its_own_evaluations() -> None:
    """Three of its own and df/dt by the solver: as many as were called."""
    problem = CompiledProblem(_cubic, 2, words=np.zeros(1, np.int64), jacobian=_own_differences, differences=4)
    found = integrate_compiled(problem, Rodas4(1e-6, 1e-6), [0.0, 0.0], [0.0, 2.0])
    assert found.checkpoint.words[0] == found.work.rates
    assert found.final == pytest.approx([8.0, 2.0], abs=1e-5)


@compiled
def _two_jumps(t, x, dx, p, w):
    """Both of the rates jump with the first state, which begins on the jump."""
    above = x[0] > 0.0
    dx[0] = -p[0] if above else 1.0
    dx[1] = p[1] if above else 0.0
    dx[2] = p[2] if above else 0.0


@pytest.mark.parametrize("sizes", [(2.0, 9e3, 5e3), (2.0, 5e3, 9e3), (8e4, 5e3, 9e3)])
def test_a_start_on_a_jump_names_the_rate_that_jumps_most(sizes: tuple[float, ...]) -> None:
    problem = CompiledProblem(_two_jumps, 3, np.array(sizes), names=("a", "b", "c"))
    found = integrate_compiled(problem, Rodas4(1e-6, 1e-6, first_step=0.5), np.zeros(3), [0.0, 1.0])
    jumps = np.array([1.0 + sizes[0], *sizes[1:]])
    worst = "abc"[int(jumps.argmax())]
    assert f"the rate of state {worst!r}" in found.stopped and "state 'a' = 0" in found.stopped, found.stopped
    low, high = ((1.0, -sizes[0]), (0.0, sizes[1]), (0.0, sizes[2]))[int(jumps.argmax())]
    assert f"from {low:.6g} to {high:.6g}" in found.stopped
    assert found.work.rates == 1 + 1 + 1 + 2 and found.work.steps == 0  # itself, df/dt, one column, two closer looks


@compiled
def _clock(t, x, dx, p, w):
    dx[0] = 1.0


@compiled
def _flags(t, x, values, p, w):
    values[0] = p[1] - x[0]
    values[1] = p[2] - x[0]


@compiled
def _taken(t, x, crossed, p, w):
    p[3 + w[0]] = t + 10.0 * (crossed[0] < 0.0) + 20.0 * (crossed[1] < 0.0)
    w[0] += 1
    p[1] += p[0] * (crossed[0] < 0.0)
    p[2] += p[0] * (crossed[1] < 0.0)


@pytest.mark.parametrize(("step", "most"), [(1.0, 1), (1e-12, 11), (0.0, 11)])
def test_events_without_progress(step: float, most: int) -> None:
    """One that fires again and again at one instant counts fivefold; more than fifty end the run."""
    events = Events(_flags, _taken, ("first", "second"))
    problem = CompiledProblem(_clock, 1, np.array([step, 0.3, 99.0, *np.zeros(100)]), [0], events=events)
    found = integrate_compiled(problem, RungeKutta4(0.25), [0.0], [0.0, 1.0])
    at = found.checkpoint.numbers[3 : 3 + found.checkpoint.words[0]]
    np.testing.assert_allclose(at, 10.3, atol=1e-10)
    if most == 1:
        assert found.stopped == "" and len(at) == 1 and found.work.restarts == 1
    else:
        assert "first happens again and again" in found.stopped and len(at) == most + 1


def test_two_events_at_one_instant_are_handled_at_once() -> None:
    events = Events(_flags, _taken, ("first", "second"))
    for second, marks in ((0.3, [30.3]), (0.1, [20.1, 10.3]), (-0.1, [20.0, 10.3])):
        problem = CompiledProblem(_clock, 1, np.array([9.0, 0.3, second, *np.zeros(100)]), [0], events=events)
        found = integrate_compiled(problem, RungeKutta4(0.25), [0.0], [0.0, 1.0])
        at = found.checkpoint.numbers[3 : 3 + found.checkpoint.words[0]]
        if second == 0.3:  # the first is located; the other is past zero by then, or only just not
            assert at[0] == pytest.approx(30.3) or at[:2] == pytest.approx([10.3, 20.3])
        else:
            np.testing.assert_allclose(at, marks, rtol=1e-12)
