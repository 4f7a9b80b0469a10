"""Derivatives of the inverse dynamics, compiled, over groups of 16 samples.

All six-vectors are about the base's origin in the axes of the base, so that bodies of links can be added. With S the
screw of a joint, V and a the velocity and acceleration (minus gravity) of the link before it,

    S' = V x S,    S'' = a x S + V x S',

I and f the inertia and wrench of all links from i on, and B the matrix of their velocity terms (half the derivative of
the quadratic form of their momentum), for j up to i:

    d tau_i / dq_j  = S_i . (2 B S_j' + I S_j''),         d tau_j / dq_i  = S_j . (2 B S_i' + I S_i'' + S_i x f),
    d tau_i / dqd_j = S_i . (2 B S_j + 2 I S_j'),         d tau_j / dqd_i = S_j . (2 B S_i + 2 I S_i').

``2 B x`` depends only on the angular part e of x: its force is ``2 e x p``, its moment ``2 (tr(K) - K) e``, with p the
momentum and ``K = integral r' r^T dm``, with the velocity r' of the points at r. A rotor is a further body on its
carrier that belongs to its joint's row and column; of a balanced one only its momentum along its axis, k per unit rate,
remains.

Reference: S. Singh, R. Russell, P. Wensing, Efficient Analytical Derivatives of Rigid-Body Dynamics using Spatial
    Vector Algebra, IEEE Robotics and Automation Letters 7 (2022) 1776-1783, for an arm without rotors.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.blocks import BLOCK, FAR, JOINT, JOINT_ALONE, block_types, fast, sincos
from drivetrain.dynamics.core.recursion import moments, read, read_alone
from drivetrain.dynamics.core.vectors import Vector, cross, dot, exact, minus, plus, times
from drivetrain.jit import kernel

GROUP = 16  # samples per group: their bodies fit the L1 cache, and few samples do not cost as much as 64

BODY, BODY_ALONE = (
    np.dtype(
        [
            ("mass", np.float64),
            *((name, np.float64, (lanes,)) for name in ("q", "qd", "qdd", "cos", "sin")),  # of its joint
            *(
                (name, np.float64, (rows, lanes))
                for name, rows in (
                    # Axes of its frame, origin; velocity, acceleration.
                    *((name, 3) for name in ("x", "y", "z", "origin", "w", "v", "dw", "dv")),
                    # Screw of its joint and its derivatives: S, S', S''.
                    *((name, 3) for name in ("turn", "slide", "turn_1", "slide_1", "turn_2", "slide_2")),
                    # Of it and all after it: first and second moments, columns of K, momentum, wrench, and the
                    # momentum of balanced rotors.
                    ("first", 3),
                    ("second", 6),
                    *((name, 3) for name in ("flow_x", "flow_y", "flow_z", "momentum", "moment", "force", "spin")),
                    # Torque of its joint for other screws: S . 2 B (angular part), S . I; and its own columns, for q
                    # and qd.
                    *((name, 3) for name in ("feels", "inertia_w", "inertia_v")),
                    *((name, 3) for name in ("by_q_w", "by_q_v", "by_qd_w", "by_qd_v")),
                )
            ),
        ]
    )
    for lanes in (GROUP, 1)
)

ENTRY, ENTRY_ALONE = block_types("by_q", "by_qd", "by_qdd", block=GROUP)


@kernel
def differentiate(
    links: Any, rotors: Any, gravity: Array, q: Array, qd: Array, qdd: Array, tip: Array,
    by_q: Array, by_qd: Array, by_qdd: Array,
) -> float:  # fmt: skip
    """Fill the derivatives; returns 0, or NaN if a number is NaN, infinite, or beyond 1e154."""
    n, m, bad = q.shape[1], len(rotors), 0.0
    joints, bodies = np.empty(n + m, JOINT), np.zeros(n + m + 1, BODY)
    rest(bodies[n + m], gravity)
    for block in range(0, len(q), BLOCK):
        count = min(BLOCK, len(q) - block)
        size = read(joints, q, qd, qdd, block, count)
        bad += 0.0 * size
        angles(links, rotors, joints, n, size)
        for at in range(0, count, GROUP):
            first, some, entries = block + at, min(GROUP, count - at), np.zeros((n, n), ENTRY)
            fill(links, rotors, joints, at, bodies, entries, entries, tip, first, some)
            write(entries, first, some, by_q, by_qd, by_qdd)
    return bad


@kernel
def derivatives_alone(arm: Any, q: Array, qd: Array, qdd: Array, tip: Array, result: Array) -> float:
    """As ``differentiate``, for one sample: ``arm`` as in ``torque_alone``, derivatives (3, 1, n, n)."""
    links, rotors, gravity = arm
    entries = np.zeros((len(q), len(q)), ENTRY_ALONE)
    size = fill_alone(links, rotors, gravity, q, qd, qdd, tip, entries, entries)
    write(entries, np.int64(0), np.int64(1), result[0], result[1], result[2])
    return 0.0 * size


@exact
def fill_alone(
    links: Any, rotors: Any, gravity: Any, q: Array, qd: Array, qdd: Array, tip: Array, entries: Any, motors: Any
) -> float:
    """Add the derivatives of one sample to ``entries`` and ``motors`` as ``fill`` does; returns the sum of squares."""
    n, m, size = len(q), len(rotors), 0.0
    joints, bodies = np.empty(n + m, JOINT_ALONE), np.zeros(n + m + 1, BODY_ALONE)
    rest(bodies[n + m], gravity)
    for i in range(n):
        size += read_alone(joints[i], q[i], qd[i], qdd[i])
    angles(links, rotors, joints, n, size)
    fill(links, rotors, joints, np.int64(0), bodies, entries, motors, tip, np.int64(0), np.int64(1))
    return size


@fast
def rest(base: Any, gravity: Any) -> None:
    """Set the base to rest, with gravity as its acceleration."""
    for k in range(len(base.q)):
        base.x[0, k] = base.y[1, k] = base.z[2, k] = 1.0
        base.dv[0, k], base.dv[1, k], base.dv[2, k] = -gravity[0], -gravity[1], -gravity[2]


@exact
def angles(links: Any, rotors: Any, joints: Any, n: int, size: float) -> None:
    """Cosines and sines of the joints, and the motion of the rotors after them; ``size`` is the result of ``read``."""
    for i in range(n):
        sincos(joints[i], links[i].turn, links[i].offset, size > FAR * FAR)
    for r in range(len(rotors)):
        joint, own = joints[rotors[r].joint], joints[n + r]
        for k in range(len(own.q)):
            own.q[k], own.qd[k], own.qdd[k] = joint.q[k], joint.qd[k], joint.qdd[k]
        if not rotors[r].balanced:
            sincos(own, links[n + r].turn, 0.0, size * links[n + r].turn ** 2 > FAR * FAR)


@fast
def fill(
    links: Any, rotors: Any, joints: Any, at: int, bodies: Any, entries: Any, motors: Any, tip: Array,
    first: int, some: int,
) -> None:  # fmt: skip
    """Add the derivatives of a group of samples from ``first`` on, which start at ``at`` in the joints' rows.

    Those of the torques that act on the motors' own rotors directly, not through their gears, are added to ``motors``,
    all others to ``entries``; both may be the same array.
    """
    n, m = len(entries), len(rotors)
    for i in range(n):
        take(joints[i], at, bodies[i])
        move(links[i], bodies[i - 1], bodies[i])  # index -1 of the first link is the last record, the base
    if len(tip):
        push(tip, first, some, bodies[n - 1])
    for r in range(m):
        link, rotor, own = links[n + r], rotors[r], bodies[n + r]
        carrier = bodies[rotor.carrier]
        take(joints[n + r], at, own)
        if rotor.balanced:
            spin(link.px, link.py, link.pz, carrier, own)
            continue
        move(link, carrier, own)
        respond(own)
        if rotor.carrier >= 0:
            hand_on(own, carrier)
    for i in range(n - 1, -1, -1):
        for k in range(some):
            motors[i, i].by_qdd[k] += links[i].rotor_inertia
        respond(bodies[i])
        enter_row(bodies[i], bodies[i], entries[i, i])
        for j in range(i):
            enter_row(bodies[i], bodies[j], entries[i, j])
            enter_column(bodies[i], bodies[j], entries[j, i])
        if i > 0:
            hand_on(bodies[i], bodies[i - 1])
            if links[i].spin != 0.0:
                # A balanced rotor on the axis, carried by the previous link, uses this link's record, which is free
                # again.
                spin_on_axis(links[i].spin, bodies[i - 1], bodies[i])
                for j in range(i):
                    enter_row(bodies[i], bodies[j], motors[i, j])
                    enter_column(bodies[i], bodies[j], entries[j, i])
    for r in range(m):
        joint, own = rotors[r].joint, bodies[n + r]
        if not rotors[r].balanced:
            enter_row(own, own, motors[joint, joint])
        for j in range(rotors[r].carrier + 1):
            enter_row(own, bodies[j], motors[joint, j])
            enter_column(own, bodies[j], entries[j, joint])


@fast
def write(entries: Any, first: int, some: int, by_q: Array, by_qd: Array, by_qdd: Array) -> None:
    """Write the derivatives of a group of samples from ``first`` on."""
    n = len(entries)
    for i in range(n):
        for k in range(some):
            for j in range(n):
                by_q[first + k, i, j] = entries[i, j].by_q[k]
                by_qd[first + k, i, j] = entries[i, j].by_qd[k]
                by_qdd[first + k, i, j] = 0.5 * (entries[i, j].by_qdd[k] + entries[j, i].by_qdd[k])


@fast
def at_sample(rows: Array, k: int) -> Vector:
    """The vector of one sample from its rows."""
    return rows[0, k], rows[1, k], rows[2, k]


@fast
def keep(rows: Array, k: int, a: Vector) -> None:
    """Write the vector of one sample to its rows."""
    rows[0, k], rows[1, k], rows[2, k] = a


@fast
def join(rows: Array, k: int, a: Vector) -> None:
    """Add to the vector of one sample in its rows."""
    rows[0, k] += a[0]
    rows[1, k] += a[1]
    rows[2, k] += a[2]


@fast
def mix(a: float, x: Vector, b: float, y: Vector, c: float, z: Vector) -> Vector:
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
    )


@fast
def take(joint: Any, at: int, body: Any) -> None:
    """Copy a group's part of a joint's block."""
    for k in range(len(body.q)):
        body.q[k], body.qd[k], body.qdd[k] = joint.q[at + k], joint.qd[at + k], joint.qdd[at + k]
        body.cos[k], body.sin[k] = joint.cos[at + k], joint.sin[at + k]


@fast
def move(link: Any, before: Any, body: Any) -> None:
    """Pose and motion of a body and its screw, its moments about the base's origin, and the wrench that moves it."""
    px, py, pz, turning, sliding = link.px, link.py, link.pz, link.turn, link.slide
    rxx, rxy, rxz, ryx, ryy, ryz = link.rxx, link.rxy, link.rxz, link.ryx, link.ryy, link.ryz
    rzx, rzy, rzz = link.rzx, link.rzy, link.rzz
    mass, hx, hy, hz, sxx, syy, szz, sxy, sxz, syz = moments(link)
    body.mass = mass
    for k in range(len(body.q)):
        x, y, z = at_sample(before.x, k), at_sample(before.y, k), at_sample(before.z, k)
        c, s, shift = body.cos[k], body.sin[k], sliding * body.q[k]
        rate, rise = body.qd[k], body.qdd[k]
        o = plus(at_sample(before.origin, k), mix(px, x, py, y, pz, z))
        a, b = mix(rxx, x, ryx, y, rzx, z), mix(rxy, x, ryy, y, rzy, z)
        z = mix(rxz, x, ryz, y, rzz, z)
        x, y, o = plus(times(c, a), times(s, b)), minus(times(c, b), times(s, a)), plus(o, times(shift, z))
        keep(body.x, k, x)
        keep(body.y, k, y)
        keep(body.z, k, z)
        keep(body.origin, k, o)
        turn = times(turning, z)
        slide = plus(cross(o, turn), times(sliding, z))
        w, v, dw, dv = (
            at_sample(before.w, k), at_sample(before.v, k), at_sample(before.dw, k), at_sample(before.dv, k)
        )  # fmt: skip
        turn_1, slide_1 = cross(w, turn), plus(cross(w, slide), cross(v, turn))
        turn_2 = plus(cross(dw, turn), cross(w, turn_1))
        slide_2 = plus(plus(cross(dw, slide), cross(dv, turn)), plus(cross(w, slide_1), cross(v, turn_1)))
        keep(body.turn, k, turn)
        keep(body.slide, k, slide)
        keep(body.turn_1, k, turn_1)
        keep(body.slide_1, k, slide_1)
        keep(body.turn_2, k, turn_2)
        keep(body.slide_2, k, slide_2)
        w, v = plus(w, times(rate, turn)), plus(v, times(rate, slide))
        dw, dv = plus(dw, mix(rise, turn, rate, turn_1, 0.0, z)), plus(dv, mix(rise, slide, rate, slide_1, 0.0, z))
        keep(body.w, k, w)
        keep(body.v, k, v)
        keep(body.dw, k, dw)
        keep(body.dv, k, dv)
        h = mix(hx, x, hy, y, hz, z)
        g = plus(h, times(mass, o))
        a = mix(sxx, x, sxy, y, sxz, z)
        b = mix(sxy, x, syy, y, syz, z)
        d = mix(sxz, x, syz, y, szz, z)
        first = plus(mix(x[0], a, y[0], b, z[0], d), plus(times(h[0], o), times(o[0], g)))  # columns of the moments
        second = plus(mix(x[1], a, y[1], b, z[1], d), plus(times(h[1], o), times(o[1], g)))
        third = plus(mix(x[2], a, y[2], b, z[2], d), plus(times(h[2], o), times(o[2], g)))
        flow_x, flow_y = plus(times(g[0], v), cross(w, first)), plus(times(g[1], v), cross(w, second))
        flow_z, p = plus(times(g[2], v), cross(w, third)), plus(times(mass, v), cross(w, g))
        polar, swirl = first[0] + second[1] + third[2], flow_x[0] + flow_y[1] + flow_z[2]
        moment = minus(times(polar, dw), mix(dw[0], first, dw[1], second, dw[2], third))
        moment = plus(moment, minus(times(swirl, w), mix(w[0], flow_x, w[1], flow_y, w[2], flow_z)))
        keep(body.moment, k, plus(moment, cross(g, dv)))
        keep(body.force, k, plus(times(mass, dv), plus(cross(dw, g), cross(w, p))))
        keep(body.first, k, g)
        keep(body.momentum, k, p)
        keep(body.flow_x, k, flow_x)
        keep(body.flow_y, k, flow_y)
        keep(body.flow_z, k, flow_z)
        keep(body.spin, k, (0.0, 0.0, 0.0))
        body.second[0, k], body.second[1, k], body.second[2, k] = first[0], second[1], third[2]
        body.second[3, k], body.second[4, k], body.second[5, k] = first[1], first[2], second[2]


