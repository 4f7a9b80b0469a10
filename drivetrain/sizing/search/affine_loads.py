"""Loads of a joint that are linear in the load parameters of drives, and their intervals over ranges of parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, Indices
from drivetrain.sizing.demand.load_basis import PARAMETERS
from drivetrain.sizing.search.bounds import load_interval


class AffineLoads(NamedTuple):
    """Loads of a joint at some samples that are linear in the load parameters of K drives: base + parameters @ unit."""

    base: Array  # without drives, (..., M); (0,) where the load is not needed
    unit: Array  # load per unit of each parameter of each drive, (K, PARAMETERS, size of base)
    drives: Indices  # joints of the drives, the joint's own last if it counts, (K,)

    def bounds(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Interval of the loads, shaped as ``base``; low, high: parameter ranges of all drives, (n, PARAMETERS)."""
        ends, half = np.empty((2, *self.base.shape)), np.empty(self.unit.shape[:2])
        bottom, top = ends.reshape(2, -1)
        load_interval(self.base.ravel(), self.unit, low[self.drives], high[self.drives], bottom, top, half)
        return ends[0], ends[1]

    def min_magnitude(self, low: Array, high: Array) -> Array:
        """Smallest magnitudes within the interval, shaped as ``base``."""
        bottom, top = self.bounds(low, high)
        return min_magnitude(bottom, top)


def affine_loads(base: Array, unit: Array, drives: Sequence[int]) -> AffineLoads:
    """Affine loads; ``unit`` holds PARAMETERS rows of the shape of ``base`` for each of the drives that has any."""
    count = len(unit) // PARAMETERS
    unit = np.ascontiguousarray(unit).reshape(count, PARAMETERS, base.size)
    return AffineLoads(np.ascontiguousarray(base), unit, np.array(drives[:count], dtype=np.int64))


NO_LOADS = AffineLoads(np.zeros(0), np.zeros((0, PARAMETERS, 0)), np.zeros(0, dtype=np.int64))


def bearing_loads(wrench: Array) -> tuple[Array, Array, Array]:
    """Tilting moment [N m], axial and radial load [N] of wrenches (6, N), (N,) each."""
    tilting, radial = (np.sqrt(x * x + y * y) for x, y in (wrench[:2], wrench[3:5]))  # np.hypot takes ten times longer
    return tilting, np.abs(wrench[5]), radial


def min_magnitude(low: Array, high: Array) -> Array:
    """Smallest magnitude within intervals."""
    return np.maximum(np.maximum(low, -high), 0.0)


def min_cross(low: Array, high: Array) -> Array:
    """Smallest |mx fy - my fx| of wrenches within an interval, (N,)."""
    ends = low, high
    one, other = (np.array([a[i] * b[j] for a in ends for b in ends]) for i, j in ((0, 4), (1, 3)))
    return min_magnitude(one.min(axis=0) - other.max(axis=0), one.max(axis=0) - other.min(axis=0))
