"""Blocks of samples in the layout for vector instructions: records with rows of 64 numbers; sines and cosines.

The number of lanes of a row is part of the record's type: the laws are compiled for 64 lanes and for a single sample.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.vectors import exact
from drivetrain.jit import law

BLOCK = 64  # samples per block; slower below 32 and above 128
FAR = 1e6  # [rad] below, the reduction in three parts is exact; above, libm is used
TWO_OVER_PI = 2.0 / math.pi

# The reduction of an angle and the test for NaN are ``exact``: they would fail if the compiler reordered sums or
# assumed that there is no NaN.
fast = law(fastmath=True)


def block_types(*names: str, block: int = BLOCK) -> tuple[np.dtype, np.dtype]:
    """Records of rows of samples, each with a name: for the samples of a block, and for a single sample."""
    several, one = (np.dtype([(name, np.float64, (lanes,)) for name in names]) for lanes in (block, 1))
    return several, one


# Position, speed, acceleration; cosine and sine of the angle; torque of its rotor, and total torque of the joint.
JOINT, JOINT_ALONE = block_types("q", "qd", "qdd", "cos", "sin", "rotor", "torque")


@exact
def sincos(joint: Any, factor: float, offset: float, far: bool) -> None:
    """Cosines and sines of ``factor * q + offset``, to 4e-16."""
    q, c, s = joint.q, joint.cos, joint.sin
    if far:
        co, so = np.cos(offset), np.sin(offset)
        for k in range(len(q)):
            cx, sx = np.cos(factor * q[k]), np.sin(factor * q[k])
            c[k] = cx * co - sx * so
            s[k] = sx * co + cx * so
        return
    for k in range(len(q)):
        x = factor * q[k]
        j = np.rint((x + offset) * TWO_OVER_PI)
        # pi/2 in three parts of 33, 33 and 53 bits; the offset joins the small remainder.
        r = ((x - j * 1.57079632673412561417) - j * 6.07710050630396597660e-11) - j * 2.02226624879595063154e-21
        r += offset
        z = r * r
        # Minimax on [-pi/4, pi/4], from the table of fdlibm's k_sin.c and k_cos.c.
        tail = 2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
        tail = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * tail)
        sine = r + r * z * (-1.66666666666666324348e-01 + z * tail)
        tail = -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)
        tail = -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * tail)
        cosine = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * tail)
        turn = j - 4.0 * np.floor(j * 0.25)
        odd = (turn == 1.0) | (turn == 3.0)
        a = cosine if odd else sine
        b = sine if odd else cosine
        s[k] = -a if turn >= 2.0 else a
        c[k] = -b if (turn == 1.0) | (turn == 2.0) else b


@exact
def read_row(row: Array, samples: Array, i: int, first: int, count: int) -> None:
    """Copy a column of samples into a row, and set the rest of the row to zero."""
    for k in range(count):
        row[k] = samples[first + k, i]
    for k in range(count, len(row)):
        row[k] = 0.0


@law(fastmath={"contract", "reassoc"})
def sum_of_squares(joint: Any) -> float:
    """Sum of squares of a joint's q, qd and qdd; not finite if one of them is NaN, infinite, or beyond 1e154."""
    total = 0.0
    for k in range(len(joint.q)):
        total += joint.q[k] * joint.q[k] + joint.qd[k] * joint.qd[k] + joint.qdd[k] * joint.qdd[k]
    return total
