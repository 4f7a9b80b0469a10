"""One step of each compiled method, with its error and the polynomial between its ends.

A polynomial is four rows C1 to C4 of the block: x(s) = X + s C1 + s^2 C2 + s^3 C3 + s^4 C4, s from 0 to 1.
Compiled into ``steppers.py`` and ``rosenbrock_kernel.py``; a change here must be told there, see ``SOURCES``.
"""

from __future__ import annotations

from typing import Any

import numba as nb
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
# As tuples their entries are constants of the compiled code. The second stage has no weight in result, error and curve.
_A, _P = (tuple(tuple(float(entry) for entry in row) for row in table) for table in (RK45.A, RK45.P))
_DIAGONAL = 10.0  # so many times smaller than another entry a diagonal may be and stay the pivot
_B, _C, _E = (tuple(float(entry) for entry in table) for table in (RK45.B, RK45.C, RK45.E))


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
def factor(matrix: Array, packed: Array, order: Any) -> None:
    """Lower times upper triangle in place, a row exchanged where its diagonal is small; then packed without zeros.

    Args:
        matrix: (n, n), overwritten; its rows and columns are in the order of elimination.
        packed: Takes the entries row by row, below and above the diagonal, behind them the inverse diagonal; (n n,).
        order: Filled with the states whose rates stand in the rows (n), where each row's entries start, below and above
            the diagonal (2 n + 1), and their states (n n - n); at its end the states in the order of elimination (n).
    """
    n = len(matrix)
    found, states = 3 * n + 1, n * n + 2 * n + 1  # the first as scratch: the columns of the pivot's row
    for i in range(n):
        order[i] = order[states + i]
    for k in range(n):
        best, pivot = _DIAGONAL * abs(matrix[k, k]), k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > best:
                best, pivot = abs(matrix[i, k]), i
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        inverse = 1.0 / matrix[k, k]
        matrix[k, k] = inverse
        last = found
        for j in range(k + 1, n):
            if matrix[k, j] != 0.0:
                order[last] = j
                last += 1
        for i in range(k + 1, n):
            if matrix[i, k] != 0.0:
                share = matrix[i, k] * inverse
                matrix[i, k] = share
                for e in range(found, last):
                    matrix[i, order[e]] -= share * matrix[k, order[e]]
    last = found
    for i in range(n):
        order[n + 2 * i] = last
        for j in range(i):
            if matrix[i, j] != 0.0:
                order[last], packed[last - found] = order[states + j], matrix[i, j]
                last += 1
        order[n + 2 * i + 1] = last
        for j in range(n - 1, i, -1):  # what is found last is asked for last: the sums of several rows overlap
            if matrix[i, j] != 0.0:
                order[last], packed[last - found] = order[states + j], matrix[i, j]
                last += 1
        packed[n * n - n + i] = matrix[i, i]
    order[3 * n] = last


@nb.njit(**PART)
def solve(packed: Array, order: Any, block: Array, row: int, goal: int) -> None:
    """Solve with the factors.

    Args:
        packed, order: From ``factor``.
        block: Rows of vectors.
        row, goal: Right-hand side and answer, different rows.
    """
    n = block.shape[1]
    found, states, diagonal = 3 * n + 1, n * n + 2 * n + 1, n * n - n
    for i in range(n):
        total = block[row, order[i]]
        for e in range(order[n + 2 * i], order[n + 2 * i + 1]):
            total -= packed[e - found] * block[goal, order[e]]
        block[goal, order[states + i]] = total
    for i in range(n - 1, -1, -1):
        total = block[goal, order[states + i]]
        for e in range(order[n + 2 * i + 1], order[n + 2 * i + 2]):
            total -= packed[e - found] * block[goal, order[e]]
        block[goal, order[states + i]] = total * packed[diagonal + i]


