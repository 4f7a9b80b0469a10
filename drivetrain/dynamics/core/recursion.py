"""The compiled Newton-Euler recursion: outwards (motion, wrench) and inwards (torque), over blocks of 64 samples.

Frames: link i has its origin on joint axis i and z along it. The axes of consecutive frames are chosen
(``packed.py``) so that a revolute joint is a constant translation and ``Rx(alpha) Rz(q + offset)``, which rotates a
vector in eight operations without a matrix.
Bodies: with ``W = [dw] + [w][w]``, the matrix from the position of a point to its acceleration, and the second moments
of mass ``S = integral r r^T dm``, the force is ``m a + W h`` and the moment ``h x a + axial(W S)``.

Choices that make it fast, each measured: the sample loop is innermost and without branches, so that it becomes vector
instructions; the numbers of a block are a structure of arrays that fits the L1 cache.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.blocks import BLOCK, FAR, JOINT, JOINT_ALONE, block_types, fast, sincos, sum_of_squares
from drivetrain.dynamics.core.vectors import exact
from drivetrain.jit import kernel

# A link over a block of samples: angular velocity, its rate, acceleration of the origin minus gravity, then force and
# moment through its joint, and the angular acceleration of the previous link along the joint's axis.
LINKS, LINKS_ALONE = block_types(
    "wx", "wy", "wz", "dx", "dy", "dz", "ax", "ay", "az", "fx", "fy", "fz", "nx", "ny", "nz", "axial"
)


@kernel
def recursion(
    links: Any, rotors: Any, gravity: Array, q: Array, qd: Array, qdd: Array, tip: Array,
    torque: Array, gear: Array, axial: Array, wrench: Array,
) -> float:  # fmt: skip
    """Fill the torque, and other outputs that have rows; returns 0, or NaN if a number is NaN, infinite, or beyond
    1e154.

    Of ``tip`` there are 0, 1 or N wrenches on the environment in the last link's frame, (.., 6) [N m, N]. Outputs:
    ``torque``, and where they have rows ``gear`` (at the gears' outputs) [N m or N], ``axial``, the angular
    acceleration of the previous link along the joint's axis [rad/s^2], (N, n) each, and ``wrench`` through the joint,
    in the joint's own frame, (N, n, 6).
    """
    n, bad = q.shape[1], 0.0
    # The last record of each is for rotors; body 0 is the base.
    joints, bodies = np.empty(n + 1, JOINT), np.zeros(n + 2, LINKS)
    for k in range(BLOCK):
        bodies[0].ax[k], bodies[0].ay[k], bodies[0].az[k] = -gravity[0], -gravity[1], -gravity[2]
    for first in range(0, len(q), BLOCK):
        count = min(BLOCK, len(q) - first)
        size = read(joints, q, qd, qdd, first, count)
        bad += 0.0 * size
        outwards(links, rotors, joints, bodies, n, size)
        if len(tip):
            push(bodies[n], tip, first, count)
        back(links, joints, bodies, n)
        write(joints, first, count, torque)
        if len(gear):
            for i in range(n):
                take_gear(joints[i])
            write(joints, first, count, gear)
        if len(axial):
            for i in range(n):
                take_axial(joints[i], bodies[i + 1])
            write(joints, first, count, axial)
        if len(wrench):
            for i in range(n):
                take_wrench(links[i], joints[i], bodies[i + 1], wrench[first : first + count, i])
    return bad


@kernel
def torque_alone(arm: Any, q: Array, qd: Array, qdd: Array, tip: Array, torque: Array) -> float:
    """As ``recursion``, for the torque of one sample: ``arm`` is (links, rotors, gravity), other arrays are (n,)."""
    links, rotors, gravity = arm
    n, size = len(q), 0.0
    joints, bodies = np.empty(n + 1, JOINT_ALONE), np.zeros(n + 2, LINKS_ALONE)
    base: Any = bodies[0]
    base.ax[0], base.ay[0], base.az[0] = -gravity[0], -gravity[1], -gravity[2]
    for i in range(n):
        size += read_alone(joints[i], q[i], qd[i], qdd[i])
    outwards(links, rotors, joints, bodies, n, size)
    if len(tip):
        push(bodies[n], tip, np.int64(0), np.int64(1))
    back(links, joints, bodies, n)
    for i in range(n):
        torque[i] = joints[i].torque[0]
    return 0.0 * size


@exact
def outwards(links: Any, rotors: Any, joints: Any, bodies: Any, n: int, size: float) -> None:
    """Motion of all links and rotors, and the wrenches that move them; ``size`` is the result of ``read``."""
    r = 0  # the next rotor; those on the link before a revolute joint come first
    for i in range(n):
        link, joint, before, body = links[i], joints[i], bodies[i], bodies[i + 1]
        sincos(joint, link.turn, link.offset, size > FAR * FAR)
        if link.slide != 0.0 or link.turn != 1.0:
            screw(link, joint, before, body)
        elif i == 0:
            first_revolute(link, joint, before, body)
        elif r < len(rotors) and rotors[r].joint == i and rotors[r].carrier == i - 1 and rotors[r].balanced:
            revolute(link, links[n + r], joint, before, body)
            r += 1
        else:
            revolute(link, None, joint, before, body)
    for other in range(r, len(rotors)):
        link, joint, carrier = links[n + other], joints[rotors[other].joint], bodies[rotors[other].carrier + 1]
        if rotors[other].balanced:
            couple(link, joint, carrier)
        else:
            spin(link, joint, joints[n], carrier, bodies[n + 1], size)


@exact
def back(links: Any, joints: Any, bodies: Any, n: int, first: int = 0) -> None:
    """Torques of the joints from ``first`` on; ``joint.rotor`` is the part due to rotors."""
    for i in range(n - 1, first - 1, -1):
        link, joint, before, body = links[i], joints[i], bodies[i], bodies[i + 1]
        if link.slide != 0.0 or link.turn != 1.0:
            screw_back(link, joint, before, body)
        elif i == 0:
            first_revolute_back(joint, body)
        else:
            revolute_back(link, joint, before, body)


@exact
def read(joints: Any, q: Array, qd: Array, qdd: Array, first: int, count: int) -> float:
    """Copy samples to the joints' rows, the rest of the rows zero; returns the sum of all squares."""
    n, size = q.shape[1], 0.0
    # A constant number of joints lets the compiler unroll: three times faster for the most common arm.
    if n == 6 and count == BLOCK:
        transpose(joints, q, qd, qdd, first, BLOCK, 6)
    else:
        for i in range(n):
            for k in range(count, len(joints[i].q)):
                joints[i].q[k] = joints[i].qd[k] = joints[i].qdd[k] = 0.0
        transpose(joints, q, qd, qdd, first, count, n)
    for i in range(n):
        size += sum_of_squares(joints[i])
    return size


@exact
def read_alone(joint: Any, q: float, qd: float, qdd: float) -> float:
    """As ``read``, for one joint of one sample."""
    joint.q[0], joint.qd[0], joint.qdd[0] = q, qd, qdd
    return sum_of_squares(joint)


@exact
def transpose(joints: Any, q: Array, qd: Array, qdd: Array, first: int, count: int, n: int) -> None:
    """Copy samples to the joints' rows."""
    for k in range(count):
        for i in range(n):
            joints[i].q[k] = q[first + k, i]
    for k in range(count):
        for i in range(n):
            joints[i].qd[k] = qd[first + k, i]
    for k in range(count):
        for i in range(n):
            joints[i].qdd[k] = qdd[first + k, i]


@exact
def write(joints: Any, first: int, count: int, out: Array) -> None:
    """Copy the joints' torques to rows of an array."""
    if out.shape[1] == 6 and count == BLOCK:
        for k in range(BLOCK):
            for i in range(6):
                out[first + k, i] = joints[i].torque[k]
    else:
        for k in range(count):
            for i in range(out.shape[1]):
                out[first + k, i] = joints[i].torque[k]


@fast
def moments(link: Any) -> tuple[float, ...]:
    """The ten numbers of a body as a tuple, read once before a loop."""
    return (
        link.mass, link.hx, link.hy, link.hz, link.sxx, link.syy, link.szz, link.sxy, link.sxz, link.syz,
    )  # fmt: skip


@fast
def keep(
    body: Any, k: int, own: tuple[float, ...], wx: float, wy: float, wz: float, dx: float, dy: float, dz: float,
    ax: float, ay: float, az: float, cx: float, cy: float,
) -> None:  # fmt: skip
    """Write the motion of one sample, the wrench for it, and a couple perpendicular to the axis, to a record."""
    m, hx, hy, hz, sxx, syy, szz, sxy, sxz, syz = own
    body.wx[k], body.wy[k], body.wz[k] = wx, wy, wz
    body.dx[k], body.dy[k], body.dz[k] = dx, dy, dz
    body.ax[k], body.ay[k], body.az[k] = ax, ay, az
    xx, yy, zz = wx * wx, wy * wy, wz * wz
    xy, yx = wx * wy - dz, wx * wy + dz
    xz, zx = wx * wz + dy, wx * wz - dy
    yz, zy = wy * wz - dx, wy * wz + dx
    body.fx[k] = m * ax - (yy + zz) * hx + xy * hy + xz * hz
    body.fy[k] = m * ay + yx * hx - (xx + zz) * hy + yz * hz
    body.fz[k] = m * az + zx * hx + zy * hy - (xx + yy) * hz
    body.nx[k] = zx * sxy + zy * syy - yx * sxz - yz * szz + (zz - yy) * syz + hy * az - hz * ay + cx
    body.ny[k] = xy * syz + xz * szz - zx * sxx - zy * sxy + (xx - zz) * sxz + hz * ax - hx * az + cy
    body.nz[k] = yx * sxx + yz * sxz - xy * syy - xz * syz + (yy - xx) * sxy + hx * ay - hy * ax


@fast
def first_revolute(link: Any, joint: Any, base: Any, body: Any) -> None:
    """Motion and own wrench of link 0, on a base at rest whose frame is that of link 0 with the joint at zero."""
    m, hx, hy, hz, sxx, syy, _, _, sxz, syz = moments(link)
    own, gx, gy, gz = link.rotor_inertia, base.ax[0], base.ay[0], base.az[0]
    for k in range(len(joint.q)):
        c, s, v, vd = joint.cos[k], joint.sin[k], joint.qd[k], joint.qdd[k]
        ax = c * gx + s * gy
        ay = c * gy - s * gx
        vv = v * v
        body.wx[k] = body.wy[k] = body.dx[k] = body.dy[k] = 0.0
        body.wz[k], body.dz[k] = v, vd
        body.ax[k], body.ay[k], body.az[k] = ax, ay, gz
        body.fx[k] = m * ax - vd * hy - vv * hx
        body.fy[k] = m * ay + vd * hx - vv * hy
        body.fz[k] = m * gz
        body.nx[k] = vv * syz - vd * sxz + hy * gz - hz * ay
        body.ny[k] = hz * ax - hx * gz - vd * syz - vv * sxz
        body.nz[k] = vd * (sxx + syy) + hx * ay - hy * ax
        body.axial[k] = 0.0
        joint.rotor[k] = own * vd


@fast
def carried(link: Any, body: Any) -> None:
    """The wrench that moves the body of a link whose motion is known."""
    own = moments(link)
    for k in range(len(body.wx)):
        keep(
            body, k, own, body.wx[k], body.wy[k], body.wz[k], body.dx[k], body.dy[k], body.dz[k],
            body.ax[k], body.ay[k], body.az[k], 0.0, 0.0,
        )  # fmt: skip


@fast
def first_revolute_back(joint: Any, body: Any) -> None:
    """Torque of joint 0, without the wrench on the base."""
    for k in range(len(joint.q)):
        joint.torque[k] = body.nz[k] + joint.rotor[k]


@fast
def revolute(link: Any, rotor: Any, joint: Any, before: Any, body: Any) -> None:
    """Motion of a link from that of the previous link, and its own wrench.

    Also the couple of a balanced rotor on the previous link: along the joint's axis, or of any direction if ``rotor``,
    its record, is not None (compiled once for each).
    """
    ca, sa, px, py, pz = link.rzz, link.rzy, link.px, link.py, link.pz
    spin, inertia, own = link.spin, link.rotor_inertia, moments(link)
    for k in range(len(joint.q)):
        c, s, v, vd = joint.cos[k], joint.sin[k], joint.qd[k], joint.qdd[k]
        wx, wy, wz = before.wx[k], before.wy[k], before.wz[k]
        dx, dy, dz = before.dx[k], before.dy[k], before.dz[k]
        # Acceleration of the joint's origin, in the previous frame.
        ax = before.ax[k] - (wy * wy + wz * wz) * px + (wx * wy - dz) * py + (wx * wz + dy) * pz
        ay = before.ay[k] + (wx * wy + dz) * px - (wx * wx + wz * wz) * py + (wy * wz - dx) * pz
        az = before.az[k] + (wx * wz - dy) * px + (wy * wz + dx) * py - (wx * wx + wy * wy) * pz
        # Transformed to this link's frame, plus the joint's own rate.
        t = ca * wy + sa * wz
        ez = ca * wz - sa * wy + v
        ex = c * wx + s * t
        ey = c * t - s * wx
        t = ca * dy + sa * dz
        axial = ca * dz - sa * dy
        gyro_x = ey * v
        gyro_y = -ex * v
        gx = c * dx + s * t + gyro_x
        gy = c * t - s * dx + gyro_y
        t = ca * ay + sa * az
        bz = ca * az - sa * ay
        bx = c * ax + s * t
        by = c * t - s * ax
        if rotor is None:
            # A rotor on the axis exerts on the previous link, its carrier, the couple spin (v (w x z) + vd z). In this
            # frame it is spin (gyro_x, gyro_y, vd). It is added here except for vd, which must not enter this joint's
            # torque.
            cx, cy, torque = spin * gyro_x, spin * gyro_y, spin * axial
        else:
            cx, cy, torque = 0.0, 0.0, add_couple(rotor, v, vd, before, k)
        keep(body, k, own, ex, ey, ez, gx, gy, axial + vd, bx, by, bz, cx, cy)
        body.axial[k] = axial
        joint.rotor[k] = inertia * vd + torque


@fast
def revolute_back(link: Any, joint: Any, before: Any, body: Any) -> None:
    """Torque of a joint; adds the wrench through it to that of the previous link."""
    ca, sa, px, py, pz, spin = link.rzz, link.rzy, link.px, link.py, link.pz, link.spin
    for k in range(len(joint.q)):
        c, s, vd = joint.cos[k], joint.sin[k], joint.qdd[k]
        fx, fy, fz = body.fx[k], body.fy[k], body.fz[k]
        nx, ny, nz = body.nx[k], body.ny[k], body.nz[k]
        joint.torque[k] = nz + joint.rotor[k]
        nz += spin * vd
        gx = c * fx - s * fy
        t = s * fx + c * fy
        gy = ca * t - sa * fz
        gz = sa * t + ca * fz
        t = s * nx + c * ny
        before.fx[k] += gx
        before.fy[k] += gy
        before.fz[k] += gz
        before.nx[k] += c * nx - s * ny + py * gz - pz * gy
        before.ny[k] += ca * t - sa * nz + pz * gx - px * gz
        before.nz[k] += sa * t + ca * nz + px * gy - py * gx


@fast
def screw(link: Any, joint: Any, before: Any, body: Any) -> None:
    """As ``revolute``, for a body that rotates by ``turn * q`` about, and moves by ``slide * q`` along, its z axis."""
    px, py, pz, turn, slide, inertia = link.px, link.py, link.pz, link.turn, link.slide, link.rotor_inertia
    rxx, rxy, rxz, ryx, ryy, ryz = link.rxx, link.rxy, link.rxz, link.ryx, link.ryy, link.ryz
    rzx, rzy, rzz, own = link.rzx, link.rzy, link.rzz, moments(link)
    for k in range(len(joint.q)):
        c, s = joint.cos[k], joint.sin[k]
        v, vd = turn * joint.qd[k], turn * joint.qdd[k]
        shift, speed, rise = slide * joint.q[k], slide * joint.qd[k], slide * joint.qdd[k]
        wx, wy, wz = before.wx[k], before.wy[k], before.wz[k]
        dx, dy, dz = before.dx[k], before.dy[k], before.dz[k]
        qy, qz = py + ryz * shift, pz + rzz * shift  # no joint moves along x, and no rotor along its axis
        ax = before.ax[k] - (wy * wy + wz * wz) * px + (wx * wy - dz) * qy + (wx * wz + dy) * qz
        ay = before.ay[k] + (wx * wy + dz) * px - (wx * wx + wz * wz) * qy + (wy * wz - dx) * qz
        az = before.az[k] + (wx * wz - dy) * px + (wy * wz + dx) * qy - (wx * wx + wy * wy) * qz
        t = rxx * wx + ryx * wy + rzx * wz
        r = rxy * wx + ryy * wy + rzy * wz
        ex = c * t + s * r
        ey = c * r - s * t
        ez = rxz * wx + ryz * wy + rzz * wz + v
        t = rxx * dx + ryx * dy + rzx * dz
        r = rxy * dx + ryy * dy + rzy * dz
        axial = rxz * dx + ryz * dy + rzz * dz
        gx = c * t + s * r + ey * v
        gy = c * r - s * t - ex * v
        t = rxx * ax + ryx * ay + rzx * az
        r = rxy * ax + ryy * ay + rzy * az
        bx = c * t + s * r + 2.0 * speed * ey
        by = c * r - s * t - 2.0 * speed * ex
        bz = rxz * ax + ryz * ay + rzz * az + rise
        keep(body, k, own, ex, ey, ez, gx, gy, axial + vd, bx, by, bz, 0.0, 0.0)
        body.axial[k] = axial
        joint.rotor[k] = inertia * joint.qdd[k]


@fast
def screw_back(link: Any, joint: Any, before: Any, body: Any) -> None:
    """Generalised torque of a body of ``screw``; adds its wrench to that of its carrier."""
    px, py, pz, turn, slide = link.px, link.py, link.pz, link.turn, link.slide
    rxx, rxy, rxz, ryx, ryy, ryz = link.rxx, link.rxy, link.rxz, link.ryx, link.ryy, link.ryz
    rzx, rzy, rzz = link.rzx, link.rzy, link.rzz
    for k in range(len(joint.q)):
        c, s, shift = joint.cos[k], joint.sin[k], slide * joint.q[k]
        fx, fy, fz = body.fx[k], body.fy[k], body.fz[k]
        nx, ny, nz = body.nx[k], body.ny[k], body.nz[k]
        joint.torque[k] = turn * nz + slide * fz + joint.rotor[k]
        qy, qz = py + ryz * shift, pz + rzz * shift  # as in ``screw``
        t = c * fx - s * fy
        r = s * fx + c * fy
        gx = rxx * t + rxy * r + rxz * fz
        gy = ryx * t + ryy * r + ryz * fz
        gz = rzx * t + rzy * r + rzz * fz
        t = c * nx - s * ny
        r = s * nx + c * ny
        before.fx[k] += gx
        before.fy[k] += gy
        before.fz[k] += gz
        before.nx[k] += rxx * t + rxy * r + rxz * nz + qy * gz - qz * gy
        before.ny[k] += ryx * t + ryy * r + ryz * nz + qz * gx - px * gz
        before.nz[k] += rzx * t + rzy * r + rzz * nz + px * gy - qy * gx


@fast
def couple(link: Any, joint: Any, carrier: Any) -> None:
    """A balanced rotor of any direction on any link: its couple on the carrier, its torque on its joint."""
    for k in range(len(joint.q)):
        joint.rotor[k] += add_couple(link, joint.qd[k], joint.qdd[k], carrier, k)


@fast
def add_couple(link: Any, v: float, vd: float, carrier: Any, k: int) -> float:
    """As ``couple``, for one sample; returns the torque."""
    zx, zy, zz = link.px, link.py, link.pz
    wx, wy, wz = carrier.wx[k], carrier.wy[k], carrier.wz[k]
    carrier.nx[k] += vd * zx + v * (wy * zz - wz * zy)
    carrier.ny[k] += vd * zy + v * (wz * zx - wx * zz)
    carrier.nz[k] += vd * zz + v * (wx * zy - wy * zx)
    return zx * carrier.dx[k] + zy * carrier.dy[k] + zz * carrier.dz[k]


@exact
def spin(link: Any, joint: Any, own: Any, carrier: Any, body: Any, size: float) -> None:
    """An unbalanced rotor: its wrench on the carrier, its torque on its joint."""
    for k in range(len(joint.q)):
        own.q[k], own.qd[k], own.qdd[k] = joint.q[k], joint.qd[k], joint.qdd[k]
    sincos(own, link.turn, 0.0, size * link.turn**2 > FAR * FAR)
    screw(link, own, carrier, body)
    screw_back(link, own, carrier, body)
    for k in range(len(joint.q)):
        joint.rotor[k] += own.torque[k]


@fast
def push(last: Any, tip: Array, first: int, count: int) -> None:
    """Add wrenches on the environment, or the only one, to that of the last link."""
    step = 1 if len(tip) > 1 else 0
    for k in range(count):
        row = tip[(first + k) * step]
        last.nx[k] += row[0]
        last.ny[k] += row[1]
        last.nz[k] += row[2]
        last.fx[k] += row[3]
        last.fy[k] += row[4]
        last.fz[k] += row[5]


@fast
def take_gear(joint: Any) -> None:
    """Torque at the gear: the joint's without the rotor's part."""
    for k in range(len(joint.q)):
        joint.torque[k] -= joint.rotor[k]


@fast
def take_axial(joint: Any, body: Any) -> None:
    """Angular acceleration of the previous link along the joint's axis."""
    for k in range(len(joint.q)):
        joint.torque[k] = body.axial[k]


@fast
def take_wrench(link: Any, joint: Any, body: Any, wrench: Array) -> None:
    """The wrench through a joint in its own frame, without the couple of a rotor on the previous link."""
    cd, sd, spin = link.cos_own, link.sin_own, link.spin
    for k in range(len(wrench)):
        fx, fy = body.fx[k], body.fy[k]
        couple = spin * joint.qd[k]
        nx, ny = body.nx[k] - couple * body.wy[k], body.ny[k] + couple * body.wx[k]
        wrench[k, 0] = cd * nx + sd * ny
        wrench[k, 1] = cd * ny - sd * nx
        wrench[k, 2] = body.nz[k]
        wrench[k, 3] = cd * fx + sd * fy
        wrench[k, 4] = cd * fy - sd * fx
        wrench[k, 5] = body.fz[k]
