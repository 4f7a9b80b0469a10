"""Branch and bound, one engine: for one optimum, for the k best sets, for the Pareto front.

A node is a part of all sets of drives. What it is bounded by, what can be taken out of it, how it is parted and when
nothing is left of interest, the trees say: ``tree.py`` for the best sets, ``front_tree.py`` for the front.
"""

from __future__ import annotations

import copy
import heapq
import math
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, Self, TypeVar

import numpy as np

from drivetrain.sizing.search.domains import Domains, Mask, with_domain
from drivetrain.sizing.search.often_enough import OftenEnough
from drivetrain.sizing.search.problem import Problem

TELL_EVERY = 50  # nodes

Pairs = tuple[int, ...]
Tell = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Node:
    """A part of all sets: every combination of the candidates left."""

    domains: Domains

    @property
    def sets(self) -> int:
        """How many sets it has."""
        return math.prod(len(domain) for domain in self.domains)


AnyNode = TypeVar("AnyNode", bound=Node)


@dataclass
class BranchAndBound(ABC, Generic[AnyNode]):
    """A search and what it has left; it can be stopped between two nodes and go on."""

    problem: Problem  # what is chosen from
    excluded: frozenset[Pairs] = frozenset()  # sets that are not to be found
    often: OftenEnough | None = None  # None where it is not asked whether sets are feasible often enough
    counters: Counter[str] = field(default_factory=Counter, init=False)  # work done
    open: list[tuple[float, int, AnyNode]] = field(default_factory=list, init=False)  # most promising first
    following: AnyNode | None = field(default=None, init=False)  # that a descent goes on with
    started: bool = field(default=False, init=False)

    def run(self, deadline: float, tell: Tell) -> None:
        """Search until it is finished or the time is up; one step is made whatever the deadline (``perf_counter``)."""
        self.begin()
        while not self.finished:
            node = self._next()
            if self.counters["nodes"] % TELL_EVERY == 0:
                tell(*self.progress())
            parts = self.parts(node)
            self.following = self.followed(parts)
            for part in parts:
                if part is not self.following:
                    self.push(part)
            if time.perf_counter() >= deadline:
                return

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


def halves(problem: Problem, domains: Domains, joint: int, number: int) -> list[Domains]:
    """Domains in two, parted in the middle of one number of a joint's drives."""
    values = problem.candidates.numbers[domains[joint].pairs, number]
    least, most = values.min(), values.max()
    middle = 0.5 * (least + most)
    return split(domains, joint, values <= (middle if middle < most else least))  # of neighbouring floats one of them


def split(domains: Domains, joint: int, mask: Mask) -> list[Domains]:
    """Domains in two: those of a joint's candidates that a mask names, and the rest."""
    return [with_domain(domains, joint, domains[joint].kept(np.asarray(one))) for one in (mask, ~mask)]
