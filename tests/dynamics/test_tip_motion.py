"""The tip as a point: Jacobian and accelerations against differences of its pose."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm

from drivetrain.arm.kinematics import body_jacobian, skeleton, tip_acceleration_terms, tip_jacobian, tip_pose
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm


def test_jacobian_is_the_body_jacobian_turned() -> None:
    arm = random_arm(90, EVERY_JOINT)
    q, _, _ = motion(90, arm.n)
    turn = tip_pose(arm, q)[:, :3, :3]
    body = body_jacobian(arm, q)
    wanted = np.concatenate([turn @ body[:, :3], turn @ body[:, 3:]], axis=1)
    assert error(tip_jacobian(arm, q), wanted) < 1e-14


def test_jacobian_is_the_slope_of_the_place() -> None:
    arm = random_arm(91, EVERY_JOINT)
    q, _, _ = motion(91, arm.n)
    h = 1e-5
    slope = [(tip_pose(arm, q + h * e) - tip_pose(arm, q - h * e))[:, :3, 3] / (2 * h) for e in np.eye(arm.n)]
    assert error(tip_jacobian(arm, q)[:, 3:], np.stack(slope, axis=2)) < 1e-9  # errors of h^2, and rounding over h


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
def test_terms_are_second_differences(joints: str) -> None:
    """For each pair of joints: the mixed second derivative of the position times both speeds."""
    arm = random_arm(92, joints)
    q, qd, _ = motion(92, arm.n, 2)
    terms = tip_acceleration_terms(arm, q, qd)
    h, units = 1e-4, np.eye(arm.n)

    def place(*steps: np.ndarray) -> np.ndarray:
        return tip_pose(arm, q + h * np.sum(steps, axis=0))[:, :3, 3]

    for j in range(arm.n):
        for k in range(arm.n):
            u, v = units[j], units[k]
            mixed = (place(u, v) - place(u, -v) - place(-u, v) + place(-u, -v)) / (4 * h * h)
            # Errors of h^2, and rounding over h^2.
            assert error(terms[:, j, k], mixed * (qd[:, j] * qd[:, k])[:, None]) < 1e-6
    np.testing.assert_allclose(terms, np.swapaxes(terms, 1, 2), atol=1e-15)


def test_figure_8_2() -> None:
    """At (0, 90 deg) with unit lengths: (-w1^2, -w1^2), (0, -w2^2), and Coriolis (0, -2 w1 w2)."""
    arm, w1, w2 = planar_2r_arm(Planar2R()), 1.7, -0.6
    terms = tip_acceleration_terms(arm, [0.0, np.pi / 2], [w1, w2])
    np.testing.assert_allclose(terms[0, 0], [-(w1**2), -(w1**2), 0.0], atol=1e-15)
    np.testing.assert_allclose(terms[1, 1], [0.0, -(w2**2), 0.0], atol=1e-15)
    np.testing.assert_allclose(terms[0, 1] + terms[1, 0], [0.0, -2 * w1 * w2, 0.0], atol=1e-15)


def test_equation_8_12_with_other_lengths() -> None:
    arm, (q1, q2), (w1, w2) = planar_2r_arm(Planar2R(lengths=(0.6, 1.1))), (0.4, -1.9), (1.2, 2.3)
    total = tip_acceleration_terms(arm, [q1, q2], [w1, w2]).sum(axis=(0, 1))
    both = q1 + q2
    wanted = [-0.6 * w1**2 * np.cos(q1) - 1.1 * (w1 + w2) ** 2 * np.cos(both),
              -0.6 * w1**2 * np.sin(q1) - 1.1 * (w1 + w2) ** 2 * np.sin(both), 0.0]  # fmt: skip
    np.testing.assert_allclose(total, wanted, atol=1e-14)


def test_skeleton() -> None:
    arm = planar_2r_arm(Planar2R(lengths=(0.6, 1.1)))
    found = skeleton(arm, [np.pi / 2, -np.pi / 2])
    np.testing.assert_allclose(found, [[0, 0, 0], [0, 0.6, 0], [1.1, 0.6, 0]], atol=1e-15)
    wild = random_arm(93, EVERY_JOINT)
    q, _, _ = motion(93, wild.n, 3)
    np.testing.assert_allclose(skeleton(wild, np.zeros(6))[:-1], wild.joint_points, atol=1e-14)
    np.testing.assert_allclose(skeleton(wild, q)[:, -1], tip_pose(wild, q)[:, :3, 3], atol=1e-15)
    # The first joint's point is on its own axis, so for a revolute joint it does not move.
    np.testing.assert_allclose(skeleton(wild, q)[:, 0], np.tile(wild.joint_points[0], (3, 1)), atol=1e-14)
