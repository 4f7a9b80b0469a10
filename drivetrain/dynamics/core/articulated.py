"""The articulated-body algorithm, compiled, over blocks of samples: accelerations in O(n) time, rotors included.

First the recursion of inverse dynamics computes the motion without joint accelerations, and the wrenches f on the links
and torques b on the rotors for it. The accelerations a of the links that are to be added to this motion, and those of
the joints, qdd, minimise (Gauss' principle)

    sum over links of (a . I a / 2 + f . a)  +  sum over joints of (R qdd^2 / 2 + (k . a_c + b - tau) qdd).

R is the inertia of a joint's rotor about its spin axis times the ratio squared, k its momentum per unit rate of the
joint, and c its carrier. From the tip to the base, each joint's acceleration is eliminated: the part of the chain after
it then acts on the previous link like a body with an articulated inertia and a wrench. A second pass from the base to
the tip computes the accelerations. If the carrier is neither the base, nor the link before the joint, nor the one after
it, an unknown would remain between joint and carrier: arms with such rotors (``packed.Packed.chained``) use the mass
matrix.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 7.3, for an arm without rotors.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.blocks import BLOCK, JOINT, JOINT_ALONE, block_types
from drivetrain.dynamics.core.composite import (
    BODY,
    BODY_ALONE,
    WRENCH,
    WRENCH_ALONE,
    add_constant_body,
    clear,
    enter_rotor,
    rotor_inertias,
    turned_tensor,
)
from drivetrain.dynamics.core.recursion import LINKS, LINKS_ALONE, outwards, push, read, read_alone, screw_back
from drivetrain.dynamics.core.vectors import Vector, cross, dot, exact, plus
from drivetrain.jit import kernel

# Smallest share of a joint's inertia that must remain with the joints after it free; rounding of zero is about 1e-15.
SINGULAR = 1e-12

# Articulated inertia of a link and all after it, [[I, H], [H^T, M]] for (angular, linear); their mass and the integral
# of r^2 dm, or more; the number of the first joint from the tip that moves no inertia, from 1 on, or 0.
INERTIA, INERTIA_ALONE = block_types(
    *("ixx", "iyy", "izz", "ixy", "ixz", "iyz"),
    *("hxx", "hxy", "hxz", "hyx", "hyy", "hyz", "hzx", "hzy", "hzz"),
    *("mxx", "myy", "mzz", "mxy", "mxz", "myz"),
    *("mass", "polar", "stuck"),
)
# Of a joint: wrench on its link per unit acceleration of the joint; the inertia that the joint moves, and its
# inverse; torque, then acceleration with the previous link held, then acceleration.
RESPONSE, RESPONSE_ALONE = block_types("fx", "fy", "fz", "nx", "ny", "nz", "moved", "mobility", "qdd")
# Acceleration of a link that is added to its motion without joint accelerations.
CHANGE, CHANGE_ALONE = block_types("dx", "dy", "dz", "ax", "ay", "az")


@kernel
def articulated_accelerations(arm: Any, q: Array, qd: Array, tau: Array, tip: Array, qdd: Array) -> tuple[int, int]:
    """Fill the accelerations, (N, n); returns sample and joint of the first joint that moves no inertia, or -1 and -1.

    Accelerations are NaN if a number is NaN, infinite, or beyond 1e154. Other arguments as for ``recursion``.
    """
    links, rotors, gravity = arm
    n, m = q.shape[1], len(rotors)
    joints, motions, bodies = np.empty(n + 1, JOINT), np.zeros(n + 2, LINKS), np.empty(n + 1, BODY)
    wrenches, responses = np.empty(m, WRENCH), np.empty(n, RESPONSE)
    own = rotor_inertias(links, rotors, n)
    set_base(motions[0], gravity)
    for first in range(0, len(q), BLOCK):
        count, inertia, change = min(BLOCK, len(q) - first), np.zeros(1, INERTIA), np.zeros(1, CHANGE)
        size = read(joints, q, qd, tau, first, count)
        move(links, rotors, joints, motions, responses, size)
        if len(tip):
            push(motions[n], tip, first, count)
        add_bodies(links, rotors, joints, bodies, wrenches, size)
        eliminate(links, rotors, own, joints, motions, bodies, wrenches, responses, inertia[0])
        accelerate(links, joints, responses, change[0])
        for k in range(count):
            if inertia[0].stuck[k] > 0.0:
                return first + k, int(inertia[0].stuck[k]) - 1
            for i in range(n):
                qdd[first + k, i] = responses[i].qdd[k] + 0.0 * size
    return -1, -1


@kernel
def accelerations_alone(arm: Any, q: Array, qd: Array, tau: Array, tip: Array, qdd: Array) -> int:
    """As ``articulated_accelerations``, for one sample, (n,); returns the joint or -1."""
    links, rotors, gravity = arm
    n, m, size = len(q), len(rotors), 0.0
    joints, motions, bodies = np.empty(n + 1, JOINT_ALONE), np.zeros(n + 2, LINKS_ALONE), np.empty(n + 1, BODY_ALONE)
    wrenches, responses = np.empty(m, WRENCH_ALONE), np.empty(n, RESPONSE_ALONE)
    inertia, change, own = np.zeros(1, INERTIA_ALONE), np.zeros(1, CHANGE_ALONE), rotor_inertias(links, rotors, n)
    set_base(motions[0], gravity)
    for i in range(n):
        size += read_alone(joints[i], q[i], qd[i], tau[i])
    move(links, rotors, joints, motions, responses, size)
    if len(tip):
        push(motions[n], tip, np.int64(0), np.int64(1))
    add_bodies(links, rotors, joints, bodies, wrenches, size)
    eliminate(links, rotors, own, joints, motions, bodies, wrenches, responses, inertia[0])
    accelerate(links, joints, responses, change[0])
    for i in range(n):
        qdd[i] = responses[i].qdd[0] + 0.0 * size
    return int(inertia[0].stuck[0]) - 1


@exact
def set_base(base: Any, gravity: Array) -> None:
    """Let the base accelerate against gravity."""
    for k in range(len(base.ax)):
        base.ax[k], base.ay[k], base.az[k] = -gravity[0], -gravity[1], -gravity[2]


@exact
def move(links: Any, rotors: Any, joints: Any, motions: Any, responses: Any, size: float) -> None:
    """Motion without joint accelerations; the torques, read in their place, are kept with the responses."""
    n = len(responses)
    for i in range(n):
        joint, response = joints[i], responses[i]
        for k in range(len(joint.q)):
            response.qdd[k] = joint.qdd[k]
            joint.qdd[k] = 0.0
    outwards(links, rotors, joints, motions, n, size)


@exact
def add_bodies(links: Any, rotors: Any, joints: Any, bodies: Any, wrenches: Any, size: float) -> None:
    """Bodies of the links with the rotors that they carry, and the rotors' wrenches per unit rate of their joints."""
    n = len(bodies) - 1
    for i in range(n):
        clear(bodies[i])
        add_constant_body(links[i], bodies[i])
    for r in range(len(rotors)):
        if rotors[r].carrier >= 0:
            enter_rotor(links[n + r], rotors[r], joints, bodies[rotors[r].carrier], bodies[n], wrenches[r], size)


