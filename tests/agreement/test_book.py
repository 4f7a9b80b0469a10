"""Agreement with the book's equations 8.103 to 8.111, written literally."""

from __future__ import annotations

import numpy as np
import pytest
from book_newton_euler import book_torques
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.geared import with_rotors
from drivetrain.dynamics.inverse import drive_torques, inverse_dynamics

# The oracle turns its rotors by matrix exponentials of up to 400 rad, good to 1e-12 or so.
TOLERANCE = 1e-10


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "PRH"])
@pytest.mark.parametrize("kind", ["coaxial", "balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("seed", range(3))
def test_equations_8_103_to_8_111(seed: int, kind: str, joints: str) -> None:
    bare = random_arm(seed, joints)
    arm = with_rotors(bare, rotors_of(seed, kind, bare.n))
    q, qd, qdd = motion(seed, arm.n, count=3)
    tip = np.random.default_rng(seed).normal(size=(3, 6)) * 20
    wanted = np.array([book_torques(arm, *sample) for sample in zip(q, qd, qdd, tip, strict=True)])
    found = drive_torques(arm, q, qd, qdd, tip_wrench=tip)
    assert error(found.gear, wanted[:, 0]) < TOLERANCE
    assert error(found.motor, wanted[:, 1]) < TOLERANCE
    ratios = [1.0 if rotor is None else rotor.ratio for rotor in arm.rotors]
    assert error(inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip), wanted[:, 1] * ratios) < TOLERANCE
