"""The mass matrix by composite bodies, compiled, over blocks of 64 samples.

Column j contains the torques for a unit acceleration of joint j from rest: all links from j on move as one body, so the
wrench through joint j is that of this composite body alone, and it also acts on every joint before j. Composite bodies
are summed from the tip to the base; no outward pass is needed. A rotor couples its joint with every joint up to its
carrier, by the momentum per unit rate of its joint.

Reference: Modern Robotics, exercise 8.13; M. W. Walker and D. E. Orin, Efficient dynamic computer simulation of
    robotic mechanisms, Journal of Dynamic Systems, Measurement and Control 104 (1982) 205-211.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.blocks import BLOCK, FAR, JOINT, block_types, fast, read_row, sincos, sum_of_squares
from drivetrain.dynamics.core.records import MOMENTS
from drivetrain.jit import kernel

BODY, BODY_ALONE = block_types(*MOMENTS)
WRENCH, WRENCH_ALONE = block_types("fx", "fy", "fz", "nx", "ny", "nz")


@kernel
def compose(links: Any, rotors: Any, q: Array, out: Array) -> float:
    """Fill mass matrices; returns 0, or NaN if a position is NaN, infinite, or beyond 1e154."""
    n, bad = q.shape[1], 0.0
    joints, wrenches = np.zeros(n + 1, JOINT), np.empty(n + len(rotors), WRENCH)  # the last joint: a rotor's
    bodies, own, entries = np.empty(n + 2, BODY), rotor_inertias(links, rotors, n), np.empty((n, n, BLOCK))
    for first in range(0, len(q), BLOCK):
        count, size = min(BLOCK, len(q) - first), 0.0
        for i in range(n):
            read_row(joints[i].q, q, i, first, count)
            size += sum_of_squares(joints[i])
        bad += 0.0 * size
        for i in range(n):
            sincos(joints[i], links[i].turn, links[i].offset, size > FAR * FAR)
        clear(bodies[n])
        for i in range(n - 1, -1, -1):
            # The links after it are in this link's frame already; add the link itself and the rotors that it carries.
            link, joint, body, wrench = links[i], joints[i], bodies[i + 1], wrenches[i]
            add_constant_body(link, body)
            for r in range(len(rotors)):
                if rotors[r].carrier == i:
                    enter_rotor(links[n + r], rotors[r], joints, body, bodies[n + 1], wrenches[n + r], size)
            unit_wrench(link, body, wrench)
            for j in range(i + 1):
                entries[i, j] = 0.0
            for k in range(BLOCK):
                entries[i, i, k] = own[i]
            fill_row(links, rotors, i, wrenches, entries)
            # A balanced rotor on the axis, carried by the previous link: its couple acts on that link, not on this
            # joint.
            for k in range(BLOCK):
                wrench.nz[k] += link.spin
            for w in range(i, len(wrenches)):
                if w < n or rotors[w - n].carrier >= i:
                    wrench_back(link, joint, wrenches[w])
            turn_body(joint, body)
            clear(bodies[i])
            place_body(link, joint, body, bodies[i])
        for k in range(count):
            for i in range(n):
                for j in range(i + 1):
                    out[first + k, i, j] = out[first + k, j, i] = entries[i, j, k]
    return bad


@fast
def rotor_inertias(links: Any, rotors: Any, n: int) -> Array:
    """Inertia of each joint's rotor about its spin axis, times the ratio squared, (n,)."""
    own = np.empty(n)
    for i in range(n):
        own[i] = links[i].rotor_inertia
    for r in range(len(rotors)):
        if not rotors[r].balanced:
            own[rotors[r].joint] += links[n + r].turn ** 2 * (links[n + r].sxx + links[n + r].syy)
    return own


@fast
def clear(body: Any) -> None:
    """Set a body to zero."""
    for k in range(len(body.mass)):
        body.mass[k] = body.hx[k] = body.hy[k] = body.hz[k] = 0.0
        body.sxx[k] = body.syy[k] = body.szz[k] = body.sxy[k] = body.sxz[k] = body.syz[k] = 0.0


