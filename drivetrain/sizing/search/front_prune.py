"""Which candidates of a box can be part of a set that no known one matches, and which whole sets of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.jit import kernel
from drivetrain.sizing.judge.packed_task import Indices
from drivetrain.sizing.search.front_cost import Box
from drivetrain.sizing.search.front_kernels import ENERGY, MASS, PRICE, USED

MOST_SETS = 4096  # of one box, enumerated at once


class Reach(NamedTuple):
    """What sets found leave open: W weightings of the additive criteria, Z zones.

    Attributes:
        weights: Of mass, price and energy, the last column of no use, (W, 4).
        values: Weighted corners of the zones, (Z, W).
        used: Their utilisation, infinite where it is not compared, (Z,).
    """

    weights: Array
    values: Array
    used: Array


@kernel
def weigh(box: Box, numbers: Array, weights: Array, values: Array) -> None:
    """Weighted costs of candidates, each with what it answers for at other joints.

    Args:
        numbers: By which drives load joints, of every pair, (P, NUMBERS).
        weights: (W, 4).
        values: Takes them, (T, W).
    """
    n, count = len(box.size), len(weights)
    for k in range(n):
        for at in range(box.first[k], box.first[k] + box.size[k]):
            energy = box.cost[at, ENERGY]
            for j in range(n):
                for i in range(numbers.shape[1]):
                    slope = box.slope[j, k, i]
                    if slope != 0.0:
                        energy += slope * numbers[box.pool[at], i]
            for w in range(count):
                fixed = weights[w, 0] * box.cost[at, MASS] + weights[w, 1] * box.cost[at, PRICE]
                values[at, w] = fixed + weights[w, 2] * energy


@kernel
def bounds(box: Box, values: Array, least: Array) -> float:
    """The least of each weighting at each joint.

    Args:
        values: From ``weigh``, (T, W).
        least: Takes it, (n, W).
    """
    used = 0.0
    for joint in range(len(box.size)):
        own = np.inf
        for w in range(values.shape[1]):
            least[joint, w] = np.inf
        for at in range(box.first[joint], box.first[joint] + box.size[joint]):
            own = min(own, box.cost[at, USED])
            for w in range(values.shape[1]):
                least[joint, w] = min(least[joint, w], values[at, w])
        used = max(used, own)
    return used


@kernel
def _reached(reach: Reach, total: Array, used: float) -> Indices:
    """Zones that sets with some least costs can reach."""
    found = np.empty(len(reach.values), dtype=np.int64)
    count = 0
    for zone in range(len(reach.values)):
        if not used < reach.used[zone]:
            continue
        inside = True
        for w in range(len(total)):
            if not total[w] < reach.values[zone, w]:
                inside = False
                break
        if inside:
            found[count] = zone
            count += 1
    return found[:count]


# long kernel: one pass over zones and candidates
@kernel
def survivors(box: Box, numbers: Array, reach: Reach, kept: NDArray[np.bool_], total: Array) -> float:
    """Which candidates may be part of a set that no known one matches.

    Args:
        numbers: By which drives load joints, of every pair, (P, NUMBERS).
        kept: Takes the answer, (T,).
        total: Takes the least of each weighting, (W,).

    Returns:
        The least utilisation; infinite where no set can be of use.
    """
    n, count = len(box.size), len(reach.weights)
    values = np.empty((len(box.pool), count))
    weigh(box, numbers, reach.weights, values)
    least = np.empty((n, count))
    used = bounds(box, values, least)
    for w in range(count):
        total[w] = 0.0
        for joint in range(n):
            total[w] += least[joint, w]
    zones = _reached(reach, total, used)
    if len(zones) == 0:
        return np.inf
    # The least at each joint by candidates that stay below a zone's utilisation.
    below = np.empty((n, len(zones), count))
    alive = np.ones(len(zones), dtype=np.bool_)
    for joint in range(n):
        first, size = box.first[joint], box.size[joint]
        order = np.argsort(box.cost[first : first + size, USED])
        heights = box.cost[first : first + size, USED][order]
        running = np.empty((size, count))
        for i in range(size):
            for w in range(count):
                own = values[first + order[i], w]
                running[i, w] = own if i == 0 else min(running[i - 1, w], own)
        for z in range(len(zones)):
            height = reach.used[zones[z]]
            last = size if height == np.inf else np.searchsorted(heights, height)
            if last == 0:
                alive[z] = False
                continue
            for w in range(count):
                below[joint, z, w] = running[last - 1, w]
    left = 0
    for z in range(len(zones)):
        for w in range(count):
            if not alive[z]:
                break
            least_sum = 0.0
            for joint in range(n):
                least_sum += below[joint, z, w]
            alive[z] = least_sum < reach.values[zones[z], w]
        if alive[z]:
            # What is left of the zone beside the least of all joints; below, of all but one.
            for w in range(count):
                least_sum = 0.0
                for joint in range(n):
                    least_sum += below[joint, z, w]
                values_left = reach.values[zones[z], w] - least_sum
                for joint in range(n):
                    below[joint, left, w] = below[joint, z, w] + values_left
            zones[left] = zones[z]
            left += 1
    if left == 0:
        return np.inf
    for joint in range(n):
        found = 0
        last_zone = 0
        for at in range(box.first[joint], box.first[joint] + box.size[joint]):
            kept[at] = False
            for step in range(left):
                z = (last_zone + step) % left  # neighbours reach the same zone more often than not
                if not box.cost[at, USED] < reach.used[zones[z]]:
                    continue
                inside = True
                for w in range(count):
                    if not values[at, w] < below[joint, z, w]:
                        inside = False
                        break
                if inside:
                    kept[at], last_zone = True, z
                    found += 1
                    break
        if found == 0:
            return np.inf
    return used


# long kernel: a depth-first walk without recursion
@kernel
def sets_of(box: Box, numbers: Array, reach: Reach, found: Indices) -> int:
    """The sets of a box whose loads are decided that reach a zone.

    Args:
        numbers: By which drives load joints, of every pair, (P, NUMBERS).
        found: Takes positions in the pool, (MOST_SETS, n).
    """
    n, count = len(box.size), len(reach.weights)
    values, least = np.empty((len(box.pool), count)), np.empty((n, count))
    weigh(box, numbers, reach.weights, values)
    used = bounds(box, values, least)
    spent, heights = np.zeros((n + 1, count)), np.zeros(n + 1)
    rest = np.zeros((n + 1, count))
    for joint in range(n - 1, -1, -1):
        rest[joint] = rest[joint + 1] + least[joint]
    zones = _reached(reach, rest[0], used)
    at = np.zeros(n, dtype=np.int64)
    joint, sets = 0, 0
    total = np.empty(count)
    while joint >= 0 and len(zones):
        if at[joint] == box.size[joint]:
            at[joint] = 0
            joint -= 1
            if joint >= 0:
                at[joint] += 1
            continue
        here = box.first[joint] + at[joint]
        height = max(heights[joint], box.cost[here, USED])
        for w in range(count):
            spent[joint + 1, w] = spent[joint, w] + values[here, w]
            total[w] = spent[joint + 1, w] + rest[joint + 1, w]
        heights[joint + 1] = height
        open_zone = False
        for z in zones:
            if not height < reach.used[z]:
                continue
            inside = True
            for w in range(count):
                if not total[w] < reach.values[z, w]:
                    inside = False
                    break
            if inside:
                open_zone = True
                break
        if open_zone and joint == n - 1:
            if sets < len(found):
                for k in range(n):
                    found[sets, k] = box.first[k] + at[k]
            sets += 1
        if open_zone and joint < n - 1:
            joint += 1
        else:
            at[joint] += 1
    return sets


@kernel
def nearness(bound: Array, used: Array, points: Array, heights: Array) -> float:
    """By what share of itself every criterion of a set found may at most be improved at once in some boxes.

    Args:
        bound: Least of every weighting of each box, (B, W).
        used: Least utilisation of each, (B,).
        points: Weighted values of the sets found, (M, W).
        heights: Their utilisation, infinite where it is not compared, (M,).
    """
    worst = 0.0
    for box in range(len(bound)):
        nearest = np.inf
        for point in range(len(points)):
            share = used[box] / heights[point]
            for w in range(bound.shape[1]):
                share = max(share, bound[box, w] / points[point, w])
            nearest = min(nearest, share)
        worst = max(worst, 1.0 - nearest)
    return worst


@kernel
def fresh_corners(cut: Array, point: Array, near: Array) -> Array:
    """The corners that take the place of those a point cuts off.

    Args:
        cut: Corners above the point in every criterion, (C, p).
        point: (p,).
        near: Corners that share a number with the point and lie above it in all others, (B, p).

    Returns:
        Without those that lie below another, (F, p).

    Reference:
        Klamroth, Lacour and Vanderpooten, European Journal of Operational Research 245 (2015) 767, algorithm 3: only
        corners with the point's number on the same axis can make one of no use.
    """
    count, p = cut.shape
    found, made = np.empty((count * p, p)), 0
    for axis in range(p):
        for i in range(count):
            covered = False
            for other in range(count + len(near)):
                one = cut[other] if other < count else near[other - count]
                if other == i or (other >= count and one[axis] != point[axis]):
                    continue
                above, same = True, True
                for k in range(p):
                    if k == axis:
                        continue
                    if one[k] < cut[i, k]:
                        above = False
                        break
                    same = same and one[k] == cut[i, k]
                if above and (not same or other < i or other >= count):
                    covered = True
                    break
            if not covered:
                found[made] = cut[i]
                found[made, axis] = point[axis]
                made += 1
    return found[:made]
