"""The linear system of a step: mass matrix and bias, and the forces of joints, gears, motors and the tip."""

from __future__ import annotations

from drivetrain.simulation.records import Run, inlined, numbers_of, part, square_of
from drivetrain.simulation.tip import add_tip

STIFF_FROM = 1.5  # inertia with springs and dampers in it, over that without: a step no longer follows what they do


@inlined
def show_coupled(run: Run) -> None:
    """What joints whose motors are coupled do when the shafts behind the gears do what has been found."""
    joints, guess, places, turns = run.joints, run.guess, run.places, run.turns
    for i in range(len(joints)):
        if run.drives[i].coupled:
            place, speed, joint = 0.0, 0.0, joints[i]
            for k in range(len(joints)):
                place += turns[i, k] * places[k]
                speed += turns[i, k] * guess[k]
            joint.shaft.position, joint.shaft.speed = places[i], guess[i]
            joint.load.position, joint.load.speed = place, speed


@part
def spread_motion(run: Run) -> None:
    """Places and speeds of the bodies' coordinates, where motors are coupled."""
    numbers, at, c = run.numbers, run.engine[0].at, len(run.coordinates)
    places, speeds = numbers_of(numbers, at.body_places), numbers_of(numbers, at.body_speeds)
    spread = square_of(numbers, at.spread, c)
    for r in range(len(places)):
        place, speed = 0.0, 0.0
        for k in range(c):
            place += spread[r, k] * run.places[k]
            speed += spread[r, k] * run.guess[k]
        places[r], speeds[r] = place, speed


@part
def gather_bodies(run: Run) -> None:
    """Mass matrix and bias along the coordinates, from those of the bodies, where motors are coupled."""
    numbers, at, e, c = run.numbers, run.engine[0].at, run.engine[0].bodies, len(run.coordinates)
    bias, felt_bias = numbers_of(numbers, at.body_bias), numbers_of(numbers, at.body_felt_bias)
    mass, felt = square_of(numbers, at.body_mass, e), square_of(numbers, at.body_felt, e)
    spread, between = square_of(numbers, at.spread, c), square_of(numbers, at.between, c)
    for r in range(e):
        for k in range(c):
            entry = 0.0
            for j in range(e):
                entry += mass[r, j] * spread[j, k]
            between[r, k] = entry
    for i in range(c):
        one, value = run.coordinates[i], 0.0
        for r in range(e):
            value += spread[r, i] * bias[r]
        run.bias[i] = value
        run.felt_bias[i] = one.factor * felt_bias[one.felt] if one.felt >= 0 else 0.0
        for k in range(c):
            whole, own = 0.0, 0.0
            for r in range(e):
                whole += spread[r, i] * between[r, k]
                if one.felt >= 0:
                    own += felt[one.felt, r] * spread[r, k]
            run.mass[i, k], run.felt[i, k] = whole, one.factor * own
        run.mass[i, i] += one.own
        run.felt[i, i] += one.own


@inlined
def _add_coupled(run: Run, h: float, theta: float) -> None:
    """Smooth torques at joints whose motors are coupled join the linear system of their shafts."""
    coordinates, joints, drives, turns = run.coordinates, run.joints, run.drives, run.turns
    n = len(joints)
    for i in range(n):
        if not drives[i].coupled:
            continue
        load = joints[i].load
        soft, torque = load.damping + theta * h * load.stiffness, load.torque
        for k in range(n):
            torque += soft * turns[i, k] * (run.guess[k] - coordinates[k].speed)
        for k in range(n):
            if not drives[k].coupled:
                continue
            coordinates[k].right += h * turns[i, k] * torque
            coordinates[k].transmitted -= turns[i, k] * torque
            for j in range(n):
                entry = theta * soft * turns[i, k] * turns[i, j]
                run.system.matrix[k, j] += h * entry
                run.system.transmitted[k, j] += entry


@inlined
def _bounds(run: Run, i: int, m: int) -> bool:
    """The bounds of dry friction of a joint and its motor; whether there are any."""
    coordinates, drives = run.coordinates, run.drives
    joint, size = run.joints[i], abs(drives[i].ratio)
    link, rotor, load, motor, mesh = coordinates[i].dry, coordinates[m].dry, joint.load, joint.motor, joint.mesh
    own, drag = link.joint, rotor.motor
    own.hold_forward, own.hold_backward = load.hold_forward, load.hold_backward
    own.slide_forward, own.slide_backward = load.slide_forward, load.slide_backward
    drag.hold_forward, drag.hold_backward = size * motor.hold_forward, size * motor.hold_backward
    drag.slide_forward, drag.slide_backward = size * motor.slide_forward, size * motor.slide_backward
    if drives[i].ratio < 0.0:
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


@inlined
def _mesh(run: Run, h: float, i: int, soft: float, torque: float) -> None:
    """What the mesh of a rigid joint transmits, and how that changes with the speeds."""
    coordinates, transmitted = run.coordinates, run.system.transmitted
    coordinates[i].transmitted = run.bias[i] - run.felt_bias[i] - torque
    for k in range(len(coordinates)):
        transmitted[i, k] = (run.mass[i, k] - run.felt[i, k]) / h
    transmitted[i, i] += soft


@inlined
def _spring(run: Run, h: float, theta: float, i: int, m: int, late: float) -> None:
    """The spring of a flexible joint between its link i and its rotor m."""
    coordinates, transmitted = run.coordinates, run.system.transmitted
    spring, matrix = run.joints[i].spring, run.system.matrix
    slope = spring.damping + theta * h * spring.stiffness
    torque, stiff = spring.torque - slope * late, theta * slope
    coordinates[i].right += h * torque
    coordinates[m].right -= h * torque
    matrix[i, i] += h * stiff
    matrix[m, m] += h * stiff
    matrix[i, m] -= h * stiff
    matrix[m, i] -= h * stiff
    coordinates[m].transmitted = torque
    for k in range(len(coordinates)):
        transmitted[m, k] = 0.0
    transmitted[m, m] = stiff
    transmitted[m, i] = -stiff


@part
def assemble(run: Run, h: float, theta: float) -> bool:
    """The linear system of the step, and the bounds of friction.

    Args:
        h: Step [s]; 1 at an instant.

    Returns:
        Whether there is any dry friction.
    """
    coordinates, joints, drives = run.coordinates, run.joints, run.drives
    guess, mass, matrix = run.guess, run.mass, run.system.matrix
    c, engine, dry = len(coordinates), run.engine[0], False
    for i in range(c):
        one = coordinates[i]
        one.right = -h * run.bias[i]
        one.relative = one.speed
        for k in range(c):
            matrix[i, k] = mass[i, k]
    for i in range(len(joints)):
        m, ratio, joint = drives[i].motor, drives[i].ratio, joints[i]
        one, rotor = coordinates[i], coordinates[m]
        flange = joint.shaft if drives[i].coupled else joint.load
        soft = flange.damping + theta * h * flange.stiffness
        torque = flange.torque + soft * (guess[i] - one.speed)
        one.right += h * torque
        one.surface = joint.load.surface_speed
        one.relative -= one.surface
        matrix[i, i] += theta * h * soft
        motor = (joint.motor.damping + theta * h * joint.motor.stiffness) * (ratio * ratio)
        rotor.right += h * (ratio * joint.motor.torque + motor * (guess[m] - rotor.speed))
        matrix[m, m] += theta * h * motor
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
        if matrix[i, i] > STIFF_FROM * mass[i, i]:
            engine.stiff = 1
    return dry