@fast
def push(tip: Array, first: int, some: int, last: Any) -> None:
    """Add the wrench on the environment to that of the last link, about the base's origin."""
    for k in range(some):
        row = tip[first + k if len(tip) > 1 else 0]
        x, y, z = at_sample(last.x, k), at_sample(last.y, k), at_sample(last.z, k)
        force = mix(row[3], x, row[4], y, row[5], z)
        join(last.force, k, force)
        join(last.moment, k, plus(mix(row[0], x, row[1], y, row[2], z), cross(at_sample(last.origin, k), force)))


@fast
def hand_on(body: Any, to: Any) -> None:
    """Add a body with all after it, and the wrench that moves them, to another body."""
    to.mass += body.mass
    for r in range(3):
        for k in range(len(body.q)):
            to.first[r, k] += body.first[r, k]
            to.flow_x[r, k] += body.flow_x[r, k]
            to.flow_y[r, k] += body.flow_y[r, k]
            to.flow_z[r, k] += body.flow_z[r, k]
            to.momentum[r, k] += body.momentum[r, k]
            to.moment[r, k] += body.moment[r, k]
            to.force[r, k] += body.force[r, k]
            to.spin[r, k] += body.spin[r, k]
    for r in range(6):
        for k in range(len(body.q)):
            to.second[r, k] += body.second[r, k]


