"""What a unit of each number of each drive adds to the load of each joint: one pass over the motion, in the base frame.

A body rides on the link that carries a drive. At its place p the force for a unit of mass is ``a - g``; the moment for
an inertia I is ``I dw + w x I w``; a rotor that turns ``ratio`` times as far as its shaft asks ``z s'' + (w x z) s'``
more for each unit of inertia times ratio. Moments about the base's origin then serve every joint before.

Reference: Modern Robotics, equations 8.103 to 8.110; velocities and accelerations are twists about the base's origin.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.core.frames import LINK, move_links
from drivetrain.dynamics.core.vectors import (
    cross,
    dot,
    exact,
    linear,
    minus,
    plus,
    put,
    put_six,
    times,
    turned,
    vector,
)
from drivetrain.jit import kernel

NUMBERS = 5  # of a drive: mass, inertia across, along, of the rotor, of the rotor times ratio


class Riders(NamedTuple):
    """Where the drives of n joints ride, all joints at zero, base frame."""

    carrier: Any  # index of the link that holds each, -1 for the base, (n,)
    place: Array  # centre of mass [m], (n, 3)
    axis: Array  # direction, (n, 3)
    weighs: Any  # whether its body counts, not its rotor alone, (n,)


class Along(NamedTuple):
    """What rows of unit loads are made of, over N samples, base frame, moments about its origin."""

    lines: Array  # screw axes of the joints, (n, 6, N)
    frames: Array  # axes of each joint's own frame, then its origin [m], (n, 12, N)
    wrenches: Array  # for a unit of each number of each drive, moment and force, (n, NUMBERS, 6, N)
    bodies: Array  # place [m] and axis of each drive, (n, 6, N)


@kernel
def go_along(
    screws: Array, frames: Array, gravity: Array, riders: Riders, q: Array, qd: Array, qdd: Array, shaft: Array,
    shaft_rate: Array, out: Along,
) -> None:  # fmt: skip
    """Fill what rows are made of.

    Args:
        screws, frames: Of the joints, base frame, all at zero, (n, 6), (n, 3, 4).
        gravity: [m/s^2], (3,).
        riders: The drives.
        q, qd, qdd: Positions, speeds and accelerations of the joints, (N, n).
        shaft, shaft_rate: Speeds and accelerations of the shafts behind the gears, (N, n).
        out: All zero; is filled, but for drives on the base, which load no joint.
    """
    n, links = len(screws), np.zeros(len(screws) + 1, LINK)
    for t in range(len(q)):
        move_links(screws, q[t], qd[t], links)
        angular, straight = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)  # what the accelerations of the joints add
        for i in range(n):
            link = links[i]
            turn, slide = vector(link.turn), vector(link.slide)
            put_six(out.lines[i, :, t], turn, slide)
            angular, straight = plus(angular, times(qdd[t, i], turn)), plus(straight, times(qdd[t, i], slide))
            for k in range(3):
                put(out.frames[i, 3 * k : 3 * k + 3, t], turned(link.rotation, vector(frames[i, :, k])))
            put(out.frames[i, 9:, t], plus(turned(link.rotation, vector(frames[i, :, 3])), vector(link.place)))
            dw, dv = plus(vector(link.dw), angular), plus(vector(link.dv), straight)
            for k in range(n):
                if riders.carrier[k] == i:
                    ride(riders, k, gravity, link, dw, dv, shaft[t, k], shaft_rate[t, k], out, t)


@exact
def ride(
    riders: Any, k: Any, gravity: Any, link: Any, dw: Any, dv: Any, rate: Any, more: Any, out: Any, t: Any
) -> None:
    """What a unit of each number of drive k asks of the link that carries it, which accelerates by dw and dv."""
    w, v = vector(link.w), vector(link.v)
    x = plus(turned(link.rotation, vector(riders.place[k])), vector(link.place))
    z = turned(link.rotation, vector(riders.axis[k]))
    put_six(out.bodies[k, :, t], x, z)
    tilt, found = cross(w, z), out.wrenches[k, :, :, t]
    about = plus(times(dot(z, dw), z), times(dot(z, w), tilt))  # of an inertia about the axis; w x w is none
    if riders.weighs[k]:
        force = minus(plus(plus(dv, cross(dw, x)), cross(w, plus(v, cross(w, x)))), vector(gravity))
        put_six(found[0], cross(x, force), force)
        put(found[1], minus(dw, about))
        put(found[2], about)
    put(found[3], about)
    put(found[4], plus(times(more, z), times(rate, tilt)))


@kernel
def fill_rows(
    along: Along, riders: Riders, joint: int, drive: int, turns: Array, first: int, force: Array, wrench: Array,
    inertia: Array,
) -> None:  # fmt: skip
    """What the units of one drive add to one joint, or where motors are coupled to its shaft.

    Args:
        along, riders: Of the motion.
        joint, drive: Indices.
        turns: Of each joint, a turn of the shaft, (n,).
        first: Sample with which ``along`` begins.
        force: Takes torque or force, (NUMBERS, N).
        wrench: Takes moment and force through the joint in its own frame, (NUMBERS, N, 6) or (NUMBERS, 0, 6).
        inertia: Takes what the shaft turns, (NUMBERS, N) or (NUMBERS, 0).
    """
    carrier, e = riders.carrier[drive], along.frames[joint]
    for t in range(along.lines.shape[2]):
        w, v, body = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), along.bodies[drive, :, t]  # of the carrier, a turn of the shaft
        for j in range(carrier + 1):
            if turns[j] != 0.0:
                line = along.lines[j, :, t]
                w, v = plus(w, times(turns[j], vector(line))), plus(v, times(turns[j], linear(line)))
        for number in range(len(force)):
            m = along.wrenches[drive, number, :, t]
            force[number, first + t] = dot(w, vector(m)) + dot(v, linear(m))
        if inertia.shape[1] > 0:
            moved, about = plus(cross(w, vector(body)), v), dot(w, linear(body)) ** 2
            inertia[3, first + t] = about
            if riders.weighs[drive]:
                inertia[0, first + t], inertia[2, first + t] = dot(moved, moved), about
                inertia[1, first + t] = dot(w, w) - about
    for number in range(len(wrench) if wrench.shape[1] > 0 and carrier >= joint else 0):
        for t in range(along.lines.shape[2]):
            m, out = along.wrenches[drive, number, :, t], wrench[number, first + t]
            push = linear(m)
            moment = minus(vector(m), cross(vector(e[9:, t]), push))
            for i in range(3):
                axis = vector(e[3 * i : 3 * i + 3, t])
                out[i], out[3 + i] = dot(axis, moment), dot(axis, push)
