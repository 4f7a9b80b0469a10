"""The arithmetic of one joint over a block of samples, outwards (motion, wrench) and back inwards (torque).

Frames: link i has its origin on joint axis i and z along it; the axes of a frame and the next are so chosen
(``packed.py``) that a revolute joint is a constant shift and ``Rx(alpha) Rz(q + offset)``, which turns a vector in
eight operations and needs no matrix.
Bodies: their moments use ``W = [dw] + [w][w]``, the matrix that gives the acceleration of a point from its place, and
the second moments of mass ``S = integral r r^T dm``: force ``m a + W h``, moment ``h x a + axial(W S)``.
Records: of every link the motion (angular velocity w, its rate dw, acceleration a of the origin less gravity), the
wrench through its joint (force, moment), and dw of the link before along the joint axis.
"""

from __future__ import annotations

from drivetrain.arrays import Array
from drivetrain.dynamics.blocks import BLOCK, fast

CHANNELS = 16 * BLOCK  # of a record: w, dw, a, force, moment (3 each), axial dw

# Columns of a row of constants: Rx(alpha), place, offset, body, spin and own inertia of the rotor, motion for a unit of
# q, turn of the joint's own frame, whole rotation (R0 to the end). The row of a balanced rotor that does not lie along
# its joint holds its angular momentum in PX to PZ.
CA, SA, PX, PY, PZ, OFFSET, MASS, HX, HY, HZ, SXX, SYY, SZZ, SXY, SXZ, SYZ = range(16)
SPIN, OWN, TURN, SLIDE, CD, SD, R0 = range(16, 23)
WIDTH = R0 + 9


@fast
def _keep(
    o: Array, k: int, wx: float, wy: float, wz: float, dx: float, dy: float, dz: float, ax: float, ay: float, az: float
) -> None:
    """Put the motion of one sample into a record."""
    o[k] = wx
    o[BLOCK + k] = wy
    o[2 * BLOCK + k] = wz
    o[3 * BLOCK + k] = dx
    o[4 * BLOCK + k] = dy
    o[5 * BLOCK + k] = dz
    o[6 * BLOCK + k] = ax
    o[7 * BLOCK + k] = ay
    o[8 * BLOCK + k] = az


@fast
def _keep_wrench(
    o: Array,
    k: int,
    body: tuple[float, ...],
    wx: float,
    wy: float,
    wz: float,
    dx: float,
    dy: float,
    dz: float,
    ax: float,
    ay: float,
    az: float,
    cx: float,
    cy: float,
) -> None:
    """Put the wrench that moves a body (its ten numbers), and a couple across the axis, into a record."""
    m, hx, hy, hz, sxx, syy, szz, sxy, sxz, syz = body
    xx, yy, zz = wx * wx, wy * wy, wz * wz
    xy, yx = wx * wy - dz, wx * wy + dz
    xz, zx = wx * wz + dy, wx * wz - dy
    yz, zy = wy * wz - dx, wy * wz + dx
    o[9 * BLOCK + k] = m * ax - (yy + zz) * hx + xy * hy + xz * hz
    o[10 * BLOCK + k] = m * ay + yx * hx - (xx + zz) * hy + yz * hz
    o[11 * BLOCK + k] = m * az + zx * hx + zy * hy - (xx + yy) * hz
    o[12 * BLOCK + k] = zx * sxy + zy * syy - yx * sxz - yz * szz + (zz - yy) * syz + hy * az - hz * ay + cx
    o[13 * BLOCK + k] = xy * syz + xz * szz - zx * sxx - zy * sxy + (xx - zz) * sxz + hz * ax - hx * az + cy
    o[14 * BLOCK + k] = yx * sxx + yz * sxz - xy * syy - xz * syz + (yy - xx) * sxy + hx * ay - hy * ax


