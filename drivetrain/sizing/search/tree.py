"""Best-first branch and bound over the drives of all joints: the best sets, with a proof of optimality.

A node has a domain of remaining candidates at every joint, reduced by constraint propagation. It is branched on the
load parameter that changes the loads of other joints most, so that many candidates are ruled out together before any
is judged. Once all loads of a node are decided, its cheapest feasible candidates are a set of drives; the rest of the
node is branched so that no set occurs twice.
"""

from __future__ import annotations

import copy
import heapq
import math
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Self, TypeVar

import numpy as np

from drivetrain.arrays import Array, Indices, Mask
from drivetrain.sizing.judge.arm_stops import needs_arm_stops
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.constraints.chance import ChanceConstraint
from drivetrain.sizing.search.constraints.common_parts import CommonParts
from drivetrain.sizing.search.constraints.stiffness import apply_stiffness_cuts
from drivetrain.sizing.search.constraints.supply import supply_may_be_feasible
from drivetrain.sizing.search.domains import Domains, Pairs, cheapest_pairs, exclude_cheapest, replace_domain
from drivetrain.sizing.search.enumeration import (
    FeasibleSet,
    can_enumerate,
    feasible_sets,
    min_energy_level,
    with_arm,
)
from drivetrain.sizing.search.preconditions import satisfied
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.search.propagate import ParameterRanges, Propagation

REPORT_EVERY = 50  # nodes, sets

Report = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Node:
    """A subproblem: every combination of the remaining candidates."""

    domains: Domains

    @property
    def n_sets(self) -> int:
        """Number of combinations."""
        return math.prod(len(domain) for domain in self.domains)


AnyNode = TypeVar("AnyNode", bound=Node)
AnyTree = TypeVar("AnyTree", bound="BranchAndBound[Any]")


