"""Wrong input from all sides: every command ends with code 2, tells every fault at once, and writes nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from drivetrain.cli import app

ROOT = Path(__file__).resolve().parents[1]
TABLE = """time [s],torque_door [N m],speed_door [rpm]
0,1.0,0
0.5,2.0,20
1.5,2.0,20
2.0,1.0,0
2.5,-1.0,-20
4.0,1.0,0
"""
STUDY = """
schema_version: 1
name: A door
motions: {swing: {table: door.csv}}
supply: {voltage: 24 V}
amplifier: {current_basis: dc, peak_current: 20 A, continuous_current: 10 A}
catalogs: []
motors:
  good: {kind: brushed, current_basis: dc, winding_basis: line_line, resistance: 0.5 ohm, torque_constant: 30 mNm/A,
         rotor_inertia: 60 gcm^2, mass: 0.5 kg, nominal_current: 5 A, peak_current: 30 A, source: made up}
gears:
  good: {kind: planetary, ratio: 50, efficiency: 80 %, inertia: 1 gcm^2, mass: 0.3 kg, repeated_peak_torque: 10 N m,
         source: made up}
joints:
  door: {candidates: {pairs: [{motor: good, gear: good}]}}
"""
OF_STUDIES = ("check", "size", "report", "select", "currents", "ratio", "why-not", "explain", "curve", "front",
              "free-ratio", "simulate", "accuracy", "loops", "sweep")  # fmt: skip

Run = Callable[..., tuple[int, str]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command in a folder with a sound study: exit code, and all that was printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    (tmp_path / "door.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "door.yaml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "in_the_way").write_text("a file", encoding="utf-8")

    def command(*arguments: object) -> tuple[int, str]:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert "Traceback" not in result.output
        return result.exit_code, result.output

    return command


def files(folder: Path) -> dict[str, bytes]:
    return {str(one.relative_to(folder)): one.read_bytes() for one in sorted(folder.rglob("*")) if one.is_file()}


NO_STUDIES: dict[str, bytes | None] = {
    "a folder": None, "empty": b"", "binary": bytes(range(256)), "a list": b"- a\n- b\n", "a word": b"hello\n",
    "broken": b"a: [1\nb: {", "tabs": b"a:\n\tb: 1\n", "twice": b"name: a\nname: b\n",
    "another coding": b"\xff\xfea\x00", "a null": b"name: 'x\x00y'\n",
    "motors in a list": b"motors: [{a: 1}]\njoints: {j: {drive: {motor: x, gear: y}}}\n",
    "unknown keys": b"nmae: x\nnonsense: 1\n", "no keys": b".nan: .nan\n", "of itself": b"a: &a [*a]\n",
    "a program": b"!!python/object/apply:os.system ['touch done']\n", "deep": b"[" * 4000,
}  # fmt: skip


@pytest.mark.parametrize("kind", NO_STUDIES)
def test_no_command_takes_what_is_no_study(run: Run, tmp_path: Path, kind: str) -> None:
    content, file = NO_STUDIES[kind], tmp_path / "strange.yaml"
    if content is None:
        file.mkdir()
    else:
        file.write_bytes(content)
    before = files(tmp_path)
    for command in OF_STUDIES if kind in ("a folder", "broken", "a list") else OF_STUDIES[:2]:  # one reader for all
        code, told = run(command, file, *(["--motor", "good"] if command == "why-not" else []))
        assert code == 2 and "error" in told and "strange.yaml" in told, (command, told)
    assert files(tmp_path) == before


def test_a_missing_study_and_a_folder_are_told_apart(run: Run, tmp_path: Path) -> None:
    assert "does not exist" in run("check", "none.yaml")[1]
    told = run("check", tmp_path)[1]
    assert "is a folder" in told and "it holds door.yaml" in told


MANY = {  # what is asked, and every word that must be told, all of one run
    ("select", "door.yaml", "--time-limit", "10 kg", "--front", "mass,foo", "--curve", "baz", "--curve-from", "1 kg",
     "--out", "in_the_way"): ("'10 kg'", "is a mass", "'foo'", "energy", "'baz'", "--curve-to", "in_the_way is a file"),
    ("select", "none.yaml", "--time-limit", "-1 s", "--front", "mas"): ("does not exist", "above 0 s", "'mass'?"),
    ("size", "none.yaml", "--out", "in_the_way"): ("does not exist", "must be a folder"),
    ("currents", "none.yaml", "--out", "."): ("does not exist", "must be a file"),
    ("ratio", "door.yaml", "--joint", "dor", "--joint", "lid", "--out", "in_the_way/x"):
        ("'door'?", "'lid'", "in_the_way is a file"),
    ("loops", "door.yaml", "--joint", "dor", "--joint", "lid", "--out", "in_the_way/x"):
        ("'door'?", "'lid'", "in_the_way is a file"),
    ("explain", "door.yaml", "--joint", "dor", "--check", "motr voltage"): ("'door'?", "'motor voltage' or"),
    ("why-not", "door.yaml", "--joint", "dor", "--motor", "goood"): ("'door'?", "'good'?"),
    ("curve", "none.yaml", "--vary", "volts", "--points", "1", "--out", "in_the_way"):
        ("does not exist", "'voltage'?", "2 or more", "must be a folder"),
    ("curve", "none.yaml", "--vary", "voltage", "--from", "1 A", "--to", "x"): ("a current", "'x'", "does not exist"),
    ("front", "none.yaml", "--by", "mass,cost,enrgy", "--time-limit", "x"): ("'cost'", "'energy'?", "'x'", "not exist"),
    ("free-ratio", "none.yaml", "--goal", "het", "--out", "in_the_way"): ("'heat'?", "does not exist", "--out"),
    ("simulate", "ur5", "--duration", "-1 s", "--from", "[1] deg", "--step", "5 kg", "--solver", "fixed", "--effects",
     "x", "--tolerance", "1 %", "--tip", "tol0", "--out", "in_the_way"):
        ("--duration", "--from", "5 kg", "--solver", "--effects", "--tolerance", "'tool0'?", "--out"),
    ("simulate", "none.yaml", "--duration", "x", "--from", "1 rad", "--tip", "t", "--step", "-1 s", "--solver", "rk4",
     "--effects", "mesh_los", "--tolerance", "-1", "--resume", "no.npz", "--out", "in_the_way"):
        ("does not exist", "--duration", "--from", "--tip", "--step", "--solver", "'mesh_los'", "--tolerance", "no.npz",
         "in_the_way"),
    ("accuracy", "none.yaml", "--tolerance", "x", "--out", "in_the_way"): ("does not exist", "--tolerance", "--out"),
    ("sweep", "none.yaml", "--workers", "-1", "--out", "in_the_way"): ("does not exist", "0 or more", "a folder"),
    ("init", "in_the_way/x.yaml", "--arm", "ur6"): ("in_the_way is a file", "'ur5'?"),
    ("catalog", "import", "none", "in_the_way"): ("in_the_way",),
    ("catalog", "lint", "in_the_way"): ("holds no catalogue table", "motors.csv"),
}  # fmt: skip


@pytest.mark.parametrize("asked", MANY, ids=lambda asked: " ".join(asked)[:60])
def test_all_faults_at_once_and_nothing_written(run: Run, tmp_path: Path, asked: tuple[str, ...]) -> None:
    before = files(tmp_path)
    code, told = run(*asked)
    assert code == 2, told
    assert [word for word in MANY[asked] if word not in told] == [], told
    assert files(tmp_path) == before


SPOILED = {  # what is written instead of what, and what is told
    "voltage: 24 V": ("voltage: -24 V", ("supply.voltage", "-24 V")),
    "peak_current: 20 A": ("peak_current: .nan A", ("amplifier.peak_current", ".nan A")),
    "resistance: 0.5 ohm": ("resistance: 0.5 N", ("motors.good.resistance", "ohm", "0.5 N")),
    "ratio: 50": ("ratio: 0", ("gear good.ratio", "0")),
    "efficiency: 80 %": ("efficiency: 180 %", ("gears.good.efficiency", "180 %")),
    "motor: good": ("motor: goood", ("'goood'", "'good'?")),  # although the row of that key is faulty
}


def test_every_spoiled_value_is_told_with_place_value_and_mend(run: Run, tmp_path: Path) -> None:
    text = STUDY
    for good, (bad, _) in SPOILED.items():
        assert text.count(good) == 1
        text = text.replace(good, bad)
    (tmp_path / "door.yaml").write_text(text, encoding="utf-8")
    told = run("check", "door.yaml")
    assert told[0] == 2
    assert [word for _, words in SPOILED.values() for word in words if word not in told[1]] == [], told[1]
    assert told[1].startswith(f"{len(SPOILED)} errors")  # and none that only follows from another


CELLS = ("nan", "inf", "-1", "1e400", "abc", "1,5")


def test_no_catalogue_means_none(run: Run, tmp_path: Path) -> None:
    """An empty list of catalogues is not the shipped one."""
    text = STUDY.replace("candidates: {pairs: [{motor: good, gear: good}]}", "candidates: {pairs: all}")
    (tmp_path / "door.yaml").write_text(text, encoding="utf-8")
    assert "door: no drive given; 1 pairs may be chosen" in run("check", "door.yaml")[1]
    none = STUDY.replace(
        "candidates: {pairs: [{motor: good, gear: good}]}", "candidates: {motors: {mass: [90 kg, null]}}"
    )
    (tmp_path / "door.yaml").write_text(none, encoding="utf-8")
    code, told = run("check", "door.yaml")
    assert code == 1 and "the study can be read, but nothing can be chosen for door" in told


@pytest.mark.parametrize("cell", CELLS)
def test_cells_of_a_table_are_told_with_row_and_column(run: Run, tmp_path: Path, cell: str) -> None:
    table = TABLE.replace("0.5,2.0,20", f'"{cell}","{cell}",20' if cell != "-1" else "-1,2.0,20")
    (tmp_path / "door.csv").write_text(table, encoding="utf-8")
    code, told = run("select", "door.yaml", "--out", "o")
    assert code == 2 and "door.csv" in told and not (tmp_path / "o").exists(), told


@pytest.mark.parametrize("content", [b"", b"\x00\x01\xff", b"time [s]\n", b"a,b\n1\n", b'"'], ids=repr)
def test_a_table_that_is_none(run: Run, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "door.csv").write_bytes(content)
    code, told = run("size", "door.yaml")
    assert code == 2 and "door.csv" in told, told


NO_ANSWER = {  # a "no" is an answer, not a fault
    "a joint nothing can drive": ("repeated_peak_torque: 10 N m", "repeated_peak_torque: 1 mN m", "gear repeated peak"),
    "a joint without candidates": ("pairs: [{motor: good, gear: good}]", "motors: {mass: [50 kg, null]}", "candidate"),
    "no price": ("joints:", "objective: price\njoints:", "fill the column price: 1 of 1 motors"),
    "too much of the supply": ("voltage: 24 V", "voltage: 24 V, peak_power: 1 mW", "supply"),
    "data missing": ("nominal_current: 5 A, ", "", "nominal_current or nominal_torque"),
}


@pytest.mark.parametrize("kind", NO_ANSWER)
def test_what_cannot_be_is_an_answer_with_a_reason(run: Run, tmp_path: Path, kind: str) -> None:
    good, bad, word = NO_ANSWER[kind]
    assert STUDY.count(good) == 1
    (tmp_path / "door.yaml").write_text(STUDY.replace(good, bad), encoding="utf-8")
    code, told = run("select", "door.yaml", "--out", "o")
    assert code == 1 and word in told and "door" in told, told


def test_ctrl_c_ends_with_one_line_and_leaves_nothing(run: Run, tmp_path: Path) -> None:
    """A real signal to a real process, while it searches."""
    code = (
        "import signal, sys\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background jobs ignore it
        "from drivetrain.sizing.search import search\n"
        "def slow(*_, **__):\n    print('searching', flush=True)\n    import time; time.sleep(30)\n"
        "search.select = slow\n"
        "from drivetrain.cli import main\n"
        "sys.argv = ['drivetrain', 'select', 'door.yaml', '--out', 'o']\n"
        "main()\n"
    )
    before = files(tmp_path)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None and process.stdout.readline() == "searching\n"
    time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and errors.strip().splitlines()[-1] == "stopped" and "Traceback" not in errors
    assert files(tmp_path) == before
