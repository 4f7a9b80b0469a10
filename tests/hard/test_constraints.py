"""Constraints told twice, or that contradict each other, and how far a loop opens over a hundred thousand steps."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from four_bar import four_bar
from hard_case import Figure, hard_case
from random_arms import error, motion, random_arm

from drivetrain.dynamics.constrained import closed_position, constrained_forward_dynamics
from drivetrain.dynamics.constraints import (
    Attachment,
    CallableConstraint,
    ClosingJoint,
    LoopClosure,
    Plane,
    PointOnSurface,
)
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.simulation.constrained import Baumgarte, Drifting, simulate_constrained
from drivetrain.solvers.solver import RungeKutta4, SemiImplicitEuler


def exact(matrix: np.ndarray, force: np.ndarray, rows: np.ndarray, drift: np.ndarray) -> np.ndarray:
    """x of ``M x + A' lambda = f``, ``A x = -d`` for independent rows, with 60 digits."""
    with mp.workdps(60):
        m, a = mp.matrix(matrix.tolist()), mp.matrix(rows.tolist())
        n, k = m.rows, a.rows
        whole, right = mp.zeros(n + k), mp.matrix([*force.tolist(), *(-drift).tolist()])
        whole[:n, :n], whole[:n, n:], whole[n:, :n] = m, a.T, a
        return np.array(mp.lu_solve(whole, right)[:n].tolist(), dtype=float).ravel()


def by_inverses(matrix: np.ndarray, force: np.ndarray, rows: np.ndarray, drift: np.ndarray) -> np.ndarray:
    """Equations 8.95 to 8.97 as they are printed."""
    inverse = np.linalg.inv(matrix)
    multipliers = np.linalg.inv(rows @ inverse @ rows.T) @ (rows @ inverse @ force + drift)
    return inverse @ (force - rows.T @ multipliers)


@hard_case(
    "T34",
    "Redundant constraints",
    setup=(
        "A six-axis arm with three constraint rows and five linear combinations of them, in 20 states. The "
        "reference has 60 digits."
    ),
    naive="inv(A inv(M) A')",
)
def test_redundant_rows() -> list[Figure]:
    worst, worst_least, naive_worst, crashes = 0.0, 0.0, 0.0, 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        arm = random_arm(seed)
        q, qd, tau = (values[0] for values in motion(seed, 6, 1))
        three, lean, mix = rng.normal(size=(3, 6)), rng.normal(size=3), rng.integers(-2, 3, (5, 3)).astype(float)
        rows, drift = np.vstack([three, mix @ three]), np.concatenate([lean, mix @ lean])
        held = CallableConstraint(lambda _, rows=rows: rows, lambda *_, drift=drift: drift, 8)
        found = constrained_forward_dynamics(arm, held, q, qd, tau)
        assert found.rank == 3
        matrix, force = mass_matrix(arm, q), tau - bias_torque(arm, q, qd)
        wanted = exact(matrix, force, three, lean)
        worst = max(worst, error(found.acceleration, wanted))
        least = np.linalg.lstsq(rows.T, force - matrix @ wanted, rcond=1e-9)[0]
        worst_least = max(worst_least, error(found.multipliers, least))
        try:
            naive_worst = max(naive_worst, error(by_inverses(matrix, force, rows, drift), wanted))
        except np.linalg.LinAlgError:
            crashes += 1
    return [
        Figure(
            "relative error of the accelerations",
            worst,
            math.nan if crashes == 20 else naive_worst,
            at_most=1e-12,
            naive_says=f"LinAlgError in {crashes} of 20" if crashes == 20 else "",
        ),
        # As good as the least squares that it is held against.
        Figure("relative difference from the multipliers of smallest norm", worst_least, at_most=1e-9),
    ]


@hard_case(
    "T35",
    "Drift over 100 000 constrained steps",
    setup="A four-bar linkage falls for 50 s: RK4 at 0.5 ms with projection.",
    naive="accelerations alone with semi-implicit Euler for 5 s",
)
def test_drift() -> list[Figure]:
    arm, loop, q = four_bar()
    run = simulate_constrained(arm, loop, q, np.zeros(3), 50.0, solver=RungeKutta4(5e-4), interval=0.05)
    assert run.counters["steps"] == 100_000
    assert (run["rank"] == 2.0).all()
    alone = simulate_constrained(
        arm, loop, q, np.zeros(3), 5.0, solver=SemiImplicitEuler(5e-4), stabilisation=Drifting(), interval=0.05
    )
    scale = run["kinetic_energy"].max()
    energies = [float(np.abs(one["energy_error"]).max() / scale) for one in (run, alone)]
    return [
        Figure(
            "gap of the loop", run["constraint_error"].max(), alone["constraint_error"].max(), at_most=1e-10, unit="m"
        ),
        Figure("relative energy error", *energies, at_most=1e-6),
    ]


def test_a_spring_as_stiff_as_the_step_diverges_and_is_told() -> None:
    """Baumgarte's way with its rate at the inverse of the step: the recording stops and names a joint."""
    arm, loop, q = four_bar()
    run = simulate_constrained(
        arm, loop, q, np.zeros(3), 5.0, solver=SemiImplicitEuler(2e-3), stabilisation=Baumgarte(1000.0), interval=0.05
    )
    assert run.stopped_by is not None
    assert run.stopped_by.name == "diverged"
    assert run.stopped_by.detail.startswith("joint_")
    assert all(np.isfinite(run[name]).all() for name in run.series)


@hard_case(
    "T36",
    "Contradictory constraints",
    setup=(
        "The tip is to lie on two parallel planes 0.1 m apart, and on a plane that rises at 1 m/s² and one that "
        "does not."
    ),
    naive="pseudo-inverse of the constraint rows",
)
def test_contradictions() -> list[Figure]:
    arm, told = random_arm(8), 0
    q, qd, tau = (values[0] for values in motion(8, 6, 1))
    tip = Attachment.tip(arm)
    floors = [PointOnSurface(tip, Plane([0, 0, 1], [0, 0, height])) for height in (0.2, 0.3)]
    try:
        closed_position(arm, floors, q)
    except InputError as fault:
        told += "no position near it meets the constraints" in str(fault)

    def jacobian(position: np.ndarray) -> np.ndarray:
        return floors[0].rows(arm, position[None], np.zeros((1, 6))).jacobian[0]

    def drift(position: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return floors[0].rows(arm, position[None], speed[None]).drift[0] + 1.0

    found = constrained_forward_dynamics(arm, [floors[0], CallableConstraint(jacobian, drift, 1)], q, qd, tau)
    told += bool(found.rank == 1 and found.missed > 0.5)
    rows = np.vstack([jacobian(q)] * 2)
    lean = np.concatenate([drift(q, qd) - 1.0, drift(q, qd)])
    answer = -np.linalg.pinv(rows) @ lean  # finite, and nothing said
    assert np.abs(rows @ answer + lean).max() > 0.4
    return [Figure("contradictions reported, of 2", float(told), 2.0 * float(np.isnan(answer).any()), at_least=2.0)]


def test_a_loop_that_cannot_close_is_an_error() -> None:
    arm, _, _ = four_bar()
    far = np.eye(4)
    far[0, 3] = 5.0
    with pytest.raises(InputError, match="no position near it"):
        closed_position(arm, LoopClosure(Attachment.tip(arm), Attachment.base(far), ClosingJoint.HINGE), np.ones(3))
