"""One step of each compiled method, with its error and the polynomial between its ends.

A polynomial is four rows C1 to C4 of the block: x(s) = X + s C1 + s^2 C2 + s^3 C3 + s^4 C4, s from 0 to 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import RK45

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers import rodas4_table as r
from drivetrain.solvers.compiled_function import call_rows
from drivetrain.solvers.compiled_rows import mix
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
# As tuples their entries are constants of the compiled code; of the polynomial a row a power. The second stage has no
# weight in result, error and curve.
_A, _P = (tuple(tuple(float(entry) for entry in row) for row in table) for table in (RK45.A, RK45.P.T))
_HALF, _LOW = 32, (1 << 32) - 1  # two numbers in one word
_DIAGONAL = 10.0  # so many times smaller than another entry a diagonal may be and stay the pivot
_B, _C, _E = (tuple(float(entry) for entry in table) for table in (RK45.B, RK45.C, RK45.E))


@law
def rates(address: int, t: float, row: int, goal: int, block: Array, data: Any, count: Any) -> None:
    """The right-hand side at a row of the block, counted.

    Args:
        t: Instant [s].
    """
    call_rows(address, t, block, row, block, goal, data)
    count[RATES] += 1


@law
def factor(jacobian: Array, diagonal: float, matrix: Array, packed: Array, order: Any) -> None:
    """Lower times upper triangle of a number on the diagonal less a matrix, a row exchanged where its pivot is small.

    What ``solve`` has to do is written down without zeros as one list: a column after the other, so that what follows
    one another does not wait for one another.

    Args:
        jacobian: (n, n), its rows and columns in the order of elimination.
        matrix: Room for the factors, (n, n).
        packed: Takes the entries below the diagonal and above, behind them the inverse pivots; (n n,).
    """
    n = len(matrix)
    found, states = 3 * n + 1, n * n + 2 * n + 1  # the first as scratch: the columns of the pivot's row
    for i in range(n):
        order[i] = order[states + i]
        for j in range(n):
            matrix[i, j] = -jacobian[i, j]
        matrix[i, i] += diagonal
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
                for e in range(np.uint64(found), np.uint64(last)):
                    column = np.uint64(order[e])
                    matrix[i, column] -= share * matrix[k, column]
    last = found
    for j in range(n):
        source = order[states + j] << _HALF
        for i in range(j + 1, n):
            if matrix[i, j] != 0.0:
                order[last], packed[last - found] = order[states + i] + source, matrix[i, j]
                last += 1
    order[n] = last - found
    for j in range(n - 1, -1, -1):
        source = order[states + j] << _HALF
        packed[n * n - n + j] = matrix[j, j]
        for i in range(j):
            if matrix[i, j] != 0.0:
                order[last], packed[last - found] = order[states + i] + source, matrix[i, j]
                last += 1
        order[n + 1 + j] = last - found


@law
def solve(packed: Array, order: Any, block: Array, row: int, goal: int) -> None:
    """Solve with the factors."""
    n = np.uint64(block.shape[1])  # indices without a sign are not looked at whether they count from the end
    one, half, low = np.uint64(1), np.uint64(_HALF), np.uint64(_LOW)
    found, states, pivots = n + n + n + one, n * n + n + n + one, n * n - n
    last = np.uint64(order[n])
    for i in range(n):
        block[goal, np.uint64(order[states + i])] = block[row, np.uint64(order[i])]
    for e in range(last):
        word = np.uint64(order[found + e])
        block[goal, word & low] -= packed[e] * block[goal, word >> half]
    for k in range(n):
        j = n - one - k
        state, first, last = np.uint64(order[states + j]), last, np.uint64(order[n + one + j])
        block[goal, state] *= packed[pivots + j]
        value = block[goal, state]
        for e in range(first, last):
            block[goal, np.uint64(order[found + e]) & low] -= packed[e] * value


# long kernel: the six stages side by side, as in the table
@law
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
        h: Step [s].
    """
    n, b = block.shape[1], block
    t, limit, inverse, diagonal = clock[TIME], clock[LIMIT], 1.0 / h, 1.0 / (h * r.GAMMA)
    factor(jacobian, diagonal, matrix, packed, order)
    count[FACTORISATIONS] += 1
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
@law
def dormand_prince_step(address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> None:
    """A step of Dormand and Prince's method from row X with rates F0; F1 gets the rates at its end.

    Args:
        h: Step [s].
    """
    b, c, a = block, _C, _A
    t, limit = clock[TIME], clock[LIMIT]
    # The first stage is F0; the others lie in U1 to U5, the last in F1.
    mix(b, STAGE, (X, F0), (1.0, h * a[1][0]))
    rates(address, min(t + c[1] * h, limit), STAGE, U1, b, data, count)
    mix(b, STAGE, (X, F0, U1), (1.0, h * a[2][0], h * a[2][1]))
    rates(address, min(t + c[2] * h, limit), STAGE, U2, b, data, count)
    mix(b, STAGE, (X, F0, U1, U2), (1.0, h * a[3][0], h * a[3][1], h * a[3][2]))
    rates(address, min(t + c[3] * h, limit), STAGE, U3, b, data, count)
    mix(b, STAGE, (X, F0, U1, U2, U3), (1.0, h * a[4][0], h * a[4][1], h * a[4][2], h * a[4][3]))
    rates(address, min(t + c[4] * h, limit), STAGE, U4, b, data, count)
    w = a[5]
    mix(b, STAGE, (X, F0, U1, U2, U3, U4), (1.0, h * w[0], h * w[1], h * w[2], h * w[3], h * w[4]))
    later = min(t + h, limit)
    rates(address, later, STAGE, U5, b, data, count)
    w = _B
    mix(b, NEXT, (X, F0, U2, U3, U4, U5), (1.0, h * w[0], h * w[2], h * w[3], h * w[4], h * w[5]))
    rates(address, later, NEXT, F1, b, data, count)
    e, stages = _E, (F0, U2, U3, U4, U5, F1)
    mix(b, ERROR, stages, (h * e[0], h * e[2], h * e[3], h * e[4], h * e[5], h * e[6]))
    mix(b, C1, (F0,), (h,))
    w = _P[1]
    mix(b, C2, stages, (h * w[0], h * w[2], h * w[3], h * w[4], h * w[5], h * w[6]))
    w = _P[2]
    mix(b, C3, stages, (h * w[0], h * w[2], h * w[3], h * w[4], h * w[5], h * w[6]))
    w = _P[3]
    mix(b, C4, stages, (h * w[0], h * w[2], h * w[3], h * w[4], h * w[5], h * w[6]))


@law
def fixed_step(method: int, address: int, h: float, block: Array, data: Any, clock: Array, count: Any) -> None:
    """A step of the classical Runge-Kutta method (a cubic between its ends) or of Euler's (a straight line).

    Args:
        h: Step [s].
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


@law
def within(share: float, block: Array, goal: int) -> None:
    """The state at a share of the step, on its polynomial."""
    for i in range(block.shape[1]):
        curve = block[C2, i] + share * (block[C3, i] + share * block[C4, i])
        block[goal, i] = block[X, i] + share * (block[C1, i] + share * curve)
