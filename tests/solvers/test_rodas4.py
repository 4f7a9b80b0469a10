"""RODAS: its tables, its order, stiff references, dense output, counts, resumption, and what it refuses."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from compiled_cases import STIFF, counted, pushed, python_rates
from scipy.integrate import solve_ivp

from drivetrain.errors import InputError
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince54, DormandPrince853, Euler, Rodas4, RungeKutta4, SemiImplicitEuler
from drivetrain.solvers.tableaux import RODAS4 as METHOD

START = [1.0, 0.2]


def exact(times: np.ndarray) -> np.ndarray:
    return integrate(DormandPrince853(1e-13, 1e-13), python_rates(counted()), START, times).states


def classical() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Alpha_ij, Gamma_ij and b_i of the method, from the tables without matrix products."""
    gamma = np.linalg.inv(np.eye(6) / METHOD.gamma - METHOD.c)
    return METHOD.a[:-1] @ gamma, gamma, METHOD.a[-1] @ gamma


def test_conditions_of_order_four() -> None:
    """The conditions of order for Rosenbrock methods, beta = alpha + gamma; Hairer, Wanner II, table IV.7.1."""
    alpha, gamma, b = classical()
    beta = alpha + gamma
    row, start = beta.sum(axis=1), alpha.sum(axis=1)
    found = [b.sum(), b @ row, b @ start**2, b @ beta @ row, b @ start**3, b @ (start * (alpha @ row))]
    found += [b @ beta @ start**2, b @ beta @ beta @ row]
    np.testing.assert_allclose(found, [1, 1 / 2, 1 / 3, 1 / 6, 1 / 4, 1 / 8, 1 / 12, 1 / 24], atol=1e-13)
    np.testing.assert_allclose(start, METHOD.times, atol=1e-13)
    np.testing.assert_allclose(gamma.sum(axis=1), METHOD.gammas, atol=1e-13)
    np.testing.assert_allclose(beta[-1], b, atol=1e-13)  # stiffly accurate
    embedded = (METHOD.a[-1] - METHOD.error[0]) @ gamma
    third = [embedded.sum(), embedded @ row, embedded @ start**2, embedded @ beta @ row]
    np.testing.assert_allclose(third, [1, 1 / 2, 1 / 3, 1 / 6], atol=1e-13)


def test_dense_output_is_of_order_three() -> None:
    alpha, gamma, b = classical()
    beta, start = alpha + gamma, alpha.sum(axis=1)
    curve = METHOD.curve @ gamma
    np.testing.assert_allclose(curve.sum(axis=0), 0.0, atol=1e-12)
    curve[0] += b  # the rise from end to end
    for s in (0.2, 0.5, 0.9):
        weights = s ** np.arange(1, 5) @ curve
        found = [weights.sum(), weights @ beta.sum(axis=1), weights @ start**2, weights @ beta @ beta.sum(axis=1)]
        np.testing.assert_allclose(found, [s, s**2 / 2, s**3 / 3, s**3 / 6], atol=1e-12)


def test_l_stable() -> None:
    """The stability function 1 + z b (1 - z beta)^-1 1 stays below 1 on the imaginary axis and vanishes at infinity."""
    alpha, gamma, b = classical()

    def grows(z: complex) -> float:
        return abs(1.0 + z * b @ np.linalg.solve(np.eye(6) - z * (alpha + gamma), np.ones(6)))

    assert max(grows(1j * w) for w in np.logspace(-2, 6, 200)) <= 1.0 + 1e-12
    assert grows(-1e9) < 1e-6


def test_order_on_a_smooth_problem() -> None:
    """Forced to a step of fixed length, the error falls with its fourth power; a wrong df/dt or Jacobian would show."""
    times, steps = np.array([0.0, 1.5]), [0.05, 0.025, 0.0125]
    errors = []
    for h in steps:
        solver = Rodas4(1.0, 1.0, largest_step=h, first_step=h)
        found = integrate_compiled(counted(), solver, START, times).states[-1]
        errors.append(np.abs(found - exact(times)[-1]).max())
        slow = integrate(solver, python_rates(counted()), START, times)  # a right-hand side in Python: the same loop
        assert (slow.states[-1] == found).all()
    assert abs(np.polyfit(np.log(steps), np.log(errors), 1)[0] - 4.0) < 0.3


