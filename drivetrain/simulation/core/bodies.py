"""Mass matrix and bias torques of a scene in its coordinates; pose of the arm's tip and forces on it."""

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
    """The moving bodies of an arm, records BODY: links, then rotors, the base last."""
    return carray(run[AT.bodies], count_of(run, AT.bodies), BODY)


@part
def rotors_of(run: Run) -> Any:
    """The rotors of an arm that are bodies of their own, records ROTOR."""
    return carray(run[AT.rotors], count_of(run, AT.rotors), ROTOR)


@part
def links_of(run: Run) -> Any:
    """The constant data of an arm's links, of rotors behind springs, and of all other rotors, records LINK."""
    return carray(run[AT.links], count_of(run, AT.links), LINK)


@part
def turns_of(run: Run) -> Any:
    """Matrix from the motion of the coordinates (shafts) to that of the joints, where motors are coupled, (n, n)."""
    return rows_of(run, AT.turns, world_of(run).joints, world_of(run).joints)


@part
def set_payload(run: Run, t: float) -> None:
    """Set the inertial data of the last link to those with the payload that the tip carries at time t [s]."""
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
    """Mass matrix and bias torques of an arm.

    Where motors are coupled, the coordinates of the bodies (joints, rotors behind springs, rotors that turn with
    several joints) are ``spread`` times those of the mechanics; otherwise both are the same.
    """
    engine, coordinates, pairs = engine_of(run), coordinates_of(run), pairs_of(run)
    e, c = engine.bodies, len(coordinates)
    places, speeds = numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds)
    bias, rotor_bias = numbers_of(run, AT.body_bias), numbers_of(run, AT.body_rotor_bias)
    mass, rotor_mass = rows_of(run, AT.body_mass, e, e), rows_of(run, AT.body_rotor_mass, e, e)
    links, spread = links_of(run), rows_of(run, AT.spread, e, c)
    set_payload(run, t)
    for r in range(e):
        if engine.coupled:
            places[r] = speeds[r] = 0.0
            for k in range(c):
                places[r] += spread[r, k] * coordinates[k].mid_position
                speeds[r] += spread[r, k] * coordinates[k].mid_speed
        else:
            places[r], speeds[r] = coordinates[r].mid_position, coordinates[r].mid_speed
    mass_and_bias(links, rotors_of(run), places, speeds, bodies_of(run), mass, rotor_mass, bias, rotor_bias)
    if engine.coupled:
        clear_bodies(run)
        add_bodies(run, 0, spread, mass, rotor_mass, bias, rotor_bias)
        return
    for i in range(c):
        coordinates[i].bias, coordinates[i].rotor_bias = bias[i], rotor_bias[i]
        for k in range(c):
            pairs[i, k].mass, pairs[i, k].rotor_mass = mass[i, k], rotor_mass[i, k]


@part
def clear_bodies(run: Run) -> None:
    """Reset mass matrix and bias torques, to the inertias of the rotors reflected to their shafts."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    for i in range(len(coordinates)):
        coordinates[i].bias = coordinates[i].rotor_bias = 0.0
        for k in range(len(coordinates)):
            pairs[i, k].mass = pairs[i, k].rotor_mass = coordinates[i].shaft_inertia if k == i else 0.0


@part
def add_bodies(run: Run, first: int, spread: Any, mass: Any, rotor_mass: Any, bias: Any, rotor_bias: Any) -> None:
    """Add mass matrix and bias torques of bodies whose motion is ``spread`` times that of the coordinates.

    With G for ``spread``: G^T M G and G^T b. ``first`` is the row of the first of these bodies. The part that acts on a
    motor's rotor (``rotor_mass``) is the row of the body that the motor turns.
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
        one, row = coordinates[i], coordinates[i].rotor_row - first
        for r in range(e):
            one.bias += spread[r, i] * bias[r]
            for k in range(c):
                pairs[i, k].mass += spread[r, i] * between[r, k]
        if 0 <= row < e:
            one.rotor_bias += spread[row, i] * rotor_bias[row]
            for k in range(c):
                for j in range(e):
                    pairs[i, k].rotor_mass += spread[row, i] * rotor_mass[row, j] * spread[j, k]


