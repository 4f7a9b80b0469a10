"""What a set of points leaves open: the zones in which a further point would be dominated by none of them.

Of candidates at every joint it is told which can be part of a set that reaches a zone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel
from drivetrain.sizing.search.domains import Mask


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
        """Take a point in, if no other matches it; point: (p,)."""
        if self.matched(point):
            return False
        slack = self._tolerance * np.maximum(np.abs(point), 1e-300)
        beaten = (point <= self.points + slack).all(axis=1)
        self.points = np.vstack([self.points[~beaten], point])
        self.keys = [old for old, out in zip(self.keys, np.atleast_1d(beaten), strict=True) if not out] + [key]
        self._cut(point)
        return True

    def matched(self, point: Array) -> bool:
        """Whether a point of the front is no worse than another one in any criterion; point: (p,)."""
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
        fresh = _fresh_corners(self.corners[above], point, self.corners[near])
        self.corners = np.vstack([self.corners[~above], fresh])


def _fresh_corners(cut: Array, point: Array, near: Array) -> Array:
    """The corners that take the place of those a point cuts off, without those that lie below another.

    Args:
        cut: Corners above the point in every criterion, (C, p).
        point: (p,).
        near: Corners that share a number with the point and lie above it in all others, (B, p).

    Reference:
        Klamroth, Lacour and Vanderpooten, European Journal of Operational Research 245 (2015) 767, algorithm 3: only
        corners with the point's number on the same axis can make one of no use.
    """
    parts, count = [], len(cut)
    for axis in range(len(point)):
        own = np.delete(cut, axis, axis=1)
        beside = np.delete(near[near[:, axis] == point[axis]], axis, axis=1)
        others = np.vstack([own, beside])
        above, same = ((op(others, own[:, np.newaxis])).all(axis=2) for op in (np.greater_equal, np.equal))
        place = np.arange(len(others))
        first = (place < np.arange(count)[:, np.newaxis]) | (place >= count)  # of those that are the same one stays
        fresh = cut[~(above & (~same | first)).any(axis=1)].copy()
        fresh[:, axis] = point[axis]
        parts.append(fresh)
    return np.vstack(parts)


def survivors(
    values: Sequence[Array], used: Sequence[Array], corners: Array, heights: Array
) -> tuple[list[Mask], Array, float] | None:
    """Which candidates may be part of a set that reaches a zone; n joints, K candidates each, W weightings, Z zones.

    Args:
        values: Weighted costs at least, (K, W) a joint.
        used: Least utilisation, (K,) a joint.
        corners: Weighted corners of the zones, (Z, W).
        heights: Their utilisation, infinite where it is not compared, (Z,).

    Returns:
        Masks by joint, the least of each weighting, (W,), and of utilisation; None where no zone can be reached.
    """
    total, lowest = np.sum([one.min(axis=0) for one in values], axis=0), max(float(one.min()) for one in used)
    near = (total < corners).all(axis=1) & (lowest < heights)
    corners, heights = corners[near], heights[near]
    least, alive = [], np.ones(len(heights), dtype=np.bool_)
    for value, use in zip(values, used, strict=True):  # by candidates that stay below a zone's utilisation
        order = np.argsort(use)
        last = np.searchsorted(use[order], heights)
        alive &= last > 0
        least.append(np.minimum.accumulate(value[order], axis=0)[np.maximum(last, 1) - 1])
    room = corners - np.sum(least, axis=0)
    alive &= (room > 0.0).all(axis=1)
    masks = [
        reaching(value, use, (part + room)[alive], heights[alive])
        for value, use, part in zip(values, used, least, strict=True)
    ]
    return (masks, total, lowest) if all(mask.any() for mask in masks) else None


@kernel
def reaching(values: Array, used: Array, corners: Array, heights: Array) -> Mask:
    """Which rows lie below some corner in every weighting and in utilisation; (K, W), (K,), (Z, W), (Z,)."""
    kept, last = np.zeros(len(used), dtype=np.bool_), 0
    for at in range(len(used)):
        for step in range(len(heights)):
            zone = (last + step) % len(heights)  # neighbours reach the same zone more often than not
            inside = used[at] < heights[zone]
            for w in range(values.shape[1]):
                if not inside:
                    break
                inside = values[at, w] < corners[zone, w]
            if inside:
                kept[at], last = True, zone
                break
    return kept
