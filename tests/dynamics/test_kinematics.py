"""Poses and Jacobians against matrix exponentials, differences and each other."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm
from scipy.linalg import expm

from drivetrain.arm.kinematics import body_jacobian, link_poses, space_jacobian, tip_pose


def bracket(twist: np.ndarray) -> np.ndarray:
    (x, y, z), v = twist[:3], twist[3:]
    return np.array([[0, -z, y, v[0]], [z, 0, -x, v[1]], [-y, x, 0, v[2]], [0, 0, 0, 0]])


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "H"])
def test_poses_are_products_of_exponentials(joints: str) -> None:
    arm = random_arm(60, joints)
    q, _, _ = motion(60, arm.n)
    for k, sample in enumerate(q):
        moved = np.eye(4)
        for i in range(arm.n):
            moved = moved @ expm(bracket(arm.screws[i]) * sample[i])
            assert error(link_poses(arm, q)[k, i], moved @ arm.home[i]) < 1e-13
        assert error(tip_pose(arm, sample), moved @ arm.tip) < 1e-13


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
def test_jacobians_are_rates_of_the_pose(joints: str) -> None:
    arm = random_arm(61, joints)
    q, qd, _ = motion(61, arm.n)
    h = 1e-4
    steps = [tip_pose(arm, q + k * h * qd) for k in (-2, -1, 1, 2)]
    rate = (steps[0] - 8 * steps[1] + 8 * steps[2] - steps[3]) / (12 * h)
    inverse = np.linalg.inv(tip_pose(arm, q))
    for k in range(len(q)):
        # Fourth-order differences with a step of 1e-4: 1e-11 of rounding, less of truncation.
        assert error(bracket(space_jacobian(arm, q)[k] @ qd[k]), rate[k] @ inverse[k]) < 1e-9
        assert error(bracket(body_jacobian(arm, q)[k] @ qd[k]), inverse[k] @ rate[k]) < 1e-9
