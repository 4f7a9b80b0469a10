"""All files or none: a failure at any moment leaves what was there before."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from drivetrain.report import outputs
from drivetrain.report.outputs import currents_csv, write_outputs
from drivetrain.report.rejected import COLUMNS as FALLEN_COLUMNS
from drivetrain.report.rejected import rejected_text
from drivetrain.sizing.results import Evaluation, Selection


def test_files_of_an_evaluation_and_of_a_selection(
    tmp_path: Path, evaluation: Evaluation, selection: Selection
) -> None:
    files = write_outputs(tmp_path / "new" / "folder", evaluation)
    assert sorted(files) == ["currents.csv", "report.html", "result.json"]
    assert all(path.stat().st_size > 1000 for path in files.values())
    write_outputs(tmp_path / "new" / "folder", selection)
    found = sorted(path.name for path in (tmp_path / "new" / "folder").iterdir())
    assert found == ["currents.csv", "rejected.csv", "report.html", "result.json"]  # and nothing left beside them


def test_currents_have_one_row_per_sample_and_joint(evaluation: Evaluation) -> None:
    rows = list(csv.reader(io.StringIO(currents_csv(evaluation))))
    samples = len(next(iter(evaluation.joints.values())).series.time)
    assert len(rows) == 1 + samples * len(evaluation.joints)
    assert any("[A]" in name for name in rows[0]) and any("[s]" in name for name in rows[0])


def test_every_candidate_that_fell_is_listed(selection: Selection) -> None:
    rows = list(csv.reader(io.StringIO(rejected_text(selection.rejected))))
    assert tuple(rows[0]) == FALLEN_COLUMNS and len(rows) == 1 + len(selection.rejected_pairs)
    first = selection.rejected_pairs[0]
    assert rows[1][:4] == [first.joint, first.motor, first.gear, first.check]
    assert float(rows[1][7]) == pytest.approx(first.utilisation, rel=1e-5)  # six digits are written


def test_a_failure_while_drawing_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, evaluation: Evaluation
) -> None:
    def breaks(result: object, **named: object) -> str:
        raise ZeroDivisionError

    monkeypatch.setattr(outputs, "result_json", breaks)
    with pytest.raises(ZeroDivisionError):
        write_outputs(tmp_path / "out", evaluation)
    assert not (tmp_path / "out").exists()
