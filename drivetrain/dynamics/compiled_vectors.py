"""Vectors of three as tuples, for compiled code: they live in registers, where small arrays would live in memory.

Compiled into ``articulated_kernel.py`` and ``frame_kernels.py``; a change here must be told there, see ``SOURCES``.
"""

from __future__ import annotations

from typing import Any

import numba as nb

from drivetrain.arrays import Array
from drivetrain.compiled_parts import CompiledPart

_njit: Any = nb.njit  # whose annotations do not know all of its options

Vector = tuple[float, float, float]
part: Any = _njit(
    error_model="numpy", nogil=True, fastmath={"contract"}, no_cpython_wrapper=True, no_cfunc_wrapper=True,
    pipeline_class=CompiledPart,
)  # fmt: skip


@part
def cross(a: Vector, b: Vector) -> Vector:
    """The cross product.

    Args:
        a, b: Vectors [any unit].

    Returns:
        a x b [product of the units].
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def dot(a: Vector, b: Vector) -> float:
    """The scalar product.

    Args:
        a, b: Vectors [any unit].

    Returns:
        a . b [product of the units].
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def get(o: Array, at: int) -> Vector:
    """Three columns of a row.

    Args:
        o: The row [any unit].
    """
    return o[at], o[at + 1], o[at + 2]


@part
def put(o: Array, at: int, a: Vector) -> None:
    """Put a vector into three columns of a row.

    Args:
        o: The row [any unit].
    """
    o[at], o[at + 1], o[at + 2] = a


@part
def add(o: Array, at: int, a: Vector) -> None:
    """Add a vector to three columns of a row.

    Args:
        o: The row [any unit].
    """
    o[at] += a[0]
    o[at + 1] += a[1]
    o[at + 2] += a[2]
