"""Why not, in words: what is printed passes too, and the page holds every check."""

from __future__ import annotations

import re

import pytest
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.report.pages.why_not_page import change_sentence, why_not_lines, why_not_report
from drivetrain.sizing.answers.why_not import SmallestChange, why_not
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

STUDY = shipped("examples") / "ur5_pick_and_place" / "study.yaml"


@pytest.fixture(scope="module")
def found():
    return why_not(
        load_study(STUDY), "shoulder_pan_joint", "AM_MF0060008_48V", "hd_CSG-14-100-2UH", cost=False
    )  # fmt: skip


def test_words_name_the_check_and_every_kind_of_change(found):
    lines = why_not_lines(found, found.answers[0])
    text = "\n".join(lines)
    assert "does not meet all limits" in lines[0] and "Rejected by gear momentary peaks" in text
    for what in ("Gear ratio:", "Payload:", "Cycle time:", "Supply voltage:"):
        assert what in text


@pytest.mark.parametrize(
    ("before", "after", "printed"),
    [(5.0, 2.3456, "2.34"), (4.0, 6.7141, "6.72"), (100.0, 53.28, "53.2"), (1.0, 0.0, "0")],
)
def test_what_is_printed_is_on_the_safe_side(before, after, printed):
    text = change_sentence(SmallestChange("cycle time", "s", before, after, after, "x", 1.0, True))
    assert f"passes with {printed}\u00a0s" in text


def test_page_is_whole_and_the_same_twice(found):
    page = why_not_report(found)
    assert page == why_not_report(found)
    assert page.count("<tr>") >= len(found.answers[0].result.checks) + 4
    assert not re.search(r"https?://(?!www\.w3\.org)", page)
    assert "nan" not in re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL).split()


def test_command_exits_by_the_answer(tmp_path):
    runner = CliRunner()
    arguments = ["why-not", str(STUDY), "--joint", "wrist_3_joint", "--out", str(tmp_path)]
    unknown = runner.invoke(app, [*arguments, "--motor", "AM_MF0060008_48"])
    assert unknown.exit_code == 2 and "AM_MF0060008_48V" in unknown.output
    falls = runner.invoke(app, [*arguments, "--gear", "hd_CSG-14-100-2UH"])
    assert falls.exit_code == 0 and "chosen" in falls.output
    assert (tmp_path / "why_not.html").is_file()
