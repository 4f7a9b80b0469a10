"""Loops of a study: the command, its page and JSON, against the design of the same joint by hand."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import drivetrain as dt
from drivetrain.cli import app
from drivetrain.drive.loops.loop_design import MODULUS_MARGIN
from drivetrain.report.pages.loops_page import loops_json, loops_report, loops_sentence
from drivetrain.sizing.answers.loops import study_loops

TABLE = "time [s],torque_door [N m],speed_door [rpm]\n0,1,0\n0.5,2,20\n1.5,2,20\n2,1,0\n2.5,-1,-20\n4,1,0\n"
STUDY = """
schema_version: 1
name: A door
motions: {swing: {table: door.csv}}
supply: {voltage: 24 V}
amplifier: {current_basis: dc, peak_current: 20 A, continuous_current: 10 A}
catalogs: []
motors:
  good: {kind: brushed, current_basis: dc, winding_basis: line_line, resistance: 0.5 ohm, torque_constant: 30 mNm/A,
         inductance: 0.1 mH, rotor_inertia: 60 gcm^2, mass: 0.5 kg, nominal_current: 5 A, peak_current: 30 A,
         source: made up}
gears:
  good: {kind: planetary, ratio: 50, efficiency: 80 %, inertia: 1 gcm^2, mass: 0.3 kg, repeated_peak_torque: 10 N m,
         stiffness_1: 2000 N m/rad, source: made up}
simulation: {control: {door: {rate: 1 kHz, delay: 1}}, damping: 0.02}
joints:
  door: {load_inertia: 0.3 kg m^2, drive: {motor: good, gear: good}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "door.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "door.yaml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def test_the_command_writes_what_the_design_says(folder: Path) -> None:
    ran = CliRunner().invoke(app, ["loops", "door.yaml", "--joint", "door", "--out", "here"])
    assert ran.exit_code == 0, ran.output
    told = json.loads((folder / "here" / "loops.json").read_text(encoding="utf-8"))
    joint, damping = told["joints"]["door"], 2.0 * 0.02 * math.sqrt(2000.0 * (0.3 + 50.0**2 * 61e-7))
    axis = dt.ServoAxis(0.03, 50.0, 61e-7, 0.3, stiffness=2000.0, spring_damping=damping)
    design = dt.design_loops(axis, dt.ServoTiming(2.0 * math.pi * 1e3, 1e-3, 1))
    gains, heavy = joint["gains"], joint["heaviest_load"]
    assert gains["speed_gain"] == pytest.approx(design.speed_gain, rel=1e-9)
    assert gains["position_gain"] == pytest.approx(design.position_gain, rel=1e-9)
    assert gains["current_gain"] == pytest.approx(1e-4 * 2.0 * math.pi * 1e3, rel=1e-9)
    assert gains["current_integral"] == pytest.approx(0.5 * 2.0 * math.pi * 1e3, rel=1e-9)
    assert told["stable"] and joint["limited_by"] == design.limited_by and design.limited_by in ran.output
    assert heavy == joint["lightest_load"] and heavy["modulus_margin"] >= MODULUS_MARGIN
    faster, notched = design.with_notch, joint["with_notch"]
    assert faster is not None and notched["gains"]["speed_gain"] == pytest.approx(faster.speed_gain, rel=1e-9)
    assert notched["notch"] == pytest.approx(vars(faster.notch)) and "with a notch at" in ran.output
    page = (folder / "here" / "loops.html").read_text(encoding="utf-8")
    assert page.count("data-chart=") == 3 and "settles" in page and not re.search(r"\bnan\b", page)
    for words in (
        "A s/rad",
        "mA/rpm",
        "(m/min)/mm",
        "sampled at 1.00 kHz",
        "modulus margin",
        "Closed-loop poles",
        "1 sample later",
        "resonance of the joint",
    ):
        assert words in page, words
    assert not re.search(r"https?://(?!www\.w3\.org)", page)


def test_the_same_loops_give_the_same_page(folder: Path) -> None:
    study = dt.load_study("door.yaml")
    evaluation = dt.evaluate(study)
    found = study_loops(evaluation)
    assert loops_report(study, found) == loops_report(study, study_loops(evaluation))
    assert "Hz" in loops_sentence(found.joints[0]) and loops_json(study, found) == loops_json(study, found)
    assert found.joints[0].step[-1] == pytest.approx(1.0, abs=0.02)
    assert found.joints[0].time[-1] == pytest.approx(8.0 / found.joints[0].design.position_gain, rel=0.02)


def test_a_joint_that_nothing_settles_is_told(folder: Path) -> None:
    """A spring without damping, on the wrong side of the lag: code 1."""
    text = STUDY.replace("damping: 0.02", "damping: 0").replace("2000 N", "8000 N")
    (folder / "door.yaml").write_text(text, encoding="utf-8")
    ran = CliRunner().invoke(app, ["loops", "door.yaml", "--out", "here"])
    assert ran.exit_code == 1, ran.output
    assert "no gains settle: resonance of the joint's spring" in ran.output
    assert "does not settle" in (folder / "here" / "loops.html").read_text(encoding="utf-8")


def test_an_unknown_inertia_is_told_and_wrong_input_listed(folder: Path) -> None:
    (folder / "door.yaml").write_text(STUDY.replace("rotor_inertia: 60 gcm^2, ", ""), encoding="utf-8")
    ran = CliRunner().invoke(app, ["loops", "door.yaml", "--out", "here"])
    assert ran.exit_code == 1 and "inertia of load or rotor is unknown" in ran.output
    (folder / "taken").write_text("mine", encoding="utf-8")
    ran = CliRunner().invoke(app, ["loops", "door.yaml", "--joint", "dor", "--joint", "lid", "--out", "taken"])
    assert ran.exit_code == 2
    assert all(word in ran.output for word in ("'door'?", "'lid'", "taken is a file"))
