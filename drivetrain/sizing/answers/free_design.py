"""An arm whose gears are of any ratio: its drives for a set of ratios, sized from the tip to the base."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import average_torque, torque_exponent
from drivetrain.drive.gear_family import GearFamily
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.sizing.answers.free_ratio_results import Goal
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.operation import Operation, operation
from drivetrain.sizing.judge.verdicts import check_of
from drivetrain.sizing.tolerance.bench import Worst
from drivetrain.study.mounting import drive_mass
from drivetrain.study.study import Study

SIZINGS = 12  # a gear that rides on the link it moves is sized again until its own weight is borne
SETTLED = 1e-10
SPEED_AND_VOLTAGE = ("motor speed", "gear maximum input speed", "gear mean input speed", "motor voltage")


@dataclass(frozen=True, eq=False)
class FreeDesign:
    """A task with a motor and either a fixed gear or a family of gears at every joint.

    Attributes:
        work: The task.
        shelf: Rows with assumptions filled in.
        motors: Key by joint index.
        families: By joint index, of the joints with a free ratio.
        fixed: Drives of the other joints.
        goal: What is to be small.
    """

    work: Workload
    shelf: Shelf
    motors: Mapping[int, str]
    families: Mapping[int, GearFamily]
    fixed: Mapping[int, Drive]
    goal: Goal

    @property
    def study(self) -> Study:
        """The task."""
        return self.work.study

    def mounted(
        self, ratios: Mapping[int, float], after: Mapping[int, Drive] | None = None, joint: int | None = None
    ) -> dict[int, Drive]:
        """The drives for a set of ratios, each sized for the load of those after it.

        Args:
            joint: To start from, going to the base; None: the tip.
        """
        drives = dict(self.fixed)
        drives.update(after or {})
        for index in range(len(self.study.joints) - 1 if joint is None else joint, -1, -1):
            if index in self.families:
                drives[index] = self._sized(index, ratios[index], drives)
        return drives

    def at(self, joint: int, drives: Mapping[int, Drive]) -> Operation:
        """One joint's drive at its work."""
        demand = self.work.at(joint, drives).demand(drives[joint])
        return operation(self.study, joint, demand, drives[joint])

    def share(self, joint: int, drives: Mapping[int, Drive]) -> float:
        """What one joint adds to the goal.

        Returns:
            In the goal's unit, for CURRENT the square of the relative RMS current; NaN where data are missing.
        """
        drive = drives[joint]
        if self.goal is Goal.MASS:
            mass = drive_mass(drive)
            return math.nan if mass is None else mass
        op = self.at(joint, drives)
        if op.missing:
            return math.nan
        if self.goal is Goal.ENERGY:
            return float(op.power @ self.work.weights)
        current = op.motor_torque / float(torque_constant(drive.motor, self.study.ambient))
        squared = op.demand.mean(current**2)
        if self.goal is Goal.HEAT:
            return float(winding_resistance(drive.motor, self.study.ambient)) * squared
        lasting = op.continuous_current.value
        return math.nan if lasting is None else squared / lasting**2

    def total(self, shares: Mapping[int, float]) -> float:
        """The goal of all joints."""
        if self.goal is Goal.CURRENT:
            return math.sqrt(math.fsum(shares.values()) / max(len(shares), 1))
        return math.fsum(shares.values())

    def limit(self, joint: int, drives: Mapping[int, Drive]) -> Worst:
        """How near a joint comes to its limits of speed and of voltage."""
        op = self.at(joint, drives)
        found = [check_of(op, name) for name in SPEED_AND_VOLTAGE]
        return max(
            (Worst(check.name, check.utilisation) for check in found if check.utilisation is not None),
            key=lambda one: one.utilisation, default=Worst("", 0.0),
        )  # fmt: skip

    def _sized(self, joint: int, ratio: float, drives: Mapping[int, Drive]) -> Drive:
        """The drive of a ratio, its gear as small as its load allows."""
        task, family, motor = self.study.joints[joint], self.families[joint], self.shelf.motor(self.motors[joint])
        work = self.work.at(joint, drives)

        def drive(torque: float) -> Drive:
            return Drive(motor, self.shelf.filled(family.gear(ratio, torque)), task.friction, task.motor_friction)

        found = drive(max(family.smallest, 1.0))
        if not family.laws:
            return found
        before = 0.0
        for _ in range(SIZINGS):
            demand = work.demand(found)
            peak = self.study.safety.peak_torque * float(np.abs(demand.loosening_torque).max())
            torque = family.size_for(
                ratio,
                peak,
                average_torque(torque_exponent(found.gear), demand.load_torque, demand.speed, demand.weights),
            )
            found = drive(torque)
            if not work.own_load or abs(torque - before) <= SETTLED * torque:
                break
            before = torque
        return found


def finite(value: float) -> float:
    """A goal for comparing: what is not known is worst.

    Returns:
        The value; infinite where it is not a number.
    """
    return math.inf if math.isnan(value) else value
