"""The candidates that are left at each joint: parts of them, the cheapest, the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

UNPRICED = -1e300  # least cost where none is known: below every cost, and sums of it stay finite
UNTESTED, CHEAPEST, ALL = range(3)


@dataclass(frozen=True, eq=False)
class Domain:
    """The candidates that are left at one joint, K of them."""

    pairs: Indices  # indices into the pairs of the study, (K,)
    cost: Array  # what each costs at least, (K,) or (K, criteria)
    exact: Mask  # whether that is what it costs, and it is feasible: all that loads the joint is decided, (K,)
    least: float = UNPRICED  # what the cheapest costs at least
    # which were held against the torque that is left possible: none (UNTESTED), those that might be the cheapest
    # (CHEAPEST) or ALL
    tested: int = UNTESTED

    def __len__(self) -> int:
        return len(self.pairs)

    @property
    def cheapest(self) -> int:
        """Place of the candidate that costs least."""
        return int(np.argmin(self.cost))

    @property
    def settled(self) -> bool:
        """Whether the cheapest candidate is known to be feasible and to cost that."""
        return bool(self.exact[self.cheapest])

    def kept(self, mask: Mask) -> Domain:
        """Some of the candidates; those left need not be the ones that were tested."""
        if mask.all():
            return self
        tested = UNTESTED if self.tested == CHEAPEST else self.tested
        return replace(self, pairs=self.pairs[mask], cost=self.cost[mask], exact=self.exact[mask], tested=tested)

    def below(self, limit: float) -> Domain:
        """The candidates that cost less than a limit; the cheapest stay, so what was tested was."""
        mask = self.cost < limit
        if mask.all():
            return self
        return replace(self, pairs=self.pairs[mask], cost=self.cost[mask], exact=self.exact[mask])

    def in_order(self) -> Domain:
        """The same, cheapest first."""
        order = np.argsort(self.cost, kind="stable")
        return replace(self, pairs=self.pairs[order], cost=self.cost[order], exact=self.exact[order])


Domains = tuple[Domain, ...]


def with_domain(domains: Sequence[Domain], joint: int, domain: Domain) -> Domains:
    """The same domains with another one at one joint."""
    return (*domains[:joint], domain, *domains[joint + 1 :])


def cheapest_pairs(domains: Sequence[Domain]) -> tuple[int, ...]:
    """The cheapest candidate of every joint."""
    return tuple(int(domain.pairs[domain.cheapest]) for domain in domains)


def without_cheapest(domains: Domains) -> list[Domains]:
    """All sets but that of the cheapest candidates, in parts: each differs from it first at another joint."""
    parts = []
    for joint in range(len(domains) - 1, -1, -1):
        first = np.arange(len(domains[joint])) == domains[joint].cheapest
        if len(domains[joint]) > 1:
            parts.append(with_domain(domains, joint, domains[joint].kept(~first)))
        domains = with_domain(domains, joint, domains[joint].kept(first))
    return parts
