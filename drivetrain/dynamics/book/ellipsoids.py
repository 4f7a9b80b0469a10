"""Ellipsoids of the mass matrix: apparent inertia of an arm at rest for joint torques, or for a force at its tip.

All functions are for an arm at rest, without Coriolis and centripetal terms, and without gravity. With joints of
different kinds the components along an ellipsoid's axes have mixed units, and its directions depend on the units; the
effective mass at the tip does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import tip_jacobian
from drivetrain.arrays import Array, axes_of, batch, checked_array, finite_samples
from drivetrain.dynamics.core.factor import factorise
from drivetrain.dynamics.mass import mass_matrix, solve_lower
from drivetrain.errors import Fault, InputError, raise_faults

BASE_AXES = np.eye(3)
MOBILITY_ROUNDING = 1e-12  # square roots of mobilities below this share of the largest are rounding


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Image of the unit ball under a symmetric positive matrix; one sample has no leading axis.

    Attributes:
        semi_axes: Lengths, longest first, in the unit that the function states, (k,) or (N, k): the eigenvalues of the
            matrix. Infinite in directions without motion, zero in directions in which the ellipsoid is flat.
        directions: Unit vectors along the axes, as columns [-], (k, k) or (N, k, k): the eigenvectors.
    """

    semi_axes: Array
    directions: Array

    @property
    def matrix(self) -> Array:
        """The matrix, in the unit of the semi-axes, (k, k) or (N, k, k); not finite if a semi-axis is infinite."""
        with np.errstate(invalid="ignore"):
            return np.asarray((self.directions * self.semi_axes[..., None, :]) @ np.swapaxes(self.directions, -1, -2))


def torque_ellipsoid(arm: Arm, q: Any, *, joints: Any = None) -> Ellipsoid:
    """The joint torques for all accelerations of unit size: the mass ellipsoid.

    Torque and acceleration are parallel only along its axes.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).
        joints: Indices of the joints that move, the others being held, (k,). None: all.

    Returns:
        Semi-axes in N m per rad/s^2, which is [kg m^2] (N per m/s^2 at prismatic joints), and directions.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, no such joint.

    Reference: Modern Robotics, section 8.1.3 and figure 8.3, which prints 1.27 for 3 - sqrt(3), 0.13 for 1 - sqrt(3)/2.
    """
    return _largest_first(*np.linalg.eigh(_chosen(arm, q, joints)))


def acceleration_ellipsoid(arm: Arm, q: Any, *, joints: Any = None) -> Ellipsoid:
    """The accelerations due to all joint torques of unit size.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).
        joints: Indices of the joints that move, the others being held, (k,). None: all.

    Returns:
        Semi-axes in rad/s^2 per N m, which is [1/(kg m^2)] (m/s^2 per N at prismatic joints), and directions.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, no such joint, or a joint that moves no inertia.

    Reference: Modern Robotics, section 8.1.3 and figure 8.3, dotted.
    """
    matrices = _chosen(arm, q, joints)
    _factor(matrices)  # refuses a singular matrix
    values, directions = np.linalg.eigh(matrices)
    return _largest_first(1.0 / values, directions)


def tip_acceleration_ellipsoid(arm: Arm, q: Any, *, axes: Any = BASE_AXES) -> Ellipsoid:
    """The accelerations of the tip, from rest, due to all forces of unit size at the tip: ``J M^-1 J^T``.

    It is defined everywhere; at a singular posture, and in directions in which the joints cannot move the tip, it is
    flat.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).
        axes: Orthogonal unit vectors in the base frame [-], (k, 3): only forces and accelerations along these count,
            and the tip is free to move along the others. The first two rows of the default suit a planar arm.

    Returns:
        Semi-axes in m/s^2 per N, which is [1/kg], and directions in terms of ``axes``.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, axes that are not orthogonal, or a joint that moves no inertia.

    Reference: Modern Robotics, section 8.1.3 and figure 8.4, dotted.
    """
    roots, directions = _tip_mobility(arm, q, _checked_axes(axes))
    return Ellipsoid(roots**2, directions)


def tip_force_ellipsoid(arm: Arm, q: Any, *, axes: Any = BASE_AXES) -> Ellipsoid:
    """The forces at the tip for all accelerations of the tip of unit size from rest: the effective mass ``Lambda``.

    For an arm with as many joints as axes it is ``J^-T M J^-1``; for an arm with more joints, ``(J M^-1 J^T)^-1``.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).
        axes: As in ``tip_acceleration_ellipsoid`` [-], (k, 3).

    Returns:
        Semi-axes [kg], infinite in directions in which the tip cannot move, and directions in terms of ``axes``.

    Raises:
        InputError: As for ``tip_acceleration_ellipsoid``.

    Reference: Modern Robotics, equation 8.21 and figure 8.4, which prints -1.73 for -sqrt(3) and 0.35 for sqrt(3)/5.
    """
    roots, directions = _tip_mobility(arm, q, _checked_axes(axes))
    with np.errstate(divide="ignore"):
        masses = 1.0 / roots**2
    return Ellipsoid(masses[..., ::-1], directions[..., ::-1])


