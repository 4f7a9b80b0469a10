"""Kernels for blocks of samples: accuracy of sines and cosines, batches of any size, NaN and infinity."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import motion, random_arm

from drivetrain.dynamics.core import blocks
from drivetrain.dynamics.core.blocks import BLOCK, FAR, JOINT
from drivetrain.dynamics.inverse import inverse_dynamics, joint_loads
from drivetrain.errors import InputError
from drivetrain.jit import kernel

sincos = kernel(blocks.sincos)


def sines(x: np.ndarray, offset: float, far: bool) -> tuple[np.ndarray, np.ndarray]:
    joints = np.zeros(1, JOINT)
    joints["q"] = x
    sincos(joints[0], 1.0, offset, far)
    return joints["cos"][0], joints["sin"][0]


@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize("size", [1e-300, 1e-9, 0.1, 1.0, 4.0, 100.0, 1e4, FAR])
@pytest.mark.parametrize("offset", [0.0, 1.0, -np.pi, np.pi / 2])
def test_sines_and_cosines(size: float, offset: float, far: bool) -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-size, size, BLOCK)
    x[:4] = [0.0, -0.0, size, -size]
    c, s = sines(x, offset, far)
    # By the addition theorem, since x + offset is not exact for large x.
    wanted_c = np.cos(x) * np.cos(offset) - np.sin(x) * np.sin(offset)
    wanted_s = np.sin(x) * np.cos(offset) + np.cos(x) * np.sin(offset)
    # Three roundings of numbers up to 1, and up to pi with an offset.
    assert np.abs(c - wanted_c).max() < 1e-15
    assert np.abs(s - wanted_s).max() < 1e-15


def test_sines_at_multiples_of_a_quarter_turn() -> None:
    x = np.arange(-32, 32) * (np.pi / 2)
    c, s = sines(x, 0.0, False)
    np.testing.assert_allclose(c, np.cos(x), rtol=0, atol=2e-16)
    np.testing.assert_allclose(s, np.sin(x), rtol=0, atol=2e-16)
    small = np.full(BLOCK, 1e-200)
    np.testing.assert_array_equal(sines(small, 0.0, False)[1], small)


@pytest.mark.parametrize("n", [1, 5, 6, 7])
@pytest.mark.parametrize("count", [1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK - 2])
def test_a_batch_is_its_samples(n: int, count: int) -> None:
    arm, (q, qd, qdd) = random_arm(n, "R" * n), motion(n, n, count)
    whole = joint_loads(arm, q, qd, qdd)
    for k in range(0, count, 7):
        one = joint_loads(arm, q[k], qd[k], qdd[k])
        for name in ("torque", "gear", "motor", "wrench", "carrier_acceleration"):
            np.testing.assert_array_equal(getattr(whole, name)[k], getattr(one, name))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
@pytest.mark.parametrize("place", [(0, 0), (1, 5), (63, 3), (64, 0), (129, 2)])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_nan_and_infinity_are_detected_anywhere(value: float, place: tuple[int, int], which: int) -> None:
    arm, samples = random_arm(0), [series.copy() for series in motion(0, 6, 130)]
    samples[which][place] = value
    with pytest.raises(InputError, match=("q", "qd", "qdd")[which]):
        inverse_dynamics(arm, *samples)
