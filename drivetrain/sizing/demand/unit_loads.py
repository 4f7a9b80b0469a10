"""What a unit of each number of each drive adds to the load of each joint: one pass over the motion, in the base frame.

A body rides on the link that carries a drive. At its place p the force for a unit of mass is ``a - g``; the moment for
an inertia I is ``I dw + w x I w``; a rotor that turns ``ratio`` times as far as its shaft asks ``z s'' + (w x z) s'``
more for each unit of inertia times ratio. Moments about the base's origin then serve every joint before.

Reference: Modern Robotics, equations 8.103 to 8.110; velocities and accelerations are twists about the base's origin.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.jit import kernel, law

NUMBERS = 5  # of a drive: mass, inertia across, along, of the rotor, of the rotor times ratio


class Riders(NamedTuple):
    """Where the drives of n joints ride, all joints at zero, base frame.

    Attributes:
        carrier: Index of the link that holds each, -1 for the base, (n,).
        place: Centre of mass [m], (n, 3).
        axis: Direction, (n, 3).
        weighs: Whether its body counts, not its rotor alone, (n,).
    """

    carrier: Any
    place: Array
    axis: Array
    weighs: Any


class Along(NamedTuple):
    """What rows of unit loads are made of, over N samples, base frame, moments about its origin.

    Attributes:
        lines: Screw axes of the joints, (n, 6, N).
        frames: Axes of each joint's own frame, then its origin [m], (n, 12, N).
        wrenches: For a unit of each number of each drive, moment and force, (n, NUMBERS, 6, N).
        bodies: Place [m] and axis of each drive, (n, 6, N).
    """

    lines: Array
    frames: Array
    wrenches: Array
    bodies: Array


@law
def cross(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any) -> Any:
    """The cross product."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@law
def turned(r: Any, x: Any, y: Any, z: Any) -> Any:
    """A vector after a rotation, (3, 3)."""
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
    )


@law
def move(r: Any, p: Any, screw: Any, angle: Any) -> None:
    """Move a frame (r, p) on by a screw given in it; Modern Robotics, equation 3.88."""
    wx, wy, wz = screw[0], screw[1], screw[2]
    slides = wx == 0.0 and wy == 0.0 and wz == 0.0
    s, c = (0.0, 0.0) if slides else (np.sin(angle), 1.0 - np.cos(angle))
    ux, uy, uz = cross(wx, wy, wz, screw[3], screw[4], screw[5])
    tx, ty, tz = cross(wx, wy, wz, ux, uy, uz)
    rest = angle - s
    tx, ty, tz = turned(
        r,
        screw[3] * angle + c * ux + rest * tx,
        screw[4] * angle + c * uy + rest * ty,
        screw[5] * angle + c * uz + rest * tz,
    )
    p[0] += tx
    p[1] += ty
    p[2] += tz
    for i in range(3):
        a, b, e = r[i, 0], r[i, 1], r[i, 2]
        x, y, z = cross(a, b, e, wx, wy, wz)
        u, v, w = cross(x, y, z, wx, wy, wz)
        r[i, 0], r[i, 1], r[i, 2] = a + s * x + c * u, b + s * y + c * v, e + s * z + c * w


@kernel
def go_along(
    screws: Array, frames: Array, gravity: Array, riders: Riders, q: Array, qd: Array, qdd: Array, shaft: Array,
    shaft_rate: Array, out: Along,
) -> None:  # fmt: skip
    """Fill what rows are made of.

    Args:
        screws, frames: Of the joints, base frame, all at zero, (n, 6), (n, 3, 4).
        gravity: [m/s^2], (3,).
        riders: The drives.
        q, qd, qdd: Positions, speeds and accelerations of the joints, (N, n).
        shaft, shaft_rate: Speeds and accelerations of the shafts behind the gears, (N, n).
        out: All zero; is filled, but for drives on the base, which load no joint.
    """
    n, r, p, v, a = len(screws), np.empty((3, 3)), np.empty(3), np.empty(6), np.empty(6)
    for t in range(len(q)):
        r[:], p[:], v[:], a[:] = 0.0, 0.0, 0.0, 0.0
        r[0, 0] = r[1, 1] = r[2, 2] = 1.0
        for i in range(n):
            screw, line = screws[i], out.lines[i, :, t]
            line[0], line[1], line[2] = turned(r, screw[0], screw[1], screw[2])
            x, y, z = turned(r, screw[3], screw[4], screw[5])
            ex, ey, ez = cross(p[0], p[1], p[2], line[0], line[1], line[2])
            line[3], line[4], line[5] = x + ex, y + ey, z + ez
            rate, more = qd[t, i], qdd[t, i]
            x, y, z = cross(v[0], v[1], v[2], line[0], line[1], line[2])
            a[0], a[1], a[2] = a[0] + x * rate, a[1] + y * rate, a[2] + z * rate
            x, y, z = cross(v[0], v[1], v[2], line[3], line[4], line[5])
            ex, ey, ez = cross(v[3], v[4], v[5], line[0], line[1], line[2])
            a[3], a[4], a[5] = a[3] + (x + ex) * rate, a[4] + (y + ey) * rate, a[5] + (z + ez) * rate
            for k in range(6):
                v[k] += line[k] * rate
                a[k] += line[k] * more
            move(r, p, screw, q[t, i])
            for k in range(4):
                x, y, z = turned(r, frames[i, 0, k], frames[i, 1, k], frames[i, 2, k])
                e = 1.0 if k == 3 else 0.0
                out.frames[i, 3 * k, t], out.frames[i, 3 * k + 1, t] = x + e * p[0], y + e * p[1]
                out.frames[i, 3 * k + 2, t] = z + e * p[2]
            for k in range(n):
                if riders.carrier[k] == i:
                    ride(riders, k, gravity, r, p, v, a, shaft[t, k], shaft_rate[t, k], out, t)


