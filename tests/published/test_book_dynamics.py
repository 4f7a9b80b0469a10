"""Modern Robotics, chapter 8: the 2R arm of figure 8.1, with and without motors, against the printed formulas."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.derivatives import coriolis_matrix
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import drive_torques, gravity_torque, inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix

L1, L2, M1, M2, G = 0.7, 1.3, 2.5, 1.1, 9.81  # unlike each other, so that each stands where it should
ANGLES = [(0.0, 0.0), (0.4, -1.1), (-2.0, 2.5), (np.pi / 2, np.pi / 2)]


@pytest.fixture(scope="module")
def arm() -> Arm:
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, 0, 3] = [L1, L1 + L2]
    screws = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, -L1, 0]]
    return Arm.from_screws(home, screws, [M1, M2], np.zeros((2, 3, 3)), gravity=[0, -G, 0])


@pytest.mark.parametrize("q", ANGLES)
def test_equations_of_motion_8_9(arm: Arm, q: tuple[float, float]) -> None:
    (a, b), (da, db), (dda, ddb) = q, (1.3, -2.2), (-3.0, 4.0)
    c2, s2 = np.cos(b), np.sin(b)
    mass = np.array(
        [
            [M1 * L1**2 + M2 * (L1**2 + 2 * L1 * L2 * c2 + L2**2), M2 * (L1 * L2 * c2 + L2**2)],
            [M2 * (L1 * L2 * c2 + L2**2), M2 * L2**2],
        ]
    )
    velocity = np.array([-M2 * L1 * L2 * s2 * (2 * da * db + db**2), M2 * L1 * L2 * da**2 * s2])
    weight = G * np.array(
        [(M1 + M2) * L1 * np.cos(a) + M2 * L2 * np.cos(a + b), M2 * L2 * np.cos(a + b)],
    )
    assert mass_matrix(arm, q) == pytest.approx(mass, abs=1e-14)
    assert coriolis_matrix(arm, q, (da, db)) @ [da, db] == pytest.approx(velocity, abs=1e-13)
    assert gravity_torque(arm, q) == pytest.approx(weight, abs=1e-13)
    wanted = mass @ [dda, ddb] + velocity + weight
    assert inverse_dynamics(arm, q, (da, db), (dda, ddb)) == pytest.approx(wanted, abs=1e-13)
    assert forward_dynamics(arm, q, (da, db), wanted) == pytest.approx([dda, ddb], abs=1e-12)


@pytest.mark.parametrize("q", ANGLES)
def test_christoffel_symbols_8_17(arm: Arm, q: tuple[float, float]) -> None:
    """By hand from the mass matrix: the only slope is that with theta_2."""
    h = -M2 * L1 * L2 * np.sin(q[1])
    da, db = 1.3, -2.2
    wanted = np.array([[h * db, h * (da + db)], [-h * da, 0]])
    assert coriolis_matrix(arm, q, (da, db)) == pytest.approx(wanted, abs=1e-13)


def test_motor_torque_8_111_by_hand() -> None:
    """One joint: the motor turns the load through the gear, and its own rotor besides."""
    bare = Arm.from_screws([np.eye(4)], [[0, 0, 1, 0, 0, 0]], [1.0], [np.eye(3) * 0.4])
    arm = with_rotors(bare, [Rotor(50.0, 2e-4)])
    drives = drive_torques(arm, [0.3], [1.0], [6.0])
    assert drives.gear == pytest.approx([0.4 * 6.0])
    assert drives.motor == pytest.approx([0.4 * 6.0 / 50 + 2e-4 * 50 * 6.0])
    assert inverse_dynamics(arm, [0.3], [1.0], [6.0]) == pytest.approx(50 * drives.motor)
