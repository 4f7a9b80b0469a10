"""Mass matrix and bias of a scene along its coordinates: of an arm, of one whose motors are coupled, of one inertia."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.dynamics.core.equation_of_motion import BODY, mass_and_bias
from drivetrain.dynamics.core.records import LINK, ROTOR
from drivetrain.simulation.mechanics import PAYLOAD
from drivetrain.simulation.records import (
    Run,
    numbers_of,
    part,
    square_of,
)


@part
def bodies_of(run: Run) -> Any:
    """The bodies of an arm as they move, links first, the base last."""
    return numbers_of(run.numbers, run.head[0].engine.at.bodies).view(BODY)


@part
def rotors_of(run: Run) -> Any:
    """The rotors of an arm that need a pass of their own."""
    return numbers_of(run.numbers, run.head[0].engine.at.rotors).view(ROTOR)


@part
def turns_of(run: Run) -> Any:
    """Joints' motion from that of the coordinates, where motors are coupled, (n, n)."""
    return square_of(run.numbers, run.head[0].engine.at.turns, len(run.joints))


@part
def _carry(run: Run, links: Any, t: float) -> None:
    """Put what the tip carries at an instant into the constants of the last link."""
    payloads, entry = numbers_of(run.numbers, run.head[0].engine.at.payloads).view(PAYLOAD), 0
    for k in range(1, len(payloads)):
        if payloads[k].time <= t:
            entry = k
    if len(payloads):
        link, carried = links[len(run.joints) - 1], payloads[entry]
        link.mass, link.hx, link.hy, link.hz = carried.mass, carried.hx, carried.hy, carried.hz
        link.sxx, link.syy, link.szz = carried.sxx, carried.syy, carried.szz
        link.sxy, link.sxz, link.syz = carried.sxy, carried.sxz, carried.syz


@part
def _move_arm(run: Run, t: float) -> None:
    """Mass matrix and bias of an arm.

    Where motors are coupled the bodies' coordinates (joints, rotors on their own, rotors that follow several joints)
    follow from those of the mechanics by ``spread``; else they are the same.
    """
    numbers, engine, coordinates, pairs = run.numbers, run.head[0].engine, run.coordinates, run.pairs
    at, e, c = engine.at, engine.bodies, len(coordinates)
    places, speeds = numbers_of(numbers, at.body_places), numbers_of(numbers, at.body_speeds)
    bias, felt_bias = numbers_of(numbers, at.body_bias), numbers_of(numbers, at.body_felt_bias)
    mass, felt = square_of(numbers, at.body_mass, e), square_of(numbers, at.body_felt, e)
    links, spread = numbers_of(numbers, at.links).view(LINK), square_of(numbers, at.spread, c)
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
    coordinates, pairs, e, c = run.coordinates, run.pairs, len(mass), len(run.coordinates)
    between = square_of(run.numbers, run.head[0].engine.at.between, c)
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
    coordinates, joints, c = run.coordinates, run.joints, len(run.coordinates)
    mass = square_of(run.numbers, run.head[0].engine.at.mass, c)
    if run.head[0].engine.arm:
        _move_arm(run, t)
    else:
        for i in range(c):
            one, own = coordinates[i], run.pairs[i, i]
            own.mass, own.felt, one.bias = one.inertia, one.rotor, 0.0
            if one.weight != 0.0:
                one.bias = one.weight * math.cos(one.place + one.phase)
    for i in range(c):  # for effects, as a plain matrix
        for k in range(c):
            mass[i, k] = run.pairs[i, k].mass
    for i in range(len(joints)):
        joints[i].bias_torque = coordinates[i].bias
