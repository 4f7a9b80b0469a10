"""The stiffness of the arm and its stops: checked on whole sets of drives, and bounded for the domains of a node.

A set whose tip deflects too far gives a cut: the sample and direction of the deflection. The component of the tip
deflection in that direction is a sum over the joints, and the contribution of a joint is at least that of the smallest
torque of its interval on its gear's spring. So a cut is a linear constraint: one sum over the joints is bounded.
Lagrangian relaxation of this constraint gives a lower bound on the cost of the sets that satisfy it.

A set whose first resonance is too low gives a cut as well. If the lowest resonance is w or higher,
f K^-1 f <= f M^-1 f / w^2 for any spring torques f (Rayleigh quotient of the inverses). No drive makes M smaller than
that of the bare arm, so the compliance f K^-1 f, a sum over the joints, has an upper bound.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arrays import Array, Mask
from drivetrain.drive.drive import Drive
from drivetrain.drive.spring import Spring, gear_spring, twist_under
from drivetrain.sizing.judge.arm_stops import needs_arm_stops, stop_checks
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.stiffness import (
    arm_checks,
    joint_travels,
    lost_motion,
    shaft_inertia,
    soft_springs,
    tip_deviation,
    tip_levers,
    unsprung,
)
from drivetrain.sizing.search.candidates import Candidates
from drivetrain.sizing.search.domains import UNPRICED, Domain, Domains
from drivetrain.sizing.search.problem import Problem, ResonanceCut, TipCut
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import lacking

MAX_CUTS = 8
ROUNDED_UP = 1.0 + 1e-9  # factor on stiffness limits that allows for rounding of sums
MAX_LINES = 60  # iterations of the Lagrangian bound


def arm_utilisation(problem: Problem, pairs: Sequence[int]) -> float:
    """Largest utilisation of the stiffness checks and of the arm's stops by a set; 0 if there are none.

    Infinite if a check lacks data of a drive that the study does not fix: such a drive is not chosen. A set that is too
    soft adds a cut to ``problem.cuts``.
    """
    study, work = problem.candidates.study, problem.candidates.work
    if not (study.stiffness.stated or needs_arm_stops(study)):
        return 0.0
    filled_parts, keys = FilledParts(study), problem.keys(dict(enumerate(pairs)))
    mounted = {i: filled_parts.drive(task, *keys[task.name]) for i, task in enumerate(study.joints)}
    drives = {task.name: mounted[i] for i, task in enumerate(study.joints)}
    if unsprung(study, {task.name: drives[task.name] for task in study.joints if task.drive is None}):
        return math.inf
    torque = np.column_stack([work.at(i, mounted).demand(drive).load_torque for i, drive in mounted.items()])
    used = 0.0
    for check in arm_checks(study, drives, torque):
        used = max(used, check.utilisation or 0.0)
        if used > 1.0:  # the remaining checks are expensive and change nothing
            if check.name == "arm tip deviation" and len(problem.cuts) < MAX_CUTS:
                moved = tip_deviation(study, drives, torque)
                sample = int(np.argmax(np.linalg.norm(moved, axis=1)))
                x, y, z = (moved[sample] / np.linalg.norm(moved[sample])).tolist()
                problem.cuts[TipCut(sample, (x, y, z))] = None
            elif check.name == "arm first resonance" and len(problem.cuts) < MAX_CUTS:
                problem.cuts[_resonance_cut(study, drives, check.time)] = None
            return used
    if needs_arm_stops(study):
        if any(task.amplifiers for task in study.joints):
            study = evaluated(work, keys).study  # with the chosen amplifiers, whose peak current brakes
        checks = tuple(stop_checks(study, drives, quick=True))
        used = max([used, *(check.utilisation or 0.0 for check in checks)])
        used = math.inf if lacking(checks) else used
    return used


def _resonance_cut(study: Study, drives: Mapping[str, Drive], time: float | None) -> ResonanceCut:
    """The cut of a set's lowest mode at an instant [s]: the spring torques M x of the mode shape x."""
    sample = int(np.searchsorted(study.cycle.time, time or 0.0))
    inertia = shaft_inertia(study, drives, sample)
    gears = [one.gear.stiffness_1 for one in drives.values()]
    compliance = 1.0 / soft_springs(study, np.array([math.inf if one is None else one for one in gears]))
    # K^-1 M x = x/w^2, in the symmetric form of the square roots of the compliances.
    root = np.sqrt(compliance)
    shape = np.linalg.eigh(root[:, None] * inertia * root)[1][:, -1]
    torques = inertia @ (root * shape)
    return ResonanceCut(sample, tuple((torques / np.linalg.norm(torques)).tolist()))


