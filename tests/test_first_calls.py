"""Every public function is safe to call first from many threads at once, and in processes started in any way."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
BEGIN = f"""
import sys, warnings
sys.path[:0] = [{str(TESTS / "hard")!r}, {str(TESTS / "agreement")!r}, {str(TESTS.parent)!r}]
warnings.simplefilter("ignore")
from public_calls import public_calls
CALLS = list(public_calls().items())

def tried(number):
    name, (called, given) = CALLS[number % len(CALLS)]
    try:
        called(**given)
    except Exception as error:
        return f"{{name}}: {{error!r}}"
"""
# Neighbours in the list share kernels: all threads begin at the same call, and each goes its own way from there.
THREADS = (
    BEGIN
    + """
import threading
gate, wrong = threading.Barrier(8), []
def all_of_them(way):
    gate.wait()
    wrong.extend(filter(None, (tried(way * k) for k in range(len(CALLS)))))
threads = [threading.Thread(target=all_of_them, args=(way,)) for way in (1, -1, 1, -1, 1, -1, 1, -1)]
[one.start() for one in threads]
[one.join() for one in threads]
print(len(CALLS), sorted(set(wrong)))
"""
)
PROCESSES = (
    BEGIN
    + """
if __name__ == "__main__":
    import multiprocessing
    with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
        print(len(CALLS), sorted(set(filter(None, pool.map(tried, range(0, len(CALLS), 8), chunksize=1)))))
"""
)


def outcome(script: Path, text: str, *given: str) -> str:
    script.write_text(text, encoding="utf-8")
    done = subprocess.run([sys.executable, script, *given], capture_output=True, text=True, env={**os.environ})
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_all_at_once_from_eight_threads(tmp_path: Path) -> None:
    found = outcome(tmp_path / "threads.py", THREADS)
    assert int(found.split()[0]) > 60 and found.endswith(" []\n"), found


@pytest.mark.parametrize("start", ["fork", "spawn", "forkserver"])
def test_in_processes_of_every_kind(tmp_path: Path, start: str) -> None:
    """An eighth of the calls, first in processes: each kind of kernel is among them."""
    found = outcome(tmp_path / "processes.py", PROCESSES, start)
    assert int(found.split()[0]) > 60 and found.endswith(" []\n"), found
