"""RODAS, an adaptive L-stable method of order 4 for stiff equations: the method for accuracy.

It solves linear systems only, so a step has a fixed price and no iteration to fail; the price of that is an exact
Jacobian at each step. Given a compiled right-hand side it runs compiled (``integrate_compiled``); given one in Python
it steps here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import rodas4_table as r
from drivetrain.solvers import rodas5p_table as p
from drivetrain.solvers.adaptive import SMALLEST_RTOL
from drivetrain.solvers.layout import RODAS4, RODAS5P
from drivetrain.solvers.solver import Rates, Solver, SolverStopped, Stepper, Work, check_positive

_SMALL = math.sqrt(float(np.finfo(np.float64).eps))
SAFETY, GROW, CAREFUL = 0.85, 6.0, 2.0  # as of ``step_control.py``


class _Table(NamedTuple):
    """A method: rows of stages 2 on, the last two starting from what the one before ended with; rows of its curve."""

    method: int
    order: int
    gamma: float
    a: tuple[tuple[float, ...], ...]
    c: tuple[tuple[float, ...], ...]
    alpha: tuple[float, ...]
    gammas: tuple[float, ...]
    d: tuple[tuple[float, ...], ...]


_LAST4 = (r.A51, r.A52, r.A53, r.A54)
_FOURTH = _Table(
    RODAS4, 4, r.GAMMA,
    ((r.A21,), (r.A31, r.A32), (r.A41, r.A42, r.A43), _LAST4, (*_LAST4, 1.0)),
    ((r.C21,), (r.C31, r.C32), (r.C41, r.C42, r.C43), (r.C51, r.C52, r.C53, r.C54),
     (r.C61, r.C62, r.C63, r.C64, r.C65)),
    (r.ALPHA2, r.ALPHA3, r.ALPHA4, 1.0, 1.0), (r.GAMMA1, r.GAMMA2, r.GAMMA3, r.GAMMA4, 0.0, 0.0),
    ((r.D11, r.D12, r.D13, r.D14, r.D15, 0.0), (r.D21, r.D22, r.D23, r.D24, r.D25, 0.0)),
)  # fmt: skip
_FIFTH = _Table(RODAS5P, 5, p.GAMMA, (*p.A, (*p.A[4], 1.0), (*p.A[4], 1.0, 1.0)), p.C, p.ALPHA, p.GAMMAS, p.D)


@dataclass(frozen=True)
class Rodas4(Solver):
    """RODAS: order 4 with a check of order 3, L-stable; for stiff equations that do not jump between breakpoints.

    Attributes:
        rtol: Error allowed in a step, as a share of each state [-].
        atol: Error allowed in a step where a state is near zero [the state's own unit]; one number, or one a state.
            Infinity leaves a state out of the control. None: a thousandth of ``rtol``, and in a simulation what each
            state says does not matter.
        largest_step: [s]; None: as long as the tolerance allows. What happens within one step and leaves no trace at
            its stages is not seen.
        smallest_step: Shorter ones stop the run [s]; 0: the resolution of the time itself.
        first_step: To begin with [s]; None: chosen from the rates.

    Reference: Hairer, Wanner, Solving Ordinary Differential Equations II (1996), section IV.7.
    """

    rtol: float = 1e-6
    atol: float | tuple[float, ...] | None = None
    largest_step: float | None = None
    smallest_step: float = 0.0
    first_step: float | None = None

    _table: ClassVar[_Table] = _FOURTH

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_positive(f"{name}.rtol", self.rtol, "-")
        if self.rtol < SMALLEST_RTOL:
            problem = f"is below what double precision can hold, {SMALLEST_RTOL:.2g}"
            raise InputError(Fault(f"{name}.rtol", problem, self.rtol))
        several = isinstance(self.atol, list | tuple | np.ndarray)
        for value in () if self.atol is None else np.ravel(np.asarray(self.atol, dtype=object)):
            if not (several and isinstance(value, float) and value == math.inf):
                check_positive(f"{name}.atol", value, "unit of the state")
        if several:
            object.__setattr__(self, "atol", tuple(float(value) for value in np.ravel(np.asarray(self.atol))))
        for field in ("largest_step", "first_step"):
            if getattr(self, field) is not None:
                check_positive(f"{name}.{field}", getattr(self, field), "s")
        if self.smallest_step != 0.0:
            check_positive(f"{name}.smallest_step", self.smallest_step, "s")

    def tolerances(self, size: int) -> Array:
        """The absolute tolerance of each state.

        Args:
            size: Number of states.

        Returns:
            [the states' own units], (size,).

        Raises:
            InputError: There are tolerances for another number of states.
        """
        if isinstance(self.atol, tuple) and len(self.atol) != size:
            name = type(self).__name__
            raise InputError(Fault(f"{name}.atol", f"must be one number, or {size}, one a state", self.atol))
        return np.full(size, 1.0) * np.asarray(1e-3 * self.rtol if self.atol is None else self.atol)

    def compiled_settings(self, size: int) -> tuple[int, Array, Array]:
        """What the compiled loop needs to know.

        Args:
            size: Number of states.

        Returns:
            Method, atol a state, settings; see ``layout``.
        """
        largest = math.inf if self.largest_step is None else self.largest_step
        settings = [self.rtol, largest, self.smallest_step, self.first_step or 0.0, 0.0, 0.0]
        return self._table.method, self.tolerances(size), np.array(settings)

    def start(self, rates: Rates, t: float, y: Array, end: float, work: Work) -> Stepper:
        return _RodasStepper(self, rates, t, y, end, work)


@dataclass(frozen=True)
class Rodas5P(Rodas4):
    """RODAS5P: order 5 with a check of order 4, L-stable; settings as of ``Rodas4``, eight stages instead of six.

    Reference: Steinebach, BIT Numerical Mathematics 63 (2023) 27.
    """

    _table: ClassVar[_Table] = _FIFTH


class _RodasStepper(Stepper):
    def __init__(self, settings: Rodas4, rates: Rates, t: float, y: Array, end: float, work: Work):
        super().__init__(rates, t, y, end, work)
        self._settings, self._atol, self._table = settings, settings.tolerances(len(y)), settings._table
        self._h = settings.first_step or 0.0
        self._last: tuple[float, float] | None = None  # step and error of the one before
        self._from, self._before, self._curve = y, t, np.zeros((4, len(y)))

    def step(self) -> None:
        """One step further.

        Raises:
            SolverStopped: No step is short enough, or the rates are no numbers.
        """
        rates = self.rates(self.t, self.y)
        if not np.isfinite(rates).all():
            culprit = int(np.flatnonzero(~np.isfinite(rates))[0])
            raise SolverStopped(f"the rate of state {culprit} is no number at {self.t:.9g} s")
        if not self._h:
            self._h = self._first(rates)
        jacobian, drift, refused = None, None, False
        while True:
            h = self._choose()
            if jacobian is None or drift is None:
                jacobian, drift = self._derivatives(rates, h)
            later, error, curve = self._try(h, rates, jacobian, drift)
            if error <= 1.0:
                break
            refused = True
            self._shorten(h, error)
        self._grow(h, error, refused)
        self._from, self._before, self._curve = self.y, self.t, curve
        self.t, self.y = (self.end if h == self.end - self.t else self.t + h), later
        self.work.steps += 1

    def within(self, t: float) -> Array:
        if t == self.t:
            return self.y
        s = (t - self._before) / (self.t - self._before)
        a, b, c, d = self._curve
        return np.asarray(self._from + s * (a + s * (b + s * (c + s * d))))

    def resume(self, y: Array) -> None:
        self.y = y
        self.work.restarts += 1

    def _scale(self, other: Array) -> Array:
        return np.asarray(self._atol + self._settings.rtol * np.maximum(np.abs(self.y), np.abs(other)))

    def _first(self, rates: Array) -> float:
        scale, span = self._scale(self.y), self.end - self.t
        state, slope = float(np.max(np.abs(self.y) / scale)), float(np.max(np.abs(rates) / scale))
        h = 1e-6 if state < 1e-5 or slope < 1e-5 else 0.01 * state / slope
        h = min(h, span, self._settings.largest_step or math.inf)
        curve = float(np.max(np.abs(self.rates(self.t + h, self.y + h * rates) - rates) / scale)) / h
        steepest = max(slope, curve)
        return min(100.0 * h, max(1e-6, 1e-3 * h) if not 1e-15 < steepest < math.inf else (0.01 / steepest) ** 0.25)

    def _choose(self) -> float:
        h, left = min(self._h, self._settings.largest_step or math.inf), self.end - self.t
        if 1.1 * h >= left:
            return left
        return 0.5 * left if 2.0 * h > left else h

    def _derivatives(self, rates: Array, h: float) -> tuple[Array, Array]:
        floor = self._atol / self._settings.rtol
        size = np.maximum(np.maximum(np.abs(self.y), h * np.abs(rates)), np.where(np.isinf(floor), 1e-3, floor))
        moves = (self.y + np.where(rates >= 0.0, _SMALL, -_SMALL) * size) - self.y
        later = self.t + min(h, _SMALL * max(abs(self.t), h))
        drift = (self.rates(later, self.y) - rates) / (later - self.t)
        jacobian = np.empty((len(rates), len(rates)))
        for j, move in enumerate(moves):
            moved = self.y.copy()
            moved[j] += move
            jacobian[:, j] = (self.rates(self.t, moved) - rates) / move
        self.work.jacobians += 1
        return jacobian, drift

    def _try(self, h: float, rates: Array, jacobian: Array, drift: Array) -> tuple[Array, float, Array]:
        """The state a step later, its error in units of what is allowed, and the curve to it."""
        n, table = len(rates), self._table
        self.work.factorisations += 1
        matrix = np.eye(n) / (h * table.gamma) - jacobian
        nowhere = self.y, math.inf, self._curve
        if not np.isfinite(matrix).all():
            return nowhere
        factors = lu_factor(matrix, check_finite=False)
        u = np.zeros((len(table.a) + 1, n))
        u[0] = lu_solve(factors, rates + h * table.gammas[0] * drift, check_finite=False)
        for i in range(len(table.a)):
            stage = self.y + np.asarray(table.a[i]) @ u[: i + 1]
            right = self.rates(min(self.t + table.alpha[i] * h, self.end), stage)
            right = right + np.asarray(table.c[i]) @ u[: i + 1] / h
            u[i + 1] = lu_solve(factors, right + h * table.gammas[i + 1] * drift, check_finite=False)
        later = stage + u[-1]
        if not np.isfinite(later).all():
            return nowhere
        bends = np.zeros((4, n))
        bends[: len(table.d)] = np.asarray(table.d) @ u
        error = float(np.max(np.abs(u[-1]) / self._scale(later)))
        rise = np.array([later - self.y, *np.zeros((3, n))])
        return later, error, rise + bends - np.array([np.zeros(n), *bends[:3]])

    def _shorten(self, h: float, error: float) -> None:
        self.work.rejected += 1
        self._h = h * (max(0.1, SAFETY * error**-0.25) if error < math.inf else 0.1)
        if self._h < max(self._settings.smallest_step, 1e-15 * abs(self.t), 1e-300):
            hint = "loosen rtol and atol, or look for a jump in the right-hand side: jumps belong into breakpoints"
            raise SolverStopped(f"no step is short enough at {self.t:.9g} s; {hint}")

    def _grow(self, h: float, error: float, refused: bool) -> None:
        power, small = 1.0 / self._table.order, max(error, 1e-10)
        factor = SAFETY * small**-power
        if self._last:
            factor = min(factor, SAFETY * (h / self._last[0]) * (self._last[1] / small**2) ** power)
        factor = min(max(factor, 0.2), CAREFUL if refused else GROW)
        self._h = max(self._h, h * factor) if h < self._h and factor >= 1.0 else h * factor
        self._last = h, max(error, 1e-2)
