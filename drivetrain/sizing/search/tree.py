"""Branch and bound over the choices of all joints: the best sets of drives, proven to be.

A node is a domain of candidates at every joint, with all that propagation rules out taken out. It is branched where the
open choice loads the other joints most differently: many candidates fall together, before any is looked at alone.
Once every load is decided the cheapest feasible candidates are a set of drives; what is left of such a node is branched
so that no set comes up twice.
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

from drivetrain.arrays import Array
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.candidates import (
    Domains,
    Indices,
    Mask,
    Pairs,
    cheapest_pairs,
    with_domain,
    without_cheapest,
)
from drivetrain.sizing.search.chance_constraint import ChanceConstraint
from drivetrain.sizing.search.common_parts import CommonParts
from drivetrain.sizing.search.preconditions import satisfied
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.search.propagate import Propagation, Ranges
from drivetrain.sizing.search.whole_sets import (
    Found,
    can_be_judged,
    feasible_sets,
    least_joules,
    supply_may_be_feasible,
    without_soft,
)

REPORT_EVERY = 50  # nodes, sets

Report = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Node:
    """A part of all sets: every combination of the candidates left."""

    domains: Domains

    @property
    def sets(self) -> int:
        """How many sets it has."""
        return math.prod(len(domain) for domain in self.domains)


AnyNode = TypeVar("AnyNode", bound=Node)
AnyTree = TypeVar("AnyTree", bound="BranchAndBound[Any]")


@dataclass
class BranchAndBound(ABC, Generic[AnyNode]):
    """A search and what it has left; it can be stopped between two nodes and go on."""

    problem: Problem  # what is chosen from
    excluded: frozenset[Pairs] = frozenset()  # sets that are not to be found
    accepts: ChanceConstraint | None = None  # None where it is not asked whether sets are feasible often enough
    counters: Counter[str] = field(default_factory=Counter, init=False)  # work done
    open: list[tuple[float, int, AnyNode]] = field(default_factory=list, init=False)  # most promising first
    following: AnyNode | None = field(default=None, init=False)  # that a descent goes on with
    started: bool = field(default=False, init=False)

    def run(self, deadline: float, report: Report) -> None:
        """Search until it is finished or the time is up; one step is made whatever the deadline (``perf_counter``)."""
        self.begin()
        while not self.finished:
            node = self._next()
            if self.counters["nodes"] % REPORT_EVERY == 0:
                report(*self.progress())
            parts = self.parts(node)
            self.following = self.followed(parts)
            for part in parts:
                if part is not self.following:
                    self.push(part)
            if time.perf_counter() >= deadline:
                return

    @property
    @abstractmethod
    def found(self) -> Sequence[Pairs]:
        """The sets found."""

    def begin(self) -> None:
        """Make the first node, once."""
        if not self.started:
            self.started = True
            self.first()

    def push(self, node: AnyNode) -> None:
        """Keep a node for later."""
        # Of equals the youngest first: it is nearest to a set.
        self.counters["pushed"] += 1
        heapq.heappush(self.open, (self.order(node), -self.counters["pushed"], node))

    def copied(self) -> Self:
        """The same search, to go on without touching this one."""
        other = copy.copy(self)
        other.open, other.counters = list(self.open), Counter(self.counters)
        return other

    @property
    def left(self) -> list[AnyNode]:
        """The nodes not looked at."""
        return [node for _, _, node in self.open] + ([] if self.following is None else [self.following])

    def _next(self) -> AnyNode:
        """The node to look at: the one that a descent goes on with, or the most promising."""
        self.counters["nodes"] += 1
        node, self.following = self.following, None
        if node is not None and self.of_interest(node):
            return node
        self.counters["descents"] += 1
        return heapq.heappop(self.open)[2]

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether nothing of interest is left."""

    @abstractmethod
    def first(self) -> None:
        """Make the first node, and the first sets to hold others against."""

    @abstractmethod
    def order(self, node: AnyNode) -> float:
        """How promising a node is: the smaller the better."""

    @abstractmethod
    def of_interest(self, node: AnyNode) -> bool:
        """Whether a node may hold a set that is wanted, after all that was found since it was made."""

    @abstractmethod
    def parts(self, node: AnyNode) -> list[AnyNode]:
        """A node parted, with all that cannot matter taken out; sets that come out of it are kept."""

    @abstractmethod
    def followed(self, parts: Sequence[AnyNode]) -> AnyNode | None:
        """The part to go on with at once; None: the most promising of all."""

    @abstractmethod
    def progress(self) -> tuple[int, int, str]:
        """How much is done, of how much, and in words."""


