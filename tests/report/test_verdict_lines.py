from __future__ import annotations

import io

from rich.console import Console

from drivetrain.catalog.findings import Severity
from drivetrain.catalog.linting import LintFault
from drivetrain.errors import DrivetrainError, Fault, InputError
from drivetrain.report.terminal import fault_lines, lint_table, progress
from drivetrain.report.verdict_lines import verdict_lines, verdict_table
from drivetrain.sizing.results import Evaluation, Selection


def printed(*items: object) -> str:
    out = io.StringIO()
    console = Console(file=out, width=200, highlight=False, markup=False)
    for item in items:
        console.print(item)
    return out.getvalue().replace("\u00a0", " ")


def test_one_line_a_joint_with_verdict_and_limit(evaluation: Evaluation) -> None:
    lines = printed(verdict_table(evaluation)).splitlines()
    assert lines[0].split() == ["peak", "RMS", "peak"]
    words = ["joint", "motor", "gear", "torque", "current", "winding", "current", "verdict", "limited", "by"]
    assert lines[1].split() == words
    assert len(lines) == 2 + 3 + 2
    elbow = lines[4]
    assert elbow.split()[:3] == ["elbow", "acme-2", "wave-2-100"]
    assert "FAIL" in elbow and "winding temperature 108 %" in elbow
    assert "86 %" in elbow and "103 %" in elbow and "100 °C" in elbow and "76 %" in elbow


def test_footer_says_objective_proof_and_fix(
    evaluation: Evaluation, selection: Selection, nothing_fits: Selection
) -> None:
    assert "12.3 kg of motors and gears" in printed(*verdict_lines(evaluation))
    assert "proof: optimal; 1200 candidates rejected" in printed(*verdict_lines(selection))
    text = printed(*verdict_lines(nothing_fits))
    assert text.startswith("FAIL") and "advice: a 10 % lower speed would do" in text


def test_missing_essentials_are_told(without_data: Evaluation) -> None:
    text = printed(*verdict_lines(without_data))
    assert "NOT CHECKED" in text and "Data are missing to check motor peak torque" in text


def test_faults_are_a_list_with_place_value_and_fix() -> None:
    faults = [
        Fault("joints.elbow.gear", "is not in the catalogue", "hd_17", "did you mean 'hd_CSG-17'?", "study.yaml:12"),
        Fault("supply.voltage", "must have a unit", 48),
    ]
    text = printed(*fault_lines(InputError(faults)))
    assert text.splitlines() == [
        "2 errors",
        "  study.yaml:12: joints.elbow.gear: is not in the catalogue",
        "      found  'hd_17'",
        "      fix    did you mean 'hd_CSG-17'?",
        "  supply.voltage: must have a unit",
        "      found  48",
    ]
    assert printed(*fault_lines(DrivetrainError("other"))) == "error other\n"


def test_data_is_never_taken_for_markup() -> None:
    """A key such as [red] or [/] is text, not style: rich would raise on the second."""
    fault = Fault("joints.[/]", "odd [red]name", "[/bold]")
    assert "joints.[/]: odd [red]name" in printed(*fault_lines(InputError(fault)))


def test_lint_shows_printed_against_predicted() -> None:
    found = [LintFault("motors.csv", 7, "Kt [mNm/A]", "m1", Severity.ERROR, "does not fit", 12.3, 24.6, "phase?")]
    text = printed(lint_table(found))
    assert all(
        part in text for part in ("motors.csv", "7", "Kt [mNm/A]", "error", "does not fit; phase?", "12.3", "24.6")
    )


def test_progress_is_silent_in_a_pipe() -> None:
    out = io.StringIO()
    with progress(Console(file=out), "searching") as step:
        step(3, 10, "elbow")
    assert out.getvalue() == ""
