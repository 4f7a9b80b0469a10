"""The commands simulate and accuracy on a small study: pages, files, exit codes, resumption, faults all at once."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from typer.testing import CliRunner

import drivetrain as dt
from drivetrain.cli import app
from drivetrain.errors import InputError
from drivetrain.simulation.recording import load_recording
from drivetrain.study.read import load_study

STUDY = """\
schema_version: 1
name: two links
arm: planar-2r
drive_mass: included
motions:
  swing:
    unit: deg
    profile: quintic
    speed: 200 deg/s
    acceleration: 800 deg/s^2
    waypoints: [[0, 0], [40, 30], [0, 0]]
    dwell: 50 ms
cycle: [{motion: swing}]
supply: {voltage: 48 V}
amplifier: {current_basis: dc, peak_current: 40 A}
motors:
  big: {kind: brushless, current_basis: dc, winding_basis: line_line, torque_constant: 0.08 N m/A, resistance: 0.4 ohm,
        inductance: 0.2 mH, rotor_inertia: 40 g cm^2, resistance_winding_housing: 0.3 K/W,
        resistance_housing_ambient: 0.7 K/W, source: invented}
gears:
  steady: {kind: strain_wave, ratio: 100, efficiency: 80 %, inertia: 3 g cm^2, stiffness_1: 3e4 N m/rad,
           source: invented}
joints:
  default: {drive: {motor: big, gear: steady}}
