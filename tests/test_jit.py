"""The disk cache of compiled code is right whatever source changes, and never needed."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivetrain import jit

LAW = """
from drivetrain.jit import law
from drivetrain.constants import FACTOR

@law
def doubled(x):
    return FACTOR * x
"""
KERNEL = """
from drivetrain.jit import kernel
from drivetrain.laws import (
    doubled,
)

@kernel
def summed(values):
    total = 0.0
    for value in values:
        total += doubled(value)
    return total
"""
USE = """
import numpy as np
from drivetrain import kernels
print(kernels.summed(np.ones(3)), sum(kernels.summed.stats.cache_hits.values()))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of the same name with one kernel, one law in another file, and its constant in a third."""
    folder = tmp_path / "drivetrain"
    folder.mkdir()
    shutil.copy(jit.__file__, folder / "jit.py")
    for name, text in {"__init__": "", "constants": "FACTOR = 2.0\n", "laws": LAW, "kernels": KERNEL}.items():
        (folder / f"{name}.py").write_text(text)
    return folder


def used(package: Path, code: str = USE, **environment: str) -> tuple[float, int]:
    """What the kernel gives in a process of its own, and how often it was found in the cache."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "NUMBA_CACHE_DIR")}
    surroundings = {
        **kept,
        "PYTHONPATH": str(package.parent),
        "XDG_CACHE_HOME": str(package.parent / "none"),
        "PYTHONDONTWRITEBYTECODE": "1",  # Python's own cache goes by time and size of a source
        **environment,
    }
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=package.parent, env=surroundings, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split()
    return float(value), int(hits)


def test_a_change_of_any_imported_source_is_seen(package: Path) -> None:
    assert used(package) == (6.0, 0)
    assert used(package) == (6.0, 1)
    before = (package / "constants.py").stat()
    (package / "constants.py").write_text("FACTOR = 5.0\n")
    os.utime(package / "constants.py", ns=(before.st_atime_ns, before.st_mtime_ns))  # as a checkout may leave it
    assert used(package) == (15.0, 0)
    (package / "constants.py").write_text("FACTOR = 2.0\n")
    assert used(package) == (6.0, 1)


def test_folders_of_old_sources_go(package: Path) -> None:
    for factor in range(jit.KEPT + 2):
        (package / "constants.py").write_text(f"FACTOR = {factor}.0\n")
        assert used(package) == (3.0 * factor, 0)
    assert len(list((package / "__pycache__" / "kernels").glob("kernels-*"))) == jit.KEPT + 1


def test_where_nothing_can_be_written_it_compiles_in_memory(package: Path) -> None:
    """A file stands where each folder would be, which stops even root."""
    (package / "__pycache__").write_text("")
    (package.parent / "none").write_text("")
    assert used(package, PYTHONDONTWRITEBYTECODE="1") == (6.0, 0)
    assert used(package, PYTHONDONTWRITEBYTECODE="1") == (6.0, 0)


def test_damaged_files_are_thrown_away(package: Path) -> None:
    """Cut off, emptied, foreign; where the process that wrote them ended in peace, rotten in one bit too."""
    assert used(package) == (6.0, 0)
    (folder,) = (package / "__pycache__" / "kernels").iterdir()
    files = [next(folder.rglob(pattern)) for pattern in ("*.nbi", "*.nbc")]
    jit._drop_damaged(folder)
    for killed in (False, True):
        if killed:
            (folder / jit.SUMS).unlink()
        for file in files:
            whole, written = file.read_bytes(), file.stat().st_mtime_ns
            flipped = bytes([*whole[:200], whole[200] ^ 1, *whole[201:]])
            for damaged in (b"", b"no cache" * 100, whole[:100], *([] if killed else [flipped])):
                file.write_bytes(damaged)
                os.utime(file, ns=(written, written))
                jit._drop_damaged(folder)
                assert not file.exists()
            file.write_bytes(whole)
            os.utime(file, ns=(written, written))
    for file in files:
        whole = file.read_bytes()
        file.write_bytes(whole[:100])
        assert used(package) == (6.0, 0)
    assert used(package) == (6.0, 1)


def test_what_another_process_adds_is_kept(package: Path) -> None:
    """Its sums are not noted while it runs, or if it is killed."""
    assert used(package) == (6.0, 0)
    adds = USE.replace("np.ones(3)", "np.ones(3, np.float32)") + "import os; sys.stdout.flush(); os._exit(0)\n"
    assert used(package, "import sys" + adds) == (6.0, 0)
    assert used(package) == (6.0, 1)
    assert used(package, "import sys" + adds) == (6.0, 1)


def test_two_first_runs_at_once(package: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        assert {value for value, _ in pool.map(lambda _: used(package), range(2))} == {6.0}
    assert used(package) == (6.0, 1)


def test_a_disk_without_room_is_not_written_to(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=jit.ROOM))
    folder = jit._folder.__wrapped__(Path(jit.__file__))
    assert folder is None


FIRST_CALLS = """
import threading
import numpy as np
import drivetrain as dt
arm = dt.with_rotors(dt.load_arm("ur5-corrected"), [dt.Rotor(100, 2e-5)] * 6)
q, qd, qdd = np.random.default_rng(0).normal(size=(3, 5, 6))
calls = [
    lambda: dt.inverse_dynamics(arm, q, qd, qdd), lambda: dt.mass_matrix(arm, q), lambda: dt.gravity_torque(arm, q),
    lambda: dt.forward_dynamics(arm, q, qd, qdd), lambda: dt.coriolis_matrix(arm, q, qd),
    lambda: dt.tip_pose(arm, q), lambda: dt.articulated_body(arm, q, qd, qdd),
    lambda: dt.task_space_dynamics(arm, q[0], qd[0]),
]
errors, gate = [], threading.Barrier(8)
def first(number):
    gate.wait()
    for k in range(8):
        try:
            calls[(number + k) % 8]()
        except BaseException as error:
            errors.append(repr(error))
threads = [threading.Thread(target=first, args=(i,)) for i in range(8)]
[one.start() for one in threads]
[one.join() for one in threads]
print(len(errors), errors[:1])
"""


def test_first_calls_from_eight_threads_at_once() -> None:
    done = subprocess.run([sys.executable, "-c", FIRST_CALLS], capture_output=True, text=True)
    assert done.stdout.startswith("0 "), done.stdout + done.stderr


def test_the_folder_that_the_user_names_is_taken(package: Path, tmp_path: Path) -> None:
    assert used(package, NUMBA_CACHE_DIR=str(tmp_path / "mine")) == (6.0, 0)
    assert used(package, NUMBA_CACHE_DIR=str(tmp_path / "mine")) == (6.0, 1)
    assert stat.S_ISDIR((tmp_path / "mine").stat().st_mode)
    assert not (package / "__pycache__" / "kernels").exists()
