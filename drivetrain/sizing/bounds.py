"""What no choice of drives can go below: the least share of the objective that each undecided joint will cost.

The torque on a joint is a weighted sum over the numbers of the drives after it. While these are open, each number
lies between the smallest and the largest of the candidates that can still be chosen, so each sample's torque lies in
an interval. The smallest magnitude in it is asked of any choice; a candidate that cannot even bear that is out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import mesh_factors
from drivetrain.drive.motor import torque_constant
from drivetrain.sizing.candidates import Candidate, Field
from drivetrain.sizing.checks_gear import TORQUE_ONLY
from drivetrain.sizing.checks_motor import peak_torque_limit
from drivetrain.sizing.demand import JointDemand
from drivetrain.sizing.judge import is_direct
from drivetrain.sizing.load_basis import NUMBERS, drive_numbers
from drivetrain.sizing.operation import Operation, operation
from drivetrain.sizing.results import Verdict

SLACK = 1.0 - 1e-9  # rounding between the interval's ends and the sums themselves


class Bounds:
    """Lower bounds on what undecided joints cost.

    A bound holds for every set that is better than the best one known when it is computed; that is all a search
    needs, as it looks for no others.

    Attributes:
        fields: Candidates of every joint.
        objective: Of the best set known [kg or price]; infinite before the first.
    """

    def __init__(self, fields: Sequence[Field]) -> None:
        self.fields = fields
        self.objective = math.inf
        self._least = [field.least for field in fields]
        self._open: dict[tuple[int, int], bool] = {}

    def improve(self, objective: float) -> None:
        """Tighten the bounds with the objective of a set that fits.

        Args:
            objective: Of the best set known [kg or price].
        """
        self.objective = objective
        self._open.clear()
        for _ in range(2):  # smaller leftovers allow smaller drives, which ask less room
            self._least = [self._least_at(joint, {}, 0.0, tested=True) for joint in range(len(self.fields))]

    def before(self, joint: int, decided: Mapping[int, Drive], spent: float) -> float:
        """The least that all joints before one will cost together.

        Args:
            joint: Index of the joint; it and those before it are undecided.
            decided: Drives of the joints after it, by index.
            spent: What these cost [kg or price].

        Returns:
            [kg or price]; infinite when one of them has no candidate left.
        """
        if math.isinf(self.objective):
            return float(sum(self._least[:joint]))
        return float(sum(self._least_at(j, decided, spent, tested=False) for j in range(joint)))

    def _least_at(self, joint: int, decided: Mapping[int, Drive], spent: float, *, tested: bool) -> float:
        """Least share of the candidates of a joint that may hold; each is tested by its motor where asked."""
        field = self.fields[joint]
        if not field.fast_enough:
            return math.inf
        low, high = self._interval(joint, decided, spent)
        asked = _least_magnitude(low, high).max() * field.study.safety.peak_torque * SLACK
        for index in np.flatnonzero(asked <= field.capacities):
            candidate = field.fast_enough[index]
            if candidate.share + spent > self.objective:
                break
            key = (joint, int(index))
            if tested and key not in self._open:
                self._open[key] = _may_hold(field, candidate, low, high)
            if self._open.get(key, True):
                return candidate.share
        return math.inf

    def _interval(self, joint: int, decided: Mapping[int, Drive], spent: float) -> tuple[Array, Array]:
        """The load torque on a joint, joint friction included, whatever the undecided drives are [N m], (N,) each."""
        field = self.fields[joint]
        study = field.study
        friction = field.unloaded.load_torque  # nothing but the joint's friction
        if not field.work.basis:
            given = field.work.at(joint, {}).demand(field.candidates[0].drive).load_torque
            return given, given
        basis = field.work.basis[joint]
        middle, half = np.zeros(len(basis.force)), np.zeros(len(basis.force))
        for position, k in enumerate(basis.drives):
            rows = slice(NUMBERS * position, NUMBERS * (position + 1))
            if k in decided:
                middle[rows] = drive_numbers(study, k, decided[k])
            else:
                least, most = self.fields[k].range_of_numbers(self._room(k, decided, spent))
                middle[rows], half[rows] = 0.5 * (least + most), 0.5 * (most - least)
        travel = study.joints[joint].travel_per_turn or 1.0
        centre = travel * (basis.bare.force + middle @ basis.force) + friction
        reach = travel * (half @ basis.magnitude)
        return centre - reach, centre + reach

    def _room(self, joint: int, decided: Mapping[int, Drive], spent: float) -> float:
        """The largest share that a joint can have in a set better than the best one."""
        others = sum(least for k, least in enumerate(self._least) if k != joint and k not in decided)
        return self.objective - spent - others


def _least_magnitude(low: Array, high: Array) -> Array:
    """The smallest magnitude in each interval."""
    return np.maximum(np.maximum(low, -high), 0.0)


def _may_hold(field: Field, candidate: Candidate, low: Array, high: Array) -> bool:
    """Whether a drive may hold when the load torque is somewhere in an interval at each sample.

    Motor torque rises with load torque at every sample (as long as the mesh does not lock itself), so its own
    smallest magnitude lies between those of the two ends; heat and currents of warm magnets only add to it.
    """
    demand = field.unloaded

    def at(load: Array) -> Operation:
        """The drive bearing a load torque."""
        loaded: JointDemand = replace(demand, gear_torque=load - demand.load_torque)
        return operation(field.study, field.joint, loaded, candidate.drive)

    least = at(SLACK * np.clip(0.0, low, high))
    if not is_direct(least) and any(check(least).verdict is Verdict.FAIL for check in TORQUE_ONLY):
        return False
    motor = candidate.drive.motor
    if least.missing:
        return False
    if mesh_factors(candidate.drive.gear).driven < 0.0 or motor.magnet_coefficient > 0.0 or field.own_load:
        return True
    ends = np.stack([at(low).torque.total, at(high).torque.total])
    torque = _least_magnitude(ends.min(axis=0), ends.max(axis=0)) * SLACK
    constant = float(torque_constant(motor, field.study.ambient))
    rms = field.study.safety.rms * math.sqrt(demand.mean(torque**2)) / constant
    peak = field.study.safety.peak_torque * float(torque.max())
    amplifier = least.task.amplifier
    limits = (
        (peak, peak_torque_limit(least).value),
        (peak / constant, motor.peak_current),
        (peak / constant, amplifier.peak_current),
        (rms, least.continuous_current.value),
        (rms, amplifier.continuous_current),
    )
    return all(limit is None or value <= limit for value, limit in limits)