@fast
def respond(body: Any) -> None:
    """Sensitivity of a joint's torque to earlier screws, and the wrenches due to its own screw."""
    mass = body.mass
    for k in range(len(body.q)):
        g, p, spin = at_sample(body.first, k), at_sample(body.momentum, k), at_sample(body.spin, k)
        kx, ky, kz = at_sample(body.flow_x, k), at_sample(body.flow_y, k), at_sample(body.flow_z, k)
        xx, yy, zz = body.second[0, k], body.second[1, k], body.second[2, k]
        xy, xz, yz = body.second[3, k], body.second[4, k], body.second[5, k]
        turn, slide = at_sample(body.turn, k), at_sample(body.slide, k)
        swirl = kx[0] + ky[1] + kz[2]
        feels = minus(times(swirl, turn), (dot(kx, turn), dot(ky, turn), dot(kz, turn)))
        keep(body.feels, k, plus(times(2.0, plus(feels, cross(p, slide))), cross(spin, turn)))
        inertia = ((yy + zz, -xy, -xz), (-xy, xx + zz, -yz), (-xz, -yz, xx + yy))
        moment = plus(mix(turn[0], inertia[0], turn[1], inertia[1], turn[2], inertia[2]), cross(g, slide))
        keep(body.inertia_w, k, moment)
        keep(body.inertia_v, k, minus(times(mass, slide), cross(g, turn)))
        e, u = at_sample(body.turn_1, k), at_sample(body.slide_1, k)
        moment = plus(mix(e[0], inertia[0], e[1], inertia[1], e[2], inertia[2]), cross(g, u))
        moment = plus(moment, minus(times(swirl, turn), mix(turn[0], kx, turn[1], ky, turn[2], kz)))
        keep(body.by_qd_w, k, plus(times(2.0, moment), cross(turn, spin)))
        force = plus(minus(times(mass, u), cross(g, e)), cross(turn, p))
        keep(body.by_qd_v, k, times(2.0, force))
        moment = plus(times(2.0, minus(times(swirl, e), mix(e[0], kx, e[1], ky, e[2], kz))), cross(e, spin))
        force = times(2.0, cross(e, p))
        e, u = at_sample(body.turn_2, k), at_sample(body.slide_2, k)
        moment = plus(moment, plus(mix(e[0], inertia[0], e[1], inertia[1], e[2], inertia[2]), cross(g, u)))
        force = plus(force, minus(times(mass, u), cross(g, e)))
        push = at_sample(body.force, k)
        keep(body.by_q_w, k, plus(moment, plus(cross(turn, at_sample(body.moment, k)), cross(slide, push))))
        keep(body.by_q_v, k, plus(force, cross(turn, push)))


