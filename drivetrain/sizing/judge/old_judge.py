"""One drive judged stage by stage, for those who still ask for it so."""

from __future__ import annotations

from drivetrain.sizing.judge.checks import CHECKS, GEAR
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.judge.verdicts import told
from drivetrain.study.verdicts import Check, Verdict


def judge(operation: Operation, *, stop_at_fail: bool = False) -> tuple[Check, ...]:
    """Everything held against one drive."""
    found: list[Check] = []
    for stage in range(4):
        found += [
            told(operation, row) for row in CHECKS if row.stage == stage and not (stage == GEAR and operation.direct)
        ]
        if stop_at_fail and any(check.verdict is Verdict.FAIL for check in found):
            break
    return tuple(found)


def is_direct(operation: Operation) -> bool:
    """Whether there is no gear."""
    return operation.direct
