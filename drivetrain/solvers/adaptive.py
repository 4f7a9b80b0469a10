"""Methods that choose their own step to hold a tolerance: those of scipy, behind the common interface."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import DOP853, LSODA, RK45, Radau

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import tableaux
from drivetrain.solvers.solver import CompiledSettings, Rates, Solver, SolverStopped, Stepper, Work, check_positive

SMALLEST_RTOL = 100.0 * float(np.finfo(np.float64).eps)  # below this scipy raises it, with a warning


class _ScipyStepper(Stepper):
    def __init__(self, method: Any, settings: Adaptive, rates: Rates, t: float, y: Array, end: float, work: Work):
        super().__init__(rates, t, y, end, work)
        self._method, self._settings = method, settings
        self._inner = self._begin(y, None)
        self._curve: Any = None

    def _begin(self, y: Array, first_step: float | None) -> Any:
        options = self._settings
        first = None if first_step is None else min(first_step, self.end - self.t)
        return self._method(
            self.rates,
            self.t,
            y,
            self.end,
            max_step=np.inf if options.largest_step is None else options.largest_step,
            rtol=options.rtol,
            atol=options.atol,
            first_step=first,
        )

    def step(self) -> None:
        message = self._inner.step()
        if self._inner.status == "failed":
            hint = "loosen rtol and atol, or look for a jump in the right-hand side: jumps belong into breakpoints"
            raise SolverStopped(f"{message or 'the step became too short'}; {hint}")
        self.t, self.y, self._curve = float(self._inner.t), self._inner.y.copy(), None
        self.work.steps += 1

    def within(self, t: float) -> Array:
        if t == self.t:
            return self.y
        if self._curve is None:
            self._curve = self._inner.dense_output()
        return np.asarray(self._curve(t))

    def resume(self, y: Array) -> None:
        last = float(self._inner.step_size)
        self.y = y
        self.work.restarts += 1
        if self.t < self.end:
            self._inner = self._begin(y, last)


@dataclass(frozen=True)
class Adaptive(Solver):
    """Base of the methods with step control.

    Attributes:
        rtol: Error allowed in a step, as a share of each state [-].
        atol: Error allowed in a step where a state is near zero [the state's own unit].
        largest_step: [s]; None: as long as the tolerance allows. What happens within one step and leaves no trace at
            its stages is not seen.
    """

    rtol: float = 1e-8
    atol: float = 1e-10
    largest_step: float | None = None

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_positive(f"{name}.rtol", self.rtol, "-")
        check_positive(f"{name}.atol", self.atol, "unit of the state")
        if self.rtol < SMALLEST_RTOL:
            problem = f"is below what double precision can hold, {SMALLEST_RTOL:.2g}"
            raise InputError(Fault(f"{name}.rtol", problem, self.rtol))
        if self.largest_step is not None:
            check_positive(f"{name}.largest_step", self.largest_step, "s")

    @abstractmethod
    def _method(self) -> Any:
        """The class of scipy that steps."""

    def start(self, rates: Rates, t: float, y: Array, end: float, work: Work) -> Stepper:
        return _ScipyStepper(self._method(), self, rates, t, y, end, work)


@dataclass(frozen=True)
class DormandPrince54(Adaptive):
    """Dormand and Prince's explicit method of order 5 with a fourth-order check (scipy's RK45, or compiled)."""

    def _method(self) -> Any:
        return RK45

    def compiled_settings(self, size: int) -> CompiledSettings:
        largest = np.inf if self.largest_step is None else self.largest_step
        return tableaux.DORMAND_PRINCE, np.full(size, self.atol), {"rtol": self.rtol, "largest_step": largest}


@dataclass(frozen=True)
class DormandPrince853(Adaptive):
    """Dormand and Prince's explicit method of order 8, for smooth motions and tight tolerances (scipy's DOP853)."""

    def _method(self) -> Any:
        return DOP853


@dataclass(frozen=True)
class Lsoda(Adaptive):
    """Multistep method that turns implicit where the equations are stiff (scipy's LSODA)."""

    def _method(self) -> Any:
        return LSODA


@dataclass(frozen=True)
class RadauIIA(Adaptive):
    """Implicit Runge-Kutta method of order 5 for stiff equations (scipy's Radau), its Jacobian by differences."""

    def _method(self) -> Any:
        return Radau
