"""Motors in MuJoCo and here: wall time at equal error, on scenes that both express with the same equations.

Each scene is first shown to be the same: this package's adaptive engine at rtol 1e-10 against scipy's step control on
the equations that MuJoCo itself evaluates. Then every method runs at several settings, all of them in turn, several
times, each for a few milliseconds at least; the median of the process time counts. MuJoCo steps in C, by its own loop
(``mujoco.rollout``), its model, data and controls made ready; here a run includes the start, a recording of all signals
every 10 ms, and the energy audit.

    python benchmarks/mujoco_motor.py [--repeats 7] [--picture out/mujoco_motor.png] [--check]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from matplotlib.figure import Figure
from mujoco_scenes import (
    INTEGRATORS,
    INTERVAL,
    Answer,
    InMujoco,
    Twin,
    error,
    holding,
    one_joint,
    one_joint_bristles,
    reference,
    run_ours,
    six_joints,
)

from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.solvers.solver import Rodas4

LEVELS = (1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
STEPS = tuple(INTERVAL / parts for parts in (1, 2, 3, 4, 5, 6, 8, 10, 14, 20, 50, 100, 200, 500))
SLOW = 0.1  # s: what takes longer is run three times only
LEAST = 3e-3  # s: what takes less is called several times in a row
FIXED, ADAPTIVE = "fixed step", "adaptive"


class Run(NamedTuple):
    """One setting of one method: its error [-] and process time [s]."""

    method: str
    setting: float
    error: float
    cost: float


def main(arguments: list[str] | None = None) -> int:
    """Measure, print the tables, draw the picture; with --check the exit code says whether MuJoCo is ever faster."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=7, help="runs of each setting, the median counts, default 7")
    parser.add_argument("--picture", type=Path, default=Path("out/mujoco_motor.png"), help="where the diagram goes")
    parser.add_argument("--check", action="store_true", help="exit 1 where MuJoCo takes less time at an equal error")
    options = parser.parse_args(arguments)
    mujoco.set_mju_user_warning(lambda text: None)  # of steps that are too long: their errors are left out below
    print(f"MuJoCo {mujoco.__version__}; process time, medians of {options.repeats} interleaved runs", flush=True)
    found, met = {}, True
    for twin in (one_joint(), one_joint_bristles(), six_joints(False), six_joints(True)):
        true = run_ours(twin, AdaptiveStep(Rodas4(1e-10)))
        doubt = error(reference(twin), true)
        print(f"\n{twin.name}, {twin.scene.duration:g} s; both references differ by {doubt:.1e}", flush=True)
        found[twin.name] = measure(twin, true, options.repeats)
        met = report(found[twin.name]) and met
    hold()
    draw(found, options.picture)
    print(f"\n{options.picture}")
    return 0 if met or not options.check else 1


def settings(twin: Twin) -> list[tuple[str, float, Callable[[], object], Callable[[], Answer]]]:
    """Method, step or tolerance, what is timed, and what it leaves, of every setting."""
    listed: list[tuple[str, float, Callable[[], object], Callable[[], Answer]]] = []
    for step in STEPS:
        for integrator in INTEGRATORS:
            # Explicit stages explode where a step is longer than 2.7 time constants of the current.
            if integrator == "RK4" and step > 5e-4 and twin.gains is None:
                continue
            ready = InMujoco(twin, integrator, step)
            listed.append((f"MuJoCo {integrator}", step, ready.run, ready.answer))
        listed.append(_ours(twin, FIXED, step, FixedStep(step)))
    for rtol in 10.0 ** -np.arange(1.0, 8.1, 0.5):
        listed.append(_ours(twin, ADAPTIVE, float(rtol), AdaptiveStep(Rodas4(float(rtol)))))
    return listed


def _ours(
    twin: Twin, method: str, setting: float, engine: Engine
) -> tuple[str, float, Callable[[], object], Callable[[], Answer]]:
    return (
        method, setting, lambda: simulate(twin.plan, solver=engine, interval=INTERVAL, checked=False),
        lambda: run_ours(twin, engine),
    )  # fmt: skip


def measure(twin: Twin, true: Answer, repeats: int) -> list[Run]:
    """Error and cost of every setting."""
    listed = settings(twin)
    costs: list[list[float]] = [[] for _ in listed]
    for turn in range(repeats + 1):
        for k, (_, _, call, _) in enumerate(listed):
            if turn > 3 and np.median(costs[k]) > SLOW:
                continue
            often = max(1, round(LEAST / costs[k][-1])) if costs[k] else 1
            begin = time.process_time()
            for _ in range(often):
                call()
            costs[k].append((time.process_time() - begin) / often)
    runs = []
    for (method, setting, _, answer), cost in zip(listed, costs, strict=True):
        with np.errstate(all="ignore"):
            off = error(answer(), true)
        if off < 1.0:  # what has exploded is no answer
            runs.append(Run(method, setting, off, float(np.median(cost[1:]))))
    return runs


