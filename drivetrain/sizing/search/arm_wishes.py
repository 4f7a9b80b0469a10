"""What is wished of the arm behind all drives: whole sets held against it, and what it costs at least to keep it.

Where a set lets the tip go too far, its sample and the way of the tip there make a cut. Along any way the tip goes at
least as far as what each joint does to it there adds up to, and a joint does at least what the least torque that open
choices leave makes of its gear's spring. So a cut is one sum over the joints that must not be too large. What sets that
keep it cost at least is Lagrange's relaxation: each joint alone minimises its cost and so much a metre of its share.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.spring import Spring, gear_spring, twist_under
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.fill import FilledParts
from drivetrain.sizing.judge.stiffness import arm_checks, joint_travels, tip_deviation, tip_levers, unsprung
from drivetrain.sizing.judge.stop_checks import asks_stops, stop_checks
from drivetrain.sizing.search.candidates import Candidates
from drivetrain.sizing.search.domains import UNPRICED, Domain, Domains, Mask
from drivetrain.sizing.search.problem import Cut, Problem

MOST_CUTS = 8
OVER = 1.0 + 1e-9  # of what is wished: rounding of sums
LINES = 60  # of the relaxation; each is a line less than the last


def arm_use(problem: Problem, pairs: Sequence[int]) -> float:
    """The largest utilisation of what is wished of the arm by a set, and of its stops; 0 where nothing is asked.

    Infinite where a check lacks a number of a drive that the study does not give: such a drive is not chosen.
    """
    study, work = problem.candidates.study, problem.candidates.work
    if not (study.stiffness.asked or asks_stops(study)):
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
        if used > 1.0:  # the rest costs much and changes nothing
            if check.name == "arm tip deviation" and len(problem.cuts) < MOST_CUTS:
                moved = tip_deviation(study, drives, torque)
                sample = int(np.argmax(np.linalg.norm(moved, axis=1)))
                x, y, z = (moved[sample] / np.linalg.norm(moved[sample])).tolist()
                problem.cuts[Cut(sample, (x, y, z))] = None
            return used
    if asks_stops(study):
        if any(task.amplifiers for task in study.joints):
            study = evaluated(work, keys).study  # with the amplifiers that were chosen, whose peak current brakes
        used = max([used, *(check.utilisation or 0.0 for check in stop_checks(study, drives))])
    return used


def without_soft(problem: Problem, domains: Domains, limit: float) -> tuple[float, Domains]:
    """What sets that keep every cut cost at least, infinite if no less than a limit, and the candidates of the rest."""
    bound, most = -math.inf, problem.candidates.study.stiffness.tip_deviation
    for cut in problem.cuts if most is not None else ():
        low, high = problem.ranges(domains)
        moved = [moved_by(problem.candidates, joint, domain, cut, low, high) for joint, domain in enumerate(domains)]
        found, kept = relaxed(domains, moved, (most or 0.0) * OVER, limit)
        bound = max(bound, found)
        if bound >= limit:
            return math.inf, domains
        domains = tuple(domain.kept(mask) for domain, mask in zip(domains, kept, strict=True))
    return bound, domains


def relaxed(
    domains: Sequence[Domain], moved: Sequence[Array], most: float, limit: float
) -> tuple[float, tuple[Mask, ...]]:
    """What sets cost at least whose sum of ``moved`` is no more than ``most``, and who may be part of one.

    Of every price of a metre the cheapest candidates are a bound, a straight line over the price; the highest of the
    lines' lower envelope is where one that moves too far meets one that does not.
    """
    least = [float(row.min()) for row in moved]
    room = most - sum(least)
    stiff = tuple(row - one <= room for row, one in zip(moved, least, strict=True))
    if not room >= 0.0:
        return math.inf, stiff
    if any(domain.least <= UNPRICED for domain in domains):
        return -math.inf, stiff
    costs = [np.where(mask, domain.cost, math.inf) for domain, mask in zip(domains, stiff, strict=True)]
    moved = [np.where(mask, row, 0.0) for row, mask in zip(moved, stiff, strict=True)]

    def line(places: list[int]) -> tuple[float, float]:
        """Cost and way of one candidate a joint."""
        pick = list(zip(costs, moved, places, strict=True))
        return sum(float(cost[at]) for cost, _, at in pick), sum(float(row[at]) for _, row, at in pick)

    price, soft = 0.0, line([int(np.argmin(cost)) for cost in costs])
    hard = line(
        [int(np.lexsort((cost, row + 1e300 * np.isinf(cost)))[0]) for cost, row in zip(costs, moved, strict=True)]
    )
    if soft[1] <= most:
        return soft[0], stiff
    for _ in range(LINES):
        price = (hard[0] - soft[0]) / (soft[1] - hard[1])
        priced = [cost + price * row for cost, row in zip(costs, moved, strict=True)]
        cost, way = line([int(np.argmin(row)) for row in priced])
        if cost + price * way >= (soft[0] + price * soft[1]) * (1.0 - 1e-12):
            break
        soft, hard = ((cost, way), hard) if way > most else (soft, (cost, way))
    bests = [float(row.min()) for row in priced]
    bound = sum(bests) - price * most
    bound -= 1e-12 * (abs(sum(bests)) + price * most)
    return bound, tuple(bound - best + row < limit for best, row in zip(bests, priced, strict=True))


def moved_by(offered: Candidates, joint: int, domain: Domain, cut: Cut, low: Array, high: Array) -> Array:
    """How far each candidate of a joint moves the tip along the way of a cut at least [m], (K,)."""
    study, springs = offered.study, _springs(offered)
    ends = offered.joints[joint].load_at(cut.sample, low, high)
    lever = tip_levers(study)[cut.sample, joint] @ cut.way * joint_travels(study)[joint]
    of_gear = np.minimum(*(lever * twist_under(springs, end) for end in ends)) / (1.0 - study.stiffness.scatter)
    return np.nan_to_num(of_gear, nan=math.inf)[offered.pairs[domain.pairs, 1]]


@lru_cache(maxsize=2)
def _springs(offered: Candidates) -> Any:
    """The springs of all gears, (G,) each: of a direct drive rigid, of an unknown stiffness NaN."""
    filled, rows = FilledParts(offered.study), []
    for key in offered.gears:
        gear = filled.gear(key)
        slope = math.nan if gear.key else math.inf
        rows.append(Spring(slope, slope, slope) if gear.stiffness_1 is None else gear_spring(gear))
    names = ("slope_1", "slope_2", "slope_3", "torque_1", "torque_2")
    series: list[Any] = [np.array([getattr(one, name) for one in rows]) for name in names]
    return Spring(*series)