def apply_stiffness_cuts(problem: Problem, domains: Domains, limit: float) -> tuple[float, Domains]:
    """Lower bound on the cost of sets that satisfy every stiffness cut, and the remaining candidates.

    The bound is infinite if it reaches the limit.
    """
    bound, offered = -math.inf, problem.candidates
    domains = filter_backlash(offered, domains)
    if not all(map(len, domains)):
        return math.inf, domains
    for cut in problem.cuts:
        if isinstance(cut, ResonanceCut):
            budget = allowed_compliance(offered.study, cut)
            shares = [compliance_of(offered, joint, domain, cut) for joint, domain in enumerate(domains)]
        else:
            low, high = problem.ranges(domains)
            budget = offered.study.stiffness.tip_deviation or 0.0
            shares = [min_tip_motion(offered, joint, domain, cut, low, high) for joint, domain in enumerate(domains)]
        found, kept = lagrangian_bound(domains, shares, budget * ROUNDED_UP, limit)
        bound = max(bound, found)
        if bound >= limit:
            return math.inf, domains
        domains = tuple(domain.subset(mask) for domain, mask in zip(domains, kept, strict=True))
    return bound, domains


def lagrangian_bound(
    domains: Sequence[Domain], shares: Sequence[Array], budget: float, limit: float
) -> tuple[float, tuple[Mask, ...]]:
    """Lower bound on the cost of sets whose shares, (K,) a joint, add up to no more than a budget, and by joint which
    candidates may be part of a set that costs less than the limit.

    For a given price per unit of share, each joint alone minimises cost + price * share; the sum less price * budget is
    a lower bound. The bound is a concave piecewise linear function of the price; its maximum is found by intersecting
    the line of a set within the budget with that of a set over it.
    """
    smallest = [float(share.min()) for share in shares]
    slack = budget - sum(smallest)
    fits = tuple(share - own <= slack for share, own in zip(shares, smallest, strict=True))
    if not slack >= 0.0:
        return math.inf, fits
    if any(domain.lower_bound <= UNPRICED for domain in domains):
        return -math.inf, fits
    costs = [np.where(mask, domain.cost, math.inf) for domain, mask in zip(domains, fits, strict=True)]
    shares = [np.where(mask, share, 0.0) for share, mask in zip(shares, fits, strict=True)]

    def totals(chosen: list[int]) -> tuple[float, float]:
        """Cost and share of a set."""
        return (
            sum(float(cost[i]) for cost, i in zip(costs, chosen, strict=True)),
            sum(float(share[i]) for share, i in zip(shares, chosen, strict=True)),
        )

    over = totals([int(np.argmin(cost)) for cost in costs])
    if over[1] <= budget:
        return over[0], fits
    within = totals(
        [int(np.lexsort((cost, share + 1e300 * np.isinf(cost)))[0]) for cost, share in zip(costs, shares, strict=True)]
    )
    for _ in range(MAX_LINES):
        price = (within[0] - over[0]) / (over[1] - within[1])
        priced = [cost + price * share for cost, share in zip(costs, shares, strict=True)]
        found = totals([int(np.argmin(row)) for row in priced])
        if found[0] + price * found[1] >= (over[0] + price * over[1]) * (1.0 - 1e-12):
            break
        if found[1] > budget:
            over = found
        else:
            within = found
    bests = [float(row.min()) for row in priced]
    bound = sum(bests) - price * budget
    bound -= 1e-12 * (abs(sum(bests)) + price * budget)  # rounding
    return bound, tuple(bound - best + row < limit for best, row in zip(bests, priced, strict=True))


