"""What a set of points leaves open: the zones in which a further point would be dominated by none of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array


class Zones:
    """Points of which none dominates another, all criteria to be small, and the corners of what they leave open.

    A new point is dominated by no point (nor equal to one) exactly when it lies below some corner in every criterion.

    Attributes:
        points: In the order of their coming, dominated ones taken out, (M, p).
        keys: Of the points, in the same order.
        corners: Upper corners of the zones, (Z, p).

    Reference:
        Klamroth, Lacour and Vanderpooten, "On the representation of the search region in multi-objective
        optimization", European Journal of Operational Research 245 (2015): local upper bounds and their update.
    """

    def __init__(self, highest: Array, tolerance: float) -> None:
        self.points = np.zeros((0, len(highest)))
        self.keys: list[tuple[int, ...]] = []
        self.corners = np.array([highest], dtype=np.float64)
        self._tolerance = tolerance
        self._highest = np.asarray(highest, dtype=np.float64)

    def offer(self, point: Array, key: tuple[int, ...]) -> bool:
        """Take a point in, if no other matches it.

        Args:
            point: (p,).
            key: What it stands for.

        Returns:
            Whether it was taken; those that it dominates are out then.
        """
        slack = self._tolerance * np.maximum(np.abs(point), 1e-300)
        if len(self.points) and bool((self.points <= point + slack).all(axis=1).any()):
            return False
        beaten = (point <= self.points + slack).all(axis=1)
        self.points = np.vstack([self.points[~beaten], point])
        self.keys = [old for old, out in zip(self.keys, np.atleast_1d(beaten), strict=True) if not out] + [key]
        self._cut(point)
        return True

    def _cut(self, point: Array) -> None:
        """Replace the corners above a point by those beside it."""
        above = (self.corners > point).all(axis=1)
        cut, kept = self.corners[above], self.corners[~above]
        if not len(cut):
            return
        new = []
        for axis in range(len(point)):
            beside = cut.copy()
            beside[:, axis] = point[axis]
            new.append(beside)
        fresh = np.unique(np.vstack(new), axis=0)
        fresh = fresh[_largest(fresh, kept)]
        self.corners = np.vstack([kept, fresh])


def _largest(corners: Array, others: Array) -> NDArray[np.bool_]:
    """Which corners lie below no other: only those bound a zone of their own."""
    every = np.vstack([corners, others])
    found = np.ones(len(corners), dtype=bool)
    for index, corner in enumerate(corners):
        below = (every >= corner).all(axis=1)
        below[index] = False
        found[index] = not below.any()
    return found
