"""Branch and bound for the exact Pareto front of whole sets of drives.

Additive criteria (mass, price, energy) are combined into weighted sums. A node has a lower bound on every weighted sum
and on the utilisation. It is closed if no zone of the search region, the part of criteria space that the sets found do
not dominate, reaches below all of these bounds.

The energy of a joint is bounded with the help of a line: at each sample the power less a multiple of the load is
bounded over the interval of loads. The multiples, summed over the cycle, are linear in the load parameters of the
drives that load the joint, and this part of the energy is charged to these drives. So a heavy drive pays for the energy
that it causes at the joints before it while their drives are still open, and the error of the bound is quadratic in the
width of the interval.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array, Indices, Mask
from drivetrain.sizing.demand.load_basis import PARAMETERS
from drivetrain.sizing.search.bounds import ROUND_DOWN
from drivetrain.sizing.search.constraints.stiffness import arm_utilisation
from drivetrain.sizing.search.constraints.supply import supply_limited, supply_utilisation
from drivetrain.sizing.search.domains import Domain, Pairs
from drivetrain.sizing.search.problem import ROUNDING
from drivetrain.sizing.search.search_region import SearchRegion, below_any_corner, filter_candidates
from drivetrain.sizing.search.tree import BranchAndBound, Node, Report, bisect_parameter, split

MASS, PRICE, ENERGY, UTILISATION = range(4)
NAMES = ("mass", "price", "energy", "utilisation")
ADDITIVE = {"mass": MASS, "price": PRICE, "energy": ENERGY}
EQUAL = 1e-9  # relative difference by rounding of sums in another order
MAX_PASSES = 3
MAX_WALKED, MAX_DECIDED = 128, 4096  # largest number of sets of a node that are enumerated, with open and decided loads
RECOMPUTE = 0.7  # costs are computed again once the open width has shrunk by this factor
MIN_WIDTH = 1e-12  # width of a parameter range that changes no torque
WEIGHT_STEPS = {0: 1, 1: 1, 2: 12, 3: 6}  # steps of the grid of weightings, by the number of additive criteria
# limits of the utilisation of the first sets
CAPS = (math.inf, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.5, 0.4, 0.3)


@dataclass(frozen=True, eq=False)
class FrontNode(Node):
    """A node whose candidates have four costs: mass, price, energy per cycle and utilisation, (K, 4).

    Costs are exact or lower bounds; the energy excludes what is charged to the drives that load the joint.
    """

    # relative width of the load interval of each joint when its costs were computed; 0: the costs are exact, (n,)
    width: Array
    # energy of joint j charged to the drive of joint k per unit of its load parameters [J], (j, k, PARAMETERS)
    slope: Array
    bound: Array  # lower bound on each weighted sum, (W,)
    utilisation: float  # lower bound


@dataclass
class FrontTree(BranchAndBound[FrontNode]):
    """The search for the Pareto front; the sets found are the points of ``region``."""

    names: Sequence[str] = ()  # criteria that are compared
    region: SearchRegion = field(init=False)
    _root: FrontNode | None = field(default=None, init=False)  # until the search for first sets
    _weights: Array = field(default_factory=lambda: np.zeros((0, 4)), init=False)  # weightings, (W, 4)
    _corners: tuple[Array, Array] | None = field(default=None, init=False)  # cache of ``_weighted_corners``

    def __post_init__(self) -> None:
        self.region = SearchRegion(np.zeros(len(self.names)), EQUAL)
        self._columns = [ADDITIVE[name] for name in self.names if name in ADDITIVE]
        self._additive = [i for i, name in enumerate(self.names) if name in ADDITIVE]
        self._compares_utilisation = "utilisation" in self.names
        # Whether drives load only joints before their own, so that sets can be judged from the tip to the base.
        self._tip_to_base = not np.tril(self.problem.is_loaded_by).any()

    def copy(self) -> FrontTree:
        other = super().copy()
        other.region = self.region.copy()
        return other

    @property
    def found(self) -> Sequence[Pairs]:
        return self.region.keys

    @property
    def finished(self) -> bool:
        return self.started and not self.open and self.dive_node is None and self._root is None

    def make_root(self) -> None:
        if not all(len(pairs) for pairs in self.problem.eligible):
            return
        root = self._root = self._update_costs(self.root())
        if root is None:
            return
        costs = [domain.cost for domain in root.domains]
        ranges = np.sum([np.ptp(one, axis=0) for one in costs], axis=0)
        self._weights = weightings(self._columns, np.maximum(ranges, 1e-9))
        largest = np.sum([np.abs(one).max(axis=0) for one in costs], axis=0)
        highest = [2.0 * largest[ADDITIVE[name]] + 1e9 if name in ADDITIVE else 2.0 for name in self.names]
        self.region = SearchRegion(np.array(highest), EQUAL)
        self._filter(root)  # compiles before the time limit starts

    def run(self, deadline: float, report: Report) -> None:
        self.begin()
        if self._root is not None:  # the first sets take at most half of the time
            root, self._root = self._root, None
            self._find_first_sets(root, 0.5 * (time.perf_counter() + deadline))
            self.dive_node = self._propagate(root)
        super().run(deadline, report)

    def order(self, node: FrontNode) -> float:
        order = node.utilisation if self._compares_utilisation else 0.0
        return order + (float(np.mean(node.bound / self._scale)) if len(node.bound) else 0.0)

    def may_improve(self, node: FrontNode) -> bool:
        return True  # tested when it is branched

    def branch(self, node: FrontNode) -> list[FrontNode]:
        filtered = self._filter(node)  # sets found since may rule out the node
        branches = [] if filtered is None else self._bisect(filtered)
        return [child for child in map(self._propagate, branches) if child is not None]

    def choose_dive(self, children: Sequence[FrontNode]) -> FrontNode | None:
        return min(children, key=self.order, default=None)  # a dive ends in sets, which rule out other nodes

    def progress(self) -> tuple[int, int, str]:
        return 0, 1, f"{len(self.region.points)} sets, {self.counters['nodes']} nodes, {len(self.open)} open"

    def gap(self) -> float:
        """Largest relative amount by which a set not found may improve on a set found in all criteria at once."""
        points = self.region.points
        if self.finished or not len(points):
            return 0.0 if self.finished else math.inf
        values, caps = self._weighted(points), np.full(len(points), math.inf)
        if self._compares_utilisation:
            caps = points[:, self.names.index("utilisation")]
        ratios = (
            np.maximum(node.utilisation / caps, (node.bound / values).max(axis=1, initial=-math.inf))
            for node in self.open_nodes
        )
        return max(0.0, *(1.0 - float(ratio.min()) for ratio in ratios))

    def root(self) -> FrontNode:
        """The node of all candidates, with costs not computed yet."""
        n, offered = self.problem.n, self.problem.candidates
        sheets = np.nan_to_num(np.column_stack([offered.mass, offered.price, np.zeros((len(offered.mass), 2))]))
        domains = tuple(Domain(pairs, sheets[pairs], np.zeros(len(pairs), np.bool_)) for pairs in self.problem.eligible)
        return FrontNode(domains, np.full(n, math.inf), np.zeros((n, n, PARAMETERS)), np.zeros(0), 0.0)

    def _weighted(self, points: Array) -> Array:
        """Weighted sums of the additive criteria of points, (M, W)."""
        return np.asarray(points[:, self._additive] @ self._weights[:, self._columns].T)

    def _weighted_corners(self) -> tuple[Array, Array]:
        """Weighted corners of the search region, (Z, W), and their utilisations, (Z,), less the tolerance."""
        if self._corners is None:
            corners = self.region.corners
            values, used = self._weighted(corners), np.full(len(corners), math.inf)
            if self._compares_utilisation:
                used = corners[:, self.names.index("utilisation")] * (1.0 - EQUAL)
            self._corners = np.ascontiguousarray(values - EQUAL * np.abs(values)), np.ascontiguousarray(used)
        return self._corners

    @property
    def _scale(self) -> Array:
        """Smallest value of each weighted sum among the sets found, (W,)."""
        points = self.region.points
        if not len(points) or not self._additive:
            return np.ones(len(self._weights))
        return np.maximum(self._weighted(points).min(axis=0), 1e-12)

    def _propagate(self, node: FrontNode) -> FrontNode | None:
        """Remove candidates until nothing changes; None if the node is closed or its sets were enumerated."""
        if not all(map(len, node.domains)):  # half of a domain of one candidate is empty
            return None
        left: FrontNode | None = node
        for _ in range(MAX_PASSES):
            before = sum(map(len, node.domains))
            left = self._update_costs(node)
            left = None if left is None else self._filter(self._without_failing(left))
            if left is None:
                return None
            node = left
            if sum(map(len, node.domains)) == before:
                break
        max_walked = MAX_WALKED if self.chance_constraint is None else MAX_WALKED // 16
        decided = not node.width.any() and node.n_sets <= MAX_DECIDED
        if not decided and not (self._tip_to_base and node.n_sets <= max_walked):
            return node
        self.counters["nodes decided" if decided else "nodes walked"] += 1
        found = list(self._enumerate(node))
        costs = np.array([cost for _, cost in found]).reshape(-1, 4)
        for i in np.lexsort((costs[:, UTILISATION], *costs[:, :3].T)):
            self._offer(*found[i])
        return None

    def _update_costs(self, node: FrontNode) -> FrontNode | None:
        """Compute the costs of joints whose load interval has shrunk, and remove infeasible candidates.

        None if a joint has no candidate left.
        """
        problem, offers = self.problem, self.problem.candidates.joints
        domains, width, slope = list(node.domains), node.width.copy(), node.slope.copy()
        for joint in range(problem.n - 1, -1, -1):
            low, high = problem.ranges(domains)
            half = 0.5 * (high - low)
            effect = half * problem.sensitivity[joint] + MIN_WIDTH * (half > 0.0)
            own_width = float(effect[problem.is_loaded_by[joint]].sum())
            if width[joint] == 0.0 or own_width > RECOMPUTE * width[joint]:
                continue  # the costs are exact, or nearly as tight as new ones
            domain, width[joint] = domains[joint], own_width
            self.counters["candidates costed"] += len(domain)
            cost = domain.cost.copy()
            if own_width == 0.0:
                slope[joint] = 0.0
                self._judge(cost, joint, domain.pairs, low)
                domains[joint] = replace(domain, cost=cost).subset(np.isfinite(cost[:, UTILISATION]))
            else:
                offers[joint].torque_interval(low, high)
                _, used, energy, power_slope = offers[joint].bound(
                    domain.pairs, problem.fixed_cost, np.zeros(len(domain)), domain.exact, until=1.0 + ROUNDING,
                    with_energy=True,
                )  # fmt: skip
                slope[joint] = problem.energy_slopes(joint, power_slope)
                charged = float((slope[joint] * 0.5 * (low + high)).sum())
                cost[:, UTILISATION] = used * ROUND_DOWN
                cost[:, ENERGY] = energy - charged - (1.0 - ROUND_DOWN) * (np.abs(energy) + abs(charged))
                domains[joint] = replace(domain, cost=cost).subset(used <= 1.0 + ROUNDING)
            if not len(domains[joint]):
                return None
        return FrontNode(tuple(domains), width, slope, node.bound, node.utilisation)

    def _judge(self, cost: Array, joint: int, pairs: Indices, parameters: Array) -> None:
        """Fill in the exact costs of candidates given the load parameters of all drives, (n, PARAMETERS)."""
        cost[:, UTILISATION], cost[:, ENERGY], extra_price = self.problem.judge(joint, pairs, parameters)
        cost[:, PRICE] = np.nan_to_num(self.problem.candidates.price[pairs]) + extra_price

    def _weighted_costs(self, node: FrontNode) -> list[Array]:
        """Weighted costs of candidates, with the energy of other joints charged to them, (K, W) a joint."""
        parameters, slope = self.problem.candidates.parameters, node.slope.sum(axis=0)
        return [
            domain.cost[:, :3] @ self._weights[:, :3].T
            + np.outer(parameters[domain.pairs] @ slope[joint], self._weights[:, ENERGY])
            for joint, domain in enumerate(node.domains)
        ]

    def _filter(self, node: FrontNode) -> FrontNode | None:
        """Remove the candidates with which no zone can be reached; None if a joint has none left."""
        if not all(map(len, node.domains)):
            return None
        used = [one.cost[:, UTILISATION] for one in node.domains]
        found = filter_candidates(self._weighted_costs(node), used, *self._weighted_corners())
        if found is None:
            return None
        masks, bound, utilisation = found
        kept = tuple(domain.subset(mask) for domain, mask in zip(node.domains, masks, strict=True))
        return replace(node, domains=kept, bound=bound, utilisation=utilisation)

    def _without_failing(self, node: FrontNode) -> FrontNode:
        """Remove the candidates that are known to fail too often under decided loads."""
        if self.chance_constraint is None or not all(map(len, node.domains)):
            return node
        return replace(node, domains=self.chance_constraint.without_failing(node.domains, node.width == 0.0))

    def _enumerate(self, node: FrontNode) -> Iterator[tuple[Pairs, Array]]:
        """Enumerate the sets of a small node that may reach a zone, with their costs, depth first from tip to base.

        Joints not chosen yet are bounded by the node's costs, so a branch is cut as soon as no zone can be reached.
        """
        problem, (corners, caps) = self.problem, self._weighted_corners()
        near = (node.bound < corners).all(axis=1) & (node.utilisation < caps)
        corners, caps, parameters = corners[near], caps[near], problem.candidates.parameters
        weighted, n = self._weighted_costs(node), problem.n
        # Lower bounds for all joints before each one.
        before = np.cumsum([np.zeros(len(self._weights)), *(one.min(axis=0) for one in weighted)], axis=0)
        used = np.maximum.accumulate([0.0, *(float(one.cost[:, UTILISATION].min()) for one in node.domains)])

        def reaches_zone(joint: int, costs: Array, own: Array, chosen: Array) -> Mask:
            """Which candidates of a joint may reach a zone, given the parameters of the drives chosen after it."""
            slope = node.slope[:joint].sum(axis=0)
            charged = own @ slope[joint] + float((chosen * slope)[joint + 1 :].sum())
            total = costs[:, :3] @ self._weights[:, :3].T + np.outer(charged, self._weights[:, ENERGY]) + before[joint]
            return below_any_corner(total, np.maximum(costs[:, UTILISATION], used[joint]), corners, caps)

        def added(spent: Array, cost: Array) -> Array:
            """Costs with those of the joints after added."""
            total = spent + cost
            total[:, UTILISATION] = np.maximum(spent[UTILISATION], cost[:, UTILISATION])
            return total

        def reaches_zone_by_bounds(joint: int, domain: Domain, spent: Array, chosen: Array) -> Mask:
            """As ``reaches_zone``, for costs that are bounds and exclude energy charged to the chosen drives."""
            costs = added(spent, domain.cost)
            costs[:, ENERGY] += float((node.slope[joint] * chosen)[joint + 1 :].sum())
            return reaches_zone(joint, costs, parameters[domain.pairs], chosen)

        def walk(joint: int, spent: Array, chosen: Array, pairs: Pairs) -> Iterator[tuple[Pairs, Array]]:
            domain = node.domains[joint]
            cost = domain.cost
            # judge only what passes the bounds, because judging takes a hundred times as long
            if node.width[joint] != 0.0:
                domain = domain.subset(reaches_zone_by_bounds(joint, domain, spent, chosen))
                if not len(domain):
                    return
                cost = domain.cost.copy()
                self._judge(cost, joint, domain.pairs, chosen)
                self.counters["candidates judged"] += len(domain)
            own, costs = parameters[domain.pairs], added(spent, cost)
            for i in np.flatnonzero(reaches_zone(joint, costs, own, chosen)):
                extended = (int(domain.pairs[i]), *pairs)
                if joint == 0:
                    yield extended, costs[i]
                    continue
                with_own = chosen.copy()
                with_own[joint] = own[i]
                yield from walk(joint - 1, costs[i], with_own, extended)

        yield from walk(n - 1, np.zeros(4), np.zeros((n, PARAMETERS)), ())

    def _offer(self, pairs: Pairs, cost: Array) -> None:
        """Check a whole set against the shared constraints, and add it to the front unless it is dominated."""
        problem = self.problem
        if self.region.dominates(self._point(cost)):
            return
        self.counters["sets judged"] += 1
        if pairs in self.excluded or not all(one.satisfied(pairs) for one in problem.constraints):
            return
        used = cost[UTILISATION]
        if supply_limited(problem):
            used = max(used, supply_utilisation(problem, *problem.set_power(pairs)))
        if used <= 1.0:
            used = max(used, arm_utilisation(problem, pairs))
        point = self._point(np.append(cost[:3], used))
        if not used <= 1.0 or self.region.dominates(point):
            return
        if self.chance_constraint is not None and not self.chance_constraint.satisfied(pairs):
            return
        if self.region.add(point, pairs):
            self.counters["sets that fit"] += 1
            self._corners = None

    def _point(self, cost: Array) -> Array:
        """The compared criteria of a set, (p,)."""
        return np.array([cost[NAMES.index(name)] for name in self.names])

    def _bisect(self, node: FrontNode) -> list[FrontNode]:
        """Split a node at the load parameter whose range affects the costs most, else at the largest domain."""
        low, high = self.problem.ranges(node.domains)
        half = 0.5 * (high - low)
        # Joints with an open load count by their energy; a decided load has no effect left.
        importance = np.array([
            0.0 if width == 0.0 else float(np.abs(domain.cost[:, ENERGY]).min()) + 1e-3
            for width, domain in zip(node.width, node.domains, strict=True)
        ])  # fmt: skip
        loading = np.asarray(self.problem.is_loaded_by.any(axis=0))
        by_effect: Array = half * np.einsum("j,jki->ki", importance, self.problem.sensitivity)
        for effect in (by_effect, half * loading[:, np.newaxis]):  # if no range changes a torque, any range counts
            joint, parameter = (int(i) for i in np.unravel_index(int(np.argmax(effect)), effect.shape))
            if effect[joint, parameter] > 0.0:
                parts = bisect_parameter(self.problem, node.domains, joint, parameter)
                return [replace(node, domains=domains) for domains in parts]
        joint = int(np.argmax([len(domain) for domain in node.domains]))
        first_half = np.arange(len(node.domains[joint])) < len(node.domains[joint]) // 2
        return [replace(node, domains=domains) for domains in split(node.domains, joint, first_half)]

    def _find_first_sets(self, root: FrontNode, deadline: float) -> None:
        """Greedy first sets: from the tip to the base the cheapest feasible candidate.

        This is repeated for each weighting and for each cap on the utilisation.
        """
        problem = self.problem
        if not self._tip_to_base:
            return  # loaded from both sides: left to branching
        weights = self._weights if len(self._weights) else np.ones((1, 4))
        for cap, weight in itertools.product(CAPS if self._compares_utilisation else (math.inf,), weights):
            if self.counters["sets judged"] and time.perf_counter() > deadline:
                return
            chosen: dict[int, int] = {}
            total = np.zeros(4)
            for joint in range(problem.n - 1, -1, -1):
                domain = root.domains[joint]
                cost = domain.cost.copy()
                self._judge(cost, joint, domain.pairs, problem.candidates.parameters_of(chosen))
                allowed = np.asarray(cost[:, UTILISATION] < cap)
                if self.chance_constraint is not None:
                    reference = tuple(chosen.get(k, 0) for k in range(problem.n))
                    allowed &= ~self.chance_constraint.fails(joint, domain.pairs, reference)
                rows = np.flatnonzero(allowed)
                if not len(rows):
                    break
                best = int(rows[np.argmin(cost[rows] @ weight)])
                chosen[joint] = int(domain.pairs[best])
                total = np.append(total[:3] + cost[best, :3], max(total[UTILISATION], cost[best, UTILISATION]))
            else:
                self._offer(tuple(chosen[joint] for joint in range(problem.n)), total)


def weightings(columns: Sequence[int], ranges: Array) -> Array:
    """Weightings of the additive criteria in some columns on a grid of the simplex, each criterion alone among them,
    (W, 4); ``ranges`` are the scales of the criteria, (4,).
    """
    rows, steps = [], WEIGHT_STEPS[len(columns)]
    for counts in itertools.product(range(steps + 1), repeat=len(columns)):
        if sum(counts) == steps:
            row = np.zeros(4)
            for column, count in zip(columns, counts, strict=True):
                row[column] = count / steps / ranges[column]
            rows.append(row)
    return np.array(rows) if columns else np.zeros((0, 4))
