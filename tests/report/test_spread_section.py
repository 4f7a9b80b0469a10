"""What scatter means, as page, terminal and file tell it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.report.charts.arm_charts import tornado_chart
from drivetrain.report.outputs import result_json, write_outputs
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.pages.spread_section import chance_rows, law_lines, spread_lines
from drivetrain.sizing.answers.spread import spread
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.parts.tolerances import Tolerance, Tolerances
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

TOLERANCES = Tolerances(
    torque_constant=Tolerance(0.05), friction=Tolerance(0.3), ambient=Tolerance(5.0, absolute=True), samples=500
)


@pytest.fixture(scope="module")
def told():
    study = load_study(shipped("examples") / "one_axis" / "study.yaml")
    drives = select(study).drives
    evaluation = evaluate(replace(study, tolerances=TOLERANCES), drives)
    return evaluation, spread(evaluation)


def test_no_tolerances_no_section(told):
    evaluation, _ = told
    plain = replace(evaluation, study=replace(evaluation.study, tolerances=Tolerances()))
    assert spread(plain) is None
    assert 'id="spread"' not in html_report(plain)
    assert "robustness" not in json.loads(result_json(plain))


def test_the_page_has_the_section(told):
    evaluation, found = told
    page = html_report(evaluation, spread=found)
    section = page[page.index('id="spread"') :]
    assert "All checks are satisfied in" in section and "seed 1" in section
    assert "torque constant: uniform within ±5\u00a0%" in section and "ambient: uniform within ±5\u00a0K" in section
    assert page == html_report(evaluation, spread=found)


def test_the_file_has_the_numbers(told, tmp_path):
    evaluation, found = told
    files = write_outputs(tmp_path, evaluation, spread=found)
    data = json.loads(files["result.json"].read_text(encoding="utf-8"))["robustness"]
    assert data["samples"] == 500 and data["seed"] == 1
    whole = data["whole"]
    assert whole["low"] <= whole["probability"] <= whole["high"]
    assert data["whole"]["probability"] == found.robustness.whole.probability
    for place, checks in data["checks"].items():
        for name, chance in checks.items():
            assert chance["probability"] >= whole["probability"], (place, name)
    assert len(data["tornadoes"][0]["bars"]) == len(found.tornadoes[0].bars)


def test_the_picture_has_every_bar_at_its_place(told):
    _, found = told
    tornado = found.tornadoes[0]
    chart = tornado_chart(tornado)
    low, high = (mark for mark in chart.marks if mark.kind == "bars")
    for row, bar in enumerate(tornado.bars[: len(chart.rows)]):
        assert str(bar.source) in chart.rows[row]
        assert low.to[row] == pytest.approx(100.0 * bar.at_low) and high.to[row] == pytest.approx(100.0 * bar.at_high)
        assert low.x[row] == high.x[row] == pytest.approx(100.0 * tornado.nominal)


def test_the_axis_of_a_tornado_names_the_check_once_and_fits_a_phone(told):
    """One line of joint, check and unit is wider than the plot beside the names of its bars."""
    tornado = replace(told[1].tornadoes[0], joint="supply", check="supply regenerated power")
    assert tornado_chart(tornado).x == "supply regenerated power\n[% of the limit]"
    assert tornado_chart(replace(tornado, joint="j1", check="motor speed")).x == "j1: motor speed\n[% of the limit]"


def test_a_tornado_without_bars_is_still_a_picture(told):
    _, found = told
    assert tornado_chart(replace(found.tornadoes[0], bars=())).rows == []


def test_the_terminal_tells_the_weakest(told):
    _, found = told
    lines = spread_lines(found)
    assert "All checks are satisfied in" in lines[0] and "500 sampled arms" in lines[0]
    rows = chance_rows(found.robustness)
    assert rows[0].place == "all together"
    singles = [row.share for row in rows if row.check not in ("", "all checks")]
    assert singles == sorted(singles)
    weighed = Tolerances(payload=Tolerance(0.02, normal=True, absolute=True))
    study = replace(found.robustness.evaluation.study, tolerances=weighed)
    assert law_lines(study) == ["payload: normal, standard deviation 0.02\u00a0kg"]


def test_a_selection_holds_as_often_as_wanted():
    study = load_study(shipped("examples") / "one_axis" / "study.yaml")
    selection = select(study)
    assert selection.choice is None
    asked = replace(study, tolerances=TOLERANCES, wanted=replace(study.wanted, holds=0.95))
    chosen = select(asked)
    choice = chosen.choice
    assert choice is not None and chosen.feasible and choice.proof in chosen.proof
    assert chosen.objective >= selection.objective - 1e-12
    assert chosen.best_sets[0].drives == chosen.drives
    assert np.isclose(chosen.evaluation.objective, chosen.objective)
    assert chosen.rejected_pairs.chosen == chosen.rejected_pairs.problem.pairs(chosen.drives)
    found = spread(chosen)
    assert found is not None and found.robustness.whole.interval[1] >= 0.95
    assert choice.proof in html_report(chosen, spread=found)
