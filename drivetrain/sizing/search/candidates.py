"""Every pair of motor and gear that a study offers, and the work of every joint, ready for bounds and for the judge.

Everything that does not depend on the choice of drives is computed here once: the basis of every joint, its motion, the
catalogue rows, and the numbers through which each pair loads other joints. No object is made for a pair.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import NO_GEAR, unknown_loss
from drivetrain.records import as_numbers, as_records
from drivetrain.sizing.demand.demand import JointDemand, Workload, workload
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.demand.series import (
    STRETCHES,
    Added,
    Load,
    Work,
    added_by,
    load_of,
    loads_by,
    new_traces,
    nothing_added,
    work_of,
)
from drivetrain.sizing.judge.cases import paired, put_amplifier, rests_on_gear
from drivetrain.sizing.judge.checks import table
from drivetrain.sizing.judge.judge import judge_cases
from drivetrain.sizing.judge.objectives import amplifier_price
from drivetrain.sizing.judge.parts import Parts, parts_of
from drivetrain.sizing.search.bounds import Brake, Offer, Sheets, bound_candidates, open_span, span_of
from drivetrain.study.model import JointTask, Study

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
Pairs = tuple[int, ...]

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


TABLE = table()


@dataclass(frozen=True, eq=False)
class Judged:
    """Candidates of one joint, judged; K of them."""

    cases: Any  # records of ``cases.Case``, (K,)
    used: Array  # largest utilisation, (K,)
    binding: Indices  # its check, -1 for none, (K,)
    lacking: Indices  # first essential check that could not be made, else -1, (K,)
    price: Array  # of the amplifier above that of the joint's cheapest, infinite where it is unknown, (K,)
    checks: Array  # every check's utilisation, NaN where it is not made, (K, checks); (0, 0) where nobody asked


class Loads(NamedTuple):
    """Loads of a joint without drives at some samples, and what a unit of each number of some drives adds to them."""

    start: Array  # (..., M); (0,) where nobody asks
    rows: Array  # (K, NUMBERS, all of start)
    drives: Indices  # joints of the drives, the joint's own last where it counts, (K,)

    def ends(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Both ends that open choices leave, as of ``start``; low, high: numbers of all joints' drives."""
        half, (bottom, top) = np.zeros(self.rows.shape[:2]), np.empty((2, self.start.size))
        open_span(self.start.ravel(), self.drives, self.rows, low, high, half, bottom, top)
        return bottom.reshape(self.start.shape), top.reshape(self.start.shape)

    def least(self, low: Array, high: Array) -> Array:
        """The least magnitudes that open choices leave."""
        least, most = self.ends(low, high)
        return np.maximum(np.maximum(least, -most), 0.0)


def loads_with(start: Array, rows: Array, drives: Sequence[int]) -> Loads:
    """Loads with rows of the same shape, NUMBERS for each of the drives that have any."""
    count = len(rows) // NUMBERS
    rows = np.ascontiguousarray(rows).reshape(count, NUMBERS, start.size)
    return Loads(np.ascontiguousarray(start), rows, np.array(drives[:count], dtype=np.int64))


UNASKED = Loads(np.zeros(0), np.zeros((0, NUMBERS, 0)), np.zeros(0, dtype=np.int64))


