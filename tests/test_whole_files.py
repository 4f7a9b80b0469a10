"""Files that belong together are written all or not at all, whenever the process is killed."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from drivetrain import InputError, whole_files
from drivetrain.whole_files import LIST, write_files

ROOT = Path(__file__).resolve().parents[1]
NAMES = ("report.html", "result.json", "currents.csv")
WRITER = """
import itertools, sys
from drivetrain.whole_files import write_files
for number in itertools.count(int(sys.argv[2])):
    write_files(sys.argv[1], {name: f"{number} " * 500 for name in ("report.html", "result.json", "currents.csv")})
"""


@pytest.mark.parametrize("which", [0, 1, 2, 3])
def test_a_failure_while_writing_leaves_the_old_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, which: int
) -> None:
    old = {"report.html": "old page", "result.json": "old result", "currents.csv": "old currents"}
    write_files(tmp_path, old)
    real, calls = whole_files._written_beside, []

    def breaks(place: Path, text: Any) -> Path:
        calls.append(place)
        if len(calls) == which + 1:
            raise OSError(28, "No space left on device")
        return real(place, text)

    monkeypatch.setattr(whole_files, "_written_beside", breaks)
    with pytest.raises(OSError, match="No space left") as caught:  # code 3 of a command: no input is to blame
        write_files(tmp_path, {name: "new" for name in old})
    assert caught.value.filename == str(tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == old


def test_ctrl_c_while_writing_leaves_no_litter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path, {"a.txt": "new"})
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="cannot be written"):
        write_files(tmp_path / "file" / "out", {"a.txt": "x"})


def test_killed_at_any_instant_the_files_belong_together(tmp_path: Path) -> None:
    """Thirty kills: after the next write nothing is left over, and before it the list tells what is missing."""
    chance, mixed = random.Random(1), 0
    for kill in range(30):
        command = [sys.executable, "-c", WRITER, str(tmp_path), str(1000 * kill)]
        process = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)})
        begin = time.monotonic()
        while not (tmp_path / NAMES[-1]).exists() and time.monotonic() - begin < 60.0:
            time.sleep(0.01)
        time.sleep(0.1 + 0.05 * chance.random())
        process.send_signal(signal.SIGKILL)
        process.wait()
        numbers = {name: set((tmp_path / name).read_text().split()) for name in NAMES}
        assert all(len(one) == 1 for one in numbers.values()), "a file holds parts of two"
        if len(set.union(*numbers.values())) > 1:
            mixed += 1
            assert (tmp_path / LIST).exists(), "files of two writes, and nothing says so"
        whole_files._finish(tmp_path)
        together = {text for name in NAMES for text in (tmp_path / name).read_text().split()}
        assert len(together) == 1, "the list did not bring the rest"
    write_files(tmp_path, dict.fromkeys(NAMES, "end"))
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys(NAMES, "end")


def test_a_list_left_behind_is_finished_first(tmp_path: Path) -> None:
    write_files(tmp_path, {"a.txt": "old", "b.txt": "old"})
    (tmp_path / ".b.txt.x.part").write_text("new")
    (tmp_path / "a.txt").write_text("new")
    (tmp_path / LIST).write_text(json.dumps({"a.txt": ".a.txt.x.part", "b.txt": ".b.txt.x.part"}))
    write_files(tmp_path, {"c.txt": "third"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "a.txt": "new", "b.txt": "new", "c.txt": "third"
    }  # fmt: skip


def test_a_list_that_names_files_elsewhere_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    write_files(folder, {"a.txt": "old"})
    (tmp_path / "precious").write_text("kept")
    (folder / LIST).write_text(json.dumps({"../precious": "a.txt"}))
    with pytest.raises(InputError, match="elsewhere"):
        write_files(folder, {"a.txt": "new"})
    assert (tmp_path / "precious").read_text() == "kept"


def test_what_dead_processes_left_goes(tmp_path: Path) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    (tmp_path / f".a.txt.{gone.pid}.x.part").write_text("half")
    (tmp_path / f".a.txt.{os.getpid()}.x.part").write_text("at work")
    write_files(tmp_path, {"a.txt": "new"})
    assert sorted(path.name for path in tmp_path.iterdir()) == [f".a.txt.{os.getpid()}.x.part", "a.txt"]
