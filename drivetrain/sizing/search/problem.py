"""What a search chooses from: the candidates of every joint with their costs, cheapest first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.checks_supply import supply_checks
from drivetrain.sizing.judge.evaluate import evaluated
from drivetrain.sizing.judge.exact_road import judged
from drivetrain.sizing.judge.objectives import weight_of
from drivetrain.sizing.judge.packed_task import SPEED, WEIGHT, Packed, chosen_numbers
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.power_bound import power_range
from drivetrain.sizing.search.propagation import (
    Choices,
    Indices,
    Memory,
    Setting,
    compile_propagate,
    compile_set_power,
    new_memory,
    set_power,
)
from drivetrain.sizing.search.spare_parts import Rule, rules_of
from drivetrain.study.mounting import mass_counts
from drivetrain.study.selection import Wanted
from drivetrain.study.verdicts import Verdict

CLOSE = 1e-9  # to the limit: what is nearer is asked of the exact road
EQUAL = 5e-10  # of the objective: sets that differ by less are put in order by their reserve
RANK, RANKS = 2e-5, 50  # of a utilisation: pairs that differ by less are put in order by the study, up to so many


@dataclass(frozen=True, eq=False)
class Problem:
    """A packed study with what is wanted of it.

    Attributes:
        packed: The study.
        wanted: What is minimised and must be respected.
        setting: What pairs add to the objective, and which drives load which joints.
        known: Pairs by joint that may be chosen, cheapest first.
        unknown: Pairs by joint whose share of the objective is not known.
        reach: Largest torque that one unit of each number of the drive of joint k makes on joint j, over the largest
            that the task alone asks there, (j, k, NUMBERS).
        rules: For all joints together.
        memory: That every step fills again.
    """

    packed: Packed
    wanted: Wanted
    setting: Setting
    known: tuple[Indices, ...]
    unknown: tuple[Indices, ...]
    reach: Array
    rules: tuple[Rule, ...]
    memory: Memory

    @property
    def n(self) -> int:
        """How many joints there are."""
        return len(self.known)

    @property
    def trifle(self) -> float:
        """What puts equal sets in order adds less than this to their objective."""
        return 1.1 * self.n * self.setting.reserve

    def numbers(self, drives: Mapping[int, int]) -> Array:
        """The numbers through which drives load joints.

        Returns:
            (n, NUMBERS), the units of ``drive_numbers``; zeros where nothing is chosen.
        """
        return chosen_numbers(self.packed, drives)

    def holds(self, joint: int, pair: int, drives: Mapping[int, int]) -> bool:
        """Whether a pair holds at a joint, by the Python road."""
        return judged(self.packed, joint, pair, drives).holds

    def supply_holds(self, pairs: Sequence[int]) -> bool:
        """Whether a set that holds at every joint asks no more of the supply than it gives."""
        study = self.packed.study
        supply = study.supply
        limits = (supply.peak_power, supply.mean_power, supply.regenerated_power)
        if not self.packed.power_known or limits == (None, None, None):
            return True
        total = np.zeros(len(study.cycle.time))
        set_power(self.packed.task, np.array(pairs, dtype=np.int64), self.memory, total)
        cycle = study.cycle
        checks = supply_checks(supply, cycle.time, cycle.weights, {"all": total}, reserve=study.safety.reserve)
        used = [check.utilisation for check in checks if check.utilisation is not None]
        if any(abs(one - 1.0) <= CLOSE for one in used):
            return not any(check.verdict is Verdict.FAIL for check in self.evaluation(pairs).shared)
        return all(one <= 1.0 for one in used)

    def supply_may_hold(self, choices: Choices) -> bool:
        """Whether some set of what is left may ask no more of the supply than it gives."""
        study, supply = self.packed.study, self.packed.study.supply
        if not self.packed.power_known:
            return True
        back, total = supply.regenerated_power, np.empty((2, len(study.cycle.time)))
        power_range(self.packed.task, self.setting, choices, self.memory, back is not None, total)
        weights, over = study.cycle.weights, 1.0 + 1e-6
        drawn, fed_back = np.maximum(total[0], 0.0), np.maximum(-total[1], 0.0)
        if supply.peak_power is not None and drawn.max() > supply.peak_power * over:
            return False
        duration = float(weights.sum()) or math.inf
        if supply.mean_power is not None and float(drawn @ weights) / duration > supply.mean_power * over:
            return False
        return back is None or float(fed_back @ weights) / duration <= back * over

    def evaluation(self, pairs: Sequence[int]) -> Evaluation:
        """A set of drives with every check, by the Python road."""
        return evaluated(self.packed.work, self.keys(dict(enumerate(pairs))))

    def keys(self, pairs: Mapping[int, int]) -> dict[str, tuple[str, str]]:
        """A set of drives by names.

        Returns:
            Keys of (motor, gear) by joint name.
        """
        joints = self.packed.study.joints
        return {joints[joint].name: self.packed.keys(pair) for joint, pair in sorted(pairs.items())}


def problem(packed: Packed, wanted: Wanted) -> Problem:
    """What a search chooses from."""
    task, study = packed.task, packed.study
    share, unknown = _shares(packed, wanted)
    known_by, unknown_by = [], []
    for joint, one in enumerate(study.joints):
        pairs = np.arange(task.first[joint], task.first[joint + 1])
        lacking = unknown[pairs]
        if one.drive is not None:  # a given drive stays, whatever is known of it
            share[pairs] = np.where(lacking, 0.0, share[pairs])
            lacking = np.zeros(len(pairs), dtype=bool)
        unknown_by.append(pairs[lacking])
        pairs = pairs[~lacking]
        known_by.append(pairs[np.argsort(share[pairs], kind="stable")])
    energy = weight_of(wanted, "energy")
    trifle = _trifle(packed, share, energy, known_by)
    compile_propagate()
    compile_set_power()
    setting = Setting(share, _in_order(share, trifle, known_by), energy, trifle, _loads(packed))
    return Problem(
        packed, wanted, setting, tuple(known_by), tuple(unknown_by), _reach(packed),
        rules_of(packed, wanted), new_memory(task)
    )  # fmt: skip


def _shares(packed: Packed, wanted: Wanted) -> tuple[Array, NDArray[np.bool_]]:
    """What each pair adds to the objective whatever it does, and whether that is not known."""
    share = np.zeros(len(packed.mass))
    for name, values in (("mass", packed.mass), ("price", packed.price)):
        weight = weight_of(wanted, name)
        if weight:
            share = share + weight * values
    lacking = np.isnan(share)
    for joint in range(len(packed.study.joints)):
        if mass_counts(packed.study, joint):  # it would load the joints before by an unknown amount
            pairs = slice(packed.task.first[joint], packed.task.first[joint + 1])
            lacking[pairs] |= np.isnan(packed.mass[pairs])
    return share, lacking


def _trifle(packed: Packed, share: Array, energy: float, known: list[Indices]) -> float:
    """What a whole utilisation counts: so little that all joints together count less than EQUAL of the objective."""
    size = math.fsum(float(share[pairs[0]]) for pairs in known if len(pairs))
    if energy:
        task = packed.task
        work = np.abs(task.bare * task.series[:, SPEED] * task.series[:, WEIGHT]).sum()
        size += energy * float(work)
    return EQUAL * (abs(size) or 1.0) / max(len(known), 1)


def _in_order(share: Array, trifle: float, known: list[Indices]) -> Array:
    """Shares with still less added, by which pairs of equal share come in the order of the study."""
    base = share.copy()
    for joint, pairs in enumerate(known):
        values = share[pairs]
        new = np.append(True, np.diff(values) > trifle)
        place = np.arange(len(pairs))
        rank = np.minimum(place - np.maximum.accumulate(np.where(new, place, 0)), RANKS)
        base[pairs] += RANK * trifle * rank * (1.0 + 0.5 * (len(known) - joint) / len(known))
    return base


def _loads(packed: Packed) -> NDArray[np.bool_]:
    """Whether the drive of joint k changes what is asked of joint j, (j, k); its own is judged with each pair."""
    task, n = packed.task, len(packed.study.joints)
    loads = np.zeros((n, n), dtype=bool)
    for joint, k in np.argwhere(task.offsets >= 0):
        rows = slice(task.offsets[joint, k], task.offsets[joint, k] + NUMBERS)
        loads[joint, k] = joint != k and any(part[rows].any() for part in (task.force, task.inertia, task.wrench))
    return loads


def _reach(packed: Packed) -> Array:
    task = packed.task
    n = len(packed.study.joints)
    reach = np.zeros((n, n, NUMBERS))
    for joint in range(n):
        scale = float(np.abs(task.bare[joint]).max()) or 1.0
        for k in range(n):
            row = int(task.offsets[joint, k])
            if row >= 0 and k != joint:
                reach[joint, k] = np.abs(task.force[row : row + NUMBERS]).max(axis=1) / scale
    return reach