@fast
def first_revolute(rows: Array, x: Array, cs: Array, base: Array, record: Array) -> None:
    """Motion and own wrench of link 0, on a base at rest whose frame is link 0's with the joint at zero.

    Args:
        rows: Constants of the links and rotors, (n + m, WIDTH) [SI].
        x: q, qd, qdd of the joints, (n, 3 BLOCK) [rad or m, and per s, s^2].
        cs: Cosines and sines of the joints' angles, torques of their rotors, (n + 1, 3 BLOCK) [-, N m].
        base: Records, the first that of the base [SI].
        record: Records, the first that of link 0 [SI].
    """
    K, X, C, o, u = rows[0], x[0], cs[0], record[0], base[0]
    m, hx, hy, hz = K[MASS], K[HX], K[HY], K[HZ]
    sxx, syy, sxz, syz, own = K[SXX], K[SYY], K[SXZ], K[SYZ], K[OWN]
    gx, gy, gz = u[6 * BLOCK], u[7 * BLOCK], u[8 * BLOCK]
    for k in range(BLOCK):
        c, s, v, vd = C[k], C[BLOCK + k], X[BLOCK + k], X[2 * BLOCK + k]
        ax = c * gx + s * gy
        ay = c * gy - s * gx
        vv = v * v
        o[k] = 0.0
        o[BLOCK + k] = 0.0
        o[2 * BLOCK + k] = v
        o[3 * BLOCK + k] = 0.0
        o[4 * BLOCK + k] = 0.0
        o[5 * BLOCK + k] = vd
        o[6 * BLOCK + k] = ax
        o[7 * BLOCK + k] = ay
        o[8 * BLOCK + k] = gz
        o[9 * BLOCK + k] = m * ax - vd * hy - vv * hx
        o[10 * BLOCK + k] = m * ay + vd * hx - vv * hy
        o[11 * BLOCK + k] = m * gz
        o[12 * BLOCK + k] = vv * syz - vd * sxz + hy * gz - hz * ay
        o[13 * BLOCK + k] = hz * ax - hx * gz - vd * syz - vv * sxz
        o[14 * BLOCK + k] = vd * (sxx + syy) + hx * ay - hy * ax
        o[15 * BLOCK + k] = 0.0
        C[2 * BLOCK + k] = own * vd


# long kernel: one pass keeps a sample's twist, acceleration and wrench in registers
@fast
def revolute(i: int, rows: Array, x: Array, cs: Array, before: Array, after: Array) -> None:
    """Motion of link i from that of the link before, its own wrench, and the couple of a rotor along the axis.

    Args:
        rows: Constants of the links and rotors, (n + m, WIDTH) [SI].
        x: q, qd, qdd of the joints, (n, 3 BLOCK) [rad or m, and per s, s^2].
        cs: Cosines and sines of the joints' angles, torques of their rotors, (n + 1, 3 BLOCK) [-, N m].
        before: Records, among them that of the link before, (k, CHANNELS) [SI].
        after: Records, among them that of this body, (k, CHANNELS) [SI].
    """
    K, X, C, u, o = rows[i], x[i], cs[i], before[i >> 1], after[(i + 1) >> 1]
    ca, sa, px, py, pz = K[CA], K[SA], K[PX], K[PY], K[PZ]
    S = (K[MASS], K[HX], K[HY], K[HZ], K[SXX], K[SYY], K[SZZ], K[SXY], K[SXZ], K[SYZ])
    spin, own = K[SPIN], K[OWN]
    for k in range(BLOCK):
        c, s, v, vd = C[k], C[BLOCK + k], X[BLOCK + k], X[2 * BLOCK + k]
        wx, wy, wz = u[k], u[BLOCK + k], u[2 * BLOCK + k]
        dx, dy, dz = u[3 * BLOCK + k], u[4 * BLOCK + k], u[5 * BLOCK + k]
        # Acceleration of the joint's origin, in the frame before.
        ax = u[6 * BLOCK + k] - (wy * wy + wz * wz) * px + (wx * wy - dz) * py + (wx * wz + dy) * pz
        ay = u[7 * BLOCK + k] + (wx * wy + dz) * px - (wx * wx + wz * wz) * py + (wy * wz - dx) * pz
        az = u[8 * BLOCK + k] + (wx * wz - dy) * px + (wy * wz + dx) * py - (wx * wx + wy * wy) * pz
        # Into this link's frame; the joint's own rate joins.
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
        gz = axial + vd
        t = ca * ay + sa * az
        bz = ca * az - sa * ay
        bx = c * ax + s * t
        by = c * t - s * ax
        _keep(o, k, ex, ey, ez, gx, gy, gz, bx, by, bz)
        # A balanced rotor on the axis, carried by the link before, asks of it spin (v (w x z) + vd z). In this frame
        # that is spin (gyro_x, gyro_y, vd). It joins here, but for vd, which must not reach this joint's own torque.
        _keep_wrench(o, k, S, ex, ey, ez, gx, gy, gz, bx, by, bz, spin * gyro_x, spin * gyro_y)
        o[15 * BLOCK + k] = axial
        C[2 * BLOCK + k] = own * vd + spin * axial


