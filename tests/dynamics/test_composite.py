"""Composite bodies against columns from the recursion, which shares only the table of constants."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.dynamics.samples import run

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
