"""Branch and bound over the choices of all joints, with the open choice that can be proven best looked at first.

A node is a set of candidates at every joint, with all that propagation rules out taken out. Nodes are parted where the
open choice loads the other joints most differently: many candidates fall together, before any is looked at alone.
Once every load is decided the cheapest candidates that hold are a set of drives; what is left of such a node is parted
so that no set comes up twice.
"""

from __future__ import annotations

import heapq
import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.search.choices import (
    all_choices,
    answered,
    cheapest,
    chosen,
    closed_up,
    least_cost,
    others,
    segment,
)
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.search.propagation import ASKED, JUDGED, OPEN, PASSES, TESTED, Choices, Indices, propagate
from drivetrain.sizing.search.spare_parts import Rule, least_under, narrowed_by, parted_by

TELL_EVERY = 50  # nodes
MISSES = 20  # dead ends on the way to the first sets
SMALL = 16  # candidates of a joint: so few are all tested again at every node
DESCEND = 3  # every third node of smallest bound is followed down to a set or a dead end
PASSES_MOST = 8
COARSE = 0.05  # of what a node can still gain: open loads that matter less are decided one by one

Tell = Callable[[int, int, str], None]
Pairs = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Node:
    """A part of all sets.

    Attributes:
        bound: No set in it that holds has a smaller objective.
        limit: With which candidates were ruled out.
        choices: The candidates left.
        low, high: Of their numbers, (n, NUMBERS).
    """

    bound: float
    limit: float
    choices: Choices
    low: Array
    high: Array


@dataclass(frozen=True, order=True)
class Found:
    """One set that holds.

    Attributes:
        objective: Of the set, with the trifles that put equals in order.
        pairs: One a joint.
        costs: What each adds to it.
    """

    objective: float
    pairs: Pairs
    costs: tuple[float, ...] = field(default=(), compare=False)


