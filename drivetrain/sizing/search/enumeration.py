"""Enumeration of the feasible sets of small nodes: set by set, depth first from the tip to the base.

Sets with equal objectives are ordered by their energy per cycle, sets of equal energy by their largest utilisation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arrays import Array, Mask
from drivetrain.sizing.search.constraints.stiffness import arm_utilisation
from drivetrain.sizing.search.constraints.supply import supply_limited, supply_utilisation
from drivetrain.sizing.search.domains import Domains, Pairs
from drivetrain.sizing.search.problem import ROUNDING, Problem
from drivetrain.sizing.search.propagate import ParameterRanges


@dataclass(frozen=True, order=True)
class FeasibleSet:
    """A feasible set of drives, ordered by objective level, energy level, utilisation and pairs."""

    level: int  # its objective in steps within which objectives are equal
    energy_level: int  # its energy per cycle in steps within which energies are equal
    utilisation: float  # largest utilisation of all checks
    pairs: Pairs  # one per joint
    objective: float = field(compare=False)  # objective of the set
    costs: tuple[float, ...] = field(compare=False)  # contribution of each pair to the objective


@dataclass(frozen=True, eq=False)
class _Partial:
    """A partial set: drives of the last joints, with their contributions."""

    pairs: Pairs  # drives of the last joints
    costs: tuple[float, ...]  # contribution of each of these pairs to the objective
    parameters: Array  # load parameters of all joints' drives, those of the node where none is chosen, (n, PARAMETERS)
    energy: float  # per cycle [J]
    utilisation: float  # largest utilisation of all checks
    power: Array  # electrical power, and its lower bound [W], (2, N); (1,) if the supply is not limited
    hidden: Array  # power hidden by missing data [W], (2,)


def can_enumerate(problem: Problem, decided: Mask) -> bool:
    """Whether the sets of a node can be judged from the tip to the base: the load of every joint must depend on decided
    drives (n,) and on drives of the joints after it only.
    """
    return not np.tril(problem.is_loaded_by, -1)[:, ~decided].any()


def feasible_sets(
    problem: Problem, domains: Domains, ranges: ParameterRanges, limit: float
) -> Iterator[FeasibleSet]:  # fmt: skip
    """Enumerate the sets of some domains below a limit that pass all checks but those of ``with_arm``, depth first from
    the tip to the base.

    ``can_enumerate`` must hold; ``ranges`` are those of the domains.
    """
    lower = np.cumsum([0.0, *(domain.lower_bound for domain in domains)])  # lower bound of the joints before each one
    limited = supply_limited(problem)

    def extend(joint: int, partial: _Partial) -> Iterator[_Partial]:
        """Complete sets from a partial one of the joints after ``joint``."""
        if joint < 0:
            yield partial
            return
        other_costs = sum(partial.costs) + lower[joint]
        pairs = domains[joint].below(limit - other_costs).pairs
        utilisation, energy, price = problem.judge(joint, pairs, partial.parameters)
        cost = problem.cost(pairs, energy, price)
        kept = np.isfinite(utilisation) & (cost + other_costs < limit)
        pairs, utilisation, energy, cost = pairs[kept], utilisation[kept], energy[kept], cost[kept]
        if limited:
            power, hidden = problem.candidate_power(joint, pairs, partial.parameters)
        else:
            power, hidden = np.zeros(len(pairs)), np.zeros((len(pairs), 2))
        for i in range(len(pairs)):
            pair, parameters = int(pairs[i]), partial.parameters.copy()
            parameters[joint] = problem.candidates.parameters[pair]
            extended = _Partial(
                (pair, *partial.pairs), (float(cost[i]), *partial.costs), parameters, partial.energy + energy[i],
                max(partial.utilisation, utilisation[i]), partial.power + power[i], partial.hidden + hidden[i],
            )  # fmt: skip
            yield from extend(joint - 1, extended)

    empty = _Partial((), (), ranges.low.copy(), 0.0, 0.0, np.zeros(1), np.zeros(2))
    for one in extend(problem.n - 1, empty):
        used = max(one.utilisation, supply_utilisation(problem, one.power, one.hidden)) if limited else one.utilisation
        if used <= 1.0 and all(constraint.satisfied(one.pairs) for constraint in problem.constraints):
            cost, energy_level = sum(one.costs), math.floor(one.energy / problem.energy_step + 0.5)
            yield FeasibleSet(problem.level(cost), energy_level, used, one.pairs, cost, one.costs)


def with_arm(problem: Problem, found: FeasibleSet) -> FeasibleSet | None:
    """The set with the checks of the whole arm, which take long and only raise its utilisation; None: not feasible."""
    used = max(found.utilisation, arm_utilisation(problem, found.pairs))
    return replace(found, utilisation=used) if used <= 1.0 else None


def min_energy_level(problem: Problem, domains: Domains, ranges: ParameterRanges) -> float:
    """Lower bound on ``FeasibleSet.energy_level`` of the feasible sets of some domains."""
    if not problem.candidates.power_known:
        return -math.inf
    total = 0.0
    for offer, domain in zip(problem.candidates.joints, domains, strict=True):
        energy = np.full(len(domain), -math.inf)
        offer.torque_interval(ranges.low, ranges.high)
        offer.bound(
            domain.pairs, np.zeros(len(problem.fixed_cost)), energy, np.zeros(len(domain), np.bool_),
            until=1.0 + ROUNDING, with_energy=True, energy_weight=1.0,
        )  # fmt: skip
        total += float(energy[np.isfinite(energy)].min(initial=math.inf))
    return total / problem.energy_step
