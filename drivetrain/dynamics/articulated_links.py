"""One link, and one rotor, of the articulated-body recursion: pose, velocity, own inertia and bias force.

All six-vectors are (angular, linear) and stand at the origin of a link's own frame, but along the axes of the base: so
moving on to the next link is a shift, never a turn, and no lever is longer than a link. The constants are those of the
inverse dynamics (``packed.py``), so that both roads hold the same arm.
"""

from __future__ import annotations

import math

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

# Columns of a link's row of work: pose, motion, articulated inertia [[A, B], [B^T, C]], bias force, couplings, what
# eliminated the joint, acceleration.
ROT, STEP, OMEGA, SPEED, CORIOLIS = 0, 9, 12, 15, 18
AXX, AYY, AZZ, AXY, AXZ, AYZ = range(24, 30)
B0 = 30
CXX, CYY, CZZ, CXY, CXZ, CYZ = range(39, 45)
BIAS, ON_SELF, ON_PARENT, ELIMINATOR = 45, 51, 57, 63
ACCELERATION, DIVISOR, REST, ROTOR, LOAD, BODY, COLUMNS = 69, 75, 76, 77, 78, 79, 84


@part
def _turned(o: Array, at: int, a: Vector) -> Vector:
    """A vector turned by the matrix in nine columns of a row."""
    return (
        o[at] * a[0] + o[at + 1] * a[1] + o[at + 2] * a[2],
        o[at + 3] * a[0] + o[at + 4] * a[1] + o[at + 5] * a[2],
        o[at + 6] * a[0] + o[at + 7] * a[1] + o[at + 8] * a[2],
    )


@part
def _turn_frame(o: Array, at: int, K: Array, angle: float, out: Array) -> None:
    """Into ``out``: the matrix in ``o``, times the one in the constants, times a turn about z."""
    c, s = math.cos(angle), math.sin(angle)
    for r in range(3):
        a, b, d = o[at + 3 * r], o[at + 3 * r + 1], o[at + 3 * r + 2]
        x = a * K[R0] + b * K[R0 + 3] + d * K[R0 + 6]
        y = a * K[R0 + 1] + b * K[R0 + 4] + d * K[R0 + 7]
        out[ROT + 3 * r] = c * x + s * y
        out[ROT + 3 * r + 1] = c * y - s * x
        out[ROT + 3 * r + 2] = a * K[R0 + 2] + b * K[R0 + 5] + d * K[R0 + 8]


@part
def _turned_inertia(o: Array, K: Array) -> tuple[float, float, float, float, float, float]:
    """Inertia (xx, yy, zz, xy, xz, yz) of the body in the constants, about its frame's origin, turned with ``o``."""
    xx, yy, zz = K[SYY] + K[SZZ], K[SXX] + K[SZZ], K[SXX] + K[SYY]
    xy, xz, yz = -K[SXY], -K[SXZ], -K[SYZ]
    a = _turned(o, ROT, (xx, xy, xz))
    b = _turned(o, ROT, (xy, yy, yz))
    c = _turned(o, ROT, (xz, yz, zz))
    x = _turned(o, ROT, (a[0], b[0], c[0]))
    y = _turned(o, ROT, (a[1], b[1], c[1]))
    z = _turned(o, ROT, (a[2], b[2], c[2]))
    return x[0], y[1], z[2], x[1], x[2], y[2]


@part
def _times(t: tuple[float, float, float, float, float, float], a: Vector) -> Vector:
    return (
        t[0] * a[0] + t[3] * a[1] + t[4] * a[2],
        t[3] * a[0] + t[1] * a[1] + t[5] * a[2],
        t[4] * a[0] + t[5] * a[1] + t[2] * a[2],
    )


@part
def _add_body(o: Array, m: float, h: Vector, t: tuple[float, float, float, float, float, float]) -> None:
    """A body (mass, first moment, inertia about the origin) joins the articulated inertia and the plain sum of it."""
    for j in range(6):
        o[AXX + j] += t[j]
    for j in range(3):
        o[CXX + j] += m
    o[B0 + 1] -= h[2]
    o[B0 + 2] += h[1]
    o[B0 + 3] += h[2]
    o[B0 + 5] -= h[0]
    o[B0 + 6] -= h[1]
    o[B0 + 7] += h[0]
    o[BODY] += m
    add(o, BODY + 1, h)
    o[BODY + 4] += 0.5 * (t[0] + t[1] + t[2])


