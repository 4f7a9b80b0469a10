"""What the supply gives and takes back: held against whole sets, and against what open choices leave possible.

A drive takes at least what it gives to the link and to its rotor; losses only add to that. Where few candidates are
left at a joint the copper loss of the best of them is counted too. The most that it takes, which is the least that it
feeds back, needs the losses of every candidate: it is known where not too many are left, each no hotter than it may be.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.friction import friction_torque
from drivetrain.sizing.judge.verdicts import supply_checks
from drivetrain.sizing.search.bounds import power_ends
from drivetrain.sizing.search.domains import Domain, Domains
from drivetrain.sizing.search.problem import Problem
from drivetrain.sizing.search.propagate import Ranges

FEW, SOME = 24, 256  # candidates of a joint whose losses are counted one by one, and where the most is wanted too


def supply_use(problem: Problem, pairs: Sequence[int]) -> float:
    """The largest utilisation of the supply by a set that is feasible at every joint; 0 where nothing limits it."""
    study = problem.candidates.study
    supply, cycle = study.supply, study.cycle
    if (
        not problem.candidates.power_known
        or (supply.peak_power, supply.mean_power, supply.regenerated_power) == (None,) * 3
    ):
        return 0.0
    total = {"all": problem.power(pairs)}
    checks = supply_checks(supply, cycle.time, cycle.weights, total, reserve=study.safety.reserve)
    return max((check.utilisation for check in checks if check.utilisation is not None), default=0.0)


def supply_may_be_feasible(problem: Problem, domains: Domains, ranges: Ranges) -> bool:
    """Whether some set of what is left may ask no more of the supply than it gives."""
    study, supply = problem.candidates.study, problem.candidates.study.supply
    if not problem.candidates.power_known:
        return True
    back = supply.regenerated_power
    least, most = power_range(problem, domains, ranges, most=back is not None)
    weights, over = study.cycle.weights, 1.0 + 1e-6
    drawn, fed_back = np.maximum(least, 0.0), np.maximum(-most, 0.0)
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
