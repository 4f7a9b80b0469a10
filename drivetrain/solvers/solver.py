"""The integration methods and their settings: frozen dataclasses, checked when they are built.

Methods with a tableau run compiled (``integrate_compiled``), the others in Python (``integrate``), some both ways.
Methods with a fixed step do not control their error: compare with a run at half the step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.solvers import tableaux
from drivetrain.solvers.tableaux import Tableau

MOST_STEPS = 100_000_000
SMALLEST_RTOL = 100.0 * float(np.finfo(np.float64).eps)  # scipy replaces a smaller one by this, with a warning
Method = tuple[Tableau, Array, dict[str, float]]  # tableau, absolute tolerances (n,), settings of ``records.RUN``


@dataclass
class Work:
    """Counters of the computing effort of an integration so far."""

    rates: int = 0  # evaluations of the right-hand side [-], exact
    steps: int = 0  # accepted steps [-]
    restarts: int = 0  # how often the state was changed by an event or a correction, so that the method restarted [-]
    rejected: int = 0  # rejected steps [-]; counted by the compiled methods only
    jacobians: int = 0  # Jacobians [-]; the evaluations for their finite differences are in ``rates`` too
    factorisations: int = 0  # matrix factorisations [-]
    event_values: int = 0  # evaluations of the event functions [-]


@dataclass(frozen=True, eq=False)
class Solution:
    """The states at the output times, up to where the solver came."""

    times: Array  # output times [s], (N,); fewer than requested if the solver stopped early
    states: Array  # one row per output time [the states' own units], (N, m)
    work: Work  # counters of the computing effort
    stopped: str  # why the solver stopped early, with advice; empty if it did not
    stopped_at: float  # time at which it stopped [s]; the last output time if it did not stop early
    fault_index: int | None  # index of the state, or of the event, that the reason names; None if it names none


class Solver:
    """An integration method with its settings."""

    def compiled_settings(self, size: int) -> Method:
        """Tableau, absolute tolerances (n,) and settings (``records.RUN``) of the compiled loop for ``size`` states."""
        problem = "must be a solver that runs compiled: Rodas4, Rodas5P, DormandPrince54, RungeKutta4 or Euler"
        raise InputError(Fault("solver", problem, self))


@dataclass(frozen=True)
class FixedStep(Solver):
    """Base of the methods with a fixed step."""

    step: float  # [s]
    cubic: ClassVar[bool] = False  # whether the dense output is a cubic Hermite polynomial, else linear
    tableau: ClassVar[Tableau | None] = None  # None: the method does not run compiled

    def __post_init__(self) -> None:
        check_positive(f"{type(self).__name__}.step", self.step, "s")

    def __str__(self) -> str:
        return f"{type(self).__name__}({self.step:g} s)"

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        """The state at t + h, (m,), from the state y at t and its rates ``first``; h and t in s."""
        raise NotImplementedError

    def compiled_settings(self, size: int) -> Method:
        if self.tableau is None:
            return super().compiled_settings(size)
        return self.tableau, np.ones(size), {"rtol": 1.0, "fixed_step": self.step}


@dataclass(frozen=True)
class Euler(FixedStep):
    """Explicit Euler method: first order, one evaluation per step; oscillations gain energy.

    Attributes:
        step: Time step [s].

    Reference: Modern Robotics, section 8.5, Euler integration algorithm.
    """

    tableau = tableaux.EULER

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        return y + h * first


@dataclass(frozen=True)
class SemiImplicitEuler(FixedStep):
    """Semi-implicit (symplectic) Euler method: first order, but the energy of oscillations stays bounded.

    Positions advance with the new speeds. The state must consist of positions followed by as many speeds; one further
    state after them advances as with Euler's method. One evaluation per step.

    Attributes:
        step: Time step [s].
    """

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        half, result = len(y) // 2, y + h * first
        result[:half] = y[:half] + h * result[half : 2 * half]
        return result


@dataclass(frozen=True)
class RungeKutta4(FixedStep):
    """The classical Runge-Kutta method: fourth order, four evaluations per step.

    Attributes:
        step: Time step [s].

    Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), table II.1.2.
    """

    cubic = True
    tableau = tableaux.RUNGE_KUTTA

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        second = rates(t + 0.5 * h, y + 0.5 * h * first)
        third = rates(t + 0.5 * h, y + 0.5 * h * second)
        fourth = rates(t + h, y + h * third)
        return y + h / 6.0 * (first + 2.0 * (second + third) + fourth)


@dataclass(frozen=True)
class Adaptive(Solver):
    """Base of the methods with step size control."""

    rtol: float = 1e-8  # relative tolerance of the error per step [-]
    atol: Any = 1e-10  # absolute tolerance of the error per step [the state's own unit]
    # [s]; None: as long as the tolerances allow. A pulse of the right-hand side that lies between the stages of a step
    # is missed.
    largest_step: float | None = None

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_positive(f"{name}.rtol", self.rtol, "-")
        if self.rtol < SMALLEST_RTOL:
            problem = f"is below what double precision can hold, {SMALLEST_RTOL:.2g}"
            raise InputError(Fault(f"{name}.rtol", problem, self.rtol))
        self._check_atol(f"{name}.atol")
        if self.largest_step is not None:
            check_positive(f"{name}.largest_step", self.largest_step, "s")

    def _check_atol(self, place: str) -> None:
        check_positive(place, self.atol, "unit of the state")


@dataclass(frozen=True)
class DormandPrince853(Adaptive):
    """Explicit Runge-Kutta method of order 8 (scipy's DOP853), for smooth motions and tight tolerances."""


@dataclass(frozen=True)
class DormandPrince54(Adaptive):
    """Explicit Runge-Kutta method of Dormand and Prince, order 5 with an embedded error estimate of order 4."""

    def compiled_settings(self, size: int) -> Method:
        largest = math.inf if self.largest_step is None else self.largest_step
        return tableaux.dormand_prince(), np.full(size, self.atol), {"rtol": self.rtol, "largest_step": largest}


@dataclass(frozen=True)
class Rodas4(Adaptive):
    """RODAS, a Rosenbrock method of order 4 with an embedded error estimate of order 3, L-stable.

    For stiff equations that are continuous between breakpoints. A step solves linear systems only, so its cost is fixed
    and no iteration can fail to converge; in return it needs an accurate Jacobian in each step.

    Attributes:
        rtol: Relative tolerance of the error per step [-].
        atol: Absolute tolerance of the error per step [the state's own unit]; one number, or one per state. Infinity
            excludes a state from the error control. None: a thousandth of ``rtol``; in a simulation, the absolute
            tolerance that each state declares.
        largest_step: [s]; None: as long as the tolerances allow. A pulse of the right-hand side that lies between the
            stages of one step is missed.
        smallest_step: The run stops if a shorter step is needed [s]; 0: the resolution of the time in floating point.
        first_step: Length of the first step [s]; None: estimated from the rates.

    Reference: Hairer, Wanner, Solving Ordinary Differential Equations II (1996), section IV.7.
    """

    rtol: float = 1e-6
    atol: float | tuple[float, ...] | None = None
    largest_step: float | None = None
    smallest_step: float = 0.0
    first_step: float | None = None
    _tableau: ClassVar[Tableau] = tableaux.RODAS4

    def __post_init__(self) -> None:
        super().__post_init__()
        name = type(self).__name__
        if self.first_step is not None:
            check_positive(f"{name}.first_step", self.first_step, "s")
        if self.smallest_step != 0.0:
            check_positive(f"{name}.smallest_step", self.smallest_step, "s")

    def _check_atol(self, place: str) -> None:
        several = isinstance(self.atol, list | tuple | np.ndarray)
        for value in () if self.atol is None else np.ravel(np.asarray(self.atol, dtype=object)):
            if not (several and isinstance(value, float) and value == math.inf):
                check_positive(place, value, "unit of the state")
        if several:
            object.__setattr__(self, "atol", tuple(float(value) for value in np.ravel(np.asarray(self.atol))))

    def compiled_settings(self, size: int) -> Method:
        if isinstance(self.atol, tuple) and len(self.atol) != size:
            place = f"{type(self).__name__}.atol"
            raise InputError(Fault(place, f"must be one number, or {size}, one a state", self.atol))
        atol = np.full(size, 1e-3 * self.rtol if self.atol is None else self.atol)
        largest = math.inf if self.largest_step is None else self.largest_step
        settings = {"rtol": self.rtol, "largest_step": largest, "smallest_step": self.smallest_step}
        return self._tableau, atol, {**settings, "first_step": self.first_step or 0.0}


@dataclass(frozen=True)
class Rodas5P(Rodas4):
    """RODAS5P, a Rosenbrock method of order 5 with an embedded error estimate of order 4, L-stable.

    Settings are those of ``Rodas4``; a step has eight stages instead of six.

    Reference: Steinebach, BIT Numerical Mathematics 63 (2023) 27.
    """

    _tableau: ClassVar[Tableau] = tableaux.RODAS5P


def check_positive(place: str, value: float, unit: str) -> None:
    """Raise InputError if a setting is not a positive, finite number; ``place`` and ``unit`` go into the message."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not 0.0 < value < float("inf"):
        raise InputError(Fault(place, f"must be a positive number [{unit}]", value))


def checked_times_and_start(times: Any, start: Any) -> tuple[Array, Array]:
    """The output times [s], (N,), and a copy of the initial state, (m,), checked; all faults are reported at once."""
    faults = Faults()
    output_times = faults.attempt(checked_array, times, (None,), "times")
    if output_times is not None and (len(output_times) < 2 or not (np.diff(output_times) > 0.0).all()):
        faults.add("times", "must be at least two instants that rise [s]", output_times[:5].tolist())
    state = faults.attempt(checked_array, start, (None,), "start")
    faults.raise_any()
    assert output_times is not None and state is not None
    return output_times, state.copy()


def inner_breakpoints(breakpoints: Sequence[float], first: float, last: float) -> list[float]:
    """The breakpoints strictly between ``first`` and ``last`` [s], increasing, without duplicates."""
    points = checked_array(np.asarray(breakpoints, dtype=np.float64).reshape(-1), (None,), "breakpoints")
    return [float(point) for point in np.unique(points) if first < point < last]
