"""Vectors of three as tuples, for compiled code: they live in registers, where small arrays would live in memory."""

from __future__ import annotations

from typing import Any

from drivetrain.arrays import Array
from drivetrain.jit import law

Vector = tuple[float, float, float]
exact: Any = law(fastmath={"contract"})


@exact
def vector(a: Array) -> Vector:
    """The numbers of an array of three."""
    return a[0], a[1], a[2]


@exact
def put(o: Array, a: Vector) -> None:
    """Put a vector into an array of three."""
    o[0], o[1], o[2] = a


@exact
def add(o: Array, a: Vector) -> None:
    """Add a vector to an array of three."""
    o[0] += a[0]
    o[1] += a[1]
    o[2] += a[2]


@exact
def plus(a: Vector, b: Vector) -> Vector:
    """A + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@exact
def minus(a: Vector, b: Vector) -> Vector:
    """A - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@exact
def times(s: float, a: Vector) -> Vector:
    """S a."""
    return s * a[0], s * a[1], s * a[2]


@exact
def cross(a: Vector, b: Vector) -> Vector:
    """A x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@exact
def dot(a: Vector, b: Vector) -> float:
    """A . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@exact
def turned(r: Array, a: Vector) -> Vector:
    """A vector turned by a matrix, (3, 3)."""
    return (
        r[0, 0] * a[0] + r[0, 1] * a[1] + r[0, 2] * a[2],
        r[1, 0] * a[0] + r[1, 1] * a[1] + r[1, 2] * a[2],
        r[2, 0] * a[0] + r[2, 1] * a[1] + r[2, 2] * a[2],
    )
