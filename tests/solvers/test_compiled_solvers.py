"""Compiled solvers, RODAS above all: dense output, counts, resumption, jumps in time, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from compiled_cases import STIFF, counted, pushed, python_rates
from scipy.integrate import solve_ivp

from drivetrain.errors import InputError
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince54, DormandPrince853, Euler, Rodas4, RungeKutta4, SemiImplicitEuler

START = [1.0, 0.2]


def exact(times: np.ndarray) -> np.ndarray:
    return integrate(DormandPrince853(1e-13, 1e-13), python_rates(counted()), START, times).states


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


@pytest.mark.parametrize("solver", [DormandPrince54(1e-6, 1e-9), RungeKutta4(0.01), Euler(0.01)], ids=repr)
def test_counts_are_calls(solver: RungeKutta4) -> None:
    found = integrate_compiled(counted(), solver, START, np.linspace(0.0, 2.0, 77), breakpoints=[0.3, 1.1])
    assert found.checkpoint.words[0] == found.work.rates


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
