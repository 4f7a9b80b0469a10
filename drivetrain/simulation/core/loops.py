"""Mass matrix and bias of an arm with closed loops, along its driven joints and the rotors on their own.

Newton's method finds the joints that follow, from where they were: pins stay closed to rounding, so no run drifts open.
All rows of the chains (joints, rotors on their own) then move as ``G`` times the coordinates, and ideal pins do no
work: ``M = sum G^T M_chain G``, and the bias is ``G^T (b + M_chain G' qd)``.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 8.2.
"""

from __future__ import annotations

import math
from typing import Any

from numba import carray

from drivetrain.dynamics.core.equation_of_motion import mass_and_bias
from drivetrain.dynamics.core.factor import backward, scalar_product
from drivetrain.dynamics.core.frames import LINK as MOVED
from drivetrain.dynamics.core.frames import move_links
from drivetrain.dynamics.core.vectors import cross, dot, plus, turned, vector
from drivetrain.simulation.core.bodies import (
    add_bodies,
    bodies_of,
    carry,
    clear_bodies,
    links_of,
    rotors_of,
    show_bodies,
)
from drivetrain.simulation.core.records import (
    AT,
    CHAIN,
    END,
    WHOLE,
    Run,
    coordinates_of,
    count_of,
    engine_of,
    numbers_of,
    part,
    rows_of,
    words_of,
    world_of,
)

MOST = 30  # Newton's steps
DEAD = 1e-6  # of what a joint that follows moves its pins by, that no other can do as well: a dead centre is near below


@part
def _whole_of(run: Run) -> Any:
    """The joints of the whole linkage."""
    return carray(run[AT.whole], count_of(run, AT.whole), WHOLE)


@part
def _chains_of(run: Run) -> Any:
    return carray(run[AT.chains], count_of(run, AT.chains), CHAIN)


