"""Twists and wrenches: re-expressed in another frame, and the bracket that differentiates them."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array, batch, checked_array
from drivetrain.errors import Fault, raise_faults
from drivetrain.spatial.rotations import skew


def bracket(twist: Any) -> Array:
    """The matrix that takes the Lie bracket with a twist from the left; its negative transpose does so for wrenches.

    (6, 6): ``bracket(V1) @ V2`` is the rate at which V2, fixed in a body that moves with V1, changes.

    Reference: Modern Robotics, definition 8.3.
    """
    v = checked_array(twist, (6,), "twist")
    turn = skew(v[:3])
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = turn
    result[3:, :3] = skew(v[3:])
    return result


def lie_bracket(first: Any, second: Any) -> Array:
    """The Lie bracket of two twists: the rate at which the second, fixed in a body that moves with the first, changes.

    ``bracket(first) @ second``, (6,) or (N, 6). It is bilinear and antisymmetric, and obeys Jacobi's identity:
    the cyclic sum of ``[a, [b, c]]`` vanishes.

    Reference: Modern Robotics, definition 8.3; exercise 8.5 for the identity.
    """
    a, b = same_batches(6, {"first": first, "second": second})
    angular = np.cross(a[:, :3], b[:, :3])
    linear = np.cross(a[:, 3:], b[:, :3]) + np.cross(a[:, :3], b[:, 3:])
    return like(np.hstack([angular, linear]), first)


def dual_bracket(twist: Any, wrench: Any) -> Array:
    """``bracket(twist).T @ wrench``, of a wrench in the frame that moves; Modern Robotics, equation 8.39."""
    v, f = same_batches(6, {"twist": twist, "wrench": wrench})
    moment = np.cross(f[:, :3], v[:, :3]) + np.cross(f[:, 3:], v[:, 3:])
    return like(np.hstack([moment, np.cross(f[:, 3:], v[:, :3])]), twist)


def same_batches(width: int, named: dict[str, Any]) -> list[Array]:
    """Samples or batches of one shape, each as a batch (N, width); N = 1 for one sample."""
    arrays = [batch(value, width, name) for name, value in named.items()]
    lead, first = next(iter(named.items()))
    raise_faults(
        Fault(name, f"must have the shape of {lead}, {np.shape(first)}", f"shape {np.shape(value)}")
        for name, value in named.items()
        if np.shape(value) != np.shape(first)
    )
    return arrays


def like(rows: Array, given: Any) -> Array:
    """A batch as it came in: its only row where one sample was given."""
    return rows if np.ndim(given) == 2 else np.asarray(rows[0])
