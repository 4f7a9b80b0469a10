"""The methods and their settings: frozen dataclasses, checked when they are built.

Those with a tableau run compiled (``integrate_compiled``), the others in Python (``integrate``), some both ways. None
of a fixed step controls its error: halve the step and see.
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
SMALLEST_RTOL = 100.0 * float(np.finfo(np.float64).eps)  # below this scipy raises it, with a warning
Method = tuple[Tableau, Array, dict[str, float]]


@dataclass
class Work:
    """What an integration has cost so far."""

    rates: int = 0  # evaluations of the right-hand side [-], exactly
    steps: int = 0  # steps that were kept [-]
    restarts: int = 0  # times the state was changed from outside, so that memory of earlier steps was dropped [-]
    rejected: int = 0  # steps that were tried and not kept [-]; counted by the methods that say so
    jacobians: int = 0  # jacobians [-]; the evaluations that differences cost are in ``rates`` too
    factorisations: int = 0  # of matrices [-]
    event_values: int = 0  # evaluations of the values of events [-]


class Solver:
    """A method and its settings."""

    def compiled_settings(self, size: int) -> Method:
        """Tableau, absolute tolerances and settings (``records.RUN``) for the compiled loop and so many states."""
        problem = "must be a solver that runs compiled: Rodas4, Rodas5P, DormandPrince54, RungeKutta4 or Euler"
        raise InputError(Fault("solver", problem, self))


@dataclass(frozen=True)
class FixedStep(Solver):
    """Base of the methods whose steps are all alike."""

    step: float
    cubic: ClassVar[bool] = False  # between the ends of a step a cubic with the right slopes, else a line
    tableau: ClassVar[Tableau | None] = None

    def __post_init__(self) -> None:
        check_positive(f"{type(self).__name__}.step", self.step, "s")

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        """The state a step later, from the state and its rates."""
        raise NotImplementedError

    def compiled_settings(self, size: int) -> Method:
        if self.tableau is None:
            return super().compiled_settings(size)
        return self.tableau, np.ones(size), {"rtol": 1.0, "fixed_step": self.step}


@dataclass(frozen=True)
class Euler(FixedStep):
    """Euler's method, the book's: first order, gains energy in swinging motions. One evaluation a step.

    Attributes:
        step: [s].

    Reference: Modern Robotics, section 8.5, Euler integration algorithm.
    """

    tableau = tableaux.EULER

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        return y + h * first


@dataclass(frozen=True)
class SemiImplicitEuler(FixedStep):
    """Euler's method with positions that follow the new speeds: first order, but energy stays bounded in swings.

    The state must be positions, then as many speeds; an odd number after them is stepped as by Euler. One evaluation a
    step.

    Attributes:
        step: [s].
    """

    def advance(self, rates: Any, t: float, y: Array, first: Array, h: float) -> Array:
        half, result = len(y) // 2, y + h * first
        result[:half] = y[:half] + h * result[half : 2 * half]
        return result


@dataclass(frozen=True)
class RungeKutta4(FixedStep):
    """The classical Runge-Kutta method: fourth order, four evaluations a step.

    Attributes:
        step: [s].

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
    """Base of the methods that choose their own step to hold a tolerance."""

    rtol: float = 1e-8  # error allowed in a step, as a share of each state [-]
    atol: Any = 1e-10  # error allowed in a step where a state is near zero [the state's own unit]
    # [s]; None: as long as the tolerance allows. What happens within one step and leaves no trace at its stages is not
    # seen.
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
    """Dormand and Prince's explicit method of order 8, for smooth motions and tight tolerances (scipy's DOP853)."""


@dataclass(frozen=True)
class DormandPrince54(Adaptive):
    """Dormand and Prince's explicit method of order 5 with a fourth-order check."""

    def compiled_settings(self, size: int) -> Method:
        largest = math.inf if self.largest_step is None else self.largest_step
        return tableaux.dormand_prince(), np.full(size, self.atol), {"rtol": self.rtol, "largest_step": largest}


@dataclass(frozen=True)
class Rodas4(Adaptive):
    """RODAS: order 4 with a check of order 3, L-stable; for stiff equations that do not jump between breakpoints.

    It solves linear systems only, so a step has a fixed price and no iteration to fail; the price of that is an exact
    Jacobian at each step.

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
    """RODAS5P: order 5 with a check of order 4, L-stable; settings as of ``Rodas4``, eight stages instead of six.

    Reference: Steinebach, BIT Numerical Mathematics 63 (2023) 27.
    """

    _tableau: ClassVar[Tableau] = tableaux.RODAS5P


def check_positive(place: str, value: float, unit: str) -> None:
    """Refuse a setting that is not a positive, finite number."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not 0.0 < value < float("inf"):
        raise InputError(Fault(place, f"must be a positive number [{unit}]", value))


def wanted_and_start(times: Any, start: Any) -> tuple[Array, Array]:
    """The wanted instants, which must rise [s], (N,), N >= 2, and a copy of the start, (m,); all faults at once."""
    faults = Faults()
    wanted = faults.attempt(checked_array, times, (None,), "times")
    if wanted is not None and (len(wanted) < 2 or not (np.diff(wanted) > 0.0).all()):
        faults.add("times", "must be at least two instants that rise [s]", wanted[:5].tolist())
    state = faults.attempt(checked_array, start, (None,), "start")
    faults.raise_any()
    assert wanted is not None and state is not None
    return wanted, state.copy()


def inner_points(breakpoints: Sequence[float], first: float, last: float) -> list[float]:
    """The breakpoints strictly between two instants, rising, each once [s]."""
    points = checked_array(np.asarray(breakpoints, dtype=np.float64).reshape(-1), (None,), "breakpoints")
    return [float(point) for point in np.unique(points) if first < point < last]