@fast
def spin_on_axis(size: float, carrier: Any, own: Any) -> None:
    """A balanced rotor on its joint's axis, the link's own z axis."""
    for k in range(len(own.q)):
        keep(own.inertia_w, k, times(size, at_sample(own.z, k)))
    react(carrier, own)


@fast
def spin(px: float, py: float, pz: float, carrier: Any, own: Any) -> None:
    """A balanced rotor with a spin axis of any direction."""
    for k in range(len(own.q)):
        axis = mix(px, at_sample(carrier.x, k), py, at_sample(carrier.y, k), pz, at_sample(carrier.z, k))
        keep(own.inertia_w, k, axis)
    react(carrier, own)


@fast
def react(carrier: Any, own: Any) -> None:
    """Effect of a balanced rotor's momentum per unit rate on its carrier, and on its joint's torque."""
    for k in range(len(own.q)):
        axis, rate = at_sample(own.inertia_w, k), own.qd[k]
        turning = cross(at_sample(carrier.w, k), axis)
        join(carrier.moment, k, plus(times(own.qdd[k], axis), times(rate, turning)))
        join(carrier.spin, k, times(rate, axis))
        keep(own.feels, k, turning)
        keep(own.by_qd_w, k, turning)
        keep(own.inertia_v, k, (0.0, 0.0, 0.0))
        keep(own.by_qd_v, k, (0.0, 0.0, 0.0))
        keep(own.by_q_w, k, (0.0, 0.0, 0.0))
        keep(own.by_q_v, k, (0.0, 0.0, 0.0))


