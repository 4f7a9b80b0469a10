"""What the choice of solver and step does to a falling arm: error and energy against work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
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
    """The same fall with several solvers, each held against a reference.

    Args:
        q0, qd0: Positions and speeds at the start [rad or m, and per s], (n,).
        duration: [s].
        interval: Between two recorded instants [s].

    Raises:
        InputError: As ``simulate_passive``.
    """
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
