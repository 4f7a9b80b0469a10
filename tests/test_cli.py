"""The commands: exit codes 0, 1, 2; faults as a list and never a traceback; files only when all is well."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import drivetrain as dt
from drivetrain import jit
from drivetrain.cli import app
from drivetrain.commands.catalog import _basis
from drivetrain.commands.shared import COMPILING, NOT_KEPT, report_folder, working
from drivetrain.errors import InputError
from drivetrain.export.losses import lost
from drivetrain.simulation.recording import load_recording

ROOT = Path(__file__).resolve().parents[1]
TABLE = """time [s],torque_door [N m],speed_door [rpm]
0,1.0,0
0.5,2.0,20
1.5,2.0,20
2.0,1.0,0
2.5,-1.0,-20
3.5,-1.0,-20
4.0,1.0,0
"""
STUDY = """
schema_version: 1
name: A door, again
motions:
  swing: {{table: door.csv}}
supply: {{voltage: 24 V}}
amplifier: {{current_basis: dc, peak_current: 20 A, continuous_current: 10 A}}
catalogs: []
motors:
  good:
    kind: brushed
    current_basis: dc
    winding_basis: line_line
    resistance: 0.5 ohm
    torque_constant: {constant}
    inductance: 0.1 mH
    rotor_inertia: 60 gcm^2
    mass: 0.5 kg
    nominal_voltage: 24 V
    no_load_current: 100 mA
    nominal_current: 5 A
    peak_current: 30 A
    max_speed: 8000 rpm
    resistance_winding_housing: 1.5 K/W
    resistance_housing_ambient: 5 K/W
    winding_time_constant: 20 s
    housing_time_constant: 900 s
    max_winding_temperature: 125 °C
    source: made up
gears:
  good:
    kind: planetary
    ratio: 50
    efficiency: 80 %
    inertia: 1 gcm^2
    mass: 0.3 kg
    continuous_torque: {torque}
    repeated_peak_torque: {torque}
    max_input_speed: 8000 rpm
    source: made up
joints:
  door:
    {drive}
"""
GIVEN = "drive: {motor: good, gear: good}"
CHOICE = "candidates: {pairs: [{motor: good, gear: good}]}"

Run = Callable[..., tuple[int, str, str]]
Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a study and its table; what fits by default."""

    def make(constant: str = "30 mNm/A", torque: str = "10 N m", drive: str = GIVEN) -> Path:
        (tmp_path / "door.csv").write_text(TABLE, encoding="utf-8")
        study = tmp_path / "door.yaml"
        study.write_text(STUDY.format(constant=constant, torque=torque, drive=drive), encoding="utf-8")
        return study

    return make


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command in an empty folder: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments: object) -> tuple[int, str, str]:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert "Traceback" not in result.output
        return result.exit_code, result.stdout, result.stderr

    return command


def test_explain_tells_what_the_evaluation_holds(run: Run, write: Write) -> None:
    """Every check once, with formula and source; one alone with the numbers of the evaluation."""
    found = dt.evaluate(dt.load_study(write()))
    code, out, _ = run("explain", write())
    assert code == (0 if found.feasible else 1)
    ((joint, result),) = found.joints.items()
    assert out.startswith(f"{joint}: ")
    told = [line.strip() for line in out.splitlines() if line.startswith("  ") and not line.startswith("    ")]
    assert [line.partition(":")[0] for line in told] == [one.name for one in (*result.checks, *found.shared)]
    assert out.count("    formula ") == len(told)
    (check,) = (one for one in result.checks if one.name == "motor peak torque")
    out = run("explain", write(), "--joint", joint, "--check", check.name)[1].replace("\u00a0", " ")
    motor = result.drive.motor
    assert check.source.replace(f" ({motor.source})", "") in out
    assert out.count(f"motor {motor.key}: {motor.source}") == 1
    assert f"{check.verdict}, {100 * (check.utilisation or 0.0):.0f} %" in out
    (asked,) = (line for line in out.splitlines() if line.strip().startswith("required"))
    scale = 1e-3 if "mN" in asked else 1.0
    assert float(re.findall(r"[0-9.]+", asked)[-1]) * scale == pytest.approx(check.required, rel=5e-3)


def test_size_fits(run: Run, write: Write, tmp_path: Path) -> None:
    code, out, _ = run("size", write(), "--out", "here")
    assert code == 0, out
    assert "door" in out and re.search(r"PASS|MARGINAL", out) and "report: " in out
    assert sorted(p.name for p in (tmp_path / "here").iterdir()) == ["currents.csv", "report.html", "result.json"]


