"""Mass matrix and bias of a scene along its coordinates, and where the tip of an arm is and what surrounds it."""

from __future__ import annotations

import math
from typing import Any

from numba import carray

from drivetrain.dynamics.core.equation_of_motion import BODY, mass_and_bias
from drivetrain.dynamics.core.records import LINK, ROTOR
from drivetrain.dynamics.core.vectors import Vector, cross, dot, minus, plus, put, times, turned, vector
from drivetrain.simulation.core.records import (
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
from drivetrain.simulation.planning.mechanics import PAYLOAD


@part
def bodies_of(run: Run) -> Any:
    """The bodies of an arm as they move, links first, the base last."""
    return carray(run[AT.bodies], count_of(run, AT.bodies), BODY)


@part
def rotors_of(run: Run) -> Any:
    """The rotors of an arm that need a pass of their own."""
    return carray(run[AT.rotors], count_of(run, AT.rotors), ROTOR)


@part
def links_of(run: Run) -> Any:
    """The constants of an arm's links, rotors on their own and rotors."""
    return carray(run[AT.links], count_of(run, AT.links), LINK)


@part
def turns_of(run: Run) -> Any:
    """Joints' motion from that of the coordinates, where motors are coupled, (n, n)."""
    return rows_of(run, AT.turns, world_of(run).joints, world_of(run).joints)


@part
def carry(run: Run, t: float) -> None:
    """Put what the tip carries at an instant into the constants of the last link."""
    links, payloads, entry = links_of(run), carray(run[AT.payloads], count_of(run, AT.payloads), PAYLOAD), 0
    for k in range(1, len(payloads)):
        if payloads[k].time <= t:
            entry = k
    if len(payloads):
        link, carried = links[engine_of(run).last], payloads[entry]
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
    links, spread = links_of(run), rows_of(run, AT.spread, e, c)
    carry(run, t)
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
        clear_bodies(run)
        add_bodies(run, 0, spread, mass, felt, bias, felt_bias)
        return
    for i in range(c):
        coordinates[i].bias, coordinates[i].felt_bias = bias[i], felt_bias[i]
        for k in range(c):
            pairs[i, k].mass, pairs[i, k].felt = mass[i, k], felt[i, k]


@part
def clear_bodies(run: Run) -> None:
    """Nothing moves with the coordinates yet but reflected rotors at shafts."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    for i in range(len(coordinates)):
        coordinates[i].bias = coordinates[i].felt_bias = 0.0
        for k in range(len(coordinates)):
            pairs[i, k].mass = pairs[i, k].felt = coordinates[i].own if k == i else 0.0


@part
def add_bodies(run: Run, first: int, spread: Any, mass: Any, felt: Any, bias: Any, felt_bias: Any) -> None:
    """Mass matrix and bias of bodies, of which ``first`` is the first, that move as ``spread`` times the coordinates.

    With G for ``spread``: G^T M G and G^T b; a motor feels the row of what it turns.
    """
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    e, c = spread.shape
    between = rows_of(run, AT.between, e, c)
    for r in range(e):
        for k in range(c):
            between[r, k] = 0.0
            for j in range(e):
                between[r, k] += mass[r, j] * spread[j, k]
    for i in range(c):
        one, row = coordinates[i], coordinates[i].felt - first
        for r in range(e):
            one.bias += spread[r, i] * bias[r]
            for k in range(c):
                pairs[i, k].mass += spread[r, i] * between[r, k]
        if 0 <= row < e:
            one.felt_bias += spread[row, i] * felt_bias[row]
            for k in range(c):
                for j in range(e):
                    pairs[i, k].felt += spread[row, i] * felt[row, j] * spread[j, k]


@part
def move_bodies(run: Run, t: float) -> None:
    """Mass matrix and bias at the places and guessed speeds."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    if engine_of(run).arm:
        _move_arm(run, t)
    else:
        for i in range(len(coordinates)):
            one, own = coordinates[i], pairs[i, i]
            own.mass, own.felt, one.bias = one.inertia, one.rotor, 0.0
            if one.weight != 0.0:
                one.bias = one.weight * math.cos(one.place + one.phase)
    show_bodies(run)


@part
def show_bodies(run: Run) -> None:
    """Provide mass matrix and bias to effects, and the pose of the tip if it is used."""
    coordinates, pairs, joints, c = coordinates_of(run), pairs_of(run), joints_of(run), world_of(run).coordinates
    mass = rows_of(run, AT.mass, c, c)
    for i in range(c):  # for effects, as a plain matrix
        for k in range(c):
            mass[i, k] = pairs[i, k].mass
    for i in range(len(joints)):
        joints[i].bias_torque = coordinates[i].bias
    if engine_of(run).arm and engine_of(run).uses_tip:
        show_tip(run)


@part
def show_tip(run: Run) -> None:
    """Fill place, speed and turning of the tip, along the axes of the base."""
    engine, tip, body = engine_of(run), world_of(run).tip, bodies_of(run)[engine_of(run).last]
    place = plus(vector(body.origin), turned(body.rotation, vector(engine.tip_offset)))
    turning = vector(body.w)
    speed = plus(vector(body.v), cross(turning, place))
    put(tip.place, place)
    put(tip.speed, speed)
    put(tip.turning, turning)
    put(engine.tip_place, place)
    put(engine.tip_speed, speed)
    put(engine.tip_turning, turning)


@part
def softness(tip: Any, step: float, k: int) -> float:
    """Entry k (xx, xy, xz, yy, yz, zz) of damping and stiffness together [N s/m]."""
    return tip.damping[k] + step * tip.stiffness[k]


@part
def _resisting(tip: Any, step: float, a: Vector) -> Vector:
    """Damping and stiffness together, times a speed [N]."""
    xx, xy, xz = softness(tip, step, 0), softness(tip, step, 1), softness(tip, step, 2)
    yy, yz, zz = softness(tip, step, 3), softness(tip, step, 4), softness(tip, step, 5)
    return (
        xx * a[0] + xy * a[1] + xz * a[2],
        xy * a[0] + yy * a[1] + yz * a[2],
        xz * a[0] + yz * a[1] + zz * a[2],
    )


@part
def _screw(run: Run, k: int) -> tuple[Vector, Vector]:
    """Turning of the tip, and speed at the base's origin, for a unit speed of a coordinate."""
    bodies, engine = bodies_of(run), engine_of(run)
    if engine.direct:
        return vector(bodies[k].turn), vector(bodies[k].slide)
    spread = rows_of(run, AT.spread, engine.bodies, world_of(run).coordinates)
    turn = slide = (0.0, 0.0, 0.0)
    for j in range(engine.last + 1):
        turn = plus(turn, times(spread[j, k], vector(bodies[j].turn)))
        slide = plus(slide, times(spread[j, k], vector(bodies[j].slide)))
    return turn, slide


@part
def _column(run: Run, k: int) -> Vector:
    """Speed of the tip for a unit speed of a coordinate."""
    turn, slide = _screw(run, k)
    return plus(slide, cross(turn, vector(engine_of(run).tip_place)))


@part
def try_tip(run: Run, shift: float) -> None:
    """Move the tip from the guess to the trial, and note what force a solution expects."""
    engine, tip, coordinates = engine_of(run), world_of(run).tip, coordinates_of(run)
    before, speed, turning = vector(tip.speed), vector(engine.tip_speed), vector(engine.tip_turning)
    for k in range(world_of(run).joints):
        more = coordinates[k].trial - coordinates[k].guess
        speed = plus(speed, times(more, _column(run, k)))
        turning = plus(turning, times(more, _screw(run, k)[0]))
    put(tip.speed, speed)
    put(tip.turning, turning)
    put(tip.place, plus(vector(engine.tip_place), times(shift, minus(speed, vector(engine.tip_speed)))))
    put(engine.tip_expected, minus(vector(tip.force), _resisting(tip, shift, minus(speed, before))))
    for k in range(6):
        engine.tip_damping[k], engine.tip_stiffness[k] = tip.damping[k], tip.stiffness[k]


@part
def calm_tip(run: Run) -> None:
    """Take the mean of how forces fall now and of how they did when last asked: it ends going round in circles."""
    engine, tip = engine_of(run), world_of(run).tip
    for k in range(6):
        tip.damping[k] = 0.5 * (tip.damping[k] + engine.tip_damping[k])
        tip.stiffness[k] = 0.5 * (tip.stiffness[k] + engine.tip_stiffness[k])


@part
def tip_agrees(run: Run, shift: float) -> bool:
    """Whether the surroundings answer what the solution expects of them."""
    tip, expected, off, size = world_of(run).tip, engine_of(run).tip_expected, 0.0, 0.0
    for r in range(3):
        off = max(off, abs(tip.force[r] - expected[r]))
        size = max(size, abs(tip.force[r]), abs(expected[r]))
    stiff = max(0.0, softness(tip, shift, 0), softness(tip, shift, 3), softness(tip, shift, 5))
    far = max(abs(tip.place[0]), abs(tip.place[1]), abs(tip.place[2])) + 1.0
    fast = max(abs(tip.speed[0]), abs(tip.speed[1]), abs(tip.speed[2]))
    return off <= 1e-12 * size + 2e-15 * stiff * (fast + far / shift)


@part
def clear_tip(tip: Any) -> None:
    """Nothing acts on the tip yet."""
    for k in range(3):
        tip.force[k] = tip.moment[k] = 0.0
    for k in range(6):
        tip.damping[k] = tip.stiffness[k] = 0.0


@part
def add_tip(run: Run, h: float, theta: float) -> None:
    """What the surroundings do to the tip joins the linear system, and what meshes transmit."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    tip, joints = world_of(run).tip, world_of(run).joints
    step, moment, force = theta * h, vector(tip.moment), vector(tip.force)
    for k in range(joints):
        one = coordinates[k]
        soft = _resisting(tip, step, _column(run, k))
        late = one.trial - one.speed
        force = plus(force, times(late, soft))
        for i in range(joints):
            entry = dot(_column(run, i), soft)
            pairs[i, k].matrix += step * entry
            if coordinates[i].motor == i:
                pairs[i, k].transmitted += theta * entry
    for i in range(joints):
        torque = dot(_column(run, i), force) + dot(_screw(run, i)[0], moment)
        coordinates[i].right += h * torque
        if coordinates[i].motor == i:
            coordinates[i].transmitted -= torque
