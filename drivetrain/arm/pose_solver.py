"""Inverse kinematics: joint positions for one pose of the tip, and along a path.

One pose: damped least squares within the joint ranges, from the given positions; if that does not converge, from random
positions, of which the solution nearest to the given ones is taken. Along a path: Newton's method from point to point,
so that the arm keeps its posture, with exact derivatives over the distance. For a redundant arm the joint rates have
the least norm.

Reference: Modern Robotics, section 6.2; Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt
    method, IEEE Trans. Robotics 27 (2011) 984-991; Golub and Pereyra, The differentiation of pseudo-inverses, SIAM J.
    Numerical Analysis 10 (1973) 413-432.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import degrees, hypot, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import tip_jacobian_rate, tip_pose_and_jacobian
from drivetrain.arrays import Array, checked_array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.rotations import axial, log_rotation
from drivetrain.spatial.tool_path import PathSamples

REACHED = 1e-11  # tolerance of the pose [m over the arm's size, rad]
STEPS = 100  # largest number of steps of the search for one pose
NEWTON_STEPS = 8
RESTARTS = 20
STALLED = 1e-4  # relative decrease of the squared pose error below which the search stops
SINGULAR = 1e-3  # smallest over largest singular value of the Jacobian, lengths over the arm's size
COARSE = 32  # pieces of a path, each halved if Newton's method does not converge
HALVINGS = 12
FAR = 0.5  # [rad or m over the arm's size] distance from the predicted positions that means another posture
PLACE = slice(3, 6)  # rows of a task with free rotation


class JointPath(NamedTuple):
    """Joint positions along a path and their derivatives over the distance, (N, n) each [rad or m, per m, m^2]."""

    position: Array
    first: Array
    second: Array


def inverse_kinematics(arm: Arm, pose: Any, start: Any, *, rotation: bool = True) -> Array:
    """Joint positions, inside the joints' ranges, at which the tip has a pose.

    Args:
        arm: The arm.
        pose: Required pose of the tip in the base frame [m], (4, 4).
        start: Initial positions [rad or m], (n,); of several solutions, one near to these is returned.
        rotation: Whether the tip's rotation is required; False: its position only.

    Returns:
        Positions [rad or m], (n,); the error of the tip is below 1e-11 of the arm's size and 1e-11 rad.

    Raises:
        InputError: Wrong shapes, or a pose that is out of reach, with the remaining error.

    Example:
        >>> arm = dt.load_arm("ur5")
        >>> pose = dt.tip_pose(arm, [0.1, -1.2, 1.4, -1.7, -1.5, 0.3])
        >>> dt.inverse_kinematics(arm, pose, [0.0, -1.0, 1.0, -1.5, -1.5, 0.0]).round(6)
        array([ 0.1, -1.2,  1.4, -1.7, -1.5,  0.3])
    """
    wanted, first = checked_array(pose, (4, 4), "pose"), checked_array(start, (arm.n,), "start")
    rows = slice(0, 6) if rotation else PLACE
    q, missing = _searched(arm, wanted, np.clip(first, arm.lower, arm.upper), rows)
    if missing is None:
        return q
    best = (q, missing)
    random = np.random.default_rng(0)
    low, high = (np.where(np.isfinite(end), end, side * pi) for end, side in ((arm.lower, -1.0), (arm.upper, 1.0)))
    found = []
    for _ in range(RESTARTS):
        q, missing = _searched(arm, wanted, random.uniform(low, high), rows)
        if missing is None:
            found.append(q)
        elif missing @ missing < best[1] @ best[1]:
            best = (q, missing)
    if found:
        return min(found, key=lambda q: float(np.abs(q - first).max()))
    turn, way = best[1][:3], best[1][3:] * size_of(arm)
    off = f"{1e3 * hypot(*way):.3g} mm" + (f" and {degrees(hypot(*turn)):.3g} deg" if rotation else "")
    at = ", ".join(f"{1e3 * x:.4g}" for x in wanted[:3, 3])
    raise InputError(Fault("pose", f"at [{at}] mm is out of reach: the nearest pose found misses it by {off}"))


def size_of(arm: Arm) -> float:
    """Characteristic length of the arm: the largest distance from a joint to the tip [m], all joints at zero."""
    return float(np.linalg.norm(arm.joint_points - arm.tip[:3, 3], axis=1).max()) or 1.0


def _searched(arm: Arm, wanted: Array, q: Array, rows: slice) -> tuple[Array, Array | None]:
    """Damped least squares within the joint ranges: final positions, and their pose error (None: converged)."""
    size, damping = size_of(arm), 1.0
    missing, jacobian = (one[0] for one in _missing(arm, wanted[None], q[None], size))
    for _ in range(STEPS):
        error, columns = missing[rows], jacobian[rows]
        power = float(error @ error)
        if power <= REACHED**2:
            return q, None
        step = _damped(columns, error, damping * power)
        stopped = ((q <= arm.lower) & (step < 0.0)) | ((q >= arm.upper) & (step > 0.0))
        if stopped.any():  # joints at their limits are fixed, and the others take the rest of the step
            step = _damped(columns * ~stopped, error, damping * power)
        there = np.clip(q + step, arm.lower, arm.upper)
        left, then = (one[0] for one in _missing(arm, wanted[None], there[None], size))
        rest = float(left[rows] @ left[rows])
        if rest < power:
            q, missing, jacobian, damping = there, left, then, max(0.2 * damping, 1e-6)
            if rest > (1.0 - STALLED) * power:
                break
        else:
            damping *= 5.0
            if damping > 1e6:
                break
    return q, missing


def _damped(jacobian: Array, error: Array, damping: float) -> Array:
    square = jacobian @ jacobian.T + (damping + 1e-15) * np.eye(len(error))
    return np.asarray(jacobian.T @ np.linalg.solve(square, error))


def _missing(arm: Arm, wanted: Array, q: Array, size: float) -> tuple[Array, Array]:
    """Pose errors of the tip, (N, 6), and the Jacobians; linear rows are divided by the arm's size."""
    there, jacobian = tip_pose_and_jacobian(arm, q)
    jacobian[:, 3:] /= size
    turns = wanted[:, :3, :3] @ np.swapaxes(there[:, :3, :3], 1, 2)
    # for batches the sine of the angle is used, which equals the angle where that is small
    angular = log_rotation(turns[0])[None] if len(q) == 1 else 0.5 * axial(turns)
    return np.hstack([angular, (wanted[:, :3, 3] - there[:, :3, 3]) / size]), jacobian