def test_report_writes_the_page_of_size_alone(run: Run, write: Write, tmp_path: Path) -> None:
    study = write()
    assert run("size", study, "--out", "sized")[0] == run("report", study, "--out", "told")[0] == 0
    page = (tmp_path / "told" / "report.html").read_bytes()
    assert page == (tmp_path / "sized" / "report.html").read_bytes()
    assert [one.name for one in (tmp_path / "told").iterdir()] == ["report.html"]


def test_size_does_not_fit(run: Run, write: Write, tmp_path: Path) -> None:
    code, out, _ = run("size", write(torque="1 N m"))
    assert code == 1
    assert "FAIL" in out and "gear repeated peak torque" in out
    assert (tmp_path / "A_door_again_report" / "report.html").is_file()  # the default folder


def test_json_is_result_json_and_nothing_else(run: Run, write: Write, tmp_path: Path) -> None:
    code, out, errors = run("size", write(), "--json", "--out", "o")
    assert code == 0
    assert json.loads(out) == json.loads((tmp_path / "o" / "result.json").read_text(encoding="utf-8"))
    assert "report: " in errors


def test_select(run: Run, write: Write, tmp_path: Path) -> None:
    code, out, _ = run("select", write(drive=CHOICE), "--out", "o", "--json")
    data = json.loads(out)
    assert (
        code == 0 and data["job"] == "select" and data["joints"]["door"]["drive"] == {"motor": "good", "gear": "good"}
    )
    assert (tmp_path / "o" / "rejected.csv").is_file()
    code, out, _ = run("select", write(torque="1 N m", drive=CHOICE), "--out", "o2")
    assert code == 1 and "No allowed set of drives meets all limits" in out


def test_select_takes_what_is_wanted_from_the_command_line(run: Run, write: Write) -> None:
    file = write(drive=CHOICE)
    options = ("--sets", 2, "--time-limit", "500 ms", "--objective", "energy")
    code, out, _ = run("select", file, *options, "--out", "o", "--json")
    data = json.loads(out)
    assert code == 0 and data["objective"]["name"] == "energy" and data["objective"]["unit"] == "J"
    for wrong in (("--time-limit", "5"), ("--time-limit", "0 s"), ("--time-limit", "3 kg")):
        code, _, errors = run("select", file, *wrong)
        assert code == 2 and "--time-limit" in errors
    assert run("select", file, "--sets", 0)[0] == 2 and run("select", file, "--objective", "weight")[0] == 2


def test_a_joint_that_nothing_may_drive_is_an_answer(run: Run, write: Write, tmp_path: Path) -> None:
    file = write(drive=CHOICE.replace("candidates: {", "candidates: {motors: {mass: [50 kg, null]}, ", 1))
    code, out, errors = run("select", file, "--out", "o")
    assert code == 1 and "door" in out and "candidate" in out and "50" in out, out + errors
    assert "filtered out" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    code, out, _ = run("select", write(drive=CHOICE), "--objective", "price", "--out", "p")
    assert code == 1 and "known price" in out
    assert json.loads((tmp_path / "p" / "result.json").read_text(encoding="utf-8"))["verdict"] == "FAIL"


def test_a_first_run_says_that_it_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def said() -> str:
        with working("adding"):
            pass
        return capsys.readouterr().err

    monkeypatch.setattr(jit, "_USED", {tmp_path})  # the folder of the kernels that are loaded
    assert COMPILING in said()
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "judge.1.nbc").touch()  # as numba leaves it
    assert "compiling" not in said()
    monkeypatch.setattr(jit, "_USED", {None})  # no folder can be written
    assert NOT_KEPT in said()


