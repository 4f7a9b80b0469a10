"""A linear stage of two states over a step in which what drives it is held: matrices made once for many steps.

Of ``x' = A x + b`` over a step h the end is ``E x + h F b`` and the mean ``F x + h G b`` with

    E = exp(A h),   F = (exp(A h) - 1) (A h)^-1,   G = (F - 1) (A h)^-1,

from the series of a small part of the step, doubled until it is the whole: that divides by nothing, so that neither a
short step nor a slow motion beside a fast one costs digits.

Reference: Higham, Functions of Matrices (2008), section 10.7.4 (the phi functions), with 10.3 (scaling and squaring).
"""

from __future__ import annotations

from typing import Any

from drivetrain.jit import kernel

TERMS = 14  # of the series; up to 1/2 the next is below rounding
Matrix = tuple[float, float, float, float]  # its entries, row after row


@kernel
def times(a: Matrix, b: Matrix) -> Matrix:
    """The product of two matrices."""
    return (
        a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]
    )  # fmt: skip


@kernel
def held_step(a: Matrix, h: float) -> tuple[Matrix, Matrix, Matrix]:
    """E, F and G of a step."""
    doublings = 0
    while max(abs(a[0]) + abs(a[1]), abs(a[2]) + abs(a[3])) * h > 0.5 and doublings < 1000:
        h *= 0.5
        doublings += 1
    x = (a[0] * h, a[1] * h, a[2] * h, a[3] * h)
    # G is 1/2 + x/6 + x^2/24 + ..., from the smallest term on.
    second = (1.0 / TERMS, 0.0, 0.0, 1.0 / TERMS)
    for k in range(TERMS - 1, 1, -1):
        more = times(second, x)
        second = ((1.0 + more[0]) / k, more[1] / k, more[2] / k, (1.0 + more[3]) / k)
    more = times(second, x)
    first = (1.0 + more[0], more[1], more[2], 1.0 + more[3])
    more = times(first, x)
    whole = (1.0 + more[0], more[1], more[2], 1.0 + more[3])
    for _ in range(doublings):
        more = times(whole, second)
        second = (
            0.25 * (more[0] + second[0] + first[0]), 0.25 * (more[1] + second[1] + first[1]),
            0.25 * (more[2] + second[2] + first[2]), 0.25 * (more[3] + second[3] + first[3]),
        )  # fmt: skip
        more = times(whole, first)
        first = (
            0.5 * (more[0] + first[0]), 0.5 * (more[1] + first[1]), 0.5 * (more[2] + first[2]),
            0.5 * (more[3] + first[3]),
        )  # fmt: skip
        whole = times(whole, whole)
    return whole, first, second


@kernel
def put_matrix(row: Any, matrix: Matrix) -> None:
    """Write a matrix into a row of four numbers [any unit]."""
    for j in range(4):
        row[j] = matrix[j]
