"""Runs of a scene, and what one costs in time."""

from __future__ import annotations

import statistics
import time as clock
from collections.abc import Mapping, Sequence

from drivetrain.errors import Fault, InputError
from drivetrain.simulation.engine import Engine
from drivetrain.simulation.plan import Plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate

MOST_ROWS = 20_000  # of a recording
USUAL_INTERVAL = 1e-3  # s
WORK = ("rates", "solves")  # what an engine counts its evaluations as


def interval_of(duration: float) -> float:
    """Between two recorded instants of a run that decisions are read from.

    Args:
        duration: Of the run [s].

    Returns:
        A millisecond, or longer where that were too many rows [s].
    """
    return max(min(USUAL_INTERVAL, duration / 500.0), duration / MOST_ROWS)


def ran(plan: Plan, engine: Engine) -> Recording:
    """A run that must reach its end.

    Raises:
        InputError: The run ended before its time: why, and when.
    """
    recording = simulate(plan, solver=engine, interval=interval_of(plan.scene.duration))
    if recording.stopped_by is not None:
        event = recording.stopped_by
        raise InputError(Fault(plan.scene.name, f"{event.name} at {event.time:.6g} s: {event.detail}"))
    return recording


def seconds(plans: Sequence[tuple[Plan, Engine]], rounds: int = 3) -> list[float]:
    """Wall time of runs, measured in turns so that what else the machine does falls on all of them.

    Returns:
        The median of each [s]; two recorded rows a run, so that recording costs nothing.
    """
    found: list[list[float]] = [[] for _ in plans]
    for _ in range(rounds):
        for own, (plan, engine) in zip(found, plans, strict=True):
            begin = clock.perf_counter()
            simulate(plan, solver=engine, interval=plan.scene.duration)
            own.append(clock.perf_counter() - begin)
    return [statistics.median(own) for own in found]


def work(counters: Mapping[str, int]) -> int:
    """Evaluations that a run took."""
    return next((counters[name] for name in WORK if name in counters), 0)
