"""What a study of one joint's gear ratio says."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.drive.matching import LoadMatch, RatioRange
from drivetrain.study.model import Study
from drivetrain.study.verdicts import Check, Verdict


@dataclass(frozen=True, eq=False)
class RatioPoint:
    """One motor with one ratio doing the joint's work.

    Attributes:
        ratio: Magnitude of the gear ratio.
        rms_torque: Of the motor over the cycle [N m].
        peak_torque: Of the motor, with what it takes to start [N m].
        motor_speed: Largest [rad/s].
        winding_temperature: Hottest of the repeated cycle [C]; infinite when it runs away, NaN when not computed.
        utilisations: Of every check, by its name; NaN where it could not be judged.
    """

    ratio: float
    rms_torque: float
    peak_torque: float
    motor_speed: float
    winding_temperature: float
    utilisations: Mapping[str, float]

    @property
    def binding(self) -> str:
        """The check of highest utilisation; empty when none was judged."""
        judged = {name: used for name, used in self.utilisations.items() if not math.isnan(used)}
        return max(judged, key=lambda name: judged[name], default="")

    @property
    def utilisation(self) -> float:
        """The highest of all checks; 1 is the limit; infinite when none was judged."""
        return self.utilisations[self.binding] if self.binding else math.inf

    @property
    def fits(self) -> bool:
        """Whether no check is over its limit."""
        return self.utilisation <= 1.0


@dataclass(frozen=True)
class RatioWindow:
    """Ratios at which every check holds.

    Attributes:
        low, high: Its ends; infinite when nothing ends it in the range looked at.
        low_binding, high_binding: The check that fails just beyond each end; empty when none was found.
    """

    low: float
    high: float
    low_binding: str
    high_binding: str


@dataclass(frozen=True)
class NearGear:
    """A gear of the catalogue held against the same task with the same motor, with its own sheet.

    Attributes:
        key: In the catalogue.
        ratio: As printed, with its sign.
        utilisation: The highest of all checks; infinite when none was judged.
        binding: The check it belongs to.
        verdict: Over all checks.
        inside: Whether its ratio lies in a window of the template; its own limits may still differ.
    """

    key: str
    ratio: float
    utilisation: float
    binding: str
    verdict: Verdict
    inside: bool


@dataclass(frozen=True)
class RatioLimits:
    """Where the limits of motor and gear lie, safety factors taken out of them; None where unknown.

    Attributes:
        continuous_torque: Of the warm motor [N m].
        peak_torque: Of the motor [N m].
        motor_speed: Of motor and gear input, the smaller [rad/s].
        winding_temperature: [C].
    """

    continuous_torque: float | None
    peak_torque: float | None
    motor_speed: float | None
    winding_temperature: float | None


@dataclass(frozen=True, eq=False)
class ClosedForms:
    """The ratios that formulas give for the same motion.

    Attributes:
        matching: sqrt(mean load inertia over rotor inertia); None without an arm.
        least_rms: Of the smallest RMS motor torque, all but Stribeck friction counted; NaN where data are missing.
        least_peak: Of the smallest peak motor torque, starting from rest not counted; NaN where data are missing.
        rated: Ranges in which the RMS torque is within the continuous one; None where that is unknown.
        load_match: The same by accelerating and load factor, one efficiency for all of the motion; None where unknown.
    """

    matching: float | None
    least_rms: float
    least_peak: float
    rated: tuple[RatioRange, ...] | None
    load_match: LoadMatch | None


@dataclass(frozen=True, eq=False)
class RatioStudy:
    """What the ratio of one joint's gear decides, every other number of its motor and gear kept.

    Attributes:
        study: What was asked.
        joint: Name of the joint.
        motor, gear: Catalogue keys of the motor and of the gear whose ratio is varied; gear "" is an ideal gear.
        drive: The template, assumptions filled in.
        points: By rising ratio.
        windows: In which every check holds, lowest first.
        best: Where the highest utilisation of what the ratio changes is smallest (a limit of output torque, say, is as
            far at every ratio).
        limits: For the pictures.
        closed_forms: What formulas say.
        gears: The nearest in the catalogue, nearest to ``best`` first.
        reaction: By how much the torque of each joint before changes across the window, over its own peak: the rotor's
            reaction, which a faster rotor makes larger. Empty without a window of two ends.
        notes: What a reader should know.
        lacking: Essential checks that could not be made at any ratio; with one no ratio is proven to fit.
    """

    study: Study
    joint: str
    motor: str
    gear: str
    drive: Drive
    points: tuple[RatioPoint, ...]
    windows: tuple[RatioWindow, ...]
    best: RatioPoint
    limits: RatioLimits
    closed_forms: ClosedForms
    gears: tuple[NearGear, ...]
    reaction: Mapping[str, float]
    notes: tuple[str, ...]
    lacking: tuple[Check, ...] = ()

    @property
    def feasible(self) -> bool:
        """Whether some ratio is proven to fit."""
        return bool(self.windows) and not self.lacking

    @property
    def ratios(self) -> Array:
        """Of the points, rising, (M,)."""
        return np.array([point.ratio for point in self.points])

    def series(self, field: str) -> Array:
        """One number over the ratio.

        Args:
            field: Name of a RatioPoint's number, such as ``rms_torque`` [N m].

        Returns:
            In the field's unit, (M,).
        """
        return np.array([getattr(point, field) for point in self.points], dtype=np.float64)

    def utilisation_of(self, check: str) -> Array:
        """One check over the ratio.

        Returns:
            Its utilisation; NaN where it could not be judged, (M,).
        """
        return np.array([point.utilisations.get(check, math.nan) for point in self.points])