def cost_at(runs: list[Run], level: float) -> float:
    """Time at an error, between settings along straight lines of the logarithms; infinite where none reaches it."""
    front: list[Run] = []  # from dear to cheap, each the cheapest of its error or better
    for run in sorted(runs, key=lambda run: (run.error, run.cost)):
        if not front or run.cost < front[-1].cost:
            front.append(run)
    if not front or front[0].error > level:
        return float("inf")
    known = np.log([(run.error, run.cost) for run in front])
    return float(np.exp(np.interp(np.log(level), known[:, 0], known[:, 1])))


def report(runs: list[Run]) -> bool:
    """Print the table of a scene; whether MuJoCo takes more time at every level."""
    methods = list(dict.fromkeys(run.method for run in runs))
    print(f"  {'ms at an error of':24}" + "".join(f"{level:>10.0e}" for level in LEVELS))
    for method in methods:
        cells = [cost_at([run for run in runs if run.method == method], level) for level in LEVELS]
        print(f"  {method:24}" + "".join(f"{1e3 * c:10.2f}" if c < np.inf else f"{'-':>10}" for c in cells))
    theirs = [cost_at([run for run in runs if run.method.startswith("MuJoCo")], level) for level in LEVELS]
    met = True
    for name, own in ((FIXED, (FIXED,)), (ADAPTIVE, (ADAPTIVE,)), ("the better of both", (FIXED, ADAPTIVE))):
        mine = [cost_at([run for run in runs if run.method in own], level) for level in LEVELS]
        pairs = list(zip(theirs, mine, strict=True))
        cells = ["-" if m == np.inf else "MuJoCo -" if t == np.inf else f"{t / m:.1f} x" for t, m in pairs]
        print(f"  {'MuJoCo / ' + name:24}" + "".join(f"{cell:>10}" for cell in cells), flush=True)
        met = all(m <= t for t, m in pairs)
    return met


def hold() -> None:
    """What dry friction that should hold does in a minute."""
    print("\nA joint that dry friction should hold, 60 s at a share of what it could hold: drift [rad], ms")
    for share in (0.5, 0.75, 0.96):
        xml, scene = holding(9.0, share, 60.0)
        model = mujoco.MjModel.from_xml_string(xml.format(integrator="implicitfast", step="0.001"))
        data = mujoco.MjData(model)
        data.qpos[0] = scene.position[0]
        begin = time.process_time()
        mujoco.mj_step(model, data, 60_000)
        theirs = time.process_time() - begin
        simulate(scene, duration=0.01)
        begin = time.process_time()
        run = simulate(scene, interval=1.0, checked=False)
        mine, drift = time.process_time() - begin, run.series["joint.position"].values[-1] - scene.position[0]
        print(
            f"  {share:.0%}   MuJoCo {data.qpos[0] - scene.position[0]:+.3f} rad {1e3 * theirs:6.1f} ms"
            f"   here {drift:+.1f} rad {1e3 * mine:6.1f} ms"
        )


def draw(found: dict[str, list[Run]], picture: Path) -> None:
    """Error against time, a panel a scene."""
    figure = Figure(figsize=(13.0, 9.0), layout="constrained")
    for ax, (name, runs) in zip(figure.subplots(2, 2).flat, found.items(), strict=True):
        for k, method in enumerate((*(f"MuJoCo {one}" for one in INTEGRATORS), FIXED, ADAPTIVE)):
            own = sorted((run for run in runs if run.method == method), key=lambda run: run.setting)
            mine = not method.startswith("MuJoCo")
            style = {"marker": "o", "lw": 2.5} if mine else {"marker": "s", "lw": 1.2, "ls": "--"}
            label = f"{method}, here" if mine else method
            x, y = [1e3 * run.cost for run in own], [run.error for run in own]
            ax.loglog(x, y, color=f"C{k}", label=label, ms=4, **style)
        ax.set_title(name)
        ax.set_xlabel("process time [ms]")
        ax.set_ylabel("error [-]")
        ax.set_ylim(1e-8, 1.0)
        ax.grid(alpha=0.3)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=7)
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    sys.exit(main())
