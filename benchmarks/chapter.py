"""Speed of the chapter's algorithms: the articulated-body method over the number of joints, the book's own package.

Run with ``python benchmarks/chapter.py``; needs the test extras. Ratios within one process, medians of several turns.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import modern_robotics as book
import numpy as np

import drivetrain as dt
from drivetrain import modern_robotics as ours

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests" / "agreement")]

from random_arms import motion, random_arm, rotors_of  # noqa: E402

SAMPLES = 300


def seconds(call: Callable[[], object], turns: int = 7) -> float:
    """Median time of a call, after one that is not counted."""
    call()
    times = []
    for _ in range(turns):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def chains() -> None:
    """The articulated-body method and the solution with the mass matrix, on longer and longer chains."""
    print("joints  articulated body [us a sample]  with rotors  by the mass matrix")
    for n in (6, 12, 25, 50, 100, 200):
        arm, sample = random_arm(0, "R" * n), motion(0, n, 20)
        geared = dt.with_rotors(arm, rotors_of(0, "coaxial", n))
        runs = ((dt.articulated_body, arm), (dt.articulated_body, geared), (dt.forward_dynamics, arm))
        times = [seconds(partial(run, one, *sample)) / 20 * 1e6 for run, one in runs]
        print(f"{n:6} {times[0]:31.2f} {times[1]:12.2f} {times[2]:19.2f}")


def book_names() -> None:
    """The book's functions under their own names against its own package, the UR5 of its section 8.8."""
    arm = dt.load_arm("ur5")
    lists = dt.book_lists(arm)
    chain = (lists.Mlist, lists.Glist, lists.Slist)
    q, qd, qdd = np.random.default_rng(1).uniform(-2, 2, (3, SAMPLES, 6))
    tips, gravity = np.zeros((SAMPLES, 6)), np.array([0.0, 0.0, -9.81])

    def inverse(package: object, count: int) -> float:
        run = package.InverseDynamicsTrajectory  # type: ignore[attr-defined]
        return seconds(lambda: run(q[:count], qd[:count], qdd[:count], gravity, tips[:count], *chain), 3) / count

    def forward(package: object, count: int) -> float:
        run = package.ForwardDynamicsTrajectory  # type: ignore[attr-defined]
        start, torque = np.zeros(6), 0.1 * q[:count]
        return seconds(lambda: run(start, start, torque, gravity, tips[:count], *chain, 1e-3, 1), 3) / (count - 1)

    for name, measure in (("InverseDynamicsTrajectory", inverse), ("ForwardDynamicsTrajectory", forward)):
        theirs, mine = measure(book, 20), measure(ours, SAMPLES)
        print(f"{name}: {1e6 * mine:.3g} us a sample, the book's package {theirs / mine:.0f} times as long")


if __name__ == "__main__":
    chains()
    book_names()
