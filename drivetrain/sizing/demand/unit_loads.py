"""Load of each joint per unit of each load parameter of each drive of an open chain, compiled, in the base frame.

The load parameters of a drive are its mass, its inertia across and along its axis, the inertia J of its rotor, and
J times the ratio. The drive is a body on the link that carries it, the carrier, which turns with w and dw/dt. Per unit
of mass at the place p, the carrier must exert the force ``a - g`` on it, with a the acceleration at p; per unit of an
inertia I the moment ``I dw + w x I w``. A rotor that turns ``ratio`` times as far as its shaft (angle s), about the
axis z, needs the moment ``z s'' + (w x z) s'`` in addition per unit of J times ratio.

All wrenches are taken about the origin of the base, so that one wrench of a drive serves every joint before it: the
torque of a joint is the scalar product with the joint's screw axis. (The wrenches through the joints themselves are
computed in ``drive_wrenches.py``.) The samples are processed in blocks laid out for
vector instructions, as in ``dynamics/core/recursion.py``.

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

# Load parameters of a drive: mass, inertia across and along its axis, rotor inertia, rotor inertia times ratio. The
# mass causes a wrench; the four others cause a pure moment, which is the same about every point.
PARAMETERS = 5
MOMENTS = PARAMETERS - 1


def _block_rows(**counts: int) -> np.dtype:
    """A record of fields, each with so many rows of BLOCK samples."""
    return np.dtype([(name, np.float64, (count, BLOCK)) for name, count in counts.items()])


# A link: rotation (row by row) and displacement since the joints were at zero, its twist (w, v) and the rate of that
# (dw, dv), and the screw axis of its joint.
LINK_ROWS = _block_rows(rotation=9, place=3, w=3, v=3, dw=3, dv=3, screw=6)
# A drive: place of its centre of mass [m] and axis; wrench per unit of mass, moments per unit of the other parameters.
DRIVE_ROWS = _block_rows(place=3, axis=3, mass_wrench=6, moments=3 * MOMENTS)
# A drive's influence on a joint: twist of the carrier per unit speed of the joint's shaft; torque and inertia of the
# joint per unit of each load parameter.
INFLUENCE_ROWS = _block_rows(twist=6, torque=PARAMETERS, inertia=PARAMETERS)
# A drive that loads a joint: both indices, and the first of the PARAMETERS rows that it fills in ``UnitLoadRows``.
INFLUENCE = np.dtype([(name, np.int64) for name in ("joint", "drive", "row")])


class MountedDrives(NamedTuple):
    """Mounting of the drives of n joints, all joints at zero, base frame."""

    carrier: Any  # index of the link that carries each, -1 for the base, (n,)
    place: Array  # centre of mass [m], (n, 3)
    axis: Array  # direction, (n, 3)
    has_body: Any  # whether mass and inertia of the whole drive count, or only those of the rotor, (n,)


class UnitLoadRows(NamedTuple):
    """Loads per unit of R load parameters, over N samples."""

    torque: Array  # torque of the joint, (R, N)
    inertia: Array  # inertia that the joint's shaft accelerates, (R, N) or (R, 0)


@kernel
def compute_unit_loads(
    screws: Array, gravity: Array, drives: MountedDrives, turns: Array, influences: Any, q: Array, qd: Array,
    qdd: Array, shaft_speed: Array, shaft_acceleration: Array, out: UnitLoadRows,
) -> None:  # fmt: skip
    """Compute the loads of all joints per unit of each load parameter, from the motion of the joints and of the shafts
    behind their gears, (N, n) each.

    ``screws`` are the axes of the joints in the base frame with all joints at zero, (n, 6); ``turns``, (n, n), has a
    row for each shaft, with the turn of each joint per turn of it.
    """
    n, samples = len(screws), len(q)
    state, links = np.zeros(n + 1, LINK), np.zeros(n, LINK_ROWS)
    loads, buffer = np.zeros(n, DRIVE_ROWS), np.zeros(1, INFLUENCE_ROWS)
    for first in range(0, samples, BLOCK):
        count = min(BLOCK, samples - first)
        part = slice(first, first + count)
        for t in range(count):
            move_links(screws, q[first + t], qd[first + t], state)
            _store_motion(state, qdd[first + t], links, t)
        for k in range(n):
            if drives.carrier[k] >= 0:
                speed, acceleration = shaft_speed[part, k], shaft_acceleration[part, k]
                _drive_wrenches(drives, k, gravity, links[drives.carrier[k]], speed, acceleration, loads[k])
        for i in range(len(influences)):
            influence, own = influences[i], buffer[0]
            joint, drive, first_row = influence.joint, influence.drive, influence.row
            carrier, rows = drives.carrier[drive], slice(first_row, first_row + PARAMETERS)
            _twist_per_turn(turns[joint, : carrier + 1], links, own.twist)
            _torques_and_inertias(loads[drive], drives.has_body[drive], own)
            _copy_rows(own.torque, out.torque[rows, part])
            if out.inertia.shape[1] > 0:
                _copy_rows(own.inertia, out.inertia[rows, part])


@exact
def _vector_at(a: Array, first: Any, t: Any) -> Vector:
    """Three rows of a block at one sample, as a vector."""
    return a[first, t], a[first + 1, t], a[first + 2, t]


@exact
def _put_vector_at(o: Array, first: Any, t: Any, a: Vector) -> None:
    """Put a vector into three rows of a block at one sample."""
    o[first, t], o[first + 1, t], o[first + 2, t] = a


@exact
def _rotated(link: Any, t: Any, a: Vector) -> Vector:
    """A vector that is fixed to a link, given with all joints at zero, at one sample."""
    rotation = link.rotation
    return dot(_vector_at(rotation, 0, t), a), dot(_vector_at(rotation, 3, t), a), dot(_vector_at(rotation, 6, t), a)


@exact
def _store_motion(state: Any, qdd: Array, links: Any, t: int) -> None:
    """Store the motion of all links at one sample of a block; the accelerations of the joints are added here."""
    angular, linear = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(len(links)):
        link, rows = state[i], links[i]
        turn, slide = vector(link.turn), vector(link.slide)
        angular, linear = plus(angular, times(qdd[i], turn)), plus(linear, times(qdd[i], slide))
        for k in range(3):
            _put_vector_at(rows.rotation, 3 * k, t, vector(link.rotation[k]))
        _put_vector_at(rows.place, 0, t, vector(link.place))
        _put_vector_at(rows.w, 0, t, vector(link.w))
        _put_vector_at(rows.v, 0, t, vector(link.v))
        _put_vector_at(rows.dw, 0, t, plus(vector(link.dw), angular))
        _put_vector_at(rows.dv, 0, t, plus(vector(link.dv), linear))
        _put_vector_at(rows.screw, 0, t, turn)
        _put_vector_at(rows.screw, 3, t, slide)


@exact
def _drive_wrenches(
    drives: Any, k: Any, gravity: Any, carrier: Any, shaft_speed: Any, shaft_acceleration: Any, out: Any
) -> None:
    """Wrenches that a drive requires of its carrier per unit of each load parameter, about the base's origin."""
    place, axis, weight = vector(drives.place[k]), vector(drives.axis[k]), vector(gravity)
    for t in range(len(shaft_speed)):
        w, dw = _vector_at(carrier.w, 0, t), _vector_at(carrier.dw, 0, t)
        p = plus(_rotated(carrier, t, place), _vector_at(carrier.place, 0, t))
        z = _rotated(carrier, t, axis)
        _put_vector_at(out.place, 0, t, p)
        _put_vector_at(out.axis, 0, t, z)
        axis_rate = cross(w, z)
        # The inertia is z z^T along the axis and 1 - z z^T across it; for the unit matrix, w x w vanishes.
        along = plus(times(dot(z, dw), z), times(dot(z, w), axis_rate))
        if drives.has_body[k]:
            v, dv = _vector_at(carrier.v, 0, t), _vector_at(carrier.dv, 0, t)
            force = minus(plus(plus(dv, cross(dw, p)), cross(w, plus(v, cross(w, p)))), weight)
            _put_vector_at(out.mass_wrench, 0, t, cross(p, force))
            _put_vector_at(out.mass_wrench, 3, t, force)
            _put_vector_at(out.moments, 0, t, minus(dw, along))
            _put_vector_at(out.moments, 3, t, along)
        _put_vector_at(out.moments, 6, t, along)
        _put_vector_at(out.moments, 9, t, plus(times(shaft_acceleration[t], z), times(shaft_speed[t], axis_rate)))


