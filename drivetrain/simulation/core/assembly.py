"""The linear system of a step, Newton iteration on piecewise laws, and the forces that follow from the solution.

Springs with several stiffnesses, tooth flanks and walls are piecewise linear. Their laws are evaluated again at the
motion that the solution gives, and the system is solved again, until both agree: Newton's method.
"""

from __future__ import annotations

import math
from typing import Any

from drivetrain.dynamics.core.vectors import dot, vector
from drivetrain.simulation.core.bodies import (
    add_tip,
    bodies_of,
    clear_tip,
    move_tip_to_trial,
    rotors_of,
    tip_converged,
    turns_of,
)
from drivetrain.simulation.core.friction import friction_torque, sliding_bound
from drivetrain.simulation.core.records import (
    AT,
    Run,
    call_laws,
    coordinates_of,
    engine_of,
    joints_of,
    pairs_of,
    part,
    world_of,
)

# Ratio of a diagonal entry of the system matrix, with springs and dampers, to the inertia alone, above which a spring
# counts as stiff: the step does not resolve its oscillation.
STIFF_RATIO = 1.5


@part
def fill_coupled_motion(run: Run) -> None:
    """Fill the motion of the connectors of joints with coupled motors, from that of the gears' output shafts."""
    coordinates, joints, turns = coordinates_of(run), joints_of(run), turns_of(run)
    for i in range(len(joints)):
        if coordinates[i].coupled:
            place, speed, joint = 0.0, 0.0, joints[i]
            for k in range(len(joints)):
                place += turns[i, k] * coordinates[k].mid_position
                speed += turns[i, k] * coordinates[k].mid_speed
            joint.shaft.position, joint.shaft.speed = coordinates[i].mid_position, coordinates[i].mid_speed
            joint.load.position, joint.load.speed = place, speed


@part
def _add_coupled(run: Run, h: float, theta: float) -> None:
    """Add the smooth torques at joints with coupled motors to the linear system, in the coordinates of the shafts."""
    coordinates, pairs, joints, turns = coordinates_of(run), pairs_of(run), joints_of(run), turns_of(run)
    n = len(joints)
    for i in range(n):
        if not coordinates[i].coupled:
            continue
        load = joints[i].load
        soft, torque = load.damping + theta * h * load.stiffness, load.torque
        for k in range(n):
            torque += soft * turns[i, k] * (coordinates[k].mid_speed - coordinates[k].speed)
        for k in range(n):
            if not coordinates[k].coupled:
                continue
            coordinates[k].impulse += h * turns[i, k] * torque
            coordinates[k].transmitted -= turns[i, k] * torque
            for j in range(n):
                entry = theta * soft * turns[i, k] * turns[i, j]
                pairs[k, j].matrix += h * entry
                pairs[k, j].transmitted += entry


@part
def _bounds(run: Run, i: int, m: int) -> bool:
    """Collect the friction bounds of joint i and of its motor, whose coordinate is m; whether any is not zero.

    The joint of a second motor on an axis has no bounds of its own, since its link is that of the first motor.
    """
    coordinates, at_joint, j = coordinates_of(run), 0.0, coordinates_of(run)[i].link
    joint, size = joints_of(run)[i], abs(coordinates[i].ratio)
    link, rotor, load, motor, mesh = coordinates[j].dry, coordinates[m].dry, joint.load, joint.motor, joint.mesh
    own, drag = link.joint, rotor.motor
    if j == i:
        own.hold_forward, own.hold_backward = load.hold_forward, load.hold_backward
        own.slide_forward, own.slide_backward = load.slide_forward, load.slide_backward
        at_joint = own.hold_forward + own.hold_backward + own.slide_forward + own.slide_backward
        link.active = 1 if at_joint > 0.0 else 0
    drag.hold_forward, drag.hold_backward = size * motor.hold_forward, size * motor.hold_backward
    drag.slide_forward, drag.slide_backward = size * motor.slide_forward, size * motor.slide_backward
    if coordinates[i].ratio < 0.0:
        drag.hold_forward, drag.hold_backward = drag.hold_backward, drag.hold_forward
        drag.slide_forward, drag.slide_backward = drag.slide_backward, drag.slide_forward
    rotor.driving, rotor.driven = mesh.driving, mesh.driven
    at_motor = drag.hold_forward + drag.hold_backward + drag.slide_forward + drag.slide_backward
    at_motor += abs(mesh.driving) + abs(mesh.driven)
    if at_motor > 0.0:
        rotor.active = 1
    elif m != j:
        rotor.active = 0
    return at_joint + at_motor > 0.0


