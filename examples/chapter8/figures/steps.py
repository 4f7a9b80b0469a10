"""What methods of integration cost and what they err."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.report.charts.chart import JOINT_COLOURS
from drivetrain.report.charts.plotting import house_style
from drivetrain.simulation.passive import DEFAULT_INTERVAL, simulate_passive
from drivetrain.simulation.recording import Recording
from drivetrain.solvers.solver import DormandPrince853, Solver

REFERENCE = DormandPrince853(1e-13, 1e-13)


@dataclass(frozen=True, eq=False)
class StepResult:
    """One run held against a far more accurate one.

    Attributes:
        solver: The method and its settings.
        recording: What it gave; it may end early.
        error: Largest error of any joint's position, up to each recorded instant [rad or m], (N,).
        energy_error: Largest energy that is there and should not be, up to each recorded instant [J], (N,).
    """

    solver: Solver
    recording: Recording
    error: Array
    energy_error: Array


def step_study(
    arm: Arm,
    q0: Any,
    qd0: Any,
    duration: float,
    solvers: Sequence[Solver],
    *,
    interval: float = DEFAULT_INTERVAL,
    reference: Solver = REFERENCE,
) -> tuple[StepResult, ...]:
    """The same fall with several solvers, each held against a reference."""
    exact = _positions(simulate_passive(arm, q0, qd0, duration, solver=reference, interval=interval))
    results = []
    for solver in solvers:
        recording = simulate_passive(arm, q0, qd0, duration, solver=solver, interval=interval)
        found = _positions(recording)
        error = np.abs(found - exact[: len(found)]).max(axis=1)
        energy = np.abs(recording["energy_error"])
        results.append(StepResult(solver, recording, np.maximum.accumulate(error), np.maximum.accumulate(energy)))
    return tuple(results)


def _positions(recording: Recording) -> Array:
    return np.array(list(recording.ending("position").values())).T


def figure_step_study(studies: Mapping[str, Sequence[StepResult]], *, unit: str = "rad", name: str = "steps") -> Figure:
    """What methods cost and what they err: position and energy over work, and the energy error over time."""
    with house_style(name):
        figure = Figure(figsize=(9.6, 3.2))
        left, middle, right = figure.subplots(1, 3)
        for i, (title, results) in enumerate(studies.items()):
            colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
            work = [result.recording.counters["rates"] for result in results]
            left.loglog(work, [result.error[-1] for result in results], "o-", color=colour, markersize=3.5, label=title)
            energy = [result.energy_error[-1] for result in results]
            middle.loglog(work, energy, "o-", color=colour, markersize=3.5)
            for result in results[:1]:
                time, values = result.recording.time[1:], result.energy_error[1:]
                right.semilogy(time, np.where(values > 0.0, values, np.nan), color=colour)
        left.set_ylabel(f"largest error of a position [{unit}]")
        middle.set_ylabel("largest energy gained or lost [J]")
        right.set_ylabel("energy gained or lost by then [J]")
        right.set_xlabel("time [s]")
        right.set_title("coarsest setting of each")
        for axes in (left, middle):
            axes.set_xlabel("evaluations of the right-hand side")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(studies))
    return figure