@part
def move_bodies(run: Run, t: float) -> None:
    """Compute mass matrix and bias torques at the positions and guessed speeds of the middle of the step."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    if engine_of(run).arm:
        _move_arm(run, t)
    else:
        for i in range(len(coordinates)):
            one, own = coordinates[i], pairs[i, i]
            own.mass, own.rotor_mass, one.bias = one.inertia, one.rotor, 0.0
            if one.weight != 0.0:
                one.bias = one.weight * math.cos(one.mid_position + one.phase)
    provide_bodies(run)


@part
def provide_bodies(run: Run) -> None:
    """Provide mass matrix and bias torques to the effects, and the motion of the tip if an effect uses it."""
    coordinates, pairs, joints, c = coordinates_of(run), pairs_of(run), joints_of(run), world_of(run).coordinates
    mass = rows_of(run, AT.mass, c, c)
    for i in range(c):  # effects read it as a plain matrix
        for k in range(c):
            mass[i, k] = pairs[i, k].mass
    for i in range(len(joints)):
        joints[i].bias_torque = coordinates[coordinates[i].link].bias
    if engine_of(run).arm and engine_of(run).uses_tip:
        fill_tip(run)


@part
def fill_tip(run: Run) -> None:
    """Fill position, velocity and angular velocity of the tip, in the base frame."""
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
def effective_damping(tip: Any, step: float, k: int) -> float:
    """Entry k (xx, xy, xz, yy, yz, zz) of the effective damping at the tip, damping + step * stiffness [N s/m]."""
    return tip.damping[k] + step * tip.stiffness[k]


@part
def _damping_force(tip: Any, step: float, a: Vector) -> Vector:
    """Effective damping at the tip times a velocity [N]."""
    xx, xy, xz = effective_damping(tip, step, 0), effective_damping(tip, step, 1), effective_damping(tip, step, 2)
    yy, yz, zz = effective_damping(tip, step, 3), effective_damping(tip, step, 4), effective_damping(tip, step, 5)
    return (
        xx * a[0] + xy * a[1] + xz * a[2],
        xy * a[0] + yy * a[1] + yz * a[2],
        xz * a[0] + yz * a[1] + zz * a[2],
    )


@part
def _tip_screw(run: Run, k: int) -> tuple[Vector, Vector]:
    """Column of the tip's Jacobian for coordinate k: angular velocity, and velocity at the base's origin."""
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
def _tip_column(run: Run, k: int) -> Vector:
    """Velocity of the tip per unit speed of coordinate k."""
    turn, slide = _tip_screw(run, k)
    return plus(slide, cross(turn, vector(engine_of(run).tip_place)))


@part
def move_tip_to_trial(run: Run, shift: float) -> None:
    """Move the tip to the trial speeds of the coordinates, and store the force that the solution assumed there."""
    engine, tip, coordinates = engine_of(run), world_of(run).tip, coordinates_of(run)
    before, speed, turning = vector(tip.speed), vector(engine.tip_speed), vector(engine.tip_turning)
    for k in range(world_of(run).joints):
        more = coordinates[k].trial_speed - coordinates[k].mid_speed
        speed = plus(speed, times(more, _tip_column(run, k)))
        turning = plus(turning, times(more, _tip_screw(run, k)[0]))
    put(tip.speed, speed)
    put(tip.turning, turning)
    put(tip.place, plus(vector(engine.tip_place), times(shift, minus(speed, vector(engine.tip_speed)))))
    put(engine.tip_expected, minus(vector(tip.force), _damping_force(tip, shift, minus(speed, before))))


@part
def tip_converged(run: Run, shift: float) -> bool:
    """Whether the force at the tip agrees with the force that the solution assumed, apart from rounding."""
    tip, expected, error, size = world_of(run).tip, engine_of(run).tip_expected, 0.0, 0.0
    for r in range(3):
        error = max(error, abs(tip.force[r] - expected[r]))
        size = max(size, abs(tip.force[r]), abs(expected[r]))
    xx, yy, zz = effective_damping(tip, shift, 0), effective_damping(tip, shift, 3), effective_damping(tip, shift, 5)
    stiff = max(0.0, xx, yy, zz)
    far = max(abs(tip.place[0]), abs(tip.place[1]), abs(tip.place[2])) + 1.0
    fast = max(abs(tip.speed[0]), abs(tip.speed[1]), abs(tip.speed[2]))
    return error <= 1e-12 * size + 2e-15 * stiff * (fast + far / shift)


@part
def clear_tip(tip: Any) -> None:
    """Reset the forces on the tip, before effects contribute to them."""
    for k in range(3):
        tip.force[k] = tip.moment[k] = 0.0
    for k in range(6):
        tip.damping[k] = tip.stiffness[k] = 0.0


@part
def add_tip(run: Run, h: float, theta: float) -> None:
    """Add the forces on the tip to the linear system, and to the torques transmitted by the meshes."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    tip, joints = world_of(run).tip, world_of(run).joints
    step, moment, force = theta * h, vector(tip.moment), vector(tip.force)
    for k in range(joints):
        one = coordinates[k]
        soft = _damping_force(tip, step, _tip_column(run, k))
        late = one.trial_speed - one.speed
        force = plus(force, times(late, soft))
        for i in range(joints):
            entry = dot(_tip_column(run, i), soft)
            pairs[i, k].matrix += step * entry
            if coordinates[i].motor == i:
                pairs[i, k].transmitted += theta * entry
    for i in range(joints):
        torque = dot(_tip_column(run, i), force) + dot(_tip_screw(run, i)[0], moment)
        coordinates[i].impulse += h * torque
        joints_of(run)[i].tip_torque = torque
        if coordinates[i].motor == i:
            coordinates[i].transmitted -= torque