@pytest.mark.parametrize("name", STIFF)
def test_stiff_references(name: str) -> None:
    problem, start, end, wanted = STIFF[name]
    atol = {"Robertson": (1e-14, 1e-18, 1e-14)}.get(name, 1e-12)
    found = integrate_compiled(problem, Rodas4(1e-8, atol), start, [0.0, end])
    assert found.stopped == ""
    np.testing.assert_allclose(found.final, wanted, rtol=2e-6)
    assert found.work.steps < 12_000


def test_tighter_is_better() -> None:
    times = np.array([0.0, 3.0])
    errors = [
        np.abs(integrate_compiled(counted(), Rodas4(rtol, rtol * 1e-3), START, times).final - exact(times)[-1]).max()
        for rtol in 10.0 ** -np.arange(3.0, 11.0)
    ]
    assert all(later < before for before, later in pairwise(errors))
    assert errors[3] < 20.0 * 1e-6 and errors[-1] < 2e-9


@pytest.mark.parametrize("solver", [Rodas4(1e-7, 1e-10), DormandPrince54(1e-7, 1e-10), RungeKutta4(0.01)], ids=repr)
def test_states_within_a_step(solver: Rodas4) -> None:
    times = np.linspace(0.0, 2.0, 333)
    found = integrate_compiled(counted(), solver, START, times)
    assert np.abs(found.states - exact(times)).max() < 1e-6
    assert len(found.times) == 333 and (found.states[0] == START).all()
    # Instants that are wanted in between change no step.
    assert (integrate_compiled(counted(), solver, START, [0.0, 2.0]).final == found.final).all()


@pytest.mark.parametrize("solver", [RungeKutta4(0.01), Euler(0.01)], ids=repr)
def test_compiled_explicit_methods_are_those_in_python(solver: RungeKutta4) -> None:
    times = np.linspace(0.0, 1.0, 7)
    ours = integrate_compiled(counted(), solver, START, times, breakpoints=[0.333])
    slow = integrate(solver, python_rates(counted()), START, times, breakpoints=[0.333])
    np.testing.assert_allclose(ours.states, slow.states, rtol=1e-13)


