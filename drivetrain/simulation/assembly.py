"""The linear system of a step: mass matrix and bias, and the forces of joints, gears, motors and the tip."""

from __future__ import annotations

from drivetrain.simulation.bodies import turns_of
from drivetrain.simulation.records import (
    Run,
    coordinates_of,
    engine_of,
    joints_of,
    pairs_of,
    part,
)
from drivetrain.simulation.tip import add_tip

STIFF_FROM = 1.5  # inertia with springs and dampers in it, over that without: a step no longer follows what they do


@part
def show_coupled(run: Run) -> None:
    """What joints whose motors are coupled do when the shafts behind the gears do what has been found."""
    coordinates, joints, turns = coordinates_of(run), joints_of(run), turns_of(run)
    for i in range(len(joints)):
        if coordinates[i].coupled:
            place, speed, joint = 0.0, 0.0, joints[i]
            for k in range(len(joints)):
                place += turns[i, k] * coordinates[k].place
                speed += turns[i, k] * coordinates[k].guess
            joint.shaft.position, joint.shaft.speed = coordinates[i].place, coordinates[i].guess
            joint.load.position, joint.load.speed = place, speed


@part
def _add_coupled(run: Run, h: float, theta: float) -> None:
    """Smooth torques at joints whose motors are coupled join the linear system of their shafts."""
    coordinates, pairs, joints, turns = coordinates_of(run), pairs_of(run), joints_of(run), turns_of(run)
    n = len(joints)
    for i in range(n):
        if not coordinates[i].coupled:
            continue
        load = joints[i].load
        soft, torque = load.damping + theta * h * load.stiffness, load.torque
        for k in range(n):
            torque += soft * turns[i, k] * (coordinates[k].guess - coordinates[k].speed)
        for k in range(n):
            if not coordinates[k].coupled:
                continue
            coordinates[k].right += h * turns[i, k] * torque
            coordinates[k].transmitted -= turns[i, k] * torque
            for j in range(n):
                entry = theta * soft * turns[i, k] * turns[i, j]
                pairs[k, j].matrix += h * entry
                pairs[k, j].transmitted += entry


@part
def _bounds(run: Run, i: int, m: int) -> bool:
    """The bounds of dry friction of a joint and its motor; whether there are any."""
    coordinates = coordinates_of(run)
    joint, size = joints_of(run)[i], abs(coordinates[i].ratio)
    link, rotor, load, motor, mesh = coordinates[i].dry, coordinates[m].dry, joint.load, joint.motor, joint.mesh
    own, drag = link.joint, rotor.motor
    own.hold_forward, own.hold_backward = load.hold_forward, load.hold_backward
    own.slide_forward, own.slide_backward = load.slide_forward, load.slide_backward
    drag.hold_forward, drag.hold_backward = size * motor.hold_forward, size * motor.hold_backward
    drag.slide_forward, drag.slide_backward = size * motor.slide_forward, size * motor.slide_backward
    if coordinates[i].ratio < 0.0:
        drag.hold_forward, drag.hold_backward = drag.hold_backward, drag.hold_forward
        drag.slide_forward, drag.slide_backward = drag.slide_backward, drag.slide_forward
    rotor.driving, rotor.driven = mesh.driving, mesh.driven
    at_joint = own.hold_forward + own.hold_backward + own.slide_forward + own.slide_backward
    at_motor = drag.hold_forward + drag.hold_backward + drag.slide_forward + drag.slide_backward
    at_motor += abs(mesh.driving) + abs(mesh.driven)
    link.active = 1 if at_joint > 0.0 else 0
    if at_motor > 0.0:
        rotor.active = 1
    elif m != i:
        rotor.active = 0
    return at_joint + at_motor > 0.0


@part
def _mesh(run: Run, h: float, i: int, soft: float, torque: float) -> None:
    """What the mesh of a rigid joint transmits, and how that changes with the speeds."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    coordinates[i].transmitted = coordinates[i].bias - coordinates[i].felt_bias - torque
    for k in range(len(coordinates)):
        pairs[i, k].transmitted = (pairs[i, k].mass - pairs[i, k].felt) / h
    pairs[i, i].transmitted += soft


@part
def _spring(run: Run, h: float, theta: float, i: int, m: int, late: float) -> None:
    """The spring of a flexible joint between its link i and its rotor m."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    spring = joints_of(run)[i].spring
    slope = spring.damping + theta * h * spring.stiffness
    torque, stiff = spring.torque - slope * late, theta * slope
    coordinates[i].right += h * torque
    coordinates[m].right -= h * torque
    pairs[i, i].matrix += h * stiff
    pairs[m, m].matrix += h * stiff
    pairs[i, m].matrix -= h * stiff
    pairs[m, i].matrix -= h * stiff
    coordinates[m].transmitted = torque
    for k in range(len(coordinates)):
        pairs[m, k].transmitted = 0.0
    pairs[m, m].transmitted = stiff
    pairs[m, i].transmitted = -stiff


@part
def assemble(run: Run, h: float, theta: float) -> bool:
    """The linear system of the step, and the bounds of friction.

    Args:
        h: Step [s]; 1 at an instant.

    Returns:
        Whether there is any dry friction.
    """
    coordinates, pairs, joints = coordinates_of(run), pairs_of(run), joints_of(run)
    c, engine, dry = len(coordinates), engine_of(run), False
    for i in range(c):
        one = coordinates[i]
        one.right = -h * coordinates[i].bias
        one.relative = one.speed
        for k in range(c):
            pairs[i, k].matrix = pairs[i, k].mass
    for i in range(len(joints)):
        m, ratio, joint = coordinates[i].motor, coordinates[i].ratio, joints[i]
        one, rotor = coordinates[i], coordinates[m]
        flange = joint.shaft if coordinates[i].coupled else joint.load
        soft = flange.damping + theta * h * flange.stiffness
        torque = flange.torque + soft * (coordinates[i].guess - one.speed)
        one.right += h * torque
        one.surface = joint.load.surface_speed
        one.relative -= one.surface
        pairs[i, i].matrix += theta * h * soft
        motor = (joint.motor.damping + theta * h * joint.motor.stiffness) * (ratio * ratio)
        rotor.right += h * (ratio * joint.motor.torque + motor * (coordinates[m].guess - rotor.speed))
        pairs[m, m].matrix += theta * h * motor
        found = _bounds(run, i, m)
        dry = dry or found
        if m == i:
            _mesh(run, h, i, theta * soft, torque)
        else:
            _spring(run, h, theta, i, m, rotor.trial - one.trial - (rotor.speed - one.speed))
    if engine.coupled:
        _add_coupled(run, h, theta)
    if engine.uses_tip:
        add_tip(run, h, theta)
    engine.stiff = 0
    for i in range(c):
        if pairs[i, i].matrix > STIFF_FROM * pairs[i, i].mass:
            engine.stiff = 1
    return dry
