"""The candidates of each joint: their share of the objective, whether they hold, and what fells them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.errors import Fault, InputError
from drivetrain.sizing.checks_gear import (
    gear_maximum_input_speed,
    gear_mean_input_speed,
    gear_momentary_torque,
    gear_repeated_peak_torque,
)
from drivetrain.sizing.checks_motor import motor_speed
from drivetrain.sizing.demand import JointDemand, JointWork, Workload, workload
from drivetrain.sizing.fill import Shelf
from drivetrain.sizing.judge import ESSENTIAL, is_direct, judge
from drivetrain.sizing.load_basis import NUMBERS, drive_numbers, loading_drives
from drivetrain.sizing.mounting import drive_mass
from drivetrain.sizing.objectives import drive_price
from drivetrain.sizing.operation import Operation, operation
from drivetrain.sizing.results import Check, Fallen, Verdict
from drivetrain.study.study import DriveMass, JointTask, Study

_PEAKS = (gear_repeated_peak_torque, gear_momentary_torque)
_SPEEDS = (gear_maximum_input_speed, gear_mean_input_speed)


@dataclass(frozen=True, eq=False)
class Candidate:
    """One motor and gear that may drive one joint.

    Attributes:
        motor, gear: Catalogue keys.
        drive: Assumptions filled in.
        share: Of the objective (mass [kg] or price); NaN when unknown.
    """

    motor: str
    gear: str
    drive: Drive
    share: float

    @property
    def keys(self) -> tuple[str, str]:
        """Of motor and gear."""
        return self.motor, self.gear


@dataclass(frozen=True, eq=False)
class Judgement:
    """A candidate held against a joint's demand.

    Attributes:
        candidate: What was judged.
        operation: The drive at its work.
        checks: Those made; all of them when it holds.
        lacking: Essential checks that could not be made.
    """

    candidate: Candidate
    operation: Operation
    checks: tuple[Check, ...]
    lacking: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether no check failed and no essential one is missing."""
        return not self.lacking and all(check.verdict is not Verdict.FAIL for check in self.checks)

    @property
    def distance(self) -> float:
        """How far it is from holding: the largest finite utilisation; infinite when an essential check is missing.

        Heat that runs away has no number of its own; the RMS current tells how far it is.
        """
        found = [check.utilisation for check in self.checks if check.utilisation is not None]
        return math.inf if self.lacking else max((used for used in found if math.isfinite(used)), default=0.0)

    def fallen(self, joint: str) -> Fallen:
        """The check that felled it.

        Args:
            joint: Name of the joint.

        Returns:
            The failed check of highest utilisation within the stage where the first one failed; for a missing
            essential check, its name with ``(not checked)`` and an infinite utilisation.
        """
        failed = [check for check in self.checks if check.verdict is Verdict.FAIL]
        keys = (joint, *self.candidate.keys)
        if not failed:
            name = self.lacking[0]
            required = next((check.required for check in self.checks if check.name == name), None)
            known = math.nan if required is None else required
            unit = next((check.unit for check in self.checks if check.name == name), "")
            return Fallen(*keys, f"{name} (not checked)", known, math.nan, unit, math.inf, self.candidate.share)
        check = max(failed, key=lambda one: one.utilisation or 0.0)
        required, available = _number(check.required), _number(check.available)
        used = _number(check.utilisation)
        return Fallen(*keys, check.name, required, available, check.unit, used, self.candidate.share)


