"""Kernels compiled by further processes while this one compiles others: what a first run takes, shared among cores.

A job names its kernels as steps ``module:function``; each function takes no arguments, and compiles one kernel or
takes it from numba's disk cache. When the first kernel is not in the cache, helpers are started, one for each further
core: plain interpreters that go through the list, and leave what they compile in the disk cache. Whoever wants to
compile a step takes it first, by making a file that nobody else has made; who finds it taken compiles another one of
the list meanwhile, then waits until it is there. A helper that dies or hangs costs that wait at most: then the kernel
is compiled here. Helpers end with the job, with this process, and with Ctrl-C, and say nothing.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

MOST_HELPERS = 3
PATIENCE = 30.0  # s for one step; on an idle machine none takes a fifth of it
GLANCE = 0.01  # s between two looks
# Modules are looked for where this process looks for them; the path is set before anything of it is imported.
_CODE = """
import os, sys
sys.path[:] = sys.argv.pop(1).split(os.pathsep)
from drivetrain.compile_ahead import help_out
help_out(sys.argv[1:])
"""


class _Board:
    """Who compiles what: one file a step that is taken, one a step that is done, in a folder."""

    def __init__(self, folder: Path):
        self.folder = folder

    def take(self, number: int) -> bool:
        """Whether the step was still to be had."""
        try:
            os.close(os.open(self.folder / f"{number}.taken", os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except OSError:
            return False
        return True

    def finish(self, number: int) -> None:
        with contextlib.suppress(OSError):
            (self.folder / f"{number}.done").touch()

    def done(self, number: int) -> bool:
        return (self.folder / f"{number}.done").exists()


class _Job:
    """Steps, of which some are taken here; helpers once the first was not in the cache."""

    def __init__(self, steps: Sequence[str]):
        self.steps = tuple(dict.fromkeys(steps))
        self.own: set[int] = set()
        self.board: _Board | None = None
        self.helpers: list[subprocess.Popen[bytes]] = []

    def start(self, cache: str) -> None:
        """Start helpers, where they would be of use and could leave what they make."""
        count = min(MOST_HELPERS, _cores() - 1)
        if self.board is not None or count < 1 or not _interpreter() or parent_process() is not None:
            return
        try:
            with tempfile.TemporaryFile(dir=cache):
                pass
            self.board = _Board(Path(tempfile.mkdtemp(prefix="drivetrain-")))
            for number in self.own:
                self.board.take(number)
            self.helpers = [_helper(self.board.folder, self.steps) for _ in range(count)]
        except OSError:
            self.stop()

    def stop(self) -> None:
        """End the helpers, and leave nothing behind."""
        for helper in self.helpers:
            helper.kill()
        for helper in self.helpers:
            helper.wait()
            if helper.stdin is not None:
                helper.stdin.close()
        self.helpers = []
        if self.board is not None:
            shutil.rmtree(self.board.folder, ignore_errors=True)

    def take(self, number: int) -> None:
        """Return when the step is ours to compile, or lies in the cache."""
        if number in self.own:
            return
        self.own.add(number)
        if self.board is None or self.board.take(number):
            return
        until = time.monotonic() + PATIENCE
        while not self.board.done(number) and time.monotonic() < until and self._helped():
            if not self._another():
                time.sleep(GLANCE)

    def _helped(self) -> bool:
        return any(helper.poll() is None for helper in self.helpers)

    def _another(self) -> bool:
        """Compile a step that nobody has taken; whether there was one."""
        for number, step in enumerate(self.steps):
            if number not in self.own and self.board is not None and self.board.take(number):
                self.own.add(number)
                _run(step)
                return True
        return False


_JOB: ContextVar[_Job | None] = ContextVar("_JOB", default=None)


@contextlib.contextmanager
def compiled_ahead(steps: Sequence[str]) -> Iterator[None]:
    """While a job runs, the kernels that it will need are compiled by helpers too, where they are not in the cache.

    Within another such job nothing is added: the outer one knows what it needs.
    """
    if _JOB.get() is not None:
        yield
        return
    from numba.core import event

    job = _Job(steps)
    token = _JOB.set(job)
    try:
        with event.install_listener("numba:compile", _listener(job)):
            yield
    finally:
        _JOB.reset(token)
        job.stop()


def take(step: str) -> None:
    """Called before a kernel is compiled or taken from the cache: waits while a helper is at it."""
    job = _JOB.get()
    if job is not None and step in job.steps:
        job.take(job.steps.index(step))


def help_out(arguments: Sequence[str]) -> None:
    """What a helper does: compile the steps that nobody has taken.."""
    threading.Thread(target=_end_with_input, daemon=True).start()
    board = _Board(Path(arguments[0]))
    for number, step in enumerate(arguments[1:]):
        if board.take(number):
            with contextlib.suppress(Exception):  # who needs the kernel meets the same, and tells
                _run(step)
            board.finish(number)


def _end_with_input() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


def _run(step: str) -> None:
    module, _, function = step.partition(":")
    getattr(importlib.import_module(module), function)()


def _cores() -> int:
    """Those that this process may use."""
    usable = getattr(os, "sched_getaffinity", None)
    return len(usable(0)) if usable is not None else os.cpu_count() or 1


def _interpreter() -> bool:
    """Whether ``sys.executable`` takes a program: not in a frozen application, or where Python is embedded."""
    name = Path(sys.executable or "").stem.lower()
    return name.startswith(("python", "pypy")) and not getattr(sys, "frozen", False)


def _helper(folder: Path, steps: Sequence[str]) -> subprocess.Popen[bytes]:
    quiet = getattr(subprocess, "CREATE_NO_WINDOW", 0)
    return subprocess.Popen(
        [sys.executable, "-c", _CODE, os.pathsep.join(sys.path), str(folder), *steps],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, creationflags=quiet,
    )  # fmt: skip


def _listener(job: _Job) -> Any:
    """Starts the helpers when the first kernel of this package is compiled, because the cache does not hold it."""
    from numba.core.event import Event, Listener

    class Start(Listener):  # type: ignore[misc]
        def on_start(self, event: Event) -> None:
            kernel = event.data["dispatcher"]
            if job.board is None and kernel.py_func.__module__.startswith("drivetrain."):
                job.start(kernel.stats.cache_path)

        def on_end(self, event: Event) -> None:
            pass

    return Start()
