"""What a controller pays that calls with one sample, (n,), a time: medians beside pinocchio's own, in one process.

Every call is made as a user makes it, checks and allocation included; the calls take turns.

    python benchmarks/one_sample.py [--arm ur5-corrected] [--turns 401]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from inverse_dynamics import along_z, error, geared

import drivetrain as dt

CALLS = 20  # a turn: short, so that other work on the machine spoils few of them


class Row(NamedTuple):
    """A call, with rotors on the joint axes too, what pinocchio calls the like, and what both should give."""

    name: str
    bare: Callable[[], object]
    geared: Callable[[], object]
    theirs: Callable[[], object]
    difference: float


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--arm", default="ur5-corrected", help="a built-in arm or a file, default ur5-corrected")
    parser.add_argument("--turns", type=int, default=401, help=f"turns of {CALLS} calls each, default 401")
    options = parser.parse_args()
    bare = dt.with_rotors(arm := dt.load_arm(options.arm), [None] * arm.n)
    table = rows(bare, geared(bare, "on the joint axes"))
    calls = [call for row in table for call in row[1:4]]
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(options.turns):
        for call, found in zip(calls, times, strict=True):
            found.append(microseconds(call))
    print(f"{arm.name}, one sample, us a call: median (quarter to three quarters of {options.turns} turns)\n")
    print(f"{'':20} {'rotors off':>20} {'rotors on the axes':>20} {'pinocchio, no rotors':>20}  difference")
    for k, row in enumerate(table):
        cells = "".join(f" {spread(found):>20}" for found in times[3 * k : 3 * k + 3])
        print(f"{row.name:20}{cells}  {row.difference:10.1e}")


def rows(bare: dt.Arm, driven: dt.Arm) -> list[Row]:
    """The calls that are measured."""
    q, qd, qdd = np.random.default_rng(0).uniform(-1.0, 1.0, (3, bare.n))
    model = along_z(bare)
    data = model.createData()

    def all_terms() -> np.ndarray:
        pin.computeAllTerms(model, data, q, qd)
        return np.array(data.nle)

    def bias() -> np.ndarray:
        terms = dt.closed_form(bare, q, qd)
        return np.asarray(terms.velocity + terms.gravity)

    pairs = {
        "inverse_dynamics": ((q, qd, qdd), lambda: pin.rnea(model, data, q, qd, qdd)),
        "forward_dynamics": ((q, qd, qdd), lambda: pin.aba(model, data, q, qd, qdd)),
        "coriolis_matrix": ((q, qd), lambda: pin.computeCoriolisMatrix(model, data, q, qd)),
        "closed_form": ((q, qd), all_terms),
    }
    table = []
    for name, (given, theirs) in pairs.items():
        call = getattr(dt, name)
        runs = [lambda call=call, arm=arm, given=given: call(arm, *given) for arm in (bare, driven)]
        own = bias() if name == "closed_form" else runs[0]()
        if name == "coriolis_matrix":  # of many such matrices each has its own; what they make of the speeds is one
            table.append(Row(name, *runs, theirs, error(own @ qd, theirs() @ qd)))
        else:
            table.append(Row(name, *runs, theirs, error(own, theirs())))
    return table


def microseconds(call: Callable[[], object]) -> float:
    """Of one call, in a row of many."""
    start = time.perf_counter()
    for _ in range(CALLS):
        call()
    return (time.perf_counter() - start) / CALLS * 1e6


def spread(found: list[float]) -> str:
    """Median and quartiles."""
    low, middle, high = np.quantile(found[1:], [0.25, 0.5, 0.75])
    return f"{middle:.1f} ({low:.1f} to {high:.1f})"


if __name__ == "__main__":
    main()
