"""The proof of a selection in words: bound, gap, rules, work, and how to go on when time was up."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.report.outputs import result_json
from drivetrain.report.pages.proof_section import proof_section
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.pages.trade_off_pages import trade_off_extra
from drivetrain.sizing.answers.trade_offs import trade_offs, usual_span
from drivetrain.sizing.judge.vary import Vary
from drivetrain.sizing.results import Selection
from drivetrain.sizing.search.search import select
from drivetrain.study.parts.selection import CurveWanted, TradeOffs
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

STUDY = shipped("examples") / "one_axis" / "study.yaml"


@pytest.fixture(scope="module")
def found() -> Selection:
    return select(load_study(STUDY))


def facts_of(selection: Selection) -> dict[str, str]:
    return dict(proof_section(selection).facts)


def test_an_optimum_is_told_with_bound_and_gap(found: Selection) -> None:
    section = proof_section(found)
    facts = facts_of(found)
    assert section.word == "proven" and "No other allowed set" in section.lead[0]
    assert facts["best set found"] == facts["lower bound"] and facts["gap"].startswith("0")
    assert f"{len(found.study.joints[0].pairs)} pairs" in facts["candidates"]
    assert facts["constraints besides the checks"] == "none" and "not needed" in facts["time limit of the search"]


def test_what_is_left_open_is_told_with_the_way_on(found: Selection) -> None:
    stopped = replace(found, proof="not proven: at most 25 % above", bound=0.8 * found.objective, state=object())
    section = proof_section(stopped)
    assert section.word == "not proven" and "resume=selection" in section.lead[1] and "25 %" in section.lead[0]
    assert "(20\u00a0% of the best)" in facts_of(stopped)["gap"]
    assert "reached" in facts_of(stopped)["time limit of the search"]


def test_rules_in_force_stand_there(found: Selection) -> None:
    wanted = replace(found.study.wanted, most_motor_types=2, same_family=(("a", "b"),))
    facts = facts_of(replace(found, study=replace(found.study, wanted=wanted)))
    assert facts["motor types"] == "at most 2 wanted; 1 in the chosen set" and facts["same family"] == "a, b"
    assert "constraints besides the checks" not in facts


def test_nothing_fits_is_a_proof_too(found: Selection) -> None:
    none = replace(
        found,
        drives={},
        objective=float("nan"),
        bound=float("inf"),
        proof="no set fits: every combination was ruled out",
    )
    section = proof_section(none)
    assert section.lead == ("No set fits: every combination was ruled out.",) and section.word == "proven"
    assert "best set found" not in dict(section.facts)


def test_front_and_curve_are_parts_of_the_report(found: Selection) -> None:
    asked = TradeOffs(("mass", "energy"), (CurveWanted("cycle_time", (12.0, 14.0)), CurveWanted("voltage")))
    study = replace(found.study, trade_offs=asked)
    selection = replace(found, study=study)
    extra = trade_off_extra(trade_offs(study), selection)
    page = html_report(selection, extra=extra)
    for text in ("The star is the chosen set", 'href="#front"', 'id="curve-cycle-time"', 'id="curve-voltage"'):
        assert text in page
    data = json.loads(result_json(selection, extra=extra))
    plain = json.loads(result_json(selection))
    assert set(data) - set(plain) == {"front", "curves"} and data["schema_version"] == plain["schema_version"]
    assert [curve["vary"] for curve in data["curves"]] == ["cycle_time", "voltage"]
    assert data["front"]["sets"][0]["criteria"]["mass"] == pytest.approx(found.objective, rel=1e-12)  # the same sum
    assert data["curves"][1]["pieces"][0]["low"] == pytest.approx(0.75 * study.supply.voltage)
    assert html_report(selection, extra=trade_off_extra(trade_offs(study), selection)) == page


def test_spans_stand_around_the_study(found: Selection) -> None:
    for vary, own in ((Vary.CYCLE_TIME, found.study.cycle.duration), (Vary.AMBIENT, found.study.ambient)):
        low, high = usual_span(found.study, vary)
        assert low < own < high


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--front", "mas,energy", "--curve", "paylod"], ["--front", "'mass'", "--curve", "'payload'"]),
        (["--curve", "voltage", "--curve-from", "20 V"], ["--curve-to", "two ends"]),
        (["--curve", "voltage", "--curve", "voltage"], ["twice"]),
        (["--curve-from", "20 V", "--curve-to", "30 V"], ["ends of one --curve"]),
        (["--curve", "voltage", "--curve-from", "20", "--curve-to", "3 s"], ["--curve-from", "--curve-to"]),
        (["--front", ","], ["names no criterion"]),
        (["--curve", "payload"], ["cannot be varied"]),
    ],
)
def test_wrong_options_are_told(tmp_path: Path, options: list[str], words: list[str]) -> None:
    ran = CliRunner().invoke(app, ["select", str(STUDY), "--out", str(tmp_path / "out"), *options])
    assert ran.exit_code == 2 and not (tmp_path / "out").exists()
    assert all(word in ran.output for word in words), ran.output


def test_the_command_adds_them_and_leaves_the_rest_as_it_was(tmp_path: Path) -> None:
    ran = CliRunner().invoke(app, ["select", str(STUDY), "--out", str(tmp_path / "plain")])
    more = ["--front", "mass", "--curve", "voltage", "--curve-from", "22 V", "--curve-to", "26 V"]
    both = CliRunner().invoke(app, ["select", str(STUDY), "--out", str(tmp_path / "more"), *more])
    assert ran.exit_code == both.exit_code == 0, both.output
    assert "front:" in both.output and "over the voltage:" in both.output and "front:" not in ran.output
    plain, told = (json.loads((tmp_path / name / "result.json").read_text()) for name in ("plain", "more"))
    curves, front = told.pop("curves"), told.pop("front")
    assert told == plain and front["criteria"] == ["mass"]
    assert [curves[0]["pieces"][0]["low"], curves[0]["pieces"][-1]["high"]] == [22.0, 26.0]
