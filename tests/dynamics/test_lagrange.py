"""Energies and powers: by hand, by differences along motions, in a passive fall, and checks of input."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.energy import kinetic_energy, potential_energy, power_balance
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics
from drivetrain.spatial.poses import inverse_pose, log_pose, pose

CASES = [(kind, level) for kind in ("coaxial", "balanced", "unbalanced", "mixed") for level in RotorLevel]


def geared(seed: int, kind: str, level: RotorLevel = RotorLevel.FULL) -> Arm:
    bare = random_arm(seed, EVERY_JOINT)
    return with_rotors(bare, rotors_of(seed, kind, bare.n), level=level)


def pendulum() -> Arm:
    """2 kg at 0.5 m below a joint about y, which is 1 m above the base: z = 1 - 0.5 cos q."""
    return Arm.from_screws([pose(point=[0, 0, 0.5])], [[0, 1, 0, -1, 0, 0]], [2.0], [np.eye(3) * 0.1])


def test_pendulum_by_hand() -> None:
    arm, q, qd = pendulum(), np.array([[0.0], [0.7], [np.pi]]), np.array([[1.0], [-2.0], [0.5]])
    np.testing.assert_allclose(potential_energy(arm, q), 2 * 9.81 * (1 - 0.5 * np.cos(q[:, 0])), rtol=1e-14)
    np.testing.assert_allclose(kinetic_energy(arm, q, qd), 0.5 * (2 * 0.25 + 0.1) * qd[:, 0] ** 2, rtol=1e-14)


def test_rotor_energies_by_hand() -> None:
    """A rotor of 0.3 kg, 0.002 kg m^2, ratio -50, on the base at a height of 1 m: spin and height count."""
    q, qd = [0.2], [3.0]
    bare, arm = pendulum(), with_rotors(pendulum(), [Rotor(-50.0, 0.002, mass=0.3)])
    spin = 0.5 * 0.002 * (50.0 * 3.0) ** 2
    for level, extra in ((RotorLevel.NONE, 0.0), (RotorLevel.REFLECTED, spin), (RotorLevel.FULL, spin)):
        found = kinetic_energy(at_level(arm, level), q, qd) - kinetic_energy(bare, q, qd)
        assert found == pytest.approx(extra, abs=1e-12)
    assert potential_energy(arm, q) - potential_energy(bare, q) == pytest.approx(0.3 * 9.81 * 1.0, rel=1e-13)


def test_an_unbalanced_rotor_lifts_its_own_weight() -> None:
    """0.4 kg at 0.1 m from the axis, level with it at zero; with ratio 3 its height is 1 - 0.1 sin(3 q)."""
    rotor = Rotor(3.0, np.eye(3) * 1e-3, mass=0.4, home=pose(point=[0.1, 0, 1.0]), screw=[0, 1, 0, -1, 0, 0])
    arm, q = with_rotors(pendulum(), [rotor]), np.linspace(-1, 1, 5)[:, None]
    own = potential_energy(arm, q) - potential_energy(pendulum(), q)
    np.testing.assert_allclose(own, 0.4 * 9.81 * (1 - 0.1 * np.sin(3 * q[:, 0])), rtol=1e-13)
    locked = at_level(arm, RotorLevel.REFLECTED)
    np.testing.assert_allclose(potential_energy(locked, q) - potential_energy(pendulum(), q), 0.4 * 9.81, rtol=1e-13)


@pytest.mark.parametrize(("kind", "level"), CASES)
def test_gravity_is_the_slope_of_the_potential(kind: str, level: RotorLevel) -> None:
    arm = geared(70, kind, level)
    q, _, _ = motion(70, arm.n, 4)
    h = 1e-4
    slope = [
        (8 * (potential_energy(arm, q + h * e) - potential_energy(arm, q - h * e))
         - (potential_energy(arm, q + 2 * h * e) - potential_energy(arm, q - 2 * h * e))) / (12 * h)
        for e in np.eye(arm.n)
    ]  # fmt: skip
    assert error(np.stack(slope, axis=1), gravity_torque(arm, q)) < 1e-9  # rounding error of V over h


@pytest.mark.parametrize(("kind", "level"), CASES)
def test_joint_power_is_the_rate_of_both_energies(kind: str, level: RotorLevel) -> None:
    """d(T + V)/dt = qd . tau, with energies differentiated along the motion and torques from the recursion."""
    arm = geared(71, kind, level)
    q, qd, qdd = motion(71, arm.n, 4)
    found = power_balance(arm, q, qd, qdd)
    h = 1e-5

    def energies(t: float) -> np.ndarray:
        at, speed = q + qd * t + 0.5 * qdd * t * t, qd + qdd * t
        return np.array([kinetic_energy(arm, at, speed), potential_energy(arm, at)])

    kinetic, potential = (8 * (energies(h) - energies(-h)) - (energies(2 * h) - energies(-2 * h))) / (12 * h)
    assert error(found.kinetic, kinetic) < 1e-8  # rounding error of the energies over h
    assert error(found.potential, potential) < 1e-8
    assert error(np.sum(qd * inverse_dynamics(arm, q, qd, qdd), axis=1), kinetic + potential) < 1e-8
    assert error(found.joints, qd * inverse_dynamics(arm, q, qd, qdd)) < 1e-15
    np.testing.assert_array_equal(found.tip, 0.0)


def test_power_at_the_tip_is_wrench_times_twist() -> None:
    arm = geared(72, "mixed")
    q, qd, qdd = motion(72, arm.n, 3)
    wrench = np.random.default_rng(72).normal(size=(3, 6)) * 20
    found = power_balance(arm, q, qd, qdd, tip_wrench=wrench)
    h = 1e-6
    for sample in range(3):
        here, there = tip_pose(arm, q[sample] - h * qd[sample]), tip_pose(arm, q[sample] + h * qd[sample])
        twist = log_pose(inverse_pose(here) @ there) / (2 * h)
        assert found.tip[sample] == pytest.approx(wrench[sample] @ twist, rel=1e-7)  # error of the differences
    total = found.kinetic + found.potential + found.tip
    assert error(found.joints.sum(axis=1), total) < 1e-12


def test_a_falling_arm_keeps_its_energy() -> None:
    """Without torques T + V is constant while both change; by RK4 with steps of 0.1 ms over 0.1 s."""
    arm = geared(73, "coaxial")
    state = np.concatenate(motion(73, arm.n, 1)[:2], axis=1)[0] * 0.3
    free, h, start = np.zeros(6), 1e-4, None

    def rate(y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[6:], forward_dynamics(arm, y[:6], y[6:], free)])

    start = kinetic_energy(arm, state[:6], state[6:]), potential_energy(arm, state[:6])
    for _ in range(1000):
        a = rate(state)
        b = rate(state + 0.5 * h * a)
        c = rate(state + 0.5 * h * b)
        state = state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))
    end = kinetic_energy(arm, state[:6], state[6:]), potential_energy(arm, state[:6])
    assert abs(end[0] - start[0]) > 0.1
    assert sum(end) == pytest.approx(sum(start), abs=1e-10)  # [J] error of RK4 with this step, and rounding
