"""The mass matrix over the gear ratio: powers of the ratio, limits, and checks of input."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import balanced_rotor, motion, random_arm

from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.book.ratio_sweep import coupling, sweep_ratio, with_ratio
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError

ELBOWS = np.column_stack([np.zeros(19), np.linspace(0.0, np.pi, 19)])


def test_book_arm_by_hand() -> None:
    """M = [[4 + 0.00125 + 0.005 + G^2 J + 2c, 1 + G J + c], [., 1 + G^2 J]] with J = 0.00125; section 8.9.2."""
    ratios, c, j = np.array([1.0, 10.0, 100.0]), np.cos(ELBOWS[:, 1]), 0.00125
    found = sweep_ratio(load_arm("planar-2r"), ELBOWS, ratios)
    for row, g in enumerate(ratios):
        first, second = 4.00625 + g * g * j + 2 * c, 1 + g * g * j
        np.testing.assert_allclose(found.coupling[row], (1 + g * j + c) / np.sqrt(first * second), rtol=1e-12)
        np.testing.assert_allclose(found.variation[row], [4.0 / first.mean(), 0.0], atol=1e-12)
    np.testing.assert_array_equal(found.ratios, ratios)


def test_constant_linear_and_square_part() -> None:
    """With balanced rotors M(G) = A + G B + G^2 D, D the diagonal of the rotors' inertias."""
    rng = np.random.default_rng(110)
    bare = random_arm(110)
    arm = with_rotors(bare, [balanced_rotor(rng, i - 1) for i in range(6)])
    q, _, _ = motion(110, 6, 3)
    at = {g: mass_matrix(with_ratio(arm, g), q) for g in (1.0, 2.0, 3.0, 50.0)}
    square = 0.5 * (at[3.0] - 2 * at[2.0] + at[1.0])
    linear = at[2.0] - at[1.0] - 3 * square
    constant = at[1.0] - linear - square
    np.testing.assert_allclose(constant + 50 * linear + 2500 * square, at[50.0], rtol=1e-9, atol=1e-9)
    axial = np.diag([rotor.axial_inertia for rotor in arm.rotors])
    np.testing.assert_allclose(square, np.tile(axial, (3, 1, 1)), atol=1e-13)
    assert np.abs(np.diagonal(linear, axis1=1, axis2=2)).max() < 1e-13
    assert np.abs(linear).max() > 1e-5  # rotors do couple


def test_shares_of_coupling_fall_with_the_ratio() -> None:
    """With ten times the ratio the links' share of coupling is a hundredth, the rotors' share a tenth."""
    arm = load_arm("planar-2r")
    ratios = np.array([1e4, 1e5])
    full = sweep_ratio(arm, ELBOWS, ratios)
    assert full.coupling[0].max() / full.coupling[1].max() == pytest.approx(10.0, rel=0.3)
    reflected = sweep_ratio(at_level(arm, RotorLevel.REFLECTED), ELBOWS, ratios)
    assert reflected.coupling[0].max() / reflected.coupling[1].max() == pytest.approx(100.0, rel=1e-3)
    assert full.variation[0, 0] / full.variation[1, 0] == pytest.approx(100.0, rel=1e-3)
    assert full.coupling[1].min() == pytest.approx(1e-5, rel=0.02)  # independent of the posture: 1/G


def test_with_ratio_keeps_signs_and_direct_drives() -> None:
    bare = random_arm(111, "RRR")
    arm = with_ratio(with_rotors(bare, [Rotor(-50.0, 1e-4), None, Rotor(7.0, 1e-4)]), 20.0)
    assert [r.ratio if r else None for r in arm.rotors] == [-20.0, None, 20.0]


def test_coupling_by_hand() -> None:
    assert coupling(np.diag([3.0, 1e-6, 2.0])) == 0.0
    assert coupling([[4.0, -1.0], [-1.0, 1.0]]) == pytest.approx(0.5)
    assert coupling([[5.0]]) == 0.0
    # A change of units of one joint has no effect.
    matrix = mass_matrix(load_arm("ur5"), motion(112, 6, 4)[0])
    scale = np.array([1.0, 1e3, 1e-3, 7.0, 1.0, 1.0])
    np.testing.assert_allclose(coupling(matrix * np.outer(scale, scale)), coupling(matrix), rtol=1e-12)
    assert coupling(matrix).shape == (4,)


def test_wrong_input() -> None:
    arm = load_arm("planar-2r")
    for ratios in ([0.0], [-10.0], [np.nan], [[10.0]]):
        with pytest.raises(InputError, match="ratio"):
            sweep_ratio(arm, ELBOWS, ratios)
    for q in (np.zeros(2), np.empty((0, 2)), np.zeros((3, 3))):
        with pytest.raises(InputError, match="q"):
            sweep_ratio(arm, q, [10.0])
    with pytest.raises(InputError, match="no rotors"):
        with_ratio(load_arm("ur5"), 10.0)
    for matrix in (np.ones((2, 3)), np.diag([1.0, 0.0]), np.ones(3), [[np.inf, 0], [0, 1]]):
        with pytest.raises(InputError, match="matrix"):
            coupling(matrix)
