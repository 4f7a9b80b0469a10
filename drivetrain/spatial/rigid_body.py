"""The motion of one rigid body as twist and wrench: momentum, energy, and Newton and Euler in six components.

Everything holds in any frame fixed to the body, when inertia, twist and wrench are all given in it. One sample or a
batch along the leading axis.

Reference: Modern Robotics, sections 8.2.2 and 8.2.3.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import cho_solve

from drivetrain.arrays import Array, batch, checked_array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.wrenches import dual_bracket, like, same_batches

SYMMETRIC = 1e-9  # on the spatial inertia, over its largest entry: what products of rotations leave, and printed digits
SINGULAR = 1e-12  # pivot of the inertia scaled to a unit diagonal; rounding leaves 1e-16 of nothing


def momentum(inertia: Any, twist: Any) -> Array:
    """The momentum (angular, linear) of a body, (6,) or (N, 6); Modern Robotics, equation 8.34."""
    return like(batch(twist, 6, "twist") @ _symmetric(inertia), twist)


def kinetic_energy(inertia: Any, twist: Any) -> Array:
    """The kinetic energy of a body; Modern Robotics, equation 8.33."""
    rows = batch(twist, 6, "twist")
    return like(0.5 * np.sum(rows * (rows @ _symmetric(inertia)), axis=1), twist)


def body_wrench(inertia: Any, twist: Any, acceleration: Any) -> Array:
    """The wrench that gives a body this acceleration: ``F = G dV/dt - ad_V^T G V``.

    Args:
        inertia: Spatial inertia G in a frame fixed to the body [kg m^2, kg m, kg], (6, 6).
        twist: V of that frame, in that frame, (angular [rad/s], linear [m/s]), (6,) or (N, 6).
        acceleration: dV/dt, the rate of the six numbers of the twist [rad/s^2, m/s^2], as ``twist``. Its linear part
            is not the acceleration of the origin, which is that plus ``angular x linear``.

    Returns:
        The total wrench on the body, in the same frame, (moment [N m], force [N]), (6,) or (N, 6).

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or an inertia that is not symmetric.

    Reference: Modern Robotics, equation 8.40, and 8.43 for a frame that is not at the centre of mass.
    """
    matrix = _symmetric(inertia)
    v, rate = same_batches(6, {"twist": twist, "acceleration": acceleration})
    return like(rate @ matrix - dual_bracket(v, v @ matrix), twist)


def body_acceleration(inertia: Any, twist: Any, wrench: Any) -> Array:
    """The acceleration that a wrench gives a body: equation 8.40 solved for dV/dt.

    Args:
        inertia: Spatial inertia G in a frame fixed to the body [kg m^2, kg m, kg], (6, 6), positive definite.
        twist: V of that frame, in that frame, (angular [rad/s], linear [m/s]), (6,) or (N, 6).
        wrench: The total wrench on the body, in that frame, (moment [N m], force [N]), as ``twist``.

    Returns:
        dV/dt [rad/s^2, m/s^2], (6,) or (N, 6); see ``body_wrench`` for what its linear part is.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or an inertia that is not symmetric and positive definite.

    Reference: Modern Robotics, equation 8.40.
    """
    matrix = _symmetric(inertia)
    scale, factor = _factor(matrix)
    v, f = same_batches(6, {"twist": twist, "wrench": wrench})
    force = f + dual_bracket(v, v @ matrix)
    return like(cho_solve((factor, True), (force * scale).T).T * scale, twist)


def _symmetric(inertia: Any) -> Array:
    matrix = checked_array(inertia, (6, 6), "inertia")
    if np.abs(matrix - matrix.T).max() > SYMMETRIC * np.abs(matrix).max():
        raise InputError(Fault("inertia", "must be symmetric", matrix.tolist()))
    return 0.5 * (matrix + matrix.T)


def _factor(matrix: Array) -> tuple[Array, Array]:
    """Cholesky's factor of the matrix scaled to a unit diagonal, and the scale: kg and kg m^2 may be decades apart."""
    diagonal = np.diag(matrix)
    faults = [Fault(f"inertia[{i}][{i}]", "must be positive", float(d)) for i, d in enumerate(diagonal) if d <= 0.0]
    if faults:
        raise InputError(faults)
    scale = 1.0 / np.sqrt(diagonal)
    try:
        factor = np.asarray(np.linalg.cholesky(matrix * np.outer(scale, scale)), dtype=np.float64)
    except np.linalg.LinAlgError:
        factor = np.zeros((1, 1))
    if np.diag(factor).min() ** 2 < SINGULAR:
        problem = "must be positive definite: along some direction this body has no inertia, or a negative one"
        raise InputError(Fault("inertia", problem, matrix.tolist()))
    return scale, factor
