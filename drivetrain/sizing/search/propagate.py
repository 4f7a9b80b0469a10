"""What open choices leave possible: intervals of torque, candidates ruled out, least costs.

The torque on a joint is a weighted sum over the numbers of the drives that load it. While these are open, each number
lies between the smallest and the largest of the candidates left, so each sample's torque lies in an interval; a
candidate that is feasible nowhere within it is out, whatever the other drives will be. Fewer candidates leave narrower
intervals, and these fewer candidates: the passes repeat, from the tip to the base, until nothing changes.

A joint whose load is decided has an interval without width; its cheapest candidate is then judged.

The supply is held against whole sets, and against what open choices leave possible. A drive takes at least what it
gives to the link and to its rotor; losses only add to that. Where few candidates are left at a joint the copper loss of
the best of them is counted too. The most that it takes, which is the least that it feeds back, needs the losses of
every candidate: it is known where not too many are left, each no hotter than it may be.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.friction import friction_torque
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.checks import SUPPLY_CHECKS
from drivetrain.sizing.judge.verdicts import standby_power, supply_checks
from drivetrain.sizing.search.bounds import power_ends
from drivetrain.sizing.search.domains import ALL, CHEAPEST, UNTESTED, Domain, Domains, Mask
from drivetrain.sizing.search.problem import Problem

PASSES = 8
FEW, SOME = 24, 256  # candidates of a joint whose losses are counted one by one, and where the most is wanted too


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
                domain = self._settled(joint, domain)
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

    def _settled(self, joint: int, domain: Domain) -> Domain:
        """Judge the cheapest candidates of a joint until the cheapest is known to be feasible."""
        problem, cost, exact = self.problem, domain.cost.copy(), domain.exact.copy()
        while True:
            best = int(np.argmin(cost))
            if exact[best]:
                break
            pairs = domain.pairs[best : best + 1]
            used, energy, price = problem.judged(joint, pairs, self.ranges.low)
            self.counters["candidates judged"] += 1
            cost[best], exact[best] = problem.cost(pairs, energy, price)[0], True
            if used[0] == math.inf:
                cost[best] = math.inf
                self.suspects.add(int(pairs[0]))
        return replace(domain, cost=cost, exact=exact).below(math.inf)

    def _new_range(self, joint: int) -> bool:
        """The range of the numbers left at a joint; where it changes, candidates that it loads are tested again."""
        least, most = self.problem.range_of(self.domains[joint])
        if (least == self.ranges.low[joint]).all() and (most == self.ranges.high[joint]).all():
            return False
        self.ranges.low[joint], self.ranges.high[joint] = least, most
        for other in np.flatnonzero(self.problem.loads[:, joint]):
            self.domains[other] = replace(self.domains[other], tested=UNTESTED)
        return True


# The supply


def supply_limited(problem: Problem) -> bool:
    """Whether the supply has a limit that sets can be held against."""
    supply = problem.candidates.study.supply
    return problem.candidates.power_known and any(getattr(supply, row.limit) is not None for row in SUPPLY_CHECKS)


def supply_use(problem: Problem, power: Array) -> float:
    """The largest utilisation of a limited supply by the power of all drives together, and the least [W], (2, N)."""
    checks = supply_checks(problem.candidates.study, power)
    return max((check.utilisation for check in checks if check.utilisation is not None), default=0.0)


def supply_may_be_feasible(problem: Problem, domains: Domains, ranges: Ranges) -> bool:
    """Whether some set of what is left may ask no more of the supply than it gives."""
    study, supply = problem.candidates.study, problem.candidates.study.supply
    if not supply_limited(problem):
        return True
    back, electronics = supply.regenerated_power, standby_power(study)
    least, most = power_range(problem, domains, ranges, most=back is not None)
    weights, over = study.cycle.weights, 1.0 + 1e-6
    drawn, fed_back = np.maximum(least + electronics, 0.0), np.maximum(-most - electronics, 0.0)
    if supply.peak_power is not None and drawn.max() > supply.peak_power * over:
        return False
    duration = float(weights.sum()) or math.inf
    if supply.mean_power is not None and float(drawn @ weights) / duration > supply.mean_power * over:
        return False
    return back is None or float(fed_back @ weights) / duration <= back * over


def power_range(problem: Problem, domains: Domains, ranges: Ranges, *, most: bool) -> tuple[Array, Array]:
    """Bounds of the power of all joints together at each sample [W], the upper one infinite where it is not known."""
    offered = problem.candidates
    samples = len(offered.study.cycle.time)
    lower, upper = np.zeros(samples), np.full(samples, 0.0 if most else np.inf)
    for joint, domain in enumerate(domains):
        offer, least, largest = offered.joints[joint], np.zeros(samples), np.full(samples, np.inf)
        torque = offer.interval(ranges.low, ranges.high)
        if len(domain) <= (SOME if most else FEW):
            power_ends(offer.records, domain.pairs, least, largest)
        else:
            least = _lossless(problem, joint, domain, torque, ranges)
        lower += least
        upper += largest
    return lower, upper


def _lossless(problem: Problem, joint: int, domain: Domain, torque: tuple[Array, Array], ranges: Ranges) -> Array:
    """The least power that a joint's link and any of its rotors take, without losses [W], (N,)."""
    offer, (low, high) = problem.candidates.joints[joint], torque
    for i, unit in enumerate(offer.work.added.torque):  # what its own drive asks, where it rides on the moved link
        ends = np.stack([ranges.low[joint, i] * unit, ranges.high[joint, i] * unit])
        low, high = low + ends.min(axis=0), high + ends.max(axis=0)
    motion, ratio = offer.work.motion, problem.candidates.ratio[domain.pairs]
    speed, inertia = motion.speed, problem.candidates.numbers[domain.pairs, 3]
    friction = friction_torque(offer.demand.friction, speed)
    least = (np.where(speed > 0.0, low, high) + friction) * speed
    for factor, row in ((inertia * ratio**2, motion.acceleration), (inertia * ratio, motion.carrier_acceleration)):
        least += np.minimum(factor.min() * row * speed, factor.max() * row * speed)
    return least
