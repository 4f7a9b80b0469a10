"""The selection problem: candidates of every joint, the objective, the constraints, and judgements with a cache."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, Indices, Mask
from drivetrain.jit import kernel
from drivetrain.sizing.demand.load_basis import PARAMETERS
from drivetrain.sizing.judge.cases import power_allowance
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.candidates import Candidates
from drivetrain.sizing.search.constraints.common_parts import CommonParts, common_parts
from drivetrain.sizing.search.domains import UNPRICED, Domain, Domains
from drivetrain.study.parts.mounting import mass_counts
from drivetrain.study.parts.selection import SelectionOptions

EQUAL = 1e-9  # relative difference below which objectives or energies are equal
ROUNDING = 1e-9  # excess of a bound over 1 in utilisation that is still attributed to rounding
JUDGE_BATCH = 4096  # largest number of candidates judged in one call
MAX_CACHED_VERDICTS = 10**6


class TipCut(NamedTuple):
    """A cut from a set whose tip deflects too far: the sample, and the direction of the deflection there."""

    sample: int
    direction: tuple[float, float, float]  # unit vector


class ResonanceCut(NamedTuple):
    """A cut from a set whose first resonance is too low: the sample, and the spring torques of the mode there."""

    sample: int
    torques: tuple[float, ...]  # by joint, scaled to length 1


@dataclass(frozen=True, eq=False)
class Problem:
    """The candidates of a study with objective and constraints; P pairs of all joints, n joints."""

    candidates: Candidates  # candidates of the study
    options: SelectionOptions  # objective and constraints of the selection
    fixed_cost: Array  # part of the objective of each pair that does not depend on the other drives, (P,)
    energy_weight: float  # objective per joule of a cycle
    price_weight: float  # objective per unit of price
    objective_step: float  # objectives that round to the same multiple of it are equal
    energy_step: float  # energies that round to the same multiple of it are equal [J]
    is_loaded_by: Mask  # whether the drive of joint k changes the load of joint j, (j, k)
    eligible: tuple[Indices, ...]  # pairs that may be chosen, by joint, smallest fixed cost first
    lacking_data: tuple[Indices, ...]  # pairs whose fixed cost or mass is unknown, by joint
    # largest torque that one unit of each load parameter of the drive of joint k causes at joint j, relative to the
    # largest torque of the bare task there, (j, k, PARAMETERS)
    sensitivity: Array
    constraints: tuple[CommonParts, ...]
    cuts: dict[TipCut | ResonanceCut, None] = field(default_factory=dict)  # ordered set of stiffness cuts found so far
    # utilisation, energy and extra price by pair; the key is the joint and the parameters of the drives that load it
    _verdicts: dict[tuple[int, bytes], dict[int, list[float]]] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.eligible)

    def level(self, objective: float) -> int:
        """An objective as a whole number of steps; equal objectives have the same level."""
        return math.floor(objective / self.objective_step + 0.5)

    def domains(self) -> Domains:
        """The eligible candidates of every joint, untested."""
        return tuple(self._domain(pairs) for pairs in self.eligible)

    def _domain(self, pairs: Indices) -> Domain:
        cost = np.full(len(pairs), UNPRICED) if self.energy_weight else self.fixed_cost[pairs]
        return Domain(pairs, cost, np.zeros(len(pairs), dtype=np.bool_), float(cost.min(initial=np.inf)))

    def range_of(self, domain: Domain) -> tuple[Array, Array]:
        """Smallest and largest load parameters of a joint's candidates, (PARAMETERS,) each."""
        return _range(self.candidates.parameters, domain.pairs)

    def ranges(self, domains: Sequence[Domain]) -> tuple[Array, Array]:
        """Smallest and largest load parameters of all joints' candidates, (n, PARAMETERS) each."""
        low, high = zip(*map(self.range_of, domains), strict=True)
        return np.array(low), np.array(high)

    def load_key(self, joint: int, pairs: Sequence[int]) -> bytes:
        """A key that is equal for all sets that load a joint equally."""
        loading = np.flatnonzero(self.is_loaded_by[joint])
        return self.candidates.parameters[[pairs[int(k)] for k in loading]].tobytes()

    def presolve(
        self, joint: int, domain: Domain, cost_limit: float, full: bool, low: Array, high: Array
    ) -> tuple[Mask, Array, int]:
        """Presolve filter: which candidates of a joint may be feasible below a cost limit, by interval bounds, lower
        bounds on their costs, (K,) each, and how many were tested.

        ``full``: test all candidates, else only those that may be the cheapest. ``low`` and ``high`` are the ranges of
        the load parameters of all joints' drives, (n, PARAMETERS).
        """
        offer, cost = self.candidates.joints[joint], domain.cost.copy()
        offer.torque_interval(low, high)
        utilisation, left, count = np.zeros(len(domain)), np.arange(len(domain)), 0
        for extra_price, amplifier in offer.amplifiers_by_extra_price() if self.price_weight else ((0.0, None),):
            offer.use_amplifier(amplifier)
            base, lower = self.fixed_cost, cost[left]
            if extra_price:
                base = self.fixed_cost + self.price_weight * extra_price
                lower = lower if self.energy_weight else np.maximum(lower, base[domain.pairs[left]])
            tested, utilisation[left], _, _ = offer.bound(
                domain.pairs[left], base, lower, domain.exact[left], until=1.0 + ROUNDING,
                with_energy=self.energy_weight != 0.0, energy_weight=self.energy_weight, cost_limit=cost_limit,
                test_all=full,
            )  # fmt: skip
            cost[left], count = lower, count + tested
            left = left[utilisation[left] > 1.0 + ROUNDING]
            if not len(left):
                break
        offer.use_amplifier(None)
        return (utilisation <= 1.0 + ROUNDING) & (cost < cost_limit), cost, count

    def energy_slopes(self, joint: int, slope: Array) -> Array:
        """Energy at a joint per unit of each load parameter of the drive of joint k [J], (k, PARAMETERS).

        ``slope``: of the power over the load at each sample [W/(N m)], (N,).
        """
        offer, slopes = self.candidates.joints[joint], np.zeros((self.n, PARAMETERS))
        per_unit = offer.unit_loads.torque @ (slope * offer.series.motion.weight)
        slopes[list(offer.loading_joints)] = per_unit.reshape(-1, PARAMETERS)
        return slopes

    def judge(self, joint: int, pairs: Indices, parameters: Array) -> tuple[Array, Array, Array]:
        """Judge candidates of one joint given the load parameters of all drives, (n, PARAMETERS); verdicts are cached.

        Returns the largest utilisation, infinite for an infeasible candidate, the energy of a cycle [J], and the price
        of the amplifier above the cheapest one, (K,) each.
        """
        key = joint, parameters[self.is_loaded_by[joint]].tobytes()
        if key not in self._verdicts and sum(map(len, self._verdicts.values())) > MAX_CACHED_VERDICTS:
            self._verdicts.clear()
        cached = self._verdicts.setdefault(key, {})
        new = np.array([pair for pair in pairs.tolist() if pair not in cached], dtype=np.int64)
        for batch in np.array_split(new, range(JUDGE_BATCH, len(new), JUDGE_BATCH)) if len(new) else ():
            figures = np.column_stack(self._judge_batch(joint, batch, parameters))
            cached.update(zip(batch.tolist(), figures.tolist(), strict=True))
        utilisation, energy, price = np.array([cached[pair] for pair in pairs.tolist()]).reshape(-1, 3).T
        return utilisation, energy, price

    def _judge_batch(self, joint: int, pairs: Indices, parameters: Array) -> tuple[Array, Array, Array]:
        """As ``judge``, without the cache; a fixed drive may lack essential checks, others may not."""
        is_fixed = self.candidates.joints[joint].is_fixed
        found = self.candidates.judge(joint, pairs, parameters, until=1.0, quick=not is_fixed)
        feasible = (found.utilisation <= 1.0) & (is_fixed | (found.missing_check < 0))
        if self.price_weight:
            feasible &= np.isfinite(found.extra_price)
        return (
            np.where(feasible, found.utilisation, math.inf),
            np.nan_to_num(found.cases["figures"]["energy"]),
            np.where(feasible & (self.price_weight != 0.0), found.extra_price, 0.0),
        )

    def cost(self, pairs: Indices, energy: Array, extra_price: Array) -> Array:
        """Part of the objective of some pairs, from their energy [J] and their amplifiers' extra price, (K,)."""
        return np.asarray(self.fixed_cost[pairs] + self.energy_weight * energy + self.price_weight * extra_price)

    def candidate_power(self, joint: int, pairs: Indices, parameters: Array) -> tuple[Array, Array]:
        """Electrical power of feasible candidates, and its lower bound [W], (K, 2, N); no amplifier changes it.

        The second array is the power hidden by missing data, as ``JointResult.power_allowance``, (K, 2).
        """
        power = np.zeros((len(pairs), 2, len(self.candidates.study.cycle.time)))
        found = self.candidates.judge(joint, pairs, parameters, until=math.inf, quick=False, power=power)
        return power, power_allowance(found.cases)

    def set_power(self, pairs: Sequence[int]) -> tuple[Array, Array]:
        """As ``candidate_power``, summed over a set that is feasible at every joint, (2, N) and (2,)."""
        chosen, parameters = np.array(pairs, dtype=np.int64), self.candidates.parameters[list(pairs)]
        by_joint = [self.candidate_power(joint, chosen[joint : joint + 1], parameters) for joint in range(self.n)]
        power, hidden = (np.sum([one[0] for one in series], axis=0) for series in zip(*by_joint, strict=True))
        return power, hidden

    def evaluate(self, pairs: Sequence[int]) -> Evaluation:
        """Full evaluation of a set of drives."""
        return evaluated(self.candidates.work, self.keys(dict(enumerate(pairs))))

    def keys(self, pairs: Mapping[int, int]) -> dict[str, tuple[str, str]]:
        """Keys of (motor, gear) by joint name, of pairs by joint index."""
        joints = self.candidates.study.joints
        return {joints[joint].name: self.candidates.keys(pair) for joint, pair in sorted(pairs.items())}

    def pairs(self, keys: Mapping[str, tuple[str, str]]) -> dict[int, int]:
        """The eligible pairs by joint index, of keys of (motor, gear) by joint name."""
        return {
            joint: next(int(pair) for pair in self.eligible[joint] if self.candidates.keys(pair) == keys[task.name])
            for joint, task in enumerate(self.candidates.study.joints)
        }


