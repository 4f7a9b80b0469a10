"""Derivatives of the inverse dynamics along a trajectory, side by side with pinocchio, at 6 and 30 joints.

One process, one thread, runs interleaved, medians. The package is measured as a user calls it. Pinocchio has no call
for many samples: its row is a Python loop. What a loop in C++ would take is near that less the same loop over an arm of
one joint, which is nearly all the cost of calling from Python.

    python benchmarks/derivatives.py [--samples 10000] [--repeats 11]
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

import drivetrain as dt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "agreement"))

from in_pinocchio import InPinocchio
from random_arms import error, motion, random_arm, rotors_of


def main(arguments: list[str] | None = None) -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--samples", type=int, default=10_000, help="samples of the trajectory, default 10000")
    parser.add_argument("--repeats", type=int, default=11, help="interleaved runs of each, default 11")
    options = parser.parse_args(arguments)
    print(f"{'us a sample, median (least to most)':38}{'agreement':>12}")
    for joints in (6, 30):
        measure(joints, options.samples, options.repeats)
    return 0


def measure(joints: int, samples: int, repeats: int) -> None:
    """The rows of one arm."""
    arm = random_arm(1, "R" * joints)
    geared = {kind: dt.with_rotors(arm, rotors_of(1, kind, arm.n)) for kind in ("coaxial", "unbalanced")}
    values = motion(1, arm.n, samples)
    peer, one = InPinocchio(arm), InPinocchio(random_arm(1, "R"))
    rows = list(zip(*values, strict=True))
    single = [tuple(x[:1] for x in row) for row in rows]
    runs: dict[str, Callable[[], object]] = {
        "drivetrain": lambda: dt.inverse_dynamics_derivatives(arm, *values),
        "drivetrain, rotors on the axes": lambda: dt.inverse_dynamics_derivatives(geared["coaxial"], *values),
        "drivetrain, rotors unbalanced": lambda: dt.inverse_dynamics_derivatives(geared["unbalanced"], *values),
        "pinocchio, Python loop": lambda: loop(peer, rows),
        "the same loop, one joint": lambda: loop(one, single),
    }
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats + 1):
        for name, run in runs.items():
            start = time.perf_counter()
            run()
            times[name].append((time.perf_counter() - start) / samples * 1e6)
    found = dt.inverse_dynamics_derivatives(arm, *(x[:5] for x in values))
    wanted = [pin.computeRNEADerivatives(peer.model, peer.data, *row)[0].copy() for row in rows[:5]]
    print(f"{joints} joints{'':28}{error(found.q, np.array(wanted)):14.0e}")
    for name, measured in times.items():
        kept = measured[1:]  # the first compiles
        print(f"  {name:34}{statistics.median(kept):8.2f} ({min(kept):.2f} to {max(kept):.2f})")


def loop(peer: InPinocchio, rows: list[tuple[np.ndarray, ...]]) -> None:
    """One call a sample."""
    for row in rows:
        pin.computeRNEADerivatives(peer.model, peer.data, *row)


if __name__ == "__main__":
    sys.exit(main())
