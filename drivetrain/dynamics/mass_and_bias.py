"""Mass matrix and bias of one sample, compiled: for simulations, which know the next sample only after this one.

All six-vectors stand at the base's origin, along the axes of the base. So wrenches and bodies of links add up as they
are, no pass turns or shifts them, and an entry of the matrix is one scalar product of a screw and a wrench.
Rotors that move on their own (behind a spring) have a coordinate of their own after the joints: a stand-in joint at the
end of the chain that moves nothing and weighs nothing, see ``packed.py``.

Reference: Modern Robotics, section 8.3, exercise 8.13; Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

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
    WIDTH,
)  # fmt: skip
from drivetrain.jit import law

# Columns of a link's row of work: rotation, origin, screw, velocity, acceleration without the joints' own, body (mass,
# first moment, second moments xx yy zz xy xz yz), wrench.
ROT, ORIGIN, SCREW, VELOCITY, ACCEL, BODY, WRENCH = 0, 9, 12, 18, 24, 30, 40
COLUMNS = 46
# What the loop over links calls once: its vectors then stay in registers, a tenth of the whole.
inlined = law(fastmath={"contract"}, forceinline=True)


class Places(NamedTuple):
    """Where ``mass_and_bias`` finds and leaves its numbers: indices into one block.

    Attributes:
        links: Number of joints; coordinates beyond are those of rotors on their own.
        total: Number of coordinates n.
        rotors: Number m of rotors that need a pass of their own.
        rows: Constants of links, stand-ins and rotors, as ``packed.Packed`` tells, (n + m, passes.WIDTH).
        spins: In the whole numbers: joint, carrier, and 1 if balanced, of those rotors, (m, 3).
        places, speeds: Positions and speeds [rad or m, and per s], (n,).
        work: Scratch, (links + m + 1, COLUMNS); the last row is the base's.
        mass: Takes the matrix [kg m^2, kg m or kg], (n, n).
        turned: Takes the part of its rows that motors feel before their gears, (n, n).
        bias: Takes the torques at constant speed [N m or N], (n,).
        turned_bias: Takes the part of them that motors feel before their gears, (n,).
    """

    links: int
    total: int
    rotors: int
    rows: int
    spins: int
    places: int
    speeds: int
    work: int
    mass: int
    turned: int
    bias: int
    turned_bias: int


def working_rows(links: int, rotors: int, rotation: Array, gravity: Array) -> Array:
    """Scratch for ``mass_and_bias``, its last row the base's.

    Args:
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
def _turn(n: Any, o: int, a: float, b: float, c: float) -> Vector:
    """A vector turned by the rotation of a row."""
    return (
        n[o] * a + n[o + 1] * b + n[o + 2] * c,
        n[o + 3] * a + n[o + 4] * b + n[o + 5] * c,
        n[o + 6] * a + n[o + 7] * b + n[o + 8] * c,
    )


@inlined
def _place(n: Any, K: int, angle: float, slide: float, before: int, o: int) -> None:
    """Rotation, origin and axis of a body that turns and slides on the one before."""
    c, s = math.cos(angle), math.sin(angle)
    r0, r1, r2, r3, r4 = n[K + R0], n[K + R0 + 1], n[K + R0 + 2], n[K + R0 + 3], n[K + R0 + 4]
    r5, r6, r7, r8 = n[K + R0 + 5], n[K + R0 + 6], n[K + R0 + 7], n[K + R0 + 8]
    px, py, pz = n[K + PX], n[K + PY], n[K + PZ]
    for r in range(3):
        a, b, d = n[before + 3 * r], n[before + 3 * r + 1], n[before + 3 * r + 2]
        x = a * r0 + b * r3 + d * r6
        y = a * r1 + b * r4 + d * r7
        z = a * r2 + b * r5 + d * r8
        n[o + 3 * r] = c * x + s * y
        n[o + 3 * r + 1] = c * y - s * x
        n[o + 3 * r + 2] = z
        n[o + ORIGIN + r] = n[before + ORIGIN + r] + a * px + b * py + d * pz + z * slide


