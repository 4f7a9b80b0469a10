"""Arms with closed loops: motion of the passive joints, and torques of the driven joints.

Pins close the loops: ``A_p qd_p + A_d qd_d = 0`` for passive and driven joints. So ``qd = J qd_d`` for all joints, and
since the forces in ideal pins do no work, the torques of the driven joints are ``J^T tau`` from the torques tau of the
open chains. This is the constrained inverse dynamics without the pin forces. Friction in the pins is not included.

Reference: Featherstone, Rigid Body Dynamics Algorithms (2008), section 8.2 (loop constraints by explicit constraints).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm, Linkage, Loops
from drivetrain.arm.coupling import coupled_groups
from drivetrain.arrays import Array
from drivetrain.dynamics.core.loops import close_samples, move_samples, pins_of
from drivetrain.errors import Fault, InputError


class WholeMotion(NamedTuple):
    """Motion of all m joints of an arm with loops."""

    # [rad or m, and per s, s^2], (N, m)
    position: Array
    velocity: Array
    acceleration: Array
    turns: Array  # J, motion of each joint per unit of each driven joint [-, rad/m or m/rad], (N, m, n)


def whole_motion(linkage: Linkage, q: Array, qd: Array, qdd: Array) -> WholeMotion:
    """Motion of all joints for a motion of the driven ones, (N, n) each; raises ``InputError`` if pins cannot close."""
    geometry = _Geometry(linkage.loops, tuple(chain.screws.tobytes() for chain in linkage.chains), linkage)
    position = _closed(geometry, np.ascontiguousarray(q).tobytes(), len(q))
    count, m = position.shape
    turns, drift = np.zeros((count, m, q.shape[1])), np.zeros((count, m))
    moved = move_samples(pins_of(linkage), position, np.ascontiguousarray(qd), turns, drift)
    if moved < count:
        raise _unreached(q[moved])
    velocity, acceleration = ((turns @ values[:, :, None])[..., 0] for values in (qd, qdd))
    return WholeMotion(position, velocity, acceleration + drift, turns)


@dataclass(frozen=True)
class _Geometry:
    """A linkage as a key of the cache: equal to others with the same loops and screws."""

    loops: Loops
    screws: tuple[bytes, ...]
    linkage: Linkage = field(compare=False)


@lru_cache(maxsize=8)
def _closed(geometry: _Geometry, key: bytes, count: int) -> Array:
    """Positions of all joints, (N, m); ``key`` are those of the driven ones."""
    q, pins = np.frombuffer(key).reshape(count, -1), pins_of(geometry.linkage)
    place = np.zeros((count, len(pins.whole)))
    closed = close_samples(pins, q.copy(), place)
    if closed < count:
        raise _unreached(q[closed])
    return place


def _unreached(q: Array) -> InputError:
    problem = "cannot be reached by the linkage: out of reach, a dead centre, or a joint that no pin holds"
    return InputError(Fault("position of the driven joints", problem, q.tolist(), "in rad or m"))


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
