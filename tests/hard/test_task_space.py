"""The inertia of the tip where the arm is nearly straight."""

from __future__ import annotations

import mpmath as mp
import numpy as np
from hard_case import Figure, hard_case
from random_arms import error

from drivetrain.arm.arm import Arm
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.dynamics.task_space import Damped, TipVelocity, task_space_dynamics

TASK = TipVelocity((3, 4))


def point_masses() -> Arm:
    homes = [np.eye(4), np.eye(4)]
    homes[0][0, 3], homes[1][0, 3] = 1.0, 2.0
    screws = [[0, 0, 1.0, 0, 0, 0], [0, 0, 1.0, 0, -1.0, 0]]
    return Arm.from_screws(homes, screws, [2.0, 1.0], np.zeros((2, 3, 3)), homes[1], (0.0, -9.81, 0.0))


def exact(arm: Arm, q: np.ndarray) -> np.ndarray:
    """The tip's inertia with 60 digits, from the arm's matrices written out (equation 8.9)."""
    with mp.workdps(60):
        a, b, m1, m2 = (mp.mpf(float(x)) for x in (*q, *arm.masses))
        c = mp.cos(b)
        mass = mp.matrix([[m1 + m2 * (2 + 2 * c), m2 * (1 + c)], [m2 * (1 + c), m2]])
        jacobian = mp.matrix([[-mp.sin(a) - mp.sin(a + b), -mp.sin(a + b)], [mp.cos(a) + mp.cos(a + b), mp.cos(a + b)]])
        back = jacobian**-1
        return np.array((back.T * mass * back).tolist(), dtype=float)


def inverted_twice(arm: Arm, q: np.ndarray) -> np.ndarray:
    jacobian = TASK.jacobian(arm, q[None])[0]
    return np.linalg.inv(jacobian @ np.linalg.inv(mass_matrix(arm, q)) @ jacobian.T)


@hard_case(
    "T33",
    "Operational-space inertia near a singularity",
    setup="A 2R arm with its elbow from 0.1 to 1e-12 rad away from straight. The reference has 60 digits.",
    naive="inv(J inv(M) J')",
)
def test_near_singular() -> list[Figure]:
    arm, worst, silent, naive_worst, naive_silent, crashes = point_masses(), 0.0, 0, 0.0, 0, 0
    for exponent in range(1, 13):
        q = np.array([0.7, 10.0**-exponent])
        wanted = exact(arm, q)
        found = task_space_dynamics(arm, q, np.zeros(2), task=TASK)
        off = error(found.inertia, wanted)
        flagged = bool(found.damping > 0.0 and found.rank < 2)
        if not flagged:
            worst = max(worst, off)
        silent += off > 1e-8 and not flagged
        try:
            naive = error(inverted_twice(arm, q), wanted)
            naive_worst = max(naive_worst, naive)
            naive_silent += naive > 1e-8
        except np.linalg.LinAlgError:  # at least it is told
            crashes += 1
    return [
        Figure("relative error where no singularity is reported", worst, naive_worst, at_most=1e-8),
        Figure(
            "incorrect answers without a report, of 12",
            float(silent),
            float(naive_silent),
            at_most=0.0,
            naive_says=f"{naive_silent}, and LinAlgError in {crashes}",
        ),
    ]


def test_down_to_a_hundred_millionth_without_damping() -> None:
    """The factors themselves are good to 1e-8 down to a share of 1e-7 of the largest singular value."""
    arm = point_masses()
    for exponent in range(1, 8):
        q = np.array([0.7, 10.0**-exponent])
        found = task_space_dynamics(arm, q, np.zeros(2), task=TASK, near_singular=Damped(1e-9))
        assert found.damping == 0.0
        assert error(found.inertia, exact(arm, q)) < 1e-8