@exact
def eliminate(
    links: Any, rotors: Any, own: Array, joints: Any, motions: Any, bodies: Any, wrenches: Any, responses: Any,
    inertia: Any,
) -> None:  # fmt: skip
    """Eliminate the joints' accelerations from tip to base; ``inertia`` is zero at first."""
    for i in range(len(responses) - 1, -1, -1):
        link, joint, motion, response = links[i], joints[i], motions[i + 1], responses[i]
        add_body(bodies[i], inertia)
        respond(link, own[i], inertia, response)
        for r in range(len(rotors)):
            if rotors[r].joint == i and rotors[r].carrier == i:
                respond_on_link(link, wrenches[r], response)
        free_joint(i, link, own[i], joint, motion, inertia, response)
        if i == 0:
            break
        # The rotor on the previous link does not add to the inertia that the joint moves.
        for k in range(len(joint.q)):
            response.nz[k] += link.spin
        for r in range(len(rotors)):
            if rotors[r].joint == i and rotors[r].carrier == i - 1:
                wrench_on(link, joint, wrenches[r])
                add_wrench(wrenches[r], response)
        free_link(response, inertia, motion)
        screw_back(link, joint, motions[i], motion)
        inertia_back(link, joint, inertia)


@exact
def add_body(body: Any, inertia: Any) -> None:
    """Add a body to an articulated inertia."""
    for k in range(len(body.mass)):
        m, hx, hy, hz = body.mass[k], body.hx[k], body.hy[k], body.hz[k]
        sxx, syy, szz = body.sxx[k], body.syy[k], body.szz[k]
        inertia.ixx[k] += syy + szz
        inertia.iyy[k] += sxx + szz
        inertia.izz[k] += sxx + syy
        inertia.ixy[k] -= body.sxy[k]
        inertia.ixz[k] -= body.sxz[k]
        inertia.iyz[k] -= body.syz[k]
        inertia.hxy[k] -= hz
        inertia.hxz[k] += hy
        inertia.hyx[k] += hz
        inertia.hyz[k] -= hx
        inertia.hzx[k] -= hy
        inertia.hzy[k] += hx
        inertia.mxx[k] += m
        inertia.myy[k] += m
        inertia.mzz[k] += m
        inertia.mass[k] += m
        inertia.polar[k] += sxx + syy + szz


