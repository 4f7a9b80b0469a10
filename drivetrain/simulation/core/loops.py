"""Mass matrix and bias torques of an arm with closed loops, in its driven joints and the rotors behind springs.

Newton's method solves the loop closure for the passive joints, from their last positions, so the loops do not drift
open (``dynamics/core/loops.py``). All rows of the chains (joints, rotors behind springs) then move as ``G`` times the
coordinates. Ideal pins do no work, so ``M = sum G^T M_chain G``, and the bias torque is ``G^T (b + M_chain G' qd)``.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 8.2.
"""

from __future__ import annotations

from typing import Any

from numba import carray

from drivetrain.dynamics.core.equation_of_motion import mass_and_bias
from drivetrain.dynamics.core.frames import LINK as MOVED
from drivetrain.dynamics.core.loops import END, WHOLE, Pins, follow, move_followers
from drivetrain.dynamics.core.vectors import dot, vector
from drivetrain.simulation.core.bodies import (
    add_bodies,
    bodies_of,
    clear_bodies,
    links_of,
    provide_bodies,
    rotors_of,
    set_payload,
    turns_of,
)
from drivetrain.simulation.core.records import (
    AT,
    CHAIN,
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

FAR = 1e6  # largest motion between two solutions of the loop closure, in strides of ``follow``; practically no limit


@part
def _whole_of(run: Run) -> Any:
    """All joints of the linkage, records WHOLE."""
    return carray(run[AT.whole], count_of(run, AT.whole), WHOLE)


@part
def _chains_of(run: Run) -> Any:
    return carray(run[AT.chains], count_of(run, AT.chains), CHAIN)


@part
def _pins_of(run: Run) -> Any:
    """The loop closures with their working memory, as ``follow`` takes them."""
    whole, passive, rows = _whole_of(run), words_of(run, AT.follow), count_of(run, AT.body_places)
    p, columns, ends = len(passive), len(whole) + 2, count_of(run, AT.ends)
    return Pins(
        whole, passive, carray(run[AT.ends], ends, END), _chains_of(run), words_of(run, AT.row_joints),
        rows_of(run, AT.screws, rows, 6), numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds),
        carray(run[AT.loop_links], count_of(run, AT.loop_links), MOVED),
        rows_of(run, AT.pins, 3 * (ends // 2), columns), rows_of(run, AT.followed, p, columns),
        rows_of(run, AT.lower, p, p),
    )  # fmt: skip


@part
def _follow(run: Run) -> bool:
    """Solve the loop closure for positions and speeds of the passive joints; whether there is a solution."""
    coordinates, pins = coordinates_of(run), _pins_of(run)
    for w in range(len(pins.whole)):
        one = pins.whole[w]
        if one.coordinate < 0:
            continue
        if engine_of(run).coupled:
            one.wanted = one.speed = 0.0
            for k in range(world_of(run).joints):
                one.wanted += turns_of(run)[one.coordinate, k] * coordinates[k].mid_position
                one.speed += turns_of(run)[one.coordinate, k] * coordinates[k].mid_speed
        else:
            one.wanted, one.speed = coordinates[one.coordinate].mid_position, coordinates[one.coordinate].mid_speed
    return follow(pins, FAR) and move_followers(pins) > 0.0


@part
def _spread(run: Run) -> None:
    """Fill the matrix G from the coordinates to all rows, and the accelerations of the rows without theirs, G' qd."""
    coordinates, whole = coordinates_of(run), _whole_of(run)
    found = rows_of(run, AT.followed, count_of(run, AT.follow), len(whole) + 2)
    joint_of, rates = words_of(run, AT.row_joints), numbers_of(run, AT.body_rates)
    places, speeds = numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds)
    spread, m, n = rows_of(run, AT.spread, len(places), len(coordinates)), len(whole), world_of(run).joints
    for r in range(len(places)):
        joint = joint_of[r]
        if joint < 0:  # a rotor behind a spring, or one that several joints turn
            turned, factor = coordinates[-1 - joint], spread[r, -1 - joint]
            places[r], speeds[r] = factor * turned.mid_position, factor * turned.mid_speed
        elif whole[joint].coordinate < 0:
            a = whole[joint].follower
            rates[r] = -found[a, m + 1]
            for k in range(n):
                spread[r, k] = 0.0
            for w in range(m):
                driver = whole[w].coordinate
                if driver >= 0 and engine_of(run).coupled:
                    for k in range(n):
                        spread[r, k] -= found[a, w] * turns_of(run)[driver, k]
                elif driver >= 0:
                    spread[r, driver] = -found[a, w]


@part
def _add_chain(run: Run, chain: Any, spread: Any) -> float:
    """Add mass matrix and bias torques of a chain to those of the coordinates; returns its potential energy [J]."""
    size, entry = chain.rows, chain.entry
    first, last = chain.row, chain.row + size
    links = links_of(run)[chain.link : chain.link + size + chain.rotors]
    rotors = rotors_of(run)[chain.rotor : chain.rotor + chain.rotors]
    bodies = bodies_of(run)[chain.body : chain.body + chain.joints + chain.rotors + 1]
    places, speeds = numbers_of(run, AT.body_places)[first:last], numbers_of(run, AT.body_speeds)[first:last]
    bias, rotor_bias = numbers_of(run, AT.body_bias)[first:last], numbers_of(run, AT.body_rotor_bias)[first:last]
    mass = numbers_of(run, AT.body_mass)[entry : entry + size * size].reshape((size, size))
    rotor_mass = numbers_of(run, AT.body_rotor_mass)[entry : entry + size * size].reshape((size, size))
    rates = numbers_of(run, AT.body_rates)[first:last]
    mass_and_bias(links, rotors, places, speeds, bodies, mass, rotor_mass, bias, rotor_bias)
    for r in range(size):
        for j in range(size):
            bias[r] += mass[r, j] * rates[j]
            rotor_bias[r] += rotor_mass[r, j] * rates[j]
    add_bodies(run, first, spread[first:last], mass, rotor_mass, bias, rotor_bias)
    upwards = vector(bodies[len(bodies) - 1].dv)
    energy = dot(upwards, vector(bodies[0].first))
    for r in range(len(rotors)):
        if rotors[r].carrier < 0 and not rotors[r].balanced:
            energy += dot(upwards, vector(bodies[chain.joints + r].first))
    return energy


def loop_bodies(t: Any, h: Any, run: Any) -> None:
    """Compute mass matrix and bias torques of an arm with closed loops; the counterpart of ``equations.bodies``."""
    engine, chains = engine_of(run), _chains_of(run)
    engine.loops_open = 0 if _follow(run) else 1
    if engine.loops_open:
        return
    set_payload(run, t)
    _spread(run)
    spread = rows_of(run, AT.spread, count_of(run, AT.row_joints), world_of(run).coordinates)
    clear_bodies(run)
    engine.potential = 0.0
    for c in range(len(chains)):
        engine.potential += _add_chain(run, chains[c], spread)
    provide_bodies(run)
