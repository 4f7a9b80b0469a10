"""Where the links and the tip are, and how they move: products of exponentials, over batches.

Reference: Modern Robotics, chapters 4 and 5.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.doors import finite_samples


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
    moved = _displacements(arm, q)[:, 1:] @ arm.home
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
    moved = _displacements(arm, q)[:, -1] @ arm.tip
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
    columns = _columns(_displacements(arm, q)[:, :-1], arm.screws)
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
    moved = _displacements(arm, q)
    space = _columns(moved[:, :-1], arm.screws)
    tips = moved[:, -1] @ arm.tip
    turned, place = np.swapaxes(tips[:, :3, :3], 1, 2), tips[:, :3, 3, None]
    columns = np.empty_like(space)
    columns[:, :3] = turned @ space[:, :3]
    columns[:, 3:] = turned @ (space[:, 3:] - np.cross(place, space[:, :3], axis=1))
    return columns if np.ndim(q) == 2 else columns[0]


def _displacements(arm: Arm, q: Any) -> Array:
    """How base, link 0, link 1, ... have moved since the joints were at zero, (N, n + 1, 4, 4)."""
    (positions,) = finite_samples(arm.n, {"q": q})
    result = np.empty((len(positions), arm.n + 1, 4, 4))
    result[:, 0] = np.eye(4)
    for i, screw in enumerate(arm.screws):
        result[:, i + 1] = result[:, i] @ screw_displacements(screw, positions[:, i])
    return result


def screw_displacements(screw: Array, angles: Array) -> Array:
    """The displacements along one screw: its exponentials.

    Args:
        screw: Unit, (angular [-], linear [m or -]), (6,).
        angles: How far [rad, or m where the angular part is zero], (N,).

    Returns:
        Homogeneous matrices, translation [m], (N, 4, 4).
    Reference: Modern Robotics, proposition 3.25.
    """
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
    # The point of the axis stays, but for the pitch.
    result[:, :3, 3] = -rotation @ np.cross(axis, linear) + angles[:, None] * (float(axis @ linear) * axis)
    return result


def _columns(displacements: Array, screws: Array) -> Array:
    """Screws carried along with displacements, as columns, (N, 6, n)."""
    rotation, place = displacements[..., :3, :3], displacements[..., :3, 3]
    angular = (rotation @ screws[:, :3, None])[..., 0]
    linear = (rotation @ screws[:, 3:, None])[..., 0] + np.cross(place, angular)
    return np.swapaxes(np.concatenate([angular, linear], axis=-1), 1, 2)
