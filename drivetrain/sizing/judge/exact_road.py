"""One pair at one joint, judged by the same functions as an evaluation: the authority over compiled code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from drivetrain.drive.drive import Drive
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.old_judge import judge
from drivetrain.sizing.judge.operation import operation
from drivetrain.sizing.judge.packed_task import Packed
from drivetrain.study.verdicts import Check, Verdict, lacking


@dataclass(frozen=True, eq=False)
class Judgement:
    """A pair held against a joint's demand.

    Attributes:
        checks: Every check.
        lacking: Essential checks that could not be made; none of a drive that the study gives, which is judged by what
            can be checked and stays.
    """

    checks: tuple[Check, ...]
    lacking: tuple[Check, ...]

    @property
    def holds(self) -> bool:
        """Whether no check failed and no essential one is missing."""
        return not self.lacking and not self.failed

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(check for check in self.checks if check.verdict is Verdict.FAIL)

    @property
    def distance(self) -> float:
        """How far it is from holding: the largest finite utilisation; infinite when an essential check is missing.

        Heat that runs away has no number of its own; the RMS current tells how far it is.
        """
        found = [check.utilisation for check in self.checks if check.utilisation is not None]
        return math.inf if self.lacking else max((used for used in found if math.isfinite(used)), default=0.0)


def judged(
    packed: Packed, joint: int, pair: int, drives: Mapping[int, int], *, stop_at_fail: bool = False
) -> Judgement:
    """A pair with every check of an evaluation."""
    study, shelf = packed.study, Shelf(packed.study)

    def drive(at: int, one: int) -> Drive:
        """The drive of a pair."""
        return shelf.drive(study.joints[at], *packed.keys(one))

    own = drive(joint, pair)
    loading = {k: one for k, one in drives.items() if k != joint and packed.task.offsets[joint, k] >= 0}
    mounted = {k: drive(k, one) for k, one in loading.items()}
    op = operation(study, joint, packed.work.at(joint, mounted).demand(own), own)
    checks = judge(op, stop_at_fail=stop_at_fail)
    return Judgement(checks, lacking(checks) if study.joints[joint].drive is None else ())
