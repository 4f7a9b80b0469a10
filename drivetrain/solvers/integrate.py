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
from drivetrain.solvers.solver import (
    MOST_STEPS,
    Adaptive,
    DormandPrince853,
    FixedStep,
    Solver,
    Work,
    inner_points,
    wanted_and_start,
)

Rates = Callable[[float, Array], Array]
Correct = Callable[[float, Array], Array | None]
MOST_FIXED_STEPS = 1e9  # from one breakpoint to the next


@dataclass(frozen=True, eq=False)
class Solution:
    """States at the wanted instants, as far as the solver came."""

    times: Array  # instants [s], (N,), those wanted, fewer if it stopped early
    states: Array  # one row an instant [their own units], (N, m)
    work: Work  # what it cost
    stopped: str = ""  # why it ended early, with what could help; empty when it did not
    stopped_at: float = math.inf  # when [s]; the end of the wanted instants when it did not
    culprit: int | None = None  # index of the state that was no number any more; None when that was not the reason


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
    """
    if not isinstance(solver, Solver):
        problem = "must be a solver, such as RungeKutta4(0.001) or DormandPrince853()"
        raise InputError(Fault("solver", problem, solver))
    wanted, state = wanted_and_start(times, start)
    if not isinstance(solver, FixedStep | DormandPrince853):
        return _by_compiled_loop(solver, rates, state, wanted, breakpoints, correct, most_steps)
    work, rows, t = Work(), [state], float(wanted[0])
    ends = [*inner_points(breakpoints, wanted[0], wanted[-1]), float(wanted[-1])]
    for end in ends:
        seen = _counted(rates, work, math.inf if end == ends[-1] else math.nextafter(end, -math.inf))
        # A state that runs away is found after the step, and reported.
        with np.errstate(over="ignore", invalid="ignore"):
            kind = _FixedStepper if isinstance(solver, FixedStep) else _ScipyStepper
            stepper: _FixedStepper | _ScipyStepper = kind(solver, seen, t, state, end)  # type: ignore[arg-type]
            stopped = _run(stepper, work, wanted, rows, correct, most_steps)
        if stopped:
            bad = np.flatnonzero(~np.isfinite(stepper.y))
            culprit = int(bad[0]) if len(bad) else None
            return Solution(wanted[: len(rows)], np.array(rows), work, stopped, stepper.t, culprit)
        t, state = end, stepper.y
    return Solution(wanted, np.array(rows), work, stopped_at=t)


def _counted(rates: Rates, work: Work, last: float) -> Rates:
    """The right-hand side, counted, that sees no later instant than the last."""

    def seen(t: float, y: Array) -> Array:
        work.rates += 1
        return rates(min(t, last), y)

    return seen


def _by_compiled_loop(
    solver: Solver,
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
    with np.errstate(over="ignore", invalid="ignore"):
        found = integrate_compiled(problem, solver, start, times, breakpoints=breakpoints, most_steps=most_steps)
    if raised:
        raise raised[0]
    culprit = found.culprit if found.stopped else None
    return Solution(found.times, found.states, found.work, found.stopped, found.stopped_at, culprit)


def _run(
    stepper: _FixedStepper | _ScipyStepper, work: Work, wanted: Array, rows: list[Array], correct: Correct | None,
    most_steps: int,
) -> str:  # fmt: skip
    """Step to the end of a segment, and put the states at the wanted instants into the rows; why it stopped, if so."""
    while stepper.t < stepper.end:
        if work.steps >= most_steps:
            return f"{most_steps} steps taken; allow a longer step or a looser tolerance"
        stopped = stepper.step()
        if stopped:
            return stopped
        work.steps += 1
        if not np.isfinite(stepper.y).all():
            return "the state is no number any more: it diverges; try a shorter step"
        slack = 1e-12 * max(1.0, abs(stepper.t))  # an instant may miss the end of a step by rounding
        while len(rows) < len(wanted) and wanted[len(rows)] < stepper.t - slack:
            rows.append(stepper.within(float(wanted[len(rows)])))
        corrected = correct(stepper.t, stepper.y) if correct else None
        if corrected is not None:
            work.restarts += 1
            stepper.resume(corrected)
        while len(rows) < len(wanted) and wanted[len(rows)] <= stepper.t + slack:
            rows.append(stepper.y)
    return ""


class _FixedStepper:
    """Steps of equal length; only the last may be shorter, so that it ends where it should."""

    def __init__(self, method: FixedStep, rates: Rates, t: float, y: Array, end: float):
        length, step = end - t, method.step
        if length / step > MOST_FIXED_STEPS:
            problem = f"needs {length / step:.3g} steps for {length:g} s, more than {MOST_FIXED_STEPS:g} [s]"
            raise InputError(Fault("step", problem, step))
        self.t, self.y, self.end = t, y, end
        self._method, self._rates, self._start = method, rates, t
        self._count, self._total = 0, max(1, math.ceil(length / step * (1.0 - 1e-12)))
        self._before, self._from = t, y
        self._first = self._slope = None  # type: Any  # at the beginning of the step and at its end, once it is known

    def step(self) -> str:
        self._count += 1
        # Multiples of the step, not sums: a million additions lose five digits of the time.
        later = self.end if self._count >= self._total else self._start + self._count * self._method.step
        self._before, self._from = self.t, self.y
        self._first = self._rates(self.t, self.y) if self._slope is None else self._slope
        self.y = self._method.advance(self._rates, self.t, self.y, self._first, later - self.t)
        self.t, self._slope = later, None
        return ""

    def within(self, t: float) -> Array:
        h, rise = self.t - self._before, self.y - self._from
        s = (t - self._before) / h
        if s > 1.0 - 1e-9:  # but for rounding the end
            return self.y
        line = self._from + s * rise
        if not self._method.cubic:
            return line
        if self._slope is None:
            self._slope = self._rates(self.t, self.y)  # the next step begins with it
        ends = (1.0 - s) * (h * self._first - rise) - s * (h * self._slope - rise)
        return np.asarray(line + s * (1.0 - s) * ends)

    def resume(self, y: Array) -> None:
        self.y, self._slope = y, None


class _ScipyStepper:
    """Steps of scipy's DOP853."""

    def __init__(self, settings: Adaptive, rates: Rates, t: float, y: Array, end: float):
        self.t, self.y, self.end = t, y, end
        self._settings, self._rates = settings, rates
        self._inner, self._curve = self._begin(None), None  # type: Any, Any

    def _begin(self, first_step: float | None) -> Any:
        from scipy.integrate import DOP853  # takes long to import, and few runs use it

        own = self._settings
        longest = math.inf if own.largest_step is None else own.largest_step
        return DOP853(
            self._rates, self.t, self.y, self.end, max_step=longest, rtol=own.rtol, atol=own.atol, first_step=first_step
        )

    def step(self) -> str:
        message = self._inner.step()
        if self._inner.status == "failed":
            hint = "loosen rtol and atol, or look for a jump in the right-hand side: jumps belong into breakpoints"
            return f"{message or 'the step became too short'}; {hint}"
        self.t, self.y, self._curve = float(self._inner.t), self._inner.y.copy(), None
        return ""

    def within(self, t: float) -> Array:
        if self._curve is None:
            self._curve = self._inner.dense_output()
        return np.asarray(self._curve(t))

    def resume(self, y: Array) -> None:
        self.y = y
        if self.t < self.end:
            self._inner = self._begin(min(float(self._inner.step_size), self.end - self.t))
