"""Vectors of three as tuples, for compiled code: they are kept in registers, while small arrays would be in memory.

Also functions for records with a ``rotation``: axis, rotation and translation relative to the previous body.
"""

from __future__ import annotations

import math
from typing import Any

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law

Vector = tuple[float, float, float]
Tensor = tuple[float, float, float, float, float, float]  # xx, yy, zz, xy, xz, yz
CONTRACT = {"contract"}
exact: Any = law(fastmath=CONTRACT)


@exact
def vector(a: Array) -> Vector:
    """The numbers of an array of three."""
    return a[0], a[1], a[2]


@exact
def put(o: Array, a: Vector) -> None:
    """Write a vector to an array of three."""
    o[0], o[1], o[2] = a


@exact
def add(o: Array, a: Vector) -> None:
    o[0] += a[0]
    o[1] += a[1]
    o[2] += a[2]


@exact
def plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@exact
def minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@exact
def times(s: float, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


@exact
def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@exact
def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@exact
def turned(r: Array, a: Vector) -> Vector:
    """A vector rotated by a matrix, (3, 3)."""
    return (
        r[0, 0] * a[0] + r[0, 1] * a[1] + r[0, 2] * a[2],
        r[1, 0] * a[0] + r[1, 1] * a[1] + r[1, 2] * a[2],
        r[2, 0] * a[0] + r[2, 1] * a[1] + r[2, 2] * a[2],
    )


@exact
def turned_tensor(r: Array, s: Tensor) -> Tensor:
    """A symmetric tensor rotated by a matrix, ``R S R^T``."""
    a, b, c = turned(r, (s[0], s[3], s[4])), turned(r, (s[3], s[1], s[5])), turned(r, (s[4], s[5], s[2]))
    x, y, z = turned(r, (a[0], b[0], c[0])), turned(r, (a[1], b[1], c[1])), turned(r, (a[2], b[2], c[2]))
    return x[0], y[1], z[2], x[1], x[2], y[2]


@exact
def axis_of(body: Any) -> Vector:
    """The z axis of a body's frame."""
    return body.rotation[0, 2], body.rotation[1, 2], body.rotation[2, 2]


@exact
def turn_on(link: Any, body: Any, before: Any, angle: float) -> None:
    """Rotation of a body after its joint's rotation relative to the previous body."""
    c, s = math.cos(angle), math.sin(angle)
    for r in range(3):
        a, b, d = before.rotation[r, 0], before.rotation[r, 1], before.rotation[r, 2]
        x = a * link.rxx + b * link.ryx + d * link.rzx
        y = a * link.rxy + b * link.ryy + d * link.rzy
        body.rotation[r, 0] = c * x + s * y
        body.rotation[r, 1] = c * y - s * x
        body.rotation[r, 2] = a * link.rxz + b * link.ryz + d * link.rzz


@exact
def step_to(link: Any, before: Any, shift: float) -> Vector:
    """Vector from the origin of the previous body to that of a body translated by ``shift`` along its axis."""
    return turned(before.rotation, (link.px + link.rxz * shift, link.py + link.ryz * shift, link.pz + link.rzz * shift))


@kernel
def squares(a: Array, b: Array, c: Array) -> float:
    """The sum of squares of three arrays of equal length; not finite if a number is not, or is beyond 1e154."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * a[i] + b[i] * b[i] + c[i] * c[i]
    return total


@exact
def linear(a: Array) -> Vector:
    """The linear part of an array of six, whose angular part is ``vector(a)``."""
    return a[3], a[4], a[5]


@exact
def put_six(o: Array, a: Vector, b: Vector) -> None:
    """Write an angular and a linear part to an array of six."""
    o[0], o[1], o[2] = a
    o[3], o[4], o[5] = b


@exact
def add_six(o: Array, a: Vector, b: Vector) -> None:
    """Add an angular and a linear part to an array of six."""
    o[0] += a[0]
    o[1] += a[1]
    o[2] += a[2]
    o[3] += b[0]
    o[4] += b[1]
    o[5] += b[2]


@exact
def dot_six(a: Array, b: Array) -> float:
    """The scalar product of two arrays of six."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
