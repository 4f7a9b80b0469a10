"""Constrained dynamics with ``A(q) qd = 0``: accelerations, torques, and multipliers of the rows of A.

    tau = M qdd + h + A^T lambda                                                    (8.93)

Rows may be redundant. The motion is still unique, and the multipliers of least norm are returned. Rows that cannot be
satisfied are reported (``missed``).

Misprint in the book: after equation 8.100 it calls ``P_theta qdd`` "the set of joint accelerations". That omits the
term ``-M^-1 A^T (A M^-1 A^T)^-1 dA/dt qd`` due to the changing constraint; the two agree at rest, or if A is constant.
P is not symmetric: it is an orthogonal projector in the metric of M^-1, not in the usual one.

Exercise 8.10, from 8.98 to 8.100: multiply ``P tau = P (M qdd + h)`` by ``M^-1`` from the left, insert ``M M^-1``
between P and its factor on both sides, and write ``P_theta`` for ``M^-1 P M``. The result is
``P_theta M^-1 tau = P_theta (qdd + M^-1 h)``; P is never inverted.

Reference: Modern Robotics, section 8.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, batch, checked_number, finite_samples
from drivetrain.dynamics.constraints import Constraint, checked_constraints, stacked_rows
from drivetrain.dynamics.core import factor
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.mass import (
    mass_factor,
    mass_matrices,
    mass_matrix,
    no_inertia_error,
    solve_lower,
    solve_upper,
)
from drivetrain.errors import Fault, InputError

CLOSED, MOST_STEPS = 1e-12, 50  # tolerance of a closed position [m or -], and largest number of Newton steps
RANK = 1e-9  # singular values below this share of the largest count as zero: above rounding, below tolerances of parts

Constraints = Constraint | Sequence[Constraint]


@dataclass(frozen=True, eq=False)
class ConstrainedMotion:
    """Motion of an arm under constraints; one sample has no leading axis.

    Attributes:
        acceleration: Of the joints [rad/s^2 or m/s^2], (N, n).
        multipliers: Of the rows, of least norm if rows are redundant [N for lengths, N m for angles], (N, k).
        rank: Number of independent rows [-], (N,); k - rank are redundant, n - rank degrees of freedom remain.
        condition: Largest over smallest singular value that was kept [-], (N,).
        missed: Acceleration that the rows require and no motion can provide [m/s^2 or 1/s^2], (N,): the largest over
            orthonormal combinations of rows that move no joint; more than rounding only if rows contradict each other.
        error: Position error of the rows [m or -], (N, k).
        speed_error: Speed error of the rows, ``A qd`` [m/s or 1/s], (N, k).
    """

    acceleration: Array
    multipliers: Array
    rank: Array
    condition: Array
    missed: Array
    error: Array
    speed_error: Array


@dataclass(frozen=True, eq=False)
class ConstrainedTorque:
    """Torques that move an arm under constraints; one sample has no leading axis.

    Attributes:
        torque: ``P (M qdd + h)``, or ``M qdd + h + A^T lambda`` for given lambda [N m or N], (N, n).
        acceleration: The resulting acceleration: the part of the wanted one that the constraints allow, (N, n).
        missed: Violation of the constraints by the wanted acceleration, ``A qdd + dA/dt qd`` [m/s^2 or 1/s^2], (N, k).
        rank: Number of independent rows [-], (N,).
    """

    torque: Array
    acceleration: Array
    missed: Array
    rank: Array


@dataclass(frozen=True, eq=False)
class Projectors:
    """The two projectors of the book; one sample has no leading axis.

    Attributes:
        torque: P, projects torques onto those that do work on the arm [-], (N, n, n); equation 8.99.
        acceleration: P_theta, projects accelerations onto those that the constraints allow [-], (N, n, n); equation
            8.101.
        rank: Number of independent rows [-], (N,); the rank of the projectors is n minus that.
    """

    torque: Array
    acceleration: Array
    rank: Array


def constrained_forward_dynamics(
    arm: Arm, constraints: Constraints, q: Any, qd: Any, tau: Any, *, tip_wrench: Any = None, tolerance: float = RANK
) -> ConstrainedMotion:
    """The accelerations and multipliers due to torques under constraints.

    A position or speed that violates the constraints is reported but not corrected: ``closed_position`` and
    ``closed_speed`` correct an initial state, and the simulation keeps it closed.

    Args:
        arm: With rotors or without.
        constraints: One or several.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tau: Generalised torques [N m; N at a prismatic joint], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment in addition, in the tip frame, (moment [N m], force
            [N]), (6,) or (N, 6). None: nothing.
        tolerance: Singular values below this share of the largest count as zero [-].

    Returns:
        Motion and multipliers.

    Raises:
        InputError: Wrong shapes, NaN, no constraints, a singular mass matrix, a tolerance outside 0 to 1.

    Reference: Modern Robotics, equations 8.93 to 8.97.
    """
    several, tolerance = checked_constraints(arm, constraints), _checked_share(tolerance)
    positions, speeds, torques = finite_samples(arm.n, {"q": q, "qd": qd, "tau": tau})
    rows = stacked_rows(arm, several, positions, speeds)
    force = torques - bias_torque(arm, positions, speeds, tip_wrench=tip_wrench)
    motion, multipliers, found = least_change(arm, positions, rows.jacobian, force, rows.drift, tolerance)
    leaving = (rows.jacobian @ speeds[:, :, None])[..., 0]
    rank = found[:, 0].astype(np.int64)
    parts = (motion, multipliers, rank, found[:, 1], found[:, 2], rows.error, leaving)
    return ConstrainedMotion(*(parts if np.ndim(q) == 2 else (part[0] for part in parts)))


def _checked_share(tolerance: Any) -> float:
    """A tolerance as a float, checked to be from 0 to below 1."""
    number = checked_number(tolerance, "tolerance", "-", least=0.0)
    if not number < 1.0:
        raise InputError(Fault("tolerance", "must be below 1 [-]", number))
    return number


def constrained_inverse_dynamics(
    arm: Arm,
    constraints: Constraints,
    q: Any,
    qd: Any,
    qdd: Any,
    *,
    multipliers: Any = None,
    tip_wrench: Any = None,
) -> ConstrainedTorque:
    """The torques for a wanted acceleration and, optionally, for given forces on the constraints.

    Args:
        arm: With rotors or without.
        constraints: One or several.
        q, qd, qdd: Positions, speeds and wanted accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        multipliers: Forces with which the arm acts on the constraints [N for lengths, N m for angles], (k,) or (N, k).
            None: the constraints carry all loads that they can, including gravity.
        tip_wrench: What the end effector applies to the environment in addition, in the tip frame, (moment [N m], force
            [N]), (6,) or (N, 6). None: nothing.

    Returns:
        Torques, and the part of the wanted acceleration that the constraints allow.

    Raises:
        InputError: Wrong shapes, NaN, no constraints, a singular mass matrix.

    Reference: Modern Robotics, equations 8.98 and, for given multipliers, 8.93.
    """
    several = checked_constraints(arm, constraints)
    positions, speeds, wanted = finite_samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    rows = stacked_rows(arm, several, positions, speeds)
    count, k = rows.drift.shape
    pressed = np.zeros((1, k)) if multipliers is None else batch(multipliers, k, "multipliers")
    if len(pressed) not in (1, count):
        raise InputError(Fault("multipliers", f"must be one set of {k}, or one a sample: {count}", len(pressed)))
    bias = bias_torque(arm, positions, speeds, tip_wrench=tip_wrench)
    matrices = mass_matrix(arm, positions)
    force = (matrices @ wanted[:, :, None])[..., 0]
    motion, _, found = least_change(arm, positions, rows.jacobian, force, rows.drift)
    whole = (matrices @ motion[:, :, None])[..., 0] + bias
    if multipliers is None:
        # The part that the constraints carry: (1 - P) tau = A^T lambda.
        _, taken, _ = least_change(arm, positions, rows.jacobian, whole, np.zeros((count, k)))
        pressed = -taken
    torque = whole + (np.swapaxes(rows.jacobian, 1, 2) @ pressed[:, :, None])[..., 0]
    missed = (rows.jacobian @ wanted[:, :, None])[..., 0] + rows.drift
    parts = (torque, motion, missed, found[:, 0].astype(np.int64))
    return ConstrainedTorque(*(parts if np.ndim(q) == 2 else (part[0] for part in parts)))


def constraint_projectors(arm: Arm, constraints: Constraints, q: Any, *, tolerance: float = RANK) -> Projectors:
    """The matrices P and P_theta.

    Args:
        arm: With rotors or without.
        constraints: One or several.
        q: Positions [rad or m], (n,) or (N, n).
        tolerance: Singular values below this share of the largest count as zero [-].

    Returns:
        Both, with the rank of the rows.

    Raises:
        InputError: Wrong shapes, NaN, no constraints, a singular mass matrix, a tolerance outside 0 to 1.

    Reference: Modern Robotics, equations 8.99 and 8.101.
    """
    several, tolerance = checked_constraints(arm, constraints), _checked_share(tolerance)
    (positions,) = finite_samples(arm.n, {"q": q})
    rows = stacked_rows(arm, several, positions, np.zeros(positions.shape))
    factor = mass_factor(arm, positions)
    left, values, _ = np.linalg.svd(solve_lower(factor, np.swapaxes(rows.jacobian, 1, 2)), full_matrices=False)
    kept = values > tolerance * values[:, :1]
    held = (left * kept[:, None]) @ np.swapaxes(left, 1, 2)
    free = np.eye(arm.n) - held
    # P = L (1 - U U^T) L^-1, and P_theta is its transpose; both without any inverse.
    torque = factor @ np.swapaxes(solve_upper(factor, free), 1, 2)
    parts = (torque, np.swapaxes(torque, 1, 2).copy(), kept.sum(axis=1))
    return Projectors(*(parts if np.ndim(q) == 2 else (part[0] for part in parts)))


def closed_position(arm: Arm, constraints: Constraints, q: Any) -> Array:
    """The position near q that satisfies the constraints, by Newton's method with least steps in the metric of M.

    Raises ``InputError`` if none is found: the constraints cannot be satisfied, or not starting from q.
    """
    held = tuple(one for one in checked_constraints(arm, constraints) if one.holonomic)
    (positions,) = finite_samples(arm.n, {"q": q})
    if len(positions) != 1:
        raise InputError(Fault("q", f"must be one position, ({arm.n},)", f"shape {np.shape(q)}"))
    if not held:
        return positions[0]
    still = np.zeros(positions.shape)
    error = np.inf
    for _ in range(MOST_STEPS):
        rows = stacked_rows(arm, held, positions, still)
        error = float(np.abs(rows.error).max())
        if error <= CLOSED:
            return positions[0]
        step, _, _ = least_change(arm, positions, rows.jacobian, still, rows.error)
        positions = np.ascontiguousarray(positions + step)
    problem = f"no position near it meets the constraints: {error:.3g} m or rad is left after {MOST_STEPS} steps"
    raise InputError(Fault("q", problem, np.asarray(q).tolist(), "start nearer, or check frames and surfaces"))


def closed_speed(arm: Arm, constraints: Constraints, q: Any, qd: Any) -> Array:
    """``P_theta qd``, the allowed speeds nearest to qd in the metric of M: the speeds after an impact."""
    several = checked_constraints(arm, constraints)
    positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    jacobian = stacked_rows(arm, several, positions, speeds).jacobian
    leaving = (jacobian @ speeds[:, :, None])[..., 0]
    change, _, _ = least_change(arm, positions, jacobian, np.zeros(speeds.shape), leaving)
    result = speeds + change
    return result if np.ndim(q) == 2 else result[0]


def least_change(
    arm: Arm, q: Array, jacobian: Array, force: Array, drift: Array, tolerance: float = RANK
) -> tuple[Array, Array, Array]:
    """Solve ``M x + A^T lambda = force``, ``A x = -drift`` for x and lambda; the input must be valid.

    Returns x, (N, n), lambda, (N, k), and rank, condition and unsatisfied drift, (N, 3), for A, (N, k, n).
    """
    motion, multipliers, found = np.empty(force.shape), np.empty(drift.shape), np.empty((len(q), 3))
    matrices = mass_matrices(packed(arm), q)
    force, drift, jacobian = (np.ascontiguousarray(values) for values in (force, drift, jacobian))
    sample, joint = factor.least_change(matrices, jacobian, force, drift, tolerance, motion, multipliers, found)
    if joint >= 0:
        raise no_inertia_error(arm, joint, f" at sample {sample}: the mass matrix is singular there")
    return motion, multipliers, found
