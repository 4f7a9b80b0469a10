"""One pair at one joint, judged by the same functions as an evaluation: the authority over compiled code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivetrain.drive.drive import Drive
from drivetrain.sizing.fill import Shelf
from drivetrain.sizing.judge import ESSENTIAL, is_direct, judge
from drivetrain.sizing.operation import operation
from drivetrain.sizing.packed_task import Packed
from drivetrain.study.verdicts import Check, Verdict


@dataclass(frozen=True, eq=False)
class Judgement:
    """A pair held against a joint's demand.

    Attributes:
        checks: Every check.
        lacking: Essential checks that could not be made.
    """

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


def judged(packed: Packed, joint: int, pair: int, drives: Mapping[int, int]) -> Judgement:
    """A pair with every check of an evaluation.

    Args:
        packed: The study.
        joint: Index of the joint.
        pair: Index into the packed pairs.
        drives: Pairs of the other joints that are in place, by joint.

    Returns:
        The judgement.
    """
    study, shelf = packed.study, Shelf(packed.study)

    def drive(at: int, one: int) -> Drive:
        """The drive of a pair."""
        return shelf.drive(study.joints[at], *packed.keys(one))

    own = drive(joint, pair)
    mounted = {k: drive(k, one) for k, one in drives.items() if packed.task.offsets[joint, k] >= 0}
    op = operation(study, joint, packed.work.at(joint, mounted).demand(own), own)
    checks = judge(op)
    made = {check.name for check in checks if check.verdict is not Verdict.NOT_CHECKED}
    skipped = ("gear repeated peak torque",) if is_direct(op) else ()
    return Judgement(checks, tuple(name for name in ESSENTIAL if name not in made and name not in skipped))
