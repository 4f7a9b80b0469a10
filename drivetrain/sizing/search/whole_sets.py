"""Whole sets of drives: judged exactly, in the order in which they come, and what is asked of all drives together.

Sets whose objectives are equal come in the order of their energy a cycle, those of equal energy in that of their
largest utilisation. The supply and the arm behind all drives are held against whole sets, and against what open
choices leave possible.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.friction import friction_torque
from drivetrain.drive.spring import Spring, gear_spring, twist_under
from drivetrain.sizing.judge.arm_stops import needs_arm_stops, stop_checks
from drivetrain.sizing.judge.checks import SUPPLY_CHECKS
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
from drivetrain.sizing.judge.verdicts import standby_power, supply_checks
from drivetrain.sizing.search.bounds import power_ends
from drivetrain.sizing.search.candidates import UNPRICED, Candidates, Domain, Domains, Mask, Pairs
from drivetrain.sizing.search.problem import ROUNDING, Cut, Problem, Swing
from drivetrain.sizing.search.propagate import Ranges
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import lacking

FEW, SOME = 24, 256  # candidates of a joint whose losses are counted one by one, and where the most is wanted too
MOST_CUTS = 8
OVER = 1.0 + 1e-9  # of what is wished: rounding of sums
LINES = 60  # of the relaxation; each is a line less than the last


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
    more: Array  # what the sheets hide of it [W], (2,)


def can_be_judged(problem: Problem, decided: Mask) -> bool:
    """Whether the load of every joint is decided by what is, and by the drives of the joints after it."""
    return not np.tril(problem.loads, -1)[:, ~decided].any()


def feasible_sets(problem: Problem, domains: Domains, ranges: Ranges, limit: float) -> Iterator[Found]:
    """Every feasible set of some domains below a limit, judged joint by joint from the tip to the base.

    The domains are of few sets that ``can_be_judged``, ``ranges`` of their numbers.
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
        unasked = np.zeros(len(pairs)), np.zeros((len(pairs), 2))
        power, more = problem.power_of(joint, pairs, after.numbers) if limited else unasked
        for at in range(len(pairs)):
            pair, numbers = int(pairs[at]), after.numbers.copy()
            numbers[joint] = problem.candidates.numbers[pair]
            one = _Chosen(
                (pair, *after.pairs), (float(cost[at]), *after.costs), numbers, after.energy + energy[at],
                max(after.used, used[at]), after.power + power[at], after.more + more[at],
            )  # fmt: skip
            yield from chosen(joint - 1, one)

    for one in chosen(problem.n - 1, _Chosen((), (), ranges.low.copy(), 0.0, 0.0, np.zeros(1), np.zeros(2))):
        used = max(one.used, supply_use(problem, one.power, one.more)) if limited else one.used
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


# The supply. A drive takes at least what it gives to the link and to its rotor; losses only add to that. Where few
# candidates are left at a joint the copper loss of the best of them counts too. The most that it takes needs the losses
# of every candidate, each no hotter than it may be.


def supply_limited(problem: Problem) -> bool:
    """Whether the supply has a limit that sets can be held against."""
    supply = problem.candidates.study.supply
    return problem.candidates.power_known and any(getattr(supply, row.limit) is not None for row in SUPPLY_CHECKS)


def supply_use(problem: Problem, power: Array, more: Array) -> float:
    """The largest utilisation of a limited supply by the power of all drives together, and the least [W], (2, N).

    Infinite where it holds only if the sheets hide nothing, unless the study gives a drive: that stays.
    """
    given = any(offer.given for offer in problem.candidates.joints)
    checks = supply_checks(problem.candidates.study, power, more=np.zeros(2) if given else more)
    return math.inf if lacking(checks) else max((check.utilisation or 0.0 for check in checks), default=0.0)


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


# What is wished of the arm. Where a set lets the tip go too far, its sample and the way of the tip there make a cut.
# Along any way the tip goes at least as far as what each joint does to it there adds up to, and a joint does at least
# what the least torque that open choices leave makes of its gear's spring. So a cut is one sum over the joints that
# must not become large. What sets that keep it cost at least is Lagrange's relaxation: each joint alone minimises its
# cost and so much a metre of its share.


