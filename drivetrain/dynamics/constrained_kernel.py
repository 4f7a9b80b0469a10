"""Accelerations and multipliers under linear constraints, compiled: factors of M, and singular values by rotation.

With ``M = L L^T`` and ``W = L^-1 A^T = U s V^T``, the least change of the free motion, in the metric of M, is

    L^T x = (1 - U U^T) L^-1 f - U s^-1 V^T d,      lambda = V s^-1 (U^T L^-1 f + s^-1 V^T d),

for ``M x + A^T lambda = f`` and ``A x = -d``. Directions whose s is nothing but rounding are left out: rows that say
the same twice then share their multiplier (least norm), and no division is by more than one small s.

Singular values come from one-sided Jacobi rotations, which are exact to rounding for each of them, small ones too, and
need no library. Reference: Demmel and Veselic, SIAM J. Matrix Anal. Appl. 13 (1992) 1204-1245.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law

SINGULAR = 1e-12  # of a joint's inertia, left when the joints before it give way; rounding leaves 1e-15 of none
MOST_SWEEPS = 40  # far more than the six or so that it takes
ROUNDING = 1e-15  # cosine at which two columns count as at right angles


@law
def _factor(matrix: Array) -> int:
    """Replace a mass matrix by its factor; the first joint that moves no inertia of its own, or -1."""
    for i in range(len(matrix)):
        whole = matrix[i, i]
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if j < i:
                matrix[i, j] = total / matrix[j, j]
            elif total > SINGULAR * whole:
                matrix[i, i] = math.sqrt(total)
            else:
                return i
    return -1


@law
def _forward(factor: Array, vector: Array) -> None:
    for i in range(len(vector)):
        for k in range(i):
            vector[i] -= factor[i, k] * vector[k]
        vector[i] /= factor[i, i]


@law
def _backward(factor: Array, vector: Array) -> None:
    for i in range(len(vector) - 1, -1, -1):
        for k in range(i + 1, len(vector)):
            vector[i] -= factor[k, i] * vector[k]
        vector[i] /= factor[i, i]


@law
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@law
def _rotate(a: Array, b: Array, c: float, s: float) -> None:
    for i in range(len(a)):
        x, y = a[i], b[i]
        a[i] = c * x - s * y
        b[i] = s * x + c * y


@law
def _orthogonal(rows: Array, turns: Array) -> None:
    """Turn rows until they are at right angles; ``turns`` takes what turned them."""
    count = len(rows)
    turns[:] = 0.0
    for p in range(count):
        turns[p, p] = 1.0
    for _ in range(MOST_SWEEPS):
        still = True
        for p in range(count - 1):
            for q in range(p + 1, count):
                a, b, c = _dot(rows[p], rows[p]), _dot(rows[q], rows[q]), _dot(rows[p], rows[q])
                if abs(c) <= ROUNDING * math.sqrt(a) * math.sqrt(b):
                    continue
                still = False
                zeta = (b - a) / (2.0 * c)
                t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / math.sqrt(1.0 + t * t)
                _rotate(rows[p], rows[q], cosine, cosine * t)
                _rotate(turns[p], turns[q], cosine, cosine * t)
        if still:
            return


@kernel
def _solve(
    matrices: Array, jacobians: Array, force: Array, drift: Array, tolerance: float, motion: Array, multipliers: Array,
    found: Array,
) -> tuple[int, int]:  # fmt: skip
    """Fill ``motion``, ``multipliers``, and ``found``: rank, condition, and the drift that no motion can meet."""
    count, rows, n = jacobians.shape
    w, turns = np.empty((rows, n)), np.empty((rows, rows))
    for sample in range(count):
        factor, x, answer = matrices[sample], motion[sample], multipliers[sample]
        joint = _factor(factor)
        if joint >= 0:
            return sample, joint
        w[:] = jacobians[sample]
        for k in range(rows):
            _forward(factor, w[k])
        x[:] = force[sample]
        _forward(factor, x)
        _orthogonal(w, turns)
        largest, smallest, rank, missed = 0.0, np.inf, 0, 0.0
        for k in range(rows):
            largest = max(largest, math.sqrt(_dot(w[k], w[k])))
        answer[:] = 0.0
        for k in range(rows):
            size, asked = math.sqrt(_dot(w[k], w[k])), _dot(turns[k], drift[sample])
            if size <= tolerance * largest:
                missed = max(missed, abs(asked))
                continue
            rank += 1
            smallest = min(smallest, size)
            # The rows of w are at right angles: each takes its own part of x, whatever the others have taken.
            push = (_dot(w[k], x) / size + asked / size) / size
            for i in range(n):
                x[i] -= push * w[k, i]
            for i in range(rows):
                answer[i] += push * turns[k, i]
        _backward(factor, x)
        found[sample, 0], found[sample, 1], found[sample, 2] = rank, largest / smallest if rank else 1.0, missed
    return -1, -1


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The solution, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        A function of mass matrices (N, n, n), which are destroyed, ``jacobians`` (N, k, n), ``force`` (N, n), ``drift``
        (N, k), the singular value that counts as none, over the largest, and what it fills: ``motion`` (N, n),
        ``multipliers`` (N, k), ``found`` (N, 3): rank, condition number of what is kept, and the largest part of the
        drift that no motion can meet. It returns sample and joint of the first that moves no inertia, or -1 and -1. All
        C order, SI units.
    """
    given = [nb.types.Array(nb.float64, ndim, "C", readonly=True) for ndim in (3, 2, 2)]
    filled = [nb.types.Array(nb.float64, 2, "C")] * 3
    matrices = nb.types.Array(nb.float64, 3, "C")
    _solve.compile(nb.types.UniTuple(nb.int64, 2)(matrices, *given, nb.float64, *filled))
    _solve.disable_compile()
    return _solve
