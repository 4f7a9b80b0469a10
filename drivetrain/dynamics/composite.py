"""The mass matrix by composite bodies, compiled, over blocks of 64 samples.

Column j holds the torques of a unit acceleration of joint j from rest: all links from j on move as one body, so the
wrench that joint j must pass on comes from that composite body alone, and every joint before j feels the same wrench.
Composite bodies are summed from the tip to the base; no pass outwards is needed. A rotor couples its joint with every
joint up to its carrier, by the momentum that a unit rate of its joint gives it.

Reference: Modern Robotics, exercise 8.13; M. W. Walker and D. E. Orin, Efficient dynamic computer simulation of
    robotic mechanisms, Journal of Dynamic Systems, Measurement and Control 104 (1982) 205-211.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba as nb
import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.blocks import BLOCK, FAR, fast, read, sincos, sum_of_squares
from drivetrain.dynamics.passes import (
    CA,
    MASS,
    OFFSET,
    OWN,
    PX,
    PY,
    PZ,
    R0,
    SA,
    SLIDE,
    SPIN,
    SXX,
    SYY,
    TURN,
)
from drivetrain.jit import kernel

BODY = 10 * BLOCK  # mass, first moments (3), second moments (xx, yy, zz, xy, xz, yz)
WRENCH = 6 * BLOCK  # force, moment


@fast
def _add_constant_body(row: Array, body: Array) -> None:
    """A body whose frame is the record's own joins it."""
    for field in range(10):
        for k in range(BLOCK):
            body[field * BLOCK + k] += row[MASS + field]


@fast
def _nine(place: Array) -> tuple[float, ...]:
    return (place[0], place[1], place[2], place[3], place[4], place[5], place[6], place[7], place[8])


@fast
def _turn_of_place(simple: bool, row: Array, place: Array) -> None:
    """The rotation from a body's frame to the one before with the angles of ``cs`` at zero, row by row."""
    if not simple:
        for j in range(9):
            place[j] = row[R0 + j]
        return
    place[:] = 0.0  # the offset of a simple joint is counted in its angle
    place[0] = 1.0
    place[4], place[5] = row[CA], -row[SA]
    place[7], place[8] = row[SA], row[CA]


@fast
def _unit_wrench(row: Array, body: Array, wrench: Array) -> None:
    """The wrench that moves a body at rest with the acceleration of a unit acceleration of its joint."""
    turn, slide = row[TURN], row[SLIDE]
    for k in range(BLOCK):
        hx, hy = body[BLOCK + k], body[2 * BLOCK + k]
        wrench[k] = -turn * hy
        wrench[BLOCK + k] = turn * hx
        wrench[2 * BLOCK + k] = slide * body[k]
        wrench[3 * BLOCK + k] = slide * hy - turn * body[8 * BLOCK + k]
        wrench[4 * BLOCK + k] = -slide * hx - turn * body[9 * BLOCK + k]
        wrench[5 * BLOCK + k] = turn * (body[4 * BLOCK + k] + body[5 * BLOCK + k])


@fast
def _add_torque(row: Array, factor: float, wrench: Array, entry: Array) -> None:
    """The torque of a wrench on a joint joins an entry of the matrix."""
    turn, slide = factor * row[TURN], factor * row[SLIDE]
    for k in range(BLOCK):
        entry[k] += turn * wrench[5 * BLOCK + k] + slide * wrench[2 * BLOCK + k]


@fast
def _wrench_back(row: Array, place: Array, cs: Array, q: Array, wrench: Array) -> None:
    """A wrench in a body's frame, as seen in the frame before."""
    px, py, pz, slide = row[PX], row[PY], row[PZ], row[SLIDE]
    rxx, rxy, rxz, ryx, ryy, ryz, rzx, rzy, rzz = _nine(place)
    for k in range(BLOCK):
        c, s, shift = cs[k], cs[BLOCK + k], slide * q[k]
        fz, nz = wrench[2 * BLOCK + k], wrench[5 * BLOCK + k]
        t = c * wrench[k] - s * wrench[BLOCK + k]
        r = s * wrench[k] + c * wrench[BLOCK + k]
        gx, gy, gz = rxx * t + rxy * r + rxz * fz, ryx * t + ryy * r + ryz * fz, rzx * t + rzy * r + rzz * fz
        t = c * wrench[3 * BLOCK + k] - s * wrench[4 * BLOCK + k]
        r = s * wrench[3 * BLOCK + k] + c * wrench[4 * BLOCK + k]
        x, y, z = px + rxz * shift, py + ryz * shift, pz + rzz * shift
        wrench[k] = gx
        wrench[BLOCK + k] = gy
        wrench[2 * BLOCK + k] = gz
        wrench[3 * BLOCK + k] = rxx * t + rxy * r + rxz * nz + y * gz - z * gy
        wrench[4 * BLOCK + k] = ryx * t + ryy * r + ryz * nz + z * gx - x * gz
        wrench[5 * BLOCK + k] = rzx * t + rzy * r + rzz * nz + x * gy - y * gx