@part
def _mesh(run: Run, h: float, i: int, soft: float, torque: float) -> None:
    """Torque transmitted by the mesh of a rigid joint, as a linear function of the changes of speed.

    ``soft`` and ``torque`` are damping and torque at the joint. The inertia that acts on the motor side is left out.
    """
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    coordinates[i].transmitted = coordinates[i].bias - coordinates[i].rotor_bias - torque
    for k in range(len(coordinates)):
        pairs[i, k].transmitted = (pairs[i, k].mass - pairs[i, k].rotor_mass) / h
    pairs[i, i].transmitted += soft


@part
def _spring(run: Run, h: float, theta: float, spring: Any, i: int, m: int, rate_change: float) -> None:
    """Add the spring of a flexible joint, between the coordinates of its link i and its rotor m, to the linear system.

    ``rate_change`` is the difference between the spring's rate at which its law was evaluated and that before the step.
    """
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    slope = spring.damping + theta * h * spring.stiffness
    torque, stiff = spring.torque - slope * rate_change, theta * slope
    coordinates[i].impulse += h * torque
    coordinates[m].impulse -= h * torque
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
    """Assemble the linear system of a step and the friction bounds; whether there is any dry friction."""
    coordinates, pairs, joints = coordinates_of(run), pairs_of(run), joints_of(run)
    c, engine, dry = len(coordinates), engine_of(run), False
    for i in range(c):
        one = coordinates[i]
        one.impulse = -h * coordinates[i].bias
        one.relative = one.speed
        for k in range(c):
            pairs[i, k].matrix = pairs[i, k].mass
    for i in range(len(joints)):
        link, m, ratio, joint = coordinates[i].link, coordinates[i].motor, coordinates[i].ratio, joints[i]
        one, rotor = coordinates[link], coordinates[m]
        flange = joint.shaft if coordinates[i].coupled else joint.load
        soft = flange.damping + theta * h * flange.stiffness
        torque = flange.torque + soft * (one.mid_speed - one.speed)
        one.impulse += h * torque
        if link == i:
            one.surface = joint.load.surface_speed
            one.relative -= one.surface
        pairs[link, link].matrix += theta * h * soft
        motor = (joint.motor.damping + theta * h * joint.motor.stiffness) * (ratio * ratio)
        rotor.impulse += h * (ratio * joint.motor.torque + motor * (coordinates[m].mid_speed - rotor.speed))
        pairs[m, m].matrix += theta * h * motor
        found = _bounds(run, i, m)
        dry = dry or found
        if m == link:
            _mesh(run, h, i, theta * soft, torque)
        else:
            rate_change = rotor.trial_speed - one.trial_speed - (rotor.speed - one.speed)
            _spring(run, h, theta, joint.spring, link, m, rate_change)
    if engine.coupled:
        _add_coupled(run, h, theta)
    if engine.uses_tip:
        add_tip(run, h, theta)
    engine.stiff = 0
    for i in range(c):
        if pairs[i, i].matrix > STIFF_RATIO * pairs[i, i].mass:
            engine.stiff = 1
    return dry


CONVERGED = 1e-12  # relative error of a spring's torque at which the Newton iteration has converged


@part
def evaluate_piecewise(run: Run, t: float, h: float, theta: float, halfway: bool) -> None:
    """Evaluate the laws of springs and tip contacts again, at the motion that the present solution gives.

    ``halfway``: at the mean of that motion and the one at which they were evaluated before, which ends a cycle between
    two pieces.
    """
    coordinates, joints = coordinates_of(run), joints_of(run)
    for i in range(len(coordinates)):
        one = coordinates[i]
        trial = one.speed + theta * one.change
        one.trial_speed = 0.5 * (one.trial_speed + trial) if halfway else trial
    for i in range(len(joints)):
        link, m = coordinates[i].link, coordinates[i].motor
        if m != link:
            rotor, spring = coordinates[m], joints[i].spring
            rate = rotor.trial_speed - coordinates[link].trial_speed
            spring.wind_up, spring.speed = rotor.position + theta * h * rate, rate
            spring.torque = spring.damping = spring.stiffness = 0.0
    if engine_of(run).uses_tip:
        move_tip_to_trial(run, theta * h)
        clear_tip(world_of(run).tip)
    call_laws(run, AT.iterated, t, h)


@part
def newton_converged(run: Run, h: float, theta: float) -> bool:
    """Whether the Newton iteration has converged: torques of springs and forces at the tip agree with the solution."""
    coordinates, joints, pairs = coordinates_of(run), joints_of(run), pairs_of(run)
    good = True
    for i in range(len(joints)):
        j, m = coordinates[i].link, coordinates[i].motor
        if m == j:
            continue
        link, rotor, spring = coordinates[j], coordinates[m], joints[i].spring
        expected = rotor.transmitted + pairs[m, m].transmitted * rotor.change + pairs[m, j].transmitted * link.change
        slope, before = spring.damping + theta * h * spring.stiffness, pairs[m, m].transmitted / theta
        size = abs(rotor.trial_speed) + abs(link.trial_speed) + abs(spring.wind_up) / (theta * h)
        error = abs(spring.torque - expected)
        if error > CONVERGED * (abs(spring.torque) + abs(expected)) + 2e-15 * max(slope, before) * size:
            good = False
    if engine_of(run).uses_tip:
        good = tip_converged(run, theta * h) and good
    return good


