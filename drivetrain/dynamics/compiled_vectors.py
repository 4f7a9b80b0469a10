"""Vectors of three as tuples, for compiled code: they live in registers, where small arrays would live in memory."""

from __future__ import annotations

from typing import Any

from drivetrain.arrays import Array
from drivetrain.jit import law

Vector = tuple[float, float, float]
part: Any = law(fastmath={"contract"})


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
