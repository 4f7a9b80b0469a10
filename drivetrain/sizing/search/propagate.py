"""Constraint propagation at one node of the search: interval bounds on the loads rule out candidates.

The torque on a joint is linear in the load parameters of the drives that load it. While these drives are not chosen,
each parameter lies between its smallest and largest value among the remaining candidates, so the torque at each sample
lies in an interval. A candidate that is infeasible everywhere in that interval is removed. Fewer candidates give
narrower intervals, so the joints are visited from the tip to the base: drives load the joints before them.

The load of a joint is decided when its interval has no width. The cheapest candidate of such a joint is judged exactly.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array, Mask
from drivetrain.sizing.demand.load_basis import PARAMETERS
from drivetrain.sizing.search.domains import ALL, CHEAPEST, UNTESTED, Domain, Domains
from drivetrain.sizing.search.problem import Problem


@dataclass(frozen=True, eq=False)
class ParameterRanges:
    """Smallest and largest load parameters among the remaining candidates of each joint, (n, PARAMETERS) each."""

    low: Array
    high: Array

    @classmethod
    def unknown(cls, n: int) -> ParameterRanges:
        """Ranges that were not computed yet, all NaN."""
        return cls(np.full((n, PARAMETERS), math.nan), np.full((n, PARAMETERS), math.nan))

    def copy(self) -> ParameterRanges:
        return ParameterRanges(self.low.copy(), self.high.copy())

    @property
    def decided(self) -> Mask:
        """Whether all remaining candidates of each joint load the other joints equally, (n,)."""
        return np.asarray((self.low == self.high).all(axis=1))


@dataclass
class Propagation:
    """Constraint propagation on the domains of one node; ``domains`` and ``ranges`` are updated in place."""

    problem: Problem  # the selection problem
    domains: list[Domain]  # remaining candidates by joint
    ranges: ParameterRanges  # load parameter ranges of the remaining candidates
    limit: float  # sets whose objective is this large or larger are rejected
    full_test_size: int  # a larger domain is tested only for the candidates that may be its cheapest
    suspects: set[int]  # pairs that passed the bounds and were then judged infeasible
    counters: Counter[str] = field(default_factory=Counter)  # work done

    def run(self) -> Domains | None:
        """Remove candidates from the tip to the base; None if no set below the limit remains.

        One pass is enough while loads are open, as the node is branched and its children are propagated. Once all are
        decided, the cheapest candidate of every joint is judged.
        """
        for joint in range(self.problem.n):
            self._update_range(joint)
        while self._pass():
            if not self._loads_decided or all(domain.cheapest_is_exact for domain in self.domains):
                return tuple(self.domains)
        return None

    def _pass(self) -> bool:
        """Remove candidates of every joint; False if no set below the limit remains."""
        self.counters["passes"] += 1
        for joint in range(self.problem.n - 1, -1, -1):
            before = len(self.domains[joint])
            if not self._filter(joint) or self._lower_bound >= self.limit:
                return False
            if len(self.domains[joint]) != before:
                self._update_range(joint)
        return True

    @property
    def _loads_decided(self) -> bool:
        return bool(self.ranges.decided[self.problem.is_loaded_by.any(axis=0)].all())

    @property
    def _lower_bound(self) -> float:
        return sum(domain.lower_bound for domain in self.domains)

    def _filter(self, joint: int) -> bool:
        """Remove candidates of a joint by bounds, and judge its cheapest if its load is decided; False if none is left.

        While another joint's load is open, the cheapest candidate is judged only if no drive loads the joint or the
        candidate is a suspect: the bounds are nearly as tight as a judgement and far cheaper.
        """
        problem, domain = self.problem, self.domains[joint]
        cost_limit = self.limit - (self._lower_bound - domain.lower_bound)
        level = ALL if len(domain) <= self.full_test_size else CHEAPEST
        if domain.tested < level:
            domain = self._presolve(joint, domain, cost_limit, level)
        else:
            domain = domain.below(cost_limit)
        decided, loaded_by = self.ranges.decided, problem.is_loaded_by[joint]
        if len(domain) and not domain.cheapest_is_exact and decided[loaded_by].all():
            is_suspect = int(domain.pairs[domain.cheapest]) in self.suspects
            if not loaded_by.any() or is_suspect or self._loads_decided:
                domain = self._judge_cheapest(joint, domain, cost_limit)
        if not len(domain):
            return False
        self.domains[joint] = replace(domain, lower_bound=max(domain.lower_bound, float(domain.cost.min())))
        return True

    def _presolve(self, joint: int, domain: Domain, cost_limit: float, level: int) -> Domain:
        """Keep the candidates that pass the bounds and cost less than a limit."""
        kept, cost, count = self.problem.presolve(
            joint, domain, cost_limit, level == ALL, self.ranges.low, self.ranges.high
        )
        self.counters["candidates tested"] += count
        return replace(domain, pairs=domain.pairs[kept], cost=cost[kept], exact=domain.exact[kept], tested=level)

    def _judge_cheapest(self, joint: int, domain: Domain, cost_limit: float) -> Domain:
        """Judge the cheapest candidate, remove it if infeasible, and repeat until the cheapest is feasible."""
        problem = self.problem
        while len(domain) and not domain.cheapest_is_exact:
            best, cost, exact = domain.cheapest, domain.cost.copy(), domain.exact.copy()
            pairs = domain.pairs[best : best + 1]
            utilisation, energy, price = problem.judge(joint, pairs, self.ranges.low)
            self.counters["candidates judged"] += 1
            cost[best], exact[best] = problem.cost(pairs, energy, price)[0], True
            domain = replace(domain, cost=cost, exact=exact)
            if utilisation[0] == math.inf:
                self.suspects.add(int(pairs[0]))
                domain = domain.subset(np.arange(len(domain)) != best)
                if domain.tested == UNTESTED:  # bounds on the next cheapest are far cheaper than judging it
                    domain = self._presolve(joint, domain, cost_limit, CHEAPEST)
        return domain

    def _update_range(self, joint: int) -> None:
        """Recompute the parameter range of a joint; if it changed, the joints that it loads must be tested again."""
        low, high = self.problem.range_of(self.domains[joint])
        if (low == self.ranges.low[joint]).all() and (high == self.ranges.high[joint]).all():
            return
        self.ranges.low[joint], self.ranges.high[joint] = low, high
        for other in np.flatnonzero(self.problem.is_loaded_by[:, joint]):
            self.domains[other] = replace(self.domains[other], tested=UNTESTED)