@fast
def first_revolute_back(cs: Array, record: Array, torque: Array) -> None:
    """Torque of joint 0; nobody asks for the wrench on the base.

    Args:
        cs: Cosines and sines of the joints' angles, torques of their rotors, (n + 1, 3 BLOCK) [-, N m].
        record: Records, the first that of link 0 [SI].
        torque: Takes the torques of the joints, (n + 1, BLOCK) [N m or N].
    """
    C, o, tau = cs[0], record[0], torque[0]
    for k in range(BLOCK):
        tau[k] = o[14 * BLOCK + k] + C[2 * BLOCK + k]


# long kernel: as above
@fast
def revolute_back(i: int, rows: Array, x: Array, cs: Array, before: Array, after: Array, torque: Array) -> None:
    """Torque of joint i, and the wrench through it joins that of the link before.

    Args:
        rows: Constants of the links and rotors, (n + m, WIDTH) [SI].
        x: q, qd, qdd of the joints, (n, 3 BLOCK) [rad or m, and per s, s^2].
        cs: Cosines and sines of the joints' angles, torques of their rotors, (n + 1, 3 BLOCK) [-, N m].
        after: Records, among them that of this body, (k, CHANNELS) [SI].
        before: Records, among them that of the link before, (k, CHANNELS) [SI].
        torque: Takes the torques of the joints, (n + 1, BLOCK) [N m or N].
    """
    K, X, C, u, o, tau = rows[i], x[i], cs[i], before[i >> 1], after[(i + 1) >> 1], torque[i]
    ca, sa, px, py, pz, spin = K[CA], K[SA], K[PX], K[PY], K[PZ], K[SPIN]
    for k in range(BLOCK):
        c, s, vd = C[k], C[BLOCK + k], X[2 * BLOCK + k]
        fx, fy, fz = o[9 * BLOCK + k], o[10 * BLOCK + k], o[11 * BLOCK + k]
        nx, ny, nz = o[12 * BLOCK + k], o[13 * BLOCK + k], o[14 * BLOCK + k]
        tau[k] = nz + C[2 * BLOCK + k]
        nz += spin * vd
        gx = c * fx - s * fy
        t = s * fx + c * fy
        gy = ca * t - sa * fz
        gz = sa * t + ca * fz
        t = s * nx + c * ny
        u[9 * BLOCK + k] += gx
        u[10 * BLOCK + k] += gy
        u[11 * BLOCK + k] += gz
        u[12 * BLOCK + k] += c * nx - s * ny + py * gz - pz * gy
        u[13 * BLOCK + k] += ca * t - sa * nz + pz * gx - px * gz
        u[14 * BLOCK + k] += sa * t + ca * nz + px * gy - py * gx


