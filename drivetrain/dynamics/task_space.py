"""Task-space dynamics: apparent inertia of the tip, and the wrench for its motion.

A task is a selection of rows of the tip's twist in some frame. With fewer than six rows the rest of the tip's motion is
free: rows (2, 3, 4) of a body twist are those of a planar arm with axes along z.
For a task with Jacobian J, the torques are ``tau = J^T F`` plus torques without effect on the task, with

    F = inertia Vd + bias + gravity,   inertia = (J M^-1 J^T)^-1,

which for six joints and six rows are Lambda = J^-T M J^-1 and eta = bias + gravity of the book. Redundant arms (more
joints than rows) use the dynamically consistent inverse. Everything is computed from the singular values s of
``L^-1 J^T``, ``M = L L^T``: the inertia along a direction is ``1/s^2``, and where s goes to zero the arm is singular.
There the result is damped or reduced, as ``condition``, ``rank`` and ``damping`` state.

Reference: Modern Robotics, section 8.6; Khatib, A unified approach for motion and force control of robot manipulators,
    IEEE J. Robotics and Automation 3 (1987) 43-53, for redundant arms.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import (
    body_jacobian,
    body_jacobian_rate,
    space_jacobian,
    space_jacobian_rate,
    tip_jacobian,
    tip_jacobian_rate,
)
from drivetrain.arrays import Array, finite_samples
from drivetrain.dynamics.inverse import gravity_torque, velocity_torque
from drivetrain.dynamics.mass import mass_factor, solve_lower
from drivetrain.errors import Fault, InputError

ALL = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True)
class Task(ABC):
    """Base class of the tasks."""

    rows: tuple[int, ...] = ALL  # selected rows of the twist (angular 0 to 2, linear 3 to 5)

    def __post_init__(self) -> None:
        rows = tuple(self.rows)
        if not rows or len(set(rows)) != len(rows) or not set(rows) <= set(ALL):
            raise InputError(Fault(f"{type(self).__name__}.rows", "must be different numbers from 0 to 5", self.rows))
        object.__setattr__(self, "rows", rows)

    @abstractmethod
    def _whole(self, arm: Arm, q: Array) -> Array:
        """The Jacobian with all six rows, (N, 6, n)."""

    @abstractmethod
    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        """Its time derivative, (N, 6, n)."""

    def jacobian(self, arm: Arm, q: Array) -> Array:
        """The matrix from joint rates to the rates of the task, in SI units, (N, k, n)."""
        return self._whole(arm, q)[:, self.rows]

    def jacobian_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        """The time derivative of the Jacobian, (N, k, n)."""
        return self._whole_rate(arm, q, qd)[:, self.rows]


@dataclass(frozen=True)
class BodyTwist(Task):
    """The twist of the tip in the tip's frame.

    Attributes:
        rows: Rows of the twist that are the task (angular 0 to 2 [rad/s], linear 3 to 5 [m/s]).
    """

    def _whole(self, arm: Arm, q: Array) -> Array:
        return body_jacobian(arm, q)

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        return body_jacobian_rate(arm, q, qd)


@dataclass(frozen=True)
class SpaceTwist(Task):
    """The twist of the tip in the base frame; the linear part is the velocity of its point at the base's origin.

    Attributes:
        rows: Rows of the twist that are the task (angular 0 to 2 [rad/s], linear 3 to 5 [m/s]).
    """

    def _whole(self, arm: Arm, q: Array) -> Array:
        return space_jacobian(arm, q)

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        return space_jacobian_rate(arm, q, qd)


@dataclass(frozen=True)
class TipVelocity(Task):
    """Angular velocity of the tip, and velocity of its origin, both in the base's axes.

    Attributes:
        rows: Rows of the twist that are the task (angular 0 to 2 [rad/s], linear 3 to 5 [m/s]).
    """

    def _whole(self, arm: Arm, q: Array) -> Array:
        return tip_jacobian(arm, q)

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        return tip_jacobian_rate(tip_jacobian(arm, q), qd)


BODY = BodyTwist()


@dataclass(frozen=True)
class NearSingular(ABC):
    """Treatment of singularities, where the arm loses a direction of the task."""

    threshold: float = 1e-6  # smallest singular value that counts as regular, as a share of the largest [-]

    def __post_init__(self) -> None:
        if not 0.0 < self.threshold < 1.0:
            raise InputError(Fault(f"{type(self).__name__}.threshold", "must be between 0 and 1", self.threshold))

    @abstractmethod
    def inverse_squares(self, values: Array) -> tuple[Array, Array]:
        """The replacement of ``1/s^2``, (N, k), and the damping, (N,)."""


@dataclass(frozen=True)
class Damped(NearSingular):
    """``1/(s^2 + d)``, with d growing smoothly from zero when the smallest s falls below the threshold.

    Attributes:
        threshold: Smallest singular value that counts as regular, as a share of the largest [-].

    Reference: Chiaverini, Siciliano, Egeland, IEEE Trans. Control Systems Technology 2 (1994) 123-134.
    """

    def inverse_squares(self, values: Array) -> tuple[Array, Array]:
        limit = self.threshold * values[:, 0]
        damping = np.maximum(limit**2 - values[:, -1] ** 2, 0.0)
        return 1.0 / (values**2 + damping[:, None]), damping


@dataclass(frozen=True)
class Reduced(NearSingular):
    """``1/s^2`` along regular directions and 0 along the others, which are removed from the task.

    Attributes:
        threshold: Smallest singular value that counts as regular, as a share of the largest [-].
    """

    def inverse_squares(self, values: Array) -> tuple[Array, Array]:
        regular = values > self.threshold * values[:, :1]
        return regular / np.where(regular, values, 1.0) ** 2, np.zeros(len(values))


DAMPED = Damped()


@dataclass(frozen=True, eq=False)
class TaskSpaceDynamics:
    """``F = inertia Vd + bias + gravity`` for a task of k rows; one sample has no leading axis.

    Attributes:
        inertia: Lambda, (N, k, k), [kg m^2; kg m and kg in linear rows].
        bias: Velocity terms, eta without gravity, (N, k), [N m; N in linear rows].
        gravity: Gravity term, (N, k), [N m; N in linear rows].
        condition: Largest over smallest singular value of ``L^-1 J^T`` [-], (N,); infinite if a direction is lost. It
            depends on the units of the rows, which are SI.
        rank: Number of regular directions [-], (N,); less than k near a singularity.
        damping: Term added to the mobility [1/(kg m^2) or 1/kg], (N,); zero if the result is exact.
    """

    inertia: Array
    bias: Array
    gravity: Array
    condition: Array
    rank: Array
    damping: Array


def task_space_dynamics(
    arm: Arm, q: Any, qd: Any, *, task: Task = BODY, near_singular: NearSingular = DAMPED
) -> TaskSpaceDynamics:
    """The equation of motion in coordinates of a task.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        task: Twist of the tip, and its rows: ``BodyTwist``, ``SpaceTwist`` or ``TipVelocity``.
        near_singular: Treatment of singularities: ``Damped`` or ``Reduced``.

    Returns:
        The terms, with the treatment near a singularity.

    Raises:
        InputError: Wrong shapes, NaN, more rows than joints and ``near_singular`` not Reduced, a singular mass matrix.

    Reference: Modern Robotics, equations 8.89 to 8.91.
    """
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    mobility = _Mobility(arm, positions, task, near_singular)
    drift = (task.jacobian_rate(arm, positions, speeds) @ speeds[:, :, None])[..., 0]
    bias = mobility.wrench(velocity_torque(arm, positions, speeds)) - mobility.times_inertia(drift)
    parts = (
        mobility.inertia(),
        bias,
        mobility.wrench(gravity_torque(arm, positions)),
        mobility.condition,
        mobility.rank,
        mobility.damping,
    )
    return TaskSpaceDynamics(*(parts if np.ndim(q) == 2 else (part[0] for part in parts)))


class _Mobility:
    """The singular values of ``W = L^-1 J^T = U s V^T``; ``J M^-1 J^T = V s^2 V^T``."""

    def __init__(self, arm: Arm, q: Array, task: Task, near_singular: NearSingular):
        rows = len(task.rows)
        if rows > arm.n and not isinstance(near_singular, Reduced):
            hint = "name the rows that it can do, or pass near_singular=Reduced()"
            raise InputError(
                Fault("task", f"must have at most as many rows as the arm has joints, {arm.n}", rows, hint)
            )
        self._factor = mass_factor(arm, q)
        left, values, right = np.linalg.svd(solve_lower(self._factor, np.swapaxes(task.jacobian(arm, q), 1, 2)), False)
        self._left, self._values, self._right = left, values, np.swapaxes(right, 1, 2)
        self._inverse, self.damping = near_singular.inverse_squares(values)
        regular = values > near_singular.threshold * values[:, :1]
        self.rank = regular.sum(axis=1)
        smallest = values[:, -1] if rows <= arm.n else np.zeros(len(values))
        with np.errstate(divide="ignore", invalid="ignore"):
            self.condition = np.where(smallest > 0.0, values[:, 0] / smallest, np.inf)

    def inertia(self) -> Array:
        """``(J M^-1 J^T)^-1``."""
        result = self._right * self._inverse[:, None] @ np.swapaxes(self._right, 1, 2)
        return np.asarray(0.5 * (result + np.swapaxes(result, 1, 2)))

    def times_inertia(self, rows: Array) -> Array:
        """The inertia times vectors, (N, k)."""
        along = (np.swapaxes(self._right, 1, 2) @ rows[:, :, None])[..., 0]
        return np.asarray((self._right @ (self._inverse * along)[:, :, None])[..., 0])

    def wrench(self, torques: Array) -> Array:
        """``inertia J M^-1`` times torques, (N, n) to (N, k), with a single division by s."""
        along = np.swapaxes(self._left, 1, 2) @ solve_lower(self._factor, torques[:, :, None])
        return np.asarray((self._right @ ((self._inverse * self._values)[:, :, None] * along))[..., 0])
