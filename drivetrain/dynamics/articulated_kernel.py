"""The articulated-body recursion, compiled: accelerations in time that grows as n, rotors of any kind included.

A rotor that is geared to joint i and rides on link c makes two bodies share the coordinate i. To the quantity that the
accelerations make least (Gauss) it adds ``R qdd_i^2 / 2 + qdd_i (k . a_c + b)``, besides its own inertia and bias force
on its carrier. R is its inertia about the spin axis times the ratio squared, k its momentum for a unit speed of the
joint, b what its spin asks of the joint; balanced or not, only k, R and b differ. With c the link before the joint or
the one after it, k joins the vector that eliminates ``qdd_i``. A carrier further off leaves a number open between joint
and carrier: its ``k . a_c`` when the carrier is nearer to the base, ``qdd_i`` when it is further out. Open numbers are
carried along, as a border around the articulated inertia, until they are met. So work grows as
``n (6 + numbers open at once)^2``.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 7.3, for an arm without rotors.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.articulated_links import (
    ACCELERATION,
    AXX,
    AXY,
    AXZ,
    AYY,
    AYZ,
    AZZ,
    B0,
    BIAS,
    BODY,
    COLUMNS,
    CORIOLIS,
    CXX,
    CXY,
    CXZ,
    CYY,
    CYZ,
    CZZ,
    DIVISOR,
    ELIMINATOR,
    LOAD,
    ON_PARENT,
    ON_SELF,
    REST,
    ROT,
    ROTOR,
    STEP,
    outwards,
    spin_rotors,
)  # fmt: skip
from drivetrain.dynamics.compiled_vectors import add, cross, dot, get, part, put
from drivetrain.dynamics.passes import SLIDE, TURN
from drivetrain.jit import kernel

# Columns of a far rotor's row: its momentum k for a unit speed of its joint, what couples its open number with the
# acceleration of the link at hand, the linear term of that number, and at last its value.
COUPLED, LINEAR, VALUE, WIDTH = 6, 12, 13, 14

# What may be left of the inertia that a joint moves when the joints after it give way; rounding leaves 1e-15 of none.
SINGULAR = 1e-12
_GIVEN = ((nb.float64, 2), (nb.int64, 2), (nb.float64, 1), *[(nb.float64, 2)] * 4)


@part
def _apply(o: Array, x: Array, y: Array) -> None:
    """The articulated inertia of a row, times x."""
    a, b, c, d, e, f = x[0], x[1], x[2], x[3], x[4], x[5]
    y[0] = o[AXX] * a + o[AXY] * b + o[AXZ] * c + o[B0] * d + o[B0 + 1] * e + o[B0 + 2] * f
    y[1] = o[AXY] * a + o[AYY] * b + o[AYZ] * c + o[B0 + 3] * d + o[B0 + 4] * e + o[B0 + 5] * f
    y[2] = o[AXZ] * a + o[AYZ] * b + o[AZZ] * c + o[B0 + 6] * d + o[B0 + 7] * e + o[B0 + 8] * f
    y[3] = o[B0] * a + o[B0 + 3] * b + o[B0 + 6] * c + o[CXX] * d + o[CXY] * e + o[CXZ] * f
    y[4] = o[B0 + 1] * a + o[B0 + 4] * b + o[B0 + 7] * c + o[CXY] * d + o[CYY] * e + o[CYZ] * f
    y[5] = o[B0 + 2] * a + o[B0 + 5] * b + o[B0 + 8] * c + o[CXZ] * d + o[CYZ] * e + o[CZZ] * f


@part
def _join(o: Array, x: Array, y: Array, factor: float) -> None:
    """``factor (x y^T + y x^T)`` joins the articulated inertia of a row."""
    for j in range(3):
        o[AXX + j] += factor * 2.0 * x[j] * y[j]
        o[CXX + j] += factor * 2.0 * x[3 + j] * y[3 + j]
        for k in range(3):
            o[B0 + 3 * j + k] += factor * (x[j] * y[3 + k] + y[j] * x[3 + k])
    o[AXY] += factor * (x[0] * y[1] + y[0] * x[1])
    o[AXZ] += factor * (x[0] * y[2] + y[0] * x[2])
    o[AYZ] += factor * (x[1] * y[2] + y[1] * x[2])
    o[CXY] += factor * (x[3] * y[4] + y[3] * x[4])
    o[CXZ] += factor * (x[3] * y[5] + y[3] * x[5])
    o[CYZ] += factor * (x[4] * y[5] + y[4] * x[5])


@part
def _six(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@part
def _hand_on(o: Array, to: Array) -> None:
    """Articulated inertia, bias force and body sums of a link join those of the link before, shifted to its origin."""
    p = get(o, STEP)
    c0, c1, c2 = (o[CXX], o[CXY], o[CXZ]), (o[CXY], o[CYY], o[CYZ]), (o[CXZ], o[CYZ], o[CZZ])
    r0, r1, r2 = cross(p, get(o, B0)), cross(p, get(o, B0 + 3)), cross(p, get(o, B0 + 6))
    x0, x1, x2 = cross(p, c0), cross(p, c1), cross(p, c2)
    # Rows of B + [p] C; its column j is p x (column j of C), and C is symmetric.
    b0 = (o[B0] + x0[0], o[B0 + 1] + x1[0], o[B0 + 2] + x2[0])
    b1 = (o[B0 + 3] + x0[1], o[B0 + 4] + x1[1], o[B0 + 5] + x2[1])
    b2 = (o[B0 + 6] + x0[2], o[B0 + 7] + x1[2], o[B0 + 8] + x2[2])
    # A + [p] B^T + ([p] B'^T)^T; column j of [p] B^T is p x (row j of B).
    s0, s1, s2 = cross(p, b0), cross(p, b1), cross(p, b2)
    to[AXX] += o[AXX] + r0[0] + s0[0]
    to[AYY] += o[AYY] + r1[1] + s1[1]
    to[AZZ] += o[AZZ] + r2[2] + s2[2]
    to[AXY] += o[AXY] + r1[0] + s0[1]
    to[AXZ] += o[AXZ] + r2[0] + s0[2]
    to[AYZ] += o[AYZ] + r2[1] + s1[2]
    add(to, B0, b0)
    add(to, B0 + 3, b1)
    add(to, B0 + 6, b2)
    for j in range(6):
        to[CXX + j] += o[CXX + j]
    f = get(o, BIAS + 3)
    add(to, BIAS, get(o, BIAS))
    add(to, BIAS, cross(p, f))
    add(to, BIAS + 3, f)
    m, h = o[BODY], get(o, BODY + 1)
    to[BODY] += m
    add(to, BODY + 1, (h[0] + m * p[0], h[1] + m * p[1], h[2] + m * p[2]))
    to[BODY + 4] += o[BODY + 4] + 2.0 * dot(p, h) + m * dot(p, p)


@part
def _open(r: int, border: Array, corner: Array, live: Array, count: int) -> int:
    """Number r is open from here on, coupled with no other open one yet; how many are open then."""
    border[r, LINEAR] = 0.0
    live[count] = r
    for s in range(count + 1):
        corner[r, live[s]] = corner[live[s], r] = 0.0
    return count + 1


@part
def _close(r: int, live: Array, count: int) -> int:
    """Number r is open no more; how many are."""
    kept = 0
    for s in range(count):
        if live[s] != r:
            live[kept] = live[s]
            kept += 1
    return kept


@part
def _meet(
    o: Array, link: int, spins: Array, lists: Array, border: Array, corner: Array, live: Array, count: int
) -> int:
    """Numbers ``k . a`` of this link join its inertia and bias, those of joints nearer to the base open."""
    r = lists[0, link]
    while r >= 0:
        k = border[r]
        if spins[r, 0] > link:
            _join(o, k, k[COUPLED:], 1.0)
            _join(o, k, k, 0.5 * corner[r, r])
            for j in range(6):
                o[BIAS + j] += k[LINEAR] * k[j]
            count = _close(r, live, count)
            for s in range(count):
                for j in range(6):
                    border[live[s], COUPLED + j] += corner[r, live[s]] * k[j]
        else:
            k[COUPLED:LINEAR] = k[:COUPLED]
            count = _open(r, border, corner, live, count)
        r = lists[1, r]
    return count


@part
def _at_joint(
    o: Array, r: int, distal: bool, border: Array, corner: Array, live: Array, count: int, gains: Array
) -> int:
    """The number of this joint's own far rotor: it is the joint's acceleration, and ends here, or it opens."""
    if not distal:
        border[r, COUPLED:LINEAR] = 0.0
        gains[r] = 1.0
        return _open(r, border, corner, live, count)
    for j in range(6):
        o[ON_SELF + j] += border[r, COUPLED + j]
    o[ROTOR] += corner[r, r]
    o[LOAD] -= border[r, LINEAR]
    count = _close(r, live, count)
    for s in range(count):
        gains[live[s]] = corner[r, live[s]]
    return count


@part
def _hand_on_border(
    o: Array, drive: float, border: Array, corner: Array, live: Array, count: int, gains: Array
) -> None:
    """The elimination of a joint's acceleration reaches the open numbers; their couplings go to the link before."""
    u, p = o[ELIMINATOR:], get(o, STEP)
    for s in range(count):
        b, g = border[live[s]], gains[live[s]]
        b[LINEAR] += _six(b[COUPLED:], o[CORIOLIS:]) + g * drive
        for j in range(6):
            b[COUPLED + j] -= u[j] * g / o[DIVISOR]
        add(b, COUPLED, cross(p, get(b, COUPLED + 3)))
        for t in range(count):
            corner[live[s], live[t]] -= g * gains[live[t]] / o[DIVISOR]


