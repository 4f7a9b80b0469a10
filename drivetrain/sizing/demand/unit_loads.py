"""What a unit of each number of each drive adds to the load of each joint: one pass over the motion, in the base frame.

A body rides on the link that carries a drive. At its place p the force for a unit of mass is ``a - g``; the moment for
an inertia I is ``I dw + w x I w``; a rotor that turns ``ratio`` times as far as its shaft asks ``z s'' + (w x z) s'``
more for each unit of inertia times ratio. Moments about the base's origin then serve every joint before. The pass goes
over blocks of samples laid out for vector instructions, as the recursion does (``dynamics/core/recursion.py``).

Reference: Modern Robotics, equations 8.103 to 8.110; velocities and accelerations are twists about the base's origin.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.blocks import BLOCK
from drivetrain.dynamics.core.frames import LINK, move_links
from drivetrain.dynamics.core.vectors import (
    Vector,
    cross,
    dot,
    exact,
    minus,
    plus,
    times,
    vector,
)
from drivetrain.jit import kernel

NUMBERS = 5  # of a drive: mass, inertia across, along, of the rotor, of the rotor times ratio


def _rows(**counts: int) -> np.dtype:
    """A record of rows of a block of samples."""
    return np.dtype([(name, np.float64, (count, BLOCK)) for name, count in counts.items()])


# A link: its displacement since the joints were at zero, its twist (w, v) and its acceleration, its joint's screw axis.
MOVED = _rows(rotation=9, place=3, w=3, v=3, dw=3, dv=3, line=6)
# A drive: place [m] and axis, and for a unit of each of its numbers moment and force.
RIDER = _rows(body=6, wrench=6 * NUMBERS)
# A drive at a joint: twist of its carrier for a unit turn of the shaft, what a unit of each number adds, one wrench.
ADDED = _rows(turn=6, force=NUMBERS, inertia=NUMBERS, wrench=6)
# Joint and drive, the first of the rows that they fill, whether those of wrenches too.
PAIR = np.dtype([(name, np.int64) for name in ("joint", "drive", "row", "on_bearing")])


class Riders(NamedTuple):
    """Where the drives of n joints ride, all joints at zero, base frame."""

    carrier: Any  # index of the link that holds each, -1 for the base, (n,)
    place: Array  # centre of mass [m], (n, 3)
    axis: Array  # direction, (n, 3)
    weighs: Any  # whether its body counts, not its rotor alone, (n,)


class Rows(NamedTuple):
    """What units add, a row a number of a drive at a joint, over N samples; what has no samples is not computed."""

    force: Array  # torque or force, (R, N)
    wrench: Array  # moment and force through the joint in its own frame, (R, 6, N) or (R, 6, 0)
    inertia: Array  # what the shaft turns, (R, N) or (R, 0)


@kernel
def fill_rows(
    screws: Array, frames: Array, gravity: Array, riders: Riders, turns: Array, pairs: Any, q: Array, qd: Array,
    qdd: Array, shaft: Array, shaft_rate: Array, out: Rows,
) -> None:  # fmt: skip
    """Fill rows.

    Args:
        screws, frames: Of the joints, base frame, all at zero, (n, 6), (n, 3, 4).
        gravity: [m/s^2], (3,).
        riders: The drives.
        turns: Of each joint, a turn of each shaft, (n, n), a row a shaft.
        pairs: Drives at joints, records PAIR.
        q, qd, qdd: Positions, speeds and accelerations of the joints, (N, n).
        shaft, shaft_rate: Speeds and accelerations of the shafts behind the gears, (N, n).
        out: All zero; is filled.
    """
    n, samples = len(screws), len(q)
    links, moved, drives, added = np.zeros(n + 1, LINK), np.zeros(n, MOVED), np.zeros(n, RIDER), np.zeros(1, ADDED)
    for first in range(0, samples, BLOCK):
        count = min(BLOCK, samples - first)
        part = slice(first, first + count)
        for t in range(count):
            move_links(screws, q[first + t], qd[first + t], links)
            _take(links, qdd[first + t], moved, t)
        for k in range(n):
            if riders.carrier[k] >= 0:
                _ride(riders, k, gravity, moved[riders.carrier[k]], shaft[part, k], shaft_rate[part, k], drives[k])
        for p in range(len(pairs)):
            pair, own = pairs[p], added[0]
            joint, drive, carrier = pair.joint, pair.drive, riders.carrier[pair.drive]
            _turn(turns[joint, : carrier + 1], moved, own)
            _push(drives[drive], riders.weighs[drive], own)
            rows = slice(pair.row, pair.row + NUMBERS)
            _copy(own.force, out.force[rows, part])
            if out.inertia.shape[1] > 0:
                _copy(own.inertia, out.inertia[rows, part])
            if out.wrench.shape[2] > 0 and pair.on_bearing and carrier >= joint:
                for number in range(NUMBERS):
                    wrench = drives[drive].wrench[6 * number : 6 * number + 6]
                    _pass_on(moved[joint], frames[joint], wrench, own.wrench)
                    _copy(own.wrench, out.wrench[pair.row + number, :, part])


@exact
def _lane(a: Array, first: Any, t: Any) -> Vector:
    """Three rows of a block at one sample."""
    return a[first, t], a[first + 1, t], a[first + 2, t]


@exact
def _put(o: Array, first: Any, t: Any, a: Vector) -> None:
    """Put a vector into three rows of a block at one sample."""
    o[first, t], o[first + 1, t], o[first + 2, t] = a


@exact
def _turned(link: Any, t: Any, a: Vector) -> Vector:
    """A vector turned as a link is."""
    rotation = link.rotation
    return dot(_lane(rotation, 0, t), a), dot(_lane(rotation, 3, t), a), dot(_lane(rotation, 6, t), a)


@exact
def _take(links: Any, qdd: Array, moved: Any, t: int) -> None:
    """Keep the motion of all links at one sample of a block, accelerations of the joints in it."""
    angular, straight = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(len(moved)):
        link, own = links[i], moved[i]
        turn, slide = vector(link.turn), vector(link.slide)
        angular, straight = plus(angular, times(qdd[i], turn)), plus(straight, times(qdd[i], slide))
        for k in range(3):
            _put(own.rotation, 3 * k, t, vector(link.rotation[k]))
        _put(own.place, 0, t, vector(link.place))
        _put(own.w, 0, t, vector(link.w))
        _put(own.v, 0, t, vector(link.v))
        _put(own.dw, 0, t, plus(vector(link.dw), angular))
        _put(own.dv, 0, t, plus(vector(link.dv), straight))
        _put(own.line, 0, t, turn)
        _put(own.line, 3, t, slide)


@exact
def _ride(riders: Any, k: Any, gravity: Any, link: Any, rates: Any, more: Any, out: Any) -> None:
    """What a unit of each number of drive k asks of the link that carries it."""
    at, along, weight, weighs = vector(riders.place[k]), vector(riders.axis[k]), vector(gravity), riders.weighs[k]
    for t in range(len(rates)):
        w, dw = _lane(link.w, 0, t), _lane(link.dw, 0, t)
        x, z = plus(_turned(link, t, at), _lane(link.place, 0, t)), _turned(link, t, along)
        _put(out.body, 0, t, x)
        _put(out.body, 3, t, z)
        tilt = cross(w, z)
        about = plus(times(dot(z, dw), z), times(dot(z, w), tilt))  # of an inertia about the axis; w x w is none
        if weighs:
            v, dv = _lane(link.v, 0, t), _lane(link.dv, 0, t)
            force = minus(plus(plus(dv, cross(dw, x)), cross(w, plus(v, cross(w, x)))), weight)
            _put(out.wrench, 0, t, cross(x, force))
            _put(out.wrench, 3, t, force)
            _put(out.wrench, 6, t, minus(dw, about))
            _put(out.wrench, 12, t, about)
        _put(out.wrench, 18, t, about)
        _put(out.wrench, 24, t, plus(times(more[t], z), times(rates[t], tilt)))


@exact
def _turn(turns: Array, moved: Any, out: Any) -> None:
    """The twist of the last of some links for a unit turn of a shaft, which turns each of their joints so far."""
    twist = out.turn
    for r in range(6):
        for t in range(BLOCK):
            twist[r, t] = 0.0
    for j in range(len(turns)):
        factor, line = turns[j], moved[j].line
        for r in range(6 if factor != 0.0 else 0):
            for t in range(BLOCK):
                twist[r, t] += factor * line[r, t]


@exact
def _push(drive: Any, weighs: Any, out: Any) -> None:
    """What units of a drive ask of a shaft, and the inertia that it turns."""
    twist, body, inertia = out.turn, drive.body, out.inertia
    for number in range(NUMBERS):
        for t in range(BLOCK):
            moment, force = _lane(drive.wrench, 6 * number, t), _lane(drive.wrench, 6 * number + 3, t)
            out.force[number, t] = dot(_lane(twist, 0, t), moment) + dot(_lane(twist, 3, t), force)
    for t in range(BLOCK):
        w, v = _lane(twist, 0, t), _lane(twist, 3, t)
        moved, about = plus(cross(w, _lane(body, 0, t)), v), dot(w, _lane(body, 3, t)) ** 2
        inertia[3, t] = about
        if weighs:
            inertia[0, t], inertia[1, t], inertia[2, t] = dot(moved, moved), dot(w, w) - about, about


@exact
def _pass_on(link: Any, frame: Array, wrench: Array, out: Array) -> None:
    """A wrench of a drive through a joint before it, in that joint's own frame."""
    x, y, z, at = vector(frame[:, 0]), vector(frame[:, 1]), vector(frame[:, 2]), vector(frame[:, 3])
    for t in range(BLOCK):
        a, b, c = _turned(link, t, x), _turned(link, t, y), _turned(link, t, z)
        push = _lane(wrench, 3, t)
        moment = minus(_lane(wrench, 0, t), cross(plus(_turned(link, t, at), _lane(link.place, 0, t)), push))
        _put(out, 0, t, (dot(a, moment), dot(b, moment), dot(c, moment)))
        _put(out, 3, t, (dot(a, push), dot(b, push), dot(c, push)))


@exact
def _copy(rows: Array, out: Array) -> None:
    """Rows of a block into rows that are as long as there are samples."""
    for r in range(len(out)):
        for t in range(out.shape[1]):
            out[r, t] = rows[r, t]
