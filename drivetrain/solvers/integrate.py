"""The loop around a solver: wanted instants, jumps that no step may cross, corrections after each step, failures."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers.compiled_function import in_c
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.rosenbrock import Rodas4
from drivetrain.solvers.solver import (
    MOST_STEPS,
    Rates,
    Solver,
    SolverStopped,
    Stepper,
    Work,
    inner_points,
    wanted_and_start,
)

Correct = Callable[[float, Array], Array | None]


@dataclass(frozen=True, eq=False)
class Solution:
    """States at the wanted instants, as far as the solver came.

    Attributes:
        times: Instants [s], (N,), those wanted, fewer if it stopped early.
        states: One row an instant [their own units], (N, m).
        work: What it cost.
        stopped: Why it ended early, with what could help; empty when it did not.
        stopped_at: When [s]; the end of the wanted instants when it did not.
        culprit: Index of the state that was no number any more; None when that was not the reason.
    """

    times: Array
    states: Array
    work: Work
    stopped: str = ""
    stopped_at: float = math.inf
    culprit: int | None = None


def integrate(
    solver: Solver,
    rates: Rates,
    start: Any,
    times: Any,
    *,
    breakpoints: Sequence[float] = (),
    correct: Correct | None = None,
    most_steps: int = MOST_STEPS,
) -> Solution:
    """The states of y' = f(t, y) at wanted instants.

    Steps never cross a breakpoint, and on each side the right-hand side is asked only for instants of that side: one
    at the breakpoint itself is moved to just before it while coming from the left. So a right-hand side that jumps
    there, and has its new value from there on, is never seen on the wrong side by any stage of any method.

    Args:
        rates: f(t, y) [per s].
        start: State at the first instant [its own units], (m,).
        times: Wanted instants, rising [s], (N,), N >= 2.
        breakpoints: Where f or its derivatives jump [s].
        correct: Called with (t, y) after each step; gives the state to go on from, or None to leave it.
        most_steps: Stop after so many [-].

    Raises:
        InputError: Times that do not rise, a start that is no finite vector, breakpoints that are no numbers, a solver
            that is none.
    """
    if not isinstance(solver, Solver):
        problem = "must be a solver, such as RungeKutta4(0.001) or DormandPrince853()"
        raise InputError(Fault("solver", problem, solver))
    wanted, state = wanted_and_start(times, start)
    if isinstance(solver, Rodas4):
        return _by_compiled_loop(solver, rates, state, wanted, breakpoints, correct, most_steps)
    inner = inner_points(breakpoints, wanted[0], wanted[-1])
    work, rows = Work(), [state]
    ends = [*inner, float(wanted[-1])]
    t = float(wanted[0])
    for end in ends:
        stepper = solver.start(_pinned(rates, end, last=end == ends[-1]), t, state, end, work)
        try:
            # A state that runs away is found after the step, and told.
            with np.errstate(over="ignore", invalid="ignore"):
                stopped = _run(stepper, wanted, rows, correct, most_steps)
        except SolverStopped as stop:
            stopped = str(stop)
        if stopped:
            bad = np.flatnonzero(~np.isfinite(stepper.y))
            culprit = int(bad[0]) if len(bad) else None
            return Solution(wanted[: len(rows)], np.array(rows), work, stopped, stepper.t, culprit)
        t, state = end, stepper.y
    return Solution(wanted, np.array(rows), work, stopped_at=t)


def _by_compiled_loop(
    solver: Rodas4,
    rates: Rates,
    start: Array,
    times: Array,
    breakpoints: Sequence[float],
    correct: Correct | None,
    most_steps: int,
) -> Solution:
    """The compiled loop asks a right-hand side in Python."""
    if correct is not None:
        hint = "take one such as RungeKutta4(0.001) or DormandPrince853()"
        raise InputError(Fault("solver", "cannot have its states corrected after each step", solver, hint))
    function, raised = in_c(rates, len(start))
    problem = CompiledProblem(ctypes.cast(function, ctypes.c_void_p).value, len(start))
    found = integrate_compiled(problem, solver, start, times, breakpoints=breakpoints, most_steps=most_steps)
    if raised:
        raise raised[0]
    culprit = found.culprit if found.stopped else None
    return Solution(found.times, found.states, found.work, found.stopped, found.stopped_at, culprit)


def _run(stepper: Stepper, wanted: Array, rows: list[Array], correct: Correct | None, most_steps: int) -> str:
    """Step to the end of a segment, and put the states at the wanted instants into the rows; why it stopped, if so."""
    while stepper.t < stepper.end:
        if stepper.work.steps >= most_steps:
            return f"{most_steps} steps taken; allow a longer step or a looser tolerance"
        stepper.step()
        if not np.isfinite(stepper.y).all():
            return "the state is no number any more: it diverges; try a shorter step"
        slack = 1e-12 * max(1.0, abs(stepper.t))  # an instant may miss the end of a step by rounding
        while len(rows) < len(wanted) and wanted[len(rows)] < stepper.t - slack:
            rows.append(stepper.within(float(wanted[len(rows)])))
        corrected = correct(stepper.t, stepper.y) if correct else None
        if corrected is not None:
            stepper.resume(corrected)
        while len(rows) < len(wanted) and wanted[len(rows)] <= stepper.t + slack:
            rows.append(stepper.y)
    return ""


def _pinned(rates: Rates, end: float, last: bool) -> Rates:
    """The right-hand side as seen from the left of the end of a segment."""
    if last:
        return rates
    before = math.nextafter(end, -math.inf)

    def seen(t: float, y: Array) -> Array:
        return rates(t if t < end else before, y)

    return seen