# long kernel: the elimination of one joint, in the order of its derivation
@part
def _inwards(
    rows: Array, spins: Array, lists: Array, work: Array, border: Array, corner: Array, live: Array, gains: Array
) -> int:
    """Eliminate the joints' accelerations from the tip to the base; the first joint that moves no inertia, or -1.

    ``live[0]`` holds the open numbers, ``live[1 + i]`` those that joint i was coupled with, up to a -1.
    """
    axis, image, count = np.empty(6), np.empty(6), 0
    for i in range(len(work) - 1, -1, -1):
        K, o = rows[i], work[i]
        if len(spins):
            count = _meet(o, i, spins, lists, border, corner, live[0], count)
            for s in range(count):
                gains[i, live[0, s]] = 0.0
            r = lists[2, i]
            if r >= 0:
                count = _at_joint(o, r, spins[r, 1] > i, border, corner, live[0], count, gains[i])
        for j in range(3):
            axis[j], axis[3 + j] = K[TURN] * o[ROT + 3 * j + 2], K[SLIDE] * o[ROT + 3 * j + 2]
        _apply(o, axis, image)
        own = 2.0 * _six(o[ON_SELF:], axis)
        o[DIVISOR] = _six(axis, image) + o[ROTOR] + own
        moved = K[TURN] ** 2 * o[BODY + 4] + K[SLIDE] ** 2 * o[BODY] + abs(o[ROTOR]) + abs(own)
        if not o[DIVISOR] > SINGULAR * moved:
            return i
        for s in range(count):
            gains[i, live[0, s]] += _six(axis, border[live[0, s], COUPLED:])
            live[1 + i, s] = live[0, s]
        if len(spins):
            live[1 + i, count:] = -1
        o[REST] = o[LOAD] - _six(axis, o[BIAS:])
        for j in range(6):
            image[j] += o[ON_SELF + j]
            o[REST] -= image[j] * o[CORIOLIS + j]
            o[ELIMINATOR + j] = image[j] + o[ON_PARENT + j]
        if i == 0:
            break
        drive = o[REST] / o[DIVISOR]
        _apply(o, o[CORIOLIS:], image)
        for j in range(6):
            o[BIAS + j] += image[j] + o[ELIMINATOR + j] * drive
        if count:
            _hand_on_border(o, drive, border, corner, live[0], count, gains[i])
        _join(o, o[ELIMINATOR:], o[ELIMINATOR:], -0.5 / o[DIVISOR])
        _hand_on(o, work[i - 1])
    return -1