@exact
def _twist_per_turn(turns: Array, links: Any, twist: Array) -> None:
    """Twist of the last of some links per unit speed of a shaft; ``turns``: turn of each joint per turn of it."""
    for r in range(6):
        for t in range(BLOCK):
            twist[r, t] = 0.0
    for j in range(len(turns)):
        factor, screw = turns[j], links[j].screw
        for r in range(6 if factor != 0.0 else 0):
            for t in range(BLOCK):
                twist[r, t] += factor * screw[r, t]


@exact
def _torques_and_inertias(drive: Any, has_body: Any, out: Any) -> None:
    """Torque of a shaft and the inertia that it accelerates, per unit of each load parameter of a drive."""
    twist, inertia, wrench, moments = out.twist, out.inertia, drive.mass_wrench, drive.moments
    for t in range(BLOCK):
        w, v = _vector_at(twist, 0, t), _vector_at(twist, 3, t)
        out.torque[0, t] = dot(w, _vector_at(wrench, 0, t)) + dot(v, _vector_at(wrench, 3, t))
    for j in range(MOMENTS):
        for t in range(BLOCK):
            out.torque[1 + j, t] = dot(_vector_at(twist, 0, t), _vector_at(moments, 3 * j, t))
    for t in range(BLOCK):
        w, v = _vector_at(twist, 0, t), _vector_at(twist, 3, t)
        speed, along = plus(cross(w, _vector_at(drive.place, 0, t)), v), dot(w, _vector_at(drive.axis, 0, t)) ** 2
        inertia[3, t] = along
        if has_body:
            inertia[0, t], inertia[1, t], inertia[2, t] = dot(speed, speed), dot(w, w) - along, along


@exact
def _copy_rows(rows: Array, out: Array) -> None:
    """Copy rows of a block into rows of all samples, up to their length."""
    for r in range(len(out)):
        for t in range(out.shape[1]):
            out[r, t] = rows[r, t]
