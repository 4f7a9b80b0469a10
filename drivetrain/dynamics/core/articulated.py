"""The articulated-body recursion, compiled: accelerations in O(n) time, rotors included.

All six-vectors are (angular, linear), about the origin of the link's own frame but in the axes of the base. So the
transformation to the next link is a translation without a rotation, and no lever arm is longer than a link.

A rotor that is geared to joint i and carried by link c makes two bodies depend on the coordinate i. It adds
``R qdd_i^2 / 2 + qdd_i (k . a_c + b)`` to the function that the accelerations minimise (Gauss' principle), besides its
own inertia and bias force on its carrier. R is its inertia about the spin axis times the ratio squared, k its momentum
for a unit speed of the joint, b the torque at the joint due to its spin; for balanced and unbalanced rotors only k, R
and b differ. If c is the base, the link before the joint or the one after it, k is added to the vector that eliminates
``qdd_i``. With any other carrier an unknown would remain between joint and carrier: arms with such rotors
(``packed.Packed.chained``) use the mass matrix.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 7.3, for an arm without rotors.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.vectors import (
    Tensor,
    Vector,
    add,
    add_six,
    axis_of,
    cross,
    dot,
    dot_six,
    exact,
    linear,
    minus,
    plus,
    put,
    put_six,
    step_to,
    times,
    turn_on,
    turned,
    turned_tensor,
    vector,
)
from drivetrain.jit import kernel

# Smallest share of a joint's inertia that must remain with the joints after it free; rounding of zero is about 1e-15.
SINGULAR = 1e-12

# Work record of a link, or of the base.
BODY = np.dtype(
    [
        # Pose relative to the previous link, velocity, acceleration due to the joint's own motion.
        ("rotation", np.float64, (3, 3)),
        ("step", np.float64, (3,)),
        ("w", np.float64, (3,)),
        ("v", np.float64, (3,)),
        ("coriolis", np.float64, (6,)),
        # Articulated inertia and bias force.
        ("inertia", np.float64, (6, 6)),
        ("bias", np.float64, (6,)),
        # Momentum per unit speed of the joint of rotors on this link, and on the previous link; vector that eliminates
        # the joint's acceleration; the acceleration itself.
        *((name, np.float64, (6,)) for name in ("on_self", "on_parent", "eliminator", "acceleration")),
        # Motion per unit of the joint, and the inertia times it.
        ("axis", np.float64, (6,)),
        ("image", np.float64, (6,)),
        # Inertia to eliminate it, remaining torque, inertia of rotors, torque at the joint.
        *((name, np.float64) for name in ("divisor", "rest", "rotor", "load")),
        # Mass, first moment and half the trace of the inertia of this link and all after it.
        ("mass", np.float64),
        ("first", np.float64, (3,)),
        ("polar", np.float64),
    ]
)


@kernel
def articulated_accelerations(arm: Any, q: Array, qd: Array, tau: Array, tip: Array, qdd: Array) -> tuple[int, int]:
    """Fill the accelerations; returns sample and joint of the first joint that moves no inertia, or -1 and -1."""
    links, rotors, gravity = arm
    n, m = q.shape[1], len(rotors)
    bodies, spinning = np.zeros(n + 1, BODY), np.zeros(1, BODY)  # the last body: the base
    base: Any = bodies[n]
    for j in range(3):
        base.rotation[j, j] = 1.0
        base.acceleration[3 + j] = -gravity[j]
    for sample in range(len(q)):
        for i in range(n):
            _move(links[i], bodies[i], bodies[i - 1], q[sample, i], qd[sample, i], tau[sample, i], i > 0)
        for r in range(m):
            joint = rotors[r].joint
            _spin(links[n + r], rotors[r], bodies, spinning[0], q[sample, joint], qd[sample, joint])
        if len(tip):
            last, at = bodies[n - 1], sample if len(tip) > 1 else 0
            moment = turned(last.rotation, (tip[at, 0], tip[at, 1], tip[at, 2]))
            add_six(last.bias, moment, turned(last.rotation, (tip[at, 3], tip[at, 4], tip[at, 5])))
        joint = _inwards(links, bodies)
        if joint >= 0:
            return sample, joint
        _outwards(links, bodies, qdd[sample])
    return -1, -1


# One link, or rotor: pose, velocity, own inertia and bias force


@exact
def _turned_moments(link: Any, body: Any) -> tuple[Vector, Tensor]:
    """First moment and inertia of a link's own body, about its frame's origin."""
    xx, yy, zz = link.syy + link.szz, link.sxx + link.szz, link.sxx + link.syy
    inertia = turned_tensor(body.rotation, (xx, yy, zz, -link.sxy, -link.sxz, -link.syz))
    return turned(body.rotation, (link.hx, link.hy, link.hz)), inertia


@exact
def _times(t: Tensor, a: Vector) -> Vector:
    return (
        t[0] * a[0] + t[3] * a[1] + t[4] * a[2],
        t[3] * a[0] + t[1] * a[1] + t[5] * a[2],
        t[4] * a[0] + t[5] * a[1] + t[2] * a[2],
    )


@exact
def _add_body(body: Any, m: float, h: Vector, t: Tensor) -> None:
    """Add a body (mass, first moment, inertia about the origin) to the articulated inertia and to the sum of bodies."""
    xx, yy, zz, xy, xz, yz = t
    rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    lever = ((0.0, -h[2], h[1]), (h[2], 0.0, -h[0]), (-h[1], h[0], 0.0))
    for r in range(3):
        for c in range(3):
            body.inertia[r, c] += rows[r][c]
            body.inertia[r, 3 + c] += lever[r][c]
            body.inertia[3 + c, r] += lever[r][c]
        body.inertia[3 + r, 3 + r] += m
    body.mass += m
    add(body.first, h)
    body.polar += 0.5 * (t[0] + t[1] + t[2])


@exact
def _bias(m: float, h: Vector, t: Tensor, w: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Moment and force of the velocity terms of a body: its velocity x* its momentum."""
    momentum, force = plus(_times(t, w), cross(h, v)), minus(times(m, v), cross(h, w))
    return plus(cross(w, momentum), cross(v, force)), cross(w, force)


