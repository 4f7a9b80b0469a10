"""One step of RODAS5P, with its error and the polynomial between its ends; see ``compiled_steps.py``.

Compiled into ``steppers.py``; a change here must be told there, see ``SOURCES``.
"""

from __future__ import annotations

from typing import Any

import numba as nb

from drivetrain.arrays import Array
from drivetrain.solvers import rodas5p_table as r
from drivetrain.solvers.compiled_steps import factor, rates, solve
from drivetrain.solvers.layout import (
    C1,
    C2,
    C3,
    C4,
    ERROR,
    F0,
    FACTORISATIONS,
    FT,
    LIMIT,
    NEXT,
    PART,
    RATES_AT,
    STAGE,
    TIME,
    U1,
    U2,
    U3,
    U4,
    U5,
    U6,
    U7,
    U8,
    X,
)

_A, _C, _D, _T, _G = r.A, r.C, r.D, r.ALPHA, r.GAMMAS  # as tuples their entries are constants of the compiled code


# long kernel: the eight stages side by side, as in the table
@nb.njit(**PART)
def rodas5p_step(
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
    """A step of RODAS5P from row X with rates F0, df/dt FT and the Jacobian; fills NEXT, ERROR and the polynomial.

    Args:
        address: Of the right-hand side.
        h: Step [s].
        block, jacobian, matrix, packed, order, data, clock, count: See ``rosenbrock_kernel.advance``.
    """
    n, b = block.shape[1], block
    t, limit, inverse, diagonal = clock[TIME], clock[LIMIT], 1.0 / h, 1.0 / (h * r.GAMMA)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = -jacobian[i, j]
        matrix[i, i] += diagonal
    factor(matrix, packed, order)
    count[FACTORISATIONS] += 1
    for i in range(n):
        b[RATES_AT, i] = b[F0, i] + h * r.GAMMA * b[FT, i]
    solve(packed, order, b, RATES_AT, U1)
    a1 = _A[0][0]
    for i in range(n):
        b[STAGE, i] = b[X, i] + a1 * b[U1, i]
    rates(address, min(t + _T[0] * h, limit), STAGE, RATES_AT, b, data, count)
    c1 = _C[0][0]
    for i in range(n):
        mixed = c1 * b[U1, i]
        b[RATES_AT, i] += inverse * mixed + h * _G[1] * b[FT, i]
    solve(packed, order, b, RATES_AT, U2)
    a1, a2 = _A[1]
    for i in range(n):
        b[STAGE, i] = b[X, i] + a1 * b[U1, i] + a2 * b[U2, i]
    rates(address, min(t + _T[1] * h, limit), STAGE, RATES_AT, b, data, count)
    c1, c2 = _C[1]
    for i in range(n):
        mixed = c1 * b[U1, i] + c2 * b[U2, i]
        b[RATES_AT, i] += inverse * mixed + h * _G[2] * b[FT, i]
    solve(packed, order, b, RATES_AT, U3)
    a1, a2, a3 = _A[2]
    for i in range(n):
        b[STAGE, i] = b[X, i] + a1 * b[U1, i] + a2 * b[U2, i] + a3 * b[U3, i]
    rates(address, min(t + _T[2] * h, limit), STAGE, RATES_AT, b, data, count)
    c1, c2, c3 = _C[2]
    for i in range(n):
        mixed = c1 * b[U1, i] + c2 * b[U2, i] + c3 * b[U3, i]
        b[RATES_AT, i] += inverse * mixed + h * _G[3] * b[FT, i]
    solve(packed, order, b, RATES_AT, U4)
    a1, a2, a3, a4 = _A[3]
    for i in range(n):
        b[STAGE, i] = b[X, i] + a1 * b[U1, i] + a2 * b[U2, i] + a3 * b[U3, i] + a4 * b[U4, i]
    rates(address, min(t + _T[3] * h, limit), STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4 = _C[3]
    for i in range(n):
        mixed = c1 * b[U1, i] + c2 * b[U2, i] + c3 * b[U3, i] + c4 * b[U4, i]
        b[RATES_AT, i] += inverse * mixed + h * _G[4] * b[FT, i]
    solve(packed, order, b, RATES_AT, U5)
    a1, a2, a3, a4, a5 = _A[4]
    for i in range(n):
        b[STAGE, i] = b[X, i] + a1 * b[U1, i] + a2 * b[U2, i] + a3 * b[U3, i] + a4 * b[U4, i] + a5 * b[U5, i]
    later = min(t + h, limit)
    rates(address, later, STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4, c5 = _C[4]
    for i in range(n):
        mixed = c1 * b[U1, i] + c2 * b[U2, i] + c3 * b[U3, i] + c4 * b[U4, i] + c5 * b[U5, i]
        b[RATES_AT, i] += inverse * mixed
    solve(packed, order, b, RATES_AT, U6)
    for i in range(n):
        b[STAGE, i] += b[U6, i]
    rates(address, later, STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4, c5, c6 = _C[5]
    for i in range(n):
        mixed = c1 * b[U1, i] + c2 * b[U2, i] + c3 * b[U3, i] + c4 * b[U4, i] + c5 * b[U5, i] + c6 * b[U6, i]
        b[RATES_AT, i] += inverse * mixed
    solve(packed, order, b, RATES_AT, U7)
    for i in range(n):
        b[STAGE, i] += b[U7, i]
    rates(address, later, STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4, c5, c6, c7 = _C[6]
    for i in range(n):
        most = c1 * b[U1, i] + c2 * b[U2, i] + c3 * b[U3, i] + c4 * b[U4, i]
        mixed = most + c5 * b[U5, i] + c6 * b[U6, i] + c7 * b[U7, i]
        b[RATES_AT, i] += inverse * mixed
    solve(packed, order, b, RATES_AT, U8)
    d, e, f = _D
    for i in range(n):
        u1, u2, u3, u4, u5, u6, u7, u8 = b[U1, i], b[U2, i], b[U3, i], b[U4, i], b[U5, i], b[U6, i], b[U7, i], b[U8, i]
        b[NEXT, i] = b[STAGE, i] + u8
        b[ERROR, i] = u8
        first = d[0] * u1 + d[1] * u2 + d[2] * u3 + d[3] * u4
        first += d[4] * u5 + d[5] * u6 + d[6] * u7 + d[7] * u8
        second = e[0] * u1 + e[1] * u2 + e[2] * u3 + e[3] * u4
        second += e[4] * u5 + e[5] * u6 + e[6] * u7 + e[7] * u8
        third = f[0] * u1 + f[1] * u2 + f[2] * u3 + f[3] * u4
        third += f[4] * u5 + f[5] * u6 + f[6] * u7 + f[7] * u8
        b[C1, i] = b[NEXT, i] - b[X, i] + first
        b[C2, i] = second - first
        b[C3, i] = third - second
        b[C4, i] = -third
