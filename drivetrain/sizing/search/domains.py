"""Domains of the branch and bound search: the remaining candidates of each joint, with bounds on their costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array, Indices, Mask

Pairs = tuple[int, ...]

UNPRICED = -1e300  # lower bound on an unknown cost: below every cost, and sums of it stay finite
UNTESTED, CHEAPEST, ALL = range(3)  # which candidates of a domain were tested against the current bounds


@dataclass(frozen=True, eq=False)
class Domain:
    """The remaining candidates of one joint, K of them."""

    pairs: Indices  # indices into the pairs of the study, (K,)
    cost: Array  # lower bound on the cost of each, (K,) or (K, criteria)
    exact: Mask  # whether the candidate was judged feasible and the cost is exact, (K,)
    lower_bound: float = UNPRICED  # lower bound on the cost of the joint
    tested: int = UNTESTED  # UNTESTED, CHEAPEST (those that may be the cheapest) or ALL

    def __len__(self) -> int:
        return len(self.pairs)

    @property
    def cheapest(self) -> int:
        """Index of the candidate of smallest cost."""
        return int(np.argmin(self.cost))

    @property
    def cheapest_is_exact(self) -> bool:
        """Whether the cheapest candidate is feasible with an exact cost."""
        return bool(self.exact[self.cheapest])

    def subset(self, mask: Mask) -> Domain:
        """The candidates of a mask; because the cheapest may be removed, the previous test no longer counts."""
        if mask.all():
            return self
        tested = UNTESTED if self.tested == CHEAPEST else self.tested
        return replace(self, pairs=self.pairs[mask], cost=self.cost[mask], exact=self.exact[mask], tested=tested)

    def below(self, cost_limit: float) -> Domain:
        """The candidates that cost less than a limit; the cheapest remains, so the previous test still counts."""
        mask = self.cost < cost_limit
        if mask.all():
            return self
        return replace(self, pairs=self.pairs[mask], cost=self.cost[mask], exact=self.exact[mask])

    def sorted_by_cost(self) -> Domain:
        """The same candidates, cheapest first."""
        order = np.argsort(self.cost, kind="stable")
        return replace(self, pairs=self.pairs[order], cost=self.cost[order], exact=self.exact[order])


Domains = tuple[Domain, ...]


def replace_domain(domains: Sequence[Domain], joint: int, domain: Domain) -> Domains:
    return (*domains[:joint], domain, *domains[joint + 1 :])


def cheapest_pairs(domains: Sequence[Domain]) -> tuple[int, ...]:
    return tuple(int(domain.pairs[domain.cheapest]) for domain in domains)


def exclude_cheapest(domains: Domains) -> list[Domains]:
    """Partition of all sets except the one of the cheapest candidates.

    In each part the joints after some joint have their cheapest candidate, and that joint has another one.
    """
    parts = []
    for joint in range(len(domains) - 1, -1, -1):
        is_cheapest = np.arange(len(domains[joint])) == domains[joint].cheapest
        if len(domains[joint]) > 1:
            parts.append(replace_domain(domains, joint, domains[joint].subset(~is_cheapest)))
        domains = replace_domain(domains, joint, domains[joint].subset(is_cheapest))
    return parts
