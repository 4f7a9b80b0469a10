"""Helpers that compile ahead: a first run ends the same with them, without them, and when they die or hang."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

from drivetrain import compile_ahead
from drivetrain.compile_ahead import compiled_ahead, take

PACKAGE = Path(__file__).resolve().parents[1]
STEPS = [f"kernels_on_trial:compile_{name}" for name in ("one", "two", "three")]
MODULE = """
    import os, time
    from pathlib import Path
    import numba
    from drivetrain.compile_ahead import take

    LOG = Path(os.environ["TRIAL_LOG"])
    HELPS = {helps!r}

    @numba.njit(cache=True)
    def kernel(x):
        return x + 1.0

    def did(name):
        take(__name__ + ":compile_" + name)
        helper = "DRIVETRAIN_TRIAL_MAIN" not in os.environ or os.environ["DRIVETRAIN_TRIAL_MAIN"] != str(os.getpid())
        if helper and HELPS == "hangs":
            time.sleep(1000.0)
        if helper and HELPS == "dies":
            os._exit(3)
        if helper and HELPS == "fails":
            raise ValueError(name)
        with LOG.open("a") as file:
            file.write(f"{{name}} {{os.getpid()}}\\n")

    def compile_one(): did("one")
    def compile_two(): did("two")
    def compile_three(): did("three")
"""


@pytest.fixture
def trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Steps that write down who took them; ``helps``: what a helper does instead."""

    def made(helps: str) -> Any:
        (tmp_path / "kernels_on_trial.py").write_text(textwrap.dedent(MODULE).format(helps=helps))
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.setenv("TRIAL_LOG", str(tmp_path / "log"))
        monkeypatch.setenv("DRIVETRAIN_TRIAL_MAIN", str(os.getpid()))
        monkeypatch.delitem(sys.modules, "kernels_on_trial", raising=False)
        monkeypatch.setattr(compile_ahead, "_cores", lambda: 2)
        return tmp_path / "log"

    return made


def done_by(log: Path) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for line in log.read_text().splitlines() if log.exists() else []:
        name, process = line.split()
        found.setdefault(name, []).append(int(process))
    return found


def run_all(cache: Path) -> list[subprocess.Popen[bytes]]:
    """What a job does: start helpers, need every step; who helped."""
    import kernels_on_trial as kernels

    with compiled_ahead(STEPS):
        job = compile_ahead._JOB.get()
        assert job is not None
        job.start(str(cache))
        helpers = list(job.helpers)
        for name in ("three", "two", "one"):
            getattr(kernels, f"compile_{name}")()
    assert all(helper.poll() is not None for helper in helpers)  # none is left
    assert job.board is None or not job.board.folder.exists()
    return helpers


def test_every_step_is_done_once_by_somebody(trial: Any, tmp_path: Path) -> None:
    log = trial("works")
    helpers = run_all(tmp_path)
    own = [name for name, by in done_by(log).items() if os.getpid() in by]
    assert len(helpers) == 1
    assert set(own) <= {"one", "two", "three"}
    assert len(own) == len(done_by(log)) or any(helpers[0].pid in by for by in done_by(log).values())


@pytest.mark.parametrize("helps", ["dies", "fails"])
def test_a_helper_that_dies_or_fails_costs_nothing_but_its_work(trial: Any, tmp_path: Path, helps: str) -> None:
    log = trial(helps)
    run_all(tmp_path)
    assert "three" in done_by(log)  # what is needed goes on, whoever was to do it


def test_a_helper_that_hangs_is_waited_for_in_bounds(
    trial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compile_ahead, "PATIENCE", 0.2)
    trial("hangs")
    helpers = run_all(tmp_path)
    assert len(helpers) == 1
    assert helpers[0].returncode != 0


def test_one_core_has_no_helper(trial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = trial("works")
    monkeypatch.setattr(compile_ahead, "_cores", lambda: 1)
    assert run_all(tmp_path) == []
    assert set(done_by(log)) == {"one", "two", "three"}


@pytest.mark.parametrize("cores, helpers", [(2, 1), (3, 2), (64, 3)])
def test_one_helper_for_each_further_core(
    trial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cores: int, helpers: int
) -> None:
    trial("works")
    monkeypatch.setattr(compile_ahead, "_cores", lambda: cores)
    assert len(run_all(tmp_path)) == helpers


def test_no_helper_where_nothing_can_be_left(trial: Any, tmp_path: Path) -> None:
    log = trial("works")
    assert run_all(tmp_path / "no such folder") == []
    assert set(done_by(log)) == {"one", "two", "three"}


@pytest.mark.parametrize("name", ["", "/opt/robots/app", "/usr/bin/blender"])
def test_no_helper_where_there_is_no_interpreter(
    trial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    trial("works")
    monkeypatch.setattr(sys, "executable", name)
    assert run_all(tmp_path) == []


def test_no_helper_in_a_frozen_application(trial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trial("works")
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    assert run_all(tmp_path) == []


def test_nothing_is_started_where_nothing_is_compiled() -> None:
    with compiled_ahead(STEPS):
        job = compile_ahead._JOB.get()
        take(STEPS[0])
        assert job is not None
        assert job.helpers == []
        with compiled_ahead(["inner:step"]):
            assert compile_ahead._JOB.get() is job
    assert compile_ahead._JOB.get() is None


COLD = """
    import os, sys
    from numba.core import event
    from drivetrain import compile_ahead
    compile_ahead._cores = lambda: int(sys.argv[1])
    compiled = []
    class Count(event.Listener):
        def on_start(self, event):
            kernel = event.data["dispatcher"].py_func
            if kernel.__module__.startswith("drivetrain."):
                compiled.append(kernel.__name__)
        def on_end(self, event):
            pass
    event.register("numba:compile", Count())
    import drivetrain.dynamics.kernels as kernels, drivetrain.dynamics.forward as forward
    steps = ["drivetrain.dynamics.kernels:compiled", "drivetrain.dynamics.composite:compiled"]
    with compile_ahead.compiled_ahead(steps):
        from drivetrain.dynamics import composite
        kernels.compiled()
        composite.compiled()
    print(*compiled)
"""


def cold(cache: Path, cores: int) -> list[str]:
    """Kernels that a process compiles itself."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(PACKAGE)}
    told = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(COLD), str(cores)], env=environment, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert told.stderr == ""
    return told.stdout.split()


def test_what_a_helper_compiles_is_found_in_the_cache(tmp_path: Path) -> None:
    first = cold(tmp_path, 2)
    assert "_recursion" in first
    assert cold(tmp_path, 2) == []  # both kernels lie in the cache, whoever compiled them