@fast
def enter_row(own: Any, body: Any, entry: Any) -> None:
    """Derivatives of a joint's torque by the coordinate of an earlier joint."""
    for k in range(len(entry.by_q)):
        feels, w, v = at_sample(own.feels, k), at_sample(own.inertia_w, k), at_sample(own.inertia_v, k)
        turn, turn_1 = at_sample(body.turn, k), at_sample(body.turn_1, k)
        entry.by_q[k] += dot(feels, turn_1) + dot(w, at_sample(body.turn_2, k)) + dot(v, at_sample(body.slide_2, k))
        entry.by_qd[k] += dot(feels, turn) + 2.0 * (dot(w, turn_1) + dot(v, at_sample(body.slide_1, k)))
        entry.by_qdd[k] += dot(w, turn) + dot(v, at_sample(body.slide, k))


@fast
def enter_column(own: Any, body: Any, entry: Any) -> None:
    """Derivatives of a joint's torque by the coordinate of a later joint."""
    for k in range(len(entry.by_q)):
        turn, slide = at_sample(body.turn, k), at_sample(body.slide, k)
        entry.by_q[k] += dot(turn, at_sample(own.by_q_w, k)) + dot(slide, at_sample(own.by_q_v, k))
        entry.by_qd[k] += dot(turn, at_sample(own.by_qd_w, k)) + dot(slide, at_sample(own.by_qd_v, k))
        entry.by_qdd[k] += dot(at_sample(own.inertia_w, k), turn) + dot(at_sample(own.inertia_v, k), slide)