"""


def write(folder: Path, more: str = "") -> Path:
    path = folder / "study.yaml"
    path.write_text(STUDY + more, encoding="utf-8")
    return path


def run(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


def test_simulate_writes_page_and_recording(tmp_path: Path) -> None:
    code, output = run("simulate", write(tmp_path), "--out", tmp_path / "out", "--step", "1 ms")
    assert code in (0, 1), output
    assert "Plan of two links" in output and "the study's checks on this run" in output
    page = (tmp_path / "out" / "simulation.html").read_text(encoding="utf-8")
    for word in ("The run", "Plan", "data-chart"):
        assert word in page
    recording = load_recording(tmp_path / "out" / "recording.npz")
    assert recording.stopped_by is None
    errors = [np.abs(recording[f"{j}.position"] - recording[f"{j}.command_position"]).max()
              for j in recording.ending("command_position")]  # fmt: skip
    assert 0.0 < max(errors) < 0.02


def test_a_longer_run_repeats_the_cycle(tmp_path: Path) -> None:
    """The command after a whole cycle is that of its start; a run can go on from within a later cycle."""
    study, long, first, second = write(tmp_path), *(tmp_path / name for name in ("long", "first", "second"))
    cycle = dt.load_study(study).cycle.duration
    quick = ("--effects", "none", "--step", "1 ms")
    for out, lasts, *more in (
        (long, 2.5 * cycle), (first, 1.3 * cycle), (second, 2.5 * cycle, "--resume", first / "recording.npz"),
    ):  # fmt: skip
        code, output = run("simulate", study, "--out", out, *quick, "--duration", f"{lasts} s", *more)
        assert code in (0, 1), output
    whole, resumed = (load_recording(folder / "recording.npz") for folder in (long, second))
    for name in whole.ending("command_position"):
        command = whole[f"{name}.command_position"]
        again = np.interp(whole.time + cycle, whole.time, command)
        within = whole.time < 1.4 * cycle
        assert np.ptp(command) > 0.5
        assert again[within] == pytest.approx(command[within], abs=2e-3)  # interpolated between rows, 1 ms apart
        assert resumed[f"{name}.position"][-1] == pytest.approx(whole[f"{name}.position"][-1], abs=1e-9)


def test_simulate_goes_on_from_a_recording(tmp_path: Path) -> None:
    study = write(tmp_path)
    whole, first, second = tmp_path / "whole", tmp_path / "first", tmp_path / "second"
    assert run("simulate", study, "--out", whole, "--effects", "mesh_loss,heat", "--step", "1 ms")[0] in (0, 1)
    run("simulate", study, "--out", first, "--effects", "mesh_loss,heat", "--step", "1 ms", "--duration", "200 ms")
    code, output = run(
        "simulate", study, "--out", second, "--effects", "mesh_loss,heat", "--step", "1 ms", "--resume",
        first / "recording.npz",
    )  # fmt: skip
    assert code in (0, 1), output
    ended = [load_recording(folder / "recording.npz") for folder in (whole, second)]
    for name in ended[0].ending("current"):
        assert ended[1][f"{name}.current"][-1] == pytest.approx(ended[0][f"{name}.current"][-1], rel=1e-9, abs=1e-12)


def test_simulate_starts_from_given_states(tmp_path: Path) -> None:
    study, quick = write(tmp_path), ("--effects", "heat", "--duration", "20 ms", "--out", tmp_path / "out")
    code, output = run("simulate", study, *quick, "--start", "joint_1.speed=6 deg/s, joint_2.position=2 deg")
    assert code in (0, 1), output
    recording = load_recording(tmp_path / "out" / "recording.npz")
    assert recording["joint_1.speed"][0] == pytest.approx(np.radians(6.0))
    assert recording["joint_2.position"][0] == pytest.approx(np.radians(2.0))
    assert "given: joint_1.speed, joint_2.position" in recording.about["start"]
    code, output = run(
        "simulate", study, *quick, "--start", "joint_1.speed=6, joint_1.sped=6 deg/s, joint_2.speed=1 kg"
    )
    assert code == 2 and "3 errors" in output and "'joint_1.speed'" in output, output
    code, output = run(
        "simulate", study, *quick, "--start", "equilibrium", "--resume", tmp_path / "out" / "recording.npz"
    )
    assert code == 2 and "goes with a run from its start" in output
    code, output = run("simulate", "planar-2r", "--start", "equilibrium")
    assert code == 2 and "--start" in output and "is for studies" in output


def test_simulate_by_the_inverse_engine_and_with_effects_chosen(tmp_path: Path) -> None:
    study = write(tmp_path, "simulation: {effects: auto, tolerance: 2 %, step: 1 ms}\n")
    code, output = run("simulate", study, "--out", tmp_path / "auto")
    assert code in (0, 1) and "effects: auto within 2 % left out" in output and "proven" in output
    code, output = run("simulate", study, "--out", tmp_path / "inverse", "--solver", "inverse", "--effects", "none")
    assert code == 0 and "Inverse" in output


def test_accuracy_tells_effects_solvers_and_roads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from drivetrain.accuracy import costs

    kept = costs.solver_cost.__kwdefaults__
    quick = kept | {
        "steps": (2e-3, 1e-3),
        "precisions": (1e-4,),
        "references": (1e-6, 1e-7),
        "explicit": (),
        "rounds": 1,
    }
    monkeypatch.setattr(costs.solver_cost, "__kwdefaults__", quick)
    code, output = run(
        "accuracy", write(tmp_path, "simulation: {step: 1 ms}\n"), "--tolerance", "5%", "--out", tmp_path
    )
    assert code in (0, 1), output
    assert "without joint spring" in output and "auto at 5 %" in output and "cheapest solver" in output
    page = (tmp_path / "accuracy.html").read_text(encoding="utf-8")
    for word in ("Effects", "effects: auto", "Solvers", "Inverse against forward", "Loops"):
        assert word in page
    found = json.loads((tmp_path / "accuracy.json").read_text(encoding="utf-8"))
    assert found["job"] == "accuracy" and found["auto"]["tolerance"] == 0.05
    assert {row["effect"] for row in found["effects"]["left_out"]} >= {"mesh loss", "joint spring", "rotor as a body"}
    errors = [run["error"] for run in found["solvers"]["runs"]]
    assert found["solvers"]["settled"] < min(errors) < 0.05
    for joint in found["inverse_forward"].values():
        assert joint["rms"][1] == pytest.approx(joint["rms"][0], rel=0.05)


def test_faults_of_the_section_and_the_command_line_all_at_once(tmp_path: Path) -> None:
    bad = write(tmp_path, "simulation: {effects: [springs, heet], tolerance: -1, slver: fixed, step: 1}\n")
    with pytest.raises(InputError) as told:
        load_study(bad)
    problems = str(told.value)
    for place in ("simulation.slver", "simulation.effects", "simulation.tolerance", "simulation.step"):
        assert place in problems
    assert "heat" in problems
    code, output = run(
        "simulate", write(tmp_path), "--effects", "heet", "--solver", "rk4", "--step", "-1 ms", "--out", tmp_path / "no"
    )
    assert code == 2
    for word in ("--effects", "--solver", "--step"):
        assert word in output
    assert not (tmp_path / "no").exists()
    assert run("simulate", write(tmp_path), "--from", "30 deg")[0] == 2
    assert run("simulate", "planar-2r", "--solver", "inverse", "--out", tmp_path / "no")[0] == 2


def test_a_study_says_what_it_wants_of_its_simulation(tmp_path: Path) -> None:
    told = load_study(write(tmp_path, "simulation: {effects: none, tolerance: 3 %, tip_tolerance: 1 mm}\n")).simulation
    assert told.effects == () and told.tolerance == pytest.approx(0.03) and told.tip_tolerance == pytest.approx(1e-3)
    assert load_study(write(tmp_path)).simulation.effects == ("all",)


def test_a_load_table_needs_the_inertia_that_it_moves(tmp_path: Path) -> None:
    door = Path(__file__).resolve().parents[2] / "examples" / "one_axis"
    copytree(door, tmp_path / "door")
    study = tmp_path / "door" / "study.yaml"
    lines = study.read_text(encoding="utf-8").splitlines()
    study.write_text("\n".join(line for line in lines if "load_inertia" not in line), encoding="utf-8")
    for command in ("simulate", "accuracy"):
        code, output = run(command, study)
        assert code == 2 and "joints.hinge.load_inertia" in output and "kg m^2" in output
    code, output = run("simulate", door / "study.yaml", "--out", tmp_path / "out")
    assert code == 0 and "RMS 3.01 A" in " ".join(output.split()), output
