"""Power of twists and wrenches is invariant, and the bracket is a derivative."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.spatial.poses import adjoint, exp_pose, inverse_pose, pose
from drivetrain.spatial.rotations import exp_rotation
from drivetrain.spatial.wrenches import bracket


def test_power_is_the_same_in_every_frame() -> None:
    rng = np.random.default_rng(1)
    a_b = pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))
    twist, wrench = rng.normal(size=(2, 6))
    there = adjoint(inverse_pose(a_b)).T @ wrench, adjoint(a_b) @ twist
    assert there[0] @ there[1] == pytest.approx(wrench @ twist, abs=1e-14)


def test_a_force_gains_the_moment_of_its_lever() -> None:
    lever, force = np.array([0.0, 2.0, 0.0]), np.array([3.0, 0.0, 0.0])
    found = adjoint(pose(point=-lever)).T @ np.concatenate([np.zeros(3), force])
    assert found == pytest.approx([0, 0, -6, 3, 0, 0])


def test_a_spin_gains_the_speed_of_its_distance() -> None:
    found = adjoint(pose(point=[0.0, 2.0, 0.0])) @ [0, 0, 1.0, 0, 0, 0]
    assert found == pytest.approx([0, 0, 1, 2, 0, 0])


def test_bracket_is_the_derivative_of_the_adjoint() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 6))
    step = 1e-6
    slope = (adjoint(exp_pose(step * a)) @ b - adjoint(exp_pose(-step * a)) @ b) / (2 * step)
    assert bracket(a) @ b == pytest.approx(slope, abs=1e-9)  # central difference: step^2 and rounding/step


def test_bracket_obeys_jacobi() -> None:
    rng = np.random.default_rng(3)
    a, b, c = rng.normal(size=(3, 6))
    total = bracket(a) @ bracket(b) @ c + bracket(b) @ bracket(c) @ a + bracket(c) @ bracket(a) @ b
    assert total == pytest.approx(np.zeros(6), abs=1e-14)