def test_compiled_dormand_prince_is_that_of_scipy() -> None:
    """At the same tolerances; another control of the step leaves errors of the tolerance's size."""
    times = np.linspace(0.0, 1.0, 7)
    ours = integrate_compiled(counted(), DormandPrince54(1e-9, 1e-11), START, times)
    scipys = solve_ivp(python_rates(counted()), (0.0, 1.0), START, "RK45", times, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(ours.states, scipys.y.T, rtol=1e-8)


@pytest.mark.parametrize("jacobian", [False, True])
@pytest.mark.parametrize(
    "solver", [Rodas4(1e-6), DormandPrince54(1e-6, 1e-9), RungeKutta4(0.01), Euler(0.01)], ids=repr
)
def test_counts_are_calls(solver: Rodas4, jacobian: bool) -> None:
    found = integrate_compiled(counted(jacobian), solver, START, np.linspace(0.0, 2.0, 77), breakpoints=[0.3, 1.1])
    work = found.work
    assert found.checkpoint.words[0] == work.rates
    if isinstance(solver, Rodas4):
        tried = work.steps + work.rejected
        assert work.factorisations == tried and work.jacobians == work.steps
        differences = 0 if jacobian else 3  # two columns and time
        assert work.rates == 5 * tried + work.steps + differences * work.jacobians + 1  # and one to choose the first


def test_exact_jacobian_gives_the_same_answer_for_less() -> None:
    ours, exactly = (integrate_compiled(counted(j), Rodas4(1e-6), START, [0.0, 2.0]) for j in (False, True))
    np.testing.assert_allclose(ours.final, exactly.final, atol=1e-7)
    assert exactly.work.rates < 0.75 * ours.work.rates


def test_resumed_run_is_the_same_to_the_last_bit() -> None:
    problem, start, end, _ = STIFF["Oregonator"]
    times = np.linspace(0.0, end, 50)
    whole = integrate_compiled(problem, Rodas4(1e-6), start, times, breakpoints=[100.0])
    part = integrate_compiled(problem, Rodas4(1e-6), start, times, breakpoints=[100.0], pause_after=7)
    for _ in range(1000):
        if not part.stopped.startswith("paused"):
            break
        kept = part.checkpoint
        part = integrate_compiled(problem, Rodas4(1e-6), start, times, breakpoints=[100.0], pause_after=41, resume=kept)
    assert part.stopped == "" and part.work == whole.work
    assert (part.states == whole.states).all()


def test_pulse_after_a_long_rest() -> None:
    """5 ms of 100 N on 1 kg after 7.3 s of rest; scipy's own methods step over it and report success."""
    problem = pushed([7.3, 7.305], [0.0, 100.0, 0.0])
    for method in ("RK45", "DOP853", "LSODA", "BDF", "Radau"):
        missed = solve_ivp(python_rates(problem), (0.0, 10.0), [0.0, 0.0], method=method, rtol=1e-6, atol=1e-9)
        assert missed.success and missed.y[1, -1] == 0.0
    found = integrate_compiled(problem, Rodas4(1e-6), [0.0, 0.0], [0.0, 10.0], breakpoints=[7.3, 7.305])
    assert abs(found.final[1] - 0.5) < 1e-9
    assert abs(found.final[0] - (0.5 * 100.0 * 0.005**2 + 0.5 * (10.0 - 7.305))) < 1e-9


@pytest.mark.parametrize("solver", [Rodas4(1e-6), DormandPrince54(1e-6, 1e-9)], ids=repr)
def test_bang_bang_with_segments_of_five_milliseconds(solver: Rodas4) -> None:
    ends, levels = [0.5, 0.505, 0.51], [2.0, -300.0, 250.0, 1.0]
    found = integrate_compiled(pushed(ends, levels), solver, [0.0, 0.0], [0.0, 1.0], breakpoints=ends)
    speed = place = 0.0
    for start, end, level in zip([0.0, *ends], [*ends, 1.0], levels, strict=True):
        place += speed * (end - start) + 0.5 * level * (end - start) ** 2
        speed += level * (end - start)
    np.testing.assert_allclose(found.final, [place, speed], atol=1e-9)


@pytest.mark.parametrize("rate", [0.05, 5.0])
def test_what_is_too_small_to_matter_grows_as_it_does(rate: float) -> None:
    """Far below its tolerance a state is not damped away, however slowly it grows."""
    found = integrate(Rodas4(1e-6, 1e-6), lambda t, x: rate * x, [1e-12], [0.0, 30.0 / rate])
    assert found.states[-1, 0] == pytest.approx(1e-12 * math.exp(30.0), rel=0.02)  # steps of 1/rate: 3.5e-4 each


def test_python_right_hand_sides_too() -> None:
    """The same method through the common interface, with jumps, corrections and instants within steps."""

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], 100.0 if 7.3 <= t < 7.305 else 0.0])

    found = integrate(Rodas4(1e-6), rates, [0.0, 0.0], np.linspace(0.0, 10.0, 11), breakpoints=[7.3, 7.305])
    assert abs(found.states[-1, 1] - 0.5) < 1e-9 and found.stopped == ""
    with pytest.raises(InputError, match="runs compiled"):
        integrate_compiled(counted(), SemiImplicitEuler(0.1), START, [0.0, 1.0])
    with pytest.raises(InputError, match="corrected after each step"):
        integrate(Rodas4(), rates, [0.0, 0.0], [0.0, 1.0], correct=lambda t, y: None)

    def fails(t: float, y: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        integrate(Rodas4(), fails, [0.0, 0.0], [0.0, 1.0])


@pytest.mark.parametrize(
    "bad",
    [
        {"rtol": 0.0},
        {"rtol": math.nan},
        {"rtol": 1e-17},
        {"atol": -1.0},
        {"atol": (1.0, 0.0)},
        {"largest_step": math.inf},
        {"first_step": -1.0},
        {"smallest_step": -1.0},
    ],
)
def test_settings_that_are_none(bad: dict) -> None:
    with pytest.raises(InputError, match="Rodas4"):
        Rodas4(**bad)


@pytest.mark.parametrize(
    ("start", "times", "points", "place"),
    [
        ([math.nan, 0.0], [0.0, 1.0], [], "start"),
        ([math.inf, 0.0], [0.0, 1.0], [], "start"),
        ([1.0], [0.0, 1.0], [], "start"),
        ([1.0, 0.0], [0.0, math.nan], [], "times"),
        ([1.0, 0.0], [0.0, 0.0], [], "times"),
        ([1.0, 0.0], [0.0, 1.0], [math.inf], "breakpoints"),
    ],
)
def test_input_that_is_none(start: list, times: list, points: list, place: str) -> None:
    with pytest.raises(InputError, match=place):
        integrate_compiled(counted(), Rodas4(), start, times, breakpoints=points)
    with pytest.raises(InputError, match="numbers"):
        CompiledProblem(counted().rates, 2, np.array([math.nan]))
    with pytest.raises(InputError, match="atol"):
        integrate_compiled(counted(), Rodas4(atol=(1e-6, 1e-6, 1e-6)), [1.0, 0.0], [0.0, 1.0])
