"""Forward dynamics: checks of input, values computed by hand, and singular arms."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.errors import InputError


def pendulums(masses: list[float], moment: float) -> Arm:
    """Links hanging along x, joints about z, a metre apart."""
    n = len(masses)
    home = np.tile(np.eye(4), (n, 1, 1))
    home[:, 0, 3] = np.arange(n) + 1.0
    screws = [[0, 0, 1, 0, -float(i), 0] for i in range(n)]
    names = [f"pivot {i}" for i in range(n)]
    inertias = [np.diag([moment, moment, moment])] * n
    return Arm.from_screws(home, screws, masses, inertias, gravity=[0, -9.81, 0], joint_names=names)


def test_pendulum() -> None:
    arm = pendulums([2.0], 0.3)
    # (I + m l^2) a = tau - m g l cos q
    found = forward_dynamics(arm, [0.6], [5.0], [1.5])
    np.testing.assert_allclose(found, [(1.5 - 2 * 9.81 * np.cos(0.6)) / 2.3], rtol=1e-14)
    # A tip force on the environment equal to the pendulum's weight supports it like a torque.
    pushed = forward_dynamics(arm, [0.0], [0.0], [0.0], tip_wrench=[0, 0, 0, 0, -2 * 9.81, 0])
    np.testing.assert_allclose(pushed, [0.0], atol=1e-14)


def test_massless_last_link_is_named() -> None:
    with pytest.raises(InputError, match="'pivot 1'"):
        forward_dynamics(pendulums([1.0, 0.0], 0.0), [0.1, 0.2], [0, 0], [0, 0])


def test_gimbal_lock_is_named_with_its_sample() -> None:
    """A top in massless gimbals: if the first and last axes coincide, the mass matrix is singular."""
    screws = [[0, 0, 1, 0, 0, 0], [1, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0]]
    inertias = [np.zeros((3, 3)), np.zeros((3, 3)), np.diag([1.0, 1.0, 1.5])]
    arm = Arm.from_screws(np.tile(np.eye(4), (3, 1, 1)), screws, [0.0, 0.0, 2.0], inertias)
    q = np.array([[0.1, 1.0, 0.2], [0.1, 0.0, 0.2], [0.3, 0.5, 0.7]])
    still = np.zeros((3, 3))
    with pytest.raises(InputError, match=r"'joint_3'.*sample 1:") as caught:
        forward_dynamics(arm, q, still, still)
    assert len(caught.value.faults) == 1
    assert np.isfinite(forward_dynamics(arm, q[[0, 2]], still[:2], still[:2])).all()


def test_a_rotor_gives_a_massless_link_inertia() -> None:
    arm = with_rotors(pendulums([1.0, 0.0], 0.0), [None, Rotor(100.0, 1e-4)])
    found = forward_dynamics(arm, [0.0, 0.0], [0.0, 0.0], [0.0, 2.0])
    assert np.isfinite(found).all()


def test_very_unequal_links() -> None:
    """A mass of 1 mg after one of 1000 kg: the matrix is scaled, so that small size alone is not singular."""
    arm = pendulums([1000.0, 1e-6], 1e-9)
    found = forward_dynamics(arm, [0.0, np.pi / 2], [0.0, 0.0], [1000 * 9.81, 0.0])
    assert np.isfinite(found).all()


def test_an_arm_of_a_nanogram_is_no_singularity() -> None:
    """Masses a billion times smaller ask a billion times less torque, and all else is the same."""
    arms = [pendulums([size, size], 0.1 * size) for size in (1.0, 1e-12)]
    q, qd, tau = np.random.default_rng(7).normal(size=(3, 2))
    large, small = (forward_dynamics(arm, q, qd, tau * size) for arm, size in zip(arms, (1.0, 1e-12), strict=True))
    np.testing.assert_allclose(small, large, rtol=1e-12)