@inlined
def _body(n: Any, K: int, o: int) -> None:
    """Mass and moments of a body about the base's origin."""
    m = n[K + MASS]
    p = get(n, o + ORIGIN)
    xy, xz, yz = n[K + SXY], n[K + SXZ], n[K + SYZ]
    h = _turn(n, o, n[K + HX], n[K + HY], n[K + HZ])
    a = _turn(n, o, n[K + SXX], xy, xz)
    b = _turn(n, o, xy, n[K + SYY], yz)
    c = _turn(n, o, xz, yz, n[K + SZZ])
    x = _turn(n, o, a[0], b[0], c[0])
    y = _turn(n, o, a[1], b[1], c[1])
    z = _turn(n, o, a[2], b[2], c[2])
    g = (h[0] + m * p[0], h[1] + m * p[1], h[2] + m * p[2])
    n[o + BODY] = m
    put(n, o + BODY + 1, g)
    n[o + BODY + 4] = x[0] + p[0] * (h[0] + g[0])
    n[o + BODY + 5] = y[1] + p[1] * (h[1] + g[1])
    n[o + BODY + 6] = z[2] + p[2] * (h[2] + g[2])
    n[o + BODY + 7] = x[1] + p[0] * h[1] + g[0] * p[1]
    n[o + BODY + 8] = x[2] + p[0] * h[2] + g[0] * p[2]
    n[o + BODY + 9] = y[2] + p[1] * h[2] + g[1] * p[2]


