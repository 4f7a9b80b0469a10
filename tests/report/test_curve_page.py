"""The page of a curve: pieces, breakpoints and the end, in words, table and picture."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.report.charts.answer_charts import colour_of, curve_charts
from drivetrain.report.pages.trade_off_pages import curve_lines, curve_report, curve_sentence
from drivetrain.sizing.answers.curve import CurvePiece, CurvePoint, OptimumCurve
from drivetrain.sizing.judge.vary import Vary
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


def point(value, pair, mass, used=0.8):
    criteria = {"mass": mass, "price": float("nan"), "energy": 100.0 + 10.0 * value, "utilisation": used}
    return CurvePoint(value, {"hinge": pair}, mass, criteria, "")


@pytest.fixture
def curve():
    study = load_study(shipped("examples") / "one_axis" / "study.yaml")
    light, heavy = ("a", "g"), ("b", "")
    pieces = (
        CurvePiece(0.0, 1.0, {}, (), "", ""),
        CurvePiece(1.0, 3.25, {"hinge": light}, (point(1.0, light, 2.0), point(3.25, light, 2.0, 1.0)),
                   "motor voltage at door", "motor RMS current at door"),
        CurvePiece(3.25, 6.0, {"hinge": heavy}, (point(3.25, heavy, 3.0), point(6.0, heavy, 3.0)),
                   "another set is better", "gear average torque at door"),
        CurvePiece(6.0, 8.0, {}, (), "", ""),
    )  # fmt: skip
    return OptimumCurve(study, Vary.PAYLOAD, "part", 2.0, (), pieces, 1e-6, ("a note",))


def test_words_name_both_ends(curve):
    text = curve_sentence(curve)
    assert "2 sets of drives are the best, each in a part of the range from 1.00 to 6.00\u00a0kg" in text
    assert "beyond 6.000\u00a0kg none fits (gear average torque at door)" in text
    assert "below 1.000\u00a0kg none fits (motor voltage at door)" in text
    lines = curve_lines(curve)
    assert len(lines) == 4 and "no set fits" in lines[0] and "b with no gear" in lines[2]


def test_a_very_short_piece_has_ends_that_differ(curve):
    *_, heavy, last = curve.pieces
    short = replace(curve, pieces=(replace(heavy, low=2.96412, high=2.96419), last))
    assert curve_lines(short)[0].startswith("2.9641 to 2.9642 kg")


def test_page_holds_every_piece(curve):
    page = curve_report(curve)
    assert page == curve_report(curve)
    for text in ("3.250", "motor RMS current at door", "a with g", "no set fits", "a note"):
        assert text in page
    assert not re.search(r"https?://(?!www\.w3\.org)", page)


def test_picture_has_a_line_a_piece_and_shades_what_does_not_fit(curve):
    charts = curve_charts(curve)
    lines = [mark for mark in charts[0].marks if mark.kind == "line"]
    held = [piece for piece in curve.pieces if piece.drives]
    assert [line.colour for line in lines] == [colour_of(curve, piece) for piece in held]
    assert [list(line.y) for line in lines] == [[point.objective for point in piece.points] for piece in held]
    spans = [(mark.x[0], mark.to[0]) for mark in charts[0].marks if mark.kind == "span"]
    assert spans == [(piece.low, piece.high) for piece in curve.pieces if not piece.drives] and len(spans) == 2
    assert len({chart.joined for chart in charts}) == 1 and charts[2].y == "highest utilisation [%]"


def test_command_tells_a_wrong_unit(tmp_path):
    study = str(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    answer = CliRunner().invoke(app, ["curve", study, "--from", "0 s", "--out", str(tmp_path)])
    assert answer.exit_code == 2 and "kg" in answer.output
    answer = CliRunner().invoke(app, ["curve", study, "--from", "0", "--to", "5 s", "--out", str(tmp_path)])
    assert answer.exit_code == 2 and "--from" in answer.output and "--to" in answer.output
    answer = CliRunner().invoke(app, ["curve", study, "--vary", "payloads", "--out", str(tmp_path)])
    assert answer.exit_code == 2 and "payload" in answer.output
