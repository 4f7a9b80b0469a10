"""Composite bodies against columns from the recursion, which shares only the table of constants."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.dynamics.samples import run
from drivetrain.errors import InputError

ROUNDING = 1e-13  # sums of some hundred terms of equal size


def by_columns(arm: Arm, q: np.ndarray) -> np.ndarray:
    repeated, units = np.repeat(q, arm.n, axis=0), np.tile(np.eye(arm.n), (len(q), 1))
    columns = run(packed(arm), (repeated, np.zeros(repeated.shape), units), gravity=np.zeros(3))
    return columns.reshape(len(q), arm.n, arm.n)


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("kind", [None, "coaxial", "balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "HRPH", "P", "R", "RRRRRRRRRRRR"])
def test_column_by_column(joints: str, kind: str | None, level: RotorLevel) -> None:
    for seed in range(3):
        arm = random_arm(seed, joints)
        if kind is not None:
            arm = with_rotors(arm, rotors_of(seed, kind, arm.n), level=level)
        q, _, _ = motion(seed, arm.n, 70)  # more than one block
        found = mass_matrix(arm, q)
        assert error(found, by_columns(arm, q)) < ROUNDING
        np.testing.assert_array_equal(found, np.swapaxes(found, 1, 2))
        np.testing.assert_array_equal(mass_matrix(arm, q[69]), found[69])


def test_angles_of_many_turns() -> None:
    arm = load_arm("puma560")
    q = np.array([[1e7, -2e6, 3e9, 1.0, 2.0, 3.0]])
    turns = np.array([[np.arctan2(np.sin(x), np.cos(x)) for x in q[0]]])
    assert error(mass_matrix(arm, q), mass_matrix(arm, turns)) < ROUNDING


def test_no_samples_and_too_large() -> None:
    arm = load_arm("ur5")
    assert mass_matrix(arm, np.zeros((0, 6))).shape == (0, 6, 6)
    with pytest.raises(InputError, match="too large"):
        mass_matrix(arm, np.full(6, 1e200))
    with pytest.raises(InputError, match="finite"):
        mass_matrix(arm, np.full(6, np.nan))