@exact
def _move(link: Any, body: Any, before: Any, q: float, qd: float, tau: float, carried: bool) -> None:
    """Pose, velocity, own inertia and bias force of a link."""
    step, w, v = step_to(link, before, link.slide * q), vector(before.w), vector(before.v)
    turn_on(link, body, before, link.turn * q + link.offset)
    put(body.step, step)
    z, turn, slide = axis_of(body), link.turn * qd, link.slide * qd
    v = plus(plus(v, cross(w, step)), times(slide, z))
    w = plus(w, times(turn, z))
    put(body.w, w)
    put(body.v, v)
    wz = cross(w, z)
    put_six(body.coriolis, times(turn, wz), plus(times(slide, wz), times(turn, cross(v, z))))
    for j in range(6):
        body.on_self[j] = body.on_parent[j] = 0.0
        for k in range(6):
            body.inertia[j, k] = 0.0
    body.mass = body.polar = body.first[0] = body.first[1] = body.first[2] = 0.0
    h, inertia = _turned_moments(link, body)
    _add_body(body, link.mass, h, inertia)
    moment, force = _bias(link.mass, h, inertia, w, v)
    put_six(body.bias, moment, force)
    body.rotor, body.load = link.rotor_inertia, tau
    if link.spin != 0.0:
        # A balanced rotor on the axis, carried by the previous link: its couple on that link is spin (w x z qd + z
        # qdd).
        put_six(body.on_parent, times(link.spin, z), (0.0, 0.0, 0.0))
        if carried:
            add(before.bias, times(link.spin * qd, cross(vector(before.w), z)))


@exact
def _spin(link: Any, rotor: Any, bodies: Any, spinning: Any, q: float, qd: float) -> None:
    """Add the inertia and bias forces of a rotor with an own record to its carrier and its joint."""
    on, joint, body = rotor.carrier, rotor.joint, bodies[rotor.joint]
    carrier = bodies[on]  # -1: the base, the last record
    if rotor.balanced:
        momentum, force = turned(carrier.rotation, (link.px, link.py, link.pz)), (0.0, 0.0, 0.0)
        if on >= 0:
            add(carrier.bias, times(qd, cross(vector(carrier.w), momentum)))
    else:
        momentum, force = _spin_whole(link, q, qd, carrier, on >= 0, body, spinning)
    if on == joint:
        add_six(body.on_self, momentum, force)
    elif on == joint - 1:
        add_six(body.on_parent, minus(momentum, cross(vector(body.step), force)), force)
    else:
        body.load -= dot(momentum, vector(carrier.acceleration)) + dot(force, linear(carrier.acceleration))