# long kernel: any screw joint, and any rotor, in one pass
@fast
def screw(rows: Array, where: tuple[int, ...], x: Array, cs: Array, before: Array, after: Array) -> None:
    """As ``revolute``, for a body that turns by ``TURN * q`` about and slides by ``SLIDE * q`` along its z axis.

    Args:
        rows: Constants of the links and rotors, (n + m, WIDTH) [SI].
        x: q, qd, qdd of the joints, (n, 3 BLOCK) [rad or m, and per s, s^2].
        cs: Cosines and sines of the joints' angles, torques of their rotors, (n + 1, 3 BLOCK) [-, N m].
        before: Records, among them that of the carrier, (k, CHANNELS) [SI].
        after: Records, among them that of this body, (k, CHANNELS) [SI].
    """
    row, joint, turned, slot, to = where
    K, X, C, u, o = rows[row], x[joint], cs[turned], before[slot], after[to]
    px, py, pz, turn, slide, own = K[PX], K[PY], K[PZ], K[TURN], K[SLIDE], K[OWN]
    S = (K[MASS], K[HX], K[HY], K[HZ], K[SXX], K[SYY], K[SZZ], K[SXY], K[SXZ], K[SYZ])
    rxx, rxy, rxz, ryx, ryy, ryz = K[R0], K[R0 + 1], K[R0 + 2], K[R0 + 3], K[R0 + 4], K[R0 + 5]
    rzx, rzy, rzz = K[R0 + 6], K[R0 + 7], K[R0 + 8]
    for k in range(BLOCK):
        c, s = C[k], C[BLOCK + k]
        v, vd = turn * X[BLOCK + k], turn * X[2 * BLOCK + k]
        shift, speed, rise = slide * X[k], slide * X[BLOCK + k], slide * X[2 * BLOCK + k]
        wx, wy, wz = u[k], u[BLOCK + k], u[2 * BLOCK + k]
        dx, dy, dz = u[3 * BLOCK + k], u[4 * BLOCK + k], u[5 * BLOCK + k]
        qx, qy, qz = px + rxz * shift, py + ryz * shift, pz + rzz * shift
        ax = u[6 * BLOCK + k] - (wy * wy + wz * wz) * qx + (wx * wy - dz) * qy + (wx * wz + dy) * qz
        ay = u[7 * BLOCK + k] + (wx * wy + dz) * qx - (wx * wx + wz * wz) * qy + (wy * wz - dx) * qz
        az = u[8 * BLOCK + k] + (wx * wz - dy) * qx + (wy * wz + dx) * qy - (wx * wx + wy * wy) * qz
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
        gz = axial + vd
        t = rxx * ax + ryx * ay + rzx * az
        r = rxy * ax + ryy * ay + rzy * az
        bx = c * t + s * r + 2.0 * speed * ey
        by = c * r - s * t - 2.0 * speed * ex
        bz = rxz * ax + ryz * ay + rzz * az + rise
        _keep(o, k, ex, ey, ez, gx, gy, gz, bx, by, bz)
        _keep_wrench(o, k, S, ex, ey, ez, gx, gy, gz, bx, by, bz, 0.0, 0.0)
        o[15 * BLOCK + k] = axial
        C[2 * BLOCK + k] = own * X[2 * BLOCK + k]


@fast
def screw_back(
    rows: Array, where: tuple[int, ...], x: Array, cs: Array, before: Array, after: Array, torque: Array
) -> None:
    """Generalised torque of what ``screw`` moved, and its wrench joins that of its carrier.

    Args:
        rows: Constants of the links and rotors, (n + m, WIDTH) [SI].
        x: q, qd, qdd of the joints, (n, 3 BLOCK) [rad or m, and per s, s^2].
        cs: Cosines and sines of the joints' angles, torques of their rotors, (n + 1, 3 BLOCK) [-, N m].
        before: Records, among them that of the carrier, (k, CHANNELS) [SI].
        after: Records, among them that of this body, (k, CHANNELS) [SI].
        torque: Takes the torques, (n + 1, BLOCK) [N m or N].
    """
    row, joint, turned, slot, to = where
    K, X, C, u, o, tau = rows[row], x[joint], cs[turned], before[slot], after[to], torque[turned]
    px, py, pz, turn, slide = K[PX], K[PY], K[PZ], K[TURN], K[SLIDE]
    rxx, rxy, rxz, ryx, ryy, ryz = K[R0], K[R0 + 1], K[R0 + 2], K[R0 + 3], K[R0 + 4], K[R0 + 5]
    rzx, rzy, rzz = K[R0 + 6], K[R0 + 7], K[R0 + 8]
    for k in range(BLOCK):
        c, s, shift = C[k], C[BLOCK + k], slide * X[k]
        fx, fy, fz = o[9 * BLOCK + k], o[10 * BLOCK + k], o[11 * BLOCK + k]
        nx, ny, nz = o[12 * BLOCK + k], o[13 * BLOCK + k], o[14 * BLOCK + k]
        tau[k] = turn * nz + slide * fz + C[2 * BLOCK + k]
        qx, qy, qz = px + rxz * shift, py + ryz * shift, pz + rzz * shift
        t = c * fx - s * fy
        r = s * fx + c * fy
        gx = rxx * t + rxy * r + rxz * fz
        gy = ryx * t + ryy * r + ryz * fz
        gz = rzx * t + rzy * r + rzz * fz
        t = c * nx - s * ny
        r = s * nx + c * ny
        u[9 * BLOCK + k] += gx
        u[10 * BLOCK + k] += gy
        u[11 * BLOCK + k] += gz
        u[12 * BLOCK + k] += rxx * t + rxy * r + rxz * nz + qy * gz - qz * gy
        u[13 * BLOCK + k] += ryx * t + ryy * r + ryz * nz + qz * gx - qx * gz
        u[14 * BLOCK + k] += rzx * t + rzy * r + rzz * nz + qx * gy - qy * gx
