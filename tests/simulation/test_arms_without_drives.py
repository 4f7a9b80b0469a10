"""Parts of simulations of arms without drives, each by another way: rates, corrections, rows, events and ends."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from random_arms import random_arm
from round_surface import Sphere

from drivetrain.arm.arm import Arm
from drivetrain.dynamics.constraints import Attachment, CallableConstraint, Constraint, PointOnSurface
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.simulation import constrained, passive
from drivetrain.simulation.constrained import Baumgarte, Drifting, Projection, Stabilisation, simulate_constrained
from drivetrain.simulation.passive import simulate_passive
from drivetrain.simulation.recording import energy_event
from drivetrain.solvers.solver import RungeKutta4, Solution, Work

Q, QD = np.array([0.3, -0.8, 0.5, 1.1]), np.array([0.7, 0.4, -0.9, 0.6])


def held(q: Any = Q, offset: float = 0.0) -> tuple[Arm, tuple[Constraint, ...]]:
    """An arm of four joints with its tip on a sphere, and a blade: joints 3 and 4 turn as the first says."""
    arm = random_arm(3, "RRPR")
    tip = Attachment.tip(arm)
    centre = np.array([0.4, -0.2, 0.1])
    near = PointOnSurface(tip, Sphere(centre, 1.0)).rows(arm, q[None], 0.0 * q[None]).error[0, 0]
    blade = CallableConstraint(
        lambda q: [[0.0, 0.0, math.cos(q[0]), math.sin(q[0])]],
        lambda q, qd: [qd[0] * (-math.sin(q[0]) * qd[2] + math.cos(q[0]) * qd[3])],
        1,
    )
    return arm, (PointOnSurface(tip, Sphere(centre, 1.0 + near - offset)), blade)


def rows_of(arm: Arm, several: tuple[Constraint, ...], q: Any, qd: Any) -> tuple[Any, Any, Any]:
    """Error (2,), A (2, 4), and dA/dt qd by a difference along the motion (2,)."""

    def at(q: Any) -> list[Any]:
        return [one.rows(arm, q[None], qd[None]) for one in several]

    matrices = [np.concatenate([one.jacobian[0] for one in at(q + step * qd)]) for step in (-1e-6, 0.0, 1e-6)]
    error = np.concatenate([one.error[0] for one in at(q)])
    return error, matrices[1], (matrices[2] - matrices[0]) @ qd / 2e-6


@pytest.mark.parametrize("how", [Projection(), Baumgarte(7.0), Drifting()], ids=str)
def test_rates_solve_the_equations_with_multipliers(how: Stabilisation) -> None:
    """Motion and multipliers at once, by one matrix; errors decay with critical damping or not at all."""
    arm, several = held(offset=0.03)
    tau = np.array([1.0, -2.0, 3.0, 0.5])
    error, a, drift = rows_of(arm, several, Q, QD)
    rate = how.rate if isinstance(how, Baumgarte) else 0.0
    # The blade constrains speeds only, which decay once.
    wanted = drift + rate * np.array([2.0, 1.0]) * (a @ QD) + rate**2 * np.array([error[0], 0.0])
    assert error[0] == pytest.approx(0.03) and np.abs(a @ QD).min() > 0.1
    whole = np.block([[mass_matrix(arm, Q), a.T], [a, np.zeros((2, 2))]])
    solved = np.linalg.solve(whole, np.concatenate([tau - bias_torque(arm, Q, QD), -wanted]))
    rates = constrained._rates(arm, several, lambda t, q, qd: t * tau, how)
    found = rates(1.0, np.concatenate([Q, QD, [5.0]]))
    np.testing.assert_allclose(found[:4], QD, rtol=0)
    np.testing.assert_allclose(found[4:8], solved[:4], rtol=1e-7, atol=1e-7)
    assert found[8] == pytest.approx(tau @ QD, rel=1e-12)
    idle = constrained._rates(arm, several, None, how)(1.0, np.concatenate([Q, QD, [5.0]]))
    assert idle[8] == 0.0 and np.abs(idle[4:8] - found[4:8]).max() > 0.1


def test_a_projection_is_the_smallest_change_in_the_metric_of_the_mass_matrix() -> None:
    arm, several = held(offset=0.03)
    mass = mass_matrix(arm, Q)
    error, a, _ = rows_of(arm, several, Q, QD)
    q, qd = (one[0] for one in Projection().put_back(arm, several, Q[None], QD[None]) or ())
    error_after, a_after, _ = rows_of(arm, several, q, qd)
    assert np.abs(error_after).max() < 1e-12 and np.abs(a_after @ qd).max() < 1e-12
    # M times a change is a combination of the rows.
    change = mass_matrix(arm, q) @ (qd - QD)
    combined, *_ = np.linalg.lstsq(a_after.T, change, rcond=None)
    np.testing.assert_allclose(a_after.T @ combined, change, atol=1e-9)
    # One Newton step by formula; the blade has no position to be corrected.
    inverse = np.linalg.inv(mass)
    step = -inverse @ a.T @ np.linalg.solve(a @ inverse @ a.T, error)
    once = Projection(most=1).put_back(arm, several, Q[None], QD[None])
    assert once is not None
    np.testing.assert_allclose(once[0][0], Q + step, atol=1e-9)
    twice = Projection(most=2).put_back(arm, several, Q[None], QD[None])
    assert twice is not None
    left = [abs(rows_of(arm, several, one[0][0], QD)[0][0]) for one in (once, twice)]
    assert 1e-6 < left[0] < 3e-3 and left[1] < 1e-6


@pytest.mark.parametrize("share, speed, moved", [(0.9, 0.9, (0, 0)), (1.1, 0.9, (1, 0)), (0.9, 1.1, (0, 1))])
def test_only_what_is_beyond_the_tolerance_is_corrected(share: float, speed: float, moved: tuple[int, int]) -> None:
    tolerance = 1e-5
    arm, several = held(offset=-share * tolerance)
    _, a, _ = rows_of(arm, several, Q, QD)
    along = 1e-3 * (QD - np.linalg.pinv(a) @ (a @ QD))  # so slow that a corrected position changes no row by much
    qd = along - np.linalg.pinv(a) @ np.array([0.5, speed]) * tolerance
    found = Projection(tolerance).put_back(arm, several, Q[None], qd[None])
    state = np.concatenate([Q, qd, [3.0]])
    corrected = constrained._correction(arm, several, Projection(tolerance))(0.0, state)
    if not any(moved):
        assert found is None and corrected is None
        return
    assert found is not None and corrected is not None
    for one, before, is_moved in zip(found, (Q, qd), moved, strict=True):
        assert np.array_equal(one[0], before) != is_moved
    np.testing.assert_array_equal(corrected, np.concatenate([found[0][0], found[1][0], [3.0]]))
    assert constrained._correction(arm, several, Drifting())(0.0, state) is None


def test_a_state_beyond_all_bounds_has_no_rates_and_one_within_them_answers_for_itself() -> None:
    arm, several = held()
    light = replace(arm, masses=0.0 * arm.masses, inertias=0.0 * arm.inertias)
    for size in (2.0 * passive.LARGEST_STATE, -2.0 * passive.LARGEST_STATE):
        state = np.concatenate([Q, QD, [size]])
        assert constrained._correction(arm, several, Projection())(0.0, state) is None
        found = constrained._rates(light, several, None, Drifting())(0.0, state)
        assert np.isnan(found).all()
    with pytest.raises(InputError):
        constrained._rates(light, several, None, Drifting())(0.0, np.concatenate([Q, QD, [0.0]]))


@pytest.mark.parametrize("offset, told", [(0.0, False), (4e-10, False), (1e-7, True)])
def test_rows_of_a_held_arm_are_its_equations(offset: float, told: bool) -> None:
    """Accelerations and multipliers at every row, work, the rows' names and units, and a start that was moved."""
    arm, several = held(offset=offset)
    tau = np.array([1.0, -2.0, 3.0, 0.5])
    run = simulate_constrained(
        arm, several, Q, QD, 0.01, torque=lambda t, q, qd: tau, solver=RungeKutta4(2e-3), interval=2.5e-3
    )
    np.testing.assert_allclose(run.time, [0.0, 0.0025, 0.005, 0.0075, 0.01])
    q, qd, qdd = (np.array(list(run.ending(what).values())).T for what in ("position", "speed", "acceleration"))
    assert np.abs(q[0] - Q).max() < 1e-6 + 10.0 * offset and np.abs(qd[0] - QD).max() > 0.1
    for k in range(len(q)):
        _, a, drift = rows_of(arm, several, q[k], qd[k])
        whole = np.block([[mass_matrix(arm, q[k]), a.T], [a, np.zeros((2, 2))]])
        solved = np.linalg.solve(whole, np.concatenate([tau - bias_torque(arm, q[k], qd[k]), -drift]))
        np.testing.assert_allclose(qdd[k], solved[:4], rtol=1e-6, atol=1e-6)
        for i, value in ((1, solved[4]), (2, solved[5])):
            assert run[f"constraint_{i}.multiplier_1"][k] == pytest.approx(value, rel=1e-6)
    assert [run.unit(f"constraint_{i}.multiplier_1") for i in (1, 2)] == ["N", "-"]
    assert run["constraint_error"].max() < 1e-11 and run["constraint_speed"].max() < 1e-11
    assert (run["rank"] == 2.0).all()
    np.testing.assert_allclose(run["work"], (q - q[0]) @ tau, atol=1e-9)
    assert [(event.time, event.name) for event in run.events] == [(0.0, "start")] * told
    assert run.about["constraints"] == "PointOnSurface, CallableConstraint"