@part
def fill_energies(run: Run) -> None:
    """Fill kinetic and potential energy of the mechanics [J]."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    c = len(coordinates)
    kinetic, potential = 0.0, 0.0
    for i in range(c):
        for k in range(c):
            kinetic += 0.5 * coordinates[i].speed * pairs[i, k].mass * coordinates[k].speed
    if engine_of(run).looped:
        potential = engine_of(run).potential
    elif engine_of(run).arm:
        # The first link's body holds the composite moments of all bodies after it; rotors on the base have their own.
        bodies, rotors = bodies_of(run), rotors_of(run)
        upwards = vector(bodies[len(bodies) - 1].dv)
        potential = dot(upwards, vector(bodies[0].first))
        for r in range(len(rotors)):
            if rotors[r].carrier < 0 and not rotors[r].balanced:
                potential += dot(upwards, vector(bodies[world_of(run).joints + r].first))
    else:
        for i in range(c):
            potential += coordinates[i].weight * math.sin(coordinates[i].mid_position + coordinates[i].phase)
    world_of(run).kinetic_energy, world_of(run).potential_energy = kinetic, potential


@part
def find_forces(run: Run, h: float, theta: float) -> None:
    """Compute accelerations, friction torques, mesh torques and powers from the solution.

    The speeds in the middle of the step are updated from the guess to those of the solution.
    """
    coordinates, pairs, joints = coordinates_of(run), pairs_of(run), joints_of(run)
    for i in range(len(coordinates)):
        one = coordinates[i]
        coordinates[i].mid_speed = one.speed + theta * one.change
        one.friction = friction_torque(coordinates, pairs, i, h) if one.dry.active else 0.0
    for i in range(len(joints)):
        j, m, ratio, joint = coordinates[i].link, coordinates[i].motor, coordinates[i].ratio, joints[i]
        link, rotor = coordinates[j], coordinates[m]
        load = rotor.transmitted
        for k in range(len(coordinates)):
            load += pairs[m, k].transmitted * coordinates[k].change
        at_joint, at_motor = _split(link, rotor, m == j, load)
        if j != i:
            at_joint = 0.0
        mesh = rotor.friction - at_motor
        if m == j:
            mesh -= at_joint
            load += at_joint
        joint.load.acceleration = link.change / h
        if coordinates[i].coupled:
            turned = 0.0
            for k in range(len(joints)):
                turned += turns_of(run)[i, k] * coordinates[k].change
            joint.load.acceleration = turned / h
        joint.motor.acceleration = ratio * rotor.change / h
        joint.load.friction, joint.motor.friction = at_joint, at_motor / ratio
        joint.mesh.torque, joint.mesh.loss, joint.mesh.power = load, mesh, mesh * coordinates[m].mid_speed
        joint.load.friction_power = at_joint * (link.mid_speed - link.surface)
        joint.motor.friction_power = at_motor * coordinates[m].mid_speed


@part
def _split(link: Any, rotor: Any, rigid: bool, load: float) -> tuple[float, float]:
    """Split the friction of a coordinate into those of joint and motor, both referred to the joint [N m or N].

    While it slips, each is at its bound. While it sticks, only the sum of both and of the mesh is determined; it is
    divided in proportion to the bounds.
    """
    dry = rotor.dry
    mode = dry.mode
    motor = _share(rotor, dry.motor, load) if mode == 0 else mode * sliding_bound(dry.motor, mode)
    if not rigid:
        return link.friction, motor
    joint = _share(rotor, dry.joint, load) if mode == 0 else mode * sliding_bound(dry.joint, mode)
    return joint, motor


@part
def _share(rotor: Any, which: Any, load: float) -> float:
    """Part of a stuck coordinate's friction, in proportion to one of its bounds (``which``)."""
    dry, forward = rotor.dry, rotor.friction > 0.0
    mesh = max(dry.driving, dry.driven) * abs(load)
    if forward:
        own, bound = which.hold_forward, dry.joint.hold_forward + dry.motor.hold_forward + mesh
    else:
        own, bound = which.hold_backward, dry.joint.hold_backward + dry.motor.hold_backward + mesh
    return rotor.friction * own / bound if bound > 0.0 else 0.0
