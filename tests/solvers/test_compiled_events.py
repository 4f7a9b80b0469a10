"""Events of compiled problems: where they are, what they change, and when time does not pass any more."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.solvers.compiled_function import compiled
from drivetrain.solvers.compiled_problem import CompiledProblem, Events, Hooks
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince54, Rodas4, RungeKutta4

SOLVERS = [Rodas4(1e-8, 1e-10), DormandPrince54(1e-8, 1e-10), RungeKutta4(0.01)]


@compiled
def _falls(t, x, dx, p, w):
    dx[0], dx[1] = x[1], -p[0]


@compiled
def _height(t, x, values, p, w):
    values[0] = x[0]


@compiled
def _bounces(t, x, crossed, p, w):
    x[1] = -p[1] * x[1]
    if w[0] < 20:
        p[2 + w[0]] = t
    w[0] += 1


@compiled
def _swings(t, x, dx, p, w):
    dx[0], dx[1] = x[1], -x[0]


@compiled
def _side(t, x, values, p, w):
    values[0] = x[0] * w[1]


@compiled
def _other_side(t, x, crossed, p, w):
    p[w[0]], p[10 + w[0]] = t, x[0]
    w[0], w[1] = w[0] + 1, -w[1]


# A block on a spring with dry friction: word 0 is how many, then the modes: -1 and 1 sliding that way, 0 sticking.
@compiled
def _dry(t, x, dx, p, w):
    for k in range(w[0]):
        sliding = w[1 + k]
        dx[2 * k] = x[2 * k + 1]
        dx[2 * k + 1] = -p[0] * x[2 * k] - p[1] * sliding if sliding != 0 else 0.0


@compiled
def _dry_values(t, x, values, p, w):
    for k in range(w[0]):
        values[k] = x[2 * k + 1] * w[1 + k] if w[1 + k] != 0 else p[1] - abs(p[0] * x[2 * k])


@compiled
def _dry_handler(t, x, crossed, p, w):
    for k in range(w[0]):
        if crossed[k] == 0.0:
            continue
        p[3 + int(p[2])] = t
        p[2] += 1.0
        force = -p[0] * x[2 * k]
        if w[1 + k] != 0 and abs(force) <= p[1]:
            x[2 * k + 1], w[1 + k] = 0.0, 0
        else:  # the other way, or away from rest: forced, and not asked again at zero speed
            x[2 * k + 1], w[1 + k] = 0.0, 1 if force > 0.0 else -1


@compiled
def _sign(t, x, dx, p, w):
    dx[0] = x[1]
    dx[1] = p[2] - p[0] * x[0] - p[1] * np.sign(x[1])


@compiled
def _steep(t, x, dx, p, w):
    dx[0] = x[1]
    dx[1] = p[2] - p[0] * x[0] - p[1] * np.tanh(x[1] / 1e-5)


@compiled
def _steps_in_time(t, x, dx, p, w):
    dx[0] = 1.0 if t < p[0] else -50.0


@compiled
def _explodes(t, x, dx, p, w):
    dx[0], dx[1] = x[0] ** 2, 1.0


@compiled
def _square_root(t, x, dx, p, w):
    dx[0], dx[1] = -1.0, np.sqrt(x[0])


@compiled
def _two_speeds(t, x, dx, p, w):
    """Current behind a voltage, with L/R = 1e-5 s, and the winding it heats, with a time constant of 1e3 s."""
    dx[0] = (math.cos(t) - x[0]) / 1e-5
    dx[1] = (x[0] ** 2 - x[1]) / 1e3


@compiled
def _stiff_spring(t, x, dx, p, w):
    """A rotor of 1e-6 kg m^2 on a spring of 1e6 N m/rad whose other end is moved."""
    dx[0], dx[1] = x[1], (p[0] * (math.sin(t) - x[0]) - p[1] * x[1]) / p[2]


@pytest.mark.parametrize("solver", SOLVERS, ids=repr)
def test_every_crossing_is_found_once(solver: Rodas4) -> None:
    """cos t changes its side at pi/2, 3 pi/2, ...; nothing is found twice."""
    problem = CompiledProblem(_swings, 2, np.zeros(20), [0, 1], events=Events(_side, _other_side, ("side",)))
    found = integrate_compiled(problem, solver, [1.0, 0.0], [0.0, 20.0])
    assert found.checkpoint.words[0] == 6
    np.testing.assert_allclose(found.checkpoint.numbers[:6], math.pi * (np.arange(6) + 0.5), atol=2e-6)


def test_event_is_where_the_solution_is_not_where_its_polynomial_is() -> None:
    """With long steps the polynomial errs by 1e-5; the instant found is that of the method, and exactly at zero."""
    problem = CompiledProblem(_swings, 2, np.zeros(20), [0, 1], events=Events(_side, _other_side, ("side",)))
    found = integrate_compiled(problem, Rodas4(1e-10, 1e-12), [1.0, 0.0], [0.0, 3.0]).checkpoint.numbers
    assert abs(found[0] - math.pi / 2.0) < 1e-9
    assert abs(found[10]) < 1e-15


@pytest.mark.parametrize("solver", SOLVERS, ids=repr)
def test_bouncing_ball_comes_to_rest_and_is_told(solver: Rodas4) -> None:
    """Bounces at t_k = t_0 + 2 v_0/g (e + e^2 + ...) pile up where the ball rests; there time does not pass."""
    fall, rest = math.sqrt(2.0 / 9.81), 0.5
    problem = CompiledProblem(_falls, 2, [9.81, rest, *[0.0] * 20], [0], events=Events(_height, _bounces, ("bounce",)))
    found = integrate_compiled(problem, solver, [1.0, 0.0], [0.0, 5.0])
    wanted = fall * (1.0 + 2.0 * np.cumsum(np.concatenate([[0.0], rest ** np.arange(1, 12)])))
    np.testing.assert_allclose(found.checkpoint.numbers[2:14], wanted, atol=1e-11)
    assert "bounce happens again and again" in found.stopped and found.fault_index == 0
    assert abs(found.stopped_at - fall * 3.0) < 1e-6


@pytest.mark.parametrize("joints", [1, 2, 5])
@pytest.mark.parametrize("solver", SOLVERS[:2], ids=repr)
def test_dry_friction_stops_after_five_half_swings(solver: Rodas4, joints: int) -> None:
    """J = 1, k = 100, Fc = 1 from 0.103: at -0.003 after pi/2, and there it stays; equal joints stop at one instant."""
    words = np.array([joints] + [-1] * joints)
    events = Events(_dry_values, _dry_handler, ("stop",) * joints)
    problem = CompiledProblem(_dry, 2 * joints, [100.0, 1.0, *[0.0] * 40], words, events=events)
    found = integrate_compiled(problem, solver, [0.103, 0.0] * joints, [0.0, 1.0, math.pi / 2.0 + 1e-6, 60.0, 3600.0])
    assert found.stopped == ""
    numbers = found.checkpoint.numbers
    assert numbers[2] == 5 * joints
    instants = np.unique(numbers[3 : 3 + 5 * joints].round(6))
    np.testing.assert_allclose(instants, np.arange(1, 6) * math.pi / 10.0, atol=1e-6)
    np.testing.assert_allclose(found.final[0::2], -0.003, atol=1e-8)
    assert (found.states[2:, 1::2] == 0.0).all()
    assert (found.states[2:, 0] == found.states[2, 0]).all()  # no creep in an hour, not by one bit


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize(
    ("start", "push"), [([0.103, 0.0], 0.0), ([0.5, 0.0], 0.0), ([0.0, 0.0], 0.3), ([0.003, 0.0], 0.0)]
)
def test_sign_is_refused_and_named(rtol: float, start: list[float], push: float) -> None:
    """scipy's BDF gives q = -515 with success=True where the answer is -0.003; here it is told what is wrong."""
    problem = CompiledProblem(_sign, 2, [100.0, 1.0, push], names=("place", "speed"))
    found = integrate_compiled(problem, Rodas4(rtol, rtol * 1e-3), start, [0.0, 10.0])
    assert "the right-hand side jumps at" in found.stopped, found.stopped
    assert "state 'speed'" in found.stopped
    assert found.work.rates < (5000 if rtol > 1e-5 else 10)  # who asks for more looks at once: it begins on the jump
    smooth = CompiledProblem(_steep, 2, [100.0, 1.0, push])  # steep is not a jump
    assert integrate_compiled(smooth, Rodas4(rtol, rtol * 1e-3), start, [0.0, 3.0]).stopped == ""