@kernel
def _range(parameters: Array, pairs: Indices) -> tuple[Array, Array]:
    """Smallest and largest parameters of some pairs; numpy takes ten times as long for ten thousand pairs."""
    low, high = parameters[pairs[0]].copy(), parameters[pairs[0]].copy()
    for pair in pairs:
        for i in range(len(low)):
            low[i], high[i] = min(low[i], parameters[pair, i]), max(high[i], parameters[pair, i])
    return low, high


def build_problem(candidates: Candidates, options: SelectionOptions) -> Problem:
    """The selection problem of some candidates."""
    study, first = candidates.study, candidates.first_pair
    fixed_cost, lacking = _fixed_costs(candidates, options)
    eligible, lacking_data = [], []
    for joint, task in enumerate(study.joints):
        pairs = np.arange(first[joint], first[joint + 1])
        if task.drive is not None:  # a fixed drive stays even if it lacks data
            fixed_cost[pairs] = np.where(lacking[pairs], 0.0, fixed_cost[pairs])
            lacking[pairs] = False
        lacking_data.append(pairs[lacking[pairs]])
        pairs = pairs[~lacking[pairs]]
        eligible.append(pairs[np.argsort(fixed_cost[pairs], kind="stable")])
    energy_weight = weight_of(options, "energy")
    every = [offer.series for offer in candidates.joints]
    work = math.fsum(float(np.abs(one.load.torque * one.motion.speed * one.motion.weight).sum()) for one in every)
    size = math.fsum(float(fixed_cost[pairs[0]]) for pairs in eligible if len(pairs)) + energy_weight * work
    is_loaded_by = np.zeros((len(eligible), len(eligible)), dtype=np.bool_)
    for joint, offer in enumerate(candidates.joints):
        is_loaded_by[joint, list(offer.loading_joints)] = True
    return Problem(
        candidates, options, fixed_cost, energy_weight, weight_of(options, "price"), EQUAL * (abs(size) or 1.0),
        EQUAL * (work or 1.0), is_loaded_by, tuple(eligible), tuple(lacking_data), _sensitivity(candidates),
        common_parts(candidates, options),
    )  # fmt: skip