@dataclass(frozen=True, eq=False)
class Field:
    """All candidates of one joint.

    Attributes:
        work: The task.
        joint: Index of the joint.
        candidates: In order of their share of the objective, then of their keys.
        unknown: Those whose share is unknown: they cannot be chosen.
    """

    work: Workload
    joint: int
    candidates: tuple[Candidate, ...]
    unknown: tuple[Candidate, ...]

    @property
    def study(self) -> Study:
        """The task."""
        return self.work.study

    @property
    def name(self) -> str:
        """Of the joint."""
        return self.study.joints[self.joint].name

    @cached_property
    def fast_enough(self) -> tuple[Candidate, ...]:
        """Candidates that hold every limit of speed, which no other drive can change."""
        return tuple(one for one in self.candidates if self._holds_speed(one))

    @cached_property
    def least(self) -> float:
        """Smallest share among those: no choice at this joint adds less; infinite without any."""
        return self.fast_enough[0].share if self.fast_enough else math.inf

    @cached_property
    def capacities(self) -> Array:
        """Peak torque that each gear allows [N m], (candidates that are fast enough,); infinite where unknown."""
        operations = [self._at(one, self.unloaded) for one in self.fast_enough]
        return np.array([min(_available(op, check) for check in _PEAKS) for op in operations])

    @cached_property
    def own_load(self) -> bool:
        """Whether the joint's drive loads the joint itself."""
        return bool(self.work.basis) and self.joint in self.work.basis[self.joint].drives

    @cached_property
    def numbers(self) -> Array:
        """Through which each drive loads the joints before, (candidates that are fast enough, NUMBERS)."""
        rows = [drive_numbers(self.study, self.joint, one.drive) for one in self.fast_enough]
        return np.array(rows).reshape(-1, NUMBERS)

    @cached_property
    def _extremes(self) -> tuple[Array, Array, Array]:
        """Shares, and the smallest and largest numbers up to each of them."""
        shares = np.array([one.share for one in self.fast_enough])
        return shares, np.minimum.accumulate(self.numbers, axis=0), np.maximum.accumulate(self.numbers, axis=0)

    def range_of_numbers(self, room: float) -> tuple[Array, Array]:
        """The smallest and largest numbers of the drives whose share leaves room; of the first one if none does.

        Args:
            room: Largest share [kg or price].

        Returns:
            Both (NUMBERS,), the units of ``drive_numbers``.
        """
        shares, least, most = self._extremes
        last = max(int(np.searchsorted(shares, room * (1.0 + 1e-12), side="right")) - 1, 0)
        return least[last], most[last]

    @cached_property
    def unloaded(self) -> JointDemand:
        """The joint's speed with nothing to carry."""
        demand = self.work.at(self.joint, {}).demand(self.candidates[0].drive)
        return replace(demand, gear_torque=np.zeros_like(demand.gear_torque))

    def _at(self, candidate: Candidate, demand: JointDemand) -> Operation:
        return operation(self.study, self.joint, demand, candidate.drive)

    def _holds_speed(self, candidate: Candidate) -> bool:
        op = self._at(candidate, self.unloaded)
        checks = (motor_speed,) if is_direct(op) else (motor_speed, *_SPEEDS)
        return all(check(op).verdict is not Verdict.FAIL for check in checks)

    def strong_enough(self, work: JointWork) -> Array:
        """Which of the fast enough also have a gear for the peak torque.

        Args:
            work: Of the joint, with the drives after it in place.

        Returns:
            True where the gear's peak limits hold, (candidates that are fast enough,).
        """
        loads = work.least_peaks(self.numbers)
        # What is at the limit to rounding is left to the check itself.
        asked = self.study.safety.peak_torque * loads * (1.0 - 1e-9)
        return np.asarray(asked <= self.capacities)

    def judge(self, candidate: Candidate, work: JointWork, *, full: bool = False) -> Judgement:
        """A candidate held against the joint's demand.

        Args:
            candidate: Of this joint.
            work: Of the joint, with the drives after it in place.
            full: Make every check, also after one has failed.

        Returns:
            The judgement.
        """
        op = self._at(candidate, work.demand(candidate.drive))
        checks = judge(op, stop_at_fail=not full)
        skipped = ("gear repeated peak torque",) if is_direct(op) else ()
        made = {check.name for check in checks if check.verdict is not Verdict.NOT_CHECKED}
        failed = any(check.verdict is Verdict.FAIL for check in checks)
        lacking = () if failed and not full else tuple(n for n in ESSENTIAL if n not in made and n not in skipped)
        return Judgement(candidate, op, checks, lacking)


