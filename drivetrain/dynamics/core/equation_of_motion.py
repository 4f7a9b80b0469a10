"""Mass matrix and bias of one sample, compiled, for simulations, which compute one sample after another.

All six-vectors are about the base's origin in the axes of the base. So wrenches and bodies of links can be added
without transformation, and an entry of the matrix is one scalar product of a screw and a wrench.
Rotors that move independently (behind a spring) have a coordinate of their own after the joints: a substitute joint at
the end of the chain that moves no link and has no mass, see ``packed.py``.

Reference: Modern Robotics, section 8.3, exercise 8.13; Featherstone, Rigid Body Dynamics Algorithms (2008), section 6.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.vectors import (
    Vector,
    add,
    axis_of,
    cross,
    dot,
    exact,
    minus,
    plus,
    put,
    step_to,
    times,
    turn_on,
    turned,
    turned_tensor,
    vector,
)

# Motion of a body in the base frame: pose; screw of its joint; velocity; acceleration without those of the joints,
# minus gravity; mass, first and second moments (xx, yy, zz, xy, xz, yz) of it and all after it; wrench that moves it.
BODY = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),
        *((name, np.float64, (3,)) for name in ("origin", "turn", "slide", "w", "v", "dw", "dv")),
        ("mass", np.float64),
        ("first", np.float64, (3,)),
        ("second", np.float64, (6,)),
        *((name, np.float64, (3,)) for name in ("moment", "force")),
    ]
)


def moving_bodies(links: int, rotors: int, base: Array, gravity: Array) -> np.ndarray:
    """Records of links, rotors and base, at rest, for ``mass_and_bias``; ``base`` is ``link_frames(arm)[0]``."""
    bodies = np.zeros(links + rotors + 1, BODY)
    bodies["rotation"][-1], bodies["origin"][-1] = base[:3, :3], base[:3, 3]
    bodies["dv"][-1] = -np.asarray(gravity)
    return bodies


@exact
def mass_and_bias(
    links: Any, rotors: Any, q: Array, qd: Array, bodies: Any,
    mass: Array, rotor_mass: Array, bias: Array, rotor_bias: Array,
) -> None:  # fmt: skip
    """Fill mass matrix, (n, n), and bias (torques at constant speed), (n,), of n coordinates, and the motion of the
    bodies.

    ``links`` are records LINK of joints, substitute joints and m rotors, ``rotors`` m records ROTOR, ``bodies`` come
    from ``moving_bodies``. ``rotor_mass`` and ``rotor_bias`` are the parts that act on the motors directly, not through
    their gears.
    """
    joints = len(bodies) - len(rotors) - 1
    for i in range(len(q)):
        bias[i] = rotor_bias[i] = 0.0
        for k in range(len(q)):
            mass[i, k] = rotor_mass[i, k] = 0.0
        mass[i, i] = rotor_mass[i, i] = links[i].rotor_inertia
    for i in range(joints):
        # For the first link, index -1 is the last record, the base.
        link, body, before = links[i], bodies[i], bodies[i - 1]
        _move(link, body, before, q[i], qd[i])
        if link.spin != 0.0 and i:
            # A balanced rotor on the axis, carried by the previous link.
            momentum = times(link.spin, axis_of(body))
            add(before.moment, times(qd[i], cross(vector(before.w), momentum)))
            bias[i] = rotor_bias[i] = dot(momentum, vector(before.dw))
            for k in range(i):
                entry = dot(momentum, vector(bodies[k].turn))
                mass[i, k] = mass[k, i] = rotor_mass[i, k] = entry
    for r in range(len(rotors)):
        _add_rotor(r, rotors[r], links[len(q) + r], joints, q, qd, bodies, mass, rotor_mass, bias, rotor_bias)
    for i in range(joints - 1, -1, -1):
        body = bodies[i]
        bias[i] += _power(body, vector(body.moment), vector(body.force))
        moment, force = _momentum(body, vector(body.turn), vector(body.slide))
        mass[i, i] += _power(body, moment, force)
        for k in range(i):
            entry = _power(bodies[k], moment, force)
            mass[i, k] += entry
            mass[k, i] += entry
        if i:
            _hand_on(body, bodies[i - 1])


@exact
def _add_rotor(
    r: int, rotor: Any, link: Any, joints: int, q: Array, qd: Array, bodies: Any,
    mass: Array, rotor_mass: Array, bias: Array, rotor_bias: Array,
) -> None:  # fmt: skip
    """Add a rotor with an own record to its carrier, the matrix and the bias."""
    joint, on, carrier = rotor.joint, rotor.carrier, bodies[rotor.carrier]  # -1: the base, the last record
    moment, force, own = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
    if rotor.balanced:
        moment = turned(carrier.rotation, (link.px, link.py, link.pz))
        own = dot(moment, vector(carrier.dw))
        if on >= 0:
            add(carrier.moment, times(qd[joint], cross(vector(carrier.w), moment)))
    else:
        body = bodies[joints + r]
        _move(link, body, carrier, q[joint], qd[joint])
        moment, force = _momentum(body, vector(body.turn), vector(body.slide))
        inertia = _power(body, moment, force)
        own = _power(body, vector(body.moment), vector(body.force))
        mass[joint, joint] += inertia
        rotor_mass[joint, joint] += inertia
        if on >= 0:
            _hand_on(body, carrier)
    bias[joint] += own
    rotor_bias[joint] += own
    for k in range(on + 1):
        entry = _power(bodies[k], moment, force)
        rotor_mass[joint, k] += entry
        mass[joint, k] += entry
        mass[k, joint] += entry


@exact
def _move(link: Any, body: Any, before: Any, q: float, qd: float) -> None:
    """Pose and motion of a body, its moments about the base's origin, and the wrench of its velocity terms."""
    turn_on(link, body, before, link.turn * q + link.offset)
    put(body.origin, plus(vector(before.origin), step_to(link, before, link.slide * q)))
    _add_motion(link, body, before, qd)
    _place_moments(link, body)
    w, v = vector(body.w), vector(body.v)
    moment, force = _momentum(body, w, v)
    rate_moment, rate_force = _momentum(body, vector(body.dw), vector(body.dv))
    put(body.moment, plus(rate_moment, plus(cross(w, moment), cross(v, force))))
    put(body.force, plus(rate_force, cross(w, force)))


