"""How the tip moves as a point: its Jacobian along the base's axes, its centripetal and Coriolis accelerations."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.doors import finite_samples
from drivetrain.dynamics.kinematics import link_poses, space_jacobian, tip_pose


def tip_jacobian(arm: Arm, q: Any) -> Array:
    """The matrix that takes joint rates to the angular velocity of the tip and the velocity of its origin, base axes.

    ``space_jacobian`` gives the velocity of the point of the tip's body that passes the base's origin instead.

    Args:
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Columns (angular [-], linear [m or -]) a joint, (6, n) or (N, 6, n).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, the J of equation 8.20 for any arm.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    columns = space_jacobian(arm, positions)
    place = tip_pose(arm, positions)[:, :3, 3, None]
    columns[:, 3:] -= np.cross(place, columns[:, :3], axis=1)
    return columns if np.ndim(q) == 2 else columns[0]


def tip_acceleration_terms(arm: Arm, q: Any, qd: Any) -> Array:
    """The accelerations that the tip has at constant joint speeds, one for each pair of speeds.

    Entry j, j is the centripetal acceleration by joint j alone; entries j, k and k, j together are the Coriolis
    acceleration of that pair. All entries together are the acceleration of the tip when no joint accelerates.

    Args:
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        Base axes [m/s^2], (n, n, 3) or (N, n, n, 3), symmetric in j and k.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equation 8.12 and figure 8.2, for any arm.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    jacobian = tip_jacobian(arm, positions)
    angular, linear = np.swapaxes(jacobian[:, :3], 1, 2), np.swapaxes(jacobian[:, 3:], 1, 2)
    # Joint j turns all that joints from j on do to the tip: d(J_k)/dq_j = w_j x J_k for j <= k.
    turned = np.cross(angular[:, :, None], linear[:, None, :])
    earlier = np.triu(np.ones((arm.n, arm.n)))[:, :, None]
    later = np.triu(np.ones((arm.n, arm.n)), 1)[:, :, None]
    slopes = turned * earlier + np.swapaxes(turned * later, 1, 2)
    terms = slopes * (speeds[:, :, None] * speeds[:, None, :])[..., None]
    return np.asarray(terms if np.ndim(q) == 2 else terms[0])


def skeleton(arm: Arm, q: Any) -> Array:
    """Where the joints and the tip are: the corners of the arm as a stick figure.

    Args:
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        Joints by their ``joint_points``, then the tip, base frame [m], (n + 1, 3) or (N, n + 1, 3).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    poses = link_poses(arm, positions)
    turn, centre = arm.home[:, :3, :3], arm.home[:, :3, 3]
    local = np.einsum("iba,ib->ia", turn, arm.joint_points - centre)
    joints = np.einsum("niab,ib->nia", poses[..., :3, :3], local) + poses[..., :3, 3]
    corners = np.concatenate([joints, tip_pose(arm, positions)[:, None, :3, 3]], axis=1)
    return np.asarray(corners if np.ndim(q) == 2 else corners[0])