@exact
def respond(link: Any, own: float, inertia: Any, response: Any) -> None:
    """Wrench on a link per unit acceleration of its joint, and the inertia that the joint moves, with its rotor's."""
    turn, slide = link.turn, link.slide
    for k in range(len(response.fx)):
        nz = turn * inertia.izz[k] + slide * inertia.hzz[k]
        fz = turn * inertia.hzz[k] + slide * inertia.mzz[k]
        response.nx[k] = turn * inertia.ixz[k] + slide * inertia.hxz[k]
        response.ny[k] = turn * inertia.iyz[k] + slide * inertia.hyz[k]
        response.nz[k] = nz
        response.fx[k] = turn * inertia.hzx[k] + slide * inertia.mxz[k]
        response.fy[k] = turn * inertia.hzy[k] + slide * inertia.myz[k]
        response.fz[k] = fz
        response.moved[k] = turn * nz + slide * fz + own


@exact
def respond_on_link(link: Any, wrench: Any, response: Any) -> None:
    """As ``add_wrench``, for a rotor carried by the link that its joint moves: it acts on the joint, too."""
    turn, slide = link.turn, link.slide
    for k in range(len(response.fx)):
        response.moved[k] += 2.0 * (turn * wrench.nz[k] + slide * wrench.fz[k])
    add_wrench(wrench, response)


@exact
def add_wrench(wrench: Any, response: Any) -> None:
    """Add the wrench of a rotor per unit acceleration of its joint."""
    for k in range(len(response.fx)):
        response.fx[k] += wrench.fx[k]
        response.fy[k] += wrench.fy[k]
        response.fz[k] += wrench.fz[k]
        response.nx[k] += wrench.nx[k]
        response.ny[k] += wrench.ny[k]
        response.nz[k] += wrench.nz[k]


@exact
def free_joint(i: int, link: Any, own: float, joint: Any, motion: Any, inertia: Any, response: Any) -> None:
    """Mobility of a joint, and its acceleration if the previous link is held."""
    turn, slide = link.turn, link.slide
    for k in range(len(response.fx)):
        whole = turn * turn * inertia.polar[k] + slide * slide * inertia.mass[k] + own
        moves = response.moved[k] > SINGULAR * whole
        mobility = 1.0 / response.moved[k] if moves else 0.0
        inertia.stuck[k] = inertia.stuck[k] if moves or inertia.stuck[k] > 0.0 else i + 1.0
        response.mobility[k] = mobility
        response.qdd[k] = mobility * (response.qdd[k] - turn * motion.nz[k] - slide * motion.fz[k] - joint.rotor[k])


