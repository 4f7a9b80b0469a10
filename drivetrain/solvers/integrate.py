"""Integration of a right-hand side written in Python: output times, breakpoints, corrections after a step, failures."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers.compiled_function import as_c_function
from drivetrain.solvers.compiled_problem import CompiledProblem
from drivetrain.solvers.integrate_compiled import integrate_compiled
from drivetrain.solvers.solver import (
    MOST_STEPS,
    Adaptive,
    DormandPrince853,
    FixedStep,
    Solution,
    Solver,
    Work,
    checked_times_and_start,
    inner_breakpoints,
)

Rates = Callable[[float, Array], Array]
Correct = Callable[[float, Array], Array | None]
MOST_FIXED_STEPS = 1e9  # from one breakpoint to the next


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
    """The states at the output times [s], of y' = f(t, y) from ``start`` (m,), with counters and why it stopped early.

    No step crosses a breakpoint [s], at which f is discontinuous, and on each side f is evaluated only at times of that
    side: an evaluation at the breakpoint itself is moved to just before it while the step before it is computed.
    ``correct`` is called after each step with (t, y) and returns the corrected state, or None.
    """
    if not isinstance(solver, Solver):
        problem = "must be a solver, such as RungeKutta4(0.001) or DormandPrince853()"
        raise InputError(Fault("solver", problem, solver))
    output_times, state = checked_times_and_start(times, start)
    if not isinstance(solver, FixedStep | DormandPrince853):
        return _by_compiled_loop(solver, rates, state, output_times, breakpoints, correct, most_steps)
    work, rows, t = Work(), [state], float(output_times[0])
    ends = [*inner_breakpoints(breakpoints, output_times[0], output_times[-1]), float(output_times[-1])]
    for end in ends:
        seen = _counted(rates, work, math.inf if end == ends[-1] else math.nextafter(end, -math.inf))
        # A state that overflows is detected after the step, and reported.
        with np.errstate(over="ignore", invalid="ignore"):
            kind = _FixedStepper if isinstance(solver, FixedStep) else _ScipyStepper
            stepper: _FixedStepper | _ScipyStepper = kind(solver, seen, t, state, end)  # type: ignore[arg-type]
            stopped = _run(stepper, work, output_times, rows, correct, most_steps)
        if stopped:
            bad = np.flatnonzero(~np.isfinite(stepper.y))
            fault_index = int(bad[0]) if len(bad) else None
            return Solution(output_times[: len(rows)], np.array(rows), work, stopped, stepper.t, fault_index)
        t, state = end, stepper.y
    return Solution(output_times, np.array(rows), work, "", t, None)


def _counted(rates: Rates, work: Work, last: float) -> Rates:
    """The right-hand side with a counter; times are limited to ``last`` [s], the end of the segment."""

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
    """Integrate with the compiled loop, which calls the Python right-hand side through ctypes."""
    if correct is not None:
        hint = "take one such as RungeKutta4(0.001) or DormandPrince853()"
        raise InputError(Fault("solver", "cannot have its states corrected after each step", solver, hint))
    function, raised = as_c_function(rates, len(start))
    problem = CompiledProblem(ctypes.cast(function, ctypes.c_void_p).value, len(start))
    with np.errstate(over="ignore", invalid="ignore"):
        found = integrate_compiled(problem, solver, start, times, breakpoints=breakpoints, most_steps=most_steps)
    if raised:
        raise raised[0]
    return found


def _run(
    stepper: _FixedStepper | _ScipyStepper, work: Work, output_times: Array, rows: list[Array], correct: Correct | None,
    most_steps: int,
) -> str:  # fmt: skip
    """Step to the end of a segment and append the states at the output times to ``rows``.

    Returns the reason if the integration must stop, else an empty string.
    """
    while stepper.t < stepper.end:
        if work.steps >= most_steps:
            return f"{most_steps} steps taken; allow a longer step or a looser tolerance"
        stopped = stepper.step()
        if stopped:
            return stopped
        work.steps += 1
        if not np.isfinite(stepper.y).all():
            return "the state is no longer finite: it diverges; try a shorter step"
        slack = 1e-12 * max(1.0, abs(stepper.t))  # an output time may differ from the end of a step by rounding
        while len(rows) < len(output_times) and output_times[len(rows)] < stepper.t - slack:
            rows.append(stepper.dense_output(float(output_times[len(rows)])))
        corrected = correct(stepper.t, stepper.y) if correct else None
        if corrected is not None:
            work.restarts += 1
            stepper.resume(corrected)
        while len(rows) < len(output_times) and output_times[len(rows)] <= stepper.t + slack:
            rows.append(stepper.y)
    return ""


class _FixedStepper:
    """Steps of equal length in one segment; only the last is shorter, to end at the end of the segment."""

    def __init__(self, method: FixedStep, rates: Rates, t: float, y: Array, end: float):
        length, step = end - t, method.step
        if length / step > MOST_FIXED_STEPS:
            problem = f"needs {length / step:.3g} steps for {length:g} s, more than {MOST_FIXED_STEPS:g} [s]"
            raise InputError(Fault("step", problem, step))
        self.t, self.y, self.end = t, y, end
        self._method, self._rates, self._start = method, rates, t
        self._count, self._total = 0, max(1, math.ceil(length / step * (1.0 - 1e-12)))
        self._before, self._from = t, y
        self._first = self._slope = None  # type: Any  # rates at the beginning of the step, and at its end once known

    def step(self) -> str:
        """Take one step; returns an empty string, since a fixed step cannot fail."""
        self._count += 1
        # Times are multiples of the step, not sums: a million additions would lose five digits.
        reached = self.end if self._count >= self._total else self._start + self._count * self._method.step
        self._before, self._from = self.t, self.y
        self._first = self._rates(self.t, self.y) if self._slope is None else self._slope
        self.y = self._method.advance(self._rates, self.t, self.y, self._first, reached - self.t)
        self.t, self._slope = reached, None
        return ""

    def dense_output(self, t: float) -> Array:
        """Dense output: the state at a time within the last step, cubic or linear, (m,)."""
        h, rise = self.t - self._before, self.y - self._from
        s = (t - self._before) / h
        if s > 1.0 - 1e-9:  # the end of the step, apart from rounding
            return self.y
        line = self._from + s * rise
        if not self._method.cubic:
            return line
        if self._slope is None:
            self._slope = self._rates(self.t, self.y)  # also the first stage of the next step
        ends = (1.0 - s) * (h * self._first - rise) - s * (h * self._slope - rise)
        return np.asarray(line + s * (1.0 - s) * ends)

    def resume(self, y: Array) -> None:
        """Continue from a corrected state; the rates at the end of the step are no longer valid."""
        self.y, self._slope = y, None


class _ScipyStepper:
    """Adaptive steps of scipy's DOP853 in one segment; same interface as ``_FixedStepper``."""

    def __init__(self, settings: Adaptive, rates: Rates, t: float, y: Array, end: float):
        self.t, self.y, self.end = t, y, end
        self._settings, self._rates = settings, rates
        self._inner, self._curve = self._begin(None), None  # type: Any, Any

    def _begin(self, first_step: float | None) -> Any:
        """A new integrator from the present time and state."""
        from scipy.integrate import DOP853  # takes long to import, and few runs use it

        own = self._settings
        longest = math.inf if own.largest_step is None else own.largest_step
        return DOP853(
            self._rates, self.t, self.y, self.end, max_step=longest, rtol=own.rtol, atol=own.atol, first_step=first_step
        )

    def step(self) -> str:
        """Take one step; returns the reason if it fails, else an empty string."""
        message = self._inner.step()
        if self._inner.status == "failed":
            hint = "loosen rtol and atol, or look for a jump in the right-hand side: jumps belong into breakpoints"
            return f"{message or 'the step became too short'}; {hint}"
        self.t, self.y, self._curve = float(self._inner.t), self._inner.y.copy(), None
        return ""

    def dense_output(self, t: float) -> Array:
        """Dense output: the state at a time within the last step, (m,)."""
        if self._curve is None:
            self._curve = self._inner.dense_output()
        return np.asarray(self._curve(t))

    def resume(self, y: Array) -> None:
        """Continue from a corrected state, with the step length reached so far."""
        self.y = y
        if self.t < self.end:
            self._inner = self._begin(min(float(self._inner.step_size), self.end - self.t))