def min_tip_motion(offered: Candidates, joint: int, domain: Domain, cut: TipCut, low: Array, high: Array) -> Array:
    """Lower bound on the tip deflection by each candidate of a joint in the direction of a cut [m], (K,)."""
    study, springs = offered.study, _springs(offered)
    ends = offered.joints[joint].torque_interval_at(cut.sample, low, high)
    lever = tip_levers(study)[cut.sample, joint] @ cut.direction * joint_travels(study)[joint]
    of_gear = np.minimum(*(lever * twist_under(springs, end) for end in ends)) / (1.0 - study.stiffness.scatter)
    return np.nan_to_num(of_gear, nan=math.inf)[offered.pairs[domain.pairs, 1]]


@lru_cache(maxsize=MAX_CUTS)
def allowed_compliance(study: Study, cut: ResonanceCut) -> float:
    """Largest f K^-1 f for the torques of a cut in an arm with the required resonance frequency [J]."""
    torques, required = np.array(cut.torques), 2.0 * math.pi * (study.stiffness.first_resonance or math.inf)
    return float(torques @ np.linalg.solve(shaft_inertia(study, {}, cut.sample), torques)) / required**2


def compliance_of(offered: Candidates, joint: int, domain: Domain, cut: ResonanceCut) -> Array:
    """Share of each candidate of a joint in f K^-1 f for the torques of a cut [J], (K,)."""
    study = offered.study
    stiffness = (1.0 - study.stiffness.scatter) * _springs(offered).slope_1 / joint_travels(study)[joint] ** 2
    return np.nan_to_num(cut.torques[joint] ** 2 / stiffness, nan=math.inf)[offered.pairs[domain.pairs, 1]]


def filter_backlash(offered: Candidates, domains: Domains) -> Domains:
    """The domains without gears whose own backlash, with the smallest of the other joints, moves the tip too far."""
    study = offered.study
    if study.stiffness.lost_motion is None or study.arm is None:
        return domains
    # Preload may close the backlash between the two gears of an axis.
    travels = np.where(
        [bool(task.sharing and task.preload) for task in study.joints], 0.0, np.abs(joint_travels(study))
    )
    backlash = _backlash(offered)
    play = [travel * backlash[offered.pairs[one.pairs, 1]] for travel, one in zip(travels, domains, strict=True)]
    smallest = tuple(float(np.nanmin(row, initial=math.inf)) for row in play)
    if any(np.isnan(row).any() for row, task in zip(play, study.joints, strict=True) if task.drive is not None):
        return domains  # the check cannot be made for any choice of the other drives
    kept = []
    for joint, (row, domain) in enumerate(zip(play, domains, strict=True)):
        values = tuple(sorted(set(row[~np.isnan(row)].tolist())))
        kept.append(domain.subset(row <= max_play(study, smallest, joint, values)))
    return tuple(kept)


@lru_cache(maxsize=256)
def max_play(study: Study, smallest: tuple[float, ...], joint: int, values: tuple[float, ...]) -> float:
    """The largest backlash of a joint's candidates that meets the lost-motion limit, by bisection; -1 if none does.

    ``smallest`` is the smallest backlash of every joint [rad or m], ``values`` those of the candidates, rising.
    """

    def too_loose(value: float) -> bool:
        plays = np.array([value if k == joint else one for k, one in enumerate(smallest)])
        return bool(
            lost_motion(plays[:, None] * tip_levers(study)).max() > (study.stiffness.lost_motion or 0.0) * ROUNDED_UP
        )

    place = bisect_left(values, True, key=too_loose)
    return values[place - 1] if place else -1.0


@lru_cache(maxsize=2)
def _backlash(offered: Candidates) -> Array:
    """Backlash of all gears [rad], (G,): 0 for a direct drive, NaN if unknown."""
    filled = FilledParts(offered.study)
    gears = [filled.gear(key) for key in offered.gears]
    return np.array([0.0 if one.direct else one.backlash for one in gears], dtype=np.float64)


@lru_cache(maxsize=2)
def _springs(offered: Candidates) -> Any:
    """Springs of all gears with fields (G,): rigid for a direct drive, NaN if the stiffness is unknown."""
    filled, rows = FilledParts(offered.study), []
    for key in offered.gears:
        gear = filled.gear(key)
        slope = math.nan if gear.key else math.inf
        rows.append(Spring(slope, slope, slope) if gear.stiffness_1 is None else gear_spring(gear))
    names = ("slope_1", "slope_2", "slope_3", "torque_1", "torque_2")
    series: list[Any] = [np.array([getattr(one, name) for one in rows]) for name in names]
    return Spring(*series)
