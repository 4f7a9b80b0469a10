"""The mass matrix: column by column, the torques of a unit acceleration. Its rotors are those of the recursion."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.doors import finite_samples, run
from drivetrain.dynamics.packed import Packed, packed

CHUNK = 2048  # samples; bounds the memory that their n unit accelerations take


def mass_matrix(arm: Arm, q: Any) -> Array:
    """The matrix M of ``torque = M(q) qdd + ...``, rotors included.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).

    Returns:
        M [kg m^2; kg m and kg where joints are prismatic], (n, n) or (N, n, n), exactly symmetric. Row i belongs to
        ``ratio_i`` times the torque of motor i.

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, section 8.3.2 (columns by inverse dynamics), with the rotors of section 8.9.3.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    result = mass_matrices(packed(arm), positions)
    return result if np.ndim(q) == 2 else result[0]


def mass_matrices(model: Packed, q: Array) -> Array:
    """Mass matrices for samples that have been checked.

    Args:
        model: The arm.
        q: Positions [rad or m], (N, n), C order.

    Returns:
        M [kg m^2, kg m or kg], (N, n, n), exactly symmetric.
    """
    count, n = q.shape
    result = np.empty((count, n, n))
    weightless = np.zeros(3)
    for first in range(0, count, CHUNK):
        some = q[first : first + CHUNK]
        repeated = np.repeat(some, n, axis=0)
        units = np.tile(np.eye(n), (len(some), 1))
        columns = run(model, (repeated, np.zeros(repeated.shape), units), gravity=weightless)
        result[first : first + CHUNK] = columns.reshape(-1, n, n)
    result += np.swapaxes(result, 1, 2).copy()
    result *= 0.5
    return result