def joint_fields(study: Study) -> tuple[Field, ...]:
    """The candidates of every joint: its given drive alone, or the pairs that the study allows.

    Args:
        study: The task.

    Returns:
        One field a joint, in the arm's order.

    Raises:
        InputError: A joint without any candidate, or with none whose share of the objective is known; a drive of
            coupled joints that rides on them and loads a shaft that is chosen before it is.
    """
    faults = [fault for joint, task in enumerate(study.joints) for fault in _early(study, joint, task)]
    work, shelf = workload(study), Shelf(study)
    fields = []
    for joint, task in enumerate(study.joints):
        pairs = task.pairs if task.drive is None else (task.drive,)
        known: list[Candidate] = []
        unknown: list[Candidate] = []
        for motor, gear in dict.fromkeys(pairs):
            drive = shelf.drive(task, motor, gear)
            candidate = Candidate(motor, gear, drive, _share(study, drive))
            (unknown if math.isnan(candidate.share) else known).append(candidate)
        if task.drive is not None and unknown:
            known, unknown = [replace(one, share=0.0) for one in unknown], []
        if not known:
            faults.append(_empty(study, task, len(unknown)))
        known.sort(key=lambda one: (one.share, one.keys))
        fields.append(Field(work, joint, tuple(known), tuple(unknown)))
    if faults:
        raise InputError(faults)
    return tuple(fields)


def unknown_share(field: Field) -> list[Fallen]:
    """The candidates that cannot be chosen because their share of the objective is unknown.

    Args:
        field: Of one joint.

    Returns:
        One entry each.
    """
    found = []
    for one in field.unknown:
        name, unit = ("mass", "kg") if drive_mass(one.drive) is None else (field.study.objective, "")
        nothing = (math.nan, math.nan, unit, math.inf, math.nan)
        found.append(Fallen(field.name, one.motor, one.gear, f"{name} (not known)", *nothing))
    return found


def _share(study: Study, drive: Drive) -> float:
    """Of the objective; unknown also where an unknown mass would load the joints before."""
    loads = study.drive_mass in (DriveMass.ADDED, DriveMass.REPLACED)
    return math.nan if loads and drive_mass(drive) is None else _objective_share(study, drive)


def _available(op: Operation, check: Callable[[Operation], Check]) -> float:
    """What a check finds available; infinite where nobody says or there is no gear."""
    available = None if is_direct(op) else check(op).available
    return math.inf if available is None else available


def _empty(study: Study, task: JointTask, unknown: int) -> Fault:
    place = f"joints.{task.name}"
    if unknown:
        problem = f"none of its {unknown} candidates has a known {study.objective}"
        hint = f"fill the {study.objective} column of the catalogue, or change the objective"
        return Fault(place, problem, hint=hint)
    return Fault(place, "has neither a given drive nor a candidate", hint="; ".join(task.passed_over))


def _early(study: Study, joint: int, task: JointTask) -> list[Fault]:
    """Drives before a joint that load its shaft: a search from tip to base would choose them too late."""
    riding = [study.joints[k].name for k in loading_drives(study, joint) if k < joint]
    if not riding:
        return []
    problem = f"is loaded by the drives of {', '.join(riding)}, which a search from tip to base chooses after it"
    hint = "mount: {carrier: group} puts a drive before the joints that it is coupled to; evaluate() has no such limit"
    return [Fault(f"joints.{task.name}", problem, hint=hint)]


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _objective_share(study: Study, drive: Drive) -> float:
    """What one drive adds to the objective."""
    found = {"mass": drive_mass(drive), "price": drive_price(drive), "energy": 0.0}
    return math.fsum(weight * _number(found[name]) for name, weight in study.wanted.weights)