# long kernel: the six stages side by side, as in the table
@nb.njit(**PART)
def rodas_step(
    address: int,
    h: float,
    block: Array,
    jacobian: Array,
    matrix: Array,
    packed: Array,
    order: Any,
    data: Any,
    clock: Array,
    count: Any,
) -> None:
    """A step of RODAS from row X with rates F0, df/dt FT and the Jacobian; fills NEXT, ERROR and the polynomial.

    Args:
        address: Of the right-hand side.
        h: Step [s].
        block, jacobian, matrix, packed, order, data, clock, count: See ``rosenbrock_kernel.advance``.
    """
    n = block.shape[1]
    t, limit, inverse, diagonal = clock[TIME], clock[LIMIT], 1.0 / h, 1.0 / (h * r.GAMMA)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = -jacobian[i, j]
        matrix[i, i] += diagonal
    factor(matrix, packed, order)
    count[FACTORISATIONS] += 1
    b = block
    for i in range(n):
        b[RATES_AT, i] = b[F0, i] + h * r.GAMMA1 * b[FT, i]
    solve(packed, order, b, RATES_AT, U1)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A21 * b[U1, i]
    rates(address, min(t + r.ALPHA2 * h, limit), STAGE, RATES_AT, b, data, count)
    for i in range(n):
        b[RATES_AT, i] += inverse * r.C21 * b[U1, i] + h * r.GAMMA2 * b[FT, i]
    solve(packed, order, b, RATES_AT, U2)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A31 * b[U1, i] + r.A32 * b[U2, i]
    rates(address, min(t + r.ALPHA3 * h, limit), STAGE, RATES_AT, b, data, count)
    for i in range(n):
        b[RATES_AT, i] += inverse * (r.C31 * b[U1, i] + r.C32 * b[U2, i]) + h * r.GAMMA3 * b[FT, i]
    solve(packed, order, b, RATES_AT, U3)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A41 * b[U1, i] + r.A42 * b[U2, i] + r.A43 * b[U3, i]
    rates(address, min(t + r.ALPHA4 * h, limit), STAGE, RATES_AT, b, data, count)
    for i in range(n):
        mixed = r.C41 * b[U1, i] + r.C42 * b[U2, i] + r.C43 * b[U3, i]
        b[RATES_AT, i] += inverse * mixed + h * r.GAMMA4 * b[FT, i]
    solve(packed, order, b, RATES_AT, U4)
    for i in range(n):
        b[STAGE, i] = b[X, i] + r.A51 * b[U1, i] + r.A52 * b[U2, i] + r.A53 * b[U3, i] + r.A54 * b[U4, i]
    later = min(t + h, limit)
    rates(address, later, STAGE, RATES_AT, b, data, count)
    for i in range(n):
        b[RATES_AT, i] += inverse * (r.C51 * b[U1, i] + r.C52 * b[U2, i] + r.C53 * b[U3, i] + r.C54 * b[U4, i])
    solve(packed, order, b, RATES_AT, U5)
    for i in range(n):
        b[STAGE, i] += b[U5, i]
    rates(address, later, STAGE, RATES_AT, b, data, count)
    for i in range(n):
        mixed = r.C61 * b[U1, i] + r.C62 * b[U2, i] + r.C63 * b[U3, i] + r.C64 * b[U4, i] + r.C65 * b[U5, i]
        b[RATES_AT, i] += inverse * mixed
    solve(packed, order, b, RATES_AT, U6)
    for i in range(n):
        b[NEXT, i] = b[STAGE, i] + b[U6, i]
        b[ERROR, i] = b[U6, i]
        first = r.D11 * b[U1, i] + r.D12 * b[U2, i] + r.D13 * b[U3, i] + r.D14 * b[U4, i] + r.D15 * b[U5, i]
        second = r.D21 * b[U1, i] + r.D22 * b[U2, i] + r.D23 * b[U3, i] + r.D24 * b[U4, i] + r.D25 * b[U5, i]
        b[C1, i] = b[NEXT, i] - b[X, i] + first
        b[C2, i] = second - first
        b[C3, i] = -second
        b[C4, i] = 0.0


# long kernel: the stages side by side, as in the table
@nb.njit(**PART)
def dormand_prince_step(address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> None:
    """A step of Dormand and Prince's method from row X with rates F0; F1 gets the rates at its end.

    Args:
        address: Of the right-hand side.
        h: Step [s].
        block, data, clock, count: See ``rosenbrock_kernel.advance``.
    """
    n, b, c = block.shape[1], block, _C
    t, limit = clock[TIME], clock[LIMIT]
    # The first stage is F0; the others lie in U1 to U5, the last in F1.
    a = _A[1]
    for i in range(n):
        b[STAGE, i] = b[X, i] + h * a[0] * b[F0, i]
    rates(address, min(t + c[1] * h, limit), STAGE, U1, b, data, count)
    a2 = _A[2]
    for i in range(n):
        b[STAGE, i] = b[X, i] + h * (a2[0] * b[F0, i] + a2[1] * b[U1, i])
    rates(address, min(t + c[2] * h, limit), STAGE, U2, b, data, count)
    a3 = _A[3]
    for i in range(n):
        b[STAGE, i] = b[X, i] + h * (a3[0] * b[F0, i] + a3[1] * b[U1, i] + a3[2] * b[U2, i])
    rates(address, min(t + c[3] * h, limit), STAGE, U3, b, data, count)
    a4 = _A[4]
    for i in range(n):
        mixed = a4[0] * b[F0, i] + a4[1] * b[U1, i] + a4[2] * b[U2, i] + a4[3] * b[U3, i]
        b[STAGE, i] = b[X, i] + h * mixed
    rates(address, min(t + c[4] * h, limit), STAGE, U4, b, data, count)
    a5 = _A[5]
    for i in range(n):
        mixed = a5[0] * b[F0, i] + a5[1] * b[U1, i] + a5[2] * b[U2, i] + a5[3] * b[U3, i] + a5[4] * b[U4, i]
        b[STAGE, i] = b[X, i] + h * mixed
    later = min(t + h, limit)
    rates(address, later, STAGE, U5, b, data, count)
    w, e = _B, _E
    for i in range(n):
        mixed = w[0] * b[F0, i] + w[2] * b[U2, i] + w[3] * b[U3, i] + w[4] * b[U4, i] + w[5] * b[U5, i]
        b[NEXT, i] = b[X, i] + h * mixed
    rates(address, later, NEXT, F1, b, data, count)
    p0, p2, p3, p4, p5, p6 = _P[0], _P[2], _P[3], _P[4], _P[5], _P[6]
    for i in range(n):
        k0, k2, k3, k4, k5, k6 = h * b[F0, i], h * b[U2, i], h * b[U3, i], h * b[U4, i], h * b[U5, i], h * b[F1, i]
        b[ERROR, i] = e[0] * k0 + e[2] * k2 + e[3] * k3 + e[4] * k4 + e[5] * k5 + e[6] * k6
        b[C1, i] = k0
        b[C2, i] = p0[1] * k0 + p2[1] * k2 + p3[1] * k3 + p4[1] * k4 + p5[1] * k5 + p6[1] * k6
        b[C3, i] = p0[2] * k0 + p2[2] * k2 + p3[2] * k3 + p4[2] * k4 + p5[2] * k5 + p6[2] * k6
        b[C4, i] = p0[3] * k0 + p2[3] * k2 + p3[3] * k3 + p4[3] * k4 + p5[3] * k5 + p6[3] * k6


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
