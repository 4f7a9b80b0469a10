"""Every set of drives that no other beats in all criteria at once, by the domains, bounds and branches of the tree.

The least of every weighting of the additive criteria, and of utilisation, bounds a node: where no zone that the sets
found leave open reaches below all of these bounds, nothing new is in it.

The energy of a joint is bounded beside a line: at each sample the power less a multiple of the load is bounded over
the interval of loads, and the multiples, summed up, are linear in the numbers of the drives that load the joint. That
part goes to those drives. So a heavy drive pays for what it costs at the joints before it while these are still open,
and what is lost in the bound shrinks with the square of the interval.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.search.bounds import BELOW
from drivetrain.sizing.search.candidates import Domain, Indices, Mask, Pairs
from drivetrain.sizing.search.problem import ROUNDING
from drivetrain.sizing.search.tree import BranchAndBound, Node, Report, halves, split
from drivetrain.sizing.search.whole_sets import arm_use, supply_limited, supply_use


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

    ``cut``: above the point in every criterion, (C, p); ``near``: those that share a number with the point and lie
    above it in all others, (B, p).

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

    ``values``: weighted costs at least, (K, W) a joint; ``used``: least utilisation, (K,) a joint; ``corners``: of the
    zones, weighted, (Z, W), ``heights`` their utilisation, infinite where it is not compared, (Z,). Masks by joint, the
    least of each weighting, (W,), and of utilisation; None where no zone can be reached.
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


MASS, PRICE, ENERGY, USED = range(4)
NAMES = ("mass", "price", "energy", "utilisation")
ADDITIVE = {"mass": MASS, "price": PRICE, "energy": ENERGY}
EQUAL = 1e-9  # relative: sums in another order
PASSES = 3
FEW, MOST = 128, 4096  # sets of a node: so few are looked at one by one, and so many at most at once
NARROWER = 0.7  # than when costs were found: then they are found anew
TINY = 1e-12  # what is open has some width, even where it changes no torque
STEPS = {0: 1, 1: 1, 2: 12, 3: 6}  # of weightings between two criteria, by how many of them are added up
HEIGHTS = (math.inf, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.5, 0.4, 0.3)


@dataclass(frozen=True, eq=False)
class Part(Node):
    """A node; the costs of its candidates are mass, price, energy a cycle and utilisation, (K, 4).

    They are exact or bounds, of energy without what the drives that load a joint answer for.
    """

    width: (
        Array  # of what was open in the load of each joint when its costs were found, over the largest; 0: exact, (n,)
    )
    slope: (
        Array  # energy at joint j that a unit of each number of the drive of joint k answers for [J], (j, k, NUMBERS)
    )
    bound: Array  # the least of each weighting, (W,)
    used: float  # the least utilisation


@dataclass
class FrontTree(BranchAndBound[Part]):
    """The search for the front, and the sets found with what they leave open, ``zones``."""

    names: Sequence[str] = ()  # criteria that are compared
    zones: Zones = field(init=False)
    _root: Part | None = field(default=None, init=False)  # all candidates, as long as no first sets were looked for
    _weights: Array = field(default_factory=lambda: np.zeros((0, 4)), init=False)
    _corners: tuple[Array, Array] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.zones = Zones(np.zeros(len(self.names)), EQUAL)
        self._columns = [ADDITIVE[name] for name in self.names if name in ADDITIVE]
        self._additive = [i for i, name in enumerate(self.names) if name in ADDITIVE]
        self._judged = "utilisation" in self.names
        # Whether drives load only the joints before their own: then these can be judged from the tip to the base.
        self._ordered = not np.tril(self.problem.loads).any()

    def copied(self) -> FrontTree:
        other = super().copied()
        other.zones = self.zones.copied()
        return other

    @property
    def found(self) -> Sequence[Pairs]:
        return self.zones.keys

    @property
    def finished(self) -> bool:
        return self.started and not self.open and self.following is None and self._root is None

    def first(self) -> None:
        if not all(len(pairs) for pairs in self.problem.known):
            return
        root = self._root = self._costed(self.root())
        if root is None:
            return
        costs = [domain.cost for domain in root.domains]
        self._weights = weightings(
            self._columns, np.maximum(np.sum([np.ptp(one, axis=0) for one in costs], axis=0), 1e-9)
        )
        most = np.sum([np.abs(one).max(axis=0) for one in costs], axis=0)
        highest = [2.0 * most[ADDITIVE[name]] + 1e9 if name in ADDITIVE else 2.0 for name in self.names]
        self.zones = Zones(np.array(highest), EQUAL)
        self._survivors(root)  # compiled before the clock runs

    def run(self, deadline: float, report: Report) -> None:
        self.begin()
        if self._root is not None:  # at most half of the time goes into first sets
            root, self._root = self._root, None
            self._dive(root, 0.5 * (time.perf_counter() + deadline))
            self.following = self._narrowed(root)
        super().run(deadline, report)

    def order(self, node: Part) -> float:
        order = node.used if self._judged else 0.0
        return order + (float(np.mean(node.bound / self._scale)) if len(node.bound) else 0.0)

    def of_interest(self, node: Part) -> bool:
        return True  # told when it is parted

    def parts(self, node: Part) -> list[Part]:
        again = self._survivors(node)  # sets found since may rule it out
        branches = [] if again is None else self._branches(again)
        return [one for one in map(self._narrowed, branches) if one is not None]

    def followed(self, parts: Sequence[Part]) -> Part | None:
        return min(parts, key=self.order, default=None)  # a descent ends in sets, and sets rule out nodes

    def progress(self) -> tuple[int, int, str]:
        return 0, 1, f"{len(self.zones.points)} sets, {self.counters['nodes']} nodes, {len(self.open)} open"

    def gap(self) -> float:
        """By what share of itself every criterion of a set found may at most be improved at once by one not found."""
        left, points = self.left, self.zones.points
        if self.finished or not len(points):
            return 0.0 if self.finished else math.inf
        values = points[:, self._additive] @ self._weights[:, self._columns].T
        heights = points[:, self.names.index("utilisation")] if self._judged else np.full(len(points), math.inf)
        shares = (
            np.maximum(part.used / heights, (part.bound / values).max(axis=1, initial=-math.inf)) for part in left
        )
        return max(0.0, *(1.0 - float(share.min()) for share in shares))

    def root(self) -> Part:
        """All candidates, their costs not known yet."""
        n, offered = self.problem.n, self.problem.candidates
        sheets = np.nan_to_num(np.column_stack([offered.mass, offered.price, np.zeros((len(offered.mass), 2))]))
        domains = tuple(Domain(pairs, sheets[pairs], np.zeros(len(pairs), np.bool_)) for pairs in self.problem.known)
        return Part(domains, np.full(n, math.inf), np.zeros((n, n, NUMBERS)), np.zeros(0), 0.0)

    def _open_zones(self) -> tuple[Array, Array]:
        """What the sets found leave open, in the terms of the bounds: weighted corners and utilisations."""
        if self._corners is None:
            corners = self.zones.corners
            values = corners[:, self._additive] @ self._weights[:, self._columns].T
            used = np.full(len(corners), math.inf)
            if self._judged:
                used = corners[:, self.names.index("utilisation")] * (1.0 - EQUAL)
            self._corners = np.ascontiguousarray(values - EQUAL * np.abs(values)), np.ascontiguousarray(used)
        return self._corners

    @property
    def _scale(self) -> Array:
        points = self.zones.points
        if not len(points) or not self._additive:
            return np.ones(len(self._weights))
        return np.maximum((points[:, self._additive] @ self._weights[:, self._columns].T).min(axis=0), 1e-12)

    def _narrowed(self, part: Part) -> Part | None:
        """A node with what cannot matter taken out, until nothing changes; None when nothing is left of it."""
        left: Part | None = part
        for _ in range(PASSES):
            before = sum(map(len, part.domains))
            left = self._costed(part)
            left = None if left is None else self._survivors(self._without_failing(left))
            if left is None:
                return None
            part = left
            if sum(map(len, part.domains)) == before:
                break
        few = FEW if self.accepts is None else FEW // 16
        decided = not part.width.any() and part.sets <= MOST
        if not decided and not (self._ordered and part.sets <= few):
            return part
        self.counters["nodes decided" if decided else "nodes walked"] += 1
        found = list(self._walk(part))
        costs = np.array([cost for _, cost in found]).reshape(-1, 4)
        for at in np.lexsort((costs[:, USED], *costs[:, :3].T)):
            self._offer(*found[at])
        return None

    def _costed(self, part: Part) -> Part | None:
        """Costs of what is not decided yet, what cannot be feasible taken out; None where a joint has nothing left."""
        problem, offers = self.problem, self.problem.candidates.joints
        domains, width, slope = list(part.domains), part.width.copy(), part.slope.copy()
        for joint in range(problem.n - 1, -1, -1):
            low, high = problem.ranges(domains)
            half = 0.5 * (high - low)
            wide = float((half * problem.reach[joint] + TINY * (half > 0.0))[problem.loads[joint]].sum())
            if width[joint] == 0.0 or wide > NARROWER * width[joint]:
                continue  # what was found is exact, or still bounds the costs nearly as well
            domain, width[joint] = domains[joint], wide
            self.counters["candidates costed"] += len(domain)
            cost = domain.cost.copy()
            if wide == 0.0:
                slope[joint] = 0.0
                self._judge(cost, joint, domain.pairs, low)
                domains[joint] = replace(domain, cost=cost).kept(np.isfinite(cost[:, USED]))
            else:
                offers[joint].interval(low, high)
                _, used, energy, line = offers[joint].bounded(
                    domain.pairs,
                    problem.share,
                    np.zeros(len(domain)),
                    domain.exact,
                    until=1.0 + ROUNDING,
                    energies=True,
                )
                slope[joint] = problem.slopes(joint, line)
                taken = float((slope[joint] * 0.5 * (low + high)).sum())
                cost[:, USED] = used * BELOW
                cost[:, ENERGY] = energy - taken - (1.0 - BELOW) * (np.abs(energy) + abs(taken))
                domains[joint] = replace(domain, cost=cost).kept(used <= 1.0 + ROUNDING)
            if not len(domains[joint]):
                return None
        return Part(tuple(domains), width, slope, part.bound, part.used)

    def _judge(self, cost: Array, joint: int, pairs: Indices, numbers: Array) -> None:
        """Fill the costs of candidates beside chosen drives."""
        cost[:, USED], cost[:, ENERGY], dearer = self.problem.judged(joint, pairs, numbers)
        cost[:, PRICE] = np.nan_to_num(self.problem.candidates.price[pairs]) + dearer

    def _weighed(self, part: Part) -> list[Array]:
        """Weighted costs of candidates, each with what it answers for at other joints, (K, W) a joint."""
        numbers, answered = self.problem.candidates.numbers, part.slope.sum(axis=0)
        return [
            domain.cost[:, :3] @ self._weights[:, :3].T
            + np.outer(numbers[domain.pairs] @ answered[joint], self._weights[:, ENERGY])
            for joint, domain in enumerate(part.domains)
        ]

    def _survivors(self, part: Part) -> Part | None:
        """A node without the candidates with which no zone can be reached."""
        if not all(map(len, part.domains)):
            return None
        found = survivors(self._weighed(part), [one.cost[:, USED] for one in part.domains], *self._open_zones())
        if found is None:
            return None
        kept = tuple(domain.kept(mask) for domain, mask in zip(part.domains, found[0], strict=True))
        return replace(part, domains=kept, bound=found[1], used=found[2])

    def _without_failing(self, part: Part) -> Part:
        """A node without the candidates that are known to fail too often with loads that are decided."""
        if self.accepts is None or not all(map(len, part.domains)):
            return part
        return replace(part, domains=self.accepts.without_failing(part.domains, part.width == 0.0))

    def _walk(self, part: Part) -> Iterator[tuple[Pairs, Array]]:
        """Every set of a small node with its costs, from the tip to the base, those that reach no zone left out.

        What is not chosen yet is bounded by the costs that the node has found, so that a branch is left as soon as no
        zone can be reached.
        """
        problem, (corners, heights) = self.problem, self._open_zones()
        near = (part.bound < corners).all(axis=1) & (part.used < heights)
        corners, heights, numbers = corners[near], heights[near], problem.candidates.numbers
        weighed, n = self._weighed(part), problem.n
        least = np.cumsum([np.zeros(len(self._weights)), *(one.min(axis=0) for one in weighed)], axis=0)
        used = np.maximum.accumulate([0.0, *(float(one.cost[:, USED].min()) for one in part.domains)])

        def reach(joint: int, costs: Array, own: Array, after: Array) -> Mask:
            """Which candidates of a joint reach a zone, with those chosen after it."""
            answered = part.slope[:joint].sum(axis=0)
            energy = own @ answered[joint] + float((after * answered)[joint + 1 :].sum())
            total = costs[:, :3] @ self._weights[:, :3].T + np.outer(energy, self._weights[:, ENERGY]) + least[joint]
            return reaching(total, np.maximum(costs[:, USED], used[joint]), corners, heights)

        def walk(joint: int, spent: Array, after: Array, pairs: Pairs) -> Iterator[tuple[Pairs, Array]]:
            domain = part.domains[joint]
            own, exact = numbers[domain.pairs], domain.cost
            if part.width[joint] != 0.0:
                # Judging takes a hundred times longer than a look at the bounds, so it has to be worth it.
                left = domain.kept(_reached_with_bounds(joint, domain, own, spent, after))
                if not len(left):
                    return
                domain, own, exact = left, numbers[left.pairs], left.cost.copy()
                self._judge(exact, joint, left.pairs, after)
                self.counters["candidates judged"] += len(left)
            costs = spent + exact
            costs[:, USED] = np.maximum(spent[USED], exact[:, USED])
            for at in np.flatnonzero(reach(joint, costs, own, after)):
                chosen = (int(domain.pairs[at]), *pairs)
                if joint == 0:
                    yield chosen, costs[at]
                    continue
                beside = after.copy()
                beside[joint] = own[at]
                yield from walk(joint - 1, costs[at], beside, chosen)

        def _reached_with_bounds(joint: int, domain: Domain, own: Array, spent: Array, after: Array) -> Mask:
            """The same while the energy of the joint is bounded beside its line."""
            costs = spent + domain.cost
            costs[:, USED] = np.maximum(spent[USED], domain.cost[:, USED])
            costs[:, ENERGY] += float((part.slope[joint] * after)[joint + 1 :].sum())
            return reach(joint, costs, own, after)

        yield from walk(n - 1, np.zeros(4), np.zeros((n, NUMBERS)), ())

    def _offer(self, pairs: Pairs, cost: Array) -> None:
        """A whole set: held against the supply, and kept if no other matches it."""
        if self.zones.matched(self._point(cost)):
            return
        self.counters["sets judged"] += 1
        if pairs in self.excluded or not all(one.satisfied(pairs) for one in self.problem.constraints):
            return
        if supply_limited(self.problem):
            cost = np.append(cost[:3], max(cost[USED], supply_use(self.problem, *self.problem.power(pairs))))
        if cost[USED] <= 1.0:
            cost = np.append(cost[:3], max(cost[USED], arm_use(self.problem, pairs)))
        if not cost[USED] <= 1.0 or self.zones.matched(self._point(cost)):
            return
        if self.accepts is not None and not self.accepts(pairs):
            return
        if self.zones.offer(self._point(cost), pairs):
            self.counters["sets that fit"] += 1
            self._corners = None

    def _point(self, cost: Array) -> Array:
        """The criteria that are compared."""
        return np.array([cost[NAMES.index(name)] for name in self.names])

    def _branches(self, part: Part) -> list[Part]:
        """A node in two, by the number that changes the loads most."""
        low, high = self.problem.ranges(part.domains)
        half = 0.5 * (high - low)
        # Only joints whose load is still open are changed; each counts with its share of the bounds.
        share = np.array([
            0.0 if width == 0.0 else float(np.abs(domain.cost[:, ENERGY]).min()) + 1e-3
            for width, domain in zip(part.width, part.domains, strict=True)
        ])  # fmt: skip
        effect: Array = half * np.einsum("j,jki->ki", share, self.problem.reach)
        joint, number = (int(at) for at in np.unravel_index(int(np.argmax(effect)), effect.shape))
        if not effect[joint, number] > 0.0:
            # Where no number changes a torque, loads are told apart by any number that differs.
            loading = np.asarray(self.problem.loads.any(axis=0))
            differ = half * loading[:, np.newaxis]
            joint, number = (int(at) for at in np.unravel_index(int(np.argmax(differ)), differ.shape))
            if not differ[joint, number] > 0.0:  # its loads are decided, and there are many sets
                joint = int(np.argmax([len(domain) for domain in part.domains]))
                below = np.arange(len(part.domains[joint])) < len(part.domains[joint]) // 2
                return [replace(part, domains=one) for one in split(part.domains, joint, below)]
        return [replace(part, domains=one) for one in halves(self.problem, part.domains, joint, number)]

    def _dive(self, root: Part, deadline: float) -> None:
        """First sets to hold others against, from the tip to the base.

        For each weighting, and for each height under which all utilisations are to stay, the cheapest feasible one.
        """
        problem = self.problem
        if not self._ordered:
            return  # loaded from both sides: left to the branches
        weights = self._weights if len(self._weights) else np.ones((1, 4))
        for height, weight in itertools.product(HEIGHTS if self._judged else (math.inf,), weights):
            if self.counters["sets judged"] and time.perf_counter() > deadline:
                return
            chosen: dict[int, int] = {}
            total = np.zeros(4)
            for joint in range(problem.n - 1, -1, -1):
                domain, beside = root.domains[joint], problem.candidates.numbers_of(chosen)
                cost = domain.cost.copy()
                self._judge(cost, joint, domain.pairs, beside)
                fits = np.asarray(cost[:, USED] < height)
                if self.accepts is not None:
                    lead = tuple(chosen.get(k, 0) for k in range(problem.n))
                    fits &= ~self.accepts.fails(joint, domain.pairs, lead)
                low = np.flatnonzero(fits)
                if not len(low):
                    break
                at = int(low[np.argmin(cost[low] @ weight)])
                chosen[joint] = int(domain.pairs[at])
                total = np.append(total[:3] + cost[at, :3], max(total[USED], cost[at, USED]))
            else:
                self._offer(tuple(chosen[joint] for joint in range(problem.n)), total)


def weightings(columns: Sequence[int], spans: Array) -> Array:
    """Weightings of the additive criteria: each alone, and mixtures of all, (W, 4).

    ``spans``: by which each is scaled, (4,).
    """
    rows, steps = [], STEPS[len(columns)]
    for parts in itertools.product(range(steps + 1), repeat=len(columns)):
        if sum(parts) == steps:
            row = np.zeros(4)
            for column, part in zip(columns, parts, strict=True):
                row[column] = part / steps / spans[column]
            rows.append(row)
    return np.array(rows) if columns else np.zeros((0, 4))
