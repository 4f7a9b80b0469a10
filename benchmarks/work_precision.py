"""What accuracy costs in time: error against wall time and against right-hand sides, method by method, scene by scene.

All methods integrate the same compiled right-hand side (``joint_scenes.py``), start afresh at the same breakpoints, and
are judged by the same error of what a drive is chosen by: that of the motor current at twenty instants, as a share of
its peak, and ten times that of its RMS value, whichever is larger (a current within 1 % goes with an RMS within 0.1 %).
What is compared at equal error is the cheapest setting of each method that reaches it. Scipy's methods call the
compiled function from Python; the package's run compiled, explicit ones too, so that method and language can be told
apart. Times are the processor's: those of the wall on a machine that does nothing else. RODAS has what a user of it
would give: the exact Jacobian, and contact and mesh as events.

    python benchmarks/work_precision.py [--softness 0.5] [--repeats 5] [--picture FILE] [--check]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from joint_scenes import ATOL, CURRENT, HEAT, SCENES, JointScene, breakpoints, problem, start
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

from drivetrain.solvers.compiled_function import address_of, evaluate
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import DormandPrince54, Euler, Rodas4, Rodas5P, RungeKutta4

LEVELS = (1e-2, 1e-3, 1e-4)  # errors at which methods are compared
TARGETS = {"scipy RK45": 50.0, "scipy LSODA": 5.0}  # times less wall time than these
OURS = "RODAS5P"
SLOW = 0.5  # [s]: what takes longer is run once


class Run(NamedTuple):
    """One setting of one method: its error [-], wall time [s] and right-hand sides."""

    method: str
    error: float
    wall: float
    rates: int


def main(arguments: list[str] | None = None) -> int:
    """Measure, print the tables, draw the picture; with --check the exit code says whether the targets are met."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--softness", type=float, default=0.5, help="speed over which friction turns [rad/s], 0.5")
    parser.add_argument("--repeats", type=int, default=5, help="runs of each setting, the median counts, default 5")
    parser.add_argument("--picture", type=Path, default=Path("out/work_precision.png"), help="where the diagram goes")
    parser.add_argument("--check", action="store_true", help="exit 1 when a target is missed")
    options = parser.parse_args(arguments)
    found, met = {}, True
    for scene in SCENES:
        print(f"\n{scene.name}, friction turns within {options.softness:g} rad/s", flush=True)
        reference, doubt = reference_currents(scene, options.softness)
        print(f"  reference: RODAS4 at rtol 1e-9; Dormand-Prince at 1e-10 differs by {doubt:.1e}")
        found[scene.name] = measure(scene, options.softness, reference, options.repeats)
        met = report(found[scene.name]) and met
    options.picture.parent.mkdir(parents=True, exist_ok=True)
    draw(found, options.picture)
    print(f"\n{options.picture}")
    return 0 if met or not options.check else 1


def instants(scene: JointScene):
    """Where the current is compared [s]; the first is the start."""
    return np.linspace(0.0, scene.duration, 21)


def decisive(states: np.ndarray) -> np.ndarray:
    """Currents at the instants [A], and behind them the RMS value without its constant factor."""
    return np.append(states[:, CURRENT], np.sqrt(states[-1, HEAT]))


def error_of(found: np.ndarray, true: np.ndarray) -> float:
    """The larger of the error of the current and ten times that of its RMS value, as shares [-]."""
    currents = float(np.abs(found[:-1] - true[:-1]).max() / np.abs(true[:-1]).max())
    return max(currents, 10.0 * abs(float(found[-1] / true[-1]) - 1.0))


@cache
def prepared(scene: JointScene, softness: float, events: bool):
    """The equations of a scene and where it starts; making them is no method's work."""
    return problem(scene, softness=softness, events=events), start(scene, softness=softness)


def run_ours(scene: JointScene, softness: float, solver: object) -> tuple[np.ndarray, int]:
    """What a drive is chosen by, and the number of right-hand sides of a compiled run."""
    task, first = prepared(scene, softness, True)
    found = integrate_compiled(task, solver, first, instants(scene), breakpoints=breakpoints(scene))
    return (decisive(found.states) if not found.stopped else np.full(22, np.nan)), found.work.rates


def run_scipy(scene: JointScene, softness: float, method: str, rtol: float) -> tuple[np.ndarray, int]:
    """The same with one of scipy's methods, split at the breakpoints, with its own dense output."""
    task, state = prepared(scene, softness, False)
    address, numbers, words = address_of(task.rates, "rates"), task.numbers.copy(), task.words.copy()
    times, ends, count = instants(scene), [0.0, *breakpoints(scene), scene.duration], 0
    rows = [state]

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        result = np.empty(len(y))
        evaluate(address, min(t, limit), np.ascontiguousarray(y), result, numbers, words)  # some hand over columns
        return result

    for first, last in pairwise(ends):
        limit = np.nextafter(last, first)  # no stage sees what begins at the breakpoint
        wanted = times[(times > first + 1e-12) & (times < last + 1e-12)]
        inside = np.unique(np.append(np.minimum(wanted, last), last))
        done = solve_ivp(rates, (first, last), state, method, inside, rtol=rtol, atol=np.array(ATOL) * rtol / 1e-4)
        if not done.success:
            return np.full(22, np.nan), count + done.nfev
        rows += list(done.y.T[: len(wanted)])
        state, count = done.y[:, -1], count + done.nfev
    return decisive(np.array(rows)), count