def test_currents(run: Run, write: Write, tmp_path: Path) -> None:
    code, out, _ = run("currents", write(), "--out", "deep/currents.csv")
    assert code == 0 and "currents: " in out
    header = (tmp_path / "deep" / "currents.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header.startswith("time [s],joint,current [A]")
    assert run("currents", write(), "--rate", "100 Hz", "--out", "fast.csv")[0] == 0
    code, _, errors = run("currents", write(), "--out", "c.h")
    assert code == 2 and "must end in .csv without --scale" in errors
    head, columns = (tmp_path / "fast.csv").read_text(encoding="utf-8").splitlines()[:2]
    assert head == "# rate: 100 Hz, order of hold between samples: 1" and columns == header


def test_currents_in_an_amplifiers_numbers(run: Run, write: Write, tmp_path: Path) -> None:
    asked = ("--scale", "cia402", "--basis", "rms", "--full-scale", "door=6 A")
    assert run("currents", write(), *asked, "--out", "c.h")[0] == 0
    text = (tmp_path / "c.h").read_text(encoding="utf-8")
    assert "0x6075 = 6000 mA dc" in text and "int16_t" in text  # a brushed motor
    for wrong, told in (
        (("--full-scale", "6 A"), "needs --scale"),
        (("--rate", "3 s"), "Hz"),
        (("--scale", "cia402", "--basis", "dc"), "rms, peak, torque"),
        (("--scale", "counts", "--full-scale", "gate=6 A"), "gate"),
        (("--scale", "counts", "--full-scale", "6 V"), "A"),
        (("--scale", "counts", "--full-scale", "1 mA"), "32767"),
    ):
        code, _, errors = run("currents", write(), *wrong, "--out", "wrong.csv")
        assert code == 2 and told in errors and not (tmp_path / "wrong.csv").exists()


def test_export(run: Run, write: Write, tmp_path: Path) -> None:
    """A study without an arm has nothing to export; each format's own reader is in tests/export."""
    code, _, errors = run("export", write(), "--to", "mjcf", "--out", "arm.xml")
    assert code == 2 and "arm" in errors and not (tmp_path / "arm.xml").exists()
    assert run("export", write(), "--to", "mjfc", "--out", "arm.xml")[0] == 2
    code, _, errors = run("export", write(), "--to", "physx", "--out", "x.json", "--payload", "part", "--rate", "3 s")
    assert code == 2 and "means nothing to physx" in errors and "--rate" in errors


def test_every_format_is_written(run: Run, tmp_path: Path) -> None:
    study = ROOT / "examples" / "puma560" / "study.yaml"
    files = {"mjcf": "a.xml", "urdf": "a.urdf", "drake": "b.urdf", "sdf": "a.sdf", "ros2": "a.yaml", "physx": "a.json"}
    for name, file in {**files, "c": "a.c"}.items():
        given = "a.txt" if name == "c" else file  # C has endings of its own
        code, out, errors = run("export", study, "--to", name, "--out", tmp_path / given)
        assert code in (0, 1), errors
        assert ("the tip carries nothing: --payload takes" in out) == (name not in ("ros2", "physx"))
        assert f"{name}: {tmp_path / file}" in out
        assert all(one in out for one in lost(name)) and (tmp_path / file).stat().st_size > 500
    assert run("export", study, "--to", "fmu", "--out", tmp_path / "a.fmu")[0] == 2  # of which joint?
    code, out, _ = run("export", study, "--to", "fmu", "--joint", "joint_2", "--out", tmp_path / "a.fmu")
    assert code in (0, 1) and "lost: " in out and zipfile.is_zipfile(tmp_path / "a.fmu")


def test_closed_loops_are_refused_before_drives_are_sought(run: Run) -> None:
    study = ROOT / "examples" / "palletiser" / "study.yaml"
    code, _, errors = run("export", study, "--to", "urdf", "--out", "a.urdf")
    assert code == 2 and "closed loops" in errors and "selected first" not in errors


def test_check_says_what_was_read_and_writes_nothing(run: Run, write: Write, tmp_path: Path) -> None:
    before = {write(), tmp_path / "door.csv"}
    code, out, _ = run("check", tmp_path / "door.yaml")
    assert code == 0 and "1 joint," in out and "good with good" in out and "can be used" in out
    assert set(tmp_path.iterdir()) == before


def test_check_says_which_rows_of_an_own_catalogue_contradict_themselves(
    run: Run, write: Write, tmp_path: Path
) -> None:
    """A torque constant in mNm/A that was given in Nm/A, an inverted ratio; the shipped catalogue is not searched."""
    rows = (
        "key,kind,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A],rotor_inertia [g cm^2],source\n"
    )
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "motors.csv").write_text(f"{rows}SMALL,brushless,dc,line_line,1.2,0.03,60,sheet\n")
    rows = "key,kind,ratio,continuous_torque [N m],source\nUPSIDE,planetary,0.2,5,sheet\n"
    (tmp_path / "parts" / "gears.csv").write_text(rows)
    study = write()
    study.write_text(study.read_text().replace("catalogs: []", "catalogs: [shipped, parts]"))
    code, _, errors = run("check", study)
    assert code == 0 and "errors in the catalogues (1):" in errors and "(SMALL): error: makes R J/kt^2" in errors
    assert "warnings in the catalogues (" in errors and "was 5 meant: motor over output speed?" in errors


def test_check_schema_is_json(run: Run) -> None:
    code, out, _ = run("check", "--schema")
    assert code == 0 and "joints" in json.loads(out)["properties"]


def test_usage_errors_are_bad_input(run: Run) -> None:
    assert run("check")[0] == 2
    assert run("size")[0] == 2
    assert run("nonsense")[0] == 2
    assert run("size", "x.yaml", "--wrong")[0] == 2
    assert run("catalog", "import", "a", "b", "--format", "excel")[0] == 2


