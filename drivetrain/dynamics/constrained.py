"""An arm under constraints ``A(q) qd = 0``: its accelerations, its torques, and the multipliers of the rows.

    tau = M qdd + h + A^T lambda                                                    (8.93)

Rows may say the same twice; then their rank is found, the motion is unique all the same, and of all multipliers that
give it those of least norm are returned. Rows that cannot be satisfied are reported (``missed``).

Where the book slips: after equation 8.100 it calls ``P_theta qdd`` "the set of joint accelerations". That misses the
part ``-M^-1 A^T (A M^-1 A^T)^-1 dA/dt qd`` which the constraint itself asks for while it turns; the two agree at rest,
or where A is constant. P is not symmetric, and not a projector in the usual metric but in that of M^-1.

Exercise 8.10, from 8.98 to 8.100: multiply ``P tau = P (M qdd + h)`` by ``M^-1`` from the left, put ``M M^-1`` between
P and its factor on both sides, and name ``M^-1 P M`` as ``P_theta``: ``P_theta M^-1 tau = P_theta (qdd + M^-1 h)``. P
was never inverted.

Reference: Modern Robotics, section 8.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, batch, finite_samples
from drivetrain.dynamics.constraints import Constraint, checked_constraints, stacked_rows
from drivetrain.dynamics.core import factor
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.mass import (
    mass_factor,
    mass_matrices,
    mass_matrix,
    no_inertia,
    solve_lower,
    solve_upper,
)
from drivetrain.errors import Fault, InputError

CLOSED, MOST_STEPS = 1e-12, 50  # [m or -] that a closed position may be off, and Newton's steps to it
RANK = 1e-9  # a singular value that counts as none, over the largest: above rounding, below any workshop

Constraints = Constraint | Sequence[Constraint]


@dataclass(frozen=True, eq=False)
class ConstrainedMotion:
    """What an arm does under constraints; one sample has no leading axis.

    Attributes:
        acceleration: Of the joints [rad/s^2 or m/s^2], (N, n).
        multipliers: Of the rows, of least norm where rows are redundant [N for lengths, N m for angles], (N, k).
        rank: Rows that are independent [-], (N,); k - rank are redundant, n - rank freedoms are left.
        condition: Largest over smallest singular value that was kept [-], (N,).
        missed: Largest acceleration that the rows ask for and no motion can give [m/s^2 or 1/s^2], (N,); more than
            rounding when rows contradict each other.
        error: How far positions are off [m or -], (N, k).
        speed_error: How fast the constraints are being left, ``A qd`` [m/s or 1/s], (N, k).
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
    """What moves an arm under constraints; one sample has no leading axis.

    Attributes:
        torque: ``P (M qdd + h)``, or ``M qdd + h + A^T lambda`` for given lambda [N m or N], (N, n).
        acceleration: What it gives: the part of the wanted one that the constraints allow, (N, n).
        missed: How far the wanted acceleration leaves the constraints, ``A qdd + dA/dt qd`` [m/s^2 or 1/s^2], (N, k).
        rank: Rows that are independent [-], (N,).
    """

    torque: Array
    acceleration: Array
    missed: Array
    rank: Array


@dataclass(frozen=True, eq=False)
class Projectors:
    """The two projectors of the book; one sample has no leading axis.

    Attributes:
        torque: P, leaves of torques what does work on the arm [-], (N, n, n); equation 8.99.
        acceleration: P_theta, leaves of accelerations what the constraints allow [-], (N, n, n); equation 8.101.
        rank: Rows that are independent [-], (N,); the projectors' own rank is n less that.
    """

    torque: Array
    acceleration: Array
    rank: Array


def constrained_forward_dynamics(
    arm: Arm, constraints: Constraints, q: Any, qd: Any, tau: Any, *, tip_wrench: Any = None, tolerance: float = RANK
) -> ConstrainedMotion:
    """The accelerations and multipliers that torques give under constraints.

    Nothing is done about a position or speed that breaks the constraints, but to tell it: ``closed_position`` and
    ``closed_speed`` correct a start, the simulation holds it.

    Args:
        arm: With rotors or without.
        constraints: One or several.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tau: Generalised torques [N m; N at a prismatic joint], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment besides, in the tip frame, (moment [N m], force
            [N]), (6,) or (N, 6). None: nothing.
        tolerance: Singular value that counts as none, over the largest [-].

    Returns:
        Motion and multipliers.

    Raises:
        InputError: Wrong shapes, NaN, no constraints, a singular mass matrix.

    Reference: Modern Robotics, equations 8.93 to 8.97.
    """
    several = checked_constraints(arm, constraints)
    positions, speeds, torques = finite_samples(arm.n, {"q": q, "qd": qd, "tau": tau})
    rows = stacked_rows(arm, several, positions, speeds)
    force = torques - bias_torque(arm, positions, speeds, tip_wrench=tip_wrench)
    motion, multipliers, found = least_change(arm, positions, rows.jacobian, force, rows.drift, tolerance)
    leaving = (rows.jacobian @ speeds[:, :, None])[..., 0]
    rank = found[:, 0].astype(np.int64)
    parts = (motion, multipliers, rank, found[:, 1], found[:, 2], rows.error, leaving)
    return ConstrainedMotion(*(parts if np.ndim(q) == 2 else (part[0] for part in parts)))


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
    """The torques for a wanted acceleration and, if wanted, for given forces against the constraints.

    Args:
        arm: With rotors or without.
        constraints: One or several.
        q, qd, qdd: Positions, speeds and wanted accelerations [rad or m, and per s, s^2], (n,) or (N, n).
        multipliers: With which the arm presses against the rows [N for lengths, N m for angles], (k,) or (N, k). None:
            it leaves to the constraints whatever they can carry, gravity too.
        tip_wrench: What the end effector applies to the environment besides, in the tip frame, (moment [N m], force
            [N]), (6,) or (N, 6). None: nothing.

    Returns:
        Torques, and what the constraints leave of the wanted acceleration.

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
        # What the constraints take off when nothing else has to be met: (1 - P) tau = A^T lambda.
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
        tolerance: Singular value that counts as none, over the largest [-].

    Returns:
        Both, with the rank of the rows.

    Raises:
        InputError: Wrong shapes, NaN, no constraints, a singular mass matrix.

    Reference: Modern Robotics, equations 8.99 and 8.101.
    """
    several = checked_constraints(arm, constraints)
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
    """The position near q at which the constraints hold, by Newton's method, each step least in the metric of M.

    Raises InputError where no such position is near q: the constraints cannot be met, or not from there.
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
    """``P_theta qd``, the allowed speeds nearest to qd in the metric of M: what is left after a shock."""
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
    """The x and lambda of ``M x + A^T lambda = force``, ``A x = -drift``; for checked input.

    x, (N, n), lambda, (N, k), and rank, condition, missed drift, (N, 3), of A (N, k, n); tolerance: as ``RANK``.
    """
    motion, multipliers, found = np.empty(force.shape), np.empty(drift.shape), np.empty((len(q), 3))
    matrices = mass_matrices(packed(arm), q)
    force, drift, jacobian = (np.ascontiguousarray(values) for values in (force, drift, jacobian))
    sample, joint = factor.least_change(matrices, jacobian, force, drift, tolerance, motion, multipliers, found)
    if joint >= 0:
        raise no_inertia(arm, joint, f" at sample {sample}: the mass matrix is singular there")
    return motion, multipliers, found