def tolerances(rtol: float) -> tuple[float, ...]:
    """Absolute tolerances in proportion to the relative one."""
    return tuple(value * rtol / 1e-4 for value in ATOL)


def reference_currents(scene: JointScene, softness: float) -> tuple[np.ndarray, float]:
    """What counts as true, and how far another method at its tightest is from them."""
    ours, _ = run_ours(scene, softness, Rodas4(1e-9, tolerances(1e-9)))
    other, _ = run_ours(scene, softness, DormandPrince54(1e-10, 1e-10))
    return ours, error_of(other, ours)


def settings(scene: JointScene, softness: float) -> list[tuple[str, Callable[[], tuple[np.ndarray, int]]]]:
    """Every method at several settings, from cheap to dear."""
    listed: list[tuple[str, Callable[[], tuple[np.ndarray, int]]]] = []
    for rtol in 10.0 ** -np.append(np.arange(1.5, 4.0, 0.25), np.arange(4.0, 7.1, 0.5)):
        for name, solver in (("RODAS5P", Rodas5P(rtol, tolerances(rtol))), ("RODAS4", Rodas4(rtol, tolerances(rtol)))):
            listed.append((name, lambda s=solver: run_ours(scene, softness, s)))
    for rtol in 10.0 ** -np.arange(2.0, 8.1):
        listed.append(
            ("Dormand-Prince 5(4), compiled", lambda r=rtol: run_ours(scene, softness, DormandPrince54(r, r)))
        )
    for step in (2e-4, 1e-4, 5e-5, 2.5e-5, 1e-5):
        listed.append(("Runge-Kutta 4, compiled", lambda h=step: run_ours(scene, softness, RungeKutta4(h))))
    for step in (1e-4, 2e-5, 5e-6):
        listed.append(("Euler, compiled", lambda h=step: run_ours(scene, softness, Euler(h))))
    for method, powers in {"LSODA": (2, 2.5, 3, 3.5, 4, 4.5, 5, 6, 7), "BDF": (2, 3, 4, 5, 6), "Radau": (2, 3, 4, 5, 6),
                           "RK45": (2, 2.5, 3, 4, 5, 6), "DOP853": (2, 4, 6)}.items():  # fmt: skip
        for power in powers:
            listed.append((f"scipy {method}", lambda m=method, r=10.0**-power: run_scipy(scene, softness, m, r)))
    return listed


def measure(scene: JointScene, softness: float, reference: np.ndarray, repeats: int) -> list[Run]:
    """Error and cost of every setting; medians of interleaved runs."""
    listed = settings(scene, softness)
    walls: list[list[float]] = [[] for _ in listed]
    results: list[tuple[float, int]] = [(np.nan, 0)] * len(listed)
    run_ours(scene, softness, Euler(0.01))  # so that nothing is compiled on the clock
    for turn in range(repeats):
        for k, (_, call) in enumerate(listed):
            if turn and walls[k][0] > SLOW:
                continue
            begin = time.process_time()
            with np.errstate(all="ignore"):
                found, rates = call()
            walls[k].append(time.process_time() - begin)
            results[k] = error_of(found, reference), rates
    return [
        Run(name, error, float(np.median(wall)), rates)
        for (name, _), wall, (error, rates) in zip(listed, walls, results, strict=True)
    ]


def cheapest(runs: list[Run], method: str, level: float) -> Run | None:
    """The cheapest setting of a method that reaches an error; None when none does."""
    reaching = [run for run in runs if run.method == method and run.error <= level]
    return min(reaching, key=lambda run: run.wall, default=None)


def report(runs: list[Run]) -> bool:
    """Print the table of a scene; whether the targets are met at every level."""
    methods, met = list(dict.fromkeys(run.method for run in runs)), True
    print(f"  {'':32}" + "".join(f"{f'error <= {level:g}':>38}" for level in LEVELS))
    for method in methods:
        cells = []
        for level in LEVELS:
            own, ours = cheapest(runs, method, level), cheapest(runs, OURS, level)
            if own is None or ours is None:
                cells.append(f"{'-':>38}")
                continue
            factor = own.wall / ours.wall
            cells.append(f"{own.wall * 1e3:12.2f} ms {own.rates:9d} rhs {factor:7.1f} x")
            met = met and factor >= TARGETS.get(method, 0.0)
        print(f"  {method:32}" + "".join(f"{cell:>38}" for cell in cells), flush=True)
    return met


def draw(found: dict[str, list[Run]], picture: Path) -> None:
    """Error against wall time and against right-hand sides, a column a scene."""
    figure = Figure(figsize=(15.0, 9.0), layout="constrained")
    axes = figure.subplots(2, len(found), sharey=True)
    for column, (name, runs) in enumerate(found.items()):
        for row, (field, label) in enumerate((("wall", "wall time [ms]"), ("rates", "right-hand sides"))):
            ax = axes[row][column]
            for k, method in enumerate(dict.fromkeys(run.method for run in runs)):
                own = [run for run in runs if run.method == method and run.error < 1.0]
                x = [getattr(run, field) * (1e3 if field == "wall" else 1) for run in own]
                style = {"marker": "o", "ms": 4, "lw": 2.5 if method == OURS else 1.2, "color": f"C{k}"}
                style["ls"] = "--" if method.startswith("scipy") else "-"
                ax.loglog(x, [run.error for run in own], label=method, **style)
            ax.set_xlabel(label)
            ax.grid(alpha=0.3)
        axes[0][column].set_title(name)
    for row in axes:
        row[0].set_ylabel("error of current and RMS")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    sys.exit(main())
