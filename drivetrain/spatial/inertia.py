"""Rigid-body inertia: moved, turned, added, and tested for whether any body could have it."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.spatial.rotations import skew


def parallel_axis(mass: float, offset: Any) -> Array:
    """The inertia that a point mass has about a point at an offset: what Steiner's rule adds.

    Args:
        mass: [kg], negative to take away.
        offset: From the point to the mass, or back [m], (3,).

    Returns:
        [kg m^2], (3, 3).

    Reference: Modern Robotics, equation 8.28.
    """
    cross = skew(offset)
    return np.asarray(-mass * (cross @ cross))


def triangle_excess(inertia: Any) -> float:
    """By how much the largest principal moment passes the sum of the two others, as a share of their total.

    No distribution of mass has a positive value. The same number, with the opposite sign, is the smallest eigenvalue
    of ``0.5 trace(I) E - I`` over half the trace: the second moment of the mass along the thinnest direction. A test
    of the diagonal entries alone misses a third of the impossible tensors.

    Args:
        inertia: About the centre of mass [kg m^2], (3, 3), symmetric.

    Returns:
        Excess [-]; 0 for a flat plate, -1/3 for a sphere, infinite when the trace is not positive but the tensor is
        not zero, and -1/3 for a point mass (zero tensor).

    Reference: Modern Robotics, section 8.2.1; Wensing, Kim, Slotine, RA-L 3 (2018) 60-67, equation 13.
    """
    tensor = checked_array(inertia, (3, 3), "inertia")
    if not tensor.any():
        return -1.0 / 3.0
    moments = np.linalg.eigvalsh(tensor)
    total = float(moments.sum())
    if total <= 0.0:
        return float("inf")
    return float(2.0 * moments[2] - total) / total