def searched(tree: AnyTree, deadline: float, report: Report) -> tuple[AnyTree, dict[Pairs, Evaluation]]:
    """A search run until it is finished or the time is up, and its sets evaluated.

    Where compiled code and evaluation disagree on a set, an error in here, it must not hide others: anew without it.
    """
    while True:
        tree.run(deadline, report)
        evaluations = {}
        for done, pairs in enumerate(tree.found):
            if done and done % REPORT_EVERY == 0:
                report(done, len(tree.found), f"evaluating {len(tree.found)} sets")
            evaluations[pairs] = tree.problem.evaluation(pairs)
        wrong = frozenset(pairs for pairs, one in evaluations.items() if not satisfied(one))
        if not wrong:
            return tree, evaluations
        before, tree = tree, replace(tree, excluded=tree.excluded | wrong)  # from its beginning
        tree.counters["disagreements"] = before.counters["disagreements"] + len(wrong)


def halves(problem: Problem, domains: Domains, joint: int, number: int) -> list[Domains]:
    """Domains in two, parted in the middle of one number of a joint's drives."""
    values = problem.candidates.numbers[domains[joint].pairs, number]
    least, most = values.min(), values.max()
    middle = 0.5 * (least + most)
    return split(domains, joint, values <= (middle if middle < most else least))  # of neighbouring floats one of them


def split(domains: Domains, joint: int, mask: Mask) -> list[Domains]:
    """Domains in two: those of a joint's candidates that a mask names, and the rest."""
    return [with_domain(domains, joint, domains[joint].kept(np.asarray(one))) for one in (mask, ~mask)]


MISSES = 20  # dead ends on the way to the first sets
SMALL, EVERY = 16, 10**9  # candidates of a joint: so few are all tested again at every node, at the first node all
DESCEND = 3  # every third node of smallest bound is followed down to a set or a dead end
FEW = 1024  # sets of a node that are equals, judged one by one
COUNTED = 1000  # equals of the best set; of more nobody is told how many
COARSE = 0.05  # of what a node can still gain: open loads that matter less are decided one by one


@dataclass(frozen=True, eq=False)
class Bounded(Node):
    """A node with the ranges of its drives' numbers."""

    ranges: Ranges
    bound: float  # no feasible set in it has a smaller objective
    whole: bool = False  # whether its cheapest candidates are a feasible set