def effective_mass(arm: Arm, q: Any, direction: Any) -> Array:
    """Effective mass at the tip: force over the acceleration in its direction, ``1 / (u^T J M^-1 J^T u)``.

    The tip is free to move sideways. To keep it on a straight line, a force with transverse components is needed, and a
    larger component along the line: ``u^T Lambda u``.

    Args:
        arm: With rotors or without.
        q: Positions [rad or m], (n,) or (N, n).
        direction: Direction of the force in the base frame, of any length except zero [-], (3,), or (N, 3).

    Returns:
        Mass [kg], () or (N,); infinite if the tip cannot move in this direction.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, a direction of length zero, or a joint that moves no inertia.

    Reference: Modern Robotics, section 8.1.3; O. Khatib, Inertial properties in robotic manipulation: an object-level
        framework, International Journal of Robotics Research 14 (1995) 19-36.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    ways = _unit_rows(batch(direction, 3, "direction"))
    if np.ndim(direction) == 2 and (np.ndim(q) != 2 or len(ways) != len(positions)):
        problem = f"must have shape (3,), or (N, 3) with N as q has, {np.shape(q)}"
        raise InputError(Fault("direction", problem, f"shape {np.shape(direction)}"))
    weighted = _weighted_jacobian(arm, positions)
    along = (weighted @ ways[:, :, None])[..., 0]
    squared = np.sum(along**2, axis=1)
    squared[squared <= MOBILITY_ROUNDING**2 * np.sum(weighted**2, axis=(1, 2))] = 0.0
    with np.errstate(divide="ignore"):
        mass = 1.0 / squared
    return mass if np.ndim(q) == 2 else mass[0]


def outline(ellipsoid: Ellipsoid, *, longest: float = np.inf, points: int = 181) -> Array:
    """The closed curve of a plane ellipsoid for plotting, (.., points, 2); the last point equals the first.

    Semi-axes are cut at ``longest``.
    """
    faults = []
    if ellipsoid.semi_axes.shape[-1] != 2:
        faults.append(Fault("ellipsoid", "must have two axes to be drawn in a plane", ellipsoid.semi_axes.shape[-1]))
    lengths = np.minimum(ellipsoid.semi_axes, longest)
    if not np.isfinite(lengths).all():
        faults.append(Fault("longest", "must be given for an ellipsoid with an infinite semi-axis", longest))
    if points < 4:
        faults.append(Fault("points", "must be at least 4", points))
    raise_faults(faults)
    angle = np.linspace(0.0, 2.0 * np.pi, points)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray((circle * lengths[..., None, :]) @ np.swapaxes(ellipsoid.directions, -1, -2))


def _largest_first(values: Array, directions: Array) -> Ellipsoid:
    order = np.argsort(-values, axis=-1)
    sorted_directions = np.take_along_axis(directions, order[..., None, :], axis=-1)
    return Ellipsoid(np.take_along_axis(values, order, axis=-1), sorted_directions)


def _chosen(arm: Arm, q: Any, joints: Any) -> Array:
    """The mass matrix of the joints that are not held, (k, k) or (N, k, k)."""
    matrices = mass_matrix(arm, q)
    if joints is None:
        return matrices
    index = np.asarray(joints if axes_of(joints) == 1 else ())
    known = index.size and index.dtype.kind in "iu" and len(set(index.tolist())) == index.size
    if not known or (index < 0).any() or (index >= arm.n).any():
        raise InputError(Fault("joints", f"must be different indices from 0 to {arm.n - 1}", joints))
    return np.asarray(matrices[..., index[:, None], index])


def _factor(matrices: Array) -> Array:
    """Cholesky factors of mass matrices, (N, k, k)."""
    factors = np.array(matrices, order="C").reshape(-1, *matrices.shape[-2:])
    if factorise(factors)[1] >= 0:
        problem = "a joint moves no inertia: the mass matrix is singular, and accelerations are not defined"
        hint = "give the links from this joint on mass and inertia, or the joint a rotor"
        raise InputError(Fault("arm", problem, hint=hint))
    return factors


def _weighted_jacobian(arm: Arm, q: Array) -> Array:
    """X in ``J M^-1 J^T = X^T X``, (N, n, 3)."""
    return solve_lower(_factor(mass_matrix(arm, q)), np.swapaxes(tip_jacobian(arm, q)[:, 3:], 1, 2))


def _tip_mobility(arm: Arm, q: Any, axes: Array) -> tuple[Array, Array]:
    """Square roots of the mobility's semi-axes, largest first, and its directions; X is better conditioned than M."""
    (positions,) = finite_samples(arm.n, {"q": q})
    seen = _weighted_jacobian(arm, positions) @ axes.T
    _, roots, turned = np.linalg.svd(seen, full_matrices=True)
    size = len(axes)
    whole = np.zeros((len(positions), size))
    whole[:, : roots.shape[1]] = roots
    whole[whole <= MOBILITY_ROUNDING * whole[:, :1]] = 0.0
    directions: Array = np.swapaxes(turned, 1, 2)
    return (whole, directions) if np.ndim(q) == 2 else (whole[0], directions[0])


def _checked_axes(axes: Any) -> Array:
    rows = checked_array(axes, (None, 3), "axes")
    if not len(rows) or np.abs(rows @ rows.T - np.eye(len(rows))).max() > 1e-9:
        raise InputError(Fault("axes", "must be one to three unit vectors at right angles, (k, 3)", rows.tolist()))
    return rows


def _unit_rows(rows: Array) -> Array:
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    if not (size > 0.0).all():
        raise InputError(Fault("direction", "must not have length zero", rows[int(np.argmin(size))].tolist()))
    return np.asarray(rows / size)