@compiled
def _stairs(t, x, dx, p, w):
    dx[0], dx[1] = 1.0, math.floor(3.0 * x[0])


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_jumps_that_a_state_passes_are_passed(rtol: float) -> None:
    """Nine steps of a staircase, three to the metre: y = 0 + 1 + ... + 8 thirds and half of the ninth."""
    steps = CompiledProblem(_stairs, 2, names=("place", "way"), may_jump=True)
    found = integrate_compiled(steps, Rodas4(rtol, rtol * 1e-2), [0.5 / 3.0, 0.0], [0.0, 3.0])
    assert found.stopped == "" and found.work.rates < 8000
    assert found.final[1] == pytest.approx(36.0 / 3.0 + 9.0 / 6.0, abs=10.0 * rtol)  # a step's tolerance at each jump
    steps = replace(steps, may_jump=False)
    refused = integrate_compiled(steps, Rodas4(rtol, rtol * 1e-2), [0.5 / 3.0, 0.0], [0.0, 3.0])
    assert "jumps at 0.1666" in refused.stopped and "state 'place' = 0.3" in refused.stopped


def test_a_jump_that_a_state_comes_back_to_is_refused_all_the_same() -> None:
    for start, push in ([0.103, 0.0], 0.0), ([0.0, 0.0], 0.3):
        problem = CompiledProblem(_sign, 2, [100.0, 1.0, push], names=("place", "speed"), may_jump=True)
        found = integrate_compiled(problem, Rodas4(1e-4, 1e-7), start, [0.0, 10.0])
        assert "the right-hand side jumps at" in found.stopped and "state 'speed'" in found.stopped
        assert found.work.rates < 10_000


