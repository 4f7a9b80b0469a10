"""Motion of frames fixed to links, and the rows of loops closed between two of them, compiled.

Twists are in the base's axes about its origin, unless a point is named. Accelerations are those at constant joint
rates, as the drift of a constraint (its second derivative without joint accelerations) needs them.

Reference: the constraint rows are those of Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems (1989),
section 9.4: a distance along an axis, and the scalar product of two axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.vectors import Vector, cross, dot, exact, minus, plus, put, times, turned, vector
from drivetrain.jit import kernel

# A link: its displacement from joints at zero, its twist (w, v) with its rate, and its joint's screw.
LINK = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),
        *((name, np.float64, (3,)) for name in ("place", "w", "v", "dw", "dv", "turn", "slide")),
    ]
)
# A frame on a link: axes row by row, place; their velocities, and the rates of these at constant joint rates.
FRAME = np.dtype(
    [("axes", np.float64, (3, 3)), *((name, np.float64, (3,)) for name in ("place", "w", "v", "dw", "dv"))]
)
# A row of a closure: the distance along an axis of frame b, or the scalar product of an axis of b and one of a.
ROW = np.dtype([("across", np.int64), ("axis_b", np.int64), ("axis_a", np.int64)])


@kernel
def close_loop(
    screws: Array, homes: Array, ends: Any, rows: Any, q: Array, qd: Array, error: Array, jacobian: Array, drift: Array
) -> None:
    """The rows of a loop closed between two frames."""
    links, frames = np.zeros(len(screws) + 1, LINK), np.empty(2, FRAME)
    for sample in range(len(q)):
        move_links(screws, q[sample], qd[sample], links)
        for end in range(2):
            _move_frame(links[ends[end]], homes[end], frames[end])
        for k in range(len(rows)):
            found = _row(rows[k], frames[0], frames[1], links, ends[0], ends[1], jacobian[sample, k])
            error[sample, k], drift[sample, k] = found


@kernel
def move_frame(screws: Array, home: Array, end: int, q: Array, qd: Array, frames: Any, jacobian: Array) -> None:
    """The motion of a frame on a link, along the base's axes."""
    n = len(screws)
    links = np.zeros(n + 1, LINK)
    for sample in range(len(q)):
        move_links(screws, q[sample], qd[sample], links)
        _move_frame(links[end], home, frames[sample])
        x = vector(frames[sample].place)
        for j in range(n):
            w = vector(links[j].turn)
            v = plus(vector(links[j].slide), cross(w, x))
            for r in range(3):
                jacobian[sample, r, j] = w[r] if j <= end else 0.0
                jacobian[sample, 3 + r, j] = v[r] if j <= end else 0.0


@exact
def move_links(screws: Array, q: Array, qd: Array, links: Any) -> None:
    """Displacement, twist and its rate of all links; the last record is the base's."""
    for j in range(3):
        links[len(q)].rotation[j, j] = 1.0
    for i in range(len(q)):
        # For the first link, index -1 is the last record, the base.
        before, link, screw = links[i - 1], links[i], screws[i]
        angular, linear = (screw[0], screw[1], screw[2]), (screw[3], screw[4], screw[5])
        turn = turned(before.rotation, angular)
        slide = plus(turned(before.rotation, linear), cross(vector(before.place), turn))
        put(link.turn, turn)
        put(link.slide, slide)
        w, v = vector(before.w), vector(before.v)
        put(link.w, plus(w, times(qd[i], turn)))
        put(link.v, plus(v, times(qd[i], slide)))
        put(link.dw, plus(vector(before.dw), times(qd[i], cross(w, turn))))
        put(link.dv, plus(vector(before.dv), times(qd[i], plus(cross(w, slide), cross(v, turn)))))
        _displace(before, angular, linear, q[i], link)


@exact
def _displace(before: Any, w: Vector, v: Vector, angle: float, link: Any) -> None:
    """The displacement of a link: that of the link before, times the exponential of its joint."""
    shift = times(angle, v)
    # Without rotation both stay zero.
    s, c = (np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2) if dot(w, w) > 0.0 else (0.0, 0.0)
    if dot(w, w) > 0.0:
        across = cross(w, cross(w, v))
        moved = plus(times(s, across), times(c, cross(w, across)))
        shift = minus(times(angle * dot(w, v), w), moved)
    for r in range(3):
        row = (before.rotation[r, 0], before.rotation[r, 1], before.rotation[r, 2])
        # A row vector, multiplied from the other side.
        once = cross(row, w)
        put(link.rotation[r], plus(row, plus(times(s, once), times(c, cross(once, w)))))
    put(link.place, plus(vector(before.place), turned(before.rotation, shift)))


@exact
def _move_frame(link: Any, home: Array, frame: Any) -> None:
    """The pose of a frame fixed to a link, its velocity and the rate of the velocity."""
    for k in range(3):
        put(frame.axes[k], turned(link.rotation, (home[0, k], home[1, k], home[2, k])))
    x = plus(vector(link.place), turned(link.rotation, (home[0, 3], home[1, 3], home[2, 3])))
    w, dw = vector(link.w), vector(link.dw)
    v = plus(vector(link.v), cross(w, x))
    put(frame.place, x)
    put(frame.w, w)
    put(frame.v, v)
    put(frame.dw, dw)
    put(frame.dv, plus(vector(link.dv), plus(cross(dw, x), cross(w, v))))


@exact
def _axis_motion(frame: Any, k: int) -> tuple[Vector, Vector, Vector]:
    """An axis of a frame, its rate, and its second derivative at constant joint rates."""
    u, w = vector(frame.axes[k]), vector(frame.w)
    rate = cross(w, u)
    return u, rate, plus(cross(vector(frame.dw), u), cross(w, rate))


@exact
def _row(row: Any, a: Any, b: Any, links: Any, on_a: int, on_b: int, jacobian: Array) -> tuple[float, float]:
    """One row of a closure: its Jacobian, and its error and drift."""
    u, du, ddu = _axis_motion(b, row.axis_b)
    if row.across:
        y, dy, ddy = _axis_motion(a, row.axis_a)
        by_a, by_b = cross(y, u), cross(u, y)
        pull = push = (0.0, 0.0, 0.0)
    else:
        x, origin = vector(a.place), vector(b.place)
        y, dy, ddy = minus(x, origin), minus(vector(a.v), vector(b.v)), minus(vector(a.dv), vector(b.dv))
        # A unit rate of a joint moves x_a with v + w x x_a, x_b likewise, and rotates u.
        by_a, by_b, pull, push = cross(x, u), minus(cross(u, y), cross(origin, u)), u, times(-1.0, u)
    for j in range(len(jacobian)):
        w, v = vector(links[j].turn), vector(links[j].slide)
        jacobian[j] = 0.0
        if j <= on_a:
            jacobian[j] += dot(by_a, w) + dot(pull, v)
        if j <= on_b:
            jacobian[j] += dot(by_b, w) + dot(push, v)
    return dot(u, y), dot(ddu, y) + 2.0 * dot(du, dy) + dot(u, ddy)
