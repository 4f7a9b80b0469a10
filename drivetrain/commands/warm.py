"""The command that compiles the numerical kernels ahead of their first use, on all cores."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable
from typing import Annotated, Any

import typer

from drivetrain.commands.shared import command, say
from drivetrain.whole_files import shipped


@command
def warm(
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="NAME", help="Only this job; may be repeated.")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Processes. Default: one per core.", min=1)] = None,
) -> None:
    """Compile all kernels now, so that later runs start at once; kernels that are already compiled are skipped."""
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    from drivetrain.errors import Fault, nearest, raise_faults
    from drivetrain.report.terminal import console, progress

    raise_faults(Fault("--only", "is no job", name, nearest(name, JOBS)) for name in only or () if name not in JOBS)
    names = [name for name in JOBS if not only or name in only]
    with (
        progress(console(errors=True), "compiling") as step,
        ProcessPoolExecutor(workers or os.cpu_count(), get_context("spawn")) as pool,
    ):
        running = {pool.submit(_timed, name): name for name in names}
        for done, job in enumerate(as_completed(running), 1):
            say(f"{running[job]:<12} {job.result():5.1f} s")
            step(done, len(names), f"{running[job]} is compiled")


def _timed(name: str) -> float:
    """Run one job; how long it took [s]."""
    begin = time.perf_counter()
    with warnings.catch_warnings(action="ignore"):  # they belong to the user's own studies, not to these
        JOBS[name]()
    return time.perf_counter() - begin


def _study(file: str) -> Any:
    """A study of the shipped examples."""
    from drivetrain.study.read import load_study

    return load_study(shipped("examples") / file)


def _select() -> None:
    from drivetrain.sizing.search.search import select

    select(_study("desktop_arm/study.yaml"))


def _front() -> None:
    from drivetrain.sizing.search.pareto.front import pareto_front

    pareto_front(_study("one_axis/study.yaml"), ("mass", "energy"))


def _tolerances() -> None:
    from drivetrain.sizing.judge.evaluate import evaluate
    from drivetrain.sizing.tolerance.monte_carlo import robustness

    study = _study("ur5_pick_and_place/tradeoffs.yaml")
    robustness(evaluate(study, {joint.name: joint.pairs[0] for joint in study.joints}), samples=100)


def _simulate() -> None:
    from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
    from drivetrain.simulation.run import simulate
    from drivetrain.simulation.study_scene import SceneOptions, scene_of
    from drivetrain.sizing.judge.parts import FilledParts

    study = _study("desktop_arm/study.yaml")
    parts = FilledParts(study)  # any drives, so that the search, which another job compiles, is not needed
    drives = {task.name: parts.drive(task, *task.pairs[0]) for task in study.joints}
    scene = scene_of(study, drives, options=SceneOptions(springs=True))
    simulate(scene, duration=0.01)
    simulate(scene, duration=0.01, solver=AdaptiveStep())


def _dynamics() -> None:
    import numpy as np

    from drivetrain.arm.files.load import load_arm
    from drivetrain.dynamics.forward import forward_dynamics
    from drivetrain.dynamics.inverse import inverse_dynamics
    from drivetrain.dynamics.mass import mass_matrix

    arm, rest = load_arm("planar-2r"), np.zeros((2, 2))
    inverse_dynamics(arm, rest, rest, rest)
    mass_matrix(arm, rest)
    forward_dynamics(arm, rest, rest, rest)
    forward_dynamics(arm, rest[0], rest[0], rest[0])
    linkage = _study("palletiser/study.yaml")
    assert linkage.arm is not None
    cycle = linkage.cycle
    inverse_dynamics(linkage.arm, cycle.position[:2], cycle.velocity[:2], cycle.acceleration[:2])


# The dearest first, so that no core waits for it at the end; last, those whose kernels "select" compiles mostly.
JOBS: dict[str, Callable[[], None]] = {
    "simulate": _simulate,
    "select": _select,
    "dynamics": _dynamics,
    "front": _front,
    "tolerances": _tolerances,
}
