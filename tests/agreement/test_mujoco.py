"""Agreement with MuJoCo on the same numbers, to 1e-10 of the largest value."""

from __future__ import annotations

import numpy as np
import pytest
from in_mujoco import InMujoco
from random_arms import coaxial_rotor, error, motion, random_arm

from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix

TOLERANCE = 1e-10  # asked for; MuJoCo keeps inertias as principal moments and quaternions, which costs some digits


@pytest.mark.parametrize("joints", ["RRRRRR", "RPRPR", "PRRP", "R"])
@pytest.mark.parametrize("seed", range(4))
def test_without_rotors(seed: int, joints: str) -> None:
    arm = random_arm(seed, joints)
    q, qd, qdd = motion(seed, arm.n)
    twin = InMujoco(arm)
    wanted = np.array([twin.torque(*sample) for sample in zip(q, qd, qdd, strict=True)])
    assert error(inverse_dynamics(arm, q, qd, qdd), wanted) < TOLERANCE
    assert error(mass_matrix(arm, q), np.array([twin.mass_matrix(x) for x in q])) < TOLERANCE
    still = np.zeros(arm.n)
    assert error(gravity_torque(arm, q), np.array([twin.torque(x, still, still) for x in q])) < TOLERANCE
    # The condition of the mass matrix, up to 1e4 here, comes on top.
    assert error(forward_dynamics(arm, q, qd, wanted), qdd) < 1e4 * TOLERANCE


@pytest.mark.parametrize("seed", range(4))
def test_reflected_inertia_is_armature(seed: int) -> None:
    bare = random_arm(seed)
    rng = np.random.default_rng(seed)
    rotors = [coaxial_rotor(rng) for _ in range(bare.n)]
    arm = with_rotors(bare, rotors, level=RotorLevel.REFLECTED)
    locked = with_rotors(bare, rotors, level=RotorLevel.NONE)
    q, qd, qdd = motion(seed, arm.n)
    armature = np.array([rotor.ratio**2 * rotor.axial_inertia for rotor in arm.rotors])
    without, twin = InMujoco(bare), InMujoco(bare, armature)
    extra = np.array([twin.torque(*s) - without.torque(*s) for s in zip(q, qd, qdd, strict=True)])
    found = inverse_dynamics(arm, q, qd, qdd) - inverse_dynamics(locked, q, qd, qdd)
    assert error(found, extra) < TOLERANCE