def test_jump_with_time_asks_for_a_breakpoint() -> None:
    problem = CompiledProblem(_steps_in_time, 1, [0.7])
    found = integrate_compiled(problem, Rodas4(1e-8), [0.0], [0.0, 1.0])
    assert "jumps at 0.7 s" in found.stopped and "breakpoint" in found.stopped
    told = integrate_compiled(problem, Rodas4(1e-8), [0.0], [0.0, 1.0], breakpoints=[0.7])
    assert abs(told.final[0] - (0.7 - 15.0)) < 1e-12


@pytest.mark.parametrize("solver", [*SOLVERS[:2], RungeKutta4(1e-3)], ids=repr)
def test_divergence_is_told_with_state_and_instant(solver: Rodas4) -> None:
    """x' = x^2 from 1 has no solution beyond t = 1."""
    found = integrate_compiled(
        CompiledProblem(_explodes, 2, names=("a", "b")), solver, [1.0, 0.0], np.linspace(0, 2, 21)
    )
    assert "state 'a'" in found.stopped and found.fault_index == 0
    assert abs(found.stopped_at - 1.0) < 1e-2
    assert np.isfinite(found.states).all() and found.times[-1] <= found.stopped_at and np.isfinite(found.final).all()


def test_rate_that_is_no_number() -> None:
    found = integrate_compiled(CompiledProblem(_square_root, 2), Rodas4(1e-6), [1.0, 0.0], np.linspace(0, 2, 21))
    assert found.stopped and 0.9 < found.stopped_at < 1.0 + 1e-6
    assert np.isfinite(found.states).all()


