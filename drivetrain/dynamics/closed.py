"""Arms with closed loops: motion of the passive joints, and torques of the driven joints.

Pins close the loops: ``A_p qd_p + A_d qd_d = 0`` for passive and driven joints. So ``qd = J qd_d`` for all joints, and
since the forces in ideal pins do no work, the torques of the driven joints are ``J^T tau`` from the torques tau of the
open chains. This is the constrained inverse dynamics without the pin forces. Friction in the pins is not included.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 8.2 (loop constraints by explicit constraints).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm, Linkage, Loops
from drivetrain.arm.coupling import coupled_groups
from drivetrain.arrays import Array
from drivetrain.dynamics.core.frames import FRAME, move_frame
from drivetrain.dynamics.core.loops import MOST, STRIDE
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.poses import pose

CLOSED = 1e-12  # gap of a closed pin, as a share of the arm's size: rounding
DEAD = 1e-5  # smallest over largest singular value below which the linkage is near a dead centre


class WholeMotion(NamedTuple):
    """Motion of all m joints of an arm with loops."""

    # [rad or m, and per s, s^2], (N, m)
    position: Array
    velocity: Array
    acceleration: Array
    turns: Array  # J, motion of each joint per unit of each driven joint [-, rad/m or m/rad], (N, m, n)


def whole_motion(linkage: Linkage, q: Array, qd: Array, qdd: Array) -> WholeMotion:
    """Motion of all joints for a motion of the driven ones, (N, n) each; raises ``InputError`` if pins cannot close."""
    geometry = _Geometry(linkage.loops, tuple(chain.screws.tobytes() for chain in linkage.chains))
    position, turns, follows = _assembly(geometry, np.ascontiguousarray(q).tobytes(), len(q))
    velocity, acceleration = ((turns @ values[:, :, None])[..., 0] for values in (qd, qdd))
    if qd.any():
        drift = _pins(geometry.loops, geometry.screws, position, velocity)[2]
        acceleration[:, list(geometry.loops.passive)] -= (follows @ drift[:, :, None])[..., 0]
    return WholeMotion(position, velocity, acceleration, turns)


class _Geometry(NamedTuple):
    """Geometry of a linkage, on which the motion of all joints depends; the key of the cache."""

    loops: Loops
    chains: tuple[bytes, ...]

    @property
    def screws(self) -> list[Array]:
        """Screws of each chain, (k, 6), as writable arrays, for which the kernels are compiled."""
        return [np.frombuffer(screws).reshape(-1, 6).copy() for screws in self.chains]


@lru_cache(maxsize=8)
def _assembly(geometry: _Geometry, key: bytes, count: int) -> tuple[Array, Array, Array]:
    """Positions of all joints, J, and pseudo-inverse of the passive joints' pin Jacobian, cached by the positions."""
    loops, screws = geometry.loops, geometry.screws
    driven, passive = list(loops.driven), list(loops.passive)
    q = np.frombuffer(key).reshape(count, -1)
    different, back = np.unique(q, axis=0, return_inverse=True)
    position = _closed_positions(loops, screws, different)
    _, jacobian, _ = _pins(loops, screws, position, np.zeros_like(position))
    follows = _passive_pseudo_inverse(jacobian, passive, different)
    turns = np.zeros((len(different), len(loops.owner), len(driven)))
    turns[:, driven] = np.eye(len(driven))
    turns[:, passive] = -follows @ jacobian[:, :, driven]
    every = back.reshape(-1)
    return position[every], turns[every], follows[every]


def _passive_pseudo_inverse(jacobian: Array, passive: list[int], q: Array) -> Array:
    """The pseudo-inverse of the pin Jacobian of the passive joints, (N, p, k)."""
    if not passive:
        return np.zeros((len(q), 0, jacobian.shape[1]))
    left, values, right = np.linalg.svd(jacobian[:, :, passive], full_matrices=False)
    share = values[:, -1] / values[:, 0] if values.shape[1] == len(passive) else np.zeros(len(q))
    if not (share > DEAD).all():
        worst = int(np.argmin(share))
        problem = "do not determine the positions of the dependent joints: a dead centre, or a joint that no pin holds"
        raise InputError(Fault("driven joints", problem, q[worst].tolist(), "in rad or m; more pins, or other ranges"))
    return np.asarray(np.swapaxes(right, 1, 2) / values[:, None] @ np.swapaxes(left, 1, 2))


