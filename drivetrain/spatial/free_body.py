"""The motion of a single rigid body, free or under a wrench.

The method is a Runge-Kutta method of order four in the exponential coordinates of each step, so that rotations stay
orthogonal to rounding in flights of any length.

Reference: Modern Robotics, equation 8.40; H. Munthe-Kaas, High order Runge-Kutta methods on manifolds, Applied
    Numerical Mathematics 29 (1999) 115-127.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_solve

from drivetrain.arrays import Array, batch, checked_array
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.spatial.poses import exp_pose
from drivetrain.spatial.rotations import is_rotation
from drivetrain.spatial.wrenches import bracket, dual_bracket, like, same_batches

SYMMETRIC = 1e-9  # relative asymmetry of a spatial inertia accepted as rounding
SINGULAR = 1e-12  # smallest pivot of an inertia scaled to a unit diagonal; rounding is about 1e-16


def momentum(inertia: Any, twist: Any) -> Array:
    """The momentum (angular, linear) of a body, (6,) or (N, 6); Modern Robotics, equation 8.34."""
    return like(batch(twist, 6, "twist") @ _symmetric(inertia), twist)


def kinetic_energy(inertia: Any, twist: Any) -> Array:
    """The kinetic energy of a body; Modern Robotics, equation 8.33."""
    rows = batch(twist, 6, "twist")
    return like(0.5 * np.sum(rows * (rows @ _symmetric(inertia)), axis=1), twist)


def body_wrench(inertia: Any, twist: Any, acceleration: Any) -> Array:
    """The wrench for an acceleration of a body: ``F = G dV/dt - ad_V^T G V``.

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
    v, rate = same_batches(twist=twist, acceleration=acceleration)
    return like(rate @ matrix - dual_bracket(v, v @ matrix), twist)


def body_acceleration(inertia: Any, twist: Any, wrench: Any) -> Array:
    """The acceleration of a body under a wrench: equation 8.40 solved for dV/dt.

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
    v, f = same_batches(twist=twist, wrench=wrench)
    force = f + dual_bracket(v, v @ matrix)
    return like(cho_solve((factor, True), (force * scale).T).T * scale, twist)


def _symmetric(inertia: Any) -> Array:
    matrix = checked_array(inertia, (6, 6), "inertia")
    if np.abs(matrix - matrix.T).max() > SYMMETRIC * np.abs(matrix).max():
        raise InputError(Fault("inertia", "must be symmetric", matrix.tolist()))
    return 0.5 * (matrix + matrix.T)


def _factor(matrix: Array) -> tuple[Array, Array]:
    """Cholesky factor of the matrix scaled to a unit diagonal, and the scale; kg and kg m^2 may differ by decades."""
    diagonal = np.diag(matrix)
    raise_faults(Fault(f"inertia[{i}][{i}]", "must be positive", float(d)) for i, d in enumerate(diagonal) if d <= 0.0)
    scale = 1.0 / np.sqrt(diagonal)
    try:
        factor = np.asarray(np.linalg.cholesky(matrix * np.outer(scale, scale)), dtype=np.float64)
    except np.linalg.LinAlgError:
        factor = np.zeros((1, 1))
    if np.diag(factor).min() ** 2 < SINGULAR:
        problem = "must be positive definite: along some direction this body has no inertia, or a negative one"
        raise InputError(Fault("inertia", problem, matrix.tolist()))
    return scale, factor


Wrench = Callable[[float, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Motion of a body over time."""

    time: Array  # [s], (N,)
    poses: Array  # of the body's frame in space, translation [m], (N, 4, 4)
    twists: Array  # of the body's frame, in that frame, (angular [rad/s], linear [m/s]), (N, 6)


def free_motion(inertia: Any, pose_s_b: Any, twist: Any, time: Any, *, wrench: Wrench | None = None) -> FreeMotion:
    """Integrate the motion of a rigid body, with one Runge-Kutta step between two instants of ``time``.

    Args:
        inertia: Spatial inertia in the body's frame [kg m^2, kg m, kg], (6, 6), positive definite.
        pose_s_b: Pose of the body's frame in space at the start, (4, 4); translation [m].
        twist: Initial twist of the body's frame, in that frame, (angular [rad/s], linear [m/s]), (6,).
        time: Increasing [s], (N,); the error is proportional to the fourth power of the step.
        wrench: Function of time [s], pose and twist that returns the wrench on the body in its own frame,
            (moment [N m], force [N]), (6,). None: free flight.

    Returns:
        The motion at these times.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, times that do not increase, a pose without a valid rotation, or an
            inertia that is not symmetric and positive definite.
    """
    times = checked_array(time, (None,), "time")
    faults = []
    if len(times) < 1 or (np.diff(times) <= 0.0).any():
        faults.append(Fault("time", "must be at least one time, and increase [s]", times.tolist()[:8]))
    start = checked_array(pose_s_b, (4, 4), "pose_s_b")
    if not is_rotation(start[:3, :3]):
        faults.append(Fault("pose_s_b", "its rotation must be orthogonal with determinant +1", start.tolist()))
    raise_faults(faults)
    first = checked_array(twist, (6,), "twist")
    rate = _rate_law(inertia, wrench)
    poses, twists = np.empty((len(times), 4, 4)), np.empty((len(times), 6))
    poses[0], twists[0] = start, first
    for k, step in enumerate(np.diff(times)):
        poses[k + 1], twists[k + 1] = _step(rate, float(times[k]), float(step), poses[k], twists[k])
    return FreeMotion(times, poses, twists)


def space_momentum(inertia: Any, motion: FreeMotion) -> Array:
    """The momentum (angular, linear) in space, (N, 6), constant in free flight; Modern Robotics, 8.34, 3.98."""
    own = momentum(inertia, motion.twists)
    rotation, place = motion.poses[:, :3, :3], motion.poses[:, :3, 3]
    angular, linear = ((rotation @ part[:, :, None])[:, :, 0] for part in (own[:, :3], own[:, 3:]))
    return np.hstack([angular + np.cross(place, linear), linear])


def _rate_law(inertia: Any, wrench: Wrench | None) -> Wrench:
    # The inverse inertia, needed four times per step: its columns are the accelerations of unit wrenches at rest.
    inverse = body_acceleration(inertia, np.zeros((6, 6)), np.eye(6))
    matrix = np.asarray(inertia, dtype=np.float64)

    def rate(time: float, pose: Array, twist: Array) -> Array:
        force = bracket(twist).T @ (matrix @ twist)
        if wrench is not None:
            force = force + wrench(time, pose, twist)
        return np.asarray(inverse @ force)

    return rate


def _step(rate: Wrench, time: float, step: float, pose: Array, twist: Array) -> tuple[Array, Array]:
    shifts, rates = [np.zeros(6)], [np.zeros(6)]
    for share in (0.0, 0.5, 0.5, 1.0):
        shift, v = share * step * shifts[-1], twist + share * step * rates[-1]
        there = pose @ exp_pose(shift)
        shifts.append(_coordinate_rate(shift, v))
        rates.append(rate(time + share * step, there, v))
    shift = step / 6.0 * (shifts[1] + 2.0 * shifts[2] + 2.0 * shifts[3] + shifts[4])
    return pose @ exp_pose(shift), twist + step / 6.0 * (rates[1] + 2.0 * rates[2] + 2.0 * rates[3] + rates[4])


def _coordinate_rate(shift: Array, twist: Array) -> Array:
    """The rate of the exponential coordinates for a body twist, to the order that the method needs."""
    turn = bracket(shift)
    turned = turn @ twist
    return np.asarray(twist + 0.5 * turned + turn @ turned / 12.0)
