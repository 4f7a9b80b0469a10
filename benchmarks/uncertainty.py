"""How many arms are judged a minute on one core when every number scatters."""

from __future__ import annotations

import sys
import time
from dataclasses import replace

from drivetrain.shipped import shipped
from drivetrain.sizing.many_arms import judged
from drivetrain.sizing.scatter import drawn
from drivetrain.sizing.scatter_task import bench
from drivetrain.sizing.search import select
from drivetrain.study.load import load_study
from drivetrain.study.tolerances import Tolerance, Tolerances

ALL = Tolerances(
    Tolerance(0.05), Tolerance(0.05), Tolerance(0.3), Tolerance(0.05), Tolerance(0.1, normal=True),
    Tolerance(0.1, normal=True, absolute=True), Tolerance(5.0, absolute=True),
)  # fmt: skip


def main(samples: int) -> None:
    """Print the rate of two six-axis examples: without and with winding time constants on the sheets.

    Args:
        samples: Arms a run.
    """
    for name in ("ur5_pick_and_place", "desktop_arm"):
        study = replace(load_study(shipped("examples") / name / "study.yaml"), tolerances=ALL)
        ready = bench(study, select(study).drives)
        draws = drawn(study, samples, 1)
        list(judged(ready, drawn(study, 10, 2)))  # compile
        runs = []
        for _ in range(5):
            start = time.process_time()
            held = sum(int(found.held.sum()) for found in judged(ready, draws))
            runs.append(time.process_time() - start)
        median = sorted(runs)[2]
        rate = 60.0 * samples / median
        print(f"{name}: {len(study.cycle.time)} samples a cycle, {held / samples:.1%} hold, {rate:,.0f} arms a minute")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20_000)
