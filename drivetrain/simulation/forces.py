"""What follows once the change of speeds is known: true speeds of the middle, friction of each part, its powers."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.dynamics.core.vectors import dot, vector
from drivetrain.simulation.bodies import bodies_of, rotors_of, turns_of
from drivetrain.simulation.friction import slide, taken_by_friction
from drivetrain.simulation.records import (
    Run,
    coordinates_of,
    engine_of,
    joints_of,
    pairs_of,
    part,
    world_of,
)


@part
def show_energies(run: Run) -> None:
    """Kinetic and potential energy at an instant."""
    coordinates, pairs = coordinates_of(run), pairs_of(run)
    c = len(coordinates)
    kinetic, potential = 0.0, 0.0
    for i in range(c):
        for k in range(c):
            kinetic += 0.5 * coordinates[i].speed * pairs[i, k].mass * coordinates[k].speed
    if engine_of(run).arm:
        # All that the first link carries has been gathered in its body; what the base carries stands in its own.
        bodies, rotors = bodies_of(run), rotors_of(run)
        upwards = vector(bodies[len(bodies) - 1].dv)
        potential = dot(upwards, vector(bodies[0].first))
        for r in range(len(rotors)):
            if rotors[r].carrier < 0 and not rotors[r].balanced:
                potential += dot(upwards, vector(bodies[world_of(run).joints + r].first))
    else:
        for i in range(c):
            potential += coordinates[i].weight * math.sin(coordinates[i].place + coordinates[i].phase)
    world_of(run).kinetic_energy, world_of(run).potential_energy = kinetic, potential


@part
def find_forces(run: Run, h: float, theta: float) -> None:
    """Speeds of the true middle as the guess, and what follows from the solution.

    Args:
        h: Step [s]; 1 at an instant.
    """
    coordinates, pairs, joints = coordinates_of(run), pairs_of(run), joints_of(run)
    for i in range(len(coordinates)):
        one = coordinates[i]
        coordinates[i].guess = one.speed + theta * one.change
        one.friction = taken_by_friction(coordinates, pairs, i, h) if one.dry.active else 0.0
    for i in range(len(joints)):
        m, ratio, joint = coordinates[i].motor, coordinates[i].ratio, joints[i]
        link, rotor = coordinates[i], coordinates[m]
        load = rotor.transmitted
        for k in range(len(coordinates)):
            load += pairs[m, k].transmitted * coordinates[k].change
        at_joint, at_motor = _split(link, rotor, m == i, load)
        mesh = rotor.friction - at_motor
        if m == i:
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
        joint.mesh.torque, joint.mesh.loss, joint.mesh.power = load, mesh, mesh * coordinates[m].guess
        joint.load.friction_power = at_joint * (coordinates[i].guess - link.surface)
        joint.motor.friction_power = at_motor * coordinates[m].guess


@part
def _split(link: Any, rotor: Any, rigid: bool, load: float) -> tuple[float, float]:
    """Friction of joint and of motor (both counted at the joint) from what they are together with the mesh.

    Sliding, each is at its bound. Stuck, only the sum is known, and each takes a share as large as its bound.
    """
    dry = rotor.dry
    mode = dry.mode
    motor = _share(rotor, dry.motor, load) if mode == 0 else mode * slide(dry.motor, mode)
    if not rigid:
        return link.friction, motor
    joint = _share(rotor, dry.joint, load) if mode == 0 else mode * slide(dry.joint, mode)
    return joint, motor


@part
def _share(rotor: Any, which: Any, load: float) -> float:
    """The share of stuck friction that one of its bounds takes."""
    dry, forward = rotor.dry, rotor.friction > 0.0
    mesh = max(dry.driving, dry.driven) * abs(load)
    if forward:
        own, bound = which.hold_forward, dry.joint.hold_forward + dry.motor.hold_forward + mesh
    else:
        own, bound = which.hold_backward, dry.joint.hold_backward + dry.motor.hold_backward + mesh
    return rotor.friction * own / bound if bound > 0.0 else 0.0