@exact
def free_link(response: Any, inertia: Any, motion: Any) -> None:
    """What acts on the previous link, as the joint is free: the inertia without the joint's, and the joint's wrench."""
    for k in range(len(response.fx)):
        mobility, qdd = response.mobility[k], response.qdd[k]
        nx, ny, nz = response.nx[k], response.ny[k], response.nz[k]
        fx, fy, fz = response.fx[k], response.fy[k], response.fz[k]
        motion.nx[k] += nx * qdd
        motion.ny[k] += ny * qdd
        motion.nz[k] += nz * qdd
        motion.fx[k] += fx * qdd
        motion.fy[k] += fy * qdd
        motion.fz[k] += fz * qdd
        x, y, z = mobility * nx, mobility * ny, mobility * nz
        inertia.ixx[k] -= x * nx
        inertia.iyy[k] -= y * ny
        inertia.izz[k] -= z * nz
        inertia.ixy[k] -= x * ny
        inertia.ixz[k] -= x * nz
        inertia.iyz[k] -= y * nz
        inertia.hxx[k] -= x * fx
        inertia.hxy[k] -= x * fy
        inertia.hxz[k] -= x * fz
        inertia.hyx[k] -= y * fx
        inertia.hyy[k] -= y * fy
        inertia.hyz[k] -= y * fz
        inertia.hzx[k] -= z * fx
        inertia.hzy[k] -= z * fy
        inertia.hzz[k] -= z * fz
        x, y, z = mobility * fx, mobility * fy, mobility * fz
        inertia.mxx[k] -= x * fx
        inertia.myy[k] -= y * fy
        inertia.mzz[k] -= z * fz
        inertia.mxy[k] -= x * fy
        inertia.mxz[k] -= x * fz
        inertia.myz[k] -= y * fz


@exact
def inertia_back(link: Any, joint: Any, inertia: Any) -> None:
    """Transform an articulated inertia from a link's frame to the previous frame."""
    ca, sa, px, py, pz, slide = link.rzz, link.rzy, link.px, link.py, link.pz, link.slide
    for k in range(len(inertia.ixx)):
        c, s, p = joint.cos[k], joint.sin[k], place(px, py, pz, ca, sa, slide * joint.q[k])
        mxx, myy, mxy, mxz, myz = turned_tensor(
            c, s, inertia.mxx[k], inertia.myy[k], inertia.mxy[k], inertia.mxz[k], inertia.myz[k]
        )
        myy, mzz, myz, mxy, mxz = turned_tensor(ca, sa, myy, inertia.mzz[k], myz, mxy, mxz)
        ixx, iyy, ixy, ixz, iyz = turned_tensor(
            c, s, inertia.ixx[k], inertia.iyy[k], inertia.ixy[k], inertia.ixz[k], inertia.iyz[k]
        )
        iyy, izz, iyz, ixy, ixz = turned_tensor(ca, sa, iyy, inertia.izz[k], iyz, ixy, ixz)
        # Columns of H, then its rows.
        x = turned_back(c, s, ca, sa, (inertia.hxx[k], inertia.hyx[k], inertia.hzx[k]))
        y = turned_back(c, s, ca, sa, (inertia.hxy[k], inertia.hyy[k], inertia.hzy[k]))
        z = turned_back(c, s, ca, sa, (inertia.hxz[k], inertia.hyz[k], inertia.hzz[k]))
        row_x = turned_back(c, s, ca, sa, (x[0], y[0], z[0]))
        row_y = turned_back(c, s, ca, sa, (x[1], y[1], z[1]))
        row_z = turned_back(c, s, ca, sa, (x[2], y[2], z[2]))
        # About the previous origin: H + [p] M, and I - H [p] + [p] (H + [p] M)^T.
        x, y, z = cross(p, (mxx, mxy, mxz)), cross(p, (mxy, myy, myz)), cross(p, (mxz, myz, mzz))
        hx, hy, hz = plus(row_x, (x[0], y[0], z[0])), plus(row_y, (x[1], y[1], z[1])), plus(row_z, (x[2], y[2], z[2]))
        a, b, d = cross(p, row_x), cross(p, row_y), cross(p, row_z)
        x, y, z = cross(p, hx), cross(p, hy), cross(p, hz)
        inertia.ixx[k], inertia.iyy[k], inertia.izz[k] = ixx + a[0] + x[0], iyy + b[1] + y[1], izz + d[2] + z[2]
        inertia.ixy[k], inertia.ixz[k], inertia.iyz[k] = ixy + a[1] + y[0], ixz + a[2] + z[0], iyz + b[2] + z[1]
        inertia.hxx[k], inertia.hxy[k], inertia.hxz[k] = hx
        inertia.hyx[k], inertia.hyy[k], inertia.hyz[k] = hy
        inertia.hzx[k], inertia.hzy[k], inertia.hzz[k] = hz
        inertia.mxx[k], inertia.myy[k], inertia.mzz[k] = mxx, myy, mzz
        inertia.mxy[k], inertia.mxz[k], inertia.myz[k] = mxy, mxz, myz
        # The root mean square distance from the origin grows by no more than the translation.
        root = math.sqrt(inertia.polar[k]) + math.sqrt(inertia.mass[k] * dot(p, p))
        inertia.polar[k] = root * root