@part
def _accelerate(
    rows: Array, spins: Array, lists: Array, base: Array, work: Array, border: Array, live: Array, gains: Array,
    qdd: Array,
) -> None:  # fmt: skip
    """The accelerations, from the base to the tip."""
    for i in range(len(work)):
        K, o = rows[i], work[i]
        before = work[i - 1] if i else base
        angular, linear = get(before, ACCELERATION), get(before, ACCELERATION + 3)
        carried = cross(angular, get(o, STEP))
        put(o, ACCELERATION, angular)
        put(o, ACCELERATION + 3, (linear[0] + carried[0], linear[1] + carried[1], linear[2] + carried[2]))
        total = o[REST] - _six(o[ELIMINATOR:], o[ACCELERATION:])
        if len(spins):
            for s in range(len(spins)):
                r = live[1 + i, s]
                if r < 0:
                    break
                total -= gains[i, r] * border[r, VALUE]
        qdd[i] = total / o[DIVISOR]
        for j in range(3):
            z = o[ROT + 3 * j + 2] * qdd[i]
            o[ACCELERATION + j] += o[CORIOLIS + j] + K[TURN] * z
            o[ACCELERATION + 3 + j] += o[CORIOLIS + 3 + j] + K[SLIDE] * z
        if len(spins):
            if lists[2, i] >= 0 and spins[lists[2, i], 1] > i:
                border[lists[2, i], VALUE] = qdd[i]
            r = lists[0, i]
            while r >= 0:
                if spins[r, 0] > i:
                    border[r, VALUE] = _six(border[r], o[ACCELERATION:])
                r = lists[1, r]


