"""One step of each compiled method, with its error and the polynomial between its ends.

A polynomial is four rows C1 to C4 of the block: x(s) = X + s C1 + s^2 C2 + s^3 C3 + s^4 C4, s from 0 to 1.
Compiled into ``steppers.py`` and ``rosenbrock_kernel.py``; a change here must be told there, see ``SOURCES``.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np
from scipy.integrate import RK45

from drivetrain.arrays import Array
from drivetrain.solvers import rodas4_table as r
from drivetrain.solvers.compiled_function import call_rows
from drivetrain.solvers.layout import (
    C1,
    C2,
    C3,
    C4,
    ERROR,
    F0,
    F1,
    FACTORISATIONS,
    FT,
    LIMIT,
    NEXT,
    PART,
    RATES,
    RATES_AT,
    RUNGE_KUTTA,
    STAGE,
    TIME,
    U1,
    U2,
    U3,
    U4,
    U5,
    U6,
    X,
)

# Dormand and Prince's tables as scipy ships them (Hairer, Norsett, Wanner I, table II.5.2; Shampine's polynomial).
_A, _B, _C, _E, _P = (np.ascontiguousarray(table) for table in (RK45.A, RK45.B, RK45.C, RK45.E, RK45.P))
_STAGES = 6


@nb.njit(**PART)
def rates(address: int, t: float, row: int, goal: int, block: Array, data: Any, count: Any) -> None:
    """The right-hand side at a row of the block, counted.

    Args:
        address: Of the right-hand side.
        t: Instant [s].
        row, goal: Rows of the state and of the answer.
        block, data, count: See ``rosenbrock_kernel.advance``.
    """
    call_rows(address, t, block, row, block, goal, data)
    count[RATES] += 1


@nb.njit(**PART)
def factor(matrix: Array, order: Any) -> None:
    """Lower times upper triangle in place, rows exchanged; the diagonal is left inverted.

    Zeros below a pivot are skipped: this is all the use that is made of sparsity.

    Args:
        matrix: (n, n), overwritten.
        order: (n,), filled with the rows' order.
    """
    n = len(order)
    for i in range(n):
        order[i] = i
    for k in range(n):
        best, pivot = abs(matrix[k, k]), k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > best:
                best, pivot = abs(matrix[i, k]), i
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        inverse = 1.0 / matrix[k, k]
        matrix[k, k] = inverse
        for i in range(k + 1, n):
            if matrix[i, k] != 0.0:
                share = matrix[i, k] * inverse
                matrix[i, k] = share
                for j in range(k + 1, n):
                    matrix[i, j] -= share * matrix[k, j]


@nb.njit(**PART)
def solve(matrix: Array, order: Any, block: Array, row: int, goal: int) -> None:
    """Solve with the factors.

    Args:
        matrix, order: From ``factor``.
        block: Rows of vectors.
        row, goal: Right-hand side and answer, different rows.
    """
    n = len(order)
    for i in range(n):
        total = block[row, order[i]]
        for j in range(i):
            total -= matrix[i, j] * block[goal, j]
        block[goal, i] = total
    for i in range(n - 1, -1, -1):
        total = block[goal, i]
        for j in range(i + 1, n):
            total -= matrix[i, j] * block[goal, j]
        block[goal, i] = total * matrix[i, i]


# long kernel: the six stages side by side, as in the table
@nb.njit(**PART)
def rodas_step(
    address: int,
    h: float,
    block: Array,
    jacobian: Array,
    matrix: Array,
    order: Any,
    data: Any,
    clock: Array,
    count: Any,
) -> None:
    """A step of RODAS from row X with rates F0, df/dt FT and the Jacobian; fills NEXT, ERROR and the polynomial.

    Args:
        address: Of the right-hand side.
        h: Step [s].
        block, jacobian, matrix, order, data, clock, count: See ``rosenbrock_kernel.advance``.
    """
    n = block.shape[1]
    t, limit, inverse, diagonal = clock[TIME], clock[LIMIT], 1.0 / h, 1.0 / (h * r.GAMMA)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = -jacobian[i, j]
        matrix[i, i] += diagonal
    factor(matrix, order)
    count[FACTORISATIONS] += 1
    b = block
    for i in range(n):
        b[RATES_AT, i] = b[F0, i] + h * r.GAMMA1 * b[FT, i]
    solve(matrix, order, b, RATES_AT, U1)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A21 * b[U1, i]
    rates(address, min(t + r.ALPHA2 * h, limit), STAGE, RATES_AT, b, data, count)
    for i in range(n):
        b[RATES_AT, i] += inverse * r.C21 * b[U1, i] + h * r.GAMMA2 * b[FT, i]
    solve(matrix, order, b, RATES_AT, U2)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A31 * b[U1, i] + r.A32 * b[U2, i]
    rates(address, min(t + r.ALPHA3 * h, limit), STAGE, RATES_AT, b, data, count)
    for i in range(n):
        b[RATES_AT, i] += inverse * (r.C31 * b[U1, i] + r.C32 * b[U2, i]) + h * r.GAMMA3 * b[FT, i]
    solve(matrix, order, b, RATES_AT, U3)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A41 * b[U1, i] + r.A42 * b[U2, i] + r.A43 * b[U3, i]
    rates(address, min(t + r.ALPHA4 * h, limit), STAGE, RATES_AT, b, data, count)
    for i in range(n):
        mixed = r.C41 * b[U1, i] + r.C42 * b[U2, i] + r.C43 * b[U3, i]
        b[RATES_AT, i] += inverse * mixed + h * r.GAMMA4 * b[FT, i]
    solve(matrix, order, b, RATES_AT, U4)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A51 * b[U1, i] + r.A52 * b[U2, i] + r.A53 * b[U3, i] + r.A54 * b[U4, i]
    later = min(t + h, limit)
    rates(address, later, STAGE, RATES_AT, b, data, count)
    for i in range(n):
        b[RATES_AT, i] += inverse * (r.C51 * b[U1, i] + r.C52 * b[U2, i] + r.C53 * b[U3, i] + r.C54 * b[U4, i])
    solve(matrix, order, b, RATES_AT, U5)
    for i in range(n):
        b[STAGE, i] += b[U5, i]
    rates(address, later, STAGE, RATES_AT, b, data, count)
    for i in range(n):
        mixed = r.C61 * b[U1, i] + r.C62 * b[U2, i] + r.C63 * b[U3, i] + r.C64 * b[U4, i] + r.C65 * b[U5, i]
        b[RATES_AT, i] += inverse * mixed
    solve(matrix, order, b, RATES_AT, U6)
    for i in range(n):
        b[NEXT, i] = b[STAGE, i] + b[U6, i]
        b[ERROR, i] = b[U6, i]
        first = r.D11 * b[U1, i] + r.D12 * b[U2, i] + r.D13 * b[U3, i] + r.D14 * b[U4, i] + r.D15 * b[U5, i]
        second = r.D21 * b[U1, i] + r.D22 * b[U2, i] + r.D23 * b[U3, i] + r.D24 * b[U4, i] + r.D25 * b[U5, i]
        b[C1, i] = b[NEXT, i] - b[X, i] + first
        b[C2, i] = second - first
        b[C3, i] = -second
        b[C4, i] = 0.0


@nb.njit(**PART)
def dormand_prince_step(address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> None:
    """A step of Dormand and Prince's method from row X with rates F0; F1 gets the rates at its end.

    Args:
        address: Of the right-hand side.
        h: Step [s].
        block, data, clock, count: See ``rosenbrock_kernel.advance``.
    """
    n, b = block.shape[1], block
    t, limit = clock[TIME], clock[LIMIT]
    # The first stage is F0; the others lie in U1 to U5, the last in F1.
    for s in range(1, _STAGES):
        for i in range(n):
            total = _A[s, 0] * b[F0, i]
            for k in range(1, s):
                total += _A[s, k] * b[U1 + k - 1, i]
            b[STAGE, i] = b[X, i] + h * total
        rates(address, min(t + _C[s] * h, limit), STAGE, U1 + s - 1, b, data, count)
    for i in range(n):
        total = _B[0] * b[F0, i]
        for k in range(1, _STAGES):
            total += _B[k] * b[U1 + k - 1, i]
        b[NEXT, i] = b[X, i] + h * total
    rates(address, min(t + h, limit), NEXT, F1, b, data, count)
    for i in range(n):
        error = _E[0] * b[F0, i] + _E[_STAGES] * b[F1, i]
        for k in range(1, _STAGES):
            error += _E[k] * b[U1 + k - 1, i]
        b[ERROR, i] = h * error
        for power in range(4):
            total = _P[0, power] * b[F0, i] + _P[_STAGES, power] * b[F1, i]
            for k in range(1, _STAGES):
                total += _P[k, power] * b[U1 + k - 1, i]
            b[C1 + power, i] = h * total


@nb.njit(**PART)
def fixed_step(method: int, address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> None:
    """A step of the classical Runge-Kutta method (a cubic between its ends) or of Euler's (a straight line).

    Args:
        method: RUNGE_KUTTA or EULER of ``layout``.
        address: Of the right-hand side.
        h: Step [s].
        block, data, clock, count: See ``rosenbrock_kernel.advance``.
    """
    n, b = block.shape[1], block
    t, limit = clock[TIME], clock[LIMIT]
    for i in range(n):
        b[ERROR, i] = b[C2, i] = b[C3, i] = b[C4, i] = 0.0
        b[C1, i] = h * b[F0, i]
        b[NEXT, i] = b[X, i] + b[C1, i]
    if method != RUNGE_KUTTA:
        return
    for s in range(3):
        share = 1.0 if s == 2 else 0.5
        for i in range(n):
            b[STAGE, i] = b[X, i] + share * h * b[F0 if s == 0 else U1 + s - 1, i]
        rates(address, min(t + share * h, limit), STAGE, U1 + s, b, data, count)
    for i in range(n):
        b[NEXT, i] = b[X, i] + h / 6.0 * (b[F0, i] + 2.0 * (b[U1, i] + b[U2, i]) + b[U3, i])
    rates(address, min(t + h, limit), NEXT, F1, b, data, count)  # the next step begins with it
    for i in range(n):
        rise = b[NEXT, i] - b[X, i]
        first, last = h * b[F0, i] - rise, rise - h * b[F1, i]
        b[C1, i] = rise + first
        b[C2, i] = last - 2.0 * first
        b[C3, i] = first - last


@nb.njit(**PART)
def within(share: float, block: Array, goal: int) -> None:
    """The state at a share of the step, on its polynomial.

    Args:
        share: 0 at the beginning, 1 at the end.
        block: See ``rosenbrock_kernel.advance``.
        goal: Row for the answer.
    """
    for i in range(block.shape[1]):
        curve = block[C2, i] + share * (block[C3, i] + share * block[C4, i])
        block[goal, i] = block[X, i] + share * (block[C1, i] + share * curve)