def test_current_in_ten_microseconds_beside_heat_in_a_thousand_seconds() -> None:
    found = integrate_compiled(CompiledProblem(_two_speeds, 2), Rodas4(1e-8, 1e-10), [1.0, 0.0], [0.0, 1.0, 20.0])
    tau, decay = 1e-5, 1e-3
    for t, (current, heat) in zip(found.times[1:], found.states[1:], strict=True):
        wanted = (math.cos(t) + tau * math.sin(t)) / (1.0 + tau**2)
        assert abs(current - wanted) < 1e-8
        # cos^2 t through a lag of 1e3 s: the mean 1/2 and the ripple at twice the frequency
        ripple = (decay**2 * math.cos(2 * t) + 2.0 * decay * math.sin(2 * t)) / (decay**2 + 4.0) / 2.0
        start = decay**2 / (decay**2 + 4.0) / 2.0
        wanted = 0.5 * -math.expm1(-decay * t) + ripple - start * math.exp(-decay * t)
        assert abs(heat - wanted) < 2e-8  # a step's tolerance of 1e-10 adds up over the steps
    assert found.work.steps < 5000


@pytest.mark.parametrize("damping", [0.0, 1e-4])
def test_stiff_spring_with_long_steps(damping: float) -> None:
    """w = 1e6 rad/s and steps of 1 ms, a thousand radians each: the rotor follows the end that is moved."""
    problem = CompiledProblem(_stiff_spring, 2, [1e6, damping, 1e-6])
    solver = Rodas4(1.0, 1e3, largest_step=1e-3, first_step=1e-3)
    found = integrate_compiled(problem, solver, [0.0, 1.0], np.linspace(0.0, 1.0, 11))
    assert found.work.steps < 1002
    np.testing.assert_allclose(found.states[:, 0], np.sin(found.times), atol=1e-6)


def test_descriptions_that_do_not_fit() -> None:
    for wrong in (
        lambda: Events(_height, _bounces, ()),
        lambda: Events(_height, None, ("ground",)),
        lambda: Events("height", _bounces, ("ground",)),
        lambda: CompiledProblem(None, 1),
        lambda: CompiledProblem(_falls, 0),
        lambda: CompiledProblem(_falls, 2, words=[1.5]),
        lambda: CompiledProblem(_falls, 2, names=("a",)),
    ):
        with pytest.raises(InputError):
            wrong()


# Six values whose zeros are known; word k is the sign or state of value k, word 6 counts, p[0] is where time begins.
@compiled
def _clock(t, x, dx, p, w):
    dx[0], dx[1] = 1.0, x[0]


@compiled
def _known(t, x, values, p, w):
    s = t - p[0]
    values[0] = w[0] * (s - 0.31) * (s - 0.33) * (s - 0.35)  # less than half a step from one another
    values[1] = 0.7 - x[0] if w[1] else 1.0  # of the state; over once it has been
    values[2] = 1.4 - 2.0 * s if w[2] else 1.0  # of time; at the same instant
    values[3] = (s - 0.9) ** 2 + 1e-9  # touches and does not cross
    values[4] = w[4] * s * (0.51 - s)  # zero to begin with, and rises first
    values[5] = -s * w[5]  # zero to begin with, and falls at once


@compiled
def _known_handler(t, x, crossed, p, w):
    row = 1 + 4 * w[6]
    p[row], p[row + 1], p[row + 2] = t - p[0], x[0], x[1]
    for k in range(6):
        if crossed[k] != 0.0:
            p[row + 3] += 2.0**k
            w[k] = 0 if k in (1, 2, 5) else -w[k]
    w[6] += 1


