"""What free ratios come to: the best ratio of each joint in the arm, and the catalogue's gears beside it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear
from drivetrain.drive.gear_family import GearFamily
from drivetrain.study.model import Study
from drivetrain.study.verdicts import Verdict


class Goal(StrEnum):
    """What the ratios are to make small, over all joints together.

    HEAT: mean copper loss at air temperature [W]. CURRENT: root mean square over the joints of RMS current over the
    motor's continuous current [-]. ENERGY: drawn a cycle, what is fed back credited [J]. MASS: of all drives [kg].
    """

    HEAT = "heat"
    CURRENT = "current"
    ENERGY = "energy"
    MASS = "mass"

    @property
    def unit(self) -> str:
        """Of its value."""
        return {"heat": "W", "current": "1", "energy": "J", "mass": "kg"}[self.value]


@dataclass(frozen=True)
class CatalogueGear:
    """A gear of the catalogue in the place of the continuous one, the other joints at their best ratios.

    Attributes:
        key: In the catalogue.
        ratio: As printed, with its sign.
        loss: By how much the goal is above the continuous best, relative; NaN where the sheet says too little.
        verdict: Of the joint's checks with the gear's own sheet.
        binding: The check of highest utilisation.
        utilisation: Of that check.
    """

    key: str
    ratio: float
    loss: float
    verdict: Verdict
    binding: str
    utilisation: float


@dataclass(frozen=True, eq=False)
class FreeJoint:
    """One joint with a free ratio.

    Attributes:
        joint, motor: Names.
        family: Of its gears.
        best: The ratio that is best for the arm.
        alone: The ratio of least RMS torque of this joint's motor alone by formula, the other joints at theirs, limits
            not counted.
        low, high: Ends of what range, speed and voltage allow at the best.
        ended_by: What ends the allowed range above; below it is the range itself or the voltage.
        gear: The continuous gear at the best ratio.
        ratios: Of the sweep, rising, (M,).
        goal: Value of the goal over them, the other joints at their best, (M,).
        rms_torque: Of the motor over them [N m], (M,).
        verdict: Of the joint's checks at the best ratio.
        binding: The check of highest utilisation there.
        utilisation: Of that check.
        gears: Of the catalogue, nearest in ratio first.
    """

    joint: str
    motor: str
    family: GearFamily
    best: float
    alone: float
    low: float
    high: float
    ended_by: str
    gear: Gear
    ratios: Array
    goal: Array
    rms_torque: Array
    verdict: Verdict
    binding: str
    utilisation: float
    gears: tuple[CatalogueGear, ...]


@dataclass(frozen=True, eq=False)
class FreeRatios:
    """The best ratios of an arm.

    Attributes:
        study: The task.
        goal: What they make small.
        value: Of the goal at the best ratios, over all joints [the goal's unit].
        alone: Of the goal when every joint takes the best ratio for its own motor, within its limits.
        joints: Those with a free ratio.
        rounds: Sweeps over the joints until no ratio moved.
        notes: What a reader should know.
    """

    study: Study
    goal: Goal
    value: float
    alone: float
    joints: tuple[FreeJoint, ...]
    rounds: int
    notes: tuple[str, ...]

    @property
    def feasible(self) -> bool:
        """Whether every joint with a free ratio holds; one whose motor lacks data is not proven to."""
        return all(one.verdict in (Verdict.PASS, Verdict.MARGINAL) for one in self.joints)