@dataclass
class BranchAndBound(ABC, Generic[AnyNode]):
    """A best-first search with dives; it can be stopped between two nodes and resumed."""

    problem: Problem  # the selection problem
    excluded: frozenset[Pairs] = frozenset()  # sets that must not be found
    chance_constraint: ChanceConstraint | None = None  # None: no probability of feasibility is required
    counters: Counter[str] = field(default_factory=Counter, init=False)  # work done
    open: list[tuple[float, int, AnyNode]] = field(default_factory=list, init=False)  # heap, most promising first
    dive_node: AnyNode | None = field(default=None, init=False)  # next node of the current dive
    started: bool = field(default=False, init=False)

    def run(self, deadline: float, report: Report) -> None:
        """Search until finished or until a deadline (``time.perf_counter``); at least one node is processed."""
        self.begin()
        while not self.finished:
            node = self._next()
            if self.counters["nodes"] % REPORT_EVERY == 0:
                report(*self.progress())
            children = self.branch(node)
            self.dive_node = self.choose_dive(children)
            for child in children:
                if child is not self.dive_node:
                    self.push(child)
            if time.perf_counter() >= deadline:
                return

    @property
    @abstractmethod
    def found(self) -> Sequence[Pairs]:
        """The sets found so far."""

    def begin(self) -> None:
        """Create the root node, once."""
        if not self.started:
            self.started = True
            self.make_root()

    def push(self, node: AnyNode) -> None:
        """Add a node to the heap; of equally promising nodes the newest is processed first, as it is the deepest."""
        self.counters["pushed"] += 1
        heapq.heappush(self.open, (self.order(node), -self.counters["pushed"], node))

    def copy(self) -> Self:
        """An independent copy of the search that can be resumed."""
        other = copy.copy(self)
        other.open, other.counters = list(self.open), Counter(self.counters)
        other.chance_constraint = None if self.chance_constraint is None else self.chance_constraint.copy()
        return other

    @property
    def open_nodes(self) -> list[AnyNode]:
        """The nodes not processed yet."""
        return [node for _, _, node in self.open] + ([] if self.dive_node is None else [self.dive_node])

    def _next(self) -> AnyNode:
        """The next node: that of the current dive, else the most promising one."""
        self.counters["nodes"] += 1
        node, self.dive_node = self.dive_node, None
        if node is not None and self.may_improve(node):
            return node
        self.counters["descents"] += 1
        return heapq.heappop(self.open)[2]

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether no open node can contain a wanted set."""

    @abstractmethod
    def make_root(self) -> None:
        """Create the root node and the first incumbents."""

    @abstractmethod
    def order(self, node: AnyNode) -> float:
        """Priority of a node; the smallest is processed first."""

    @abstractmethod
    def may_improve(self, node: AnyNode) -> bool:
        """Whether a node may still contain a wanted set, given the incumbents."""

    @abstractmethod
    def branch(self, node: AnyNode) -> list[AnyNode]:
        """The propagated children of a node; sets found on the way are kept."""

    @abstractmethod
    def choose_dive(self, children: Sequence[AnyNode]) -> AnyNode | None:
        """The child to process next; None: the most promising of all open nodes."""

    @abstractmethod
    def progress(self) -> tuple[int, int, str]:
        """Work done, total work, and a text."""


def run_search(tree: AnyTree, deadline: float, report: Report) -> tuple[AnyTree, dict[Pairs, Evaluation]]:
    """Run a search until finished or until the deadline, and evaluate the sets that it found.

    If a full evaluation finds one of the sets infeasible, the search is restarted with that set excluded.
    """
    while True:
        tree.run(deadline, report)
        evaluations = {}
        for done, pairs in enumerate(tree.found):
            if done and done % REPORT_EVERY == 0:
                report(done, len(tree.found), f"evaluating {len(tree.found)} sets")
            evaluations[pairs] = tree.problem.evaluate(pairs)
        infeasible = frozenset(pairs for pairs, one in evaluations.items() if not satisfied(one))
        if not infeasible:
            return tree, evaluations
        disagreements = tree.counters["disagreements"] + len(infeasible)
        tree = replace(tree, excluded=tree.excluded | infeasible)
        tree.counters["disagreements"] = disagreements


def bisect_parameter(problem: Problem, domains: Domains, joint: int, parameter: int) -> list[Domains]:
    """Split the candidates of a joint at the middle of the range of one load parameter."""
    values = problem.candidates.parameters[domains[joint].pairs, parameter]
    low, high = values.min(), values.max()
    middle = 0.5 * (low + high)
    # The middle of two neighbouring floats rounds to one of them.
    return split(domains, joint, values <= (middle if middle < high else low))


def split(domains: Domains, joint: int, mask: Mask) -> list[Domains]:
    """Split the candidates of a joint into those of a mask and the others."""
    return [replace_domain(domains, joint, domains[joint].subset(np.asarray(one))) for one in (mask, ~mask)]


MAX_DEAD_ENDS = 20  # largest number of dead ends in the dive for the first incumbents
FULL_TEST_SIZE = 16  # domains up to this size are tested in full at every node
NO_TEST_LIMIT = 10**9  # test domains of every size in full
DIVE_EVERY = 3  # every third node of smallest bound starts a dive down to a set or a dead end
MAX_ENUMERATED = 1024  # largest number of tied sets of a node that are enumerated
MAX_COUNTED = 1000  # ties of the best set are counted up to this number
# Dives for the first incumbents: the share of the estimated price of loads that is counted, and the size up to which
# domains are tested in full after the dive. The first one removes expensive candidates before the rest is tested.
ROOT_DIVES = ((0.0, FULL_TEST_SIZE), (0.5, NO_TEST_LIMIT), (1.0, NO_TEST_LIMIT))
COARSE = 0.05  # share of a node's possible gain below which open loads are branched one by one


@dataclass(frozen=True, eq=False)
class BoundedNode(Node):
    """A propagated node."""

    ranges: ParameterRanges  # load parameter ranges of its candidates
    bound: float  # lower bound on the objective of its feasible sets
    cheapest_is_feasible: bool = False  # whether its cheapest candidates are a feasible set


@dataclass
class Tree(BranchAndBound[BoundedNode]):
    """The search for the sets of smallest objective."""

    cutoff: float = math.inf  # sets whose objective is this large or larger are rejected
    best: list[FeasibleSet] = field(default_factory=list, init=False)  # incumbents, best first
    branched_by_load: bool = field(default=False, init=False)  # whether the last node was branched on a single load
    supply_binds: bool = field(default=False, init=False)  # whether the supply limits ruled out a set
    suspects: set[int] = field(default_factory=set, init=False)  # pairs that passed the bounds and failed the judge
    tie_counts: Counter[int] = field(default_factory=Counter, init=False)  # feasible sets found, by objective level
    # objective levels at which a node was closed without counting its sets, as none of them precedes the incumbents
    uncounted_levels: set[int] = field(default_factory=set, init=False)

    def copy(self) -> Tree:
        other = super().copy()
        other.best, other.tie_counts = list(self.best), Counter(self.tie_counts)
        other.uncounted_levels = set(self.uncounted_levels)
        return other

    @property
    def found(self) -> Sequence[Pairs]:
        return [one.pairs for one in self.best]

    @property
    def last(self) -> FeasibleSet | None:
        """The worst incumbent; None while there are fewer than wanted."""
        return self.best[-1] if len(self.best) >= self.problem.options.sets else None

    @property
    def limit(self) -> float:
        """Upper bound: sets whose objective is this large or larger are not wanted; ties of the last incumbent are."""
        if self.last is None:
            return self.cutoff
        return min(self.cutoff, (self.last.level + 0.5) * self.problem.objective_step)

    @property
    def equals(self) -> tuple[int, bool]:
        """Number of feasible sets that tie with the best one, and whether all of them were counted."""
        if not self.best:
            return 0, self.finished
        level = self.best[0].level
        incumbents = sum(found.level == level for found in self.best)
        return max(self.tie_counts[level], incumbents), self.finished and level not in self.uncounted_levels

    @property
    def finished(self) -> bool:
        return self.started and self._open_bound >= self.limit

    @property
    def bound(self) -> float:
        """Lower bound on the objective of all feasible sets; infinite if there is proven to be none."""
        open_bound = self._open_bound if self.started else -math.inf
        return min([open_bound, *(found.objective for found in self.best[:1])])

    @property
    def _open_bound(self) -> float:
        first = [self.open[0][0]] if self.open else []
        return min([*first, math.inf if self.dive_node is None else self.dive_node.bound])

    def make_root(self) -> None:
        root = self.propagate(self.problem.domains(), 0, None)
        for share, full_test_size in ROOT_DIVES:
            if root is None:
                return
            self._dive(root, share)
            size = NO_TEST_LIMIT if math.isinf(self.limit) else full_test_size
            root = self.propagate(root.domains, size, root)
        if root is not None:
            self.push(root)

    def order(self, node: BoundedNode) -> float:
        return node.bound

    def may_improve(self, node: BoundedNode) -> bool:
        return node.bound < self.limit

    def branch(self, node: BoundedNode) -> list[BoundedNode]:
        if node.cheapest_is_feasible:
            self.tie_counts[self.problem.level(node.bound)] += 1
        if self._close_ties(node):
            return []
        children = (self.propagate(domains, FULL_TEST_SIZE, node) for domains in self._branches(node))
        return [child for child in children if child is not None]

    def choose_dive(self, children: Sequence[BoundedNode]) -> BoundedNode | None:
        if not children or self.counters["descents"] % DIVE_EVERY:
            return None
        return children[0] if self.branched_by_load else min(children, key=lambda one: one.bound)

    def progress(self) -> tuple[int, int, str]:
        share = 0.0
        if self.best and self.best[0].objective > 0.0:
            share = min(max(self.bound / self.best[0].objective, 0.0), 1.0)
        return round(1000 * share), 1000, f"{self.counters['nodes']} nodes, {len(self.open)} open"

    def propagate(self, domains: Domains, full_test_size: int, parent: BoundedNode | None) -> BoundedNode | None:
        """The node of some domains after propagation, None if it contains no wanted set; a set found is kept."""
        problem, limit = self.problem, self.limit
        left: Domains | None = domains if all(len(domain) for domain in domains) else None
        for constraint in problem.constraints:
            left = None if left is None else constraint.propagate(left, limit)
        if left is None:
            return None
        self.counters["nodes made"] += 1
        ranges = ParameterRanges.unknown(problem.n) if parent is None else parent.ranges.copy()
        if problem.energy_weight or problem.price_weight:
            left = tuple(domain.sorted_by_cost() for domain in left)
        stiffness_bound, left = apply_stiffness_cuts(problem, left, limit)
        if stiffness_bound >= limit:
            return None
        left = Propagation(problem, list(left), ranges, limit, full_test_size, self.suspects, self.counters).run()
        if left is None:
            return None
        joint_bound = sum(domain.lower_bound for domain in left)
        common_bounds = (constraint.bound(left, limit) for constraint in problem.constraints)
        bound = max([joint_bound, stiffness_bound, *common_bounds])
        if bound >= limit or (self.supply_binds and not supply_may_be_feasible(problem, left, ranges)):
            return None
        node = BoundedNode(left, ranges, bound)
        if all(domain.cheapest_is_exact for domain in left) and not self._open_loads(node).size:
            node = replace(node, cheapest_is_feasible=self._offer_cheapest(node))
        if self.chance_constraint is None:
            return node
        load_decided = np.asarray([ranges.decided[loading].all() for loading in problem.is_loaded_by])
        remaining = self.chance_constraint.without_failing(left, load_decided)
        return node if remaining is left else self.propagate(remaining, full_test_size, node)

    def _violated(self, domains: Domains) -> CommonParts | None:
        """The first common-parts constraint that the cheapest candidates violate."""
        pairs = cheapest_pairs(domains)
        return next((one for one in self.problem.constraints if not one.satisfied(pairs)), None)

    def _open_loads(self, node: BoundedNode) -> Indices:
        """Joints whose drives load other joints and are not decided."""
        return np.flatnonzero(self.problem.is_loaded_by.any(axis=0) & ~node.ranges.decided)

    def _offer_cheapest(self, node: BoundedNode) -> bool:
        """Offer the cheapest set of a node whose loads are decided as an incumbent; whether it is feasible."""
        cheapest = tuple(domain.subset(np.arange(len(domain)) == domain.cheapest) for domain in node.domains)
        if cheapest_pairs(cheapest) in self.excluded or self._violated(node.domains) is not None:
            return False
        found = next(feasible_sets(self.problem, cheapest, node.ranges, math.inf), None)
        found = None if found is None else with_arm(self.problem, found)
        self.supply_binds |= found is None
        return found is not None and self._offer(found)

    def _offer(self, found: FeasibleSet) -> bool:
        """Make a feasible set an incumbent if it is good enough; False if it is excluded or fails too often."""
        if found.pairs in self.excluded:
            return False
        if (self.last is not None and found >= self.last) or found.pairs in {one.pairs for one in self.best}:
            return True
        if self.chance_constraint is not None and not self.chance_constraint.satisfied(found.pairs, found.objective):
            self.excluded |= {found.pairs}
            return False
        self.counters["sets that fit"] += 1
        self.best = sorted([*self.best, found])[: self.problem.options.sets]
        return True

    def _close_ties(self, node: BoundedNode) -> bool:
        """Whether a node is closed: its sets tie with the last incumbent, and were enumerated or cannot precede it."""
        problem, last = self.problem, self.last
        if last is None or node.bound < (last.level - 0.5) * problem.objective_step:
            return False
        counting = (
            self.chance_constraint is None
            and not needs_arm_stops(problem.candidates.study)  # each set takes long
            and last.level == self.best[0].level
            and self.tie_counts[last.level] < MAX_COUNTED
        )
        if not counting and min_energy_level(problem, node.domains, node.ranges) > last.energy_level:
            self.uncounted_levels.add(last.level)
            return True
        if node.n_sets > MAX_ENUMERATED or not can_enumerate(problem, node.ranges.decided):
            return False
        self.tie_counts[last.level] -= node.cheapest_is_feasible
        for one in sorted(feasible_sets(problem, node.domains, node.ranges, self.limit)):
            if not counting and self.last is not None and one >= self.last:
                self.uncounted_levels.add(last.level)
                break
            self.counters["equal sets judged"] += 1
            whole = with_arm(problem, one)
            self.tie_counts[last.level] += whole is not None and self._offer(whole)
        return True

    def _dive(self, node: BoundedNode, share: float) -> None:
        """Depth-first search for first incumbents: decide the loads from the tip to the base, cheapest drives first.

        The cost of a load includes a share of what it costs the other joints by estimate. At dead ends the dive
        backtracks while there are fewer incumbents than wanted, else it ends.
        """
        waiting: list[tuple[Domains, BoundedNode]] = []
        prices = share * self._parameter_prices(node)
        for _ in range(self.problem.n + self.problem.options.sets + MAX_DEAD_ENDS):
            if node.bound >= self.limit:
                return
            loads = self._open_loads(node)
            by_load = loads.size and self._violated(node.domains) is None
            children = self._branch_on_load(node, int(loads[-1]), prices) if by_load else self._branches(node)
            stack = [*waiting, *((domains, node) for domains in reversed(children))]
            waiting = stack if self.last is None else stack[-1:]
            found = None
            while waiting and found is None:
                domains, parent = waiting.pop()
                found = self.propagate(domains, FULL_TEST_SIZE, parent)
            if found is None:
                return
            node = found

    def _parameter_prices(self, node: BoundedNode) -> Array:
        """Estimated cost at the other joints per unit of each load parameter, (n, PARAMETERS).

        The cost of a joint is assumed to grow in proportion to its largest torque.
        """
        costs = np.abs([domain.lower_bound for domain in node.domains])
        return np.asarray(np.einsum("j,jki->ki", costs, self.problem.sensitivity))

    def _branches(self, node: BoundedNode) -> list[Domains]:
        """Branch on a violated constraint, else on a load parameter, a single load, or the cheapest set."""
        loads, violated = self._open_loads(node), self._violated(node.domains)
        self.branched_by_load = False
        if violated is not None:
            return violated.branch(node.domains)
        if not loads.size:
            return exclude_cheapest(node.domains)
        joint, parameter, effect_is_small = self._widest_parameter(node)
        if effect_is_small:
            self.branched_by_load = True
            return self._branch_on_load(node, int(loads[-1]))
        return bisect_parameter(self.problem, node.domains, joint, parameter)

    def _widest_parameter(self, node: BoundedNode) -> tuple[int, int, bool]:
        """Joint and load parameter whose range affects the cost of the other joints most, by estimate.

        The flag is True if all open parameters together affect the cost by little compared with the node's gap.
        """
        gain = self.limit - node.bound
        if math.isinf(gain):
            gain = 0.1 * abs(node.bound)
        effect = 0.5 * (node.ranges.high - node.ranges.low) * self._parameter_prices(node)
        joint, parameter = np.unravel_index(int(np.argmax(effect)), effect.shape)
        return int(joint), int(parameter), bool(effect.sum() <= COARSE * gain)

    def _branch_on_load(self, node: BoundedNode, joint: int, prices: Array | None = None) -> list[Domains]:
        """Split a joint's candidates into those that load the others as the cheapest one does, and the rest.

        ``prices``: as ``_parameter_prices``, counted in the choice of the cheapest.
        """
        domain, problem = node.domains[joint], self.problem
        parameters, cheapest = problem.candidates.parameters, domain.cheapest
        if prices is not None:
            cost = domain.cost + np.abs(parameters[domain.pairs]) @ prices[joint]
            priced = replace(domain, cost=cost, exact=np.zeros_like(domain.exact))
            feasible, _, _ = problem.presolve(joint, priced, math.inf, False, node.ranges.low, node.ranges.high)
            cheapest = int(np.argmin(np.where(feasible, cost, math.inf)))
        same = (parameters[domain.pairs] == parameters[domain.pairs[cheapest]]).all(axis=1)
        return split(node.domains, joint, same)
