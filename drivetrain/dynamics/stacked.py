"""The stacked matrices A, G, W and L of the closed form, with rotors as further bodies.

Bodies are the links and, after them, the rotors, each with a frame at its centre of mass. Body b rides on the body
``carrier(b)`` before it in the list and moves against it along its own screw, a rotor ``ratio`` times as far as its
joint (where motors are coupled, a sum of such multiples). So ``V = W V + A qd`` (equation 8.68) holds with the rotors'
rows as it does without, W stays nilpotent, and every formula of section 8.4 holds unchanged; torques come out as
generalised torques, ``ratio`` times the motor's.
At the level REFLECTED a rotor is two bodies: one locked to its carrier, and one without mass that spins as if its
carrier stood still. This is for study and for tests; ``inverse_dynamics`` is some thousand times faster.

Reference: Modern Robotics, equations 8.60 to 8.72 and 8.103 to 8.108.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.rotors import MountedRotor, RotorLevel
from drivetrain.arrays import Array
from drivetrain.dynamics.doors import finite_samples
from drivetrain.dynamics.kinematics import screw_displacements
from drivetrain.spatial.poses import adjoint, inverse_pose

BASE, NOTHING = -1, -2  # what a body rides on, if not another body; nothing: not even on gravity


@dataclass(frozen=True, eq=False)
class Stacked:
    """The matrices of an arm of n joints and b bodies (links, then rotors); one sample has no leading axis.

    Attributes:
        A: Screws of the joints in the bodies' frames, a rotor's times its ratio, (6 b, n).
        G: Spatial inertias on the diagonal [kg m^2, kg], (6 b, 6 b).
        W: Takes twists to what riding on another body adds to them, (N, 6 b, 6 b); depends on q.
        L: ``inv(1 - W)``, (N, 6 b, 6 b); depends on q.
        base: Takes the base's acceleration (its six components) to what the bodies on it get of it, (N, 6 b, 6).
        tip: Takes a wrench in the tip frame to the stack of wrenches, (6 b, 6).
        carriers: What each body rides on: index of a body, -1 the base, -2 nothing, (b,).
    """

    A: Array
    G: Array
    W: Array
    L: Array
    base: Array
    tip: Array
    carriers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Body:
    home: Array  # (4, 4), base frame, all joints zero
    carrier: int
    turns: Array  # of the joints' positions along its own screw, (n,); all 0: locked
    screw: Array  # (6,), in its own frame
    inertia: Array  # (6, 6), in its own frame


def stacked(arm: Arm, q: Any) -> Stacked:
    """The stacked matrices of an arm.

    Args:
        q: Positions [rad or m], (n,) or (N, n).

    Raises:
        InputError: Wrong shape, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.60 to 8.67 and 8.72.
    """
    (positions,) = finite_samples(arm.n, {"q": q})
    bodies = _bodies(arm)
    size = 6 * len(bodies)
    a, g = np.zeros((size, arm.n)), np.zeros((size, size))
    w, lead = np.zeros((2, len(positions), size, size))
    base = np.zeros((len(positions), size, 6))
    for b, body in enumerate(bodies):
        own = slice(6 * b, 6 * b + 6)
        a[own] = np.outer(body.screw, body.turns)
        g[own, own] = body.inertia
        lead[:, own, own] = np.eye(6)
        if body.carrier == NOTHING:
            continue
        step = _adjoints(_seen_from(body, bodies, positions @ body.turns))
        if body.carrier == BASE:
            base[:, own] = step
        else:
            on = slice(6 * body.carrier, 6 * body.carrier + 6)
            w[:, own, on] = step
            lead[:, own] += step @ lead[:, on]
    tip = np.zeros((size, 6))
    tip[6 * arm.n - 6 : 6 * arm.n] = adjoint(inverse_pose(arm.tip) @ arm.home[-1]).T
    carriers = tuple(body.carrier for body in bodies)
    many = np.ndim(q) == 2
    return Stacked(a, g, w if many else w[0], lead if many else lead[0], base if many else base[0], tip, carriers)


def _bodies(arm: Arm) -> list[_Body]:
    """Links first, then what the rotors are at this level."""
    found = []
    for i in range(arm.n):
        screw = adjoint(inverse_pose(arm.home[i])) @ arm.screws[i]
        inertia = _spatial_inertia(float(arm.masses[i]), arm.inertias[i])
        found.append(_Body(arm.home[i], i - 1, np.eye(arm.n)[i], screw, inertia))
    for rotor, turns in zip(arm.rotors, rotor_turns(arm), strict=True):
        if rotor is not None:
            found += _rotor_bodies(rotor, turns, arm.level)
    return found


def _rotor_bodies(rotor: MountedRotor, turns: Array, level: RotorLevel) -> list[_Body]:
    screw = adjoint(inverse_pose(rotor.home)) @ rotor.screw
    inertia = _spatial_inertia(rotor.mass, rotor.inertia)
    if level is RotorLevel.FULL:
        return [_Body(rotor.home, rotor.carrier, turns, screw, inertia)]
    locked = _Body(rotor.home, rotor.carrier, 0.0 * turns, screw, inertia)
    if level is RotorLevel.NONE:
        return [locked]
    spin = np.concatenate([screw[:3], np.zeros(3)])
    axial = rotor.axial_inertia * np.outer(spin, spin)
    return [locked, _Body(rotor.home, NOTHING, turns, spin, axial)]


def _spatial_inertia(mass: float, tensor: Array) -> Array:
    result = np.zeros((6, 6))
    result[:3, :3], result[3:, 3:] = tensor, mass * np.eye(3)
    return result


def _seen_from(body: _Body, bodies: list[_Body], angles: Array) -> Array:
    """Poses of the carrier seen from the body, (N, 4, 4)."""
    carrier = np.eye(4) if body.carrier == BASE else bodies[body.carrier].home
    return np.asarray(screw_displacements(body.screw, -angles) @ inverse_pose(body.home) @ carrier)


def _adjoints(poses: Array) -> Array:
    """Adjoint matrices, (N, 6, 6)."""
    rotation, (x, y, z) = poses[:, :3, :3], poses[:, :3, 3].T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    result = np.zeros((len(poses), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = rotation
    result[:, 3:, :3] = cross @ rotation
    return result
