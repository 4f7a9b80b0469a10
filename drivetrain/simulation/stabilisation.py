"""How a simulation keeps to its constraints: accelerations alone let positions drift away from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.constrained import least_change
from drivetrain.dynamics.constraints import Constraint, Rows, stacked_rows
from drivetrain.errors import Fault, InputError
from drivetrain.solvers.solver import check_positive


class Stabilisation:
    """Base of the ways: asks for what the rows ask for and puts nothing back; each may do otherwise."""

    def drift(self, rows: Rows, qd: Array, held: Array) -> Array:
        """What accelerations must undo: the drift of the rows, and perhaps more.

        Args:
            qd: Speeds [rad/s or m/s], (N, n).
            held: Whether a row holds a position, (k,).

        Returns:
            d of ``A qdd = -d`` [m/s^2 or 1/s^2], (N, k).
        """
        return rows.drift

    def put_back(
        self, arm: Arm, constraints: tuple[Constraint, ...], q: Array, qd: Array
    ) -> tuple[Array, Array] | None:
        """The state after a step, put back.

        Args:
            q, qd: Positions and speeds [rad or m, and per s], (1, n).

        Returns:
            Positions and speeds, (1, n) each; None to leave them.
        """
        return None


@dataclass(frozen=True)
class Projection(Stabilisation):
    """After each step back onto the constraints, by the least change in the metric of M: nothing drifts.

    Attributes:
        tolerance: Errors of positions [m or -] and of speeds [m/s or 1/s] that are left alone.
        most: Newton steps at a time [-].
    """

    tolerance: float = 1e-12
    most: int = 5

    def __post_init__(self) -> None:
        check_positive("Projection.tolerance", self.tolerance, "m")
        if isinstance(self.most, bool) or not isinstance(self.most, int) or self.most < 1:
            raise InputError(Fault("Projection.most", "must be a whole number from 1", self.most))

    def put_back(
        self, arm: Arm, constraints: tuple[Constraint, ...], q: Array, qd: Array
    ) -> tuple[Array, Array] | None:
        rows = stacked_rows(arm, constraints, q, qd)
        changed = False
        for _ in range(self.most):
            if np.abs(rows.error).max() <= self.tolerance:
                break
            # Rows that bind speeds only have no error, and so their directions are left alone.
            step, _, _ = least_change(arm, q, rows.jacobian, np.zeros(q.shape), rows.error)
            q, changed = q + step, True
            rows = stacked_rows(arm, constraints, q, qd)
        leaving = (rows.jacobian @ qd[:, :, None])[..., 0]
        if np.abs(leaving).max() > self.tolerance:
            step, _, _ = least_change(arm, q, rows.jacobian, np.zeros(q.shape), leaving)
            qd, changed = qd + step, True
        return (q, qd) if changed else None


@dataclass(frozen=True)
class Baumgarte(Stabilisation):
    """Errors die away as those of a critically damped spring; cheap, with any solver, but never quite zero.

    Attributes:
        rate: a of ``A qdd + dA/dt qd + 2 a A qd + a^2 error = 0`` [1/s]; far below the inverse of the solver's step.

    Reference: Baumgarte, Comp. Methods in Applied Mechanics and Engineering 1 (1972) 1-16.
    """

    rate: float = 10.0

    def __post_init__(self) -> None:
        check_positive("Baumgarte.rate", self.rate, "1/s")

    def drift(self, rows: Rows, qd: Array, held: Array) -> Array:
        leaving = (rows.jacobian @ qd[:, :, None])[..., 0]
        return rows.drift + self.rate * np.where(held, 2.0, 1.0) * leaving + self.rate**2 * rows.error


@dataclass(frozen=True)
class Drifting(Stabilisation):
    """Nothing is done: to see what the others are good for."""
