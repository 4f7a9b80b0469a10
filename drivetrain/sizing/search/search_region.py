"""The search region of a multi-objective search: the part of criteria space that the sets found do not dominate.

It is a union of zones, each the points below a corner. A node of the search is closed if its lower bounds lie in no
zone; a candidate is removed if no set with it can lie in one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetrain.arrays import Array, Mask
from drivetrain.jit import kernel


class SearchRegion:
    """Nondominated points, all p criteria to be minimised, and the region of criteria space that they do not dominate.

    The region is the union of zones: all points below a corner in every criterion. The corners are the local upper
    bounds of the literature.

    Attributes:
        points: Nondominated points in the order in which they were added, (M, p).
        keys: Keys of the points, in the same order.
        corners: Upper corners of the zones, (Z, p).

    Reference:
        Klamroth, Lacour and Vanderpooten, "On the representation of the search region in multi-objective
        optimization", European Journal of Operational Research 245 (2015): local upper bounds and their update.
    """

    def __init__(self, highest: Array, tolerance: float) -> None:
        """A region without points, below the corner ``highest``, (p,); criteria within a relative ``tolerance`` are
        equal.
        """
        self.points = np.zeros((0, len(highest)))
        self.keys: list[tuple[int, ...]] = []
        self.corners = np.array([highest], dtype=np.float64)
        self._tolerance = tolerance
        self._highest = np.asarray(highest, dtype=np.float64)

    def add(self, point: Array, key: tuple[int, ...]) -> bool:
        """Add a point (p,) unless it is dominated, and remove the points that it dominates; whether it was added."""
        if self.dominates(point):
            return False
        slack = self._tolerance * np.maximum(np.abs(point), 1e-300)
        dominated = (point <= self.points + slack).all(axis=1)
        self.points = np.vstack([self.points[~dominated], point])
        kept = [old for old, out in zip(self.keys, np.atleast_1d(dominated), strict=True) if not out]
        self.keys = [*kept, key]
        self._update_corners(point)
        return True

    def dominates(self, point: Array) -> bool:
        """Whether some point of the front is no worse than a point (p,) in every criterion."""
        slack = self._tolerance * np.maximum(np.abs(point), 1e-300)
        return bool(len(self.points) and (self.points <= point + slack).all(axis=1).any())

    def copy(self) -> SearchRegion:
        other = SearchRegion(self._highest, self._tolerance)
        other.points, other.keys, other.corners = self.points, list(self.keys), self.corners
        return other

    def _update_corners(self, point: Array) -> None:
        """Replace the corners above a new point."""
        above = (self.corners > point).all(axis=1)
        if not above.any():
            return
        touching = (self.corners >= point).all(axis=1) & ~above
        fresh = _new_corners(self.corners[above], point, self.corners[touching])
        self.corners = np.vstack([self.corners[~above], fresh])


def _new_corners(above: Array, point: Array, touching: Array) -> Array:
    """The corners that replace those ``above`` a new point, without redundant ones.

    ``touching`` are the corners equal to the point in some criteria and above it in the others: only corners with the
    point's value on the same axis can make a new one redundant (Klamroth, Lacour and Vanderpooten, European Journal of
    Operational Research 245 (2015) 767, algorithm 3).
    """
    parts, count = [], len(above)
    for axis in range(len(point)):
        own = np.delete(above, axis, axis=1)
        same_value = np.delete(touching[touching[:, axis] == point[axis]], axis, axis=1)
        others = np.vstack([own, same_value])
        covers, equals = ((op(others, own[:, np.newaxis])).all(axis=2) for op in (np.greater_equal, np.equal))
        place = np.arange(len(others))
        first = (place < np.arange(count)[:, np.newaxis]) | (place >= count)  # of equal corners one is kept
        fresh = above[~(covers & (~equals | first)).any(axis=1)].copy()
        fresh[:, axis] = point[axis]
        parts.append(fresh)
    return np.vstack(parts)


def filter_candidates(
    values: Sequence[Array], used: Sequence[Array], corners: Array, caps: Array
) -> tuple[list[Mask], Array, float] | None:
    """Which candidates may be part of a set that lies in a zone, and lower bounds on each weighted sum, (W,), and on
    the utilisation; None if no zone can be reached.

    By joint, ``values`` are lower bounds on the weighted costs, (K, W), ``used`` on the utilisation, (K,). Of the
    zones, ``corners`` are the weighted corners, (Z, W), ``caps`` their utilisation, infinite if it is not a criterion.
    """
    total, lowest = np.sum([one.min(axis=0) for one in values], axis=0), max(float(one.min()) for one in used)
    near = (total < corners).all(axis=1) & (lowest < caps)
    corners, caps = corners[near], caps[near]
    smallest, reachable = [], np.ones(len(caps), dtype=np.bool_)
    for value, use in zip(values, used, strict=True):  # over the candidates below the utilisation of each zone
        order = np.argsort(use)
        count = np.searchsorted(use[order], caps)
        reachable &= count > 0
        smallest.append(np.minimum.accumulate(value[order], axis=0)[np.maximum(count, 1) - 1])
    slack = corners - np.sum(smallest, axis=0)
    reachable &= (slack > 0.0).all(axis=1)
    masks = [
        below_any_corner(value, use, (own + slack)[reachable], caps[reachable])
        for value, use, own in zip(values, used, smallest, strict=True)
    ]
    return (masks, total, lowest) if all(mask.any() for mask in masks) else None


@kernel
def below_any_corner(values: Array, used: Array, corners: Array, caps: Array) -> Mask:
    """Which rows lie below some corner in every weighted sum and in utilisation; (K, W), (K,), (Z, W), (Z,)."""
    kept, last = np.zeros(len(used), dtype=np.bool_), 0
    for row in range(len(used)):
        for step in range(len(caps)):
            zone = (last + step) % len(caps)  # neighbouring rows often lie in the same zone
            inside = used[row] < caps[zone]
            for w in range(values.shape[1]):
                if not inside:
                    break
                inside = values[row, w] < corners[zone, w]
            if inside:
                kept[row], last = True, zone
                break
    return kept