@law
def ride(
    riders: Any, k: Any, gravity: Any, r: Any, p: Any, v: Any, a: Any, rate: Any, more: Any, out: Any, t: Any
) -> None:  # fmt: skip
    """What a unit of each number of drive k asks of the link that carries it, of which pose and motion are given."""
    body, place, axis = out.bodies[k, :, t], riders.place[k], riders.axis[k]
    x, y, z = turned(r, place[0], place[1], place[2])
    x, y, z = x + p[0], y + p[1], z + p[2]
    zx, zy, zz = turned(r, axis[0], axis[1], axis[2])
    body[0], body[1], body[2], body[3], body[4], body[5] = x, y, z, zx, zy, zz
    gx, gy, gz = cross(v[0], v[1], v[2], zx, zy, zz)
    spin, speed = zx * a[0] + zy * a[1] + zz * a[2], zx * v[0] + zy * v[1] + zz * v[2]
    mx, my, mz = zx * spin + gx * speed, zy * spin + gy * speed, zz * spin + gz * speed  # about the axis
    found = out.wrenches[k, :, :, t]
    if riders.weighs[k]:
        ux, uy, uz = cross(v[0], v[1], v[2], x, y, z)
        ux, uy, uz = cross(v[0], v[1], v[2], v[3] + ux, v[4] + uy, v[5] + uz)
        fx, fy, fz = cross(a[0], a[1], a[2], x, y, z)
        fx, fy, fz = a[3] + fx + ux - gravity[0], a[4] + fy + uy - gravity[1], a[5] + fz + uz - gravity[2]
        found[0, 3], found[0, 4], found[0, 5] = fx, fy, fz
        found[0, 0], found[0, 1], found[0, 2] = cross(x, y, z, fx, fy, fz)
        found[1, 0], found[1, 1], found[1, 2] = a[0] - mx, a[1] - my, a[2] - mz  # w x w is none
        found[2, 0], found[2, 1], found[2, 2] = mx, my, mz
    found[3, 0], found[3, 1], found[3, 2] = mx, my, mz
    found[4, 0], found[4, 1], found[4, 2] = zx * more + gx * rate, zy * more + gy * rate, zz * more + gz * rate


@kernel
def fill_rows(
    along: Along, riders: Riders, joint: int, drive: int, turns: Array, first: int, force: Array, wrench: Array,
    inertia: Array,
) -> None:  # fmt: skip
    """What the units of one drive add to one joint, or where motors are coupled to its shaft.

    Args:
        along, riders: Of the motion.
        joint, drive: Indices.
        turns: Of each joint, a turn of the shaft, (n,).
        first: Sample with which ``along`` begins.
        force: Takes torque or force, (NUMBERS, N).
        wrench: Takes moment and force through the joint in its own frame, (NUMBERS, N, 6) or (NUMBERS, 0, 6).
        inertia: Takes what the shaft turns, (NUMBERS, N) or (NUMBERS, 0).
    """
    carrier, body, e, v = riders.carrier[drive], along.bodies[drive], along.frames[joint], np.empty(6)
    for t in range(along.lines.shape[2]):
        v[:] = 0.0  # twist of the carrier, a turn of the shaft
        for j in range(carrier + 1):
            if turns[j] != 0.0:
                for k in range(6):
                    v[k] += turns[j] * along.lines[j, k, t]
        for number in range(len(force)):
            m = along.wrenches[drive, number]
            force[number, first + t] = v[0] * m[0, t] + v[1] * m[1, t] + v[2] * m[2, t]
            force[number, first + t] += v[3] * m[3, t] + v[4] * m[4, t] + v[5] * m[5, t]
        if inertia.shape[1] > 0:
            x, y, z = cross(v[0], v[1], v[2], body[0, t], body[1, t], body[2, t])
            x, y, z = x + v[3], y + v[4], z + v[5]
            about = (v[0] * body[3, t] + v[1] * body[4, t] + v[2] * body[5, t]) ** 2
            inertia[3, first + t] = about
            if riders.weighs[drive]:
                inertia[0, first + t], inertia[2, first + t] = x * x + y * y + z * z, about
                inertia[1, first + t] = v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - about
    for number in range(len(wrench) if wrench.shape[1] > 0 and carrier >= joint else 0):
        m = along.wrenches[drive, number]
        for t in range(along.lines.shape[2]):
            fx, fy, fz = m[3, t], m[4, t], m[5, t]
            x, y, z = cross(e[9, t], e[10, t], e[11, t], fx, fy, fz)
            x, y, z = m[0, t] - x, m[1, t] - y, m[2, t] - z
            for i in range(3):
                wrench[number, first + t, i] = e[3 * i, t] * x + e[3 * i + 1, t] * y + e[3 * i + 2, t] * z
                wrench[number, first + t, 3 + i] = e[3 * i, t] * fx + e[3 * i + 1, t] * fy + e[3 * i + 2, t] * fz