def _closed_positions(loops: Loops, screws: list[Array], q: Array) -> Array:
    """Positions of all joints, (N, m), followed on a straight path of the driven joints from zero to their positions.

    All samples advance together. Along this path the passive joints cannot change to another assembly mode of the
    linkage unless it passes a dead centre.
    """
    driven, passive = list(loops.driven), list(loops.passive)
    size = loops.size
    slides = [
        not screws[loops.owner[joint]][loops.paths[loops.owner[joint]].index(joint), :3].any() for joint in driven
    ]
    strides = np.abs(q) / np.where(slides, size, 1.0)
    steps = max(1, math.ceil(float(strides.max(initial=0.0)) / STRIDE))
    position = np.zeros((len(q), len(loops.owner)))
    rest, error = np.zeros_like(position), np.inf
    for step in range(steps):
        begin, jacobian, _ = _pins(loops, screws, position, rest)
        change = q / steps
        position[:, driven] += change
        target = begin + (jacobian[:, :, driven] @ change[:, :, None])[..., 0]
        position[:, passive] -= _least_squares(jacobian[:, :, passive], target)
        for _ in range(MOST if step == steps - 1 else 1):
            missing, jacobian, _ = _pins(loops, screws, position, rest)
            error = float(np.abs(missing).max(initial=0.0)) / size
            if error <= CLOSED:
                break
            position[:, passive] -= _least_squares(jacobian[:, :, passive], missing)
    if not error <= 1e3 * CLOSED:
        worst = int(np.argmax(np.abs(missing).max(axis=1)))
        problem = f"leaves a pin {error * size:.3g} m open: the linkage does not reach so far"
        raise InputError(Fault("position of the driven joints", problem, q[worst].tolist(), "in rad or m"))
    return position


def _least_squares(matrix: Array, target: Array) -> Array:
    """Least squares by the normal equations, (N, p); the next Newton step corrects their rounding errors."""
    turned = np.swapaxes(matrix, 1, 2)
    normal = turned @ matrix
    scale = np.trace(normal, axis1=1, axis2=2)[:, None, None] + 1e-300
    normal = normal + 1e-14 * scale * np.eye(matrix.shape[2])
    return np.asarray(np.linalg.solve(normal, turned @ target[:, :, None])[..., 0])


def _pins(loops: Loops, screws: list[Array], position: Array, velocity: Array) -> tuple[Array, Array, Array]:
    """Gaps of the pins [m], (N, k), their Jacobian, (N, k, m), and second derivatives at constant rates, (N, k)."""
    count, m = position.shape
    error, drift = np.zeros((2, count, 3 * len(loops.pins)))
    jacobian = np.zeros((count, 3 * len(loops.pins), m))
    frames = np.empty(count, FRAME)
    columns: dict[int, Array] = {}
    for k, (first, second, point) in enumerate(loops.pins):
        rows = slice(3 * k, 3 * k + 3)
        for (chain, length), sign in ((first, 1.0), (second, -1.0)):
            path = list(loops.paths[chain])
            turned = columns.setdefault(chain, np.empty((count, 6, len(path))))
            q, qd = (np.ascontiguousarray(values[:, path]) for values in (position, velocity))
            move_frame(screws[chain], pose(point=point), length - 1, q, qd, frames, turned)
            error[:, rows] += sign * frames["place"]
            drift[:, rows] += sign * frames["dv"]
            jacobian[:, rows, path] += sign * turned[:, 3:]
    return error, jacobian, drift


