"""Two motors of an axis judged as one, for what knows one motor a joint."""

from __future__ import annotations

from drivetrain.sizing.judge.evaluate import evaluate_drives
from drivetrain.sizing.results import Evaluation
from drivetrain.study.parts.mounting import two_as_one


def judged_as_one(evaluation: Evaluation) -> Evaluation:
    """An evaluation with two motors of an axis as one of twice the size, of which the verdicts are the same."""
    drives = {name: joint.drive for name, joint in evaluation.joints.items()}
    study, drives = two_as_one(evaluation.study, drives)
    return evaluation if study is evaluation.study else evaluate_drives(study, drives)
