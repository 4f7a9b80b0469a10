"""The candidates of each joint: their share of the objective, whether they hold, and what fells them."""

from __future__ import annotations

import math
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
from drivetrain.sizing.demand import JointDemand, joint_demand
from drivetrain.sizing.evaluate import objective_share
from drivetrain.sizing.fill import assumed_drive
from drivetrain.sizing.judge import ESSENTIAL, is_direct, judge
from drivetrain.sizing.mounting import drive_mass
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
        study: The task.
        joint: Index of the joint.
        candidates: In order of their share of the objective, then of their keys.
        unknown: Those whose share is unknown: they cannot be chosen.
    """

    study: Study
    joint: int
    candidates: tuple[Candidate, ...]
    unknown: tuple[Candidate, ...]

    @property
    def name(self) -> str:
        """Of the joint."""
        return self.study.joints[self.joint].name

    @cached_property
    def own_load(self) -> bool:
        """Whether the joint's demand depends on its own drive, which rides on the link it moves."""
        return self.study.arm is not None and self.study.joints[self.joint].mount.carrier == "child"

    @cached_property
    def fast_enough(self) -> tuple[Candidate, ...]:
        """Candidates that hold every limit of speed, which no other drive can change."""
        still = _speed_demand(self.study, self.joint)
        return tuple(one for one in self.candidates if self._holds_speed(one, still))

    @cached_property
    def least(self) -> float:
        """Smallest share among those: no choice at this joint adds less; infinite without any."""
        return self.fast_enough[0].share if self.fast_enough else math.inf

    @cached_property
    def _capacities(self) -> Array:
        """Peak torques that the gears allow [N m], (2, candidates that are fast enough); infinite where unknown."""
        still = _speed_demand(self.study, self.joint)
        rows = [[_capacity(self._at(one, still), check) for one in self.fast_enough] for check in _PEAKS]
        return np.array(rows).reshape(len(_PEAKS), -1)

    def _at(self, candidate: Candidate, demand: JointDemand) -> Operation:
        return operation(self.study, self.joint, demand, candidate.drive)

    def _holds_speed(self, candidate: Candidate, demand: JointDemand) -> bool:
        op = self._at(candidate, demand)
        checks = (motor_speed,) if is_direct(op) else (motor_speed, *_SPEEDS)
        return all(check(op).verdict is not Verdict.FAIL for check in checks)

    def demand(self, mounted: dict[int, Drive]) -> JointDemand | None:
        """What the joint asks with the drives after it in place.

        Args:
            mounted: Drives by joint index.

        Returns:
            The demand; None when it also depends on the joint's own drive.
        """
        return None if self.own_load else joint_demand(self.study, mounted, self.joint)

    def strong_enough(self, demand: JointDemand | None) -> Array:
        """Which of the fast enough also have a gear for the peak torque.

        Args:
            demand: From ``demand``; None leaves all in.

        Returns:
            True where the gear's peak limits hold, (candidates that are fast enough,).
        """
        if demand is None or not self.fast_enough:
            return np.ones(len(self.fast_enough), dtype=bool)
        op = self._at(self.fast_enough[0], demand)
        asked = np.array([[check(op).required] for check in _PEAKS])
        # What is at the limit to rounding is left to the check itself.
        return np.asarray((asked <= self._capacities * (1.0 + 1e-12)).all(axis=0))

    def judge(
        self, candidate: Candidate, mounted: dict[int, Drive], demand: JointDemand | None, *, full: bool = False
    ) -> Judgement:
        """A candidate held against the joint's demand.

        Args:
            candidate: Of this joint.
            mounted: Drives by joint index.
            demand: From ``demand``.
            full: Make every check, also after one has failed.

        Returns:
            The judgement.
        """
        if demand is None:
            demand = joint_demand(self.study, {**mounted, self.joint: candidate.drive}, self.joint)
        op = self._at(candidate, demand)
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
        InputError: A joint without any candidate, or with none whose share of the objective is known.
    """
    fields, faults = [], []
    for joint, task in enumerate(study.joints):
        pairs = task.pairs if task.drive is None else (task.drive,)
        known: list[Candidate] = []
        unknown: list[Candidate] = []
        for motor, gear in dict.fromkeys(pairs):
            drive = assumed_drive(study, task, motor, gear)
            candidate = Candidate(motor, gear, drive, _share(study, drive))
            (unknown if math.isnan(candidate.share) else known).append(candidate)
        if task.drive is not None and unknown:
            known, unknown = [replace(one, share=0.0) for one in unknown], []
        if not known:
            faults.append(_empty(study, task, len(unknown)))
        known.sort(key=lambda one: (one.share, one.keys))
        fields.append(Field(study, joint, tuple(known), tuple(unknown)))
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
    return math.nan if loads and drive_mass(drive) is None else objective_share(study, drive)


def _speed_demand(study: Study, joint: int) -> JointDemand:
    """The joint's speed with nothing to carry."""
    cycle = study.cycle
    unloaded = replace(study, arm=None, cycle=replace(cycle, torque=np.zeros_like(cycle.velocity)))
    demand = joint_demand(unloaded, {}, joint)
    travel = study.joints[joint].travel_per_turn or 1.0
    return demand if study.arm is None else replace(demand, speed=demand.speed / travel)


def _capacity(op: Operation, check: object) -> float:
    """What a check finds available; infinite where nobody says or there is no gear."""
    available = None if is_direct(op) else check(op).available  # type: ignore[operator]
    return math.inf if available is None else float(available)


def _empty(study: Study, task: JointTask, unknown: int) -> Fault:
    place = f"joints.{task.name}"
    if unknown:
        problem = f"none of its {unknown} candidates has a known {study.objective}"
        hint = f"fill the {study.objective} column of the catalogue, or change the objective"
        return Fault(place, problem, hint=hint)
    return Fault(place, "has neither a given drive nor a candidate", hint="; ".join(task.passed_over))


def _number(value: float | None) -> float:
    return math.nan if value is None else value
