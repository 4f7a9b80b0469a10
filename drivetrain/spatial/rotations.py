"""Rotations: exponential and logarithm, accurate at all angles from 0 to pi, and roll-pitch-yaw angles."""

from __future__ import annotations

from math import atan2, cos, hypot, sin, sqrt
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array


def skew(vector: Any) -> Array:
    """The skew-symmetric matrix of a vector v, ``skew(v) @ w = v x w``, (3, 3)."""
    x, y, z = checked_array(vector, (3,), "vector")
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_rotation(rotation_vector: Any) -> Array:
    """The rotation about a vector by an angle equal to its length.

    Args:
        rotation_vector: Axis times angle [rad], (3,).

    Returns:
        Rotation matrix [-], (3, 3), to a few units of rounding at every angle.

    Reference: Modern Robotics (Lynch and Park), equation 3.51 (Rodrigues).
    """
    vector = checked_array(rotation_vector, (3,), "rotation_vector")
    turn = skew(vector)
    a, b, _ = exp_series(hypot(*vector))
    return np.eye(3) + a * turn + b * (turn @ turn)


def exp_series(angle: float) -> tuple[float, float, float]:
    """The factors sin x / x, (1 - cos x) / x^2 and (x - sin x) / x^3 of the exponential, accurate also near zero."""
    if angle == 0.0:
        return 1.0, 0.5, 1.0 / 6.0
    half = 0.5 * angle
    b = 0.5 * (sin(half) / half) ** 2  # 1 - cos x would cancel
    if angle < 1e-2:
        square = angle * angle
        return sin(angle) / angle, b, 1.0 / 6.0 - square / 120.0 + square * square / 5040.0
    return sin(angle) / angle, b, (angle - sin(angle)) / angle**3


def log_rotation(rotation: Any) -> Array:
    """The rotation vector of a rotation matrix.

    Shepperd's quaternion and atan2 lose no digits at small angles or near half a turn, unlike the textbook method with
    acos and division by the sine.

    Args:
        rotation: Matrix, (3, 3).

    Returns:
        Axis times angle [rad], (3,), angle between 0 and pi. At exactly half a turn, where both signs are valid, the
        one whose largest component is positive.

    Reference: Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978) 223-224.
    """
    real, imaginary = quaternion(rotation)
    size = hypot(*imaginary)
    if size == 0.0:
        return np.zeros(3)
    return imaginary * (2.0 * atan2(size, real) / size)


def quaternion(rotation: Any) -> tuple[float, Array]:
    """Real part, not negative, and imaginary part, (3,), of the unit quaternion of a rotation matrix."""
    r = checked_array(rotation, (3, 3), "rotation")
    trace = float(np.trace(r))
    largest = int(np.argmax([r[0, 0], r[1, 1], r[2, 2], trace]))
    if largest == 3:
        real, imaginary = 1.0 + trace, axial(r)
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        imaginary = np.empty(3)
        imaginary[i] = 1.0 + r[i, i] - r[j, j] - r[k, k]
        imaginary[j] = r[j, i] + r[i, j]
        imaginary[k] = r[k, i] + r[i, k]
        real = float(axial(r)[i])
    size = hypot(real, *imaginary) * (-1.0 if real < 0.0 else 1.0)
    return real / size, imaginary / size


def rotation_from_quaternion(real: float, imaginary: Any) -> Array:
    """The rotation matrix of a quaternion of any length, its imaginary part (3,); the identity for zero."""
    vector = checked_array(imaginary, (3,), "imaginary")
    sine = hypot(*vector)
    return exp_rotation(vector * (2.0 * atan2(sine, real) / sine if sine else 0.0))


def axial(r: Array) -> Array:
    """Vector of ``r - r^T``, (..., 3): for a rotation, the axis times twice the sine of the angle."""
    return np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1)


def rotation_from_rpy(rpy: Any) -> Array:
    """The rotation by roll about x, then pitch about y, then yaw about z, all about fixed axes.

    Args:
        rpy: Roll, pitch and yaw [rad], (3,).

    Returns:
        Rotation matrix [-], (3, 3).
    """
    roll, pitch, yaw = checked_array(rpy, (3,), "rpy")
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_from_rotation(rotation: Any) -> Array:
    """Roll, pitch and yaw of a rotation matrix.

    Roll, pitch, yaw [rad], (3,); pitch between -pi/2 and pi/2, and yaw zero where pitch is +-pi/2 (there only the
    sum or difference of roll and yaw is defined).
    """
    r = checked_array(rotation, (3, 3), "rotation")
    cos_pitch = hypot(r[0, 0], r[1, 0])
    yaw = atan2(r[1, 0], r[0, 0]) if cos_pitch >= 1e-14 else 0.0
    # After removing the yaw, roll and pitch follow from well-conditioned entries, even if the yaw itself is rounding.
    cy, sy = cos(yaw), sin(yaw)
    roll = atan2(sy * r[0, 2] - cy * r[1, 2], cy * r[1, 1] - sy * r[0, 1])
    return np.array([roll, atan2(-r[2, 0], cy * r[0, 0] + sy * r[1, 0]), yaw])


def frame_along(axis: Any) -> Array:
    """The rotation that takes the z axis to a given direction by the smallest angle.

    Rotation matrix [-], (3, 3), with the direction as its third column; the identity for +z, half a turn about x
    for -z.
    """
    x, y, z = checked_array(axis, (3,), "axis")
    across = x * x + y * y
    if across == 0.0:
        return np.diag([1.0, 1.0, 1.0]) if z > 0.0 else np.diag([1.0, -1.0, -1.0])
    divisor = 1.0 + z if z > 0.0 else across / (1.0 - z)  # 1 + z without cancellation
    return np.array(
        [
            [1.0 - x * x / divisor, -x * y / divisor, x],
            [-x * y / divisor, 1.0 - y * y / divisor, y],
            [-x, -y, z],
        ]
    )


def nearest_rotation(matrix: Any) -> Array:
    """The rotation matrix nearest to a matrix in the Frobenius norm, (3, 3)."""
    left, _, right = np.linalg.svd(checked_array(matrix, (3, 3), "matrix"))
    if np.linalg.det(left @ right) < 0.0:
        left = left * np.array([1.0, 1.0, -1.0])
    return np.asarray(left @ right)


def is_rotation(matrix: Any, tolerance: float = 1e-6) -> bool:
    """Whether a matrix is a rotation: orthogonal, and not a reflection."""
    r = checked_array(matrix, (3, 3), "matrix")
    error = float(np.abs(r.T @ r - np.eye(3)).max())
    return error <= tolerance and float(np.linalg.det(r)) > 0.0


def unit(vector: Any) -> Array:
    """The vector scaled to unit length, (3,)."""
    v = checked_array(vector, (3,), "vector")
    return v / sqrt(float(v @ v))
