"""What open choices leave possible: intervals of torque, candidates ruled out, least costs.

The torque on a joint is a weighted sum over the numbers of the drives that load it. While these are open, each number
lies between the smallest and the largest of the candidates left, so each sample's torque lies in an interval; a
candidate that is feasible nowhere within it is out, whatever the other drives will be. Fewer candidates leave narrower
intervals, and these fewer candidates: the passes repeat, from the tip to the base, until nothing changes.

A joint whose load is decided has an interval without width; its cheapest candidate is then judged.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.search.candidates import ALL, CHEAPEST, UNTESTED, Domain, Domains, Mask
from drivetrain.sizing.search.problem import Problem

PASSES = 8


@dataclass(frozen=True, eq=False)
class Ranges:
    """Smallest and largest number of the candidates left at each joint, (n, NUMBERS) each."""

    low: Array
    high: Array

    @classmethod
    def unknown(cls, n: int) -> Ranges:
        """Of candidates that nobody has looked at."""
        return cls(np.full((n, NUMBERS), math.nan), np.full((n, NUMBERS), math.nan))

    def copied(self) -> Ranges:
        """The same numbers in memory of their own."""
        return Ranges(self.low.copy(), self.high.copy())

    @property
    def decided(self) -> Mask:
        """Whether the drive of each joint loads others as only one candidate does, (n,)."""
        return np.asarray((self.low == self.high).all(axis=1))


@dataclass
class Propagation:
    """The domains of one node while they shrink."""

    problem: Problem  # what is chosen from
    domains: list[Domain]  # what is left
    ranges: Ranges  # of what is left
    limit: float  # sets that cost as much or more are of no interest
    full: int  # so many candidates of a joint are all tested, of more only those that may be the cheapest
    suspects: set[int]  # pairs that were judged infeasible although the bounds let them pass
    counters: Counter[str] = field(default_factory=Counter)  # work done

    def run(self) -> Domains | None:
        """Rule out candidates until nothing changes; None where no set below the limit is left."""
        n = self.problem.n
        for joint in range(n):
            self._new_range(joint)
        for _ in range(PASSES):
            self.counters["passes"] += 1
            changed = False
            for joint in range(n - 1, -1, -1):
                before = self.domains[joint]
                if not self._narrowed(joint):
                    return None
                domain = self.domains[joint]
                changed |= domain.least > before.least
                if self._least >= self.limit:
                    return None
                if len(domain) != len(before):
                    changed |= self._new_range(joint)
            if not changed:
                break
        return tuple(self.domains)

    @property
    def _least(self) -> float:
        return sum(domain.least for domain in self.domains)

    def _narrowed(self, joint: int) -> bool:
        """Test the candidates of a joint, judge the cheapest where its load is decided; whether any is left."""
        domain, room = self.domains[joint], self.limit - (self._least - self.domains[joint].least)
        wanted = ALL if len(domain) <= self.full else CHEAPEST
        domain = self._tested(joint, domain, room, wanted) if domain.tested < wanted else domain.below(room)
        loading = self.problem.loads[joint]
        if len(domain) and not domain.settled and self.ranges.decided[loading].all():
            # Short of a whole set the bounds are nearly as good as a judgement, and far cheaper.
            suspect = int(domain.pairs[domain.cheapest]) in self.suspects
            if not loading.any() or suspect or self.ranges.decided[self.problem.loads.any(axis=0)].all():
                domain = self._settled(joint, domain, room)
        if not len(domain):
            return False
        self.domains[joint] = replace(domain, least=max(domain.least, float(domain.cost.min())))
        return True

    def _tested(self, joint: int, domain: Domain, room: float, wanted: int) -> Domain:
        """The candidates that may be part of a set within the limit."""
        kept, cost, count = self.problem.presolved(
            joint, domain, room, wanted == ALL, self.ranges.low, self.ranges.high
        )
        self.counters["candidates tested"] += count
        return replace(domain, pairs=domain.pairs[kept], cost=cost[kept], exact=domain.exact[kept], tested=wanted)

    def _settled(self, joint: int, domain: Domain, room: float) -> Domain:
        """Judge the cheapest candidates of a joint until the cheapest is known to be feasible."""
        problem = self.problem
        while len(domain) and not domain.settled:
            best, cost, exact = domain.cheapest, domain.cost.copy(), domain.exact.copy()
            pairs = domain.pairs[best : best + 1]
            used, energy, price = problem.judged(joint, pairs, self.ranges.low)
            self.counters["candidates judged"] += 1
            cost[best], exact[best] = problem.cost(pairs, energy, price)[0], True
            domain = replace(domain, cost=cost, exact=exact)
            if used[0] == math.inf:
                self.suspects.add(int(pairs[0]))
                domain = domain.kept(np.arange(len(domain)) != best)
                if domain.tested == UNTESTED:  # bounds of what comes now are far cheaper than judging it
                    domain = self._tested(joint, domain, room, CHEAPEST)
        return domain

    def _new_range(self, joint: int) -> bool:
        """The range of the numbers left at a joint; where it changes, candidates that it loads are tested again."""
        least, most = self.problem.range_of(self.domains[joint])
        if (least == self.ranges.low[joint]).all() and (most == self.ranges.high[joint]).all():
            return False
        self.ranges.low[joint], self.ranges.high[joint] = least, most
        for other in np.flatnonzero(self.problem.loads[:, joint]):
            self.domains[other] = replace(self.domains[other], tested=UNTESTED)
        return True
