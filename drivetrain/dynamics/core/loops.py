"""Closed loops, compiled: Newton's method for the passive joints, and their motion with the driven ones.

Pins are closed to rounding: after they are within tolerance, one more Newton step is made. Except for ``follow`` and
the kernels over samples, the laws do not branch on variables, so that code in other languages can be generated from
them.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 8.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetrain.arm.arm import Linkage
from drivetrain.arrays import Array
from drivetrain.dynamics.core.factor import backward, scalar_product
from drivetrain.dynamics.core.frames import LINK, move_links
from drivetrain.dynamics.core.vectors import CONTRACT, cross, exact, plus, turned, vector
from drivetrain.jit import kernel
from drivetrain.records import record_type

MOST = 30  # largest number of Newton steps
# Near a dead centre: the part of a passive joint's motion of its pins that no other passive joint can replace is below
# this share of the whole.
DEAD = 1e-6
STRIDE = 0.2  # largest step of a driven joint while loops are closed [rad]; of a prismatic one, share of the arm's size
FINER = (1, 8, 64)  # factors on the number of steps, tried one after the other
LEAP = 5.0  # largest change of a passive joint in a Newton step, in steps: more may reach another assembly mode
FARTHEST = 1e5  # largest motion of the driven joints to a sample, in strides: a tenth of a second of computing
CLOSED = 1e-10  # gap of closed pins before the last Newton step, as a share of the arm's size; squared after it


@dataclass
class Whole:
    """A joint of the linkage, driven or passive."""

    coordinate: int  # driven coordinate of this joint; -1: passive
    follower: int  # index among the passive joints
    stride: float
    wanted: float = 0.0  # target position, if driven
    place: float = 0.0
    speed: float = 0.0
    kept: float = 0.0  # position before the pins were closed again


@dataclass
class End:
    """One end of a pin (two consecutive records per pin), on the link after ``joints`` joints of a chain."""

    chain: int
    joints: int
    closed: float  # gap up to which a pin counts as closed [m]
    point: Annotated[Array, 3]  # in the base frame with all joints at zero [m]


@dataclass
class Rows:
    """The rows of a chain."""

    row: int  # the first one
    joints: int  # their number


WHOLE, END, ROWS = (record_type(one, np.int64) for one in (Whole, End, Rows))


class Pins(NamedTuple):
    """Data of the closed loops of an arm, by joints of the linkage and by rows of its chains, and work arrays."""

    whole: Any  # records WHOLE, (m,)
    follow: Any  # indices of the passive joints, (p,)
    ends: Any  # records END, two per pin
    chains: Any  # records with the first ``row`` of each chain, and how many ``joints`` it has
    joints: Any  # joint of each row
    screws: Any  # of the joints by row, (rows, 6)
    # work arrays
    places: Any
    speeds: Any
    moved: Any  # records ``frames.LINK``, one per row and one per chain
    table: Any  # per direction of a pin: motion per unit of each joint; gap; drift, (3 pins, m + 2)
    found: Any  # per passive joint: its motion that equals each column of the table, (p, m + 2)
    lower: Any  # (p, p)


def linkage_records(linkage: Linkage) -> tuple[Any, NDArray[np.int64], Any]:
    """Records of the linkage's joints, indices of the passive ones, and records of the pins' ends."""
    loops = linkage.loops
    slides = [linkage.chains[c].slides[loops.paths[c].index(joint)] for joint, c in enumerate(loops.owner)]
    driven, passive = list(loops.driven), list(loops.passive)
    whole = np.zeros(len(loops.owner), WHOLE)
    whole["coordinate"] = -1
    whole["coordinate"][driven] = np.arange(len(driven))
    whole["follower"][passive] = np.arange(len(passive))
    whole["stride"] = STRIDE * np.where(slides, loops.size, 1.0)
    ends = [(chain, count, CLOSED * loops.size, point) for *pair, point in loops.pins for chain, count in pair]
    return whole, np.array(passive, np.int64), np.array(ends, END)


def pins_of(linkage: Linkage) -> Pins:
    """The closed loops of a linkage with work arrays, all joints at zero."""
    whole, passive, ends = linkage_records(linkage)
    sizes = [len(path) for path in linkage.loops.paths]
    rows, m, p, pins = sum(sizes), len(whole), len(passive), len(ends) // 2
    chains = np.array([*zip(np.cumsum(sizes) - sizes, sizes, strict=True)], ROWS)
    joints = np.concatenate([np.array(path, np.int64) for path in linkage.loops.paths])
    screws = np.concatenate([chain.screws for chain in linkage.chains])
    return Pins(
        whole, passive, ends, chains, joints, screws, np.zeros(rows), np.zeros(rows),
        np.zeros(rows + len(chains), LINK), np.zeros((3 * pins, m + 2)), np.zeros((p, m + 2)), np.zeros((p, p)),
    )  # fmt: skip


@kernel(fastmath=CONTRACT)
def close_samples(pins: Any, q: Array, place: Array) -> int:
    """Set the positions of all joints, (N, m), for those of the driven ones, (N, n).

    Each sample is reached straight from the one before it, or else from zero. Returns the number of samples before the
    first one without a solution.
    """
    whole = pins.whole
    for sample in range(len(q)):
        for w in range(len(whole)):
            if whole[w].coordinate >= 0:
                whole[w].wanted = q[sample, whole[w].coordinate]
        if not follow(pins, FARTHEST):
            for w in range(len(whole)):
                whole[w].place = 0.0
            if not follow(pins, FARTHEST):
                return sample
        for w in range(len(whole)):
            place[sample, w] = whole[w].place
    return len(q)


@kernel(fastmath=CONTRACT)
def move_samples(pins: Any, place: Array, qd: Array, turns: Array, drift: Array) -> int:
    """Set each joint's motion per unit of the driven ones, (N, m, n), and its acceleration without theirs, (N, m).

    Both are given as zeros. ``place``: positions of all joints; ``qd``: speeds of the driven ones, (N, n). Returns the
    number of samples before the first one near a dead centre.
    """
    whole, found = pins.whole, pins.found
    for sample in range(len(qd)):
        for w in range(len(whole)):
            one = whole[w]
            one.place = place[sample, w]
            if one.coordinate >= 0:
                one.speed = qd[sample, one.coordinate]
        if not move_followers(pins) > 0.0:
            return sample
        for w in range(len(whole)):
            one = whole[w]
            if one.coordinate >= 0:
                turns[sample, w, one.coordinate] = 1.0
                continue
            drift[sample, w] = -found[one.follower, len(whole) + 1]
            for k in range(len(whole)):
                if whole[k].coordinate >= 0:
                    turns[sample, w, whole[k].coordinate] = -found[one.follower, k]
    return len(qd)


@exact
def move_pins(pins: Any) -> Any:
    """Fill the table of the pins; returns the sum of squares of their gaps, each over its tolerance [-]."""
    whole, chains, table, joints, moved = pins.whole, pins.chains, pins.table, pins.joints, pins.moved
    places, speeds, m, error = pins.places, pins.speeds, len(pins.whole), 0.0
    for c in range(len(chains)):
        first, last = chains[c].row, chains[c].row + chains[c].joints
        for r in range(first, last):
            places[r], speeds[r] = whole[joints[r]].place, whole[joints[r]].speed
        move_links(pins.screws[first:last], places[first:last], speeds[first:last], moved[first + c : last + c + 1])
    for r in range(len(table)):
        for k in range(m + 2):
            table[r, k] = 0.0
    for e in range(len(pins.ends)):
        end, chain, row, sign = pins.ends[e], chains[pins.ends[e].chain], 3 * (e // 2), 1.0 - 2.0 * (e % 2)
        first = chain.row + end.chain
        at = moved[first + (end.joints - 1 if end.joints else chain.joints)]
        w = vector(at.w)
        x = plus(vector(at.place), turned(at.rotation, vector(end.point)))
        v = plus(vector(at.v), cross(w, x))
        dv = plus(vector(at.dv), plus(cross(vector(at.dw), x), cross(w, v)))
        for k in range(3):
            table[row + k, m] += sign * x[k]
            table[row + k, m + 1] += sign * dv[k]
        for j in range(end.joints):
            link = moved[first + j]
            dx = plus(vector(link.slide), cross(vector(link.turn), x))
            for k in range(3):
                table[row + k, joints[chain.row + j]] += sign * dx[k]
    for r in range(len(table)):
        error += (table[r, m] / pins.ends[2 * (r // 3)].closed) ** 2
    return error


@exact
def solve_followers(pins: Any, dead: Any) -> Any:
    """Solve for the passive joints' motion for each column of the table, by least squares.

    The result is positive unless the linkage is near a dead centre, as defined by ``dead``, the square of ``DEAD``.
    """
    table, found, follow, lower, whole = pins.table, pins.found, pins.follow, pins.lower, pins.whole
    p, columns, room = len(follow), len(whole) + 2, 1.0
    for a in range(p):
        own = table[:, follow[a]]
        before = scalar_product(own, own)
        for b in range(a):
            other = table[:, follow[b]]
            share = scalar_product(other, own)
            lower[a, b] = share
            for r in range(len(table)):
                own[r] -= share * other[r]
        size = scalar_product(own, own)
        room = np.minimum(room, size - dead * before)
        lower[a, a] = np.sqrt(size)
        for r in range(len(table)):
            own[r] /= lower[a, a]
    for k in range(columns):
        if k < columns - 2 and whole[k].coordinate < 0:
            continue
        right = table[:, k]
        for a in range(p):
            own = table[:, follow[a]]
            found[a, k] = scalar_product(own, right)
            for r in range(len(table)):
                right[r] -= found[a, k] * own[r]
        backward(lower, found[:, k])
    return room


@exact
def newton(pins: Any, dead: Any) -> Any:
    """One Newton step of the passive joints; returns ``move_pins`` before it, and the result of ``solve_followers``."""
    error = move_pins(pins)
    room = solve_followers(pins, dead)
    for a in range(len(pins.follow)):
        one, step = pins.whole[pins.follow[a]], pins.found[a, len(pins.whole)]
        one.place -= step
        room = np.minimum(room, LEAP * one.stride - abs(step))
    return error, room


@exact
def close_pins(pins: Any, dead: float) -> bool:
    """Move the passive joints until all pins are closed; returns whether they are."""
    for _ in range(MOST):
        error, room = newton(pins, dead)
        if not error < math.inf or not room > 0.0:
            return False
        if error <= 1.0:
            return True
    return False


@exact
def follow(pins: Any, most: float) -> bool:
    """Move the driven joints on a straight path to their targets, and the passive ones with them; returns the success.

    The path has at most ``most`` steps, or finer ones. No step comes so near a dead centre that it might pass it,
    beyond which the linkage would be in another assembly mode. Without success all joints stay where they were.
    """
    whole, far = pins.whole, 0.0
    for w in range(len(whole)):
        one = whole[w]
        one.kept = one.place
        if one.coordinate >= 0:
            far += abs(one.wanted - one.place) / one.stride
    if not far <= most:
        return False
    for finer in FINER:
        strides = math.ceil(max(finer * far, 1.0))
        if _walk(pins, strides, max(DEAD, STRIDE * far / strides) ** 2):
            return True
        for w in range(len(whole)):
            whole[w].place = whole[w].kept
    return False


@exact
def _walk(pins: Any, strides: int, dead: float) -> bool:
    """Move the driven joints from their positions to their targets in ``strides`` steps; returns the success."""
    for stride in range(1, strides + 1):
        for w in range(len(pins.whole)):
            one = pins.whole[w]
            if one.coordinate >= 0:
                to = one.wanted
                one.place = to if stride == strides else one.kept + (to - one.kept) * stride / strides
        if not close_pins(pins, dead):
            return False
    return True


@exact
def move_followers(pins: Any) -> Any:
    """Compute speeds of the passive joints, and in ``found`` their motion per unit of the driven ones.

    Returns the result of ``solve_followers``.
    """
    whole, passive, found = pins.whole, pins.follow, pins.found
    move_pins(pins)
    solve_followers(pins, DEAD * DEAD)
    for a in range(len(passive)):
        speed = 0.0
        for w in range(len(whole)):
            if whole[w].coordinate >= 0:
                speed -= found[a, w] * whole[w].speed
        whole[passive[a]].speed = speed
    move_pins(pins)  # the accelerations depend on the speeds
    return solve_followers(pins, DEAD * DEAD)
