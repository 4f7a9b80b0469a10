"""How many arms are judged a minute of one core when every number scatters, and what a robust choice costs."""

from __future__ import annotations

import sys
import time
from dataclasses import replace

from drivetrain.motion.duty_cycle import build_mix
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.robust import robust_select
from drivetrain.sizing.search.search import select
from drivetrain.sizing.tolerance.monte_carlo import robustness
from drivetrain.study.change import slowed
from drivetrain.study.model import Study
from drivetrain.study.parts.tolerances import Tolerance, Tolerances
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

ALL = Tolerances(
    Tolerance(0.05), Tolerance(0.05), Tolerance(0.3), Tolerance(0.05), Tolerance(0.1, normal=True),
    Tolerance(0.1, normal=True, absolute=True), Tolerance(5.0, absolute=True),
)  # fmt: skip
RUNS = 3


def main(samples: int) -> None:
    """Print the rates of two six-axis examples, as they are and as mixes, and the cost of robust choices.

    Args:
        samples: Arms a run.
    """
    studies: dict[str, Study] = {}
    for name in ("ur5_pick_and_place", "desktop_arm"):
        study = replace(load_study(shipped("examples") / name / "study.yaml"), tolerances=ALL)
        mix = build_mix([study.cycle, slowed(study.cycle, 1.5)], [0.4, 0.6], names=["fast", "slow"])
        studies |= {name: study, f"{name}, mix of two": replace(study, cycle=mix)}
    for name, study in studies.items():
        evaluation = evaluate(study, select(study).drives)
        robustness(evaluation, samples=10)  # compile
        runs = []
        for _ in range(RUNS):
            start = time.process_time()
            found = robustness(evaluation, samples=samples).whole
            runs.append(time.process_time() - start)
        rate = 60.0 * samples / sorted(runs)[RUNS // 2]
        told = f"{len(study.cycle.time)} samples, {found.probability:.1%} hold"
        print(f"{name}: {told}, {rate:,.0f} arms a minute of one core")
    for name in ("ur5_pick_and_place", "desktop_arm"):
        start = time.process_time()
        choice = robust_select(studies[name], holds=0.99)
        spent = time.process_time() - start
        print(f"{name}: {len(choice.trials)} sets drawn in {spent:.2f} s; {choice.proof}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60_000)