# --- without constraints


def test_rates_are_those_of_forward_dynamics() -> None:
    arm, _ = held()
    tau = np.array([1.0, -2.0, 3.0, 0.5])
    for law, torque in ((None, 0.0 * tau), (lambda t, q, qd: t * tau + q, 2.0 * tau + Q)):
        found = passive._rates(arm, law)(2.0, np.concatenate([Q, QD, [9.0]]))
        wanted = [*QD, *forward_dynamics(arm, Q, QD, torque), torque @ QD]
        np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_energies_torques_and_counters_of_a_free_arm() -> None:
    arm, _ = held()
    tau = np.array([1.0, -2.0, 3.0, 0.5])
    run = simulate_passive(arm, Q, QD, 0.01, torque=lambda t, q, qd: (1.0 + t) * tau, solver=RungeKutta4(2e-3))
    assert (run.counters["rates"], run.counters["steps"], run.counters["restarts"]) == (20, 5, 0)
    q, qd, qdd, given = (
        np.array(list(run.ending(what).values())).T for what in ("position", "speed", "acceleration", "torque")
    )
    for k, t in enumerate((0.0, 0.01)):
        np.testing.assert_allclose(given[k], (1.0 + t) * tau, rtol=1e-12)
        np.testing.assert_allclose(qdd[k], forward_dynamics(arm, q[k], qd[k], given[k]), rtol=1e-9)
        assert run["kinetic_energy"][k] == pytest.approx(0.5 * qd[k] @ mass_matrix(arm, q[k]) @ qd[k], rel=1e-12)
    total = run["kinetic_energy"] + run["potential_energy"]
    assert run["work"][1] == pytest.approx(total[1] - total[0], rel=1e-6)
    # Power is nearly linear in so short a time.
    assert run["work"][1] == pytest.approx(0.005 * (given[0] @ qd[0] + given[1] @ qd[1]), rel=1e-3)
    np.testing.assert_allclose(run["energy_error"], total - run["work"] - total[0], atol=1e-12)


