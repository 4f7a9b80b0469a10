"""Every member of the family: order, exact counts, instants, breakpoints, corrections, failures."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.solver import DormandPrince54, DormandPrince853, Euler, RungeKutta4, SemiImplicitEuler, Solver

FIXED = [(Euler, 1), (SemiImplicitEuler, 1), (RungeKutta4, 4)]
ADAPTIVE = [DormandPrince54, DormandPrince853]
EVERY = [kind(1e-3) for kind, _ in FIXED] + [kind(1e-6, 1e-9) for kind in ADAPTIVE]

RESTARTED = [*EVERY[:2], RungeKutta4(0.05), DormandPrince853(1e-6)]


def swing(t: float, y: np.ndarray) -> np.ndarray:
    """A pendulum under a push that depends on time: nothing about it is linear."""
    return np.array([y[1], -9.0 * math.sin(y[0]) + math.cos(3.0 * t)])


START = np.array([1.0, 0.2])


def exact(times: np.ndarray) -> np.ndarray:
    return integrate(DormandPrince853(1e-13, 1e-13), swing, START, times).states


@pytest.mark.parametrize(("kind", "order"), FIXED)
def test_order(kind: type, order: int) -> None:
    times = np.array([0.0, 1.5])
    steps = np.array([0.02, 0.01, 0.005, 0.0025])
    errors = [np.abs(integrate(kind(h), swing, START, times).states[-1] - exact(times)[-1]).max() for h in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert abs(slope - order) < 0.25


@pytest.mark.parametrize(("kind", "stages"), [(Euler, 1), (SemiImplicitEuler, 1), (RungeKutta4, 4)])
def test_counts_of_fixed_steps_are_exact(kind: type, stages: int) -> None:
    calls = []

    def counted(t: float, y: np.ndarray) -> np.ndarray:
        calls.append(t)
        return swing(t, y)

    work = integrate(kind(0.01), counted, START, [0.0, 1.0]).work
    assert (work.steps, work.rates) == (100, 100 * stages)
    assert len(calls) == work.rates
    # Instants that are ends of steps cost nothing.
    assert integrate(kind(0.01), swing, START, np.linspace(0, 1, 51)).work.rates == 100 * stages


@pytest.mark.parametrize("solver", EVERY, ids=repr)
def test_counts_are_calls(solver: Solver) -> None:
    calls = []

    def counted(t: float, y: np.ndarray) -> np.ndarray:
        calls.append(t)
        return swing(t, y)

    work = integrate(solver, counted, START, np.linspace(0.0, 2.0, 77), breakpoints=[0.3, 1.1]).work
    assert work.rates == len(calls)
    assert max(calls) <= 2.0


@pytest.mark.parametrize("solver", EVERY, ids=repr)
def test_states_within_a_step(solver: Solver) -> None:
    """As accurate between the ends of steps as at them: within ten times the error at the ends."""
    times = np.linspace(0.0, 2.0, 333)
    found, wanted = integrate(solver, swing, START, times).states, exact(times)
    ends = integrate(solver, swing, START, [0.0, 2.0]).states[-1]
    assert np.abs(found - wanted).max() < 10.0 * np.abs(ends - wanted[-1]).max() + 2e-6  # of the tolerance's size
    np.testing.assert_array_equal(found[0], START)


def test_inner_curve_of_runge_kutta_is_a_cubic() -> None:
    errors = []
    for h in (0.1, 0.05, 0.025):
        times = np.linspace(0.0, 1.0, 401)
        errors.append(np.abs(integrate(RungeKutta4(h), swing, START, times).states - exact(times)).max())
    assert np.polyfit(np.log([0.1, 0.05, 0.025]), np.log(errors), 1)[0] > 3.6


@pytest.mark.parametrize("solver", [kind(1e-6, 1e-9) for kind in ADAPTIVE] + [RungeKutta4(0.01)], ids=repr)
def test_pulse_after_a_long_rest(solver: Solver) -> None:
    """5 ms of 100 rad/s^2 after 7.3 s of rest: without breakpoints every adaptive method steps over it."""

    def pushed(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], 100.0 if 7.3 <= t < 7.305 else 0.0])

    found = integrate(solver, pushed, [0.0, 0.0], [0.0, 10.0], breakpoints=[7.3, 7.305]).states[-1]
    assert abs(found[1] - 0.5) < 1e-9
    if not isinstance(solver, RungeKutta4):
        assert abs(integrate(solver, pushed, [0.0, 0.0], [0.0, 10.0]).states[-1][1] - 0.5) > 0.4


@pytest.mark.parametrize("solver", EVERY, ids=repr)
def test_no_stage_looks_across_a_breakpoint(solver: Solver) -> None:
    """Bang-bang with segments of 5 ms, jumping at 0.5, 0.505 and 0.51 s."""
    jumps = [0.5, 0.505, 0.51]
    levels = [2.0, -300.0, 250.0, 1.0]

    def pushed(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([0.0, levels[int(np.searchsorted(jumps, t, side="right"))]])

    found = integrate(solver, pushed, [0.0, 0.0], [0.0, 1.0], breakpoints=jumps).states[-1]
    assert abs(found[1] - (1.0 - 1.5 + 1.25 + 0.49)) < 1e-9


def test_last_step_is_shorter_and_ends_on_time() -> None:
    seen = []

    def one(t: float, y: np.ndarray) -> np.ndarray:
        seen.append(t)
        return np.ones(1)

    solution = integrate(Euler(0.3), one, [0.0], [0.0, 1.0])
    np.testing.assert_allclose(seen, [0.0, 0.3, 0.6, 0.9], rtol=1e-15)
    assert solution.states[-1, 0] == pytest.approx(1.0, abs=1e-15)
    assert solution.work.steps == 4
    assert integrate(Euler(0.1), one, [0.0], [0.0, 1.0]).work.steps == 10  # 0.1 ten times is more than 1, by rounding
    assert integrate(Euler(1e-4), one, [0.0], [5.0, 35.0]).work.steps == 300_000


def test_semi_implicit_steps_keep_energy_where_euler_gains() -> None:
    def spring(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -y[0], 1.0])  # and a clock, which is stepped as by Euler

    explicit, sister = (
        integrate(kind(0.01), spring, [1.0, 0.0, 0.0], [0.0, 100.0]).states[-1] for kind, _ in FIXED[:2]
    )
    assert explicit[0] ** 2 + explicit[1] ** 2 > 2.0
    assert abs(sister[0] ** 2 + sister[1] ** 2 - 1.0) < 0.02
    assert sister[2] == pytest.approx(100.0)


@pytest.mark.parametrize("solver", RESTARTED, ids=repr)
def test_corrections_after_steps(solver: Solver) -> None:
    """A spring and a mass whose energy is put right whenever it is off by more than rounding."""

    def turn(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -y[0]])

    def put_back(t: float, y: np.ndarray) -> np.ndarray | None:
        size = math.hypot(*y)
        return None if abs(size - 1.0) < 1e-15 else y / size

    solution = integrate(solver, turn, [1.0, 0.0], np.linspace(0.0, 1.0, 11), correct=put_back)
    free = integrate(solver, turn, [1.0, 0.0], [0.0, 1.0])
    assert abs(np.hypot(*solution.states[-1]) - 1.0) < 1e-14
    assert solution.work.restarts > 0
    assert free.work.restarts == 0
    assert np.abs(solution.states[-1] - [math.cos(1.0), -math.sin(1.0)]).max() < 1e-3


def test_divergence_is_told_with_its_instant() -> None:
    def explode(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([0.0, np.inf if t > 0.5 else 1.0])

    solution = integrate(Euler(0.01), explode, [0.0, 0.0], np.linspace(0.0, 1.0, 11))
    assert "diverges" in solution.stopped
    assert 0.5 < solution.stopped_at < 0.53
    assert solution.fault_index == 1
    assert len(solution.times) == len(solution.states) == 6
    assert np.isfinite(solution.states).all()


def test_solver_at_its_limit_is_told_with_a_mend() -> None:
    def towards_pole(t: float, y: np.ndarray) -> np.ndarray:
        return y**2  # 1 / (1 - t)

    for solver in (DormandPrince853(), DormandPrince54()):
        solution = integrate(solver, towards_pole, [1.0], [0.0, 0.9, 2.0])
        assert "loosen" in solution.stopped or "diverges" in solution.stopped
        assert abs(solution.stopped_at - 1.0) < 1e-3
        assert len(solution.states) == 2


def test_most_steps() -> None:
    solution = integrate(Euler(1e-3), swing, START, [0.0, 1.0], most_steps=100)
    assert "100 steps" in solution.stopped
    assert solution.stopped_at == pytest.approx(0.1)


def test_wrong_input() -> None:
    with pytest.raises(InputError, match="rise"):
        integrate(Euler(0.1), swing, START, [0.0, 0.0, 1.0])
    with pytest.raises(InputError, match=r"times(.|\n)*start"):
        integrate(Euler(0.1), swing, [np.nan, 0.0], [0.0])
    with pytest.raises(InputError, match="breakpoints"):
        integrate(Euler(0.1), swing, START, [0.0, 1.0], breakpoints=[np.nan])
    for bad in (0.0, -1.0, np.inf, np.nan, True, "fast"):
        for kind, _ in FIXED:
            with pytest.raises(InputError, match="step"):
                kind(bad)
    for kind in ADAPTIVE:
        with pytest.raises(InputError, match="rtol"):
            kind(1e-17)
        with pytest.raises(InputError, match="atol"):
            kind(1e-6, 0.0)
        with pytest.raises(InputError, match="largest_step"):
            kind(1e-6, 1e-9, -1.0)


def test_a_name_is_no_solver() -> None:
    with pytest.raises(InputError, match="RungeKutta4"):
        integrate("rk4", lambda t, y: -y, [1.0], [0.0, 1.0])
