"""Speed of the chapter's algorithms: forward dynamics and mass matrix of long chains, the book's own package.

Run with ``python benchmarks/chapter.py``; needs the test extras. One process, one thread, medians of processor time.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import modern_robotics as book
import numpy as np
import pinocchio as pin
from inverse_dynamics import along_z

import drivetrain as dt
from drivetrain import modern_robotics as ours

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests" / "agreement")]

from random_arms import motion, random_arm, rotors_of  # noqa: E402

SAMPLES = 300
TURNS = 21


def seconds(call: Callable[[], object], turns: int = 7) -> float:
    """Median time of a call, after one that is not counted."""
    call()
    times = []
    for _ in range(turns):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return statistics.median(times)


def chains() -> None:
    """Forward dynamics and the mass matrix of longer and longer chains, side by side with pinocchio.

    Pinocchio's ``abaInParallel`` with one thread is a loop in C++. Its ``crba`` has no call for many samples: its time
    is that of a Python loop less that of the same loop over an arm of one joint, the cost of calling from Python.
    """
    names = ("forward_dynamics", "with rotors", "pinocchio aba", "mass_matrix", "pinocchio crba")
    print(
        "us a sample: median (quarter to three quarters of the turns)\njoints"
        + "".join(f"{name:>27}" for name in names)
    )
    for n in (6, 12, 30, 50, 100, 200):
        found = interleaved(runs(n, 60_000 // n))
        crba, one = found.pop("crba"), statistics.median(found.pop("crba of one joint"))
        found["pinocchio crba"] = [each - one for each in crba]
        cells = ("{1:.3g} ({0:.3g} to {2:.3g})".format(*statistics.quantiles(x)) for x in found.values())
        print(f"{n:6}" + "".join(f"{cell:>27}" for cell in cells))


def runs(n: int, samples: int) -> dict[str, tuple[Callable[[], object], int]]:
    """What is measured at n joints, with the number of samples."""
    arm, (q, qd, tau) = random_arm(0, "R" * n), motion(0, n, samples)
    geared = dt.with_rotors(arm, rotors_of(0, "coaxial", n))
    model, one = along_z(arm), along_z(random_arm(0, "R"))
    pool, columns = pin.ModelPool(model, 1), [np.asfortranarray(x.T) for x in (q, qd, tau)]
    result = np.zeros((n, samples), order="F")

    def crba(model: pin.Model) -> None:
        data = model.createData()
        for row in q[:, : model.nv].copy():
            pin.crba(model, data, row)

    calls: dict[str, Callable[[], object]] = {
        "forward_dynamics": lambda: dt.forward_dynamics(arm, q, qd, tau),
        "with rotors": lambda: dt.forward_dynamics(geared, q, qd, tau),
        "pinocchio aba": lambda: pin.abaInParallel(1, pool, *columns, result),
        "mass_matrix": lambda: dt.mass_matrix(arm, q),
        "crba": lambda: crba(model),
        "crba of one joint": lambda: crba(one),
    }
    return {name: (call, samples) for name, call in calls.items()}


def interleaved(calls: dict[str, tuple[Callable[[], object], int]]) -> dict[str, list[float]]:
    """Microseconds a sample, of turns in which all take part; the first is not counted."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(TURNS + 1):
        for name, (call, samples) in calls.items():
            call()  # warms the caches
            start = time.process_time()
            call()
            if turn:
                found[name].append((time.process_time() - start) / samples * 1e6)
    return found


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