@fast
def add_constant_body(link: Any, body: Any) -> None:
    """Add the body of a link, given in the record's own frame."""
    m, hx, hy, hz = link.mass, link.hx, link.hy, link.hz
    sxx, syy, szz, sxy, sxz, syz = link.sxx, link.syy, link.szz, link.sxy, link.sxz, link.syz
    for k in range(len(body.mass)):
        body.mass[k] += m
        body.hx[k] += hx
        body.hy[k] += hy
        body.hz[k] += hz
        body.sxx[k] += sxx
        body.syy[k] += syy
        body.szz[k] += szz
        body.sxy[k] += sxy
        body.sxz[k] += sxz
        body.syz[k] += syz


@fast
def unit_wrench(link: Any, body: Any, wrench: Any) -> None:
    """The wrench on a body at rest for a unit acceleration of its joint."""
    turn, slide = link.turn, link.slide
    for k in range(len(body.mass)):
        hx, hy = body.hx[k], body.hy[k]
        wrench.fx[k] = -turn * hy
        wrench.fy[k] = turn * hx
        wrench.fz[k] = slide * body.mass[k]
        wrench.nx[k] = slide * hy - turn * body.sxz[k]
        wrench.ny[k] = -slide * hx - turn * body.syz[k]
        wrench.nz[k] = turn * (body.sxx[k] + body.syy[k])


@fast
def wrench_back(link: Any, joint: Any, wrench: Any) -> None:
    """Transform a wrench from a body's frame to the previous frame."""
    px, py, pz, slide = link.px, link.py, link.pz, link.slide
    rxx, rxy, rxz, ryx, ryy, ryz = link.rxx, link.rxy, link.rxz, link.ryx, link.ryy, link.ryz
    rzx, rzy, rzz = link.rzx, link.rzy, link.rzz
    for k in range(len(wrench.fx)):
        c, s, shift = joint.cos[k], joint.sin[k], slide * joint.q[k]
        fz, nz = wrench.fz[k], wrench.nz[k]
        t = c * wrench.fx[k] - s * wrench.fy[k]
        r = s * wrench.fx[k] + c * wrench.fy[k]
        gx, gy, gz = rxx * t + rxy * r + rxz * fz, ryx * t + ryy * r + ryz * fz, rzx * t + rzy * r + rzz * fz
        t = c * wrench.nx[k] - s * wrench.ny[k]
        r = s * wrench.nx[k] + c * wrench.ny[k]
        y, z = py + ryz * shift, pz + rzz * shift  # no joint moves along x, and no rotor along its axis
        wrench.fx[k], wrench.fy[k], wrench.fz[k] = gx, gy, gz
        wrench.nx[k] = rxx * t + rxy * r + rxz * nz + y * gz - z * gy
        wrench.ny[k] = ryx * t + ryy * r + ryz * nz + z * gx - px * gz
        wrench.nz[k] = rzx * t + rzy * r + rzz * nz + px * gy - y * gx


@fast
def turn_body(joint: Any, body: Any) -> None:
    """Rotate a body about z by the angle of its joint."""
    for k in range(len(body.mass)):
        c, s = joint.cos[k], joint.sin[k]
        hx, hy = body.hx[k], body.hy[k]
        body.hx[k] = c * hx - s * hy
        body.hy[k] = s * hx + c * hy
        xx, yy, xy, xz, yz = turned_tensor(c, s, body.sxx[k], body.syy[k], body.sxy[k], body.sxz[k], body.syz[k])
        body.sxx[k], body.syy[k], body.sxy[k], body.sxz[k], body.syz[k] = xx, yy, xy, xz, yz


@fast
def turned_tensor(
    c: float, s: float, xx: float, yy: float, xy: float, xz: float, yz: float
) -> tuple[float, float, float, float, float]:
    """A symmetric tensor rotated about z, without zz, which does not change."""
    cc, sc, ss = c * c, s * c, s * s
    return (
        cc * xx - 2.0 * sc * xy + ss * yy,
        ss * xx + 2.0 * sc * xy + cc * yy,
        sc * (xx - yy) + (cc - ss) * xy,
        c * xz - s * yz,
        s * xz + c * yz,
    )