@part
def _far(spins: Array, n: int) -> Array:
    """Rotors whose carrier is not next to their joint: the first at each link, the next there, that of each joint."""
    lists = np.full((3, max(n, len(spins))), -1)
    for r in range(len(spins)):
        joint, link = spins[r, 0], spins[r, 1]
        if link >= 0 and link != joint and link != joint - 1:
            lists[1, r] = lists[0, link]
            lists[0, link] = r
            lists[2, joint] = r
    return lists


@kernel
def _accelerations(
    rows: Array, spins: Array, gravity: Array, q: Array, qd: Array, tau: Array, tip: Array, qdd: Array
) -> tuple[int, int]:
    """Fill ``qdd``; sample and joint of the first that moves no inertia, or -1."""
    n, m = q.shape[1], len(spins)
    work, base, rotor = np.zeros((n, COLUMNS)), np.zeros(COLUMNS), np.zeros((1, COLUMNS))
    border, corner = np.zeros((m, WIDTH)), np.zeros((m, m))
    live, gains, lists = np.full((n + 1, m), -1), np.zeros((n, m)), _far(spins, n)
    base[ROT] = base[ROT + 4] = base[ROT + 8] = 1.0
    for j in range(3):
        base[ACCELERATION + 3 + j] = -gravity[j]
    for sample in range(len(q)):
        outwards(rows, q[sample], qd[sample], tau[sample], base, work)
        if m:
            spin_rotors(rows, spins, q[sample], qd[sample], base, work, border, rotor)
        if len(tip):
            last, wrench = work[n - 1], tip[sample if len(tip) > 1 else 0]
            for j in range(6):
                a, b, c = last[ROT + 3 * (j % 3)], last[ROT + 3 * (j % 3) + 1], last[ROT + 3 * (j % 3) + 2]
                at = 3 * (j // 3)
                last[BIAS + j] += a * wrench[at] + b * wrench[at + 1] + c * wrench[at + 2]
        joint = _inwards(rows, spins, lists, work, border, corner, live, gains)
        if joint >= 0:
            return sample, joint
        _accelerate(rows, spins, lists, base, work, border, live, gains, qdd[sample])
    return -1, -1


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The recursion, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        A function of ``rows, spins, gravity`` (as ``packed.Packed`` tells), ``q, qd, tau`` (N, n), ``tip`` (0, 1 or N
        wrenches on the environment in the last link's frame), and what it fills: ``qdd`` (N, n); all C order, SI
        units. It returns sample and joint of the first that moves no inertia, or -1 and -1.
    """
    given = [nb.types.Array(kind, ndim, "C", readonly=True) for kind, ndim in _GIVEN]
    _accelerations.compile(nb.types.UniTuple(nb.int64, 2)(*given, nb.types.Array(nb.float64, 2, "C")))
    _accelerations.disable_compile()
    return _accelerations
