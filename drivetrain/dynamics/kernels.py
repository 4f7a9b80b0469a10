"""The compiled Newton-Euler recursion: one for links and rotors, over blocks of 64 samples.

What decides its speed, each measured: the sample loop is innermost and straight-line, so that it becomes vector
instructions; a block's numbers lie as a structure of arrays in the nearest cache; neighbouring links keep their records
in different arrays, so that the compiler can see that what is read is not what is written; arrays are sliced inside the
passes and not before them, because a slice passed as an argument costs an atomic count of references.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.blocks import BLOCK, FAR, fast, read, sincos, sum_of_squares, write
from drivetrain.dynamics.passes import (
    CD,
    CHANNELS,
    OFFSET,
    PX,
    PY,
    PZ,
    SD,
    SPIN,
    TURN,
    first_revolute,
    first_revolute_back,
    revolute,
    revolute_back,
    screw,
    screw_back,
)
from drivetrain.jit import kernel

_GIVEN = ((nb.bool_, 1), (nb.float64, 2), (nb.int64, 2), (nb.float64, 1), *[(nb.float64, 2)] * 4)


@fast
def _couple(rows: Array, row: int, x: Array, joint: int, cs: Array, carrier: Array, slot: int) -> None:
    """A balanced rotor in any direction on any link: its couple on the carrier, its torque on its joint."""
    K, X, C, u = rows[row], x[joint], cs[joint], carrier[slot]
    zx, zy, zz = K[PX], K[PY], K[PZ]
    for k in range(BLOCK):
        v, vd = X[BLOCK + k], X[2 * BLOCK + k]
        wx, wy, wz = u[k], u[BLOCK + k], u[2 * BLOCK + k]
        u[12 * BLOCK + k] += vd * zx + v * (wy * zz - wz * zy)
        u[13 * BLOCK + k] += vd * zy + v * (wz * zx - wx * zz)
        u[14 * BLOCK + k] += vd * zz + v * (wx * zy - wy * zx)
        C[2 * BLOCK + k] += zx * u[3 * BLOCK + k] + zy * u[4 * BLOCK + k] + zz * u[5 * BLOCK + k]


@fast
def _spin(rows: Array, row: int, x: Array, joint: int, cs: Array, carrier: Array, slot: int, torque: Array) -> None:
    """A rotor that is a body of its own: its wrench on the carrier, its torque on its joint."""
    n = len(x)  # the last row of cs and torque is a rotor's
    rotor = np.empty((1, CHANNELS))
    where = (row, joint, n, slot, n - n)
    screw(rows, where, x, cs, carrier, rotor)
    screw_back(rows, where, x, cs, carrier, rotor, torque)
    C, tau = cs[joint], torque[n]
    for k in range(BLOCK):
        C[2 * BLOCK + k] += tau[k]


@fast
def _load_tip(tip: Array, first: int, count: int, record: Array, slot: int) -> None:
    """The wrench on the environment, one for all samples or one each, joins that of the last link."""
    o = record[slot]
    step = 1 if len(tip) > 1 else 0
    for k in range(count):
        row = tip[(first + k) * step]
        for j in range(3):
            o[(9 + j) * BLOCK + k] += row[3 + j]
            o[(12 + j) * BLOCK + k] += row[j]


@fast
def _take_gear(joint: int, cs: Array, torque: Array, block: Array) -> None:
    """Torque at the gear: the joint's without what its rotor needs."""
    C, tau, to = cs[joint], torque[joint], block[joint]
    for k in range(BLOCK):
        to[k] = tau[k] - C[2 * BLOCK + k]


@fast
def _take_axial(joint: int, record: Array, slot: int, block: Array) -> None:
    """Angular acceleration of the link before the joint, along the joint's axis."""
    o, to = record[slot], block[joint]
    for k in range(BLOCK):
        to[k] = o[15 * BLOCK + k]


@fast
def _take_wrench(
    joint: int, rows: Array, x: Array, record: Array, slot: int, first: int, count: int, wrench: Array
) -> None:
    """The wrench through a joint, in the joint's own frame; a rotor's couple on the link before is not part of it."""
    K, X, o = rows[joint], x[joint], record[slot]
    cd, sd, spin = K[CD], K[SD], K[SPIN]
    for k in range(count):
        fx, fy = o[9 * BLOCK + k], o[10 * BLOCK + k]
        couple = spin * X[BLOCK + k]
        nx, ny = o[12 * BLOCK + k] - couple * o[BLOCK + k], o[13 * BLOCK + k] + couple * o[k]
        out = wrench[first + k, joint]
        out[0] = cd * nx + sd * ny
        out[1] = cd * ny - sd * nx
        out[2] = o[14 * BLOCK + k]
        out[3] = cd * fx + sd * fy
        out[4] = cd * fy - sd * fx
        out[5] = o[11 * BLOCK + k]


