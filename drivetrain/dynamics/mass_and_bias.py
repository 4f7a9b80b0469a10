"""Mass matrix and bias of one sample, compiled: for simulations, which know the next sample only after this one.

All six-vectors stand at the base's origin, along the axes of the base. So wrenches and bodies of links add up as they
are, no pass turns or shifts them, and an entry of the matrix is one scalar product of a screw and a wrench.
Rotors that move on their own (behind a spring) have a coordinate of their own after the joints: a stand-in joint at the
end of the chain that moves nothing and weighs nothing, see ``packed.py``.

Reference: Modern Robotics, section 8.3 and exercise 8.13; Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.
"""

from __future__ import annotations

import math

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.compiled_vectors import Vector, add, cross, dot, get, part, put
from drivetrain.dynamics.passes import (
    HX,
    HY,
    HZ,
    MASS,
    OWN,
    PX,
    PY,
    PZ,
    R0,
    SLIDE,
    SPIN,
    SXX,
    SXY,
    SXZ,
    SYY,
    SYZ,
    SZZ,
    TURN,
)  # fmt: skip

# Columns of a link's row of work: rotation, origin, screw, velocity, acceleration without the joints' own, body (mass,
# first moment, second moments xx yy zz xy xz yz), wrench.
ROT, ORIGIN, SCREW, VELOCITY, ACCEL, BODY, WRENCH = 0, 9, 12, 18, 24, 30, 40
COLUMNS = 46


def working_rows(links: int, rotors: int, rotation: Array, gravity: Array) -> Array:
    """Scratch for ``mass_and_bias``, its last row the base's.

    Args:
        links: Number of joints.
        rotors: Number of rotors that need a pass of their own.
        rotation: Of the frame of the first row's constants in the base [-], (3, 3).
        gravity: Acceleration of free fall in the base frame [m/s^2], (3,).

    Returns:
        (links + rotors + 1, COLUMNS); vectors in it have the axes of the base.
    """
    work = np.zeros((links + rotors + 1, COLUMNS))
    work[-1, ROT : ROT + 9] = np.ravel(rotation)
    work[-1, ACCEL + 3 : ACCEL + 6] = -np.asarray(gravity)
    return work


@part
def _turn(o: Array, a: float, b: float, c: float) -> Vector:
    """A vector turned by the rotation of a row."""
    return (
        o[0] * a + o[1] * b + o[2] * c,
        o[3] * a + o[4] * b + o[5] * c,
        o[6] * a + o[7] * b + o[8] * c,
    )


@part
def _place(K: Array, angle: float, slide: float, before: Array, o: Array) -> None:
    """Rotation, origin and axis of a body that turns and slides on the one before."""
    c, s = math.cos(angle), math.sin(angle)
    for r in range(3):
        a, b, d = before[3 * r], before[3 * r + 1], before[3 * r + 2]
        x = a * K[R0] + b * K[R0 + 3] + d * K[R0 + 6]
        y = a * K[R0 + 1] + b * K[R0 + 4] + d * K[R0 + 7]
        z = a * K[R0 + 2] + b * K[R0 + 5] + d * K[R0 + 8]
        o[3 * r] = c * x + s * y
        o[3 * r + 1] = c * y - s * x
        o[3 * r + 2] = z
        o[ORIGIN + r] = before[ORIGIN + r] + a * K[PX] + b * K[PY] + d * K[PZ] + z * slide


@part
def _body(K: Array, o: Array) -> None:
    """Mass and moments of a body about the base's origin."""
    m = K[MASS]
    p = get(o, ORIGIN)
    h = _turn(o, K[HX], K[HY], K[HZ])
    a = _turn(o, K[SXX], K[SXY], K[SXZ])
    b = _turn(o, K[SXY], K[SYY], K[SYZ])
    c = _turn(o, K[SXZ], K[SYZ], K[SZZ])
    x = _turn(o, a[0], b[0], c[0])
    y = _turn(o, a[1], b[1], c[1])
    z = _turn(o, a[2], b[2], c[2])
    g = (h[0] + m * p[0], h[1] + m * p[1], h[2] + m * p[2])
    o[BODY] = m
    put(o, BODY + 1, g)
    o[BODY + 4] = x[0] + p[0] * (h[0] + g[0])
    o[BODY + 5] = y[1] + p[1] * (h[1] + g[1])
    o[BODY + 6] = z[2] + p[2] * (h[2] + g[2])
    o[BODY + 7] = x[1] + p[0] * h[1] + g[0] * p[1]
    o[BODY + 8] = x[2] + p[0] * h[2] + g[0] * p[2]
    o[BODY + 9] = y[2] + p[1] * h[2] + g[1] * p[2]


