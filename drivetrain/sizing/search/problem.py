"""What a search chooses from: the candidates of every joint with their costs, cheapest first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.cases import power_allowance
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.candidates import UNPRICED, Candidates, Domain, Domains, Indices, Mask
from drivetrain.sizing.search.common_parts import CommonParts, common_parts
from drivetrain.study.parts.mounting import mass_counts
from drivetrain.study.parts.selection import SelectionOptions

EQUAL = 1e-9  # of the objective, of the energy: sets that differ by less are equals
ROUNDING = 1e-9  # of a utilisation: a bound that asks so little more rules nothing out
AT_ONCE = 4096  # candidates judged at most at once
REMEMBERED = 10**6  # verdicts


class Cut(NamedTuple):
    """The sample at which a set let the tip go too far, and its way there, of length 1."""

    sample: int
    way: tuple[float, float, float]


class Swing(NamedTuple):
    """The sample at which a set swung too slowly, and the torques of its springs there [N m]."""

    sample: int
    torques: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Problem:
    """The candidates of a study with what is wanted of it; P pairs of all joints, n joints."""

    candidates: Candidates  # of the study
    wanted: SelectionOptions  # what is minimised and must be respected
    share: Array  # what each pair adds to the objective whatever it does, (P,)
    energy: float  # what one joule a cycle adds
    price: float  # what one unit of price adds
    step: float  # objectives, and energies [J], that round to the same multiple of it are equal
    joules: float
    loads: Mask  # whether the drive of joint k changes what is asked of joint j, (j, k)
    known: tuple[Indices, ...]  # pairs by joint that may be chosen, cheapest first
    unknown: tuple[Indices, ...]  # pairs by joint whose share of the objective is not known
    # largest torque that one unit of each number of the drive of joint k makes on joint j, over the largest that the
    # task alone asks there, (j, k, NUMBERS)
    reach: Array
    constraints: tuple[CommonParts, ...]  # for all joints together
    cuts: dict[Cut | Swing, None] = field(default_factory=dict)  # where sets were too soft, each once
    _judged: dict[tuple[int, bytes], dict[int, list[float]]] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """How many joints there are."""
        return len(self.known)

    def level(self, objective: float) -> int:
        """The same number for all objectives that are equal."""
        return math.floor(objective / self.step + 0.5)

    def domains(self) -> Domains:
        """All candidates, with nothing known of them."""
        return tuple(self._domain(pairs) for pairs in self.known)

    def _domain(self, pairs: Indices) -> Domain:
        cost = np.full(len(pairs), UNPRICED) if self.energy else self.share[pairs]
        return Domain(pairs, cost, np.zeros(len(pairs), dtype=np.bool_), float(cost.min(initial=np.inf)))

    def range_of(self, domain: Domain) -> tuple[Array, Array]:
        """Smallest and largest numbers of the candidates left at a joint, (NUMBERS,) each."""
        return _range(self.candidates.numbers, domain.pairs)

    def ranges(self, domains: Sequence[Domain]) -> tuple[Array, Array]:
        """The same of all joints, (n, NUMBERS) each."""
        low, high = zip(*map(self.range_of, domains), strict=True)
        return np.array(low), np.array(high)

    def loads_of(self, joint: int, pairs: Sequence[int]) -> bytes:
        """The numbers of the drives of a set that load a joint."""
        return self.candidates.numbers[[pairs[int(k)] for k in np.flatnonzero(self.loads[joint])]].tobytes()

    def presolved(
        self, joint: int, domain: Domain, limit: float, full: bool, low: Array, high: Array
    ) -> tuple[Mask, Array, int]:
        """Which candidates of a joint may be feasible and cost less than a limit, costs at least, how many were tested.

        ``full``: whether all are tested, or only those that may be the cheapest; low, high: numbers of all
        joints' drives, (n, NUMBERS).
        """
        offer, cost = self.candidates.joints[joint], domain.cost.copy()
        offer.interval(low, high)
        used, left, count = np.zeros(len(domain)), np.arange(len(domain)), 0
        for more, amplifier in offer.dearer_of_rest() if self.price else ((0.0, None),):
            offer.take(amplifier)
            base, least = self.share, cost[left]
            if more:
                base = self.share + self.price * more
                least = least if self.energy else np.maximum(least, base[domain.pairs[left]])
            looked, used[left], _, _ = offer.bounded(
                domain.pairs[left], base, least, domain.exact[left], until=1.0 + ROUNDING,
                energies=self.energy != 0.0, weight=self.energy, room=limit, full=full,
            )  # fmt: skip
            cost[left], count = least, count + looked
            left = left[used[left] > 1.0 + ROUNDING]
            if not len(left):
                break
        offer.take(None)
        return (used <= 1.0 + ROUNDING) & (cost < limit), cost, count

    def slopes(self, joint: int, line: Array) -> Array:
        """Energy at a joint that a unit of each number of the drive of joint k answers for [J], (k, NUMBERS)."""
        offer, found = self.candidates.joints[joint], np.zeros((self.n, NUMBERS))
        found[list(offer.others)] = (offer.rows.torque @ (line * offer.work.motion.weight)).reshape(-1, NUMBERS)
        return found

    def judged(self, joint: int, pairs: Indices, numbers: Array) -> tuple[Array, Array, Array]:
        """Candidates of one joint beside chosen drives; pairs: (K,); numbers: of all joints' drives, (n, NUMBERS).

        Largest utilisation, infinite where one is not feasible, energy a cycle [J], and what the amplifier costs above
        the cheapest, (K,).
        """
        key = joint, numbers[self.loads[joint]].tobytes()
        if key not in self._judged and sum(map(len, self._judged.values())) > REMEMBERED:
            self._judged.clear()
        known, offer = self._judged.setdefault(key, {}), self.candidates.joints[joint]
        new = np.array([pair for pair in pairs.tolist() if pair not in known], dtype=np.int64)
        for some in np.array_split(new, range(AT_ONCE, len(new), AT_ONCE)) if len(new) else ():
            found = self.candidates.judge(joint, some, numbers, until=1.0, quick=not offer.given)
            feasible = (found.used <= 1.0) & (offer.given | (found.lacking < 0))
            if self.price:
                feasible &= np.isfinite(found.price)
            used, energy = np.where(feasible, found.used, math.inf), np.nan_to_num(found.cases["figures"]["energy"])
            figures = np.column_stack([used, energy, np.where(feasible & (self.price != 0.0), found.price, 0.0)])
            known.update(zip(some.tolist(), figures.tolist(), strict=True))
        used, energy, price = np.array([known[pair] for pair in pairs.tolist()]).reshape(-1, 3).T
        return used, energy, price

    def cost(self, pairs: Indices, energy: Array, price: Array) -> Array:
        """What pairs add to the objective, of their energy and of their amplifiers above the cheapest, (K,)."""
        return np.asarray(self.share[pairs] + self.energy * energy + self.price * price)

    def power_of(self, joint: int, pairs: Indices, numbers: Array) -> tuple[Array, Array]:
        """Electrical power of candidates that are feasible, and the least [W], (K, 2, N); amplifiers change none.

        And what their sheets hide of it, as ``JointResult.power_allowance``, (K, 2).
        """
        power = np.zeros((len(pairs), 2, len(self.candidates.study.cycle.time)))
        found = self.candidates.judge(joint, pairs, numbers, until=math.inf, quick=False, power=power)
        return power, power_allowance(found.cases)

    def power(self, pairs: Sequence[int]) -> tuple[Array, Array]:
        """The same of all drives of a set that is feasible at every joint, (2, N) and (2,)."""
        chosen, numbers = np.array(pairs, dtype=np.int64), self.candidates.numbers[list(pairs)]
        every = [self.power_of(joint, chosen[joint : joint + 1], numbers) for joint in range(self.n)]
        power, more = (np.sum([one[0] for one in some], axis=0) for some in zip(*every, strict=True))
        return power, more

    def evaluation(self, pairs: Sequence[int]) -> Evaluation:
        """A set of drives with every check."""
        return evaluated(self.candidates.work, self.keys(dict(enumerate(pairs))))

    def keys(self, pairs: Mapping[int, int]) -> dict[str, tuple[str, str]]:
        """Keys of (motor, gear) by joint name."""
        joints = self.candidates.study.joints
        return {joints[joint].name: self.candidates.keys(pair) for joint, pair in sorted(pairs.items())}


@kernel
def _range(numbers: Array, pairs: Indices) -> tuple[Array, Array]:
    """Smallest and largest numbers of some pairs; numpy takes ten times as long for ten thousand pairs."""
    low, high = numbers[pairs[0]].copy(), numbers[pairs[0]].copy()
    for pair in pairs:
        for i in range(len(low)):
            low[i], high[i] = min(low[i], numbers[pair, i]), max(high[i], numbers[pair, i])
    return low, high


def problem(offered: Candidates, wanted: SelectionOptions) -> Problem:
    """What a search chooses from."""
    study, first = offered.study, offered.first
    share, lacking = _shares(offered, wanted)
    known, unknown = [], []
    for joint, one in enumerate(study.joints):
        pairs = np.arange(first[joint], first[joint + 1])
        if one.drive is not None:  # a given drive stays, whatever is known of it
            share[pairs] = np.where(lacking[pairs], 0.0, share[pairs])
            lacking[pairs] = False
        unknown.append(pairs[lacking[pairs]])
        pairs = pairs[~lacking[pairs]]
        known.append(pairs[np.argsort(share[pairs], kind="stable")])
    energy = weight_of(wanted, "energy")
    works = [offer.work for offer in offered.joints]
    work = math.fsum(float(np.abs(one.load.torque * one.motion.speed * one.motion.weight).sum()) for one in works)
    size = math.fsum(float(share[pairs[0]]) for pairs in known if len(pairs)) + energy * work
    loads = np.zeros((len(known), len(known)), dtype=np.bool_)
    for joint, offer in enumerate(offered.joints):
        loads[joint, list(offer.others)] = True
    return Problem(
        offered, wanted, share, energy, weight_of(wanted, "price"), EQUAL * (abs(size) or 1.0), EQUAL * (work or 1.0),
        loads, tuple(known), tuple(unknown), _reach(offered), common_parts(offered, wanted),
    )  # fmt: skip


def _shares(offered: Candidates, wanted: SelectionOptions) -> tuple[Array, Mask]:
    """What each pair adds to the objective whatever it does, and whether that is not known."""
    share = np.zeros(len(offered.mass))
    for name, values in (("mass", offered.mass), ("price", offered.price)):
        weight = weight_of(wanted, name)
        if weight:
            share = share + weight * values
    lacking = np.isnan(share)
    for joint in range(len(offered.joints)):
        if mass_counts(offered.study, joint):  # it would load the joints before by an unknown amount
            pairs = slice(offered.first[joint], offered.first[joint + 1])
            lacking[pairs] |= np.isnan(offered.mass[pairs])
    return share, lacking


def _reach(offered: Candidates) -> Array:
    n = len(offered.joints)
    reach = np.zeros((n, n, NUMBERS))
    for joint, offer in enumerate(offered.joints):
        scale = float(np.abs(offer.work.load.torque).max()) or 1.0
        reach[joint, list(offer.others)] = np.abs(offer.rows.torque).max(axis=1).reshape(-1, NUMBERS) / scale
    return reach