@part
def _momentum(n: Any, o: int, w: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Moment and force part of a body's inertia times a six-vector."""
    b = o + BODY
    m, h = n[b], get(n, b + 1)
    xx, yy, zz = n[b + 4], n[b + 5], n[b + 6]
    xy, xz, yz = n[b + 7], n[b + 8], n[b + 9]
    hv, hw = cross(h, v), cross(h, w)
    moment = (
        (yy + zz) * w[0] - xy * w[1] - xz * w[2] + hv[0],
        (xx + zz) * w[1] - xy * w[0] - yz * w[2] + hv[1],
        (xx + yy) * w[2] - xz * w[0] - yz * w[1] + hv[2],
    )
    return moment, (m * v[0] - hw[0], m * v[1] - hw[1], m * v[2] - hw[2])


@inlined
def _motion(n: Any, o: int, before: int, turn: float, slide: float, speed: float) -> None:
    """Screw, velocity and velocity-made acceleration of a body from those of the one before."""
    z, p = (n[o + 2], n[o + 5], n[o + 8]), get(n, o + ORIGIN)
    sw = (turn * z[0], turn * z[1], turn * z[2])
    pz = cross(p, sw)
    sv = (pz[0] + slide * z[0], pz[1] + slide * z[1], pz[2] + slide * z[2])
    put(n, o + SCREW, sw)
    put(n, o + SCREW + 3, sv)
    w, v = get(n, before + VELOCITY), get(n, before + VELOCITY + 3)
    # The screw is carried along: its rate is velocity x screw, the joint's own part of which is none.
    ww, wv, vw = cross(w, sw), cross(w, sv), cross(v, sw)
    for j in range(3):
        n[o + VELOCITY + j] = w[j] + sw[j] * speed
        n[o + VELOCITY + 3 + j] = v[j] + sv[j] * speed
        n[o + ACCEL + j] = n[before + ACCEL + j] + ww[j] * speed
        n[o + ACCEL + 3 + j] = n[before + ACCEL + 3 + j] + (wv[j] + vw[j]) * speed


@inlined
def _bias(n: Any, o: int) -> None:
    """The wrench that a body's velocity and velocity-made acceleration ask for."""
    w, v = get(n, o + VELOCITY), get(n, o + VELOCITY + 3)
    m, f = _momentum(n, o, w, v)
    am, af = _momentum(n, o, get(n, o + ACCEL), get(n, o + ACCEL + 3))
    wm, vf, wf = cross(w, m), cross(v, f), cross(w, f)
    for j in range(3):
        n[o + WRENCH + j] = am[j] + wm[j] + vf[j]
        n[o + WRENCH + 3 + j] = af[j] + wf[j]


@part
def _power(n: Any, o: int, moment: Vector, force: Vector) -> float:
    """What a wrench does on a unit speed of a joint."""
    return dot(get(n, o + SCREW), moment) + dot(get(n, o + SCREW + 3), force)


# long kernel: three kinds of rotors, while their carriers are at hand
@part
def _rotors(at: Places, n: Any, words: Any) -> None:
    """Rotors of a pass of their own join carriers, matrix and bias; ``turned`` is the part that their motors feel."""
    total = at.total
    for r in range(at.rotors):
        joint, link, balanced = words[at.spins + 3 * r], words[at.spins + 3 * r + 1], words[at.spins + 3 * r + 2]
        K = at.rows + (total + r) * WIDTH
        carrier = at.work + (link if link >= 0 else at.links + at.rotors) * COLUMNS
        moment, force, own = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        speed = n[at.speeds + joint]
        if balanced:
            moment = _turn(n, carrier, n[K + PX], n[K + PY], n[K + PZ])
            couple = cross(get(n, carrier + VELOCITY), moment)
            own = dot(moment, get(n, carrier + ACCEL))
            if link >= 0:
                add(n, carrier + WRENCH, (couple[0] * speed, couple[1] * speed, couple[2] * speed))
        else:
            o = at.work + (at.links + r) * COLUMNS
            _place(n, K, n[K + TURN] * n[at.places + joint], 0.0, carrier, o)
            _motion(n, o, carrier, n[K + TURN], 0.0, speed)
            _body(n, K, o)
            _bias(n, o)
            moment, force = _momentum(n, o, get(n, o + SCREW), get(n, o + SCREW + 3))
            inertia = _power(n, o, moment, force)
            own = _power(n, o, get(n, o + WRENCH), get(n, o + WRENCH + 3))
            n[at.mass + joint * total + joint] += inertia
            n[at.turned + joint * total + joint] += inertia
            if link >= 0:
                for j in range(16):
                    n[carrier + BODY + j] += n[o + BODY + j]
        n[at.bias + joint] += own
        n[at.turned_bias + joint] += own
        for k in range(link + 1):
            entry = _power(n, at.work + k * COLUMNS, moment, force)
            n[at.turned + joint * total + k] += entry
            n[at.mass + joint * total + k] += entry
            n[at.mass + k * total + joint] += entry


@part
def _outwards(at: Places, n: Any) -> None:
    """Where links are, how they move, what their own bodies ask for, and rotors on their axes."""
    total = at.total
    for i in range(at.links):
        K, o = at.rows + i * WIDTH, at.work + i * COLUMNS
        before = o - COLUMNS if i else at.work + (at.links + at.rotors) * COLUMNS
        q, speed = n[at.places + i], n[at.speeds + i]
        _place(n, K, n[K + TURN] * q, n[K + SLIDE] * q, before, o)
        _motion(n, o, before, n[K + TURN], n[K + SLIDE], speed)
        _body(n, K, o)
        _bias(n, o)
        spin = n[K + SPIN]
        if spin != 0.0 and i:
            # A balanced rotor on the axis, carried by the link before.
            z = (spin * n[o + 2], spin * n[o + 5], spin * n[o + 8])
            couple = cross(get(n, before + VELOCITY), z)
            add(n, before + WRENCH, (couple[0] * speed, couple[1] * speed, couple[2] * speed))
            own = dot(z, get(n, before + ACCEL))
            n[at.turned_bias + i] = own
            n[at.bias + i] = own
            for k in range(i):
                entry = dot(z, get(n, at.work + k * COLUMNS + SCREW))
                n[at.turned + i * total + k] = entry
                n[at.mass + i * total + k] = entry
                n[at.mass + k * total + i] = entry


@part
def mass_and_bias(at: Places, n: Any, words: Any) -> None:
    """Fill mass matrix and bias.

    Args:
        n: All real numbers [SI]; the last row of work is as ``working_rows`` makes it.
    """
    total = at.total
    for i in range(total):
        n[at.bias + i] = 0.0
        n[at.turned_bias + i] = 0.0
        for k in range(total):
            n[at.mass + i * total + k] = 0.0
            n[at.turned + i * total + k] = 0.0
        own = n[at.rows + i * WIDTH + OWN]
        n[at.mass + i * total + i] = own
        n[at.turned + i * total + i] = own
    _outwards(at, n)
    if at.rotors:
        _rotors(at, n, words)
    for i in range(at.links - 1, -1, -1):
        o = at.work + i * COLUMNS
        n[at.bias + i] += _power(n, o, get(n, o + WRENCH), get(n, o + WRENCH + 3))
        moment, force = _momentum(n, o, get(n, o + SCREW), get(n, o + SCREW + 3))
        n[at.mass + i * total + i] += _power(n, o, moment, force)
        for k in range(i):
            entry = _power(n, at.work + k * COLUMNS, moment, force)
            n[at.mass + i * total + k] += entry
            n[at.mass + k * total + i] += entry
        if i:
            for j in range(16):
                n[o - COLUMNS + BODY + j] += n[o + BODY + j]
