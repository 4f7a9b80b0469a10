"""The page of free ratios."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.report.charts.answer_charts import free_ratio_charts
from drivetrain.report.pages.ratio_page import free_ratio_lines, free_ratio_report, free_ratio_sentence
from drivetrain.sizing.answers.free_ratio import free_ratios
from drivetrain.study.model import FreeRatio
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

STUDY = shipped("examples") / "one_axis" / "study.yaml"


@pytest.fixture(scope="module")
def found():
    study = load_study(STUDY)
    task = study.joints[0]
    pair = task.drive or task.pairs[0]
    return free_ratios(study, free={task.name: FreeRatio(2.0, 400.0)}, drives={task.name: pair})


def test_words_tell_the_goal_and_the_ratio(found):
    assert "mean copper loss" in free_ratio_sentence(found)
    (line,) = free_ratio_lines(found)
    one = found.joints[0]
    assert line.startswith(f"{one.joint}: ratio ") and f", {one.verdict}; " in line
    assert "A check fails" not in free_ratio_sentence(replace(found, joints=(replace(one, verdict=Verdict.PASS),)))
    failing = replace(found, joints=(replace(one, verdict=Verdict.FAIL),))
    assert f"A check fails or could not be made at {one.joint}." in free_ratio_sentence(failing)


def test_page_and_picture(found):
    page = free_ratio_report(found)
    assert page == free_ratio_report(found)
    assert not re.search(r"https?://(?!www\.w3\.org)", page)
    (chart,), one = free_ratio_charts(found), found.joints[0]
    best = next(mark for mark in chart.marks if mark.label.startswith("best for the arm"))
    assert chart.log_x and (best.x, best.y) == ([one.best], [found.value])
    line = next(mark for mark in chart.marks if mark.kind == "line")
    assert np.nanmin(line.y) >= found.value * (1.0 - 1e-6)


def test_command_tells_what_is_missing(tmp_path):
    answer = CliRunner().invoke(app, ["free-ratio", str(STUDY), "--out", str(tmp_path)])
    assert answer.exit_code == 2 and "free_ratio" in answer.output
