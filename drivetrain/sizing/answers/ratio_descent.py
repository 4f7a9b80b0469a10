"""Coordinate descent over the gear ratios of an arm: one objective of all joints, one ratio at a time.

The ratio of a joint changes the torque of its own motor and the load of the joints before it, through the rotor's
reaction and the gear's mass. The joints after it are not affected, so during a line search along one ratio their
contributions to the objective are computed once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

import numpy as np
from scipy.optimize import minimize_scalar

from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import average_torque, torque_exponent
from drivetrain.drive.matching import GearFamily
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.drive.motor_limits import continuous_current
from drivetrain.sizing.answers.ratio import rms_torque
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.vary import Setup, Worst, edges, worst_of
from drivetrain.sizing.results import JointResult
from drivetrain.study.model import Study
from drivetrain.study.parts.mounting import drive_mass
from drivetrain.study.parts.verdicts import Check

MAX_ROUNDS = 12
RATIO_TOLERANCE = 1e-6  # largest relative change of any ratio in a round after which the descent ends
GRID_POINTS = 20  # ratios at which a line search brackets the minimum
EDGE_TOLERANCE = 1e-9  # relative error of the ends of the allowed range
# largest number of sizings of a gear mounted on the link that it moves, until its own weight is included
MAX_SIZINGS = 12
SIZE_TOLERANCE = 1e-10  # relative change of the gear's torque between two sizings
# The checks that limit the range of ratios; the others are reported at the best ratio.
RANGE_CHECKS = ("motor speed", "gear maximum input speed", "gear mean input speed", "motor voltage")


class Goal(StrEnum):
    """Quantity that the ratios minimise, over all joints together.

    HEAT: mean copper loss at ambient temperature [W]. CURRENT: root mean square over the joints of RMS current over the
    motor's continuous current [-]. ENERGY: drawn per cycle, with energy fed back subtracted [J]. MASS: of all drives
    [kg].
    """

    HEAT = "heat"
    CURRENT = "current"
    ENERGY = "energy"
    MASS = "mass"

    @property
    def unit(self) -> str:
        return {"heat": "W", "current": "1", "energy": "J", "mass": "kg"}[self.value]


@dataclass(frozen=True, eq=False)
class ArmDesign:
    """A task with a drive for every joint: a motor with a family of gears of any ratio, or a fixed drive."""

    work: Workload
    filled_parts: FilledParts
    motors: Mapping[int, str]  # catalogue keys by joint index, as the following
    families: Mapping[int, GearFamily]  # gear families of the joints with a free ratio
    fixed: Mapping[int, Drive]  # drives of the other joints
    goal: Goal

    @property
    def study(self) -> Study:
        return self.work.study

    def middle_ratios(self) -> dict[int, float]:
        """The geometric middle of the range of every free ratio, by joint index."""
        return {joint: math.sqrt(family.low * family.high) for joint, family in self.families.items()}

    def setup(self, ratios: Mapping[int, float]) -> Setup:
        """The drives with some ratios, each gear sized for the load of the drives after it; ratios by joint index."""
        return self._sized_up_to(len(self.study.joints) - 1, ratios, dict(self.fixed))

    def setup_with(self, joint: int, ratios: Mapping[int, float], current: Setup) -> Setup:
        """The drives with some ratios, where the drives of the joints after ``joint`` are those of a current setup."""
        after = {i: drive for i, drive in current.drives.items() if i > joint}
        return self._sized_up_to(joint, ratios, {**self.fixed, **after})

    def contribution(self, setup: Setup, joint: int) -> float:
        """Contribution of one joint to the objective; its square for CURRENT; NaN where data are missing."""
        drive, ambient = setup.drives[joint], self.study.ambient
        if self.goal is Goal.MASS:
            mass = drive_mass(drive)
            return math.nan if mass is None else mass
        result = setup.joint(joint)
        if not result.torque_known:
            return math.nan
        if self.goal is Goal.ENERGY:
            return float(result.series.electrical_power @ self.work.weights)
        squared_current = (rms_torque(setup, joint) / float(torque_constant(drive.motor, ambient))) ** 2
        if self.goal is Goal.HEAT:
            return float(winding_resistance(drive.motor, ambient)) * squared_current
        mounting = self.study.joints[joint].housing_to_ambient
        limit = continuous_current(drive.motor, ambient, housing_to_ambient=mounting).value
        return math.nan if limit is None else squared_current / limit**2

    def objective(self, setup: Setup, known: Mapping[int, float] | None = None) -> float:
        """The goal over all joints; ``known``: contributions of some joints that are computed already."""
        count = len(self.study.joints)
        parts = [known[i] if known and i in known else self.contribution(setup, i) for i in range(count)]
        return math.sqrt(math.fsum(parts) / count) if self.goal is Goal.CURRENT else math.fsum(parts)

    def _sized_up_to(self, joint: int, ratios: Mapping[int, float], drives: dict[int, Drive]) -> Setup:
        for index in range(joint, -1, -1):
            if index in self.families:
                drives[index] = self._sized_drive(index, ratios[index], drives)
        return Setup(self.work, drives)

    def _sized_drive(self, joint: int, ratio: float, drives: Mapping[int, Drive]) -> Drive:
        """The drive with a ratio, its gear as small as its load permits; ``drives``: those of the joints after it."""
        task, family, work = self.study.joints[joint], self.families[joint], self.work.at(joint, drives)
        motor = self.filled_parts.motor(self.motors[joint])

        def drive(torque: float) -> Drive:
            gear = self.filled_parts.filled(family.gear(ratio, torque))
            return Drive(motor, gear, task.friction, task.motor_friction)

        found = drive(max(family.smallest, 1.0))
        if not family.laws:
            return found
        before = 0.0
        for _ in range(MAX_SIZINGS):
            demand = work.demand(found)
            peak = self.study.safety.peak_torque * float(np.abs(demand.loosening_torque).max())
            exponent = torque_exponent(found.gear)
            mean = average_torque(exponent, demand.load_torque, demand.speed, demand.weights)
            torque = family.size_for(ratio, peak, mean)
            found = drive(torque)
            if not work.own_load or abs(torque - before) <= SIZE_TOLERANCE * torque:
                break
            before = torque
        return found


def checks_with_limits(result: JointResult) -> list[Check]:
    """The checks of a joint; of an ideal gear, which has no limits, without its own."""
    ideal = result.drive.gear.kind == "ideal"
    return [check for check in result.checks if not (ideal and check.name.startswith("gear "))]


def coordinate_descent(design: ArmDesign) -> tuple[dict[int, float], int]:
    """Ratios by joint index at which no change of a single ratio lowers the objective, and the number of rounds.

    A round is one line search per joint, from the tip to the base.
    """
    ratios = design.middle_ratios()
    for turn in range(1, MAX_ROUNDS + 1):
        change = 0.0
        for joint in sorted(design.families, reverse=True):
            best = LineSearch(design, joint, ratios).minimum().ratio
            change = max(change, abs(best / ratios[joint] - 1.0))
            ratios[joint] = best
        if change <= RATIO_TOLERANCE:
            return ratios, turn
    return ratios, MAX_ROUNDS


@dataclass(frozen=True)
class LineMinimum:
    """The minimum along one ratio, and the allowed range that contains it."""

    ratio: float
    low: float  # lower end of the range in which the limits of speed and voltage are met
    high: float  # its upper end
    ended_by: str  # the check that limits the range above, or the family's own range


class LineSearch:
    """The objective as a function of the ratio of one joint, with the other ratios kept."""

    def __init__(self, design: ArmDesign, joint: int, ratios: Mapping[int, float]) -> None:
        self.design, self.joint, self.ratios = design, joint, dict(ratios)
        self.current = design.setup(ratios)
        self.setup = cache(lambda ratio: design.setup_with(joint, {**self.ratios, joint: ratio}, self.current))
        joints_after = range(joint + 1, len(design.study.joints))
        self._unaffected = {i: design.contribution(self.current, i) for i in joints_after}

    def objective(self, ratio: float) -> float:
        """Objective at a ratio; infinite where it cannot be computed."""
        value = self.design.objective(self.setup(ratio), self._unaffected)
        return math.inf if math.isnan(value) else value

    def binding_limit(self, ratio: float) -> Worst:
        """The limit of speed or voltage with the highest utilisation; above 1 the ratio is not allowed."""
        result = self.setup(ratio).joint(self.joint)
        return worst_of(check for check in checks_with_limits(result) if check.name in RANGE_CHECKS)

    def _grid(self) -> list[float]:
        """A grid of ratios; if none of them is allowed, also the ratio between them that is nearest to its limits."""
        family = self.design.families[self.joint]
        grid = [float(ratio) for ratio in np.geomspace(family.low, family.high, GRID_POINTS)]
        used = [self.binding_limit(ratio).utilisation for ratio in grid]
        at = int(np.argmin(used))
        if 1.0 < used[at] < math.inf:
            ends = math.log(grid[max(at - 1, 0)]), math.log(grid[min(at + 1, GRID_POINTS - 1)])
            found = minimize_scalar(
                lambda x: self.binding_limit(math.exp(x)).utilisation, bounds=ends, method="bounded",
                options={"xatol": 1e-4},
            )  # fmt: skip
            grid = sorted([*grid, math.exp(float(found.x))])
        return grid

    def minimum(self) -> LineMinimum:
        """The smallest objective within the allowed ranges: the best ratio of a grid, refined by Brent's method."""
        grid = self._grid()
        allowed = edges(lambda ratio: self.binding_limit(ratio).utilisation <= 1.0, grid, error=EDGE_TOLERANCE)
        ranges = list(allowed)
        if not ranges:
            least = min(grid, key=lambda ratio: self.binding_limit(ratio).utilisation)
            return LineMinimum(least, least, least, self.binding_limit(least).check)
        inside = [any(low.inside <= ratio <= high.inside for low, high in ranges) for ratio in grid]
        values = [self.objective(ratio) if own else math.inf for ratio, own in zip(grid, inside, strict=True)]
        at = int(np.argmin(values))
        first, last = next((a, b) for a, b in ranges if a.inside <= grid[at] <= b.inside)
        low, high = max(first.inside, grid[0]), min(last.inside, grid[-1])
        left, right = max(low, grid[max(at - 1, 0)]), min(high, grid[min(at + 1, len(grid) - 1)])
        found = minimize_scalar(
            lambda x: self.objective(math.exp(x)), bounds=(math.log(left), math.log(right)), method="bounded",
            options={"xatol": 1e-8},
        )  # fmt: skip
        best = min([math.exp(float(found.x)), grid[at], left, right], key=self.objective)
        ended_by = self.binding_limit(last.outside).check if last.known else "end of the range"
        return LineMinimum(best, low, high, ended_by)