@fast
def _collect(
    n: int,
    rows: Array,
    x: Array,
    cs: Array,
    even: Array,
    odd: Array,
    torque: Array,
    first: int,
    count: int,
    gear: Array,
    axial: Array,
    wrench: Array,
) -> None:
    """What was asked for besides the torque, out of the records."""
    block = np.empty((n, BLOCK))
    if len(gear):
        for i in range(n):
            _take_gear(i, cs, torque, block)
        write(block, first, count, n, gear)
    if len(axial):
        for i in range(n):
            _take_axial(i, odd if i % 2 == 0 else even, (i + 1) >> 1, block)
        write(block, first, count, n, axial)
    if len(wrench):
        for i in range(n):
            _take_wrench(i, rows, x, odd if i % 2 == 0 else even, (i + 1) >> 1, first, count, wrench)


# long kernel: another layer of calls, each passing arrays field by field, costs a third more
@kernel
def _recursion(
    simple: Array,
    rows: Array,
    spins: Array,
    gravity: Array,
    q: Array,
    qd: Array,
    qdd: Array,
    tip: Array,
    torque: Array,
    gear: Array,
    axial: Array,
    wrench: Array,
) -> float:
    """Fill ``torque``, and those of ``gear``, ``axial`` and ``wrench`` that have rows; NaN if the input is spoiled."""
    n = len(simple)
    x, cs = np.empty((n, 3 * BLOCK)), np.empty((n + 1, 3 * BLOCK))
    even, odd = np.zeros((n // 2 + 1, CHANNELS)), np.zeros((n // 2 + 1, CHANNELS))
    result = np.empty((n + 1, BLOCK))
    bad, zero = 0.0, n - n  # numba would compile a callee again for each literal
    for j in range(3):
        even[0, (6 + j) * BLOCK : (7 + j) * BLOCK] = -gravity[j]
    for first in range(0, len(q), BLOCK):
        count = min(BLOCK, len(q) - first)
        read(q, first, count, n, zero, x)
        read(qd, first, count, n, zero + 1, x)
        read(qdd, first, count, n, zero + 2, x)
        size = sum_of_squares(x)
        bad += 0.0 * size
        for i in range(n):
            sincos(x, i, rows[i, TURN], rows[i, OFFSET], cs, i, size > FAR * FAR)
            if not simple[i]:
                if i & 1:
                    screw(rows, (i, i, i, i >> 1, (i + 1) >> 1), x, cs, odd, even)
                else:
                    screw(rows, (i, i, i, i >> 1, (i + 1) >> 1), x, cs, even, odd)
            elif i == 0:
                first_revolute(rows, x, cs, even, odd)
            elif i & 1:
                revolute(i, rows, x, cs, odd, even)
            else:
                revolute(i, rows, x, cs, even, odd)
        for r in range(len(spins)):
            joint, slot, balanced = spins[r, 0], spins[r, 1] + 1, spins[r, 2]
            if balanced:
                if slot & 1:
                    _couple(rows, n + r, x, joint, cs, odd, slot >> 1)
                else:
                    _couple(rows, n + r, x, joint, cs, even, slot >> 1)
            else:
                ratio = rows[n + r, TURN]
                sincos(x, joint, ratio, 0.0 * ratio, cs, n, size * ratio**2 > FAR * FAR)
                if slot & 1:
                    _spin(rows, n + r, x, joint, cs, odd, slot >> 1, result)
                else:
                    _spin(rows, n + r, x, joint, cs, even, slot >> 1, result)
        if len(tip):
            _load_tip(tip, first, count, even if n % 2 == 0 else odd, n >> 1)
        for i in range(n - 1, -1, -1):
            if not simple[i]:
                if i & 1:
                    screw_back(rows, (i, i, i, i >> 1, (i + 1) >> 1), x, cs, odd, even, result)
                else:
                    screw_back(rows, (i, i, i, i >> 1, (i + 1) >> 1), x, cs, even, odd, result)
            elif i == 0:
                first_revolute_back(cs, odd, result)
            elif i & 1:
                revolute_back(i, rows, x, cs, odd, even, result)
            else:
                revolute_back(i, rows, x, cs, even, odd, result)
        write(result, first, count, n, torque)
        if len(gear) + len(axial) + len(wrench):
            _collect(n, rows, x, cs, even, odd, result, first, count, gear, axial, wrench)
    return bad


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The recursion, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        A function of ``simple, rows, spins, gravity`` (as ``packed.Packed`` tells), ``q, qd, qdd`` (N, n), ``tip``
        (0, 1 or N wrenches on the environment in the last link's frame), and what it fills: ``torque`` (N, n), and,
        each with N rows or none, ``gear`` (N, n), ``axial`` (N, n), ``wrench`` (N, n, 6); all C order, SI units. It
        returns 0, or NaN when ``q``, ``qd`` or ``qdd`` hold a NaN, an infinity, or a number beyond 1e154.
    """
    given = [nb.types.Array(kind, ndim, "C", readonly=True) for kind, ndim in _GIVEN]
    filled = [nb.types.Array(nb.float64, ndim, "C") for ndim in (2, 2, 2, 3)]
    # One signature, so that read-only arrays do not have it compiled again.
    _recursion.compile(nb.float64(*given, *filled))
    _recursion.disable_compile()
    return _recursion