def arm_use(problem: Problem, pairs: Sequence[int]) -> float:
    """The largest utilisation of what is wished of the arm by a set, and of its stops; 0 where nothing is asked.

    Infinite where a check lacks a number of a drive that the study does not give: such a drive is not chosen.
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
        if used > 1.0:  # the rest costs much and changes nothing
            if check.name == "arm tip deviation" and len(problem.cuts) < MOST_CUTS:
                moved = tip_deviation(study, drives, torque)
                sample = int(np.argmax(np.linalg.norm(moved, axis=1)))
                x, y, z = (moved[sample] / np.linalg.norm(moved[sample])).tolist()
                problem.cuts[Cut(sample, (x, y, z))] = None
            elif check.name == "arm first resonance" and len(problem.cuts) < MOST_CUTS:
                problem.cuts[_swing(study, drives, check.time)] = None
            return used
    if needs_arm_stops(study):
        if any(task.amplifiers for task in study.joints):
            study = evaluated(work, keys).study  # with the amplifiers that were chosen, whose peak current brakes
        checks = tuple(stop_checks(study, drives, quick=True))
        used = max([used, *(check.utilisation or 0.0 for check in checks)])
        used = math.inf if lacking(checks) else used
    return used


def _swing(study: Study, drives: Mapping[str, Drive], time: float | None) -> Swing:
    """The slowest way in which a set swings: the torques M x of its shape at the instant that was told."""
    sample = int(np.searchsorted(study.cycle.time, time or 0.0))
    inertia = shaft_inertia(study, drives, sample)
    gears = [one.gear.stiffness_1 for one in drives.values()]
    yielding = 1.0 / soft_springs(study, np.array([math.inf if one is None else one for one in gears]))
    # K^-1 M x = x/w^2, in the symmetric form of the square roots of the compliances.
    root = np.sqrt(yielding)
    shape = np.linalg.eigh(root[:, None] * inertia * root)[1][:, -1]
    torques = inertia @ (root * shape)
    return Swing(sample, tuple((torques / np.linalg.norm(torques)).tolist()))


def without_soft(problem: Problem, domains: Domains, limit: float) -> tuple[float, Domains]:
    """What sets that keep every cut cost at least, infinite if no less than a limit, and the candidates of the rest."""
    bound, offered = -math.inf, problem.candidates
    domains = without_play(offered, domains)
    if not all(map(len, domains)):
        return math.inf, domains
    for cut in problem.cuts:
        if isinstance(cut, Swing):
            most = swing_room(offered.study, cut)
            moved = [yielded_by(offered, joint, domain, cut) for joint, domain in enumerate(domains)]
        else:
            low, high = problem.ranges(domains)
            most = offered.study.stiffness.tip_deviation or 0.0
            moved = [moved_by(offered, joint, domain, cut, low, high) for joint, domain in enumerate(domains)]
        found, kept = relaxed(domains, moved, most * OVER, limit)
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


# An arm that swings at w under the torques f of its springs has f K^-1 f <= f M^-1 f / w^2 (Rayleigh's quotient of both
# inverses, of any f). No drive makes M smaller than the bare arm's, so a slow set cuts off all that yield as much.


@lru_cache(maxsize=MOST_CUTS)
def swing_room(study: Study, cut: Swing) -> float:
    """How much the springs may yield to a cut's torques in an arm that swings as fast as wished [J]."""
    torques, wanted = np.array(cut.torques), 2.0 * math.pi * (study.stiffness.first_resonance or math.inf)
    return float(torques @ np.linalg.solve(shaft_inertia(study, {}, cut.sample), torques)) / wanted**2


def yielded_by(offered: Candidates, joint: int, domain: Domain, cut: Swing) -> Array:
    """How much the spring of each candidate of a joint yields to a cut's torques [J], (K,)."""
    study = offered.study
    stiffness = (1.0 - study.stiffness.scatter) * _springs(offered).slope_1 / joint_travels(study)[joint] ** 2
    return np.nan_to_num(cut.torques[joint] ** 2 / stiffness, nan=math.inf)[offered.pairs[domain.pairs, 1]]


def without_play(offered: Candidates, domains: Domains) -> Domains:
    """Domains without gears whose backlash lets the tip go too far beside the least of the other joints."""
    study = offered.study
    if study.stiffness.lost_motion is None or study.arm is None:
        return domains
    # A preload may close what is between the two gears of an axis.
    there = np.where([bool(task.sharing and task.preload) for task in study.joints], 0.0, np.abs(joint_travels(study)))
    every = [travel * _backlash(offered)[offered.pairs[one.pairs, 1]]
             for travel, one in zip(there, domains, strict=True)]  # fmt: skip
    least = tuple(float(np.nanmin(row, initial=math.inf)) for row in every)
    if any(np.isnan(row).any() for row, task in zip(every, study.joints, strict=True) if task.drive is not None):
        return domains  # the check is not made, whatever the others are
    kept = []
    for joint, (row, domain) in enumerate(zip(every, domains, strict=True)):
        values = tuple(sorted(set(row[~np.isnan(row)].tolist())))
        kept.append(domain.kept(row <= most_play(study, least, joint, values)))
    return tuple(kept)


@lru_cache(maxsize=256)
def most_play(study: Study, least: tuple[float, ...], joint: int, values: tuple[float, ...]) -> float:
    """The largest of some plays of a joint that keeps the wish beside the others' least; -1: none."""

    def too_loose(value: float) -> bool:
        plays = np.array([value if k == joint else one for k, one in enumerate(least)])
        return bool(lost_motion(plays[:, None] * tip_levers(study)).max() > (study.stiffness.lost_motion or 0.0) * OVER)

    place = bisect_left(values, True, key=too_loose)
    return values[place - 1] if place else -1.0


@lru_cache(maxsize=2)
def _backlash(offered: Candidates) -> Array:
    """Of all gears [rad], (G,): of a direct drive 0, unknown NaN."""
    filled = FilledParts(offered.study)
    gears = [filled.gear(key) for key in offered.gears]
    return np.array([0.0 if one.direct else one.backlash for one in gears], dtype=np.float64)


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
