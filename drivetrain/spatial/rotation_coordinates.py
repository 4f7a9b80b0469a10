"""Three numbers for a rotation, and how their rates follow from the angular velocity."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.rotations import log_rotation, rpy_from_rotation, skew

# Of (1 - (x/2) cot(x/2)) / x^2 in x^2: |B_2k| / (2k)!, B the Bernoulli numbers.
SERIES = (
    1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600,
    3617 / 10670622842880000,
)  # fmt: skip
SMALL = 0.5  # rad; the ninth term is below 1e-15 of the first, in the slope too
UPRIGHT = 1e-9  # cosine of the pitch at which roll and yaw cannot be told apart any more


class RotationCoordinates(ABC):
    """Base of the choices of coordinates."""

    @abstractmethod
    def values(self, rotation: Array) -> Array:
        """The coordinates of a rotation.

        [rad], (3,).
        """

    @abstractmethod
    def rate_matrix(self, rotation: Array) -> Array:
        """The matrix that takes the angular velocity in the body frame to the rates of the coordinates.

        [-], (3, 3).
        """

    @abstractmethod
    def rate_matrix_rate(self, rotation: Array, spin: Array) -> Array:
        """The time derivative of the rate matrix.

        [1/s], (3, 3).
        """


@dataclass(frozen=True)
class RotationVector(RotationCoordinates):
    """Exponential coordinates: axis times angle, angle from 0 to pi; they jump where the angle passes pi.

    Reference: Modern Robotics, section 5.1.5, whose matrix A(r) is the inverse of the rate matrix.
    """

    def values(self, rotation: Array) -> Array:
        return log_rotation(rotation)

    def rate_matrix(self, rotation: Array) -> Array:
        vector = log_rotation(rotation)
        turn = skew(vector)
        factor, _ = _factors(math.hypot(*vector))
        return np.asarray(np.eye(3) + 0.5 * turn + factor * (turn @ turn))

    def rate_matrix_rate(self, rotation: Array, spin: Array) -> Array:
        vector = log_rotation(rotation)
        rate = self.rate_matrix(rotation) @ spin
        turn, turning = skew(vector), skew(rate)
        factor, slope = _factors(math.hypot(*vector))
        grown = slope * float(vector @ rate)
        return np.asarray(0.5 * turning + grown * (turn @ turn) + factor * (turning @ turn + turn @ turning))


@dataclass(frozen=True)
class RollPitchYaw(RotationCoordinates):
    """Roll about x, then pitch about y, then yaw about z, axes fixed, as in URDF; singular at a pitch of 90 degrees."""

    def values(self, rotation: Array) -> Array:
        return rpy_from_rotation(rotation)

    def rate_matrix(self, rotation: Array) -> Array:
        (sr, cr), (sp, cp) = _roll_and_pitch(rotation)
        return np.array([[1.0, sr * sp / cp, cr * sp / cp], [0.0, cr, -sr], [0.0, sr / cp, cr / cp]])

    def rate_matrix_rate(self, rotation: Array, spin: Array) -> Array:
        (sr, cr), (sp, cp) = _roll_and_pitch(rotation)
        roll, pitch, _ = self.rate_matrix(rotation) @ spin
        by_roll = np.array([[0.0, cr * sp / cp, -sr * sp / cp], [0.0, -sr, -cr], [0.0, cr / cp, -sr / cp]])
        by_pitch = np.array([[0.0, sr, cr], [0.0, 0.0, 0.0], [0.0, sr * sp, cr * sp]]) / cp**2
        return np.asarray(roll * by_roll + pitch * by_pitch)


ROTATION_VECTOR = RotationVector()


def _factors(angle: float) -> tuple[float, float]:
    """The factor c = (1 - (x/2) cot(x/2)) / x^2, and its derivative over x."""
    square = angle * angle
    if angle < SMALL:
        factor = sum(term * square**k for k, term in enumerate(SERIES))
        slope = sum(2.0 * k * term * square ** (k - 1) for k, term in enumerate(SERIES) if k)
        return factor, slope
    half = 0.5 * angle
    cot = math.cos(half) / math.sin(half)
    factor = (1.0 - half * cot) / square
    slope = ((half / math.sin(half) ** 2 - cot) / (2.0 * square) - 2.0 * factor / angle) / angle
    return factor, slope


def _roll_and_pitch(rotation: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Sines and cosines."""
    cosine = math.hypot(rotation[0, 0], rotation[1, 0])
    if cosine < UPRIGHT:
        problem = "are not unique at a pitch of 90 degrees"
        raise InputError(Fault("roll and yaw", problem, None, "take RotationVector() for coordinates"))
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    return (math.sin(roll), math.cos(roll)), (-float(rotation[2, 0]), cosine)
