"""The limits of the shared supply: checked on whole sets of drives, and bounded for the domains of a node.

The lower bound on the power of a drive is what it delivers to the link and to its rotor, without losses. Where few
candidates are left at a joint, the smallest copper loss among them is added. The upper bound needs the losses of every
candidate, each at its highest permitted temperature.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.friction import friction_torque
from drivetrain.sizing.judge.checks import SUPPLY_CHECKS
from drivetrain.sizing.judge.verdicts import standby_power, supply_checks
from drivetrain.sizing.search.bounds import candidate_power_range
from drivetrain.sizing.search.domains import Domain, Domains
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.search.propagate import ParameterRanges
from drivetrain.study.parts.verdicts import lacking

MAX_LOSSES, MAX_LOSSES_BOTH = 24, 256  # candidates up to which losses are bounded one by one; for both bounds of power


def supply_limited(problem: Problem) -> bool:
    """Whether the supply has a limit that can be checked."""
    supply = problem.candidates.study.supply
    return problem.candidates.power_known and any(getattr(supply, row.limit) is not None for row in SUPPLY_CHECKS)


def supply_utilisation(problem: Problem, power: Array, hidden: Array) -> float:
    """Largest utilisation of the supply's limits by a whole set, from the power of all drives together and its lower
    bound [W], (2, N).

    Infinite if the limits are met only without the power ``hidden`` by missing data, (2,), unless the study fixes a
    drive.
    """
    any_fixed = any(offer.is_fixed for offer in problem.candidates.joints)
    checks = supply_checks(problem.candidates.study, power, more=np.zeros(2) if any_fixed else hidden)
    return math.inf if lacking(checks) else max((check.utilisation or 0.0 for check in checks), default=0.0)


def supply_may_be_feasible(problem: Problem, domains: Domains, ranges: ParameterRanges) -> bool:
    """Whether some set of the domains may meet the limits of the supply."""
    study, supply = problem.candidates.study, problem.candidates.study.supply
    if not supply_limited(problem):
        return True
    back, electronics = supply.regenerated_power, standby_power(study)
    lower, upper = power_range(problem, domains, ranges, both=back is not None)
    weights, over = study.cycle.weights, 1.0 + 1e-6
    drawn, fed_back = np.maximum(lower + electronics, 0.0), np.maximum(-upper - electronics, 0.0)
    if supply.peak_power is not None and drawn.max() > supply.peak_power * over:
        return False
    duration = float(weights.sum()) or math.inf
    if supply.mean_power is not None and float(drawn @ weights) / duration > supply.mean_power * over:
        return False
    return back is None or float(fed_back @ weights) / duration <= back * over


def power_range(problem: Problem, domains: Domains, ranges: ParameterRanges, *, both: bool) -> tuple[Array, Array]:
    """Lower and upper bound on the power of all joints together at each sample [W], (N,) each.

    The upper bound is infinite where it is unknown, or not requested by ``both``.
    """
    offered = problem.candidates
    samples = len(offered.study.cycle.time)
    lower, upper = np.zeros(samples), np.full(samples, 0.0 if both else np.inf)
    for joint, domain in enumerate(domains):
        offer, low, high = offered.joints[joint], np.zeros(samples), np.full(samples, np.inf)
        torque = offer.torque_interval(ranges.low, ranges.high)
        if len(domain) <= (MAX_LOSSES_BOTH if both else MAX_LOSSES):
            candidate_power_range(offer.bound_data, domain.pairs, low, high)
        else:
            low = _lossless_power(problem, joint, domain, torque, ranges)
        lower += low
        upper += high
    return lower, upper


def _lossless_power(
    problem: Problem, joint: int, domain: Domain, torque: tuple[Array, Array], ranges: ParameterRanges
) -> Array:
    """Lower bound on the power delivered to a joint's link and rotor, without losses [W], (N,)."""
    offer, (low, high) = problem.candidates.joints[joint], torque
    for i, unit in enumerate(offer.series.unit_loads.torque):  # load by its own drive, if the moved link carries it
        ends = np.stack([ranges.low[joint, i] * unit, ranges.high[joint, i] * unit])
        low, high = low + ends.min(axis=0), high + ends.max(axis=0)
    motion, ratio = offer.series.motion, problem.candidates.ratio[domain.pairs]
    speed, rotor_inertia = motion.speed, problem.candidates.parameters[domain.pairs, 3]
    friction = friction_torque(offer.demand.friction, speed)
    power = (np.where(speed > 0.0, low, high) + friction) * speed
    rotor_terms = (
        (rotor_inertia * ratio**2, motion.acceleration), (rotor_inertia * ratio, motion.carrier_acceleration),
    )  # fmt: skip
    for factor, acceleration in rotor_terms:
        power += np.minimum(factor.min() * acceleration * speed, factor.max() * acceleration * speed)
    return power
