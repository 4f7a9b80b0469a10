"""How long `drivetrain serve` takes to answer: every slider of the page, a ratio, another motor, a selection anew.

An answer is the whole report as the browser gets it, asked for through the server. Times are those of this process'
processor, which another program on the machine lengthens less than the clock on the wall.

    python benchmarks/served_page.py [--turns 15] [examples/*/study.yaml]
"""

from __future__ import annotations

import argparse
import json
import threading
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np

import drivetrain as dt
from drivetrain.commands.server import server_of
from drivetrain.report.pages.live_page import LivePage

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
STUDIES = [EXAMPLES / name / "study.yaml" for name in ("one_axis", "desktop_arm", "ur5_pick_and_place")]


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("studies", nargs="*", type=Path, default=STUDIES)
    parser.add_argument("--turns", type=int, default=15, help="questions of each kind, default 15")
    options = parser.parse_args()
    print("| study | question | processor time: median | longest | answer [kB] |\n| --- | --- | --- | --- | --- |")
    for path in options.studies:
        study = dt.load_study(path)
        live = LivePage(study, dt.select(study))
        server = server_of(live)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        for name, questions in kinds(live, options.turns).items():
            road = "select" if name == "select anew" else "evaluate"
            found = [ask(server.server_address[1], road, one) for one in questions]
            spent, size = [1e3 * seconds for seconds, _ in found[1:]], max(bytes_ for _, bytes_ in found)
            told = f"{np.median(spent):.0f} ms | {max(spent):.0f} ms | {size / 1e3:.0f}"
            print(f"| {path.parent.name} | {name} | {told} |", flush=True)
        server.shutdown()


def kinds(live: LivePage, turns: int) -> dict[str, list[dict[str, Any]]]:
    """Questions by what is moved, the first of each to warm up."""
    drives = {name: list(pair) for name, pair in live.first.drives.items()}
    first = next(iter(drives))
    found = {
        one.name: [{"drives": drives, "values": {one.name: float(v)}} for v in np.linspace(one.low, one.high, turns)]
        for one in live.controls.values()
    }  # fmt: skip
    gear = live.study.catalog.gears.get(drives[first][1])
    if gear is not None:
        shares = np.linspace(0.5, 2.0, turns)
        found["ratio"] = [{"drives": drives, "ratios": {first: float(abs(gear.ratio) * share)}} for share in shares]
    motors = list(dict.fromkeys(motor for motor, _ in live.study.joints[0].pairs))[:turns]
    found["another motor"] = [{"drives": drives | {first: [motor, drives[first][1]]}} for motor in motors]
    found["select anew"] = [
        {"values": {"voltage": live.study.supply.voltage * share}} for share in (1.0, 1.05, 0.95, 1.1)
    ]
    return found


def ask(port: int, road: str, question: dict[str, Any]) -> tuple[float, int]:
    """Processor time [s] and bytes of an answer."""
    request = urllib.request.Request(
        f"http://127.0.0.1:{port}/{road}", json.dumps(question).encode(), {"Content-Type": "application/json"}
    )
    start = time.process_time()
    with urllib.request.urlopen(request) as answer:
        size = len(answer.read())
    return time.process_time() - start, size


if __name__ == "__main__":
    main()
