"""The table of docs/trust.md: what was attacked, how often, and what was lost, counted afresh.

Run as `python tests/hard/trust_table.py [SHARE]`: 1 is what the page states, 0.01 a look. Each row tells its seconds.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(HERE.parent / "agreement"), str(ROOT)]
HEAD = "| attack | tried | lost | seconds |\n|---|---|---|---|"
SWEEP = """
study: {study}
vary: {{supply.voltage: [12 V, 24 V, 36 V, 48 V], ambient: [20 °C, 30 °C, 40 °C]}}
points_per_shard: 2
"""
FINE = ("refused", "answered")


def spoiled_calls(share: float) -> tuple[int, list[str]]:
    """Public functions with a number, a shape or a kind spoiled."""
    import numpy as np
    from corruption import spoiled_call, verdict
    from public_calls import public_calls

    rng, calls, lost = np.random.default_rng(7), list(public_calls().items()), []
    count = max(round(50_000 * share), len(calls))
    for k in range(count):
        name, (function, arguments) = calls[k % len(calls)]
        given = spoiled_call(arguments, rng)
        found = verdict(lambda function=function, given=given: function(**given))
        if found not in FINE:
            lost.append(f"{name}: {found}")
    return count, lost


def spoiled_files(share: float) -> tuple[int, list[str]]:
    """Studies, robots, motions, load tables, catalogues and recordings with something spoiled."""
    import numpy as np
    from corruption import verdict
    from spoiled_files import spoilers

    rng, count, lost = np.random.default_rng(8), 0, []
    with tempfile.TemporaryDirectory() as folder:
        for name, (source, often) in spoilers(Path(folder)).items():
            for _ in range(max(round(20 * often * share), 3)):
                count += 1
                found = verdict(source.spoiled(rng))
                if found not in FINE:
                    lost.append(f"{name}: {found}")
    return count, lost


def kills(share: float) -> tuple[int, list[str]]:
    """Commands killed at any instant; the next run must find nothing half done, and do its work."""
    chance, count, lost = random.Random(9), max(round(200 * share), 3), []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        shutil.copytree(ROOT / "examples" / "one_axis", folder / "one_axis")
        study, sweep = folder / "one_axis" / "study.yaml", folder / "sweep.yaml"
        sweep.write_text(SWEEP.format(study=study), encoding="utf-8")
        jobs = {"select": [study], "simulate": [study], "sweep": [sweep, "--workers", "0"]}
        lasted, whole = {}, {}
        for name, given in jobs.items():  # undisturbed
            begin = time.monotonic()
            _started(name, given, folder / "whole" / name).wait()
            lasted[name], whole[name] = time.monotonic() - begin, _files(folder / "whole" / name)
        for k in range(count):
            name = list(jobs)[k % len(jobs)]
            out = folder / "killed" / name
            process = _started(name, jobs[name], out)
            time.sleep(chance.uniform(0.2, 1.1) * lasted[name])
            process.kill()
            process.wait()
            if bad := [path.name for path in out.rglob("*.json") if not _is_json(path)]:
                lost.append(f"{name}: {bad} is half written")
        for name, given in jobs.items():
            code = _started(name, given, folder / "killed" / name).wait()
            found = _files(folder / "killed" / name)
            if code not in (0, 1) or found != whole[name]:
                lost.append(
                    f"{name}: the run after all kills ends with {code} and leaves {sorted(found ^ whole[name])}"
                )
    return count, lost


def _started(name: str, given: list[object], out: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "drivetrain", name, *map(str, given), "--out", str(out)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def _is_json(path: Path) -> bool:
    try:
        json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return False
    except FileNotFoundError:
        return True
    return True


ATTACKS: dict[str, Callable[[float], tuple[int, list[str]]]] = {
    "calls with a spoiled number, shape or kind": spoiled_calls,
    "spoiled studies, robots, motions, tables, catalogues, recordings": spoiled_files,
    "SIGKILL at any instant of `select`, `simulate`, `sweep`": kills,
}


def main(share: float) -> int:
    """Print the rows as they come; 0 when nothing was lost."""
    print(HEAD)
    code = 0
    for what, attack in ATTACKS.items():
        begin = time.monotonic()
        tried, lost = attack(share)
        code |= bool(lost)
        print(f"| {what} | {tried} | {len(lost) or 'nothing'} | {time.monotonic() - begin:.0f} |", flush=True)
        for one in sorted(set(lost)):
            print(one, file=sys.stderr)
    return code


if __name__ == "__main__":
    raise SystemExit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 1.0))
