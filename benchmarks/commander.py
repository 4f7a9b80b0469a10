"""How long a tick of ``dt.Commander`` takes, call by call, and one of its C code: a histogram of a million calls.

On a machine that does other things too, the slowest calls are those that the system interrupted; the same loop around a
call that does nothing shows how many of these there are.

    python benchmarks/commander.py [--calls 1000000]
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns

import numpy as np

import drivetrain as dt
from drivetrain.whole_files import shipped

EDGES = (1, 2, 3, 5, 7, 10, 20, 50, 100, 1000)  # us


def main(arguments: list[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--calls", type=int, default=1_000_000, help="default 1000000")
    calls = parser.parse_args(arguments).calls
    study = dt.load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    drives = {task.name: task.pairs[len(task.pairs) // 2] for task in study.joints}
    commander = dt.Commander(dt.evaluate(study, drives), payload="gripper")
    cycle = study.cycle
    rows = list(zip(cycle.position, cycle.velocity, cycle.acceleration, strict=True))
    with tempfile.TemporaryDirectory() as folder:
        columns = {
            "Commander": measured(lambda k: commander(*rows[k]), len(rows), calls),
            "C code": measured(in_c(commander, rows, Path(folder)), len(rows), calls),
            "nothing": measured(lambda k: rows[k], len(rows), calls),
        }
    print(f"{calls} calls, six joints; the C code called by ctypes")
    print(f"{'':>14}" + "".join(f"{name:>12}" for name in columns))
    for name, share in (("median", 50.0), ("99 %", 99.0), ("99.99 %", 99.99), ("largest", 100.0)):
        print(f"{name + ' [us]':>14}" + "".join(f"{np.percentile(one, share):12.2f}" for one in columns.values()))
    for low, high in zip((0, *EDGES), (*EDGES, np.inf), strict=True):
        counts = [int(((one >= low) & (one < high)).sum()) for one in columns.values()]
        print(f"{f'{low} to {high}':>14}" + "".join(f"{count:12d}" for count in counts))
    return 0


def measured(call: Callable[[int], object], samples: int, calls: int) -> np.ndarray:
    """Time of every call [us]."""
    times, k = np.empty(calls, dtype=np.int64), 0
    for _ in range(1000):
        call(0)
    gc.collect()
    gc.freeze()
    for i in range(calls):
        begin = perf_counter_ns()
        call(k)
        times[i] = perf_counter_ns() - begin
        k = k + 1 if k + 1 < samples else 0
    gc.unfreeze()
    return times / 1e3


def in_c(commander: dt.Commander, rows: list[tuple[np.ndarray, ...]], folder: Path) -> Callable[[int], object]:
    """One tick of the C code."""
    dt.write_c(commander, folder / "commander.c")
    compiler = shutil.which("cc") or shutil.which("gcc") or "cc"
    subprocess.run(
        [compiler, "-O2", "-shared", "-fPIC", "-o", folder / "c.so", folder / "commander.c", "-lm"], check=True
    )
    step, n = ctypes.CDLL(str(folder / "c.so")).commander_step, len(commander.joints)
    state, current = np.zeros((4, n)), np.zeros(n)
    state[2:] = 30.0

    def at(row: np.ndarray) -> ctypes.c_void_p:
        return ctypes.c_void_p(row.ctypes.data)

    kept = [tuple(np.ascontiguousarray(one) for one in row) for row in rows]
    given = [
        (at(state), at(q), at(qd), at(qdd), at(q), at(qd), at(current)) for q, qd, qdd in kept
    ]  # fmt: skip
    return lambda k: (step(*given[k]), kept)


if __name__ == "__main__":
    sys.exit(main())
