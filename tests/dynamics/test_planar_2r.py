"""The closed form of equation 8.9 against Newton's law for two point masses and the recursion; checks of input."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm, planar_2r_terms, planar_2r_torque
from drivetrain.dynamics.derivatives import coriolis_matrix
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics, joint_loads
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError

CHAINS = [Planar2R(), Planar2R((1.3, 0.4), (0.7, 1.9), 3.7), Planar2R((5.0, 0.02), (0.2, 0.1), -1.0)]


def samples() -> np.ndarray:
    return np.random.default_rng(80).uniform(-3, 3, (3, 50, 2))


@pytest.mark.parametrize("chain", CHAINS)
def test_newton_for_two_points(chain: Planar2R) -> None:
    """Equations 8.11 and 8.12: forces on the masses and their moments about the joints, in complex numbers."""
    q, qd, qdd = samples()
    (m1, m2), (l1, l2) = chain.masses, chain.lengths
    angle, rate, gain = np.cumsum(q, axis=1), np.cumsum(qd, axis=1), np.cumsum(qdd, axis=1)
    rods = np.array([l1, l2]) * np.exp(1j * angle)
    turned = rods * (1j * gain - rate**2)  # the second derivative of a rod
    f1 = m1 * (turned[:, 0] + 1j * chain.gravity)
    f2 = m2 * (turned.sum(axis=1) + 1j * chain.gravity)
    second = np.imag(np.conj(rods[:, 1]) * f2)
    first = np.imag(np.conj(rods[:, 0]) * f1) + np.imag(np.conj(rods.sum(axis=1)) * f2)
    np.testing.assert_allclose(planar_2r_torque(chain, q, qd, qdd), np.stack([first, second], axis=1), atol=1e-12)


@pytest.mark.parametrize("chain", CHAINS)
def test_the_arm_made_of_it(chain: Planar2R) -> None:
    arm, (q, qd, qdd) = planar_2r_arm(chain), samples()
    terms = planar_2r_terms(chain, q, qd)
    np.testing.assert_allclose(mass_matrix(arm, q), terms.mass, atol=1e-13)
    np.testing.assert_allclose((coriolis_matrix(arm, q, qd) @ qd[:, :, None])[..., 0], terms.velocity, atol=1e-12)
    np.testing.assert_allclose(gravity_torque(arm, q), terms.gravity, atol=1e-12)
    np.testing.assert_allclose(inverse_dynamics(arm, q, qd, qdd), planar_2r_torque(chain, q, qd, qdd), atol=1e-12)
    np.testing.assert_array_equal(
        joint_loads(arm, q, qd, qdd).wrench[:, :, [0, 1, 5]], 0.0
    )  # all forces are in the plane
    assert isinstance(arm, Arm) and arm.tip[0, 3] == pytest.approx(sum(chain.lengths))


def test_one_sample() -> None:
    q, qd, qdd = samples()
    one, many = planar_2r_terms(CHAINS[1], q[4], qd[4]), planar_2r_terms(CHAINS[1], q, qd)
    for single, batch in zip(one, many, strict=True):
        np.testing.assert_array_equal(single, batch[4])
    found = planar_2r_torque(CHAINS[1], q[4], qd[4], qdd[4])
    np.testing.assert_allclose(found, planar_2r_torque(CHAINS[1], q, qd, qdd)[4], rtol=1e-14)


def test_all_wrong_input_is_reported() -> None:
    with pytest.raises(InputError) as caught:
        Planar2R(masses=(1.0, -2.0), lengths=(0.0, 1.0), gravity=np.nan)
    assert {fault.place for fault in caught.value.faults} == {"masses", "lengths", "gravity"}
    with pytest.raises(InputError, match="masses"):
        Planar2R(masses=(1.0, 1.0, 1.0))
    with pytest.raises(InputError, match="qdd"):
        planar_2r_torque(Planar2R(), np.zeros(2), np.zeros(2), np.zeros(3))
    with pytest.raises(InputError, match="q"):
        planar_2r_terms(Planar2R(), np.zeros(3), np.zeros(3))
