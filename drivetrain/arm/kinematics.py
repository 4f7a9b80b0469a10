"""Kinematics of links and tip: poses, Jacobians and their rates by products of exponentials, over batches.

Erratum of the book: exercise 8.6, on the derivatives of the Jacobians, gives ``dJ_i/dtheta_j = ad_Ji(J_j)`` for both.
This is right for the body Jacobian (i < j). For the space Jacobian (i > j) the sign is wrong: joint j moves axis i,
which gives ``ad_Jj(J_i) = -ad_Ji(J_j)``.

Reference: Modern Robotics, chapters 4 and 5, exercise 8.6.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arrays import Array, finite_samples


def link_poses(arm: Arm, q: Any) -> Array:
    """Poses of the links' centre-of-mass frames in the base frame.

    Args:
        arm: The arm.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Poses [m], (n, 4, 4) or (N, n, 4, 4).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equation 4.14.
    """
    moved = displacements(arm, q)[:, 1:] @ arm.home
    return moved if np.ndim(q) == 2 else moved[0]


def tip_pose(arm: Arm, q: Any) -> Array:
    """Pose of the tip in the base frame.

    Args:
        arm: The arm.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Pose [m], (4, 4) or (N, 4, 4).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equation 4.14.
    """
    moved = displacements(arm, q)[:, -1] @ arm.tip
    return moved if np.ndim(q) == 2 else moved[0]


def space_jacobian(arm: Arm, q: Any) -> Array:
    """The matrix that takes joint rates to the twist of the tip, in the base frame.

    Args:
        arm: The arm.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Columns (angular [-], linear [m or -]) a joint, (6, n) or (N, 6, n).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equation 5.11.
    """
    columns = screw_columns(displacements(arm, q)[:, :-1], arm.screws)
    return columns if np.ndim(q) == 2 else columns[0]


def body_jacobian(arm: Arm, q: Any) -> Array:
    """The matrix that takes joint rates to the twist of the tip, in the tip frame.

    Args:
        arm: The arm.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Columns (angular [-], linear [m or -]) a joint, (6, n) or (N, 6, n).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equation 5.18.
    """
    moved = displacements(arm, q)
    space = screw_columns(moved[:, :-1], arm.screws)
    tips = moved[:, -1] @ arm.tip
    turned, place = np.swapaxes(tips[:, :3, :3], 1, 2), tips[:, :3, 3, None]
    columns = np.empty_like(space)
    columns[:, :3] = turned @ space[:, :3]
    columns[:, 3:] = turned @ (space[:, 3:] - _cross(place, space[:, :3]))
    return columns if np.ndim(q) == 2 else columns[0]


def displacements(arm: Arm, q: Any) -> Array:
    """Displacements of base, link 0, link 1, ... from their poses with all joints at zero, (N, n + 1, 4, 4)."""
    refuse_loops(arm)
    (positions,) = finite_samples(arm.n, {"q": q})
    result = np.empty((len(positions), arm.n + 1, 4, 4))
    result[:, 0] = np.eye(4)
    for i, screw in enumerate(arm.screws):
        result[:, i + 1] = result[:, i] @ screw_displacements(screw, positions[:, i])
    return result


def screw_displacements(screw: Array, angles: Array) -> Array:
    """Exponentials of one screw, (N, 4, 4) [m]; Modern Robotics, proposition 3.25."""
    axis, linear = screw[:3], screw[3:]
    result = np.zeros((len(angles), 4, 4))
    result[:, 3, 3] = 1.0
    if not axis.any():
        result[:, :3, :3] = np.eye(3)
        result[:, :3, 3] = angles[:, None] * linear
        return result
    x, y, z = axis
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rest = 2.0 * np.sin(0.5 * angles) ** 2  # 1 - cos would cancel
    rotation = np.sin(angles)[:, None, None] * turn + rest[:, None, None] * (turn @ turn)
    result[:, :3, :3] = np.eye(3) + rotation
    # The point of the axis does not move except by the pitch.
    result[:, :3, 3] = -rotation @ (turn @ linear) + angles[:, None] * (float(axis @ linear) * axis)
    return result


def screw_columns(displacements: Array, screws: Array) -> Array:
    """Screws transformed by the displacements, as columns, (N, 6, n)."""
    rotation, place = displacements[..., :3, :3], displacements[..., :3, 3]
    angular = np.swapaxes((rotation @ screws[:, :3, None])[..., 0], 1, 2)
    linear = np.swapaxes((rotation @ screws[:, 3:, None])[..., 0], 1, 2) + _cross(np.swapaxes(place, 1, 2), angular)
    return np.concatenate([angular, linear], axis=1)


def space_jacobian_rate(arm: Arm, q: Any, qd: Any) -> Array:
    """The time derivative of the space Jacobian.

    Args:
        arm: The arm.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        Columns (angular [1/s], linear [m/s or 1/s]) a joint, (6, n) or (N, 6, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.6 (a), with the sign corrected.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    columns = space_jacobian(arm, positions)
    moved = columns * speeds[:, None]
    # the twist of the link before each joint, with which the joint's axis moves
    before = np.cumsum(moved, axis=2) - moved
    rate = _brackets(before, columns)
    return rate if np.ndim(q) == 2 else rate[0]


def body_jacobian_rate(arm: Arm, q: Any, qd: Any) -> Array:
    """The time derivative of the body Jacobian.

    Args:
        arm: The arm.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        Columns (angular [1/s], linear [m/s or 1/s]) a joint, (6, n) or (N, 6, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.6 (b).
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    columns = body_jacobian(arm, positions)
    moved = columns * speeds[:, None]
    # the twist of the tip relative to the link after each joint
    after = np.cumsum(moved[:, :, ::-1], axis=2)[:, :, ::-1] - moved
    rate = _brackets(columns, after)
    return rate if np.ndim(q) == 2 else rate[0]


def _brackets(a: Array, b: Array) -> Array:
    """Lie brackets of twists, column by column, (N, 6, n)."""
    angular = _cross(a[:, :3], b[:, :3])
    linear = _cross(a[:, 3:], b[:, :3]) + _cross(a[:, :3], b[:, 3:])
    return np.concatenate([angular, linear], axis=1)


def tip_jacobian(arm: Arm, q: Any) -> Array:
    """The matrix from joint rates to the angular velocity of the tip and the velocity of its origin, in base axes.

    The linear part of ``space_jacobian`` is instead the velocity of that point of the tip's body that coincides with
    the origin of the base.

    Columns (angular [-], linear [m or -]) per joint, (6, n) or (N, 6, n).

    Reference: Modern Robotics, the J of equation 8.20 for any arm.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    columns = tip_pose_and_jacobian(arm, positions)[1]
    return columns if np.ndim(q) == 2 else columns[0]


def tip_pose_and_jacobian(arm: Arm, q: Array) -> tuple[Array, Array]:
    """``tip_pose`` and ``tip_jacobian`` of a batch, (N, 4, 4) and (N, 6, n)."""
    moved = displacements(arm, q)
    poses, columns = moved[:, -1] @ arm.tip, screw_columns(moved[:, :-1], arm.screws)
    columns[:, 3:] -= _cross(poses[:, :3, 3, None], columns[:, :3])
    return poses, columns


def tip_jacobian_rate(jacobian: Array, qd: Array) -> Array:
    """The time derivative of ``tip_jacobian`` (argument ``jacobian``), (N, 6, n)."""
    moved = jacobian * qd[:, None]
    until = np.cumsum(moved, axis=2)
    after = until[:, 3:, -1:] - until[:, 3:]
    # a joint rotates all joints after it, and these move the tip relative to its axis
    angular = _cross(until[:, :3], jacobian[:, :3])
    linear = _cross(until[:, :3], jacobian[:, 3:]) + _cross(jacobian[:, :3], after)
    return np.concatenate([angular, linear], axis=1)


def _cross(a: Array, b: Array) -> Array:
    """Cross products along the second axis, (N, 3, ...); numpy's takes ten times as long for one sample."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def tip_acceleration_terms(arm: Arm, q: Any, qd: Any) -> Array:
    """Accelerations of the tip at constant joint speeds, one for each pair of joints.

    Entry j, j is the centripetal acceleration due to joint j; the sum of entries j, k and k, j is the Coriolis
    acceleration of that pair. The sum of all entries is the acceleration of the tip when no joint accelerates.

    Args:
        arm: Arm with n joints.
        q: Joint positions [rad or m], (n,) or (N, n).
        qd: Joint speeds [rad/s or m/s], as q.

    Returns:
        Accelerations in base axes [m/s^2], (n, n, 3) or (N, n, n, 3), symmetric in j and k.

    Reference: Modern Robotics, equation 8.12 and figure 8.2, for any arm.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    jacobian = tip_jacobian(arm, positions)
    angular, linear = np.swapaxes(jacobian[:, :3], 1, 2), np.swapaxes(jacobian[:, 3:], 1, 2)
    # joint j rotates the contributions of the joints from j on: d(J_k)/dq_j = w_j x J_k for j <= k
    turned = np.cross(angular[:, :, None], linear[:, None, :])
    earlier = np.triu(np.ones((arm.n, arm.n)))[:, :, None]
    later = np.triu(np.ones((arm.n, arm.n)), 1)[:, :, None]
    slopes = turned * earlier + np.swapaxes(turned * later, 1, 2)
    terms = slopes * (speeds[:, :, None] * speeds[:, None, :])[..., None]
    return np.asarray(terms if np.ndim(q) == 2 else terms[0])


def skeleton(arm: Arm, q: Any) -> Array:
    """Corners of the arm as a stick figure: its ``joint_points``, then the tip [m], (n + 1, 3) or (N, n + 1, 3)."""
    (positions,) = finite_samples(arm.n, {"q": q})
    poses = link_poses(arm, positions)
    turn, centre = arm.home[:, :3, :3], arm.home[:, :3, 3]
    local = np.einsum("iba,ib->ia", turn, arm.joint_points - centre)
    joints = np.einsum("niab,ib->nia", poses[..., :3, :3], local) + poses[..., :3, 3]
    corners = np.concatenate([joints, tip_pose(arm, positions)[:, None, :3, 3]], axis=1)
    return np.asarray(corners if np.ndim(q) == 2 else corners[0])
