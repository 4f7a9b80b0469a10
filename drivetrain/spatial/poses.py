"""Poses of frames as homogeneous matrices: construction, inverse, exponential, logarithm and adjoint."""

from __future__ import annotations

from math import cos, hypot, sin
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.spatial.rotations import exp_rotation, exp_series, log_rotation, rotation_from_rpy, skew


def pose(rotation: Any | None = None, point: Any | None = None) -> Array:
    """The pose with a rotation and an origin.

    Args:
        rotation: Matrix, (3, 3); None: identity.
        point: Origin [m], (3,); None: zero.

    Returns:
        Homogeneous matrix, (4, 4).
    """
    result = np.eye(4)
    if rotation is not None:
        result[:3, :3] = checked_array(rotation, (3, 3), "rotation")
    if point is not None:
        result[:3, 3] = checked_array(point, (3,), "point")
    return result


def pose_from_xyz_rpy(xyz: Any, rpy: Any) -> Array:
    """The pose of a URDF ``origin``, (4, 4): an origin and roll, pitch, yaw about fixed axes."""
    return pose(rotation_from_rpy(rpy), xyz)


def inverse_pose(pose_a_b: Any) -> Array:
    """The pose of frame a in frame b, given that of b in a.

    Args:
        pose_a_b: Homogeneous matrix, (4, 4).

    Returns:
        Homogeneous matrix, (4, 4); translation [m].
    """
    t = checked_array(pose_a_b, (4, 4), "pose_a_b")
    back = t[:3, :3].T
    return pose(back, -back @ t[:3, 3])


def exp_pose(twist: Any) -> Array:
    """The pose reached by following a constant twist for one unit of time.

    Args:
        twist: Angular [rad] and linear [m] part, (6,).

    Returns:
        Homogeneous matrix, (4, 4).

    Reference: Modern Robotics, proposition 3.25.
    """
    v = checked_array(twist, (6,), "twist")
    turn = skew(v[:3])
    _, b, c = exp_series(hypot(*v[:3]))
    shift = v[3:] + b * (turn @ v[3:]) + c * (turn @ (turn @ v[3:]))
    return pose(exp_rotation(v[:3]), shift)


def log_pose(pose_a_b: Any) -> Array:
    """The constant twist that reaches a pose in one unit of time.

    Args:
        pose_a_b: Homogeneous matrix, (4, 4).

    Returns:
        Angular [rad] and linear [m] part, (6,); angle at most pi.

    Reference: Modern Robotics, section 3.3.3.2.
    """
    t = checked_array(pose_a_b, (4, 4), "pose_a_b")
    vector = log_rotation(t[:3, :3])
    turn = skew(vector)
    angle = hypot(*vector)
    across = turn @ t[:3, 3]
    linear = t[:3, 3] - 0.5 * across + _log_factor(angle) * (turn @ across)
    return np.concatenate([vector, linear])


def _log_factor(angle: float) -> float:
    """(1 - (x/2) cot(x/2)) / x^2, by its series for small x, where the formula would cancel."""
    square = angle * angle
    if angle < 1e-2:
        return 1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    half = 0.5 * angle
    return (1.0 - half * cos(half) / sin(half)) / square


def adjoint(pose_a_b: Any) -> Array:
    """The matrix that transforms a twist from frame b to frame a.

    Args:
        pose_a_b: Homogeneous matrix, (4, 4).

    Returns:
        (6, 6), for twists (angular, linear) [rad/s, m/s].

    Reference: Modern Robotics, definition 3.20.
    """
    t = checked_array(pose_a_b, (4, 4), "pose_a_b")
    rotation = t[:3, :3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation
    result[3:, :3] = skew(t[:3, 3]) @ rotation
    return result


def axis_screw(axis: Array, point: Array, *, slides: bool = False) -> Array:
    """The screw of a turn about a line (unit direction, point [m]), or of a travel along it, (6,)."""
    return np.concatenate([np.zeros(3), axis] if slides else [axis, np.cross(point, axis)])


def axis_point(screw: Any, near: Any) -> Array:
    """The point of a screw's axis that is nearest to a given point [m], (3,)."""
    s = checked_array(screw, (6,), "screw")
    p = checked_array(near, (3,), "near")
    on_axis = np.cross(s[:3], s[3:])
    return np.asarray(on_axis + s[:3] * float(s[:3] @ (p - on_axis)))
