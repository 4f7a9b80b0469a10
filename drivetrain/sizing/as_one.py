"""Two motors on one axis evaluated as one motor, for models with one motor per joint."""

from __future__ import annotations

from drivetrain.sizing.judge.evaluate import evaluate_drives
from drivetrain.sizing.results import Evaluation
from drivetrain.study.parts.mounting import run_apart, two_as_one


def judged_to_run(evaluation: Evaluation) -> Evaluation:
    """An evaluation as it is simulated: two motors on one axis that are alike become one of twice the size."""
    return evaluation if run_apart(evaluation.study, evaluation.mounted) else judged_as_one(evaluation)


def judged_as_one(evaluation: Evaluation) -> Evaluation:
    """An evaluation with the two motors of an axis replaced by one of twice the size, with the same verdicts."""
    study, drives = two_as_one(evaluation.study, evaluation.mounted)
    return evaluation if study is evaluation.study else evaluate_drives(study, drives)
