"""Rates of coordinates against their differences, at small, ordinary and large angles."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.spatial.rotation_coordinates import RollPitchYaw, RotationCoordinates, RotationVector, _factors
from drivetrain.spatial.rotations import exp_rotation, rotation_from_rpy

STEP = 1e-4  # of a five-point difference: its error is 1e-16 from truncation, 1e-11 from rounding
CHOICES = [RotationVector(), RollPitchYaw()]


def differences(function: object, rotation: np.ndarray, spin: np.ndarray) -> np.ndarray:
    at = [function(rotation @ exp_rotation(k * STEP * spin)) for k in (-2, -1, 1, 2)]
    return (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * STEP)


def rotations() -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    axes = [axis / np.linalg.norm(axis) for axis in rng.normal(size=(9, 3))]
    angles = [0.0, 1e-8, 1e-3, 0.3, 0.499, 0.501, 1.7, 2.9, 3.1]
    return [exp_rotation(angle * axis) for angle, axis in zip(angles, axes, strict=True)]


@pytest.mark.parametrize("coordinates", CHOICES, ids=repr)
@pytest.mark.parametrize("rotation", rotations(), ids=[f"angle {k}" for k in range(9)])
def test_rates(coordinates: RotationCoordinates, rotation: np.ndarray) -> None:
    spin = np.array([0.4, -0.7, 0.5])
    wanted = differences(coordinates.values, rotation, spin)
    np.testing.assert_allclose(coordinates.rate_matrix(rotation) @ spin, wanted, atol=2e-9)
    slope = differences(coordinates.rate_matrix, rotation, spin)
    np.testing.assert_allclose(coordinates.rate_matrix_rate(rotation, spin), slope, atol=1e-8)


def test_matrix_of_the_book() -> None:
    """The inverse of A(r) = 1 - (1 - cos x)/x^2 [r] + (x - sin x)/x^3 [r]^2, section 5.1.5."""
    r = np.array([0.5, -0.8, 0.3])
    x = np.linalg.norm(r)
    turn = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    book = np.eye(3) - (1 - math.cos(x)) / x**2 * turn + (x - math.sin(x)) / x**3 * turn @ turn
    np.testing.assert_allclose(RotationVector().rate_matrix(exp_rotation(r)) @ book, np.eye(3), atol=1e-14)


def test_factors_in_many_digits() -> None:
    for angle in [1e-12, 1e-4, 0.05, 0.4999, 0.5, 1.0, 2.0, 3.1]:
        with mp.workdps(100):
            x = mp.mpf(angle)

            def whole(y: mp.mpf) -> mp.mpf:
                return (1 - y / 2 * mp.cot(y / 2)) / y**2

            h = mp.mpf(10) ** -12 * x
            wanted = (float(whole(x)), float((whole(x + h) - whole(x - h)) / (2 * h) / x))
        np.testing.assert_allclose(_factors(angle), wanted, rtol=1e-12)


def test_roll_and_yaw_at_a_right_angle_are_told() -> None:
    upright = rotation_from_rpy([0.3, math.pi / 2, 0.2])
    with pytest.raises(InputError, match=r"90 degrees.*RotationVector"):
        RollPitchYaw().rate_matrix(upright)
    RotationVector().rate_matrix(upright)