@dataclass
class Tree:
    """The search and what it found; it can be stopped between two nodes and go on.

    Attributes:
        problem: What is chosen from.
        excluded: Sets that are not to be found.
        best: The best sets so far, best first.
        open: Nodes that are left, smallest bound first.
        following: The node that a descent goes on with.
        started: Whether the first node was made.
        fine: Whether the last node was parted by a single load.
        supply_binds: Whether the supply ruled out a set.
        asks: What the Python road said, by joint, pair and the drives in place.
        counters: Work done.
    """

    problem: Problem
    excluded: frozenset[Pairs] = frozenset()
    best: list[Found] = field(default_factory=list)
    open: list[tuple[float, int, Node]] = field(default_factory=list)
    following: Node | None = None
    started: bool = False
    fine: bool = False
    supply_binds: bool = False
    asks: dict[tuple[int, int, bytes], bool] = field(default_factory=dict)
    counters: Counter[str] = field(default_factory=Counter)

    def copied(self) -> Tree:
        """The same search, to go on without touching this one."""
        return replace(
            self, best=list(self.best), open=list(self.open), asks=dict(self.asks), counters=Counter(self.counters)
        )

    @property
    def limit(self) -> float:
        """Sets that cost as much or more are of no interest."""
        if len(self.best) < self.problem.wanted.sets:
            return math.inf
        last = self.best[-1].objective
        return last - 2e-15 * abs(last)  # what is equal but for rounding is no better

    @property
    def finished(self) -> bool:
        """Whether no better set can be left."""
        return self.started and self._smallest >= self.limit

    @property
    def bound(self) -> float:
        """No set that holds has a smaller objective; infinite when there is proven to be none."""
        left = self._smallest if self.started else -math.inf
        return min([left, *(found.objective for found in self.best[:1])])

    @property
    def _smallest(self) -> float:
        """Bound of all that is left."""
        left = [self.open[0][0]] if self.open else []
        return min([*left, math.inf if self.following is None else self.following.bound])

    def run(self, deadline: float, tell: Tell) -> None:
        """Search until it is finished or the time is up.

        Args:
            deadline: On the clock of ``time.perf_counter`` [s]; one step is made whatever it says.
        """
        self.begin()
        while not self.finished:
            node = self._next()
            if self.counters["nodes"] % TELL_EVERY == 0:
                self._tell(tell)
            parts = [found for part in self._parts(node) if (found := self._narrowed(part, SMALL, node)) is not None]
            if parts and self.counters["descents"] % DESCEND == 0:
                self.following = parts[0] if self.fine else min(parts, key=lambda one: one.bound)
            for part in parts:
                if part is not self.following:
                    self._push(part)
            if time.perf_counter() >= deadline:
                return

    def _next(self) -> Node:
        """The node to look at: the one of smallest bound, or the one that a descent goes on with."""
        self.counters["nodes"] += 1
        node, self.following = self.following, None
        if node is not None and node.bound < self.limit:
            return node
        self.counters["descents"] += 1
        return heapq.heappop(self.open)[2]

    def begin(self) -> None:
        """Make the first node, and the first sets to hold others against."""
        if self.started:
            return
        self.started = True
        if any(len(pairs) == 0 for pairs in self.problem.known):
            return
        root = self._narrowed(all_choices(self.problem.known, self.problem.setting), 0, None)
        if root is None:
            return
        self._dive(root)
        root = self._narrowed(root.choices, np.iinfo(np.int64).max, root)
        if root is not None and not math.isinf(self.limit):
            self._dive(root)
            root = self._narrowed(root.choices, np.iinfo(np.int64).max, root)
        self._push(root)

    def _push(self, node: Node | None) -> None:
        if node is not None:
            # Of equals the youngest first: it is nearest to a set.
            self.counters["pushed"] += 1
            heapq.heappush(self.open, (node.bound, -self.counters["pushed"], node))

    def _narrowed(self, choices: Choices, full: int, above: Node | None) -> Node | None:
        """What propagation leaves of some choices; a set that comes out of it is kept."""
        if not choices.size.all():
            return None
        narrow = self._by_rules(choices)
        if narrow is None:
            return None
        choices = narrow
        memory, task, setting = self.problem.memory, self.problem.packed.task, self.problem.setting
        self.counters["nodes made"] += 1
        memory.counts[:] = 0
        limit = self.limit
        choices = closed_up(choices, in_order=setting.energy != 0.0)
        memory.low[:], memory.high[:] = (math.nan, math.nan) if above is None else (above.low, above.high)
        code = ASKED
        while code == ASKED:
            code, joint = propagate(task, setting, choices, limit, full, PASSES_MOST, memory)
            if code == ASKED:
                self._ask(choices, joint)
        for name, index in (("candidates tested", TESTED), ("candidates judged", JUDGED), ("passes", PASSES)):
            self.counters[name] += int(memory.counts[index])
        if code != OPEN:
            return None
        choices = closed_up(choices)
        bound = max([float(choices.least.sum()), *(least_under(rule, choices, limit) for rule in self.problem.rules)])
        if bound >= limit or (self.supply_binds and not self.problem.supply_may_hold(choices)):
            return None
        node = Node(bound, limit, choices, memory.low.copy(), memory.high.copy())
        if self._decided(node):
            self._offer(node)
        return node

    def _by_rules(self, choices: Choices) -> Choices | None:
        """What the rules for all joints together leave; None where they leave nothing."""
        for rule in self.problem.rules:
            narrow = narrowed_by(rule, choices, self.limit)
            if narrow is None:
                return None
            choices = narrow
        return choices

    def _broken(self, choices: Choices) -> Rule | None:
        """A rule that the cheapest candidates break."""
        pairs = [cheapest(choices, joint) for joint in range(self.problem.n)]
        return next((rule for rule in self.problem.rules if not rule.allows(pairs)), None)

    def _ask(self, choices: Choices, joint: int) -> None:
        """Let the Python road say whether a candidate holds; one that does not is taken out."""
        pair = -2 - int(choices.known[joint])
        drives = {k: cheapest(choices, k) for k in range(self.problem.n) if k != joint}
        key = (joint, pair, self.problem.numbers(drives).tobytes())
        if key not in self.asks:
            self.counters["asked of the exact road"] += 1
            self.asks[key] = self.problem.holds(joint, pair, drives)
        answered(choices, joint, pair, self.asks[key])

    def _decided(self, node: Node) -> bool:
        """Whether every load is decided, and the cheapest candidates are known to hold."""
        settled = [int(node.choices.known[joint]) == cheapest(node.choices, joint) for joint in range(self.problem.n)]
        return all(settled) and not self._open_loads(node).size

    def _open_loads(self, node: Node) -> Indices:
        """Joints whose drives load others and are not decided."""
        loads = self.problem.setting.loads.any(axis=0)
        return np.flatnonzero(loads & (node.low != node.high).any(axis=1))

    def _offer(self, node: Node) -> None:
        """Keep the cheapest set of a node whose loads are decided, if it is among the best."""
        pairs = tuple(cheapest(node.choices, joint) for joint in range(self.problem.n))
        if (
            self._broken(node.choices) is not None
            or pairs in self.excluded
            or any(found.pairs == pairs for found in self.best)
        ):
            return
        if not self.problem.supply_holds(pairs):
            self.supply_binds = True
            return
        self.counters["sets that fit"] += 1
        costs = np.array([least_cost(node.choices, joint) for joint in range(self.problem.n)])
        found = Found(float(costs.sum()), pairs, tuple(costs.tolist()))
        self.best = sorted([*self.best, found])[: self.problem.wanted.sets]

    def _dive(self, node: Node | None) -> None:
        """Go for sets that hold: the cheapest candidate from the tip to the base."""
        for _ in range(self.problem.n + self.problem.wanted.sets + MISSES):
            if node is None or node.bound >= self.limit:
                return
            loads = self._open_loads(node)
            alone = loads.size and self._broken(node.choices) is None
            parts = self._one_load(node, int(loads[-1])) if alone else self._parts(node)
            node = next((found for part in parts if (found := self._narrowed(part, SMALL, node)) is not None), None)

    def _parts(self, node: Node) -> list[Choices]:
        """A node in parts, each with less to be decided."""
        loads, broken = self._open_loads(node), self._broken(node.choices)
        if broken is not None:
            self.fine = False
            return parted_by(broken, node.choices)
        if not loads.size:
            self.fine = False
            return others(node.choices)
        joint, number = self._widest(node)
        if self.fine:
            return self._one_load(node, int(loads[-1]))
        pool = segment(node.choices, joint)
        values = self.problem.packed.task.numbers[pool, number]
        below = values <= 0.5 * (node.low[joint, number] + node.high[joint, number])
        return [chosen(node.choices, joint, below), chosen(node.choices, joint, ~below)]

    def _widest(self, node: Node) -> tuple[int, int]:
        """The joint and the number of its drive whose range may hide most of what a node can still gain."""
        least, room = np.array(node.choices.least), self.limit - node.bound
        if math.isinf(room):
            room = 0.1 * abs(node.bound)
        costs = np.array(self.best[0].costs) if self.best else 2.0 * np.abs(least)
        # What a joint costs in the best set, over the least it may cost here, is there to be explained by its load.
        gap = np.maximum(costs - least, 0.0) + 1e-3 * room
        width = 0.5 * (node.high - node.low) * self.problem.reach
        total = width.sum(axis=(1, 2))
        self.fine = bool(np.abs(costs) @ total <= COARSE * room)
        effect = np.einsum("j,jki->ki", gap / np.maximum(total, 1e-300), width)
        joint, number = np.unravel_index(int(np.argmax(effect)), effect.shape)
        return int(joint), int(number)

    def _one_load(self, node: Node, joint: int) -> list[Choices]:
        """The candidates of a joint that load others as its cheapest does, and the rest."""
        numbers = self.problem.packed.task.numbers
        same = (numbers[segment(node.choices, joint)] == numbers[cheapest(node.choices, joint)]).all(axis=1)
        return [chosen(node.choices, joint, same), chosen(node.choices, joint, ~same)]

    def _tell(self, tell: Tell) -> None:
        share = 0.0
        if self.best and self.best[0].objective > 0.0:
            share = min(max(self.bound / self.best[0].objective, 0.0), 1.0)
        tell(round(1000 * share), 1000, f"{self.counters['nodes']} nodes, {len(self.open)} open")