@pytest.mark.parametrize(
    ("duration", "interval", "count", "last"),
    [
        (0.3, 0.1, 4, 0.3), (0.25, 0.1, 4, 0.25), (0.05, 0.1, 2, 0.05), (0.3 * (1.0 - 1e-13), 0.1, 4, 0.3),
        (0.3 * (1.0 + 1e-10), 0.1, 4, 0.3), (0.3 * (1.0 + 1e-8), 0.1, 5, 0.3 * (1.0 + 1e-8)),
        (0.3 * (1.0 - 1e-10), 0.1, 4, 0.3 * (1.0 - 1e-10)), (1e9, 1e3, 1_000_001, 1e9),
    ],
)  # fmt: skip
def test_rows_are_even_and_the_last_is_the_end(duration: float, interval: float, count: int, last: float) -> None:
    times = passive.recorded_times(duration, interval)
    assert len(times) == count and times[-1] == pytest.approx(last, rel=1e-12)
    np.testing.assert_allclose(times[:-1], interval * np.arange(count - 1), rtol=1e-12)


@pytest.mark.parametrize("duration, interval, place", [(1.01e9, 1e3, "duration"), (1.0, 0.99e-8, "duration")])
def test_too_long_or_too_many_rows(duration: float, interval: float, place: str) -> None:
    with pytest.raises(InputError) as caught:
        passive.recorded_times(duration, interval)
    assert caught.value.faults[0].place == place


def test_a_torque_law_is_tried_once_at_the_start() -> None:
    arm, seen = held()[0], list[Any]()

    def law(t: float, q: Any, qd: Any) -> Any:
        seen.append((t, *q, *qd))
        return 0.0 * q

    assert (
        passive.checked_law(arm, law, np.append(Q, QD)) is law
        and seen == [(0.0, *Q, *QD)]
        and passive.checked_law(arm, None, np.append(Q, QD)) is None
    )


def test_a_start_faster_than_any_arm_is_refused_by_its_index() -> None:
    arm, _ = held()
    np.testing.assert_array_equal(passive.checked_start(arm, Q, 1e6 * np.sign(QD)), [*Q, *(1e6 * np.sign(QD))])
    for k in range(4):
        fast = QD.copy()
        fast[k] = -1.001e6
        with pytest.raises(InputError) as caught:
            passive.checked_start(arm, Q, fast)
        assert caught.value.faults[0].place == f"qd0[{k}]"


