"""What every solver of y' = f(t, y) offers: a description that starts a stepper, and the stepper that does the work.

A new member of the family is a frozen dataclass with the method's settings, checked when it is built, whose ``start``
gives a ``Stepper``. The stepper must
- call ``self.rates`` for every evaluation of f and nothing else, so that the count is exact;
- end its last step exactly at ``end``, and never look beyond it: f may jump there;
- keep ``t`` and ``y`` at the end of the last step, and never change an array that it has handed out;
- give the state anywhere within the last step, to about the accuracy of the step;
- raise ``SolverStopped`` when it cannot go on, with what the user can do about it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.errors import DrivetrainError, Fault, InputError
from drivetrain.solvers.tableaux import Tableau

Rates = Callable[[float, Array], Array]
MOST_STEPS = 100_000_000


class SolverStopped(DrivetrainError):
    """A solver that cannot go on; the message says why and what could help."""


@dataclass
class Work:
    """What an integration has cost so far.

    Attributes:
        rates: Evaluations of the right-hand side [-], exactly.
        steps: Steps that were kept [-].
        restarts: Times the state was changed from outside, so that memory of earlier steps was dropped [-].
        rejected: Steps that were tried and not kept [-]; counted by the methods that say so.
        jacobians: Jacobians [-]; the evaluations that differences cost are in ``rates`` too.
        factorisations: Of matrices [-].
        event_values: Evaluations of the values of events [-].
    """

    rates: int = 0
    steps: int = 0
    restarts: int = 0
    rejected: int = 0
    jacobians: int = 0
    factorisations: int = 0
    event_values: int = 0


class Stepper(ABC):
    """An integration under way; ``t`` [s] and ``y`` are the end of the last step."""

    def __init__(self, rates: Rates, t: float, y: Array, end: float, work: Work):
        self.t, self.y, self.end, self.work = t, y, end, work
        self._rates = rates

    def rates(self, t: float, y: Array) -> Array:
        """The right-hand side, counted [per s]."""
        self.work.rates += 1
        return self._rates(t, y)

    @abstractmethod
    def step(self) -> None:
        """One step further, at most to ``end``.

        Raises:
            SolverStopped: The method cannot go on.
        """

    @abstractmethod
    def within(self, t: float) -> Array:
        """The state at an instant of the last step."""

    @abstractmethod
    def resume(self, y: Array) -> None:
        """Go on from another state at the same instant."""


CompiledSettings = tuple[Tableau, Array, dict[str, float]]


class Solver:
    """A method and its settings; it offers one of these two, or both."""

    def start(self, rates: Rates, t: float, y: Array, end: float, work: Work) -> Stepper:
        """A stepper in Python from (t, y) towards ``end``."""
        raise NotImplementedError

    def compiled_settings(self, size: int) -> CompiledSettings:
        """Tableau, absolute tolerances and settings (``records.SETTINGS``) for the compiled loop and so many states.

        Raises:
            InputError: It does not run compiled.
        """
        problem = "must be a solver that runs compiled: Rodas4, Rodas5P, DormandPrince54, RungeKutta4 or Euler"
        raise InputError(Fault("solver", problem, self))


def check_positive(place: str, value: float, unit: str) -> None:
    """Refuse a setting that is not a positive, finite number.

    Args:
        value: What was given [unit].

    Raises:
        InputError: It is none.
    """
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not 0.0 < value < float("inf"):
        raise InputError(Fault(place, f"must be a positive number [{unit}]", value))


def wanted_and_start(times: Any, start: Any) -> tuple[Array, Array]:
    """The wanted instants and a copy of the start, checked.

    Args:
        times: Wanted instants, rising [s], (N,), N >= 2.
        start: State at the first instant [its own units], (m,).

    Raises:
        InputError: Times that do not rise, a start that is no finite vector.
    """
    faults: list[Fault] = []
    wanted = state = np.empty(0)
    try:
        wanted = checked_array(times, (None,), "times")
        if len(wanted) < 2 or not (np.diff(wanted) > 0.0).all():
            faults.append(Fault("times", "must be at least two instants that rise [s]", wanted[:5].tolist()))
    except InputError as error:
        faults.extend(error.faults)
    try:
        state = checked_array(start, (None,), "start").copy()
    except InputError as error:
        faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return wanted, state


def inner_points(breakpoints: Sequence[float], first: float, last: float) -> list[float]:
    """The breakpoints that split an interval.

    Args:
        breakpoints: In any order, also twice [s].
        first, last: Ends of the interval [s].

    Returns:
        Those strictly inside, rising, each once [s].

    Raises:
        InputError: Breakpoints that are no finite numbers.
    """
    points = checked_array(np.asarray(breakpoints, dtype=np.float64).reshape(-1), (None,), "breakpoints")
    return [float(point) for point in np.unique(points) if first < point < last]
