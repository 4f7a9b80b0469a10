"""Derivatives of inverse and forward dynamics against differences, pinocchio, the mass matrix and each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns, with_coupling
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.core import derivatives as core
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.derivatives import (
    christoffel_symbols,
    forward_dynamics_derivatives,
    inverse_dynamics_derivatives,
)
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import drive_torques, inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.jit import kernel

fill_alone = kernel(core.fill_alone)
KINDS = ("none", "coaxial", "balanced", "unbalanced", "mixed")


def arm_of(kind: str, joints: str = EVERY_JOINT, seed: int = 31) -> Arm:
    arm = random_arm(seed, joints)
    return arm if kind == "none" else with_rotors(arm, rotors_of(seed, kind, arm.n))


def coupled(kind: str = "mixed") -> Arm:
    arm = arm_of(kind)
    return with_coupling(arm, np.eye(arm.n) + 0.4 * np.random.default_rng(2).normal(size=(arm.n, arm.n)))


def differences(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: float = 1e-3) -> np.ndarray:
    """Central differences of sixth order, with errors of truncation and rounding both near 1e-12."""
    columns = []
    for unit in step * np.eye(x.shape[1]):
        rise = [function(x + k * unit) - function(x - k * unit) for k in (1, 2, 3)]
        columns.append((45.0 * rise[0] - 9.0 * rise[1] + rise[2]) / (60.0 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("kind", [*KINDS, "coupled"])
def test_against_differences(kind: str, level: RotorLevel) -> None:
    arm = at_level(coupled() if kind == "coupled" else arm_of(kind), level)
    q, qd, qdd = motion(31, arm.n, 19)  # one complete group of samples, one incomplete
    tip = np.random.default_rng(31).normal(size=(19, 6))
    found = inverse_dynamics_derivatives(arm, q, qd, qdd, tip_wrench=tip)
    by_q = differences(lambda x: inverse_dynamics(arm, x, qd, qdd, tip_wrench=tip), q)
    by_qd = differences(lambda x: inverse_dynamics(arm, q, x, qdd, tip_wrench=tip), qd)
    # Unbalanced rotors turn by up to 120 times the step.
    assert error(found.q, by_q) < (1e-5 if kind in ("unbalanced", "mixed", "coupled") else 1e-10)
    assert error(found.qd, by_qd) < 1e-10
    assert error(found.qdd, mass_matrix(arm, q)) < 1e-14
    if kind != "coupled":
        np.testing.assert_array_equal(found.qdd, np.swapaxes(found.qdd, 1, 2))


@pytest.mark.parametrize("kind", ["coaxial", "balanced", "unbalanced"])
def test_rotors_torques_are_apart(kind: str) -> None:
    """What acts on a rotor directly does not pass through its gear, whose torque another algorithm computes."""
    arm = arm_of(kind)
    model, samples = packed(arm), motion(38, arm.n, 1)
    q, qd, qdd = (x[0] for x in samples)
    through, motors = np.zeros((2, arm.n, arm.n), core.ENTRY_ALONE)
    fill_alone(*model.arm, q, qd, qdd, np.zeros((0, 6)), through, motors)
    whole = inverse_dynamics_derivatives(arm, q, qd, qdd)
    by_q = differences(lambda x: drive_torques(arm, x, *samples[1:]).gear, samples[0])[0]
    by_qd = differences(lambda x: drive_torques(arm, samples[0], x, samples[2]).gear, samples[1])[0]
    assert error(through["by_q"][:, :, 0], by_q) < (1e-5 if kind == "unbalanced" else 1e-10)
    assert error(through["by_qd"][:, :, 0], by_qd) < 1e-10
    for name, wanted in (("by_q", whole.q), ("by_qd", whole.qd)):
        assert error((through[name] + motors[name])[:, :, 0], wanted) < 1e-13


@pytest.mark.parametrize("kind", [*KINDS, "coupled"])
def test_against_pinocchio(kind: str) -> None:
    """In pinocchio rotors are bodies on own joints that follow by N: ``G^T J G`` with the speeds G per joint speed."""
    arm = coupled() if kind == "coupled" else arm_of(kind)
    peer = InPinocchio(arm)
    spread = np.stack([peer.spread(unit) for unit in np.eye(arm.n)], axis=1)
    assert spread.shape == (peer.model.nv, arm.n)
    assert kind == "none" or np.abs(spread[arm.n :]).max() <= np.abs(rotor_turns(arm)).max()
    samples = motion(32, arm.n, 5)
    found = inverse_dynamics_derivatives(arm, *samples)
    for k, sample in enumerate(zip(*samples, strict=True)):
        by_q, by_qd, mass = pin.computeRNEADerivatives(peer.model, peer.data, *(peer.spread(x) for x in sample))
        mass = np.triu(mass) + np.triu(mass, 1).T
        for ours, theirs in ((found.q[k], by_q), (found.qd[k], by_qd), (found.qdd[k], mass)):
            # Terms that cancel in the product are larger by the square of the ratios, up to 120.
            assert error(ours, spread.T @ theirs @ spread) < 1e-10


def test_long_chains() -> None:
    arm = arm_of("mixed", "R" * 30)
    q, qd, qdd = motion(33, arm.n, 2)
    found = inverse_dynamics_derivatives(arm, q, qd, qdd)
    assert error(found.qdd, mass_matrix(arm, q)) < 1e-13
    assert error(found.qd, differences(lambda x: inverse_dynamics(arm, q, x, qdd), qd)) < 1e-10


def test_speeds_give_twice_the_coriolis_matrix() -> None:
    arm = arm_of("mixed")
    q, qd, qdd = motion(34, arm.n, 5)
    wanted = 2.0 * np.einsum("sijk,sk->sij", christoffel_symbols(arm, q), qd)
    assert error(inverse_dynamics_derivatives(arm, q, qd, qdd).qd, wanted) < 1e-12


@pytest.mark.parametrize("kind", ["none", "mixed", "coupled"])
def test_accelerations(kind: str) -> None:
    arm = coupled() if kind == "coupled" else arm_of(kind)
    q, qd, qdd = motion(35, arm.n, 4)
    tip = np.array([1.0, -2.0, 3.0, 4.0, -5.0, 6.0])
    tau = inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip)
    found = forward_dynamics_derivatives(arm, q, qd, tau, tip_wrench=tip)
    by_q = differences(lambda x: forward_dynamics(arm, x, qd, tau, tip_wrench=tip), q, 2e-4)
    assert error(found.q, by_q) < (1e-5 if kind != "none" else 1e-8)
    by_qd = differences(lambda x: forward_dynamics(arm, q, x, tau, tip_wrench=tip), qd)
    assert error(found.qd, by_qd) < 1e-9
    assert error(found.tau @ mass_matrix(arm, q), np.broadcast_to(np.eye(arm.n), found.tau.shape)) < 1e-11


def test_one_sample_of_coupled_motors_is_a_row_of_a_batch() -> None:
    arm = arm_of("mixed")
    samples = motion(36, arm.n, 70)
    matrix = np.eye(arm.n) + np.eye(arm.n, k=-1)  # coupled motors: shaft i turns with joints i and i - 1
    coupled = with_coupling(arm, matrix)
    batch = inverse_dynamics_derivatives(coupled, *samples)
    one = inverse_dynamics_derivatives(coupled, *(x[3] for x in samples))
    for name in ("q", "qd", "qdd"):
        np.testing.assert_allclose(getattr(one, name), getattr(batch, name)[3], rtol=1e-12, atol=1e-12)
