"""RODAS, adaptive L-stable methods for stiff equations: the methods for accuracy.

They solve linear systems only, so a step has a fixed price and no iteration to fail; the price of that is an exact
Jacobian at each step. They run compiled (``integrate_compiled``), also where the right-hand side is in Python.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.solvers import tableaux
from drivetrain.solvers.adaptive import SMALLEST_RTOL
from drivetrain.solvers.solver import CompiledSettings, Solver, check_positive


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

    _tableau: ClassVar[tableaux.Tableau] = tableaux.RODAS4

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

    def compiled_settings(self, size: int) -> CompiledSettings:
        largest = math.inf if self.largest_step is None else self.largest_step
        settings = {"rtol": self.rtol, "largest_step": largest, "smallest_step": self.smallest_step}
        return self._tableau, self.tolerances(size), {**settings, "first_step": self.first_step or 0.0}


@dataclass(frozen=True)
class Rodas5P(Rodas4):
    """RODAS5P: order 5 with a check of order 4, L-stable; settings as of ``Rodas4``, eight stages instead of six.

    Reference: Steinebach, BIT Numerical Mathematics 63 (2023) 27.
    """

    _tableau: ClassVar[tableaux.Tableau] = tableaux.RODAS5P
