"""What the best set of drives becomes when one number of the task changes: pieces, breakpoints, and an end."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.study.study import Study

PROVEN = "optimal"
PROVEN_ROBUST = "optimal among the sets that hold often enough"


class Vary(StrEnum):
    """What is changed of a task."""

    PAYLOAD = "payload"
    CYCLE_TIME = "cycle_time"
    VOLTAGE = "voltage"
    AMBIENT = "ambient"

    @property
    def unit(self) -> str:
        """Of its values."""
        return {"payload": "kg", "cycle_time": "s", "voltage": "V", "ambient": "degC"}[self.value]


@dataclass(frozen=True, eq=False)
class CurvePoint:
    """The best set at one value.

    Attributes:
        value: Of what is varied.
        drives: Keys of (motor, gear) by joint name; empty where nothing fits.
        objective: Of the set; NaN where nothing fits.
        criteria: Mass [kg], price, energy of a cycle [J] and largest utilisation of the set.
        proof: Of the search that found it; empty where the set was found at another value and evaluated here.
        chance: That the set holds within the study's tolerances; None where that was not counted.
    """

    value: float
    drives: dict[str, Pair]
    objective: float
    criteria: dict[str, float]
    proof: str
    chance: Chance | None = None

    @property
    def feasible(self) -> bool:
        """Whether a set was found."""
        return bool(self.drives)


def is_proven(proof: str) -> bool:
    """Whether the words of a search say that its answer is proven."""
    return proof in ("", PROVEN, PROVEN_ROBUST) or proof.startswith("no set")


@dataclass(frozen=True, eq=False)
class CurvePiece:
    """A range of values in which one set is the best, or none fits.

    Attributes:
        low, high: Its ends.
        drives: Of the set; empty where nothing fits.
        points: The set at some values from low to high; empty where nothing fits.
        low_ends_by, high_ends_by: Place and check that fail beyond each end; what makes another set better there when
            none fails; empty at the ends of what was looked at.
    """

    low: float
    high: float
    drives: dict[str, Pair]
    points: tuple[CurvePoint, ...]
    low_ends_by: str
    high_ends_by: str


@dataclass(frozen=True, eq=False)
class OptimumCurve:
    """The best set over one number of the task.

    Attributes:
        study: The task as it is.
        vary: What is changed.
        payload: Name of the payload whose mass is varied; empty otherwise.
        now: The value in the study.
        points: Every selection made, by value.
        pieces: By rising value, without gaps.
        tolerance: Within which each breakpoint lies [unit of what is varied].
        notes: What a reader should know: what was not proven, and what may have been passed over.
    """

    study: Study
    vary: Vary
    payload: str
    now: float
    points: tuple[CurvePoint, ...]
    pieces: tuple[CurvePiece, ...]
    tolerance: float
    notes: tuple[str, ...]

    @property
    def unit(self) -> str:
        """Of the values."""
        return self.vary.unit

    @property
    def proven(self) -> bool:
        """Whether every selection was proven."""
        return all(is_proven(point.proof) for point in self.points)

    @property
    def feasible(self) -> bool:
        """Whether a set was found at any value."""
        return any(piece.drives for piece in self.pieces)
