"""How frames fixed to links move, and the rows of loops closed between two of them, compiled.

Twists are along the base's axes, at its origin, until a point is named. Accelerations are those at constant joint
rates; what a constraint needs of them is its own second derivative without the accelerations of the joints.

Reference: the constraint rows are those of Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems (1989),
section 9.4: a distance along an axis, and the scalar product of two axes.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.compiled_vectors import Vector, cross, dot, get, part, put
from drivetrain.jit import kernel

# Columns of a link's row: its displacement since the joints were at zero (rotation row by row, place), its twist, and
# the rate of its twist; of a joint's, its axis.
PLACE, TWIST, DRIFT, AXIS, COLUMNS = 9, 12, 18, 24, 30
ALONG, ACROSS = 0, 1  # kinds of rows: distance along an axis of b; scalar product of an axis of b and one of a


@part
def _turned(o: Array, a: Vector) -> Vector:
    return (
        o[0] * a[0] + o[1] * a[1] + o[2] * a[2],
        o[3] * a[0] + o[4] * a[1] + o[5] * a[2],
        o[6] * a[0] + o[7] * a[1] + o[8] * a[2],
    )


@part
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part
def _scaled(f: float, a: Vector) -> Vector:
    return f * a[0], f * a[1], f * a[2]


@part
def _displace(before: Array, screw: Array, angle: float, o: Array) -> None:
    """The displacement of a link: that of the link before, times the exponential of its joint."""
    w, v = get(screw, 0), get(screw, 3)
    shift = _scaled(angle, v)
    o[:PLACE] = before[:PLACE]
    if dot(w, w) > 0.0:
        s, c = math.sin(angle), 2.0 * math.sin(0.5 * angle) ** 2
        point, pitch = cross(w, v), dot(w, v)
        across = cross(w, point)
        moved = _sum(_scaled(s, across), _scaled(c, cross(w, across)))
        shift = _sum(_scaled(-1.0, moved), _scaled(angle * pitch, w))
        for r in range(3):
            row = get(before, 3 * r)
            # A row vector turned the other way round.
            once = cross(row, w)
            put(o, 3 * r, _sum(row, _sum(_scaled(s, once), _scaled(c, cross(once, w)))))
    put(o, PLACE, _sum(get(before, PLACE), _turned(before, shift)))


@part
def _spread(screws: Array, q: Array, qd: Array, links: Array) -> None:
    """Displacement, twist and drift of the base and of all links, (n + 1, COLUMNS)."""
    for i in range(len(q)):
        before, o = links[i], links[i + 1]
        w = _turned(before, get(screws[i], 0))
        v = _sum(_turned(before, get(screws[i], 3)), cross(get(before, PLACE), w))
        put(o, AXIS, w)
        put(o, AXIS + 3, v)
        bw, bv = get(before, TWIST), get(before, TWIST + 3)
        put(o, TWIST, _sum(bw, _scaled(qd[i], w)))
        put(o, TWIST + 3, _sum(bv, _scaled(qd[i], v)))
        put(o, DRIFT, _sum(get(before, DRIFT), _scaled(qd[i], cross(bw, w))))
        linear = _scaled(qd[i], _sum(cross(bw, v), cross(bv, w)))
        put(o, DRIFT + 3, _sum(get(before, DRIFT + 3), linear))
        _displace(before, screws[i], q[i], o)


@part
def _frame(o: Array, home: Array, pose: Array) -> None:
    """The pose of a frame fixed to a link: rotation column by column, place; then its velocity and drift there."""
    for k in range(3):
        put(pose, 3 * k, _turned(o, (home[0, k], home[1, k], home[2, k])))
    x = _sum(get(o, PLACE), _turned(o, (home[0, 3], home[1, 3], home[2, 3])))
    w, alpha = get(o, TWIST), get(o, DRIFT)
    v = _sum(get(o, TWIST + 3), cross(w, x))
    put(pose, 9, x)
    put(pose, 12, w)
    put(pose, 15, v)
    put(pose, 18, alpha)
    put(pose, 21, _sum(get(o, DRIFT + 3), _sum(cross(alpha, x), cross(w, v))))


@part
def _axis_motion(pose: Array, k: int) -> tuple[Vector, Vector, Vector]:
    """An axis of a frame, its rate, and its second derivative at constant joint rates."""
    u, w = get(pose, 3 * k), get(pose, 12)
    rate = cross(w, u)
    return u, rate, _sum(cross(get(pose, 18), u), cross(w, rate))


@part
def _row(code: Array, a: Array, b: Array, links: Array, on_a: int, on_b: int, row: Array) -> tuple[float, float]:
    """One row of a closure: its Jacobian, and its error and drift."""
    u, du, ddu = _axis_motion(b, code[1])
    if code[0] == ALONG:
        x = get(a, 9)
        back = _scaled(-1.0, get(b, 9))
        y, dy, ddy = (
            _sum(x, back),
            _sum(get(a, 15), _scaled(-1.0, get(b, 15))),
            _sum(get(a, 21), _scaled(-1.0, get(b, 21))),
        )
        # A unit rate of a joint moves x_a by v + w x x_a, x_b likewise, and turns u.
        by_a, by_b, push = cross(x, u), _sum(cross(u, y), cross(back, u)), _scaled(-1.0, u)
        pull = u
    else:
        y, dy, ddy = _axis_motion(a, code[2])
        by_a, by_b = cross(y, u), cross(u, y)
        pull = push = (0.0, 0.0, 0.0)
    for j in range(len(row)):
        w, v = get(links[j + 1], AXIS), get(links[j + 1], AXIS + 3)
        row[j] = 0.0
        if j <= on_a:
            row[j] += dot(by_a, w) + dot(pull, v)
        if j <= on_b:
            row[j] += dot(by_b, w) + dot(push, v)
    return dot(u, y), dot(ddu, y) + 2.0 * dot(du, dy) + dot(u, ddy)


@kernel
def _close(
    screws: Array,
    homes: Array,
    ends: Array,
    codes: Array,
    q: Array,
    qd: Array,
    error: Array,
    jacobian: Array,
    drift: Array,
) -> None:
    """The rows of a loop closed between the frames ``homes`` on the links ``ends`` (-1 the base)."""
    links, a, b = np.zeros((q.shape[1] + 1, COLUMNS)), np.zeros(24), np.zeros(24)
    links[0, 0] = links[0, 4] = links[0, 8] = 1.0
    for sample in range(len(q)):
        _spread(screws, q[sample], qd[sample], links)
        _frame(links[ends[0] + 1], homes[0], a)
        _frame(links[ends[1] + 1], homes[1], b)
        for k in range(len(codes)):
            error[sample, k], drift[sample, k] = _row(codes[k], a, b, links, ends[0], ends[1], jacobian[sample, k])


@kernel
def _move(screws: Array, home: Array, end: int, q: Array, qd: Array, pose: Array, jacobian: Array) -> None:
    """Pose, velocity and drift of a frame (N, 24), and the Jacobian of its velocity (N, 6, n)."""
    links = np.zeros((q.shape[1] + 1, COLUMNS))
    links[0, 0] = links[0, 4] = links[0, 8] = 1.0
    for sample in range(len(q)):
        _spread(screws, q[sample], qd[sample], links)
        _frame(links[end + 1], home, pose[sample])
        x = get(pose[sample], 9)
        for j in range(q.shape[1]):
            o = links[j + 1]
            w, v = get(o, AXIS), get(o, AXIS + 3)
            v = _sum(v, cross(w, x))
            for r in range(3):
                jacobian[sample, r, j] = w[r] if j <= end else 0.0
                jacobian[sample, 3 + r, j] = v[r] if j <= end else 0.0


def _arrays(kind: Any, *dimensions: int) -> list[Any]:
    return [nb.types.Array(kind, ndim, "C", readonly=True) for ndim in dimensions]


@lru_cache(maxsize=1)
def compiled_closure() -> Any:
    """The rows of a closed loop, compiled at the first call or taken from numba's disk cache.

    Returns:
        A function of ``screws`` (n, 6), ``homes`` (2, 4, 4), ``ends`` (2,), ``codes`` (k, 3), ``q, qd`` (N, n) and
        what it fills: ``error`` (N, k), ``jacobian`` (N, k, n), ``drift`` (N, k); all C order, SI units.
    """
    given = [*_arrays(nb.float64, 2, 3), *_arrays(nb.int64, 1, 2), *_arrays(nb.float64, 2, 2)]
    _close.compile(nb.void(*given, *[nb.types.Array(nb.float64, ndim, "C") for ndim in (2, 3, 2)]))
    _close.disable_compile()
    return _close


@lru_cache(maxsize=1)
def compiled_frame() -> Any:
    """The motion of a frame on a link, compiled at the first call or taken from numba's disk cache.

    Returns:
        A function of ``screws`` (n, 6), ``home`` (4, 4), its link, ``q, qd`` (N, n), and what it fills: ``pose``
        (N, 24): axes, place, angular velocity, velocity, and the rates of both at constant joint rates; ``jacobian``
        (N, 6, n) of the velocities; all C order, base axes, SI units.
    """
    given = [*_arrays(nb.float64, 2, 2), nb.int64, *_arrays(nb.float64, 2, 2)]
    _move.compile(nb.void(*given, *[nb.types.Array(nb.float64, ndim, "C") for ndim in (2, 3)]))
    _move.disable_compile()
    return _move
