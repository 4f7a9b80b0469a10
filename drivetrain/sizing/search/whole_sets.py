"""Whole sets of drives: every one of a few candidates a joint, judged exactly, and the order in which sets come.

Sets whose objectives are equal come in the order of their energy a cycle, those of equal energy in that of their
largest utilisation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.search.arm_wishes import arm_use
from drivetrain.sizing.search.branch_and_bound import Pairs
from drivetrain.sizing.search.domains import Domains, Mask
from drivetrain.sizing.search.problem import ROUNDING, Problem
from drivetrain.sizing.search.propagate import Ranges, supply_limited, supply_use


@dataclass(frozen=True, order=True)
class Found:
    """One feasible set."""

    level: int  # its objective and its energy a cycle in steps within which both are equal
    joules: int
    used: float  # its largest utilisation
    pairs: Pairs  # one a joint
    objective: float = field(compare=False)  # of the set
    costs: tuple[float, ...] = field(compare=False)  # what each pair adds to it


@dataclass(frozen=True, eq=False)
class _Chosen:
    """Pairs of the last joints, with all that they ask."""

    pairs: Pairs  # of the joints chosen
    costs: tuple[float, ...]
    numbers: Array  # of all joints' drives, those of the node where none is chosen, (n, NUMBERS)
    energy: float  # a cycle [J]
    used: float  # largest utilisation
    power: Array  # electrical, and the least [W], (2, N); (1,) where the supply has no limit


def can_be_judged(problem: Problem, decided: Mask) -> bool:
    """Whether the load of every joint is decided by what is, and by the drives of the joints after it."""
    return not np.tril(problem.loads, -1)[:, ~decided].any()


def feasible_sets(problem: Problem, domains: Domains, ranges: Ranges, limit: float) -> Iterator[Found]:
    """Every feasible set of some domains below a limit, judged joint by joint from the tip to the base.

    Args:
        domains: Of few sets; see ``can_be_judged``.
        ranges: Of their numbers.
        limit: Sets that cost as much are not wanted.
    """
    least, limited = np.cumsum([0.0, *(domain.least for domain in domains)]), supply_limited(problem)

    def chosen(joint: int, after: _Chosen) -> Iterator[_Chosen]:
        if joint < 0:
            yield after
            return
        spent = sum(after.costs) + least[joint]
        pairs = domains[joint].below(limit - spent).pairs
        used, energy, price = problem.judged(joint, pairs, after.numbers)
        cost = problem.cost(pairs, energy, price)
        kept = np.isfinite(used) & (cost + spent < limit)
        pairs, used, energy, cost = pairs[kept], used[kept], energy[kept], cost[kept]
        power = problem.power_of(joint, pairs, after.numbers) if limited else np.zeros(len(pairs))
        for at in range(len(pairs)):
            pair, numbers = int(pairs[at]), after.numbers.copy()
            numbers[joint] = problem.candidates.numbers[pair]
            one = _Chosen(
                (pair, *after.pairs), (float(cost[at]), *after.costs), numbers, after.energy + energy[at],
                max(after.used, used[at]), after.power + power[at],
            )  # fmt: skip
            yield from chosen(joint - 1, one)

    for one in chosen(problem.n - 1, _Chosen((), (), ranges.low.copy(), 0.0, 0.0, np.zeros(1))):
        used = max(one.used, supply_use(problem, one.power)) if limited else one.used
        if used > 1.0 or not all(constraint.satisfied(one.pairs) for constraint in problem.constraints):
            continue
        used = max(used, arm_use(problem, one.pairs))
        if used <= 1.0:
            cost, joules = sum(one.costs), math.floor(one.energy / problem.joules + 0.5)
            yield Found(problem.level(cost), joules, used, one.pairs, cost, one.costs)


def least_joules(problem: Problem, domains: Domains, ranges: Ranges) -> float:
    """What no feasible set of some domains undercuts, as ``Found.joules``."""
    if not problem.candidates.power_known:
        return -math.inf
    total = 0.0
    for offer, domain in zip(problem.candidates.joints, domains, strict=True):
        least = np.full(len(domain), -math.inf)
        offer.interval(ranges.low, ranges.high)
        offer.bounded(
            domain.pairs, np.zeros(len(problem.share)), least, np.zeros(len(domain), np.bool_), until=1.0 + ROUNDING,
            energies=True, weight=1.0,
        )  # fmt: skip
        total += float(least[np.isfinite(least)].min(initial=math.inf))
    return total / problem.joules
