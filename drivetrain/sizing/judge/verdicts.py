"""The table of checks told for one drive, and for the supply behind all: numbers, verdicts, instants, words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Supply
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.records import known
from drivetrain.sizing.judge.checks import CHECKS, GEAR, SUPPLY_CHECKS, TORQUE, Requirement
from drivetrain.sizing.judge.judge import utilisation
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.verdicts import Check, Verdict


def checks_of(op: Operation) -> tuple[Check, ...]:
    """Every check of one drive; those of the gear only where there is one, wishes only where they are stated."""
    rows = [row for row in CHECKS if not (row.stage == GEAR and op.direct)]
    return tuple(told(op, row) for row in rows if not row.wish or op.number(row.asked) != 0.0)


def check_of(op: Operation, name: str) -> Check:
    """One check by its name."""
    return told(op, next(row for row in CHECKS if row.name == name))


def told(op: Operation, row: Requirement) -> Check:
    """One row of the table, held against what a drive does."""
    factor, basis = op.number(row.factor), op.task.amplifier.current_basis
    if row.stage >= TORQUE and op.missing:
        lack = f"cannot be computed: {op.missing} not on the sheet and not assumed"
        return Check(
            row.name, None, None, row.unit, None, Verdict.NOT_CHECKED, remark=lack, essential=row.essential,
            factor=factor, current_basis=basis,
        )  # fmt: skip
    words = row.words(op, row)
    required = _number(op.number(row.required) * factor * row.scale)
    limit = None if words.silent else _number(op.number(row.limit) * row.scale)
    endless = required is not None and math.isinf(required)
    used = op.utilisation(row) if required is not None and (endless or limit is not None) else None
    instant = None if required is None or endless else op.instant(row.instant)
    if used is None:
        remark = words.remark or "the sheet gives no limit"
        required = None if words.silent else required
        return Check(
            row.name, required, limit, row.unit, None, Verdict.NOT_CHECKED, None if words.silent else instant,
            words.source, remark, row.essential and op.number(row.asked) != 0.0, factor, basis,
        )  # fmt: skip
    verdict = judged(used, op.safety.reserve)
    return Check(
        row.name, required, limit, row.unit, used, verdict, instant, words.source, words.remark, row.essential, factor,
        basis,
    )  # fmt: skip


def judged(used: float, reserve: float) -> Verdict:
    """The verdict on a utilisation."""
    if used <= 1.0 - reserve:
        return Verdict.PASS
    return Verdict.MARGINAL if used <= 1.0 else Verdict.FAIL


def placed(cycle: Cycle, check: Check) -> Check:
    """A check that says in which part of a mix its instant lies."""
    if len(cycle.parts) == 1 or check.time is None:
        return check
    part = cycle.part_at(check.time)
    begin = float(cycle.time[cycle.parts[part].start])
    said = f"in {cycle.part_names[part]}, {check.time - begin:.4g} s into it"
    return replace(check, remark=f"{said}; {check.remark}" if check.remark else said)


def supply_figures(weights: Array, power: Array) -> dict[str, Any]:
    """What all joints together ask of the supply, by field of ``Supply``; for many sets at once (S, N) or one (N,).

    What one joint feeds back another may use at the same instant; only the sum reaches the supply. Drawn is where the
    sum is positive, regenerated where it is negative; the mean of each is over the whole cycle, so that a supply that
    takes nothing back is not credited with it.

    Args:
        weights: Time each sample stands for [s], (N,).
        power: Electrical, of all joints together [W].
    """
    share = weights / weights.sum() if weights.sum() > 0.0 else np.full(len(weights), 1.0 / len(weights))
    drawn, fed_back = np.maximum(power, 0.0), np.maximum(-power, 0.0)
    mean, back = (np.einsum("...t,t", one, share) for one in (drawn, fed_back))  # @ sums by how many sets there are
    return {"peak_power": drawn.max(axis=-1), "mean_power": mean, "regenerated_power": back}


def supply_checks(
    supply: Supply, time: Array, weights: Array, powers: Mapping[str, Array], *, reserve: float, unknown: str = ""
) -> tuple[Check, ...]:
    """Power of all joints together, instant by instant, against the supply's limits.

    Args:
        time: [s], (N,).
        weights: Time each sample stands for [s], (N,).
        powers: Electrical power by joint name [W], (N,) each.
        unknown: Joints whose power is not known, in words.

    Returns:
        Peak, mean and regenerated power [W].
    """
    total = np.sum(list(powers.values()), axis=0)
    figures, highest = supply_figures(weights, total), float(time[int(np.argmax(np.maximum(total, 0.0)))])
    found = []
    for row in SUPPLY_CHECKS:
        required, limit = None if unknown else float(figures[row.required]), getattr(supply, row.limit)
        used = None if required is None or limit is None else utilisation(required, limit)
        verdict = Verdict.NOT_CHECKED if used is None else judged(used, reserve)
        lack = "the study states no limit" if limit is None else ""
        remark, instant = f"power unknown of {unknown}" if unknown else lack, highest if row.instant else None
        source = f"{row.name} limit of the study"
        found.append(Check(row.name, required, limit, row.unit, used, verdict, instant, source, remark))
    return tuple(found)


def _number(value: float) -> float | None:
    return float(value) if known(value) else None