@fast
def _turn_body(cs: Array, body: Array) -> None:
    """A body turned about z by the angle of its joint."""
    for k in range(BLOCK):
        c, s = cs[k], cs[BLOCK + k]
        hx, hy = body[BLOCK + k], body[2 * BLOCK + k]
        xx, yy, xy = body[4 * BLOCK + k], body[5 * BLOCK + k], body[7 * BLOCK + k]
        xz, yz = body[8 * BLOCK + k], body[9 * BLOCK + k]
        cc, sc, ss = c * c, s * c, s * s
        body[BLOCK + k] = c * hx - s * hy
        body[2 * BLOCK + k] = s * hx + c * hy
        body[4 * BLOCK + k] = cc * xx - 2.0 * sc * xy + ss * yy
        body[5 * BLOCK + k] = ss * xx + 2.0 * sc * xy + cc * yy
        body[7 * BLOCK + k] = sc * (xx - yy) + (cc - ss) * xy
        body[8 * BLOCK + k] = c * xz - s * yz
        body[9 * BLOCK + k] = s * xz + c * yz


# long kernel: ten numbers of a body turned and shifted in registers
@fast
def _place_body(row: Array, place: Array, q: Array, body: Array, total: Array) -> None:
    """A body turned by the constant rotation of its place, and shifted to it, joins the total."""
    px, py, pz, slide = row[PX], row[PY], row[PZ], row[SLIDE]
    rxx, rxy, rxz, ryx, ryy, ryz, rzx, rzy, rzz = _nine(place)
    for k in range(BLOCK):
        m, x, y, z = body[k], body[BLOCK + k], body[2 * BLOCK + k], body[3 * BLOCK + k]
        hx, hy, hz = rxx * x + rxy * y + rxz * z, ryx * x + ryy * y + ryz * z, rzx * x + rzy * y + rzz * z
        xx, yy, zz = body[4 * BLOCK + k], body[5 * BLOCK + k], body[6 * BLOCK + k]
        xy, xz, yz = body[7 * BLOCK + k], body[8 * BLOCK + k], body[9 * BLOCK + k]
        ax, ay, az = rxx * xx + rxy * xy + rxz * xz, rxx * xy + rxy * yy + rxz * yz, rxx * xz + rxy * yz + rxz * zz
        bx, by, bz = ryx * xx + ryy * xy + ryz * xz, ryx * xy + ryy * yy + ryz * yz, ryx * xz + ryy * yz + ryz * zz
        dx, dy, dz = rzx * xx + rzy * xy + rzz * xz, rzx * xy + rzy * yy + rzz * yz, rzx * xz + rzy * yz + rzz * zz
        shift = slide * q[k]
        x, y, z = px + rxz * shift, py + ryz * shift, pz + rzz * shift
        total[k] += m
        total[BLOCK + k] += hx + m * x
        total[2 * BLOCK + k] += hy + m * y
        total[3 * BLOCK + k] += hz + m * z
        total[4 * BLOCK + k] += ax * rxx + ay * rxy + az * rxz + x * (2.0 * hx + m * x)
        total[5 * BLOCK + k] += bx * ryx + by * ryy + bz * ryz + y * (2.0 * hy + m * y)
        total[6 * BLOCK + k] += dx * rzx + dy * rzy + dz * rzz + z * (2.0 * hz + m * z)
        total[7 * BLOCK + k] += ax * ryx + ay * ryy + az * ryz + hx * y + x * hy + m * x * y
        total[8 * BLOCK + k] += ax * rzx + ay * rzy + az * rzz + hx * z + x * hz + m * x * z
        total[9 * BLOCK + k] += bx * rzx + by * rzy + bz * rzz + hy * z + y * hz + m * y * z


@fast
def _momentum_wrench(row: Array, wrench: Array) -> None:
    """What a balanced rotor asks of its carrier for a unit acceleration of its joint: a couple."""
    for field in range(3):
        for k in range(BLOCK):
            wrench[field * BLOCK + k] = 0.0
            wrench[(3 + field) * BLOCK + k] = row[PX + field]


@fast
def _enter_rotors(
    rows: Array, spins: Array, n: int, link: int, x: Array, cs: Array, size: float, places: Array, part: Array,
    body: Array, wrenches: Array,
) -> None:  # fmt: skip
    """Rotors join their carrier: the wrench for a unit rate of their joint, and the body that is not yet counted."""
    for r in range(len(spins)):
        joint, row = spins[r, 0], rows[n + r]
        if spins[r, 1] != link:
            continue
        if spins[r, 2]:
            _momentum_wrench(row, wrenches[n + r])
            continue
        sincos(x, joint, row[TURN], 0.0, cs, n, size * row[TURN] ** 2 > FAR * FAR)
        part[:] = 0.0
        _add_constant_body(row, part)
        _unit_wrench(row, part, wrenches[n + r])
        _wrench_back(row, places[n + r], cs[n], x[joint], wrenches[n + r])
        _turn_body(cs[n], part)
        _place_body(row, places[n + r], x[joint], part, body)


