"""Exercise 8.4, the rotational inverted pendulum: the page's arm against its kinetic energy written out by hand."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np

import drivetrain as dt

PAGE = Path(__file__).resolve().parents[2] / "examples" / "chapter8" / "02c_furuta.py"


def test_equations_by_hand() -> None:
    """Tip 2 moves at (L1 q1' - L2 c q2', L2 s q1', L2 s q2') in the frame that turns with rod 1; g is 10 m/s^2."""
    arm = runpy.run_path(str(PAGE))["furuta"]()
    rng = np.random.default_rng(84)
    for q1, q2 in rng.uniform(-np.pi, np.pi, (20, 2)):
        s, c = np.sin(q2), np.cos(q2)
        mass = np.array([[2 + 4 + 2 * (1 + s * s) + 4 * s * s, -2 * c], [-2 * c, 2 + 4]])
        np.testing.assert_allclose(dt.mass_matrix(arm, [q1, q2]), mass, atol=1e-13)
        np.testing.assert_allclose(dt.gravity_torque(arm, [q1, q2]), [0.0, -20.0 * s], atol=1e-13)
        # Lagrange: dM11/dq2 = 12 s c, dM12/dq2 = 2 s.
        v1, v2 = rng.normal(size=2)
        velocity = [12 * s * c * v1 * v2 + 2 * s * v2 * v2, -6 * s * c * v1 * v1]
        np.testing.assert_allclose(dt.velocity_torque(arm, [q1, q2], [v1, v2]), velocity, atol=1e-12)


def test_what_the_exercise_asks() -> None:
    arm = runpy.run_path(str(PAGE))["furuta"]()
    torque = dt.inverse_dynamics(arm, [np.pi / 4] * 2, [0.0, 0.0], [0.0, 0.0])
    np.testing.assert_allclose(torque, [0.0, -20.0 / np.sqrt(2.0)], atol=1e-12)
