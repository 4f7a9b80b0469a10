"""Mass matrix and bias of a single sample against the batch algorithms, with rotors of every kind, bound and free."""

import numpy as np
import pytest
from random_arms import EVERY_JOINT, random_arm, rotors_of

import drivetrain as dt
from drivetrain.dynamics.core import equation_of_motion
from drivetrain.dynamics.core.packed import link_frames, packed
from drivetrain.dynamics.flexibility import free_mass
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.jit import kernel

mass_and_bias, moving_bodies = kernel(equation_of_motion.mass_and_bias), kernel(equation_of_motion.moving_bodies)
KINDS = ("coaxial", "balanced", "unbalanced", "mixed")


def filled(arm: dt.Arm, q: np.ndarray, qd: np.ndarray, free: tuple[int, ...] = ()) -> tuple[np.ndarray, ...]:
    """Mass matrix, its rotors' part, bias and its rotors' part."""
    model, n = packed(arm, free), len(q)
    bodies = moving_bodies(arm.n, len(model.rotors), link_frames(arm)[0], arm.gravity)
    results = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    mass_and_bias(model.links, model.rotors, q, qd, bodies, *results)
    return results


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("level", list(dt.RotorLevel))
def test_bound_rotors(seed: int, level: dt.RotorLevel) -> None:
    arm = random_arm(seed, EVERY_JOINT)
    arm = dt.with_rotors(arm, rotors_of(seed, KINDS[seed % 4], arm.n), level=level)
    rng = np.random.default_rng(seed)
    q, qd, qdd = rng.normal(size=(3, arm.n))
    mass, turned, bias, turned_bias = filled(arm, q, qd)
    scale = np.abs(dt.mass_matrix(arm, q)).max()
    np.testing.assert_allclose(mass, dt.mass_matrix(arm, q), atol=1e-12 * scale)
    np.testing.assert_allclose(bias, bias_torque(arm, q, qd), atol=1e-12 * np.abs(bias).max())
    # Before the gear is the rotors' part, behind it the rest.
    torque, gear = dt.inverse_dynamics(arm, q, qd, qdd), dt.drive_torques(arm, q, qd, qdd).gear
    spinning = np.array([rotor is not None for rotor in arm.rotors])
    rest = torque - (turned @ qdd + turned_bias)
    np.testing.assert_allclose(rest[spinning], gear[spinning], atol=1e-11 * np.abs(torque).max())


@pytest.mark.parametrize("seed", range(8))
def test_free_rotors(seed: int) -> None:
    arm = random_arm(seed, EVERY_JOINT)
    arm = dt.with_rotors(arm, rotors_of(seed, KINDS[seed % 4], arm.n))
    free = tuple(i for i in (1, 3, 4) if arm.rotors[i] is not None)
    rng = np.random.default_rng(seed)
    q, qd = rng.normal(size=(2, arm.n))
    shafts = list(free)
    mass, _, bias, _ = filled(arm, np.concatenate([q, q[shafts]]), np.concatenate([qd, qd[shafts]]), free)
    # Tied to their joints again they are the arm itself.
    tie = np.vstack([np.eye(arm.n), np.eye(arm.n)[shafts]])
    scale = np.abs(mass).max()
    np.testing.assert_allclose(tie.T @ mass @ tie, dt.mass_matrix(arm, q), atol=1e-12 * scale)
    np.testing.assert_allclose(tie.T @ bias, bias_torque(arm, q, qd), atol=1e-11 * np.abs(bias).max())
    whole, own = free_mass(arm, q[None])[0], [arm.n + i for i in free]
    np.testing.assert_allclose(mass[: arm.n, arm.n :], whole[: arm.n, own], atol=1e-11 * scale)
    np.testing.assert_allclose(np.diag(mass)[arm.n :], np.diag(whole)[own], rtol=1e-11)