def test_init_writes_once(run: Run, tmp_path: Path) -> None:
    code, out, _ = run("init", "mine.yaml")
    assert code == 0 and "drivetrain check mine.yaml" in out
    (tmp_path / "mine.yaml").write_text("edited", encoding="utf-8")
    code, _, errors = run("init", "mine.yaml")
    assert code == 2 and "already there" in errors and "--force" in errors
    assert (tmp_path / "mine.yaml").read_text(encoding="utf-8") == "edited"
    assert run("init", "mine.yaml", "--force")[0] == 0
    assert "\nname: Mine\n" in (tmp_path / "mine.yaml").read_text(encoding="utf-8")
    code, out, _ = run("check", "mine.yaml")
    assert code == 0 and "pairs may be chosen" in out
    assert "motors: " in out and "filtered out" in out and "combinations are published as fitting" in out


def test_catalog_lint(run: Run, tmp_path: Path) -> None:
    assert run("catalog", "lint", tmp_path)[0] == 2  # no tables
    assert run("catalog", "lint", ROOT / "catalogs")[0] == 0
    header = "key,maker,kind,current_basis,winding_basis,resistance [ohm],torque_constant [mNm/A],nominal_voltage [V]"
    row = "m,Acme,brushed,dc,line_line,1.0,50,24,100 000,sheet"
    (tmp_path / "motors.csv").write_text(f"{header},no_load_speed [rpm],source\n{row}\n", encoding="utf-8")
    code, out, _ = run("catalog", "lint", tmp_path)
    assert code == 1 and "motors.csv" in out and "1 error," in out


def test_catalog_import_without_any_basis_is_an_error(run: Run, tmp_path: Path) -> None:
    table = "Bestell-Nr.;Nennstrom [A];Anschlusswiderstand [Ohm];Drehmomentkonstante [mNm/A]\nX1;3,1;0,4;30,5\n"
    (tmp_path / "maker.csv").write_text(table, encoding="utf-8")
    code, _, errors = run("catalog", "import", tmp_path / "maker.csv", tmp_path / "out", "--format", "maker")
    assert code == 2 and "--basis dc" in errors and "no row was imported" in errors
    assert not (tmp_path / "out").exists()


def test_basis_for_all_or_by_name() -> None:
    assert _basis([]) == ""
    assert _basis(["dc"]) == "dc"
    assert _basis(["maxon=dc", "Kollmorgen=rms/phase", "peak/phase"]) == {
        "maxon": "dc", "Kollmorgen": "rms/phase", "": "peak/phase",
    }  # fmt: skip


def test_default_folder_is_a_plain_name(write: Write) -> None:
    from drivetrain.study.read import load_study

    study = load_study(write())
    assert str(report_folder(study.name)) == "A_door_again_report"
    assert report_folder("../../etc/pass wd").parts == ("etc_pass_wd_report",)


def test_errors_raised_late_are_told_too(run: Run, write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    from drivetrain.errors import Fault
    from drivetrain.sizing.judge import evaluate

    def refuses(study: object) -> None:
        raise InputError(Fault("drives.door", "has no drive"))

    monkeypatch.setattr(evaluate, "evaluate", refuses)
    code, _, errors = run("size", write())
    assert code == 2 and "drives.door: has no drive" in errors


def test_piped_output_has_no_colour_and_the_module_runs(write: Write, tmp_path: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "COLUMNS")} | {
        "PYTHONPATH": str(ROOT)
    }
    command = [sys.executable, "-m", "drivetrain", "size", str(write(torque="1 N m"))]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    assert "\x1b" not in done.stdout + done.stderr
    assert "FAIL" in done.stdout
    version = subprocess.run(
        [sys.executable, "-m", "drivetrain", "--version"], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert version.returncode == 0 and version.stdout.startswith("drivetrain ")


def test_simulate_lets_an_arm_fall(tmp_path: Path) -> None:
    ran = CliRunner().invoke(app, ["simulate", "planar-2r", "--duration", "0.2 s", "--out", str(tmp_path / "fall")])
    assert ran.exit_code == 0, ran.output
    assert "energy error" in ran.output
    recording = load_recording(tmp_path / "fall" / "recording.npz")
    assert recording.time[-1] == pytest.approx(0.2)
    assert abs(recording["energy_error"][-1]) < 1e-6  # J; the default solver's tolerance on a joule of motion
    assert (tmp_path / "fall" / "recording.svg").read_text(encoding="utf-8").startswith("<svg")


def test_ratio_tells_the_window_of_the_door(tmp_path: Path) -> None:
    study = str(ROOT / "examples" / "one_axis" / "study.yaml")
    ran = CliRunner().invoke(app, ["ratio", study, "--out", str(tmp_path)])
    assert ran.exit_code == 0, ran.output
    assert "hinge:" in ran.output
    assert "fits with a ratio from" in ran.output
    assert {path.name for path in tmp_path.iterdir()} == {"ratio.html", "ratio.json"}
