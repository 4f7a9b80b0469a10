"""Mass matrix, Coriolis matrix and gravity: values computed by hand, and laws they obey."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import motion, random_arm

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.derivatives import christoffel_symbols, coriolis_matrix
from drivetrain.dynamics.inverse import gravity_torque
from drivetrain.dynamics.mass import mass_factor, mass_matrix


def test_long_batches_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = random_arm(41)
    q, qd, _ = motion(41, 6, 25)
    masses, coriolis, symbols = mass_matrix(arm, q), coriolis_matrix(arm, q, qd), christoffel_symbols(arm, q)
    monkeypatch.setattr("drivetrain.dynamics.mass.CHUNK", 10)
    monkeypatch.setattr("drivetrain.dynamics.derivatives.CHUNK", 10)
    np.testing.assert_allclose(mass_matrix(arm, q), masses, rtol=1e-13)
    np.testing.assert_allclose(coriolis_matrix(arm, q, qd), coriolis, atol=1e-12)
    np.testing.assert_allclose(christoffel_symbols(arm, q), symbols, rtol=1e-12, atol=1e-12)


def test_two_slides_and_a_wheel() -> None:
    """A cross table with a wheel: masses add up, there is no coupling, a rotor adds its inertia times ratio squared."""
    home = np.tile(np.eye(4), (3, 1, 1))
    screws = [[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 1, 0, 0, 0]]
    bare = Arm.from_screws(home, screws, [3.0, 2.0, 1.0], [np.eye(3) * 0.5] * 3)
    np.testing.assert_allclose(mass_matrix(bare, [0.3, -1.0, 2.0]), np.diag([6.0, 3.0, 0.5]), atol=1e-15)
    geared = with_rotors(bare, [Rotor(200.0, 1e-4), None, Rotor(-30.0, 1e-4)])
    wanted = np.diag([6.0 + 200.0**2 * 1e-4, 3.0, 0.5 + 900 * 1e-4])
    np.testing.assert_allclose(mass_matrix(geared, [0.3, -1.0, 2.0]), wanted, atol=1e-14)
    np.testing.assert_allclose(gravity_torque(bare, [0.3, -1.0, 2.0]), np.zeros(3), atol=1e-14)


def test_rotor_couples_joints_only_at_full_level() -> None:
    """Two parallel axes: the second rotor also turns with link 0, so there is an off-diagonal term J ratio."""
    screws = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0]]
    bare = Arm.from_screws(np.tile(np.eye(4), (2, 1, 1)), screws, [1.0, 1.0], [np.eye(3)] * 2)
    rotors = [Rotor(50.0, 1e-3), Rotor(-80.0, 2e-3)]
    own = np.array([[2.0, 1.0], [1.0, 1.0]]) + np.diag([2e-3, 0.0])  # rotor 1 is carried by link 0
    squares = np.diag([50.0**2 * 1e-3, 80.0**2 * 2e-3])
    coupling = np.array([[0.0, -80.0 * 2e-3], [-80.0 * 2e-3, 0.0]])
    levels = {RotorLevel.NONE: own, RotorLevel.REFLECTED: own + squares, RotorLevel.FULL: own + squares + coupling}
    for level, wanted in levels.items():
        np.testing.assert_allclose(mass_matrix(with_rotors(bare, rotors, level=level), [0.4, 1.1]), wanted, atol=1e-14)


def test_the_factor_is_lower_triangular() -> None:
    arm, (q, _, _) = random_arm(5), motion(5, 6, 4)
    factor = mass_factor(arm, q)
    assert not np.triu(factor, 1).any()
    np.testing.assert_allclose(factor @ factor.swapaxes(1, 2), mass_matrix(arm, q), atol=1e-13 * np.abs(factor).max())
