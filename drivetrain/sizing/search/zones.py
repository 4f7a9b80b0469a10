"""What a set of points leaves open: the zones in which a further point would be dominated by none of them."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.search.front_prune import fresh_corners


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
        """
        if self.matched(point):
            return False
        slack = self._tolerance * np.maximum(np.abs(point), 1e-300)
        beaten = (point <= self.points + slack).all(axis=1)
        self.points = np.vstack([self.points[~beaten], point])
        self.keys = [old for old, out in zip(self.keys, np.atleast_1d(beaten), strict=True) if not out] + [key]
        self._cut(point)
        return True

    def matched(self, point: Array) -> bool:
        """Whether a point of the front is no worse than another one in any criterion.

        Args:
            point: (p,).
        """
        slack = self._tolerance * np.maximum(np.abs(point), 1e-300)
        return bool(len(self.points) and (self.points <= point + slack).all(axis=1).any())

    def copied(self) -> Zones:
        """The same zones, to go on without touching these."""
        other = Zones(self._highest, self._tolerance)
        other.points, other.keys, other.corners = self.points, list(self.keys), self.corners
        return other

    def _cut(self, point: Array) -> None:
        """Replace the corners above a point by those beside it."""
        above = (self.corners > point).all(axis=1)
        if not above.any():
            return
        near = (self.corners >= point).all(axis=1) & ~above
        fresh = fresh_corners(self.corners[above], point, self.corners[near])
        self.corners = np.vstack([self.corners[~above], fresh])