@dataclass
class Tree(BranchAndBound[Bounded]):
    """The search for the best sets, and what it found."""

    below: float = math.inf  # sets that cost as much are not wanted either
    best: list[Found] = field(default_factory=list, init=False)  # best first
    fine: bool = field(default=False, init=False)  # whether the last node was branched by a single load
    supply_binds: bool = field(default=False, init=False)  # whether the supply ruled out a set
    # pairs that were judged infeasible although the bounds passed them
    suspects: set[int] = field(default_factory=set, init=False)
    # feasible sets by level of objective, of nodes looked at; levels of which a node was left: none of it precedes the
    # best
    counted: Counter[int] = field(default_factory=Counter, init=False)
    uncounted: set[int] = field(default_factory=set, init=False)

    def copied(self) -> Tree:
        other = super().copied()
        other.best, other.counted, other.uncounted = list(self.best), Counter(self.counted), set(self.uncounted)
        return other

    @property
    def found(self) -> Sequence[Pairs]:
        return [one.pairs for one in self.best]

    @property
    def last(self) -> Found | None:
        """The last of the sets wanted; None while there are fewer."""
        return self.best[-1] if len(self.best) >= self.problem.wanted.sets else None

    @property
    def limit(self) -> float:
        """Sets that cost as much or more are of no interest; those that are equal to the last one are."""
        return self.below if self.last is None else min(self.below, (self.last.level + 0.5) * self.problem.step)

    @property
    def equals(self) -> tuple[int, bool]:
        """How many feasible sets share the best objective, and whether that is all of them or at least so many."""
        if not self.best:
            return 0, self.finished
        level = self.best[0].level
        known = sum(found.level == level for found in self.best)
        return max(self.counted[level], known), self.finished and level not in self.uncounted

    @property
    def finished(self) -> bool:
        """Whether no better set can be left."""
        return self.started and self._smallest >= self.limit

    @property
    def bound(self) -> float:
        """No feasible set has a smaller objective; infinite when there is proven to be none."""
        left = self._smallest if self.started else -math.inf
        return min([left, *(found.objective for found in self.best[:1])])

    @property
    def _smallest(self) -> float:
        """Bound of all that is left."""
        left = [self.open[0][0]] if self.open else []
        return min([*left, math.inf if self.following is None else self.following.bound])

    def first(self) -> None:
        root = self.narrowed(self.problem.domains(), 0, None)
        for full in (SMALL, EVERY):  # what is too dear is out before all of the rest are tested
            if root is None:
                return
            self._dive(root)
            root = self.narrowed(root.domains, EVERY if math.isinf(self.limit) else full, root)
        if root is not None:
            self.push(root)

    def order(self, node: Bounded) -> float:
        return node.bound

    def of_interest(self, node: Bounded) -> bool:
        return node.bound < self.limit

    def parts(self, node: Bounded) -> list[Bounded]:
        if node.whole:
            self.counted[self.problem.level(node.bound)] += 1
        if self._settled_equals(node):
            return []
        return [found for part in self._branches(node) if (found := self.narrowed(part, SMALL, node)) is not None]

    def followed(self, parts: Sequence[Bounded]) -> Bounded | None:
        if not parts or self.counters["descents"] % DESCEND:
            return None
        return parts[0] if self.fine else min(parts, key=lambda one: one.bound)

    def progress(self) -> tuple[int, int, str]:
        share = 0.0
        if self.best and self.best[0].objective > 0.0:
            share = min(max(self.bound / self.best[0].objective, 0.0), 1.0)
        return round(1000 * share), 1000, f"{self.counters['nodes']} nodes, {len(self.open)} open"

    def narrowed(self, domains: Domains, full: int, above: Bounded | None) -> Bounded | None:
        """What propagation leaves of some domains; a set that comes out of it is kept."""
        problem, limit = self.problem, self.limit
        left: Domains | None = domains if all(len(domain) for domain in domains) else None
        for constraint in problem.constraints:
            left = None if left is None else constraint.propagate(left, limit)
        if left is None:
            return None
        self.counters["nodes made"] += 1
        ranges = Ranges.unknown(problem.n) if above is None else above.ranges.copied()
        ordered = [domain.in_order() for domain in left] if problem.energy or problem.price else list(left)
        stiff, kept = without_soft(problem, tuple(ordered), limit)
        if stiff >= limit:
            return None
        left = Propagation(problem, list(kept), ranges, limit, full, self.suspects, self.counters).run()
        if left is None:
            return None
        least = sum(domain.least for domain in left)
        bound = max([least, stiff, *(constraint.bound(left, limit) for constraint in problem.constraints)])
        if bound >= limit or (self.supply_binds and not supply_may_be_feasible(problem, left, ranges)):
            return None
        node = Bounded(left, ranges, bound)
        if all(domain.settled for domain in left) and not self._open_loads(node).size:
            node = replace(node, whole=self._offer_cheapest(node))
        if self.accepts is None:
            return node
        decided = np.asarray([ranges.decided[loading].all() for loading in self.problem.loads])
        accepts = self.accepts.without_failing(left, decided)
        return node if accepts is left else self.narrowed(accepts, full, node)

    def _violated(self, domains: Domains) -> CommonParts | None:
        """A constraint that the cheapest candidates violate."""
        pairs = cheapest_pairs(domains)
        return next((one for one in self.problem.constraints if not one.satisfied(pairs)), None)

    def _open_loads(self, node: Bounded) -> Indices:
        """Joints whose drives load others and are not decided."""
        return np.flatnonzero(self.problem.loads.any(axis=0) & ~node.ranges.decided)

    def _offer_cheapest(self, node: Bounded) -> bool:
        """Keep the cheapest set of a node whose loads are decided, if it is among the best; whether it is feasible."""
        cheapest = [domain.kept(np.arange(len(domain)) == domain.cheapest) for domain in node.domains]
        if cheapest_pairs(cheapest) in self.excluded or self._violated(node.domains) is not None:
            return False
        found = next(feasible_sets(self.problem, tuple(cheapest), node.ranges, math.inf), None)
        self.supply_binds |= found is None
        return found is not None and self._offer(found)

    def _offer(self, found: Found) -> bool:
        """Keep a feasible set if it is among the best; whether it may be one."""
        if found.pairs in self.excluded:
            return False
        if (self.last is not None and found >= self.last) or found.pairs in {one.pairs for one in self.best}:
            return True
        if self.accepts is not None and not self.accepts(found.pairs):
            self.excluded |= {found.pairs}
            return False
        self.counters["sets that fit"] += 1
        self.best = sorted([*self.best, found])[: self.problem.wanted.sets]
        return True

    def _settled_equals(self, node: Bounded) -> bool:
        """Whether a node is done with: all of its sets are equals of the last one wanted, and few, or come after it."""
        problem, last = self.problem, self.last
        if last is None or node.bound < (last.level - 0.5) * problem.step:
            return False
        counting = self.accepts is None and last.level == self.best[0].level and self.counted[last.level] < COUNTED
        if not counting and least_joules(problem, node.domains, node.ranges) > last.joules:
            self.uncounted.add(last.level)
            return True
        if node.sets > FEW or not can_be_judged(problem, node.ranges.decided):
            return False
        found = sorted(feasible_sets(problem, node.domains, node.ranges, self.limit))
        self.counters["equal sets judged"] += len(found)
        self.counted[last.level] += sum([self._offer(one) for one in found]) - node.whole
        return True

    def _dive(self, node: Bounded) -> None:
        """Go for feasible sets: the cheapest candidate from the tip to the base, with what its load is known to cost.

        While sets are wanted at any cost it goes back at dead ends, else it ends there.
        """
        waiting: list[tuple[Domains, Bounded]] = []
        prices = self._prices(node)
        for _ in range(self.problem.n + self.problem.wanted.sets + MISSES):
            if node.bound >= self.limit:
                return
            loads = self._open_loads(node)
            alone = loads.size and self._violated(node.domains) is None
            parts = self._one_load(node, int(loads[-1]), prices) if alone else self._branches(node)
            kept = [*waiting, *((part, node) for part in reversed(parts))]
            waiting = kept if self.last is None else kept[-1:]
            found = None
            while waiting and found is None:
                part, above = waiting.pop()
                found = self.narrowed(part, SMALL, above)
            if found is None:
                return
            node = found

    def _prices(self, node: Bounded) -> Array | None:
        """What a unit of each number of a joint's drive makes the others cost; None while no set is known.

        What a joint costs in the best set over the least it may cost is put on the drives that load it, by their share.
        """
        if not self.best:
            return None
        best, reach = self.best[0], self.problem.reach
        gap = np.maximum(np.array(best.costs) - [domain.least for domain in node.domains], 0.0)
        heavier = np.abs(self.problem.candidates.numbers[list(best.pairs)] - node.ranges.low)
        total = np.einsum("jki,ki->j", reach, heavier)
        return np.einsum("j,jki->ki", gap / np.maximum(total, 1e-9), reach)

    def _branches(self, node: Bounded) -> list[Domains]:
        """A node in parts, each with less to be decided."""
        loads, violated = self._open_loads(node), self._violated(node.domains)
        self.fine = False
        if violated is not None:
            return violated.branch(node.domains)
        if not loads.size:
            return without_cheapest(node.domains)
        joint, number = self._widest(node)
        if self.fine:
            return self._one_load(node, int(loads[-1]))
        return halves(self.problem, node.domains, joint, number)

    def _widest(self, node: Bounded) -> tuple[int, int]:
        """The number of a joint's drive that loads the others most differently, by what each is known to cost."""
        least, room = np.array([domain.least for domain in node.domains]), self.limit - node.bound
        if math.isinf(room):
            room = 0.1 * abs(node.bound)
        costs = np.array(self.best[0].costs) if self.best else 2.0 * np.abs(least)
        # What a joint costs in the best set, over the least it may cost here, is there to be explained by its load.
        gap = np.maximum(costs - least, 0.0) + 1e-3 * room
        width = 0.5 * (node.ranges.high - node.ranges.low) * self.problem.reach
        total = width.sum(axis=(1, 2))
        self.fine = bool(np.abs(costs) @ total <= COARSE * room)
        effect = np.einsum("j,jki->ki", gap / np.maximum(total, 1e-300), width)
        joint, number = np.unravel_index(int(np.argmax(effect)), effect.shape)
        return int(joint), int(number)

    def _one_load(self, node: Bounded, joint: int, prices: Array | None = None) -> list[Domains]:
        """The candidates of a joint that load others as its cheapest does, and the rest; a load may have its price."""
        domain, problem = node.domains[joint], self.problem
        numbers, cheapest = problem.candidates.numbers, domain.cheapest
        if prices is not None:
            cost = domain.cost + np.abs(numbers[domain.pairs]) @ prices[joint]
            priced = replace(domain, cost=cost, exact=np.zeros_like(domain.exact))
            fits, _, _ = problem.presolved(joint, priced, math.inf, False, node.ranges.low, node.ranges.high)
            cheapest = int(np.argmin(np.where(fits, cost, math.inf)))
        same = (numbers[domain.pairs] == numbers[domain.pairs[cheapest]]).all(axis=1)
        return split(node.domains, joint, same)