@pytest.mark.parametrize("start", [-1000.0, 0.0, 1000.0])
@pytest.mark.parametrize(
    "solver",
    [Rodas4(1e-8, largest_step=0.05), DormandPrince54(1e-8, 1e-8, largest_step=0.05), RungeKutta4(0.05)],
    ids=lambda one: type(one).__name__,
)
def test_crossings_with_a_closed_form(solver: Rodas4, start: float) -> None:
    """Which, when and at what state, whatever begins at zero, falls together, lies close together or only touches."""
    words = np.array([-1, 1, 1, 1, 1, 1, 0])
    events = Events(_known, _known_handler, tuple("abcdef"))
    problem = CompiledProblem(_clock, 2, [start, *[0.0] * 60], words, events=events)
    found = integrate_compiled(problem, solver, [0.0, 0.0], start + np.array([0.0, 1.2]))
    rows = found.checkpoint.numbers[1:].reshape(-1, 4)[: found.checkpoint.words[6]]
    assert np.diff(rows[:, 0]).min() >= 0.0
    assert (rows[:5, 3] == [32, 1, 1, 1, 16]).all() and rows[5:, 3].sum() == 2 + 4  # at once, but for rounding
    wanted = np.array([0.0, 0.31, 0.33, 0.35, 0.51, *[0.7] * (len(rows) - 5)])
    np.testing.assert_allclose(rows[:, :3].T, [wanted, wanted, wanted**2 / 2.0], atol=1e-15 * max(10.0, abs(start)))
    assert found.work.event_values < 230  # four a step, and some ten to find each


@compiled
def _adds_up(t, x, share, p, w):
    p[0] += share[0] * x[0] ** 3
    p[1] += share[0]
    p[2] = max(p[2], t)


@pytest.mark.parametrize("solver", [Rodas4(1e-6), DormandPrince54(1e-6, 1e-9), RungeKutta4(0.07)], ids=repr)
def test_account_of_two_points_is_exact_for_a_cubic(solver: Rodas4) -> None:
    """Gauss at two points adds up t^3 without error, whatever instants are wanted in between."""
    problem = CompiledProblem(_clock, 2, np.zeros(3), hooks=Hooks(account=_adds_up))
    found = integrate_compiled(problem, solver, [0.0, 0.0], np.linspace(0.0, 2.0, 14), breakpoints=[0.4])
    np.testing.assert_allclose(found.checkpoint.numbers[:2], [2.0**4 / 4.0, 2.0], rtol=1e-12)
    assert found.checkpoint.numbers[2] < 2.0


@compiled
def _doubles(t, x, nothing, p, w):
    x[1] = 2.0 * x[1] + x[0]


def test_what_opens_a_segment_sees_the_state_there() -> None:
    """x' = 1, y' = x: at 0, 1, 2 and 3 s y becomes 2 y + x, also where the last segment ends."""
    problem = CompiledProblem(_clock, 2, hooks=Hooks(segment_start=_doubles))
    found = integrate_compiled(
        problem, RungeKutta4(0.125), [0.0, 1.0], [0.0, 0.5, 1.0, 2.0, 3.0], breakpoints=[1.0, 2.0]
    )
    y = [2.0, 2.125, 2.0 * 2.5 + 1.0, 2.0 * 7.5 + 2.0, 2.0 * 19.5 + 3.0]
    np.testing.assert_allclose(found.states.T, [found.times, y], rtol=1e-13)


@compiled
def _slow(t, x, dx, p, w):
    dx[0] = 1.0


@compiled
def _short(t, x, values, p, w):
    values[0] = (x[0] - p[0]) ** 2 - p[1] ** 2 if w[0] == 0 else 1.0


@compiled
def _notes(t, x, crossed, p, w):
    p[2], w[0] = t, 1


@pytest.mark.parametrize("place", [0.3, 0.36, 0.45, 0.6, 0.7])
@pytest.mark.parametrize("half", [0.02, 1e-4])
def test_a_value_that_is_negative_only_for_a_part_of_a_step_fires(place: float, half: float) -> None:
    """(t - place)^2 - half^2 in one step from 0 to 1: positive at both ends, and at every quarter."""
    events = Events(_short, _notes, ("short",))
    problem = CompiledProblem(_slow, 1, np.array([place, half, 0.0]), np.array([0]), events=events)
    run = integrate_compiled(problem, RungeKutta4(1.0), [0.0], [0.0, 1.0])
    assert run.checkpoint.numbers[2] == pytest.approx(place - half, abs=1e-13)