@dataclass(frozen=True, eq=False)
class JointOffer:
    """One joint: its work without drives, its candidates' rows, and what the drives of others add to its load."""

    joint: int  # index of the joint
    demand: JointDemand  # without drives
    # the same for compiled code; amounts are the numbers of the joint's own drive, where it rides on the link that it
    # moves
    work: Work
    others: tuple[int, ...]  # joints whose drives load this one
    rows: Added  # what a unit of each number of each of their drives adds
    heavy: Loads  # the wrench on the output bearing, six rows
    held: Loads  # the torque that holds a position still
    stops: Loads  # the torque in stops on a ramp
    swung: Loads  # the inertia at all samples, where a frequency is wished
    brake: Loads  # torque, static torque and inertia where stops at a current limit are looked at, own drive not in it
    few: Work  # the work at a few samples, with its memory
    records: Offer  # the candidates for the bounds, with their memory
    given: bool  # whether the study gives the drive: it stays, whatever is known of it
    task: JointTask  # of its amplifiers a drive takes the first that holds; of none that of the records

    def cases(self, parts: Indices) -> Any:
        """Records of pairs, (K,); parts: rows of motor and gear, (K, 2)."""
        sheets, cases, (left, right) = self.records.sheets, np.repeat(self.records.sheets.plain, len(parts)), parts.T
        cases["motor"], cases["shaft"] = sheets.motors[left], sheets.shafts[left]
        cases["gear"], cases["direct"] = sheets.gears[right], sheets.direct[right]
        return cases

    def amounts(self, numbers: Array) -> Array:
        """Of the joint's own drive, (K, NUMBERS) or (K, 0)."""
        return np.ascontiguousarray(numbers[:, : len(self.work.added.torque)])

    def interval(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Both ends of the torque that open choices leave, without what the joint's own drive adds [N m], (N,) each.

        They lie in the memory of the records, for the bounds that are asked next.

        ``low, high``: Numbers of all joints' drives, (n, NUMBERS).
        """
        offer, whole = self.records, self.records.whole
        open_span(offer.load, offer.others, offer.rows, low, high, offer.half, whole.low, whole.high)
        found = whole.still
        if self.heavy.start.size:
            bottom, top = self.heavy.ends(low, high)
            tilting, axial, radial = _bearing_loads(np.maximum(np.maximum(bottom, -top), 0.0))
            found[:3] = tilting.max(), axial.max(), radial.max()
            whole.tilts[:] = tilting**2, radial**2, _least_cross(bottom, top)
        for at, loads in ((3, self.held), (4, self.swung), (5, self.stops)):
            if loads.start.size:
                found[at] = loads.least(low, high).max()
        if self.brake.start.size:
            memory = self.records.brake
            least, most = self.brake.ends(low, high)
            for ends, *found_ends in zip((memory.torque, memory.static, memory.inertia), least, most, strict=True):
                ends[:] = found_ends
        return whole.low, whole.high

    def load_at(self, sample: int, low: Array, high: Array) -> tuple[Array, Array]:
        """Both ends of the torque at one sample that open choices leave, friction and own drive in it [N m], (1,)."""
        load, rows, own = self.work.load.torque, self.rows.torque, self.work.added.torque
        drives, shown = (*self.others, self.joint), self.records.whole.shown[sample]
        at = loads_with(load[[sample]], np.concatenate([rows[:, [sample]], own[:, [sample]]]), drives)
        least, most = at.ends(low, high)
        return least + shown, most + shown

    def bounded(
        self, pairs: Indices, base: Array, cost: Array, exact: Mask, *, until: float, energies: bool,
        weight: float = 0.0, room: float = math.inf, full: bool = True,
    ) -> tuple[int, Array, Array, Array]:  # fmt: skip
        """Candidates while the torque lies in the interval; see ``bound_candidates``.

        How many were looked at, their utilisations and energies at least, (K,), and the line, (N,).
        """
        line = np.zeros(len(self.records.load))
        used, energy = np.zeros(len(pairs)), np.zeros(len(pairs))
        count = bound_candidates(
            self.records, TABLE, pairs, exact, until, not self.given, room, full, energies, weight, base, cost, used,
            energy, line,
        )  # fmt: skip
        return count, used, energy, line

    def judge(
        self, parts: Indices, own: Array, numbers: Array, *, until: float, quick: bool, power: Array | None = None,
        all_checks: bool = False,
    ) -> Judged:  # fmt: skip
        """Candidates beside chosen drives, each with the first amplifier that holds, else the least overloaded.

        ``parts``: rows of motor and gear, (K, 2); ``own``: the candidates' numbers, (K, NUMBERS); ``numbers``: of all
        joints' drives, (n, NUMBERS); ``until``, ``quick``: as for ``judge_cases``; ``power`` takes the electrical
        power, and the least, on top of what is there [W], (1, 2, N) or (K, 2, N); ``all_checks``: whether every
        check's utilisation is wanted.
        """
        amounts = numbers[list(self.others)].ravel()
        bare = self.work.load
        load = Load(
            bare.torque + amounts @ self.rows.torque,
            # A product of matrices would wake all threads of the library for it, which spin on.
            bare.wrench + np.einsum("k,kct->ct", amounts, self.rows.wrench) if bare.wrench.size else bare.wrench,
            bare.inertia + amounts @ self.rows.inertia if bare.inertia.size else bare.inertia,
            bare.stop + amounts @ self.rows.stop if bare.stop.size else bare.stop,
            bare.static + amounts @ self.rows.static if bare.static.size else bare.static,
        )
        few = self._few(load.torque, load.torque) if quick else None
        work = self.work._replace(load=load, few=None if few is None else self._at(load, few))
        power = np.zeros((0, 2, len(load.torque))) if power is None else power

        def judged(rows: Indices, amplifier: Amplifier | None) -> Judged:
            cases, count = self.cases(parts[rows]), len(rows)
            if amplifier is not None:
                put_amplifier(cases, amplifier, self.task)
            used, binding, lacking = np.zeros(count), np.zeros(count, np.int64), np.zeros(count, np.int64)
            checks = np.zeros((count, len(TABLE)) if all_checks else (0, 0))
            judge_cases(
                cases, as_numbers(cases), TABLE, work, self.amounts(own[rows]), until, quick, power, checks, used,
                binding, lacking,
            )  # fmt: skip
            return Judged(cases, used, binding, lacking, np.zeros(count), checks)

        every = np.arange(len(parts))
        if not self.task.amplifiers or len(power):  # what is drawn does not depend on them
            return judged(every, None)
        found, dearer = judged(every, self.task.amplifiers[0]), self.dearer
        found.price[:] = dearer[0]
        for amplifier, more in zip(self.task.amplifiers[1:], dearer[1:], strict=True):
            left = np.flatnonzero(found.used > 1.0)
            if len(left):
                again = judged(left, amplifier)
                better = np.flatnonzero(again.used < found.used[left])
                found.price[left[better]] = more
                for name in ("cases", "used", "binding", "lacking", *(["checks"] if all_checks else [])):
                    getattr(found, name)[left[better]] = getattr(again, name)[better]
        return found

    @property
    def dearer(self) -> Array:
        """What each amplifier costs above the cheapest, infinite where nobody says, (A,)."""
        prices = np.array([math.inf if one.price is None else one.price for one in self.task.amplifiers])
        return prices - min(prices.min(), np.finfo(float).max)

    def dearer_of_rest(self) -> list[tuple[float, Amplifier | None]]:
        """Of each amplifier what it, or any that is tried after it, costs at least above the cheapest."""
        some = self.task.amplifiers
        least = np.minimum.accumulate(self.dearer[::-1])[::-1] if some else np.zeros(0)
        return [(float(one), own) for one, own in zip(least, some, strict=True) if one < math.inf] or [(0.0, None)]

    def take(self, amplifier: Amplifier | None) -> None:
        """An amplifier for the bounds; None: one that allows what any of the joint's allows."""
        if self.task.amplifiers:
            put_amplifier(self.records.sheets.plain, amplifier or self.task.amplifier, self.task)
            if amplifier is None:  # it allows most, and so brakes hardest: another may brake less
                self.records.sheets.plain["setting"]["stop_current"] = math.nan

    def _few(self, low: Array, high: Array) -> Indices:
        """In each stretch of the cycle the samples that ask most: of acceleration, and of torque at least."""
        least = np.maximum(low, -high)
        return np.concatenate([self.records.sharp, _peaks(least)])

    def _at(self, load: Load, at: Indices) -> Work:
        """The work at a few samples, as far as peaks need it."""
        motion, few, rows = self.work.motion, self.few, np.ascontiguousarray(self.work.added.torque[:, at])
        some = few.motion._replace(**{name: getattr(motion, name)[at] for name in motion._fields[:-2]})
        return few._replace(
            motion=some, load=few.load._replace(torque=load.torque[at]), added=few.added._replace(torque=rows)
        )


@dataclass(frozen=True, eq=False)
class Candidates:
    """The pairs of all joints, P of them; n joints."""

    study: Study  # the task
    work: Workload  # its joints' work
    motors: tuple[str, ...]  # catalogue keys by row; the first gear is that of a direct drive
    gears: tuple[str, ...]
    first: Indices  # pairs of joint j are ``first[j]`` to ``first[j + 1]``, (n + 1,)
    pairs: Indices  # row of the motor and of the gear of each pair, (P, 2)
    numbers: Array  # through which each pair loads joints, the units of ``drive_numbers``, (P, NUMBERS)
    ratio: Array  # of each pair's gear, (P,)
    mass: Array  # of each pair [kg], NaN where unknown, (P,)
    price: Array  # the same, the cheapest of the joint's amplifiers in it
    joints: tuple[JointOffer, ...]  # one a joint
    power_known: bool  # whether every given drive's power is known, as far as it is to be held against the supply

    def keys(self, pair: int) -> tuple[str, str]:
        """The catalogue keys of a pair."""
        motor, gear = self.pairs[pair]
        return self.motors[motor], self.gears[gear]

    def numbers_of(self, chosen: Mapping[int, int]) -> Array:
        """The numbers of chosen pairs by joint, zeros where nothing is chosen, (n, NUMBERS)."""
        numbers = np.zeros((len(self.joints), NUMBERS))
        for joint, pair in chosen.items():
            numbers[joint] = self.numbers[pair]
        return numbers

    def judge(self, joint: int, pairs: Indices, numbers: Array, **options: Any) -> Judged:
        """Candidates of one joint beside chosen drives; options of ``JointOffer.judge``."""
        return self.joints[joint].judge(self.pairs[pairs], self.numbers[pairs], numbers, **options)


def candidates(study: Study, work: Workload | None = None) -> Candidates:
    """The candidates of a study."""
    work, parts = workload(study) if work is None else work, parts_of(study)
    shafts: dict[Any, Any] = {}
    known = True
    for joint, task in enumerate(study.joints):
        law = task.motor_friction
        if law not in shafts:
            shafts[law] = as_records(
                [shaft_friction(Drive(motor, NO_GEAR, motor_friction=law)) for motor in parts.motors], Friction
            )
        if task.drive is not None:
            (motor, gear), sheets = parts.pairs[joint][0], parts.gear_rows[0]
            row = sheets[gear]
            known &= not np.isnan(parts.motor_rows["rotor_inertia"][motor] + unknown_loss(row) + row.inertia)
    pairs, numbers = np.concatenate(parts.pairs), np.concatenate(parts.amounts)
    joints = tuple(
        _offer(work, parts, joint, shafts[task.motor_friction], (pairs, numbers))
        for joint, task in enumerate(study.joints)
    )
    first = np.concatenate([[0], np.cumsum([len(some) for some in parts.pairs])]).astype(np.int64)
    ratio = np.array([gear.ratio for gear in parts.gears])[pairs[:, 1]]
    return Candidates(
        study, work, parts.motor_keys, parts.gear_keys, first, pairs, numbers, ratio, np.concatenate(parts.mass),
        np.concatenate(list(map(_with_amplifier, study.joints, parts.price))), joints, bool(known),
    )  # fmt: skip


def _with_amplifier(task: JointTask, price: Array) -> Array:
    """Prices of pairs with that of the cheapest amplifier; one that is given and has none is left out of the sum."""
    if not task.amplifiers:
        return price + (amplifier_price(task.amplifier) or 0.0)
    return price + min((one.price for one in task.amplifiers if one.price is not None), default=math.nan)


def _offer(work: Workload, parts: Parts, joint: int, shafts: Any, every: tuple[Indices, Array]) -> JointOffer:
    study, cycle = work.study, work.study.cycle
    demand, gears, rubs = work.at(joint, {}).fixed, parts.gear_rows, study.joints[joint].friction.load_share
    if rubs > 0.0:
        gears = gears[0].copy(), gears[1]
        gears[0]["load_friction"] = rubs
    if not rests_on_gear(study.joints[joint], demand):
        demand = replace(demand, wrench=None)
    basis = work.basis[joint] if work.basis else None
    loading = () if basis is None else basis.drives
    others = [k for k in loading if k != joint and loads_by(work, joint, k)]
    nothing = nothing_added(load_of(replace(demand, wrench=None)))
    rows = nothing if basis is None else added_by(work, joint, others)
    own = nothing if basis is None else added_by(work, joint, [joint] if joint in basis.drives else [])
    offered = work_of(demand, own if demand.wrench is not None else own._replace(wrench=own.wrench[:, :, :0].copy()))

    drives = (*others, joint)

    def largest(name: str, *series: Array) -> Loads:
        """Loads where they are largest in each stretch."""
        at = np.unique([_peaks(one) for one in series])
        load, beside, mine = (getattr(one, name)[..., at] for one in (offered.load, rows, offered.added))
        return loads_with(load, np.concatenate([beside, mine]), drives)

    heavy = UNASKED if demand.wrench is None else largest("wrench", *_bearing_loads(offered.load.wrench))
    held = UNASKED if demand.static_torque is None else largest("static", np.abs(demand.static_torque))
    stops = largest("stop", np.abs(offered.load.stop)) if len(demand.stop.torque) else UNASKED
    brake, braking = _brakes(offered, rows, others)
    few, size = offered.few, 2 * STRETCHES
    assert few is not None
    nowhere = {name: np.zeros(size) for name in few.motion._fields[:-2]}
    few = few._replace(
        motion=few.motion._replace(periods=few.motion.periods._replace(step=np.zeros(size)), **nowhere),
        sum=few.sum._replace(torque=np.zeros(size)), traces=new_traces(size, len(cycle.parts)),
    )  # fmt: skip
    steps = offered.motion.periods.step
    share = np.zeros(len(steps))
    for part, weight in zip(cycle.parts, cycle.shares, strict=True):
        if part.stop > part.start + 1:
            share[part] = weight * steps[part] / steps[part].sum()
    plain = paired(
        study, joint, demand, (parts.motor_rows, shafts), gears, np.zeros((min(len(shafts), 1), 2), dtype=np.int64)
    )
    case, friction, (sheets, direct) = plain.copy(), study.joints[joint].friction, gears
    pairs, numbers = every
    records = Offer(
        Sheets(plain, case, parts.motor_rows, shafts, sheets, direct, pairs), as_numbers(case), numbers,
        offered.load.torque, np.array(others, dtype=np.int64),
        rows.torque.reshape(len(others), NUMBERS, len(cycle.time)), np.zeros((len(others), NUMBERS)),
        _peaks(np.abs(demand.acceleration)),
        span_of(few.motion, friction, np.zeros((len(own.torque), size)), np.zeros(size), 0),
        span_of(offered.motion, friction, own.torque, share, heavy.start.shape[-1] * (heavy.start.size > 0)), brake,
    )  # fmt: skip
    swung = UNASKED
    if plain["setting"]["resonance"].any() and offered.load.inertia.size:
        swung = loads_with(offered.load.inertia, np.concatenate([rows.inertia, offered.added.inertia]), drives)
    offer = JointOffer(
        joint, demand, offered, tuple(others), rows, heavy, held, stops, swung, braking, few, records,
        study.joints[joint].drive is not None, study.joints[joint],
    )  # fmt: skip
    offer.take(None)
    return offer


def _brakes(work: Work, rows: Added, others: Sequence[int]) -> tuple[Brake, Loads]:
    """Where stops at a current limit are looked at: of each stretch the fastest sample, and the one of most torque."""
    motion, load, own = work.motion, work.load, work.added
    at = np.zeros(0, dtype=np.int64)
    if load.inertia.size and motion.speed.any():
        moves = motion.loss_speed != 0.0
        swing = motion.speed**2 * np.abs(load.inertia)
        at = np.unique([_peaks(swing), _peaks(moves * np.abs(load.torque)), _peaks(np.abs(motion.speed))])
        at = at[moves[at]]
    acceleration = motion.acceleration[at]

    def three(torque: Array, inertia: Array) -> Array:
        """Torque, static torque and inertia."""
        return np.stack([torque, torque - inertia * acceleration, inertia], axis=-2)

    if not len(at):
        empty, nothing = np.zeros(0), np.zeros((len(own.torque), 0))
        ends = (np.zeros((2, 0)), np.zeros((2, 0)), np.zeros((2, 0)))
        return Brake(empty, empty, empty, empty, nothing, nothing, *ends), UNASKED
    brake = Brake(
        motion.speed[at], motion.loss_speed[at], acceleration, motion.carrier_acceleration[at],
        np.ascontiguousarray(own.torque[:, at]), np.ascontiguousarray(own.inertia[:, at]), *np.zeros((3, 2, len(at))),
    )  # fmt: skip
    start = three(load.torque[at], load.inertia[at])
    return brake, loads_with(start, three(rows.torque[:, at], rows.inertia[:, at]), others)


def _bearing_loads(wrench: Array) -> tuple[Array, Array, Array]:
    """Tilting moment, axial and radial load of wrenches, (N,) each."""
    return np.hypot(wrench[0], wrench[1]), np.abs(wrench[5]), np.hypot(wrench[3], wrench[4])


def _least_cross(low: Array, high: Array) -> Array:
    """The least of |mx fy - my fx| of wrenches that lie between two, (N,)."""
    ends = low, high
    one, other = (np.array([a[i] * b[j] for a in ends for b in ends]) for i, j in ((0, 4), (1, 3)))
    least, most = one.min(axis=0) - other.max(axis=0), one.max(axis=0) - other.min(axis=0)
    return np.maximum(np.maximum(least, -most), 0.0)


def _peaks(values: Array) -> Indices:
    """In each of STRETCHES stretches of equal length where the largest value stands."""
    length, first = len(values) // STRETCHES, np.arange(STRETCHES)
    if length == 0:
        return first % len(values)
    return first * length + values[: STRETCHES * length].reshape(STRETCHES, length).argmax(axis=1)
