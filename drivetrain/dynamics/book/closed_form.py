"""The equation of motion in closed form: M, its rate, c, g and the tip's Jacobian as products of stacked matrices.

An independent computation of the results of the recursion, in the form of the book. Rotors are bodies like links.

Misprints in the book: in equation 8.74 the two terms with ``[ad_Aqd]`` must be subtracted, as they are in 8.69 and in
8.79. The rate of M in exercise 8.7 contains a matrix Gamma that the chapter does not define, and lacks a factor L in
the second term, which should be the transpose of the first; with neither W nor L, of either sign, for Gamma is the
printed formula correct. From ``dL/dt = -L [ad_Aqd] W L`` it follows with ``Gamma = -W``:

    dM/dt = A^T L^T Gamma^T [ad_Aqd]^T L^T G L A + A^T L^T G L [ad_Aqd] Gamma L A.

Bodies are the links and, after them, the rotors, each with a frame at its centre of mass. Body b is carried by the body
``carrier(b)`` before it in the list and moves relative to it along its own screw, a rotor by ``ratio`` times the motion
of its joint (for coupled motors, by a sum of such multiples). So ``V = W V + A qd`` (equation 8.68) also holds with the
rotors' rows, W stays nilpotent, and all formulas of section 8.4 hold unchanged. The torques are generalised torques,
``ratio`` times the motor's.
At the level REFLECTED a rotor is two bodies: one locked to its carrier, and one without mass that spins as if its
carrier were at rest. This module is for study and for tests.

Reference: Modern Robotics, section 8.4, equations 8.60 to 8.80 and 8.103 to 8.108.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.kinematics import screw_displacements
from drivetrain.arm.rotors import MountedRotor, RotorLevel
from drivetrain.arrays import Array, batch, finite_samples
from drivetrain.dynamics.core.vectors import (
    Vector,
    add_six,
    cross,
    dot,
    dot_six,
    exact,
    linear,
    plus,
    put_six,
    times,
    turned,
    vector,
)
from drivetrain.dynamics.samples import is_one_finite_sample
from drivetrain.errors import Fault, InputError
from drivetrain.jit import kernel
from drivetrain.spatial.poses import adjoint, inverse_pose
from drivetrain.spatial.rotations import skew


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """The terms of ``tau = M qdd + c + g + J^T F``; one sample has no leading axis.

    Attributes:
        mass: M [kg m^2; kg m and kg where joints are prismatic], (N, n, n); equation 8.78.
        mass_rate: dM/dt [kg m^2/s; kg m/s, kg/s], (N, n, n); exercise 8.7.
        velocity: c, Coriolis and centripetal torques [N m; N at a prismatic joint], (N, n); equation 8.79.
        gravity: g [N m or N], (N, n); equation 8.80.
        tip_jacobian: J, body Jacobian of the tip, columns (angular [-], linear [m or -]), (N, 6, n); equation 8.77.
    """

    mass: Array
    mass_rate: Array
    velocity: Array
    gravity: Array
    tip_jacobian: Array


def closed_form(arm: Arm, q: Any, qd: Any) -> ClosedForm:
    """The terms of the equation of motion, from the stacked matrices.

    Args:
        arm: With rotors or without; row i belongs to ``ratio_i`` times the torque of motor i.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        The terms.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, equations 8.77 to 8.80 and exercise 8.7.
    """
    if is_one_finite_sample(arm.n, q, qd, qd):
        positions, speeds = q[None], qd[None]
    else:
        positions, speeds = finite_samples(arm.n, {"q": q, "qd": qd})
    (count, n), known = positions.shape, _constants(arm)
    terms = [np.zeros((count, *shape)) for shape in ((n, n), (n, n), (n,), (n,), (6, n))]
    _fill_terms(known, positions, speeds, *terms)
    return ClosedForm(*terms) if np.ndim(q) == 2 else ClosedForm(*(term[0] for term in terms))


def closed_form_torque(arm: Arm, q: Any, qd: Any, qdd: Any, *, tip_wrench: Any = None) -> Array:
    """The joint torques of a motion, (n,) or (N, n), by the closed form; Modern Robotics, equation 8.77."""
    positions, speeds, accelerations = finite_samples(arm.n, {"q": q, "qd": qd, "qdd": qdd})
    terms = closed_form(arm, positions, speeds)
    torque = np.einsum("kij,kj->ki", terms.mass, accelerations) + terms.velocity + terms.gravity
    if tip_wrench is not None:
        wrenches = batch(tip_wrench, 6, "tip_wrench")
        if len(wrenches) not in (1, len(positions)):
            raise InputError(Fault("tip_wrench", f"must have shape (6,), or ({len(positions)}, 6)", wrenches.shape))
        torque += np.einsum("kji,kj->ki", terms.tip_jacobian, np.broadcast_to(wrenches, (len(positions), 6)))
    return torque if np.ndim(q) == 2 else torque[0]


def mass_matrix_rate(arm: Arm, q: Any, qd: Any) -> Array:
    """The time derivative of the mass matrix along a motion.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).

    Returns:
        dM/dt [kg m^2/s; kg m/s and kg/s where joints are prismatic], (n, n) or (N, n, n), exactly symmetric; equal to
        the Coriolis matrix plus its transpose.

    Raises:
        InputError: Wrong shapes, or a NaN or infinity.

    Reference: Modern Robotics, exercise 8.7; see the module for what is misprinted there.
    """
    return closed_form(arm, q, qd).mass_rate


class _Constants(NamedTuple):
    carriers: np.ndarray  # as in Stacked, (b,)
    # pose of the carrier in the body's frame with all joints at zero, and its coefficients of sin, 1 - cos and angle,
    # (b, 4, 3, 4)
    places: Array
    screws: Array  # of the joints in the bodies' frames, (b, 6)
    turns: Array  # factors from joint positions to motions along the screws, (b, n)
    inertias: Array  # about the centre of mass [kg m^2], (b, 3, 3)
    masses: Array  # (b,)
    base: Array  # acceleration of the base minus gravity, (6,)
    tip: Array  # from twists of the last link to those of the tip, (6, 6)


@lru_cache(maxsize=64)
def _constants(arm: Arm) -> _Constants:
    """Constants of ``_fill_terms`` for an arm, cached by the identity of the arm."""
    bodies = _bodies(arm)
    places = np.empty((len(bodies), 4, 3, 4))
    for place, body in zip(places, bodies, strict=True):
        x = np.zeros((4, 4))
        x[:3, :3], x[:3, 3] = skew(body.screw[:3]), body.screw[3:]
        # The third power is minus the first, except for the pitch; for a prismatic joint both higher powers are zero.
        # The sum of both is set from the pitch, since a rounding error in it would grow with the angle.
        advance = np.zeros((4, 4))
        advance[:3, 3] = _advance(body.screw[:3], body.screw[3:])
        powers = (np.eye(4), -x @ x @ x, x @ x, advance)
        place[:] = [(power @ _at_zero(body, bodies))[:3] for power in powers]
    return _Constants(
        np.array([body.carrier for body in bodies]),
        places,
        np.array([body.screw for body in bodies]),
        np.array([body.turns for body in bodies]),
        np.array([body.inertia[:3, :3] for body in bodies]),
        np.array([body.inertia[3, 3] for body in bodies]),
        np.concatenate([np.zeros(3), -arm.gravity]),
        adjoint(inverse_pose(arm.tip) @ arm.home[-1]),
    )


def _advance(axis: Array, linear: Array) -> Array:
    """Displacement along the screw axis per radian, or per metre of a prismatic joint, (3,) [m]."""
    if not axis.any():
        return linear
    pitch = float(axis @ linear)
    rounding = 1e-12 * float(np.abs(linear).max()) + 1e-15
    return pitch * axis if abs(pitch) > rounding else 0.0 * axis


@kernel
def _fill_terms(
    known: Any, q: Array, qd: Array, mass: Array, rate: Array, velocity: Array, held: Array, jacobian: Array
) -> None:  # fmt: skip
    """Fill M, dM/dt, c, g and J; products with L are computed body by body, as ``L X = W L X + X``."""
    carriers, places, screws, turns, inertias, masses, base, tip = known
    n = q.shape[1]
    # For each body, as rows: n of L A, n of L [ad_Aqd] L A, then L [ad_Aqd] W V, and L times the base's acceleration.
    stack, place, momentum = np.empty((len(carriers), 2 * n + 2, 6)), np.empty((3, 4)), np.empty((n, 6))
    for sample in range(len(q)):
        for b in range(len(carriers)):
            rows, screw, inertia, m, on = stack[b], screws[b], inertias[b], masses[b], carriers[b]
            angle, speed = 0.0, 0.0
            for i in range(n):
                angle -= turns[b, i] * q[sample, i]
                speed += turns[b, i] * qd[sample, i]
            s, c = math.sin(angle), 2.0 * math.sin(0.5 * angle) ** 2
            for j in range(3):
                for k in range(4):
                    at = places[b, :, j, k]
                    place[j, k] = at[0] + s * at[1] + c * at[2] + angle * at[3]
            for i in range(len(rows)):
                for j in range(6):
                    rows[i, j] = 0.0
                if on >= 0:
                    _carry(place, stack[on, i], rows[i])
            if on == BASE:
                _carry(place, base, rows[2 * n + 1])
            own_w, own_v = times(speed, vector(screw)), times(speed, linear(screw))
            w, v = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            for i in range(n):
                w = plus(w, times(qd[sample, i], vector(rows[i])))
                v = plus(v, times(qd[sample, i], linear(rows[i])))
            _add_bracket(own_w, own_v, w, v, rows[2 * n])
            w, v = plus(w, own_w), plus(v, own_v)
            spin, push = turned(inertia, w), times(m, v)  # of the body's momentum G V
            moment, force = plus(cross(w, spin), cross(v, push)), cross(w, push)
            for i in range(n):  # [ad_Aqd] W L A = [ad_Aqd] L A, since a screw's bracket with itself is zero
                _add_bracket(own_w, own_v, vector(rows[i]), linear(rows[i]), rows[n + i])
                add_six(rows[i], times(turns[b, i], vector(screw)), times(turns[b, i], linear(screw)))
                put_six(momentum[i], turned(inertia, vector(rows[i])), times(m, linear(rows[i])))
            for i in range(n):
                velocity[sample, i] += dot(moment, vector(rows[i])) + dot(force, linear(rows[i]))
                velocity[sample, i] -= dot_six(momentum[i], rows[2 * n])
                held[sample, i] += dot_six(momentum[i], rows[2 * n + 1])
                for j in range(n):
                    change = dot_six(momentum[i], rows[n + j])
                    rate[sample, i, j] -= change
                    rate[sample, j, i] -= change
                for j in range(i + 1):
                    mass[sample, i, j] += dot_six(momentum[i], rows[j])
        for i in range(n):
            for j in range(6):
                jacobian[sample, j, i] = dot_six(tip[j], stack[n - 1, i])
            for j in range(i):
                mass[sample, j, i] = mass[sample, i, j]


@exact
def _carry(place: Array, twist: Array, to: Array) -> None:
    """Transform a twist into the frame in which its own frame has the pose ``place``, (3, 4)."""
    w = turned(place, vector(twist))
    put_six(to, w, plus(turned(place, linear(twist)), cross((place[0, 3], place[1, 3], place[2, 3]), w)))


@exact
def _add_bracket(w: Vector, v: Vector, x: Vector, y: Vector, to: Array) -> None:
    """Add the Lie bracket of the twists (w, v) and (x, y)."""
    add_six(to, cross(w, x), plus(cross(v, x), cross(w, y)))


BASE, NOTHING = -1, -2  # carriers that are no body; NOTHING also excludes the acceleration of gravity


@dataclass(frozen=True, eq=False)
class Stacked:
    """The stacked matrices of an arm of n joints and b bodies (links, then rotors); one sample has no leading axis."""

    A: Array  # screws of the joints in the bodies' frames, a rotor's times its ratio, (6 b, n)
    G: Array  # spatial inertias on the diagonal [kg m^2, kg], (6 b, 6 b)
    W: Array  # from the twists of carriers to their part in the twists of the bodies, (N, 6 b, 6 b); depends on q
    L: Array  # ``inv(1 - W)``, (N, 6 b, 6 b); depends on q
    base: Array  # from the base's acceleration to its part in those of the bodies on it, (N, 6 b, 6)
    tip: Array  # from a wrench in the tip frame to the stack of wrenches, (6 b, 6)
    carriers: tuple[int, ...]  # carrier of each body: its index, -1 for the base, -2 for nothing, (b,)


@dataclass(frozen=True, eq=False)
class _Body:
    home: Array  # (4, 4), base frame, all joints zero
    carrier: int
    turns: Array  # factors from joint positions to the motion along its own screw, (n,); all 0: locked
    screw: Array  # (6,), in its own frame
    inertia: Array  # (6, 6), in its own frame


def stacked(arm: Arm, q: Any) -> Stacked:
    """The stacked matrices of an arm; Modern Robotics, equations 8.60 to 8.67 and 8.72."""
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
    """The links, then the bodies of the rotors at the arm's level."""
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


def _at_zero(body: _Body, bodies: list[_Body]) -> Array:
    """Pose of the carrier in the body's frame with all joints at zero, (4, 4)."""
    return np.asarray(inverse_pose(body.home) @ (bodies[body.carrier].home if body.carrier >= 0 else np.eye(4)))


def _seen_from(body: _Body, bodies: list[_Body], angles: Array) -> Array:
    """Poses of the carrier in the body's frame, (N, 4, 4)."""
    return np.asarray(screw_displacements(body.screw, -angles) @ _at_zero(body, bodies))


def _adjoints(poses: Array) -> Array:
    """Adjoint matrices, (N, 6, 6)."""
    rotation, (x, y, z) = poses[:, :3, :3], poses[:, :3, 3].T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    result = np.zeros((len(poses), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = rotation
    result[:, 3:, :3] = cross @ rotation
    return result
