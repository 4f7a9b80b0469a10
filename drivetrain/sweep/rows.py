"""What is kept of each point: one row of plain values, the same whoever computed it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Study
from drivetrain.sweep.points import SELECT, Point, Sweep, task_of

Row = dict[str, Any]
NUMBERS = ("objective", "mass", "price", "energy", "utilisation")
WORDS = ("verdict", "proof", "binding_joint", "binding_check", "drives", "fault")


def rows_of(sweep: Sweep, work: Sequence[tuple[Point, Study | str]]) -> list[Row]:
    """The rows of some points."""
    return [_row(sweep, point, study) for point, study in work]


def _row(sweep: Sweep, point: Point, study: Study | str) -> Row:
    row: Row = {"point": point.index, **dict(zip(sweep.names, point.texts, strict=True)), "feasible": False}
    row |= dict.fromkeys(NUMBERS, math.nan) | dict.fromkeys(WORDS, "")
    if isinstance(study, str):
        return row | {"verdict": "FAULT", "fault": study}
    try:
        return row | _answer(sweep.run, task_of(study, point))
    except InputError as error:
        return row | {"verdict": "FAULT", "fault": str(error)}


def _answer(run: str, study: Study) -> Row:
    """What a selection or an evaluation found."""
    proof, drives, objective = "", {task.name: task.drive for task in study.joints}, math.nan
    if run == SELECT:
        selection = select(study, advise=False)
        evaluation, proof = selection.evaluation, selection.proof
        feasible, objective, drives = selection.feasible, selection.objective, dict(selection.drives)
        verdict = selection.verdict
    else:
        evaluation = evaluate(study)
        feasible, objective, verdict = evaluation.feasible, evaluation.objective, evaluation.verdict
    joint, check = _binding(evaluation)
    known = {name: evaluation.criteria.get(name, math.nan) for name in ("mass", "price", "energy", "utilisation")}
    return {
        "feasible": feasible,
        "verdict": str(verdict),
        "objective": objective,
        **known,
        "proof": proof,
        "binding_joint": joint,
        "binding_check": check,
        "drives": "; ".join(
            f"{name}: {' + '.join(key for key in keys if key)}" for name, keys in drives.items() if keys
        ),
    }


def _binding(evaluation: Evaluation) -> tuple[str, str]:
    """The joint and the check nearest to a limit, or furthest over it."""

    def used(result: JointResult) -> float:
        return (result.binding.utilisation if result.binding else None) or 0.0

    result = max(evaluation.joints.values(), key=used, default=None)
    if result is None:
        return "", ""
    return result.name, result.binding.name if result.binding else ""
