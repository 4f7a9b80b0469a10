"""Modern Robotics, section 8.9.2: the 2R arm with its motors, gear ratios 10 and 100, and equation 8.9's gravity."""

from __future__ import annotations

import numpy as np
import pytest

import drivetrain as dt


def mass_matrix(arm: dt.Arm, q: np.ndarray) -> np.ndarray:
    """Column by column from inverse dynamics of unit accelerations, without gravity."""
    columns = [dt.inverse_dynamics(arm, q, np.zeros(2), unit) for unit in np.eye(2)]
    return np.column_stack(columns)


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2, 2.5])
def test_mass_matrix_with_ratio_10(angle: float) -> None:
    c = np.cos(angle)
    found = mass_matrix(dt.load_arm("planar-2r", gravity=[0, 0, 0]), np.array([0.3, angle]))
    assert found == pytest.approx(np.array([[4.13125 + 2 * c, 1.0125 + c], [1.0125 + c, 1.125]]), abs=1e-14)


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2, 2.5])
def test_mass_matrix_with_ratio_100(angle: float) -> None:
    c = np.cos(angle)
    arm = dt.with_rotors(dt.load_arm("planar-2r", gravity=[0, 0, 0]), [dt.Rotor(100, 0.00125)] * 2)
    found = mass_matrix(arm, np.array([-1.0, angle]))
    assert found == pytest.approx(np.array([[16.50625 + 2 * c, 1.125 + c], [1.125 + c, 13.5]]), abs=1e-14)


def test_gravity_torque_with_the_second_motor_at_the_elbow() -> None:
    q = np.array([0.4, -1.1])
    first, second = 9.81 * np.cos(q[0]), 9.81 * np.cos(q[0] + q[1])
    found = dt.inverse_dynamics(dt.load_arm("planar-2r"), q, np.zeros(2), np.zeros(2))
    # Link 1 carries its own kilogram and that of motor 2.
    assert found == pytest.approx([3 * first + second, second], abs=1e-13)