def chain_arms(arm: Arm) -> list[Arm]:
    """The chains of an arm with loops as arms, with its gravity, level, rotors and coupled motors."""
    assert arm.linkage is not None
    loops, found, groups = arm.linkage.loops, [], coupled_groups(arm)
    beside = {loops.driven[i]: [loops.driven[k] for k in group] for group in groups for i in group}
    mounted = dict(zip(loops.driven, arm.rotors, strict=True))
    taken = set[int]()
    for chain, path in zip(arm.linkage.chains, loops.paths, strict=True):
        rotors = []
        for joint in path:
            rotor = mounted.get(joint)
            here = rotor is not None and joint not in taken and (rotor.carrier < 0 or rotor.carrier in path)
            here = here and {*beside.get(joint, ())} <= {*path}
            taken.update([joint] if here else [])
            rotors.append(replace(rotor, carrier=path.index(rotor.carrier) if rotor.carrier >= 0 else -1)
                          if rotor is not None and here else None)  # fmt: skip
        coupling = _chain_coupling(arm, groups, path)
        found.append(replace(chain, gravity=arm.gravity, level=arm.level, rotors=tuple(rotors), coupling=coupling))
    if any(rotor is not None and joint not in taken for joint, rotor in mounted.items()):
        raise InputError(Fault("rotors", "must ride on the base or on a link before or after their joint"))
    return found


def _chain_coupling(arm: Arm, groups: list[tuple[int, ...]], path: tuple[int, ...]) -> Array | None:
    """Coupling matrix of the motors whose joints are all in this chain; None if there are none."""
    assert arm.linkage is not None
    found, driven = np.eye(len(path)), arm.linkage.loops.driven
    for group in groups:
        joints = [driven[i] for i in group]
        if arm.coupling is not None and {*joints} <= {*path}:
            at = [path.index(joint) for joint in joints]
            found[np.ix_(at, at)] = arm.coupling[np.ix_(group, group)]
    return None if np.array_equal(found, np.eye(len(path))) else found


def main_chain(arm: Arm, q: Array) -> tuple[Arm, Array]:
    """An arm's main chain and the positions of all its joints, (N, n); the arm itself if it has no loops."""
    chain, positions, _ = chain_motions(arm, q)[0]
    return chain, positions


def chain_motions(arm: Arm, q: Array) -> list[tuple[Arm, Array, list[int]]]:
    """Each chain from the base, positions of its joints, (N, k), and their indices among the driven joints or -1."""
    if arm.linkage is None:
        return [(arm, q, list(range(arm.n)))]
    rest, loops = np.zeros_like(q), arm.linkage.loops
    position, driven = whole_motion(arm.linkage, q, rest, rest).position, list(loops.driven)
    return [
        (chain, position[:, list(path)], [driven.index(joint) if joint in driven else -1 for joint in path])
        for chain, path in zip(arm.linkage.chains, loops.paths, strict=True)
    ]


def closed_loads(arm: Arm, motion: list[Array], tip_wrench: Any, loads: Any) -> tuple[Array, ...]:
    """Loads of the driven joints of an arm with loops, from the loads of its chains.

    Returns generalised torque, its part through the gears, wrenches, and accelerations of the previous links, as in
    ``JointLoads``. Wrenches are NaN for joints within a loop: how bearings and pins share them depends on their
    stiffness. ``loads`` is ``joint_loads``, passed in because of the direction of imports.
    """
    assert arm.linkage is not None
    loops = arm.linkage.loops
    whole = whole_motion(arm.linkage, *motion)
    torque, gear = np.zeros((2, *whole.position.shape))
    count, n = motion[0].shape
    wrench, axial = np.zeros((count, n, 6)), np.zeros((count, n))
    for index, (chain, path) in enumerate(zip(chain_arms(arm), loops.paths, strict=True)):
        along = [np.ascontiguousarray(values[:, list(path)]) for values in whole[:3]]
        found = loads(chain, *along, tip_wrench=tip_wrench if index == 0 else None)
        torque[:, path] += found.torque
        gear[:, path] += found.gear if chain.coupling is None else found.gear @ chain.coupling
        for k, joint in enumerate(loops.driven):
            if joint in path:
                wrench[:, k] += found.wrench[:, path.index(joint)]
                axial[:, k] = found.carrier_acceleration[:, path.index(joint)]
    wrench[:, [k for k, joint in enumerate(loops.driven) if loops.inside(joint)]] = np.nan
    turned = np.swapaxes(whole.turns, 1, 2)
    torque, gear = ((turned @ values[:, :, None])[..., 0] for values in (torque, gear))
    for pair in map(list, loops.shared):
        half = 0.5 * gear[:, pair].sum(axis=1, keepdims=True)
        torque[:, pair] += half - gear[:, pair]
        gear[:, pair] = half
    return torque, gear, wrench, axial
