"""How fast the tip's Jacobians change: exercise 8.6.

Where the book slips: it writes ``dJ_i/dtheta_j = ad_Ji(J_j)`` for both Jacobians. That is right for the body Jacobian
(i < j). For the space Jacobian (i > j) it has the wrong sign: joint j carries axis i along, which makes it
``ad_Jj(J_i) = -ad_Ji(J_j)``.

Reference: Modern Robotics, exercise 8.6.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.doors import finite_samples
from drivetrain.dynamics.kinematics import body_jacobian, space_jacobian


def space_jacobian_rate(arm: Arm, q: Any, qd: Any) -> Array:
    """The time derivative of the space Jacobian.

    Args:
        arm: The arm.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        Columns (angular [1/s], linear [m/s or 1/s]) a joint, (6, n) or (N, 6, n).

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.6 (a), its sign put right.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    columns = space_jacobian(arm, positions)
    moved = columns * speeds[:, None]
    # The twist of the link before each joint, which carries the joint's axis along.
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
    # The twist of the tip against the link after each joint.
    after = np.cumsum(moved[:, :, ::-1], axis=2)[:, :, ::-1] - moved
    rate = _brackets(columns, after)
    return rate if np.ndim(q) == 2 else rate[0]


def _brackets(a: Array, b: Array) -> Array:
    """Lie brackets of twists, column by column, (N, 6, n)."""
    angular = np.cross(a[:, :3], b[:, :3], axis=1)
    linear = np.cross(a[:, 3:], b[:, :3], axis=1) + np.cross(a[:, :3], b[:, 3:], axis=1)
    return np.concatenate([angular, linear], axis=1)