@part
def _add_bias(
    o: Array, m: float, h: Vector, t: tuple[float, float, float, float, float, float], w: Vector, v: Vector
) -> None:
    """The force that keeps a body's momentum turning along with its velocity (w, v)."""
    hv, hw = cross(h, v), cross(h, w)
    n = _times(t, w)
    n = (n[0] + hv[0], n[1] + hv[1], n[2] + hv[2])
    f = (m * v[0] - hw[0], m * v[1] - hw[1], m * v[2] - hw[2])
    wn, vf = cross(w, n), cross(v, f)
    add(o, BIAS, (wn[0] + vf[0], wn[1] + vf[1], wn[2] + vf[2]))
    add(o, BIAS + 3, cross(w, f))


# long kernel: a link's pose, velocity and own body are used while they are at hand
@part
def outwards(rows: Array, q: Array, qd: Array, tau: Array, base: Array, work: Array) -> None:
    """Where the links are, how they move, and what their own bodies ask for.

    Args:
        rows: Constants of the links and rotors, (n + m, passes.WIDTH) [SI].
        q, qd: Positions and speeds of the joints, (n,) [rad or m, and per s].
        tau: Torques of the joints, (n,) [N m or N].
        base: Row of work of the base, (COLUMNS,) [SI].
        work: Takes a row a link, (n, COLUMNS) [SI].
    """
    for i in range(len(work)):
        K, o = rows[i], work[i]
        before = work[i - 1] if i else base
        shift = K[SLIDE] * q[i]
        place = _turned(before, ROT, (K[PX] + K[R0 + 2] * shift, K[PY] + K[R0 + 5] * shift, K[PZ] + K[R0 + 8] * shift))
        _turn_frame(before, ROT, K, K[TURN] * q[i], o)
        put(o, STEP, place)
        z = (o[ROT + 2], o[ROT + 5], o[ROT + 8])
        turn, slide = K[TURN] * qd[i], K[SLIDE] * qd[i]
        w, v = get(before, OMEGA), get(before, SPEED)
        carried = cross(w, place)
        w = (w[0] + turn * z[0], w[1] + turn * z[1], w[2] + turn * z[2])
        v = (v[0] + carried[0] + slide * z[0], v[1] + carried[1] + slide * z[1], v[2] + carried[2] + slide * z[2])
        put(o, OMEGA, w)
        put(o, SPEED, v)
        wz, vz = cross(w, z), cross(v, z)
        put(o, CORIOLIS, (turn * wz[0], turn * wz[1], turn * wz[2]))
        linear = (slide * wz[0] + turn * vz[0], slide * wz[1] + turn * vz[1], slide * wz[2] + turn * vz[2])
        put(o, CORIOLIS + 3, linear)
        o[AXX:ELIMINATOR] = 0.0
        o[BODY:] = 0.0
        h, tensor = _turned(o, ROT, (K[HX], K[HY], K[HZ])), _turned_inertia(o, K)
        _add_body(o, K[MASS], h, tensor)
        _add_bias(o, K[MASS], h, tensor, w, v)
        o[ROTOR] = K[OWN]
        o[LOAD] = tau[i]
        if K[SPIN] != 0.0:
            # A balanced rotor on the axis, carried by the link before: it asks of that link spin (w x z qd + z qdd).
            put(o, ON_PARENT, (K[SPIN] * z[0], K[SPIN] * z[1], K[SPIN] * z[2]))
            if i:
                wz, spin = cross(get(before, OMEGA), z), K[SPIN] * qd[i]
                add(before, BIAS, (spin * wz[0], spin * wz[1], spin * wz[2]))