@fast
def _fill_row(rows: Array, spins: Array, link: int, constants: Array, wrenches: Array, entries: Array) -> None:
    """The entries that the joint of a link makes with those after it, and with the rotors on it or beyond."""
    n = len(constants)
    for k in range(BLOCK):
        entries[link * n + link, k] += constants[link]
    for w in range(link, len(wrenches)):
        joint, factor = w, 1.0
        if w >= n:
            joint = spins[w - n, 0]
            if spins[w - n, 1] < link:
                continue
            factor = 2.0 if joint == link else 1.0
        _add_torque(rows[link], factor, wrenches[w], entries[max(joint, link) * n + min(joint, link)])


@fast
def _constants(simple: Array, rows: Array, spins: Array, places: Array, constants: Array) -> None:
    """The rotations of the places, and what rotors add to the diagonal whatever the angles."""
    n = len(simple)
    for i in range(len(rows)):
        _turn_of_place(i < n and simple[i], rows[i], places[i])
    for i in range(n):
        constants[i] = rows[i, OWN]
    for r in range(len(spins)):
        if not spins[r, 2]:
            row = rows[n + r]
            constants[spins[r, 0]] += row[TURN] * row[TURN] * (row[SXX] + row[SYY])


@fast
def _mirror(n: int, first: int, count: int, entries: Array, out: Array) -> None:
    """Both halves of the matrices, from the lower one."""
    for k in range(count):
        for i in range(n):
            for j in range(i + 1):
                out[first + k, i * n + j] = entries[i * n + j, k]
                out[first + k, j * n + i] = entries[i * n + j, k]


@kernel
def _compose(simple: Array, rows: Array, spins: Array, q: Array, out: Array) -> float:
    """Fill ``out``; NaN if the input is spoiled."""
    n, both = len(simple), len(rows)
    x, cs = np.zeros((n, 3 * BLOCK)), np.empty((n + 1, 2 * BLOCK))
    body, part, wrenches = np.empty(BODY), np.empty(BODY), np.empty((both, WRENCH))
    places, constants, entries = np.empty((both, 9)), np.empty(n), np.empty((n * n, BLOCK))
    _constants(simple, rows, spins, places, constants)
    bad, zero = 0.0, n - n  # numba would compile a callee again for each literal
    for first in range(0, len(q), BLOCK):
        count = min(BLOCK, len(q) - first)
        read(q, first, count, n, zero, x)
        size = sum_of_squares(x)
        bad += 0.0 * size
        for i in range(n):
            sincos(x, i, rows[i, TURN], rows[i, OFFSET], cs, i, size > FAR * FAR)
        entries[:] = 0.0
        body[:] = 0.0
        for i in range(n - 1, -1, -1):
            # The links beyond are in this link's frame already; the link itself, and what it carries, join them.
            _add_constant_body(rows[i], body)
            _enter_rotors(rows, spins, n, i, x, cs, size, places, part, body, wrenches)
            _unit_wrench(rows[i], body, wrenches[i])
            _fill_row(rows, spins, i, constants, wrenches, entries)
            # A balanced rotor on the axis, on the link before: its couple loads that link, and not this joint.
            for k in range(BLOCK):
                wrenches[i, 5 * BLOCK + k] += rows[i, SPIN]
            for w in range(i, both):
                if w < n or spins[w - n, 1] >= i:
                    _wrench_back(rows[i], places[i], cs[i], x[i], wrenches[w])
            _turn_body(cs[i], body)
            part[:] = body
            body[:] = 0.0
            _place_body(rows[i], places[i], x[i], part, body)
        _mirror(n, first, count, entries, out)
    return bad


@lru_cache(maxsize=1)
def compiled() -> Any:
    """The algorithm, compiled at the first call (some seconds) or taken from numba's disk cache.

    Returns:
        A function of ``simple, rows, spins`` (as ``packed.Packed`` tells), ``q`` (N, n) and what it fills, ``out``
        (N, n * n), exactly symmetric; all C order, SI units. It returns 0, or NaN when ``q`` holds a NaN, an infinity,
        or a number beyond 1e154.
    """
    kinds = ((nb.bool_, 1), (nb.float64, 2), (nb.int64, 2), (nb.float64, 2))
    given = [nb.types.Array(kind, ndim, "C", readonly=True) for kind, ndim in kinds]
    # One signature, so that read-only arrays do not have it compiled again.
    _compose.compile(nb.float64(*given, nb.types.Array(nb.float64, 2, "C")))
    _compose.disable_compile()
    return _compose
