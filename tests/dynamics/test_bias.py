"""The torques due to speeds, gravity and tip wrench add up to the whole."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.geared import with_rotors
from drivetrain.arm.kinematics import body_jacobian
from drivetrain.dynamics.derivatives import coriolis_matrix
from drivetrain.dynamics.inverse import bias_torque, gravity_torque, inverse_dynamics, tip_torque, velocity_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError

ROUNDING = 1e-12


@pytest.mark.parametrize("kind", ["coaxial", "unbalanced", "mixed"])
@pytest.mark.parametrize("seed", range(3))
def test_parts_make_the_whole(seed: int, kind: str) -> None:
    bare = random_arm(seed, EVERY_JOINT)
    arm = with_rotors(bare, rotors_of(seed, kind, bare.n))
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=(len(q), 6)) * 20
    velocity, held, pressed = velocity_torque(arm, q, qd), gravity_torque(arm, q), tip_torque(arm, q, tip)
    assert error(bias_torque(arm, q, qd), velocity + held) < ROUNDING
    assert error(bias_torque(arm, q, qd, tip_wrench=tip), velocity + held + pressed) < ROUNDING
    pushed = np.einsum("kij,kj->ki", mass_matrix(arm, q), qdd)
    whole = inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    assert error(pushed + bias_torque(arm, q, qd, tip_wrench=tip), whole) < ROUNDING
    assert error(np.einsum("kij,kj->ki", coriolis_matrix(arm, q, qd), qd), velocity) < ROUNDING
    assert error(velocity_torque(arm, q, -3.0 * qd), 9.0 * velocity) < ROUNDING
    assert error(np.einsum("kji,kj->ki", body_jacobian(arm, q), tip), pressed) < ROUNDING


def test_one_wrench_for_all_samples_and_one_sample() -> None:
    arm = random_arm(1)
    q, _, _ = motion(1, arm.n)
    wrench = np.arange(6.0)
    many = tip_torque(arm, q, wrench)
    assert many == pytest.approx(tip_torque(arm, q, np.tile(wrench, (len(q), 1))))
    assert tip_torque(arm, q[2], wrench) == pytest.approx(many[2])
    with pytest.raises(InputError, match="tip_wrench"):
        tip_torque(arm, q, np.zeros((len(q) - 1, 6)))
