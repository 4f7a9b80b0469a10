"""Blocks of samples laid out for vector instructions: transposing in and out, sines and cosines."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import law

BLOCK = 64  # samples; below 32 and above 128 slower
FAR = 1e6  # rad; three-part reduction is exact below, libm takes over above
TWO_OVER_PI = 2.0 / math.pi

fast = law(fastmath=True)
# The reduction of an angle, and the test for NaN, are void once the compiler may reorder sums or rule NaN out.
exact = law(fastmath={"contract"})


@exact
def sincos(block: Array, row: int, factor: float, offset: float, cs: Array, to: int, far: bool) -> None:
    """Cosines and sines of ``factor * q + offset`` for the positions q of one joint, to 4e-16.

    Args:
        block: Rows of q, qd, qdd, one row a joint, (n, 3 BLOCK) [rad, rad/s, rad/s^2].
        factor: Turns of what is asked for, a turn of the joint [-].
        offset: Added to the angle [rad], -pi to pi.
        cs: Takes cosines, then sines, (rows, 2 BLOCK or more) [-].
    """
    q = block[row, :BLOCK]
    c = cs[to, :BLOCK]
    s = cs[to, BLOCK : 2 * BLOCK]
    if far:
        co, so = math.cos(offset), math.sin(offset)
        for k in range(BLOCK):
            cx, sx = math.cos(factor * q[k]), math.sin(factor * q[k])
            c[k] = cx * co - sx * so
            s[k] = sx * co + cx * so
        return
    for k in range(BLOCK):
        x = factor * q[k]
        j = np.rint((x + offset) * TWO_OVER_PI)
        # pi/2 in three parts of 33, 33 and 53 bits; the offset joins the small remainder.
        r = ((x - j * 1.57079632673412561417) - j * 6.07710050630396597660e-11) - j * 2.02226624879595063154e-21
        r += offset
        z = r * r
        # Minimax on [-pi/4, pi/4], from the table of fdlibm's k_sin.c and k_cos.c.
        sine = r + r * z * (
            -1.66666666666666324348e-01
            + z
            * (
                8.33333333332248946124e-03
                + z
                * (
                    -1.98412698298579493134e-04
                    + z
                    * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))
                )
            )
        )
        cosine = (
            1.0
            - 0.5 * z
            + z
            * z
            * (
                4.16666666666666019037e-02
                + z
                * (
                    -1.38888888888741095749e-03
                    + z
                    * (
                        2.48015872894767294178e-05
                        + z
                        * (
                            -2.75573143513906633035e-07
                            + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)
                        )
                    )
                )
            )
        )
        turn = j - 4.0 * np.floor(j * 0.25)
        odd = (turn == 1.0) | (turn == 3.0)
        a = cosine if odd else sine
        b = sine if odd else cosine
        s[k] = -a if turn >= 2.0 else a
        c[k] = -b if (turn == 1.0) | (turn == 2.0) else b


@exact
def read(samples: Array, first: int, count: int, n: int, field: int, block: Array) -> None:
    """Transpose samples into a field of the joints' rows, the rest of the block zero.

    Args:
        samples: (N, n), C order [any unit].
        block: Takes them, (n, 3 BLOCK) [any unit].
    """
    # Constants let the compiler unroll and shuffle: three times faster, worth it for the commonest arm.
    if n == 6 and count == BLOCK:
        _read(samples, first, BLOCK, 6, field, block)
    else:
        _read(samples, first, count, n, field, block)


@exact
def write(block: Array, first: int, count: int, n: int, out: Array) -> None:
    """Transpose a block of results into rows of an array.

    Args:
        block: (n or more, BLOCK) [any unit].
        out: Takes them, (N, n), C order [any unit].
    """
    if n == 6 and count == BLOCK:
        _write(block, first, BLOCK, 6, out)
    else:
        _write(block, first, count, n, out)


@exact
def _read(samples: Array, first: int, count: int, n: int, field: int, block: Array) -> None:
    flat = samples.reshape(-1)[first * n :]
    to = block.reshape(-1)[field * BLOCK :]
    for k in range(count):
        for i in range(n):
            to[i * 3 * BLOCK + k] = flat[k * n + i]
    for i in range(n):
        for k in range(count, BLOCK):
            to[i * 3 * BLOCK + k] = 0.0


@exact
def _write(block: Array, first: int, count: int, n: int, out: Array) -> None:
    flat = out.reshape(-1)[first * n :]
    values = block.reshape(-1)
    for k in range(count):
        for i in range(n):
            flat[k * n + i] = values[i * BLOCK + k]


@law(fastmath={"contract", "reassoc"})
def sum_of_squares(block: Array) -> float:
    """Of all numbers of a block; not finite when one of them is NaN, infinite, or beyond 1e154.

    Args:
        block: Any shape, C order [any unit].

    Returns:
        The sum [that unit, squared].
    """
    values = block.reshape(-1)
    total = 0.0
    for k in range(len(values)):
        total += values[k] * values[k]
    return total