@exact
def _spin_whole(
    link: Any, q: float, qd: float, carrier: Any, held: bool, joint: Any, rotor: Any
) -> tuple[Vector, Vector]:
    """Add an unbalanced rotor to its carrier as a body; returns its momentum per unit speed of its joint."""
    turn_on(link, rotor, carrier, link.turn * q)
    p, z = turned(carrier.rotation, (link.px, link.py, link.pz)), axis_of(rotor)
    m, (h, t) = link.mass, _turned_moments(link, rotor)
    # Inertia about the carrier's origin: that about the spin axis, translated.
    ph, pp = 2.0 * dot(p, h), m * dot(p, p)
    t = (
        t[0] + ph - 2.0 * p[0] * h[0] + pp - m * p[0] * p[0],
        t[1] + ph - 2.0 * p[1] * h[1] + pp - m * p[1] * p[1],
        t[2] + ph - 2.0 * p[2] * h[2] + pp - m * p[2] * p[2],
        t[3] - p[0] * h[1] - p[1] * h[0] - m * p[0] * p[1],
        t[4] - p[0] * h[2] - p[2] * h[0] - m * p[0] * p[2],
        t[5] - p[1] * h[2] - p[2] * h[1] - m * p[1] * p[2],
    )
    h, pz, turn = plus(h, times(m, p)), cross(p, z), link.turn
    # Momentum per unit speed of the joint, and that for the acceleration of its spin due to the carrier's rotation.
    momentum = times(turn, plus(_times(t, z), cross(h, pz)))
    force = times(turn, minus(times(m, pz), cross(h, z)))
    joint.rotor += turn * (dot(z, momentum) + dot(pz, force))
    w, v, spin = vector(carrier.w), vector(carrier.v), turn * qd
    e = times(spin, cross(w, z))
    d = times(spin, plus(cross(v, z), cross(w, pz)))
    moment, push = _bias(m, h, t, plus(w, times(spin, z)), plus(v, times(spin, pz)))
    moment = plus(moment, plus(_times(t, e), cross(h, d)))
    push = plus(push, minus(times(m, d), cross(h, e)))
    joint.load -= turn * (dot(z, moment) + dot(pz, push))
    if held:
        _add_body(carrier, m, h, t)
        add_six(carrier.bias, moment, push)
    return momentum, force


# The articulated inertia


@exact
def _apply(o: Any, x: Array, y: Array) -> None:
    """The articulated inertia of a link times x."""
    for j in range(6):
        y[j] = dot_six(o.inertia[j], x)


@exact
def _eliminate(body: Any) -> None:
    """Remove the part of a link's articulated inertia in the direction in which its joint is free."""
    for j in range(6):
        for k in range(6):
            body.inertia[j, k] -= body.eliminator[j] * body.eliminator[k] / body.divisor


@exact
def _hand_on(o: Any, to: Any) -> None:
    """Add articulated inertia, bias force and body sums of a link to those of the previous link, about its origin."""
    p, inertia = vector(o.step), o.inertia
    for j in range(6):
        add(inertia[j], cross(p, linear(inertia[j])))
    for k in range(6):
        shift = cross(p, (inertia[3, k], inertia[4, k], inertia[5, k]))
        inertia[0, k] += shift[0]
        inertia[1, k] += shift[1]
        inertia[2, k] += shift[2]
    for j in range(6):
        for k in range(6):
            to.inertia[j, k] += inertia[j, k]
    force, first = linear(o.bias), vector(o.first)
    add_six(to.bias, plus(vector(o.bias), cross(p, force)), force)
    to.mass += o.mass
    add(to.first, plus(first, times(o.mass, p)))
    to.polar += o.polar + 2.0 * dot(p, first) + o.mass * dot(p, p)


# The two sweeps


@exact
def _inwards(links: Any, bodies: Any) -> int:
    """Eliminate the joints' accelerations from tip to base; returns the first joint that moves no inertia, or -1."""
    for i in range(len(bodies) - 2, -1, -1):
        link, body = links[i], bodies[i]
        axis, image, z = body.axis, body.image, axis_of(body)
        put_six(axis, times(link.turn, z), times(link.slide, z))
        _apply(body, axis, image)
        own = 2.0 * dot_six(body.on_self, axis)
        body.divisor = dot_six(axis, image) + body.rotor + own
        moved = link.turn**2 * body.polar + link.slide**2 * body.mass + abs(body.rotor) + abs(own)
        if not body.divisor > SINGULAR * moved:
            return i
        body.rest = body.load - dot_six(axis, body.bias)
        for j in range(6):
            image[j] += body.on_self[j]
            body.rest -= image[j] * body.coriolis[j]
            body.eliminator[j] = image[j] + body.on_parent[j]
        if i == 0:
            break
        drive = body.rest / body.divisor
        _apply(body, body.coriolis, image)
        for j in range(6):
            body.bias[j] += image[j] + body.eliminator[j] * drive
        _eliminate(body)
        _hand_on(body, bodies[i - 1])
    return -1


@exact
def _outwards(links: Any, bodies: Any, qdd: Array) -> None:
    """Compute the accelerations from base to tip."""
    for i in range(len(qdd)):
        link, body, before = links[i], bodies[i], bodies[i - 1]  # before the first: the base
        angular, straight = vector(before.acceleration), linear(before.acceleration)
        put_six(body.acceleration, angular, plus(straight, cross(angular, vector(body.step))))
        qdd[i] = (body.rest - dot_six(body.eliminator, body.acceleration)) / body.divisor
        z = times(qdd[i], axis_of(body))
        turning, sliding = times(link.turn, z), times(link.slide, z)
        add_six(body.acceleration, plus(vector(body.coriolis), turning), plus(linear(body.coriolis), sliding))