def _fixed_costs(candidates: Candidates, options: SelectionOptions) -> tuple[Array, Mask]:
    """Fixed cost of each pair, (P,), and whether it lacks data that the selection needs, (P,)."""
    cost = np.zeros(len(candidates.mass))
    for name, values in (("mass", candidates.mass), ("price", candidates.price)):
        weight = weight_of(options, name)
        if weight:
            cost = cost + weight * values
    lacking = np.isnan(cost)
    for joint in range(len(candidates.joints)):
        if mass_counts(candidates.study, joint):  # an unknown mass would load the joints before by an unknown amount
            pairs = slice(candidates.first_pair[joint], candidates.first_pair[joint + 1])
            lacking[pairs] |= np.isnan(candidates.mass[pairs])
    return cost, lacking


def _sensitivity(candidates: Candidates) -> Array:
    """As ``Problem.sensitivity``."""
    n = len(candidates.joints)
    sensitivity = np.zeros((n, n, PARAMETERS))
    for joint, offer in enumerate(candidates.joints):
        scale = float(np.abs(offer.series.load.torque).max()) or 1.0
        largest = np.abs(offer.unit_loads.torque).max(axis=1)
        sensitivity[joint, list(offer.loading_joints)] = largest.reshape(-1, PARAMETERS) / scale
    return sensitivity
