"""What is said of a part that was not chosen: how it stands, what fells it, and what would let it pass."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from drivetrain.sizing.answers.ratio_results import NearGear
from drivetrain.sizing.results import JointResult, Selection
from drivetrain.study.model import Study
from drivetrain.study.verdicts import Check


class Standing(StrEnum):
    """How a pair stands at a joint, beside the other drives of the chosen set."""

    CHOSEN = "chosen"
    HOLDS = "holds, not chosen"
    FALLS = "falls"
    NOT_JUDGED = "cannot be judged"
    NO_PARTNER = "has no partner"


@dataclass(frozen=True)
class SmallestChange:
    """The smallest change of one number that lets a drive pass; or why none does.

    Attributes:
        what: ``gear ratio``, ``payload``, ``cycle time`` or ``supply voltage``.
        unit: Of the numbers; empty for a ratio.
        before: As it is.
        after: With which it passes, evaluated; None: no change of this number lets it pass.
        short: A little less changed, with which it does not pass, evaluated; None where ``after`` is.
        check: That fails at ``short``; where no change helps, the one that stays over its limit.
        utilisation: Of that check, at ``short`` or at the furthest change tried.
        set_holds: Whether the whole set of drives holds with the change.
        reason: Why no change helps; empty where one does.
        gear: Of the catalogue, nearest in ratio among those that pass with their own sheet; ratios only.
    """

    what: str
    unit: str
    before: float
    after: float | None = None
    short: float | None = None
    check: str = ""
    utilisation: float = 0.0
    set_holds: bool = False
    reason: str = ""
    gear: NearGear | None = None


@dataclass(frozen=True, eq=False)
class PairAnswer:
    """One pair at one joint.

    Attributes:
        joint, motor, gear: Names; the gear of a direct drive is "", of a part without any partner too.
        standing: How it stands.
        passed_over: Rules of the study and missing data for which it may not be chosen, in sentences.
        partners: How many pairs of the part were looked at here; 1 where a pair was named.
        holding: How many of them hold beside the other chosen drives.
        result: Every check beside the other chosen drives; None without a partner.
        felled: The failed check that is furthest over its limit; None where none failed.
        lacking: Checks without which no drive is chosen and for which data are missing.
        changes: The smallest change of each kind; empty where it holds.
        best: The best set in which this joint has the pair (a pair of the part, where only that was named); None where
            that was not asked or it is the chosen one.
    """

    joint: str
    motor: str
    gear: str
    standing: Standing
    passed_over: tuple[str, ...]
    partners: int
    holding: int
    result: JointResult | None
    felled: Check | None
    lacking: tuple[str, ...]
    changes: tuple[SmallestChange, ...]
    best: Selection | None


@dataclass(frozen=True, eq=False)
class WhyNot:
    """Why a part was not chosen.

    Attributes:
        study: The task.
        motor, gear: Keys that were asked after; None for one that was left open.
        selection: What was chosen instead.
        answers: One a joint asked after.
    """

    study: Study
    motor: str | None
    gear: str | None
    selection: Selection
    answers: tuple[PairAnswer, ...]

    @property
    def holds(self) -> bool:
        """Whether it holds at every joint asked after."""
        return all(one.standing in (Standing.CHOSEN, Standing.HOLDS) for one in self.answers)