@part
def _momentum(o: Array, w: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Moment and force part of a body's inertia times a six-vector."""
    m, h = o[BODY], get(o, BODY + 1)
    xx, yy, zz = o[BODY + 4], o[BODY + 5], o[BODY + 6]
    xy, xz, yz = o[BODY + 7], o[BODY + 8], o[BODY + 9]
    hv, hw = cross(h, v), cross(h, w)
    moment = (
        (yy + zz) * w[0] - xy * w[1] - xz * w[2] + hv[0],
        (xx + zz) * w[1] - xy * w[0] - yz * w[2] + hv[1],
        (xx + yy) * w[2] - xz * w[0] - yz * w[1] + hv[2],
    )
    return moment, (m * v[0] - hw[0], m * v[1] - hw[1], m * v[2] - hw[2])


@part
def _motion(o: Array, before: Array, turn: float, slide: float, speed: float) -> None:
    """Screw, velocity and velocity-made acceleration of a body from those of the one before."""
    z, p = (o[2], o[5], o[8]), get(o, ORIGIN)
    sw = (turn * z[0], turn * z[1], turn * z[2])
    pz = cross(p, sw)
    sv = (pz[0] + slide * z[0], pz[1] + slide * z[1], pz[2] + slide * z[2])
    put(o, SCREW, sw)
    put(o, SCREW + 3, sv)
    w, v = get(before, VELOCITY), get(before, VELOCITY + 3)
    # The screw is carried along: its rate is velocity x screw, the joint's own part of which is none.
    ww, wv, vw = cross(w, sw), cross(w, sv), cross(v, sw)
    for j in range(3):
        o[VELOCITY + j] = w[j] + sw[j] * speed
        o[VELOCITY + 3 + j] = v[j] + sv[j] * speed
        o[ACCEL + j] = before[ACCEL + j] + ww[j] * speed
        o[ACCEL + 3 + j] = before[ACCEL + 3 + j] + (wv[j] + vw[j]) * speed


@part
def _bias(o: Array) -> None:
    """The wrench that a body's velocity and velocity-made acceleration ask for."""
    w, v = get(o, VELOCITY), get(o, VELOCITY + 3)
    n, f = _momentum(o, w, v)
    an, af = _momentum(o, get(o, ACCEL), get(o, ACCEL + 3))
    wn, vf, wf = cross(w, n), cross(v, f), cross(w, f)
    for j in range(3):
        o[WRENCH + j] = an[j] + wn[j] + vf[j]
        o[WRENCH + 3 + j] = af[j] + wf[j]


@part
def _power(screw: Array, moment: Vector, force: Vector) -> float:
    """What a wrench does on a unit speed of a joint."""
    return dot(get(screw, SCREW), moment) + dot(get(screw, SCREW + 3), force)


# long kernel: three kinds of rotors, while their carriers are at hand
@part
def _rotors(
    links: int, rows: Array, spins: Array, q: Array, qd: Array, base: Array, work: Array, mass: Array, turned: Array,
    bias: Array, turned_bias: Array,
) -> None:  # fmt: skip
    """Rotors of a pass of their own join carriers, matrix and bias; ``turned`` is the part that their motors feel."""
    total = len(bias)
    for r in range(len(spins)):
        joint, link, K = spins[r, 0], spins[r, 1], rows[total + r]
        carrier = work[link] if link >= 0 else base
        moment, force, own = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        if spins[r, 2]:
            moment = _turn(carrier, K[PX], K[PY], K[PZ])
            w = get(carrier, VELOCITY)
            couple = cross(w, moment)
            own = dot(moment, get(carrier, ACCEL))
            if link >= 0:
                for j in range(3):
                    carrier[WRENCH + j] += couple[j] * qd[joint]
        else:
            o = work[links + r]
            _place(K, K[TURN] * q[joint], 0.0, carrier, o)
            _motion(o, carrier, K[TURN], 0.0, qd[joint])
            _body(K, o)
            _bias(o)
            moment, force = _momentum(o, get(o, SCREW), get(o, SCREW + 3))
            inertia = _power(o, moment, force)
            own = _power(o, get(o, WRENCH), get(o, WRENCH + 3))
            mass[joint, joint] += inertia
            turned[joint, joint] += inertia
            if link >= 0:
                for j in range(10):
                    carrier[BODY + j] += o[BODY + j]
                for j in range(6):
                    carrier[WRENCH + j] += o[WRENCH + j]
        bias[joint] += own
        turned_bias[joint] += own
        for k in range(link + 1):
            entry = _power(work[k], moment, force)
            turned[joint, k] += entry
            mass[joint, k] += entry
            mass[k, joint] += entry


# long kernel: one pass out and one back, while a link's numbers are at hand
@part
def mass_and_bias(
    links: int, rows: Array, spins: Array, q: Array, qd: Array, work: Array, mass: Array, turned: Array, bias: Array,
    turned_bias: Array,
) -> None:  # fmt: skip
    """Fill mass matrix and bias.

    Args:
        links: Number of joints; coordinates beyond are those of rotors on their own.
        rows: Constants of links, stand-ins and rotors, as ``packed.Packed`` tells [SI].
        spins: Joint, carrier, and 1 if balanced, of the rotors that need a pass of their own, (m, 3).
        q, qd: Positions and speeds [rad or m, and per s], (n,).
        work: From ``working_rows``, (links + m + 1, COLUMNS).
        mass: Takes the matrix [kg m^2, kg m or kg], (n, n).
        turned: Takes the part of its rows that motors feel before their gears, (n, n).
        bias: Takes the torques at constant speed [N m or N], (n,).
        turned_bias: Takes the part of them that motors feel before their gears, (n,).
    """
    total, base = len(bias), work[len(work) - 1]
    for i in range(total):
        bias[i] = 0.0
        turned_bias[i] = 0.0
        for k in range(total):
            mass[i, k] = 0.0
            turned[i, k] = 0.0
        mass[i, i] = turned[i, i] = rows[i, OWN]
    for i in range(links):
        K, o = rows[i], work[i]
        before = work[i - 1] if i else base
        _place(K, K[TURN] * q[i], K[SLIDE] * q[i], before, o)
        _motion(o, before, K[TURN], K[SLIDE], qd[i])
        _body(K, o)
        _bias(o)
        if K[SPIN] != 0.0 and i:
            # A balanced rotor on the axis, carried by the link before.
            z = (K[SPIN] * o[2], K[SPIN] * o[5], K[SPIN] * o[8])
            couple = cross(get(before, VELOCITY), z)
            for j in range(3):
                before[WRENCH + j] += couple[j] * qd[i]
            turned_bias[i] = dot(z, get(before, ACCEL))
            bias[i] = turned_bias[i]
            for k in range(i):
                entry = dot(z, get(work[k], SCREW))
                turned[i, k] = mass[i, k] = entry
                mass[k, i] = entry
    if len(spins):
        _rotors(links, rows, spins, q, qd, base, work, mass, turned, bias, turned_bias)
    for i in range(links - 1, -1, -1):
        o = work[i]
        bias[i] += _power(o, get(o, WRENCH), get(o, WRENCH + 3))
        moment, force = _momentum(o, get(o, SCREW), get(o, SCREW + 3))
        mass[i, i] += _power(o, moment, force)
        for k in range(i):
            entry = _power(work[k], moment, force)
            mass[i, k] += entry
            mass[k, i] += entry
        if i:
            before = work[i - 1]
            for j in range(16):
                before[BODY + j] += o[BODY + j]
