"""Matrices of a linear stage over a step, against an arithmetic of forty digits."""

import mpmath as mp
import pytest

from drivetrain.drive.loops.current_loop_kernel import held_step

LOOP = (-9000.0, 12000.0, -250.0, 0.0)  # 1/s: a current loop of 1 kHz, about


@pytest.mark.parametrize("h", [1e-9, 1e-7, 1e-6, 3e-5, 1e-4, 1e-3, 1e-2, 1.0])
def test_ends_and_means_keep_their_digits_at_any_step(h: float) -> None:
    found = held_step(LOOP, h)
    with mp.workdps(60):
        scaled = mp.matrix([[entry * mp.mpf(h) for entry in LOOP[:2]], [entry * mp.mpf(h) for entry in LOOP[2:]]])
        whole = mp.expm(scaled)
        first = (whole - mp.eye(2)) * scaled**-1
        second = (first - mp.eye(2)) * scaled**-1
        for matrix, exact in zip(found, (whole, first, second), strict=True):
            off = max(abs(matrix[k] - exact[k // 2, k % 2]) for k in range(4))
            # Rounding, doubled with every doubling of the step; the largest entry is about one.
            assert off < 5e-16 * max(1.0, 1e4 * h)