@exact
def _add_motion(link: Any, body: Any, before: Any, speed: float) -> None:
    """Screw, velocity, and acceleration due to velocities of a body, from those of the previous one."""
    z, w, v = axis_of(body), vector(before.w), vector(before.v)
    turn = times(link.turn, z)
    slide = plus(cross(vector(body.origin), turn), times(link.slide, z))
    put(body.turn, turn)
    put(body.slide, slide)
    put(body.w, plus(w, times(speed, turn)))
    put(body.v, plus(v, times(speed, slide)))
    # The screw moves with the body: its rate is velocity x screw, to which the joint's own speed does not contribute.
    put(body.dw, plus(vector(before.dw), times(speed, cross(w, turn))))
    put(body.dv, plus(vector(before.dv), times(speed, plus(cross(w, slide), cross(v, turn)))))


@exact
def _place_moments(link: Any, body: Any) -> None:
    """Mass and moments of a body about the base's origin."""
    m, p, r, to = link.mass, vector(body.origin), body.rotation, body.second
    h = turned(r, (link.hx, link.hy, link.hz))
    s = turned_tensor(r, (link.sxx, link.syy, link.szz, link.sxy, link.sxz, link.syz))
    g = plus(h, times(m, p))
    body.mass = m
    put(body.first, g)
    to[0] = s[0] + p[0] * (h[0] + g[0])
    to[1] = s[1] + p[1] * (h[1] + g[1])
    to[2] = s[2] + p[2] * (h[2] + g[2])
    to[3] = s[3] + p[0] * h[1] + g[0] * p[1]
    to[4] = s[4] + p[0] * h[2] + g[0] * p[2]
    to[5] = s[5] + p[1] * h[2] + g[1] * p[2]


@exact
def _momentum(body: Any, w: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Moment and force part of a body's inertia times a six-vector."""
    m, h, s = body.mass, vector(body.first), body.second
    xx, yy, zz, xy, xz, yz = s[0], s[1], s[2], s[3], s[4], s[5]
    turning = (
        (yy + zz) * w[0] - xy * w[1] - xz * w[2],
        (xx + zz) * w[1] - xy * w[0] - yz * w[2],
        (xx + yy) * w[2] - xz * w[0] - yz * w[1],
    )
    return plus(turning, cross(h, v)), minus(times(m, v), cross(h, w))


@exact
def _power(body: Any, moment: Vector, force: Vector) -> float:
    """Power of a wrench at unit speed of a body's joint."""
    return dot(vector(body.turn), moment) + dot(vector(body.slide), force)


@exact
def _hand_on(body: Any, to: Any) -> None:
    """Add a body with all after it, and the wrench that moves them, to another body."""
    to.mass += body.mass
    add(to.first, vector(body.first))
    for j in range(6):
        to.second[j] += body.second[j]
    add(to.moment, vector(body.moment))
    add(to.force, vector(body.force))