@exact
def place(px: float, py: float, pz: float, ca: float, sa: float, shift: float) -> Vector:
    """Origin of a link in the previous frame, shifted along the joint's axis."""
    return px, py - sa * shift, pz + ca * shift


@exact
def turned_back(c: float, s: float, ca: float, sa: float, a: Vector) -> Vector:
    """A vector rotated from a link's frame to the previous frame."""
    x, y = c * a[0] - s * a[1], s * a[0] + c * a[1]
    return x, ca * y - sa * a[2], sa * y + ca * a[2]


@exact
def turned_on(c: float, s: float, ca: float, sa: float, a: Vector) -> Vector:
    """A vector rotated from the previous frame to a link's frame."""
    y = ca * a[1] + sa * a[2]
    return c * a[0] + s * y, c * y - s * a[0], ca * a[2] - sa * a[1]


@exact
def wrench_on(link: Any, joint: Any, wrench: Any) -> None:
    """Transform a wrench from the previous frame to a link's frame."""
    ca, sa, px, py, pz, slide = link.rzz, link.rzy, link.px, link.py, link.pz, link.slide
    for k in range(len(wrench.fx)):
        c, s, p = joint.cos[k], joint.sin[k], place(px, py, pz, ca, sa, slide * joint.q[k])
        force, moment = (wrench.fx[k], wrench.fy[k], wrench.fz[k]), (wrench.nx[k], wrench.ny[k], wrench.nz[k])
        moment = plus(moment, cross(force, p))
        wrench.fx[k], wrench.fy[k], wrench.fz[k] = turned_on(c, s, ca, sa, force)
        wrench.nx[k], wrench.ny[k], wrench.nz[k] = turned_on(c, s, ca, sa, moment)


@exact
def accelerate(links: Any, joints: Any, responses: Any, change: Any) -> None:
    """Compute the accelerations from base to tip; ``change`` is zero at first."""
    for i in range(len(responses)):
        accelerate_link(links[i], joints[i], responses[i], change)


@exact
def accelerate_link(link: Any, joint: Any, response: Any, change: Any) -> None:
    """Acceleration of a joint and of its link from that of the previous link."""
    ca, sa, px, py, pz, turn, slide = link.rzz, link.rzy, link.px, link.py, link.pz, link.turn, link.slide
    for k in range(len(change.dx)):
        c, s, p = joint.cos[k], joint.sin[k], place(px, py, pz, ca, sa, slide * joint.q[k])
        d, a = (change.dx[k], change.dy[k], change.dz[k]), (change.ax[k], change.ay[k], change.az[k])
        a = turned_on(c, s, ca, sa, plus(a, cross(d, p)))
        d = turned_on(c, s, ca, sa, d)
        moment = dot((response.nx[k], response.ny[k], response.nz[k]), d)
        force = dot((response.fx[k], response.fy[k], response.fz[k]), a)
        qdd = response.qdd[k] - response.mobility[k] * (moment + force)
        response.qdd[k] = qdd
        change.dx[k], change.dy[k], change.dz[k] = d[0], d[1], d[2] + turn * qdd
        change.ax[k], change.ay[k], change.az[k] = a[0], a[1], a[2] + slide * qdd
