"""The best sets side by side: what each is worth, and where it differs from the first."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.report.outputs import currents_csv, result_json
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.rejected import COLUMNS, counted, rejected_data, rejected_text
from drivetrain.report.verdict_lines import verdict_lines, verdict_table
from drivetrain.report.words import objective_text, set_lines, set_rows
from drivetrain.sizing.results import DriveSet, Evaluation, Selection
from drivetrain.study.parts.selection import Wanted
from drivetrain.study.parts.verdicts import Check, Verdict


@pytest.fixture
def three_sets(selection: Selection) -> Selection:
    drives = {joint: ("acme-1", "wave-1-100") for joint in selection.evaluation.joints}
    worth = {"mass": 12.34, "price": math.nan, "energy": 55.5, "utilisation": 0.93}
    second = {**drives, "elbow": ("acme-2", "")}
    third = {**second, "wrist": ("acme-3", "wave-3-50")}
    found = (DriveSet(drives, 12.34, worth), DriveSet(second, 12.5, worth), DriveSet(third, 13.0, worth))
    return replace(selection, best_sets=found, bound=12.34)


def test_each_set_says_where_it_differs(three_sets: Selection) -> None:
    rows = set_rows(three_sets)
    assert [row.rank for row in rows] == [1, 2, 3]
    assert rows[0].changes == () and rows[1].changes == ("elbow: acme-2 with no gear",)
    assert rows[2].changes == ("elbow: acme-2 with no gear", "wrist: acme-3 with wave-3-50")
    assert (rows[0].objective, rows[0].price, rows[0].utilisation) == ("12.34", "–", "93\u00a0%")
    assert set_lines(three_sets)[0] == "set 2: 12.50 kg; elbow: acme-2 with no gear"
    assert set_rows(replace(three_sets, best_sets=three_sets.best_sets[:1])) == []


def test_sets_stand_on_the_page_in_the_file_and_on_the_terminal(three_sets: Selection) -> None:
    page = html_report(three_sets)
    assert "The best sets" in page and "elbow: acme-2 with no gear; wrist: acme-3 with wave-3-50" in page
    data = json.loads(result_json(three_sets))
    assert data["bound"] == 12.34 and len(data["sets"]) == 3
    assert data["sets"][1]["drives"]["elbow"] == {"motor": "acme-2", "gear": ""}
    assert data["sets"][0]["criteria"] == {"energy": 55.5, "mass": 12.34, "price": None, "utilisation": 0.93}
    assert any("set 3: 13.00 kg" in line.plain for line in verdict_lines(three_sets))


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ((("mass", 1.0),), "12.3 kg of motors and gears"),
        ((("price", 1.0),), "price 12.3"),
        ((("energy", 1.0),), "12.3 J drawn in a cycle"),
        ((("mass", 1.0), ("energy", 0.5)), "12.3, weighted: mass × 1 + energy × 0.5"),
    ],
)
def test_every_objective_has_its_words(three_sets: Selection, weights: tuple, words: str) -> None:  # type: ignore[type-arg]
    study = replace(three_sets.study, wanted=Wanted(weights))
    evaluation = replace(three_sets.evaluation, study=study)
    assert words in objective_text(evaluation)
    page = html_report(replace(three_sets, study=study, evaluation=evaluation))
    assert "The best sets" in page


def test_a_selection_in_which_no_joint_has_a_drive_still_has_a_page(selection: Selection) -> None:
    lacking = Check("candidates of elbow", 1.0, 0.0, "1", None, Verdict.FAIL, remark="elbow has no candidate")
    nothing = Evaluation(selection.study, {}, (lacking,), math.nan)
    found = replace(selection, drives={}, evaluation=nothing, objective=math.nan, alternatives={}, rejected_pairs=())
    found = replace(found, advice=("elbow: no motor of the catalogue may drive it",))
    page = html_report(found)
    assert "FAIL" in page and "no motor of the catalogue may drive it" in page
    assert json.loads(result_json(found))["verdict"] == "FAIL"
    assert any("no motor" in line.plain for line in verdict_lines(found))
    assert "elbow has no candidate." in [line.plain for line in verdict_lines(found)]
    cells = [list(column.cells) for column in verdict_table(nothing).columns]
    assert cells[0] == ["catalogue"] and cells[-1] == ["candidates of elbow"]
    assert "\u221e" not in page + "".join(str(cell) for column in cells for cell in column)
    assert "All joints together" not in page and "data-sheet temperature" not in page
    header, *rows = currents_csv(nothing).splitlines()
    assert header.startswith("time [s],joint,current [A]") and rows == []


class Table(tuple):  # type: ignore[type-arg]
    """Stands for a table of columns that is made into objects only when asked for one."""

    def frame(self) -> object:
        return self.selection.rejected

    selection: Selection


def test_columns_are_taken_as_they_are_and_counted(selection: Selection) -> None:
    plain = selection.rejected
    assert tuple(plain.columns) == COLUMNS and len(plain) == len(selection.rejected_pairs)
    counts = counted(plain)
    for (joint, check), count in counts.items():
        assert count == sum(one.joint == joint and one.check == check for one in selection.rejected_pairs)
    assert sum(counts.values()) == len(selection.rejected_pairs)
    lazy = Table()
    lazy.selection = selection
    coded = replace(selection, rejected_pairs=lazy)
    assert html_report(coded) == html_report(selection)
    assert counted(plain[:0]) == {}


def test_unknown_numbers_are_told_in_the_file(selection: Selection) -> None:
    one = replace(selection.rejected_pairs[0], required=math.nan, utilisation=math.inf)
    line = rejected_text(replace(selection, rejected_pairs=(one,)).rejected).splitlines()[1].split(",")
    assert line[4] == "nan" and line[7] == "inf"
    assert np.isnan(float(line[4]))


def test_a_key_with_a_comma_or_a_quote_is_one_cell(selection: Selection) -> None:
    odd = replace(selection.rejected_pairs[0], motor='a,"b"')
    text = rejected_text(replace(selection, rejected_pairs=(odd, *selection.rejected_pairs[1:5000])).rejected)
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[1][1] == 'a,"b"' and {len(row) for row in rows} == {len(COLUMNS)}
    assert len(rows) == 1 + min(5000, len(selection.rejected_pairs))


def test_every_chosen_drive_has_its_star_among_the_rejected(selection: Selection) -> None:
    joints = selection.evaluation.joints
    stars = rejected_data(selection, selection.rejected)["chosen"]
    assert len(joints) > 1 and [star[0] for star in stars] == list(joints)
    for name, _, _, share, used, word in stars:
        drive = joints[name].drive
        assert word == "chosen" and used == joints[name].binding.utilisation
        assert share == pytest.approx(drive.motor.mass + drive.gear.mass, rel=1e-12)
