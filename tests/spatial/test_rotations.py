"""Rotations against scipy, at the smallest angles and next to half a turn; tests/hard has them against 60 digits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivetrain.spatial.rotations import (
    exp_rotation,
    frame_along,
    is_rotation,
    log_rotation,
    nearest_rotation,
    quaternion,
    rotation_from_rpy,
    rpy_from_rotation,
    skew,
    unit,
)


def axes() -> list[np.ndarray]:
    rng = np.random.default_rng(24)
    fixed = [np.eye(3)[i] * s for i in range(3) for s in (1.0, -1.0)]
    return [*fixed, *(unit(v) for v in rng.normal(size=(20, 3)))]


@pytest.mark.parametrize("angle", [1e-300, 1e-150, 1e-12, 1e-7])
def test_log_keeps_relative_digits_of_small_angles(angle: float) -> None:
    for axis in axes():
        assert log_rotation(exp_rotation(angle * axis)) == pytest.approx(angle * axis, rel=1e-15, abs=1e-16 * angle)


def test_log_picks_one_sign_at_half_a_turn() -> None:
    assert log_rotation(np.diag([-1.0, -1.0, 1.0])) == pytest.approx([0, 0, np.pi])
    assert log_rotation(np.diag([1.0, -1.0, -1.0])) == pytest.approx([np.pi, 0, 0])


def test_agrees_with_scipy_on_random_rotations() -> None:
    rng = np.random.default_rng(1)
    for rotation in Rotation.random(200, random_state=rng):
        matrix = rotation.as_matrix()
        assert log_rotation(matrix) == pytest.approx(rotation.as_rotvec(), abs=5e-15)
        real, imaginary = quaternion(matrix)
        wanted = rotation.as_quat(canonical=True)
        assert np.append(imaginary, real) == pytest.approx(wanted, abs=1e-15)


def test_roll_pitch_yaw_both_ways() -> None:
    rng = np.random.default_rng(2)
    for rpy in rng.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], size=(100, 3)):
        matrix = rotation_from_rpy(rpy)
        # Rotations about fixed axes x, y, z are lower case in scipy.
        assert matrix == pytest.approx(Rotation.from_euler("xyz", rpy).as_matrix(), abs=1e-15)
        assert rpy_from_rotation(matrix) == pytest.approx(rpy, abs=1e-14)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_roll_pitch_yaw_at_gimbal_lock_gives_the_same_rotation(pitch: float) -> None:
    matrix = rotation_from_rpy([0.3, pitch, -0.8])
    found = rpy_from_rotation(matrix)
    assert found[2] == 0.0
    assert rotation_from_rpy(found) == pytest.approx(matrix, abs=2e-16)


@pytest.mark.parametrize("gap", [1e-15, 1e-13, 1e-10, 1e-8, 1e-4])
def test_roll_pitch_yaw_lose_nothing_near_gimbal_lock(gap: float) -> None:
    """Rotated in two steps, so that all entries have rounding; only the sum of roll and yaw is then determined."""
    matrix = exp_rotation([0.4, 0.5, -0.2]).T @ (
        exp_rotation([0.4, 0.5, -0.2]) @ rotation_from_rpy([0.3, np.pi / 2 - gap, -0.8])
    )
    assert rotation_from_rpy(rpy_from_rotation(matrix)) == pytest.approx(matrix, abs=2e-14)


def test_skew_takes_the_cross_product() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 3))
    assert skew(a) @ b == pytest.approx(np.cross(a, b), abs=1e-16)


def test_frame_along_puts_z_on_the_axis_by_the_smallest_rotation() -> None:
    for axis in [*axes(), unit([1e-9, 0, -1]), unit([1e-9, 2e-9, 1])]:
        frame = frame_along(axis)
        assert frame[:, 2] == pytest.approx(axis, abs=1e-16)
        assert is_rotation(frame, 1e-15)
        # The smallest rotation has the angle between the axes.
        assert np.trace(frame) == pytest.approx(1 + 2 * axis[2], abs=1e-15)
    assert np.array_equal(frame_along([0, 0, 1.0]), np.eye(3))
    assert np.array_equal(frame_along([0, 0, -1.0]), np.diag([1.0, -1.0, -1.0]))


def test_nearest_rotation_mends_rounding_and_refuses_nothing() -> None:
    rng = np.random.default_rng(4)
    exact = exp_rotation(rng.normal(size=3))
    assert np.abs(nearest_rotation(exact + 1e-7 * rng.normal(size=(3, 3))) - exact).max() < 1e-6
    assert is_rotation(nearest_rotation(np.diag([1.0, 1.0, -1.0])), 1e-15)
    assert not is_rotation(np.diag([1.0, 1.0, -1.0]))
    assert not is_rotation(1.001 * np.eye(3))