@part
def _pins_of(run: Run) -> Any:
    """A row a direction of every pin: what each joint moves it by; how far it is open, and its acceleration then."""
    return rows_of(run, AT.pins, 3 * (count_of(run, AT.ends) // 2), count_of(run, AT.whole) + 2)


@part
def _followed_of(run: Run) -> Any:
    """A row a joint that follows: what would do the same as each column of ``_pins_of``."""
    return rows_of(run, AT.followed, count_of(run, AT.follow), count_of(run, AT.whole) + 2)


@part
def _move_pins(run: Run) -> float:
    """Fill the rows of the pins; how far they are open, 1 being closed [-]."""
    whole, chains, table = _whole_of(run), _chains_of(run), _pins_of(run)
    ends, joint_of = carray(run[AT.ends], count_of(run, AT.ends), END), words_of(run, AT.row_joints)
    places, speeds = numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds)
    screws = rows_of(run, AT.screws, len(places), 6)
    moved = carray(run[AT.loop_links], count_of(run, AT.loop_links), MOVED)
    m, error = len(whole), 0.0
    for c in range(len(chains)):
        first, last = chains[c].row, chains[c].row + chains[c].joints
        for r in range(first, last):
            places[r], speeds[r] = whole[joint_of[r]].place, whole[joint_of[r]].speed
        move_links(screws[first:last], places[first:last], speeds[first:last], moved[first + c : last + c + 1])
    for r in range(len(table)):
        for k in range(m + 2):
            table[r, k] = 0.0
    for e in range(len(ends)):
        end, chain, row, sign = ends[e], chains[ends[e].chain], 3 * (e // 2), 1.0 - 2.0 * (e % 2)
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
                table[row + k, joint_of[chain.row + j]] += sign * dx[k]
    for r in range(len(table)):
        error += (table[r, m] / ends[2 * (r // 3)].closed) ** 2
    return error


@part
def _solve_followers(run: Run) -> bool:
    """What the joints that follow do for each column of the pins, by least squares; whether they can."""
    table, found, follow = _pins_of(run), _followed_of(run), words_of(run, AT.follow)
    whole, p, columns = _whole_of(run), len(follow), table.shape[1]
    lower = rows_of(run, AT.lower, p, p)
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
        if not size > DEAD * DEAD * before:
            return False
        lower[a, a] = math.sqrt(size)
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
    return True


@part
def _close_pins(run: Run) -> bool:
    """Move the joints that follow until all pins are closed."""
    whole, follow, found = _whole_of(run), words_of(run, AT.follow), _followed_of(run)
    for _ in range(MOST):
        error = _move_pins(run)
        if not error < math.inf or not _solve_followers(run):
            return False
        if error <= 1.0:
            return True
        for a in range(len(follow)):
            whole[follow[a]].place -= found[a, len(whole)]
    return False


@part
def _follow(run: Run) -> bool:
    """All joints where the driven ones want them, on a straight way from where they were; whether they come there."""
    coordinates, whole, follow, found = coordinates_of(run), _whole_of(run), words_of(run, AT.follow), _followed_of(run)
    far = 0.0
    for w in range(len(whole)):
        one = whole[w]
        one.kept = one.place
        if one.coordinate >= 0:
            far += abs(coordinates[one.coordinate].place - one.place) / one.stride
    if not far < 1e6:
        return False
    strides, reached = math.ceil(max(far, 1.0)), True
    for stride in range(1, strides + 1):
        for w in range(len(whole)):
            one = whole[w]
            if one.coordinate >= 0:
                to = coordinates[one.coordinate].place
                one.place = to if stride == strides else one.kept + (to - one.kept) * stride / strides
                one.speed = coordinates[one.coordinate].guess
        reached = reached and _close_pins(run)
    if not reached:
        for w in range(len(whole)):
            whole[w].place = whole[w].kept
        return False
    for a in range(len(follow)):
        speed = 0.0
        for w in range(len(whole)):
            if whole[w].coordinate >= 0:
                speed -= found[a, w] * whole[w].speed
        whole[follow[a]].speed = speed
    _move_pins(run)  # what they accelerate by hangs on the speeds
    return _solve_followers(run)


@part
def _spread(run: Run) -> None:
    """How all rows move with the coordinates, and how they accelerate where these do not."""
    coordinates, whole, found = coordinates_of(run), _whole_of(run), _followed_of(run)
    joint_of, rates = words_of(run, AT.row_joints), numbers_of(run, AT.body_rates)
    places, speeds = numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds)
    spread, m = rows_of(run, AT.spread, len(places), len(coordinates)), len(whole)
    for r in range(len(places)):
        joint = joint_of[r]
        if joint < 0:  # a rotor on its own
            places[r], speeds[r] = coordinates[-1 - joint].place, coordinates[-1 - joint].guess
        elif whole[joint].coordinate < 0:
            a = whole[joint].follower
            rates[r] = -found[a, m + 1]
            for w in range(m):
                if whole[w].coordinate >= 0:
                    spread[r, whole[w].coordinate] = -found[a, w]


@part
def _add_chain(run: Run, chain: Any, spread: Any) -> float:
    """Mass matrix and bias of a chain join those of the coordinates; its potential energy."""
    size, entry = chain.rows, chain.entry
    first, last = chain.row, chain.row + size
    links = links_of(run)[chain.link : chain.link + size + chain.rotors]
    rotors = rotors_of(run)[chain.rotor : chain.rotor + chain.rotors]
    bodies = bodies_of(run)[chain.body : chain.body + chain.joints + chain.rotors + 1]
    places, speeds = numbers_of(run, AT.body_places)[first:last], numbers_of(run, AT.body_speeds)[first:last]
    bias, felt_bias = numbers_of(run, AT.body_bias)[first:last], numbers_of(run, AT.body_felt_bias)[first:last]
    mass = numbers_of(run, AT.body_mass)[entry : entry + size * size].reshape((size, size))
    felt = numbers_of(run, AT.body_felt)[entry : entry + size * size].reshape((size, size))
    rates = numbers_of(run, AT.body_rates)[first:last]
    mass_and_bias(links, rotors, places, speeds, bodies, mass, felt, bias, felt_bias)
    for r in range(size):
        for j in range(size):
            bias[r] += mass[r, j] * rates[j]
            felt_bias[r] += felt[r, j] * rates[j]
    add_bodies(run, first, spread[first:last], mass, felt, bias, felt_bias)
    upwards = vector(bodies[len(bodies) - 1].dv)
    energy = dot(upwards, vector(bodies[0].first))
    for r in range(len(rotors)):
        if rotors[r].carrier < 0 and not rotors[r].balanced:
            energy += dot(upwards, vector(bodies[chain.joints + r].first))
    return energy


def loop_bodies(t: Any, h: Any, run: Any) -> None:
    """Mass matrix and bias of an arm with loops, as ``bodies`` of an open one."""
    engine, chains = engine_of(run), _chains_of(run)
    engine.open = 0 if _follow(run) else 1
    if engine.open:
        return
    carry(run, t)
    _spread(run)
    spread = rows_of(run, AT.spread, count_of(run, AT.row_joints), world_of(run).coordinates)
    clear_bodies(run)
    engine.potential = 0.0
    for c in range(len(chains)):
        engine.potential += _add_chain(run, chains[c], spread)
    show_bodies(run)
