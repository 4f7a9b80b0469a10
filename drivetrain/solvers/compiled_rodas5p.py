"""One step of RODAS5P, with its error and the polynomial between its ends; see ``compiled_steps.py``."""

from __future__ import annotations

from typing import Any

from drivetrain.arrays import Array
from drivetrain.jit import law
from drivetrain.solvers import rodas5p_table as r
from drivetrain.solvers.compiled_rows import mix
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

# As tuples their entries are constants of the compiled code. The curve's rows are what the states x(s) need.
_A, _C, _T, _G = r.A, r.C, r.ALPHA, r.GAMMAS
_FIRST, _SECOND, _THIRD = r.D
_BENDS = tuple(b - a for a, b in zip(_FIRST, _SECOND, strict=True))
_TURNS = tuple(b - a for a, b in zip(_SECOND, _THIRD, strict=True))
_STAGES = (U1, U2, U3, U4, U5, U6, U7, U8)
_LAST = tuple(-c for c in _THIRD)


# long kernel: the eight stages side by side, as in the table
@law
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
        h: Step [s].
    """
    b = block
    t, limit, over, diagonal = clock[TIME], clock[LIMIT], 1.0 / h, 1.0 / (h * r.GAMMA)
    factor(jacobian, diagonal, matrix, packed, order)
    count[FACTORISATIONS] += 1
    mix(b, RATES_AT, (F0, FT), (1.0, h * r.GAMMA))
    solve(packed, order, b, RATES_AT, U1)
    a1 = _A[0][0]
    mix(b, STAGE, (X, U1), (1.0, a1))
    rates(address, min(t + _T[0] * h, limit), STAGE, RATES_AT, b, data, count)
    c1 = _C[0][0]
    mix(b, RATES_AT, (RATES_AT, U1, FT), (1.0, over * c1, h * _G[1]))
    solve(packed, order, b, RATES_AT, U2)
    a1, a2 = _A[1]
    mix(b, STAGE, (X, U1, U2), (1.0, a1, a2))
    rates(address, min(t + _T[1] * h, limit), STAGE, RATES_AT, b, data, count)
    c1, c2 = _C[1]
    mix(b, RATES_AT, (RATES_AT, U1, U2, FT), (1.0, over * c1, over * c2, h * _G[2]))
    solve(packed, order, b, RATES_AT, U3)
    a1, a2, a3 = _A[2]
    mix(b, STAGE, (X, U1, U2, U3), (1.0, a1, a2, a3))
    rates(address, min(t + _T[2] * h, limit), STAGE, RATES_AT, b, data, count)
    c1, c2, c3 = _C[2]
    mix(b, RATES_AT, (RATES_AT, U1, U2, U3, FT), (1.0, over * c1, over * c2, over * c3, h * _G[3]))
    solve(packed, order, b, RATES_AT, U4)
    a1, a2, a3, a4 = _A[3]
    mix(b, STAGE, (X, U1, U2, U3, U4), (1.0, a1, a2, a3, a4))
    rates(address, min(t + _T[3] * h, limit), STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4 = _C[3]
    mix(b, RATES_AT, (RATES_AT, U1, U2, U3, U4, FT), (1.0, over * c1, over * c2, over * c3, over * c4, h * _G[4]))
    solve(packed, order, b, RATES_AT, U5)
    a1, a2, a3, a4, a5 = _A[4]
    mix(b, STAGE, (X, U1, U2, U3, U4, U5), (1.0, a1, a2, a3, a4, a5))
    later = min(t + h, limit)
    rates(address, later, STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4, c5 = _C[4]
    mix(b, RATES_AT, (RATES_AT, U1, U2, U3, U4, U5), (1.0, over * c1, over * c2, over * c3, over * c4, over * c5))
    solve(packed, order, b, RATES_AT, U6)
    mix(b, STAGE, (STAGE, U6), (1.0, 1.0))
    rates(address, later, STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4, c5, c6 = _C[5]
    mix(b, RATES_AT, (RATES_AT, U1, U2, U3), (1.0, over * c1, over * c2, over * c3))
    mix(b, RATES_AT, (RATES_AT, U4, U5, U6), (1.0, over * c4, over * c5, over * c6))
    solve(packed, order, b, RATES_AT, U7)
    mix(b, STAGE, (STAGE, U7), (1.0, 1.0))
    rates(address, later, STAGE, RATES_AT, b, data, count)
    c1, c2, c3, c4, c5, c6, c7 = _C[6]
    mix(b, RATES_AT, (RATES_AT, U1, U2, U3, U4), (1.0, over * c1, over * c2, over * c3, over * c4))
    mix(b, RATES_AT, (RATES_AT, U5, U6, U7), (1.0, over * c5, over * c6, over * c7))
    solve(packed, order, b, RATES_AT, U8)
    mix(b, NEXT, (STAGE, U8), (1.0, 1.0))
    mix(b, ERROR, (U8,), (1.0,))
    mix(b, C1, (NEXT, X, *_STAGES), (1.0, -1.0, *_FIRST))
    mix(b, C2, _STAGES, _BENDS)
    mix(b, C3, _STAGES, _TURNS)
    mix(b, C4, _STAGES, _LAST)