BEYOND = 2.0 * passive.LARGEST_STATE


@pytest.mark.parametrize(
    ("states", "kept", "index", "at"),
    [
        ([[1.0, 2.0], [3.0, 4.0], [5.0, -BEYOND], [BEYOND, 1.0]], 2, 1, 0.2),
        ([[BEYOND, 3.0 * BEYOND], [3.0, 4.0], [1.0, 1.0], [1.0, 1.0]], 1, 1, 0.0),
        ([[1.0, 2.0], [-3.0 * BEYOND, 2.0 * BEYOND], [1.0, 1.0], [1.0, 1.0]], 1, 0, 0.1),
    ],
)  # fmt: skip
def test_a_run_ends_before_the_row_that_diverges(states: Any, kept: int, index: int, at: float) -> None:
    times = np.array([0.0, 0.1, 0.2, 0.3])
    found = passive.up_to_divergence(Solution(times, np.array(states), Work(), "", 0.3, None))
    assert (len(found.times), len(found.states), found.fault_index, found.stopped_at) == (kept, kept, index, at)
    assert "diverges" in found.stopped
    fine = Solution(times, np.full((4, 2), 0.9 * passive.LARGEST_STATE), Work(), "", 0.3, None)
    assert passive.up_to_divergence(fine) is fine


def test_who_diverged() -> None:
    arm, _ = held()
    last = np.array([[1.0, 2.0, 3.0, 4.0, 5.0, -9.0, 7.0, 8.0, 100.0]])

    def told(stopped: str, index: int | None) -> Any:
        return passive.stopped_by(arm, Solution(np.array([0.2]), last, Work(), stopped, 0.3, index))

    first = arm.joint_names
    assert told("", None) is None
    event = told("why", None)
    assert (event.time, event.name, event.detail) == (0.3, "solver", "why")
    for index, name in ((0, f"{first[0]}.position"), (3, f"{first[3]}.position"), (4, f"{first[0]}.speed"),
                        (7, f"{first[3]}.speed"), (8, f"{first[1]}.speed")):  # fmt: skip
        event = told("why", index)
        assert (event.time, event.name, event.detail) == (0.3, "diverged", f"{name}: why")


def test_a_limit_that_is_passed_is_told_once_each_time() -> None:
    arm, _ = held()
    arm = replace(arm, lower=np.array([-1.0, -2.0, -0.5, -np.inf]), upper=np.array([1.0, 2.0, 0.5, np.inf]))
    times = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    q = np.array([
        [1.5, 0.0, 0.0, 9.0], [1.5, 0.0, 0.6, 9.0], [0.0, -2.5, 0.6, 9.0], [1.0, 0.0, -0.6, 9.0], [1.2, -2.1, 0.0, 9.0],
    ])  # fmt: skip
    a, b, c, _ = arm.joint_names
    wanted = [
        (0.0, f"{a} passes its upper limit, 1 rad"), (1.0, f"{c} passes its upper limit, 0.5 m"),
        (2.0, f"{b} passes its lower limit, -2 rad"), (3.0, f"{c} passes its lower limit, -0.5 m"),
        (4.0, f"{a} passes its upper limit, 1 rad"), (4.0, f"{b} passes its lower limit, -2 rad"),
    ]  # fmt: skip
    assert [(event.time, event.detail) for event in passive.limit_events(arm, times, q)] == wanted


@pytest.mark.parametrize(
    ("passed", "stored", "tolerance", "most"),
    [
        (2.0, 0.0, 0.0, 0.02), (2.0, 0.0, 5e-4, 0.02), (2.0, 0.0, 5e-3, 0.1), (0.0, 3e6, 0.0, 3e-3),
        (2.0, 3e6, 5e-3, 0.103),
    ],
)  # fmt: skip
def test_energy_that_is_missing(passed: float, stored: float, tolerance: float, most: float) -> None:
    """A hundredth of what goes to and fro, or ten times the tolerance, and rounding of what is stored."""
    time, error = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.99, 1.01, -1.3]) * most
    assert energy_event(time, error[:2], passed, stored, tolerance) == ()
    assert energy_event(time[:0], error[:0], passed, stored, tolerance) == ()
    for sign in (1.0, -1.0):
        (event,) = energy_event(time, sign * error, passed, stored, tolerance)
        assert (event.time, event.name) == (2.0, "energy")
        assert ("tolerance" in event.detail) == (tolerance > 0.0)
        if passed:
            assert event.detail.startswith(f"{130.0 * most / passed:.2g} %")
