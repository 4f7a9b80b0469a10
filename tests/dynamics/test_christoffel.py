"""Christoffel symbols against derivatives of M, the Coriolis matrix, the closed form, and passivity."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.derivatives import christoffel_symbols, coriolis_matrix
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix

KINDS = ("coaxial", "balanced", "unbalanced", "mixed")


def geared(seed: int, kind: str, level: RotorLevel = RotorLevel.FULL) -> Arm:
    bare = random_arm(seed, EVERY_JOINT)
    return with_rotors(bare, rotors_of(seed, kind, bare.n), level=level)


def slopes(arm: Arm, q: np.ndarray) -> np.ndarray:
    """dM_ij/dq_k by central differences of fourth order, (N, n, n, n)."""
    h = 2e-4  # the step is small because unbalanced rotors turn 30 times faster than their joints
    columns = []
    for unit in np.eye(arm.n):
        far, near = ([mass_matrix(arm, q + s * k * h * unit) for s in (1, -1)] for k in (2, 1))
        columns.append((8 * (near[0] - near[1]) - (far[0] - far[1])) / (12 * h))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("kind", KINDS)
def test_equation_8_17(kind: str, level: RotorLevel) -> None:
    arm = geared(60, kind, level)
    q, _, _ = motion(60, arm.n, 3)
    rate = slopes(arm, q)  # i j k: dM_ij/dq_k
    wanted = 0.5 * (rate + np.swapaxes(rate, 2, 3) - np.moveaxis(rate, 3, 1))
    # Errors of the differences: rounding of M over h, and (30 h)^4 due to the fast rotors.
    assert error(christoffel_symbols(arm, q), wanted) < 1e-8


@pytest.mark.parametrize("kind", KINDS)
def test_equations_8_18_and_8_19(kind: str) -> None:
    arm = geared(61, kind)
    q, qd, _ = motion(61, arm.n)
    symbols = christoffel_symbols(arm, q)
    assert error(np.einsum("sijk,sk->sij", symbols, qd), coriolis_matrix(arm, q, qd)) < 1e-13
    centrifugal = inverse_dynamics(arm, q, qd, np.zeros_like(q)) - gravity_torque(arm, q)
    assert error(np.einsum("sijk,sj,sk->si", symbols, qd, qd), centrifugal) < 1e-12
    np.testing.assert_array_equal(symbols, np.swapaxes(symbols, 2, 3))


@pytest.mark.parametrize("kind", KINDS)
def test_passivity(kind: str) -> None:
    """Proposition 8.1, with dM/dt by differences, independently of the symbols."""
    arm = geared(62, kind)
    q, qd, _ = motion(62, arm.n, 4)
    rate = np.einsum("sijk,sk->sij", slopes(arm, q), qd)
    skew = rate - 2.0 * coriolis_matrix(arm, q, qd)
    assert error(skew, -np.swapaxes(skew, 1, 2)) < 1e-8
    assert np.abs(skew).max() > 1e-2  # the matrix is not zero, which would be skew-symmetric too


def test_pairs_in_figure_8_2() -> None:
    """Unit masses and lengths at (0, 90 deg): Gamma_112 = Gamma_122 = -1 and Gamma_211 = 1, by equation 8.9."""
    screws = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, -1, 0]]
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, 0, 3] = [1.0, 2.0]
    arm = Arm.from_screws(home, screws, [1.0, 1.0], np.zeros((2, 3, 3)))
    wanted = np.zeros((2, 2, 2))
    wanted[0, 0, 1] = wanted[0, 1, 0] = wanted[0, 1, 1] = -1.0
    wanted[1, 0, 0] = 1.0
    np.testing.assert_allclose(christoffel_symbols(arm, [0.4, np.pi / 2]), wanted, atol=1e-15)