@part
def _spin_whole(
    K: Array, q: float, qd: float, carrier: Array, held: bool, joint: Array, rotor: Array, k: Array
) -> None:
    """An unbalanced rotor: a body of its own joins its carrier; k, and what else it asks of its joint."""
    _turn_frame(carrier, ROT, K, K[TURN] * q, rotor)
    p = _turned(carrier, ROT, (K[PX], K[PY], K[PZ]))
    z = (rotor[ROT + 2], rotor[ROT + 5], rotor[ROT + 8])
    m, h, t = K[MASS], _turned(rotor, ROT, (K[HX], K[HY], K[HZ])), _turned_inertia(rotor, K)
    # Second moments about the carrier's origin: those about the spin axis, shifted.
    ph, pp = 2.0 * dot(p, h), m * dot(p, p)
    xx = t[0] + ph - 2.0 * p[0] * h[0] + pp - m * p[0] * p[0]
    yy = t[1] + ph - 2.0 * p[1] * h[1] + pp - m * p[1] * p[1]
    zz = t[2] + ph - 2.0 * p[2] * h[2] + pp - m * p[2] * p[2]
    xy = t[3] - p[0] * h[1] - p[1] * h[0] - m * p[0] * p[1]
    xz = t[4] - p[0] * h[2] - p[2] * h[0] - m * p[0] * p[2]
    yz = t[5] - p[1] * h[2] - p[2] * h[1] - m * p[1] * p[2]
    t = (xx, yy, zz, xy, xz, yz)
    h = (h[0] + m * p[0], h[1] + m * p[1], h[2] + m * p[2])
    pz, turn = cross(p, z), K[TURN]
    # Momentum for a unit speed of the joint, and for the acceleration that its spin has by the carrier's turning.
    hpz, hz, tz = cross(h, pz), cross(h, z), _times(t, z)
    put(k, 0, (turn * (tz[0] + hpz[0]), turn * (tz[1] + hpz[1]), turn * (tz[2] + hpz[2])))
    put(k, 3, (turn * (m * pz[0] - hz[0]), turn * (m * pz[1] - hz[1]), turn * (m * pz[2] - hz[2])))
    joint[ROTOR] += turn * (dot(z, get(k, 0)) + dot(pz, get(k, 3)))
    w, v, spin = get(carrier, OMEGA), get(carrier, SPEED), turn * qd
    wz, vz, wpz = cross(w, z), cross(v, z), cross(w, pz)
    e = (spin * wz[0], spin * wz[1], spin * wz[2])
    d = (spin * (vz[0] + wpz[0]), spin * (vz[1] + wpz[1]), spin * (vz[2] + wpz[2]))
    n, f, hd, he = _times(t, e), (m * d[0], m * d[1], m * d[2]), cross(h, d), cross(h, e)
    rotor[BIAS : BIAS + 6] = 0.0
    put(rotor, BIAS, (n[0] + hd[0], n[1] + hd[1], n[2] + hd[2]))
    put(rotor, BIAS + 3, (f[0] - he[0], f[1] - he[1], f[2] - he[2]))
    _add_bias(
        rotor, m, h, t,
        (w[0] + spin * z[0], w[1] + spin * z[1], w[2] + spin * z[2]),
        (v[0] + spin * pz[0], v[1] + spin * pz[1], v[2] + spin * pz[2]),
    )  # fmt: skip
    joint[LOAD] -= turn * (dot(z, get(rotor, BIAS)) + dot(pz, get(rotor, BIAS + 3)))
    if held:
        _add_body(carrier, m, h, t)
        add(carrier, BIAS, get(rotor, BIAS))
        add(carrier, BIAS + 3, get(rotor, BIAS + 3))


# long kernel: one branch for each place a carrier can have
@part
def spin_rotors(
    rows: Array, spins: Array, q: Array, qd: Array, base: Array, work: Array, momentum: Array, scratch: Array
) -> None:
    """The rotors that are not folded into the links' rows: what they ask of carrier and joint, k where it belongs.

    Args:
        rows: Constants of the links and rotors, (n + m, passes.WIDTH) [SI].
        spins: Joint, carrier, and 1 if balanced, of the rotors, (m, 3).
        q, qd: Positions and speeds of the joints, (n,) [rad or m, and per s].
        base: Row of work of the base, (COLUMNS,) [SI].
        work: Rows of the links, (n, COLUMNS) [SI].
        momentum: Takes each rotor's for a unit speed of its joint, in its first six columns, (m, 6 or more) [SI].
        scratch: A row for the rotor at hand, (1, COLUMNS) [SI].
    """
    n = len(work)
    for r in range(len(spins)):
        joint, link, balanced = spins[r, 0], spins[r, 1], spins[r, 2]
        K, own, k = rows[n + r], work[joint], momentum[r]
        carrier = work[link] if link >= 0 else base
        if balanced:
            spin = _turned(carrier, ROT, (K[PX], K[PY], K[PZ]))
            put(k, 0, spin)
            k[3:6] = 0.0
            if link >= 0:
                wz = cross(get(carrier, OMEGA), spin)
                add(carrier, BIAS, (qd[joint] * wz[0], qd[joint] * wz[1], qd[joint] * wz[2]))
        else:
            _spin_whole(K, q[joint], qd[joint], carrier, link >= 0, own, scratch[0], k)
        angular, linear = get(k, 0), get(k, 3)
        if link == joint:
            add(own, ON_SELF, angular)
            add(own, ON_SELF + 3, linear)
        elif link == joint - 1:
            lever = cross(get(own, STEP), linear)
            add(own, ON_PARENT, (angular[0] - lever[0], angular[1] - lever[1], angular[2] - lever[2]))
            add(own, ON_PARENT + 3, linear)
        elif link < 0:
            own[LOAD] -= dot(angular, get(base, ACCELERATION)) + dot(linear, get(base, ACCELERATION + 3))
