"""The page of a front: its sets in words, picture, table and JSON."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.report.charts.answer_charts import front_charts
from drivetrain.report.pages.trade_off_pages import front_json, front_lines, front_report, front_sentence
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.pareto.front import Front
from drivetrain.study.parts.tolerances import Tolerance, Tolerances
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

STUDY = shipped("examples") / "one_axis" / "study.yaml"


@pytest.fixture(scope="module")
def study():
    return load_study(STUDY)


def front(study, names=("mass", "energy"), complete=True, gap=0.0):
    joint = study.joints[0].name
    points = tuple(
        DriveSet({joint: (f"m{i}", "g" if i else "")}, mass, {
            "mass": mass, "price": math.nan, "energy": energy, "utilisation": used,
        })
        for i, (mass, energy, used) in enumerate([(1.0, 90.0, 0.95), (1.5, 70.0, 0.8), (2.25, 66.0, 0.5)])
    )  # fmt: skip
    return Front(study, names, {"price": "no candidate has a known price"}, points, complete, gap, {"boxes": 3})


def test_words_tell_span_and_proof(study):
    text = front_sentence(front(study))
    assert "3 sets" in text and "mass from 1.00 to 2.25\u00a0kg" in text and "Complete" in text
    left = front_sentence(front(study, complete=False, gap=0.05))
    assert "up to 5 %" in left and "Not complete" in left
    assert "before anything was known" in front_sentence(front(study, complete=False, gap=math.inf))
    assert len(front_lines(front(study))) == 3 and "price" not in front_lines(front(study))[0]


def test_words_tell_the_required_probability(study):
    """Which sets of a front must have, where the study states tolerances."""
    wanted = replace(study, wanted=replace(study.wanted, holds=0.95))
    assert "95" not in front_sentence(front(wanted))  # without tolerances every set has it or not
    scattered = replace(wanted, tolerances=Tolerances(payload=Tolerance(0.1)))
    text = front_sentence(front(scattered))
    assert "3 sets of drives, each passing every check with at least 95\u00a0%, that no other beats" in text
    nothing = front_sentence(replace(front(scattered), points=()))
    assert "No set of drives passes every check with at least 95\u00a0% (" in nothing


def test_a_long_front_is_cut_on_the_terminal_and_one_set_has_no_span(study):
    long = front(study)
    long = replace(long, points=long.points * 20)
    *shown, last = front_lines(long)
    assert len(shown) == 40 and last.startswith("and 20 more")
    one = front_sentence(replace(long, points=long.points[:1]))
    assert "mass 1.00\u00a0kg, energy 90.0\u00a0J" in one and "from" not in one


def test_page_holds_every_set_and_what_is_left_out(study):
    page = front_report(front(study))
    assert page == front_report(front(study))
    for text in ("2.250", "m2 with g", "no candidate has a known price", "complete"):
        assert text in page
    assert not re.search(r"https?://(?!www\.w3\.org)", page)
    empty = Front(study, ("mass",), {}, (), True, 0.0, {})
    assert "No set of drives passes every check" in front_report(empty)


@pytest.mark.parametrize(
    ("names", "panels"), [(("mass", "energy"), 1), (("mass", "energy", "utilisation"), 3), (("mass",), 1)]
)
def test_picture_has_a_panel_for_every_two_criteria(study, names, panels):
    found = front(study, names)
    charts = front_charts(found, found.points[0])
    assert len(charts) == panels
    for chart in charts:
        points = next(mark for mark in chart.marks if mark.kind == "points")
        assert len(points.x) == len(points.tips) == 3
        for tip, point in zip(points.tips, found.points, strict=True):  # a point shows its drives
            assert all(motor in tip for motor, _ in point.drives.values())
        assert any(mark.label == "chosen" for mark in chart.marks)


def test_json_is_read_by_machines(study):
    data = json.loads(front_json(front(study)))
    assert data["complete"] is True and len(data["sets"]) == 3
    assert data["sets"][0]["criteria"]["price"] is None and data["sets"][1]["criteria"]["energy"] == 70.0


def test_command_writes_page_and_json(tmp_path):
    answer = CliRunner().invoke(app, ["front", str(STUDY), "--out", str(tmp_path), "--by", "mass, energy"])
    assert answer.exit_code in (0, 1), answer.output
    assert (tmp_path / "front.html").is_file() and json.loads((tmp_path / "front.json").read_text())["complete"]
    wrong = CliRunner().invoke(app, ["front", str(STUDY), "--out", str(tmp_path), "--by", "mas"])
    assert wrong.exit_code == 2 and "mass" in wrong.output
    for text in ("5", "0 s", "3 kg"):
        wrong = CliRunner().invoke(app, ["front", str(STUDY), "--time-limit", text])
        assert wrong.exit_code == 2 and "--time-limit" in wrong.output
