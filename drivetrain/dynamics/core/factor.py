"""Factors of mass matrices, compiled: ``M = L L^T``, and the least change of a motion that satisfies constraints.

With ``W = L^-1 A^T = U s V^T``, the least change of the free motion, in the metric of M, is

    L^T x = (1 - U U^T) L^-1 f - U s^-1 V^T d,      lambda = V s^-1 (U^T L^-1 f + s^-1 V^T d),

for ``M x + A^T lambda = f`` and ``A x = -d``. Directions whose s is rounding of zero are left out: redundant rows then
share their multiplier (least norm), and no result is divided by more than one small s.

The singular values are computed by one-sided Jacobi rotations, which are accurate also for small ones and need no
library. Reference: Demmel and Veselic, SIAM J. Matrix Anal. Appl. 13 (1992) 1204-1245.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law

# Smallest share of a joint's inertia that must remain with the joints before it free; rounding of zero is about 1e-15.
SINGULAR = 1e-12
MOST_SWEEPS = 40  # far more than the usual six or so
ROUNDING = 1e-15  # cosine below which two columns count as orthogonal


@kernel
def factorise(matrices: Array) -> tuple[int, int]:
    """Replace mass matrices (N, n, n) by L; returns sample and joint of the first without inertia, or -1 and -1."""
    for sample in range(len(matrices)):
        joint = _factor(matrices[sample])
        if joint >= 0:
            return sample, joint
        for i in range(matrices.shape[1]):
            for k in range(i + 1, matrices.shape[1]):
                matrices[sample, i, k] = 0.0
    return -1, -1


@kernel
def solve(matrices: Array, vectors: Array) -> tuple[int, int]:
    """Replace vectors (N, n) by ``M^-1 b``; overwrites the matrices, and returns the same as ``factorise``."""
    for sample in range(len(matrices)):
        joint = _factor(matrices[sample])
        if joint >= 0:
            return sample, joint
        _forward(matrices[sample], vectors[sample])
        backward(matrices[sample], vectors[sample])
    return -1, -1


@kernel
def least_change(
    matrices: Array, jacobians: Array, force: Array, drift: Array, tolerance: float, motion: Array, multipliers: Array,
    found: Array,
) -> tuple[int, int]:  # fmt: skip
    """Solve for x, ``motion`` (N, n), and lambda, ``multipliers`` (N, k); returns as ``factorise``.

    M, ``matrices`` (N, n, n), is overwritten. Singular values below a share ``tolerance`` of the largest count as zero.
    ``found``, (N, 3): rank, condition number of the rows kept, and largest part of d, the ``drift``, that no x can
    satisfy.
    """
    count, rows, n = jacobians.shape
    w, turns = np.empty((rows, n)), np.empty((rows, rows))
    for sample in range(count):
        factor, x, answer = matrices[sample], motion[sample], multipliers[sample]
        joint = _factor(factor)
        if joint >= 0:
            return sample, joint
        for i in range(n):
            x[i] = force[sample, i]
        _forward(factor, x)
        for k in range(rows):
            for i in range(n):
                w[k, i] = jacobians[sample, k, i]
            _forward(factor, w[k])
        _orthogonal(w, turns)
        largest, smallest, rank, missed = 0.0, np.inf, 0, 0.0
        for k in range(rows):
            answer[k] = 0.0
            largest = max(largest, math.sqrt(scalar_product(w[k], w[k])))
        for k in range(rows):
            size, wanted = math.sqrt(scalar_product(w[k], w[k])), scalar_product(turns[k], drift[sample])
            if size <= tolerance * largest:
                missed = max(missed, abs(wanted))
                continue
            rank += 1
            smallest = min(smallest, size)
            # The rows of w are orthogonal: each determines its part of x independently of the others.
            push = (scalar_product(w[k], x) / size + wanted / size) / size
            for i in range(n):
                x[i] -= push * w[k, i]
            for i in range(rows):
                answer[i] += push * turns[k, i]
        backward(factor, x)
        found[sample, 0], found[sample, 1], found[sample, 2] = rank, largest / smallest if rank else 1.0, missed
    return -1, -1


@law
def _factor(matrix: Array) -> int:
    """Replace the lower half of a mass matrix by its factor; returns the first joint without inertia, or -1."""
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
    """Replace b by L^-1 b."""
    for i in range(len(vector)):
        total = vector[i]
        for k in range(i):
            total -= factor[i, k] * vector[k]
        vector[i] = total / factor[i, i]


@law
def backward(factor: Array, vector: Array) -> None:
    """Replace b by L^-T b."""
    for i in range(len(vector) - 1, -1, -1):
        total = vector[i]
        for k in range(i + 1, len(vector)):
            total -= factor[k, i] * vector[k]
        vector[i] = total / factor[i, i]


@law
def scalar_product(a: Array, b: Array) -> float:
    """Scalar product of two rows or columns of any length."""
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
    """Rotate rows until they are orthogonal; the rotations are accumulated in ``turns``."""
    count = len(rows)
    for p in range(count):
        for q in range(count):
            turns[p, q] = 1.0 if p == q else 0.0
    for _ in range(MOST_SWEEPS):
        still = True
        for p in range(count - 1):
            for q in range(p + 1, count):
                a, b, c = (
                    scalar_product(rows[p], rows[p]),
                    scalar_product(rows[q], rows[q]),
                    scalar_product(rows[p], rows[q]),
                )
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
