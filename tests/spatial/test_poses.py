"""Poses against scipy's matrix exponential, and inverse functions against each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from drivetrain.spatial.poses import (
    adjoint,
    axis_point,
    exp_pose,
    inverse_pose,
    log_pose,
    pose,
    pose_from_xyz_rpy,
)
from drivetrain.spatial.rotations import exp_rotation, skew, unit

ANGLES = [0.0, 1e-200, 1e-12, 1e-8, 1e-4, 9.99e-3, 1.001e-2, 0.09, 0.3, 2.0, np.pi - 1e-6, np.pi - 1e-9]


def hat(twist: np.ndarray) -> np.ndarray:
    result = np.zeros((4, 4))
    result[:3, :3], result[:3, 3] = skew(twist[:3]), twist[3:]
    return result


def random_pose(rng: np.random.Generator) -> np.ndarray:
    return pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))


@pytest.mark.parametrize("angle", ANGLES)
def test_exp_is_the_matrix_exponential(angle: float) -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        twist = np.concatenate([angle * unit(rng.normal(size=3)), rng.normal(size=3)])
        # the error of scipy's Pade approximation is some 1e-15 of the norm
        assert exp_pose(twist) == pytest.approx(expm(hat(twist)), abs=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_undoes_exp(angle: float) -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        twist = np.concatenate([angle * unit(rng.normal(size=3)), rng.normal(size=3)])
        assert log_pose(exp_pose(twist)) == pytest.approx(twist, abs=2e-14)


def test_inverse_and_adjoint_follow_the_chain() -> None:
    rng = np.random.default_rng(7)
    a_b, b_c = random_pose(rng), random_pose(rng)
    assert inverse_pose(a_b) @ a_b == pytest.approx(np.eye(4), abs=1e-15)
    assert adjoint(a_b @ b_c) == pytest.approx(adjoint(a_b) @ adjoint(b_c), abs=1e-14)
    assert adjoint(inverse_pose(a_b)) == pytest.approx(np.linalg.inv(adjoint(a_b)), abs=1e-13)


def test_adjoint_is_conjugation_of_the_twist_matrix() -> None:
    rng = np.random.default_rng(8)
    a_b, twist = random_pose(rng), rng.normal(size=6)
    assert hat(adjoint(a_b) @ twist) == pytest.approx(a_b @ hat(twist) @ inverse_pose(a_b), abs=1e-14)


def test_pose_from_xyz_rpy_turns_about_fixed_axes() -> None:
    found = pose_from_xyz_rpy([1, 2, 3], [0.0, 0.0, np.pi / 2])
    assert found @ [1, 0, 0, 1] == pytest.approx([1, 3, 3, 1])


def test_axis_point_is_on_the_axis_and_nearest() -> None:
    rng = np.random.default_rng(9)
    axis, point, near = unit(rng.normal(size=3)), rng.normal(size=3), rng.normal(size=3)
    screw = np.concatenate([axis, np.cross(point, axis) + 0.3 * axis])  # the pitch does not change the line
    found = axis_point(screw, near)
    assert np.cross(found - point, axis) == pytest.approx(np.zeros(3), abs=1e-15)
    assert (found - near) @ axis == pytest.approx(0.0, abs=1e-15)
