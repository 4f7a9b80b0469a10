"""Lie brackets of twists and wrenches, and batches of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array, batch, checked_array
from drivetrain.errors import Fault, raise_faults
from drivetrain.spatial.rotations import skew


def bracket(twist: Any) -> Array:
    """The matrix ad_V of the Lie bracket with a twist, (6, 6); its negative transpose is that for wrenches.

    ``bracket(V1) @ V2`` is the rate of change of V2, fixed in a body that moves with V1.

    Reference: Modern Robotics, definition 8.3.
    """
    v = checked_array(twist, (6,), "twist")
    turn = skew(v[:3])
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = turn
    result[3:, :3] = skew(v[3:])
    return result


def lie_bracket(first: Any, second: Any) -> Array:
    """The Lie bracket of two twists: the rate of change of the second, fixed in a body that moves with the first.

    ``bracket(first) @ second``, (6,) or (N, 6). It is bilinear and antisymmetric, and satisfies the Jacobi identity:
    the cyclic sum of ``[a, [b, c]]`` is zero.

    Reference: Modern Robotics, definition 8.3; exercise 8.5 for the identity.
    """
    a, b = same_batches(first=first, second=second)
    angular = np.cross(a[:, :3], b[:, :3])
    linear = np.cross(a[:, 3:], b[:, :3]) + np.cross(a[:, :3], b[:, 3:])
    return like(np.hstack([angular, linear]), first)


def dual_bracket(twist: Any, wrench: Any) -> Array:
    """``bracket(twist).T @ wrench`` for a wrench in the moving frame; Modern Robotics, equation 8.39."""
    v, f = same_batches(twist=twist, wrench=wrench)
    moment = np.cross(f[:, :3], v[:, :3]) + np.cross(f[:, 3:], v[:, 3:])
    return like(np.hstack([moment, np.cross(f[:, 3:], v[:, :3])]), twist)


def turned(rotation: Array, rows: Array) -> Array:
    """Twists or wrenches about the same point in turned axes: both parts multiplied by rotations (N, 3, 3), (N, 6)."""
    return np.asarray((rows.reshape(-1, 2, 3) @ np.swapaxes(rotation, 1, 2)).reshape(-1, 6))


def same_batches(**named: Any) -> list[Array]:
    """Twists or wrenches of one shape, (6,) or (N, 6), as batches (N, 6), with N = 1 for one sample."""
    arrays = [batch(value, 6, name) for name, value in named.items()]
    lead, first = next(iter(named.items()))
    raise_faults(
        Fault(name, f"must have the shape of {lead}, {np.shape(first)}", f"shape {np.shape(value)}")
        for name, value in named.items()
        if np.shape(value) != np.shape(first)
    )
    return arrays


def like(rows: Array, given: Any) -> Array:
    """A batch in the shape of ``given``: its only row if one sample was given."""
    return rows if np.ndim(given) == 2 else np.asarray(rows[0])
