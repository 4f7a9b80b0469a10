"""Explicit methods of a fixed step: Euler's, its semi-implicit sister, and the classical Runge-Kutta method.

None of them controls its error: halve the step and see. Between the ends of a step Euler's methods draw a straight
line, Runge-Kutta a cubic with the right slopes.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import tableaux
from drivetrain.solvers.solver import CompiledSettings, Rates, Solver, Stepper, Work, check_positive

MOST_STEPS = 1e9  # from one breakpoint to the next


class FixedStepper(Stepper):
    """Steps of equal length; only the last may be shorter, so that it ends where it should."""

    def __init__(self, rates: Rates, t: float, y: Array, end: float, work: Work, step: float):
        super().__init__(rates, t, y, end, work)
        if (end - t) / step > MOST_STEPS:
            problem = f"needs {(end - t) / step:.3g} steps for {end - t:g} s, more than {MOST_STEPS:g} [s]"
            raise InputError(Fault("step", problem, step))
        self._start, self._step = t, step
        self._count, self._total = 0, max(1, math.ceil((end - t) / step * (1.0 - 1e-12)))
        self._before, self._from = t, y
        self._slope: Array | None = None  # at (t, y), once it is known

    def step(self) -> None:
        self._count += 1
        # Multiples of the step, not sums: a million additions lose five digits of the time.
        later = self.end if self._count >= self._total else self._start + self._count * self._step
        self._before, self._from = self.t, self.y
        self.y = self._advance(self.t, self.y, later - self.t)
        self.t = later
        self.work.steps += 1

    @abstractmethod
    def _advance(self, t: float, y: Array, h: float) -> Array:
        """The state a step later."""

    def within(self, t: float) -> Array:
        share = self._share(t)
        return self.y if share == 1.0 else self._from + share * (self.y - self._from)

    def resume(self, y: Array) -> None:
        self.y, self._slope = y, None
        self.work.restarts += 1

    def _share(self, t: float) -> float:
        """How far into the last step, 1 at its end; what is there but for rounding is at its end."""
        share = (t - self._before) / (self.t - self._before)
        return 1.0 if share > 1.0 - 1e-9 else share


class _EulerStepper(FixedStepper):
    def _advance(self, t: float, y: Array, h: float) -> Array:
        return y + h * self.rates(t, y)


class _SemiImplicitStepper(FixedStepper):
    def _advance(self, t: float, y: Array, h: float) -> Array:
        half = len(y) // 2
        result = y + h * self.rates(t, y)
        result[:half] = y[:half] + h * result[half : 2 * half]
        return result


class _RungeKuttaStepper(FixedStepper):
    def _advance(self, t: float, y: Array, h: float) -> Array:
        first = self._first = self.rates(t, y) if self._slope is None else self._slope
        second = self.rates(t + 0.5 * h, y + 0.5 * h * first)
        third = self.rates(t + 0.5 * h, y + 0.5 * h * second)
        fourth = self.rates(t + h, y + h * third)
        self._slope = None
        return y + h / 6.0 * (first + 2.0 * (second + third) + fourth)

    def within(self, t: float) -> Array:
        s = self._share(t)
        if s == 1.0:
            return self.y
        if self._slope is None:
            self._slope = self.rates(self.t, self.y)  # the next step begins with it
        h, rise = self.t - self._before, self.y - self._from
        ends = (1.0 - s) * (h * self._first - rise) - s * (h * self._slope - rise)
        return np.asarray(self._from + s * rise + s * (1.0 - s) * ends)


@dataclass(frozen=True)
class _FixedStep(Solver):
    step: float

    def __post_init__(self) -> None:
        check_positive(f"{type(self).__name__}.step", self.step, "s")


@dataclass(frozen=True)
class Euler(_FixedStep):
    """Euler's method, the book's: first order, gains energy in swinging motions. One evaluation a step.

    Attributes:
        step: [s].

    Reference: Modern Robotics, section 8.5, Euler integration algorithm.
    """

    def start(self, rates: Rates, t: float, y: Array, end: float, work: Work) -> Stepper:
        return _EulerStepper(rates, t, y, end, work, self.step)

    def compiled_settings(self, size: int) -> CompiledSettings:
        return tableaux.EULER, np.ones(size), {"rtol": 1.0, "fixed_step": self.step}


@dataclass(frozen=True)
class SemiImplicitEuler(_FixedStep):
    """Euler's method with positions that follow the new speeds: first order, but energy stays bounded in swings.

    The state must be positions, then as many speeds; an odd number after them is stepped as by Euler. One evaluation a
    step.

    Attributes:
        step: [s].
    """

    def start(self, rates: Rates, t: float, y: Array, end: float, work: Work) -> Stepper:
        return _SemiImplicitStepper(rates, t, y, end, work, self.step)


@dataclass(frozen=True)
class RungeKutta4(_FixedStep):
    """The classical Runge-Kutta method: fourth order, four evaluations a step.

    Attributes:
        step: [s].

    Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), table II.1.2.
    """

    def start(self, rates: Rates, t: float, y: Array, end: float, work: Work) -> Stepper:
        return _RungeKuttaStepper(rates, t, y, end, work, self.step)

    def compiled_settings(self, size: int) -> CompiledSettings:
        return tableaux.RUNGE_KUTTA, np.ones(size), {"rtol": 1.0, "fixed_step": self.step}
