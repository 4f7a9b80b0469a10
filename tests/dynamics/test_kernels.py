"""What the compiled recursion is made of."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.dynamics import blocks
from drivetrain.dynamics.blocks import BLOCK, FAR

read, sincos, write = blocks.read, blocks.sincos, blocks.write
sum_of_squares = blocks.sum_of_squares


def sines(x: np.ndarray, factor: float, offset: float, far: bool) -> tuple[np.ndarray, np.ndarray]:
    block, cs = np.zeros((1, 3 * BLOCK)), np.zeros((1, 2 * BLOCK))
    block[0, :BLOCK] = x
    sincos(block, 0, factor, offset, cs, 0, far)
    return cs[0, :BLOCK], cs[0, BLOCK:]


@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize("size", [1e-300, 1e-9, 0.1, 1.0, 4.0, 100.0, 1e4, FAR])
@pytest.mark.parametrize("offset", [0.0, 1.0, -np.pi, np.pi / 2])
def test_sines_and_cosines(size: float, offset: float, far: bool) -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-size, size, BLOCK)
    x[:4] = [0.0, -0.0, size, -size]
    c, s = sines(x, 1.0, offset, far)
    # By the sum of angles, since x + offset is not exact for large x.
    wanted_c = np.cos(x) * np.cos(offset) - np.sin(x) * np.sin(offset)
    wanted_s = np.sin(x) * np.cos(offset) + np.cos(x) * np.sin(offset)
    # Three roundings of numbers up to 1, and up to pi where the offset joins.
    assert np.abs(c - wanted_c).max() < 1e-15
    assert np.abs(s - wanted_s).max() < 1e-15


def test_sines_at_multiples_of_a_quarter_turn() -> None:
    x = np.arange(-32, 32) * (np.pi / 2)
    c, s = sines(x, 1.0, 0.0, False)
    np.testing.assert_allclose(c, np.cos(x), rtol=0, atol=2e-16)
    np.testing.assert_allclose(s, np.sin(x), rtol=0, atol=2e-16)
    small = np.full(BLOCK, 1e-200)
    np.testing.assert_array_equal(sines(small, 1.0, 0.0, False)[1], small)


@pytest.mark.parametrize("n", [1, 5, 6, 7])
@pytest.mark.parametrize("count", [1, 63, 64])
def test_transposing_in_and_out(n: int, count: int) -> None:
    rng = np.random.default_rng(n)
    samples = rng.normal(size=(200, n))
    block = np.full((n, 3 * BLOCK), 9.0)
    read(samples, 70, count, n, 1, block)
    np.testing.assert_array_equal(block[:, BLOCK : BLOCK + count], samples[70 : 70 + count].T)
    assert not block[:, BLOCK + count : 2 * BLOCK].any()
    assert (block[:, :BLOCK] == 9.0).all()
    assert (block[:, 2 * BLOCK :] == 9.0).all()
    out = np.full((200, n), 9.0)
    write(block[:, BLOCK : 2 * BLOCK].copy(), 70, count, n, out)
    np.testing.assert_array_equal(out[70 : 70 + count], samples[70 : 70 + count])
    assert (np.delete(out, np.s_[70 : 70 + count], axis=0) == 9.0).all()


def test_sum_of_squares_sees_what_is_no_number() -> None:
    block = np.ones((2, 3 * BLOCK))
    assert sum_of_squares(block) == 6 * BLOCK
    for value in (np.nan, np.inf, -np.inf):
        for place in ((0, 0), (1, 3 * BLOCK - 1), (0, 77)):
            spoiled = block.copy()
            spoiled[place] = value
            assert not np.isfinite(sum_of_squares(spoiled))


def test_block_is_whole_vectors() -> None:
    assert blocks.BLOCK % 8 == 0
