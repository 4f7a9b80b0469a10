"""Mass matrix and bias of a scene along its coordinates: of an arm, of one whose motors are coupled, of one inertia."""

from __future__ import annotations

import math
from typing import Any

from numba import carray

from drivetrain.dynamics.core.equation_of_motion import BODY, mass_and_bias
from drivetrain.dynamics.core.records import LINK, ROTOR
from drivetrain.simulation.mechanics import PAYLOAD
from drivetrain.simulation.records import (
    AT,
    Run,
    coordinates_of,
    count_of,
    engine_of,
    joints_of,
    numbers_of,
    pairs_of,
    part,
    rows_of,
    world_of,
)


@part
def bodies_of(run: Run) -> Any:
    """The bodies of an arm as they move, links first, the base last."""
    return carray(run[AT.bodies], count_of(run, AT.bodies), BODY)


@part
def rotors_of(run: Run) -> Any:
    """The rotors of an arm that need a pass of their own."""
    return carray(run[AT.rotors], count_of(run, AT.rotors), ROTOR)


@part
def turns_of(run: Run) -> Any:
    """Joints' motion from that of the coordinates, where motors are coupled, (n, n)."""
    return rows_of(run, AT.turns, world_of(run).joints, world_of(run).joints)


@part
def _carry(run: Run, links: Any, t: float) -> None:
    """Put what the tip carries at an instant into the constants of the last link."""
    payloads, entry = carray(run[AT.payloads], count_of(run, AT.payloads), PAYLOAD), 0
    for k in range(1, len(payloads)):
        if payloads[k].time <= t:
            entry = k
    if len(payloads):
        link, carried = links[world_of(run).joints - 1], payloads[entry]
        link.mass, link.hx, link.hy, link.hz = carried.mass, carried.hx, carried.hy, carried.hz
        link.sxx, link.syy, link.szz = carried.sxx, carried.syy, carried.szz
        link.sxy, link.sxz, link.syz = carried.sxy, carried.sxz, carried.syz


@part
def _move_arm(run: Run, t: float) -> None:
    """Mass matrix and bias of an arm.

    Where motors are coupled the bodies' coordinates (joints, rotors on their own, rotors that follow several joints)
    follow from those of the mechanics by ``spread``; else they are the same.
    """
    engine, coordinates, pairs = engine_of(run), coordinates_of(run), pairs_of(run)
    e, c = engine.bodies, len(coordinates)
    places, speeds = numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds)
    bias, felt_bias = numbers_of(run, AT.body_bias), numbers_of(run, AT.body_felt_bias)
    mass, felt = rows_of(run, AT.body_mass, e, e), rows_of(run, AT.body_felt, e, e)
    links, spread = carray(run[AT.links], count_of(run, AT.links), LINK), rows_of(run, AT.spread, e, c)
    _carry(run, links, t)
    for r in range(e):
        if engine.coupled:
            places[r] = speeds[r] = 0.0
            for k in range(c):
                places[r] += spread[r, k] * coordinates[k].place
                speeds[r] += spread[r, k] * coordinates[k].guess
        else:
            places[r], speeds[r] = coordinates[r].place, coordinates[r].guess
    mass_and_bias(links, rotors_of(run), places, speeds, bodies_of(run), mass, felt, bias, felt_bias)
    if engine.coupled:
        _gather(run, spread, mass, felt, bias, felt_bias)
        return
    for i in range(c):
        coordinates[i].bias, coordinates[i].felt_bias = bias[i], felt_bias[i]
        for k in range(c):
            pairs[i, k].mass, pairs[i, k].felt = mass[i, k], felt[i, k]


@part
def _gather(run: Run, spread: Any, mass: Any, felt: Any, bias: Any, felt_bias: Any) -> None:
    """Mass matrix and bias along the coordinates, from those of the bodies, where motors are coupled."""
    coordinates, pairs, e, c = coordinates_of(run), pairs_of(run), len(mass), world_of(run).coordinates
    between = rows_of(run, AT.between, e, c)
    for r in range(e):
        for k in range(c):
            between[r, k] = 0.0
            for j in range(e):
                between[r, k] += mass[r, j] * spread[j, k]
    for i in range(c):
        one = coordinates[i]
        one.bias, one.felt_bias = 0.0, 0.0
        for r in range(e):
            one.bias += spread[r, i] * bias[r]
        if one.felt >= 0:
            one.felt_bias = one.factor * felt_bias[one.felt]
        for k in range(c):
            whole, own = 0.0, 0.0
            for r in range(e):
                whole += spread[r, i] * between[r, k]
                if one.felt >= 0:
                    own += felt[one.felt, r] * spread[r, k]
            pairs[i, k].mass, pairs[i, k].felt = whole, one.factor * own
        pairs[i, i].mass += one.own
        pairs[i, i].felt += one.own


@part
def move_bodies(run: Run, t: float) -> None:
    """Mass matrix and bias at the places and guessed speeds."""
    coordinates, pairs, joints, c = coordinates_of(run), pairs_of(run), joints_of(run), world_of(run).coordinates
    mass = rows_of(run, AT.mass, c, c)
    if engine_of(run).arm:
        _move_arm(run, t)
    else:
        for i in range(c):
            one, own = coordinates[i], pairs[i, i]
            own.mass, own.felt, one.bias = one.inertia, one.rotor, 0.0
            if one.weight != 0.0:
                one.bias = one.weight * math.cos(one.place + one.phase)
    for i in range(c):  # for effects, as a plain matrix
        for k in range(c):
            mass[i, k] = pairs[i, k].mass
    for i in range(len(joints)):
        joints[i].bias_torque = coordinates[i].bias