def follow(
    arm: Arm, path: Callable[[Array], PathSamples], length: float, start: Array, *, rotation: bool = True
) -> Callable[[Array], JointPath]:
    """Joint positions [rad or m] along a path from ``start`` in one posture, as a function of the distance [m], (N,).

    Where the path leaves the reach of the arm or comes to a singular pose, this or the returned function raises
    PathLostError.
    """
    from scipy.interpolate import BPoly  # takes long to import, and few studies follow paths

    rows, size = slice(0, 6) if rotation else PLACE, size_of(arm)
    first = path(np.zeros(1))
    knots, coarse = [0.0], [_rates(first, start[None], _missing(arm, first.poses, start[None], size)[1], rows, size)]
    for goal in np.linspace(0.0, length, COARSE + 1)[1:]:
        _go_on(arm, path, knots, coarse, float(goal), rows, size)
    guess = BPoly.from_derivatives(np.array(knots), np.concatenate([np.stack(one, axis=1) for one in coarse]))

    def at(s: Array) -> JointPath:
        wanted = path(s)
        q, jacobian, reached = _newton(arm, wanted.poses, guess(s), rows, size)
        values = np.linalg.svd(jacobian[:, rows], compute_uv=False)
        weak = ~reached | (values[:, min(arm.n, values.shape[1]) - 1] < SINGULAR * values[:, 0])
        if weak.any():
            raise PathLostError(float(s[int(np.argmax(weak))]), "singular")
        return _rates(wanted, q, jacobian, rows, size)

    return at


class PathLostError(Exception):
    """The distance at which an arm cannot follow a path [m], and why: ``out of reach`` or ``singular``."""

    def __init__(self, distance: float, why: str) -> None:
        super().__init__(distance, why)
        self.distance, self.why = distance, why


def _go_on(
    arm: Arm,
    path: Callable[[Array], PathSamples],
    knots: list[float],
    coarse: list[JointPath],
    goal: float,
    rows: slice,
    size: float,
) -> None:
    """Add knots up to the distance ``goal``; steps are halved if Newton's method does not converge."""
    step, halved = goal - knots[-1], 0
    while knots[-1] < goal:
        there = min(knots[-1] + step, goal) if halved else goal
        ahead, (q, first, second) = there - knots[-1], coarse[-1]
        predicted = q + ahead * (first + 0.5 * ahead * second)
        target = path(np.array([there]))
        found, jacobian, reached = _newton(arm, target.poses, predicted, rows, size)
        if reached.all() and np.abs(found - predicted).max() < FAR and np.abs(found - q).max() < FAR:
            knots.append(there)
            coarse.append(_rates(target, found, jacobian, rows, size))
            continue
        step, halved = 0.5 * (step if halved else ahead), halved + 1
        if halved > HALVINGS:
            raise PathLostError(there, _why(arm, path, goal, q[0], rows))


def _why(arm: Arm, path: Callable[[Array], PathSamples], goal: float, q: Array, rows: slice) -> str:
    """Why the path cannot be followed: ``singular``, or ``out of reach`` if joint ranges are not the reason."""
    free = replace(arm, lower=np.full(arm.n, -np.inf), upper=np.full(arm.n, np.inf))
    try:
        inverse_kinematics(free, path(np.array([goal])).poses[0], q, rotation=rows != PLACE)
    except InputError:
        return "out of reach"
    return "singular"


def _newton(arm: Arm, wanted: Array, q: Array, rows: slice, size: float) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Newton's method from the given positions: positions, Jacobians, and convergence, (N, n), (N, 6, n), (N,)."""
    for steps_left in reversed(range(NEWTON_STEPS)):
        missing, jacobian = _missing(arm, wanted, q, size)
        reached = np.abs(missing[:, rows]).max(axis=1) <= REACHED
        if reached.all() or not steps_left:
            break
        inverse = np.linalg.pinv(jacobian[:, rows], rcond=1e-9)
        q = q + (inverse @ missing[:, rows, None])[:, :, 0]
    return q, jacobian, reached


def _rates(wanted: PathSamples, q: Array, jacobian: Array, rows: slice, size: float) -> JointPath:
    """Derivatives of the joint positions over the distance, of least norm if the arm is redundant."""
    scale = np.repeat([1.0, 1.0 / size], 3)
    first, second = (rate * scale for rate in wanted[1:])
    inverse = np.linalg.pinv(jacobian[:, rows], rcond=1e-9)
    slope = (inverse @ first[:, rows, None])[:, :, 0]
    rate = tip_jacobian_rate(jacobian, slope)[:, rows]
    curve = inverse @ (second[:, rows, None] - rate @ slope[:, :, None])
    if q.shape[1] > rate.shape[1]:
        across = np.swapaxes(rate, 1, 2) @ (np.swapaxes(inverse, 1, 2) @ slope[:, :, None])
        curve += across - inverse @ (jacobian[:, rows] @ across)
    return JointPath(q, slope, curve[:, :, 0])