@fast
def place_body(link: Any, joint: Any, body: Any, total: Any) -> None:
    """Add a body to the total, transformed by the constant rotation and translation of its joint's place."""
    px, py, pz, slide = link.px, link.py, link.pz, link.slide
    rxx, rxy, rxz, ryx, ryy, ryz = link.rxx, link.rxy, link.rxz, link.ryx, link.ryy, link.ryz
    rzx, rzy, rzz = link.rzx, link.rzy, link.rzz
    for k in range(len(body.mass)):
        m, x, y, z = body.mass[k], body.hx[k], body.hy[k], body.hz[k]
        hx, hy, hz = rxx * x + rxy * y + rxz * z, ryx * x + ryy * y + ryz * z, rzx * x + rzy * y + rzz * z
        xx, yy, zz, xy, xz, yz = body.sxx[k], body.syy[k], body.szz[k], body.sxy[k], body.sxz[k], body.syz[k]
        ax, ay, az = rxx * xx + rxy * xy + rxz * xz, rxx * xy + rxy * yy + rxz * yz, rxx * xz + rxy * yz + rxz * zz
        bx, by, bz = ryx * xx + ryy * xy + ryz * xz, ryx * xy + ryy * yy + ryz * yz, ryx * xz + ryy * yz + ryz * zz
        dx, dy, dz = rzx * xx + rzy * xy + rzz * xz, rzx * xy + rzy * yy + rzz * yz, rzx * xz + rzy * yz + rzz * zz
        shift = slide * joint.q[k]
        x, y, z = px, py + ryz * shift, pz + rzz * shift  # as in ``wrench_back``
        total.mass[k] += m
        total.hx[k] += hx + m * x
        total.hy[k] += hy + m * y
        total.hz[k] += hz + m * z
        total.sxx[k] += ax * rxx + ay * rxy + az * rxz + x * (2.0 * hx + m * x)
        total.syy[k] += bx * ryx + by * ryy + bz * ryz + y * (2.0 * hy + m * y)
        total.szz[k] += dx * rzx + dy * rzy + dz * rzz + z * (2.0 * hz + m * z)
        total.sxy[k] += ax * ryx + ay * ryy + az * ryz + hx * y + x * hy + m * x * y
        total.sxz[k] += ax * rzx + ay * rzy + az * rzz + hx * z + x * hz + m * x * z
        total.syz[k] += bx * rzx + by * rzy + bz * rzz + hy * z + y * hz + m * y * z


@fast
def enter_rotor(link: Any, rotor: Any, joints: Any, body: Any, spinning: Any, wrench: Any, size: float) -> None:
    """Add a rotor to its carrier: its wrench per unit rate of its joint, and its body unless it is counted already."""
    if rotor.balanced:
        for k in range(len(wrench.fx)):
            wrench.fx[k] = wrench.fy[k] = wrench.fz[k] = 0.0
            wrench.nx[k], wrench.ny[k], wrench.nz[k] = link.px, link.py, link.pz
        return
    joint, own = joints[rotor.joint], joints[len(joints) - 1]
    for k in range(len(wrench.fx)):
        own.q[k] = joint.q[k]
    sincos(own, link.turn, 0.0, size * link.turn**2 > FAR * FAR)
    clear(spinning)
    add_constant_body(link, spinning)
    unit_wrench(link, spinning, wrench)
    wrench_back(link, own, wrench)
    turn_body(own, spinning)
    place_body(link, own, spinning, body)


@fast
def fill_row(links: Any, rotors: Any, i: int, wrenches: Any, entries: Array) -> None:
    """The entries of a joint with the joints after it, and with the rotors on its link or later links."""
    n = len(entries)
    for w in range(i, len(wrenches)):
        joint, factor = w, 1.0
        if w >= n:
            joint = rotors[w - n].joint
            if rotors[w - n].carrier < i:
                continue
            factor = 2.0 if joint == i else 1.0
        turn, slide, wrench = factor * links[i].turn, factor * links[i].slide, wrenches[w]
        entry = entries[max(joint, i), min(joint, i)]
        for k in range(len(entry)):
            entry[k] += turn * wrench.nz[k] + slide * wrench.fz[k]
