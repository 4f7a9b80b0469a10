"""Twists and wrenches: re-expressed in another frame, and the bracket that differentiates them."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.spatial.poses import adjoint, inverse_pose
from drivetrain.spatial.rotations import skew


def bracket(twist: Any) -> Array:
    """The matrix that takes the Lie bracket with a twist from the left; its negative transpose does so for wrenches.

    Args:
        twist: (angular [rad/s], linear [m/s]), (6,).

    Returns:
        (6, 6): ``bracket(V1) @ V2`` is the rate at which V2, fixed in a body that moves with V1, changes.

    Reference: Modern Robotics, definition 8.3.
    """
    v = checked_array(twist, (6,), "twist")
    turn = skew(v[:3])
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = turn
    result[3:, :3] = skew(v[3:])
    return result


def transform_twist(pose_a_b: Any, twist: Any) -> Array:
    """A twist given in frame b, as seen in frame a.

    Args:
        pose_a_b: Pose of b in a, (4, 4); translation [m].
        twist: (angular [rad/s], linear [m/s]) in b, (6,).

    Returns:
        The twist in a, (6,).

    Reference: Modern Robotics, definition 3.20.
    """
    return np.asarray(adjoint(pose_a_b) @ checked_array(twist, (6,), "twist"))


def transform_wrench(pose_a_b: Any, wrench: Any) -> Array:
    """A wrench given in frame b, as seen in frame a: the moment is then about the origin of a.

    Args:
        pose_a_b: Pose of b in a, (4, 4); translation [m].
        wrench: (moment [N m], force [N]) in b, (6,).

    Returns:
        The wrench in a, (6,); its power with any twist is what it was.

    Reference: Modern Robotics, equation 3.98.
    """
    return np.asarray(adjoint(inverse_pose(pose_a_b)).T @ checked_array(wrench, (6,), "wrench"))
