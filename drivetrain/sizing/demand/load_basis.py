"""What arm, payload and drives ask of each joint, as a sum over a few numbers of each drive.

Newton and Euler are linear in mass and inertia. A drive loads the joints before it through five numbers: its mass,
its inertia across and along its axis, the inertia of its rotor, and that inertia times the ratio. What one unit of
each does to each joint over the cycle is computed once; any set of drives is then a weighted sum, for an evaluation
as for a search. Where motors are coupled, "joint" means the shaft behind the gear of the joint's drive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import on_moving_base, with_body
from drivetrain.arm.coupling import shaft_motion, shaft_torques
from drivetrain.arm.geared import with_rotors
from drivetrain.arrays import Array
from drivetrain.drive.counterbalance import counterbalance_torque
from drivetrain.drive.drive import Drive, drive_inertia
from drivetrain.dynamics.core.packed import link_frames
from drivetrain.dynamics.inverse import inverse_dynamics, joint_loads
from drivetrain.motion.base import BASE_JOINTS, base_states
from drivetrain.sizing.demand.unit_loads import NUMBERS, Along, Riders, fill_rows, go_along
from drivetrain.spatial.rotations import frame_along
from drivetrain.study.model import DriveMass, Study
from drivetrain.study.parts.mounting import (
    carrier_link,
    carrying,
    drive_body,
    emptied,
    joint_axis,
    mount_point,
    rotor_ratio,
    seat,
    seated_rotor,
)

AT_ONCE = 1024  # samples gone along at once: what rows are made of stays in a near cache


@dataclass(frozen=True, eq=False)
class Loads:
    """What is asked of joints, in each joint's own coordinate.

    Attributes:
        force: At the gear's output, equation 8.110 [N m or N], (n, N).
        wrench: Moment [N m] and force [N] passed on, joint frame, (n, N, 6).
        inertia: Diagonal of the mass matrix, rotors of other joints included [kg m^2 or kg], (n, N); of shafts, with
            the other shafts held still.
        carrier_acceleration: Angular, of the link before the joint along its axis [rad/s^2], (n, N).
    """

    force: Array
    wrench: Array
    inertia: Array
    carrier_acceleration: Array


@dataclass(frozen=True, eq=False)
class JointBasis:
    """One joint: what is asked without any drive, and what a unit of each number of each drive adds.

    Attributes:
        bare: Of arm and payload; the leading axis is dropped.
        slides: Whether the joint is prismatic.
        told: Whether the wrench is one on the gear's bearing: not where a guide carries the joint, where the gear turns
            a shaft away from it, or where a loop closes around it.
        drives: Joints whose drives load this one, in the order of their rows.
        force, wrench, inertia: Added by one unit, NUMBERS rows a drive, (rows, N), (rows, 6 N), (rows, N).
    """

    bare: Loads
    slides: bool
    told: bool
    drives: tuple[int, ...]
    force: Array
    wrench: Array
    inertia: Array

    @cached_property
    def magnitude(self) -> Array:
        """Of ``force``."""
        return np.abs(self.force)


def load_basis(study: Study, *, forces_only: bool = False) -> tuple[JointBasis, ...]:
    """The basis of every joint; with ``forces_only`` wrenches and inertias are rows of no width."""
    if study.arm is None:
        return ()
    arm, loads = emptied(study), _forces if forces_only else _loads
    bare = _with_payloads(study, arm, loads)
    bare = replace(bare, force=bare.force - counterbalance_torques(study, study.cycle.position).T)
    if arm.linkage is None and study.base is None:
        return _with_units(study, arm, bare)
    reference = loads(study, arm)  # differences of whole runs: a loop carries what a drive weighs to joints elsewhere
    units = [_units(study, arm, reference, joint, loads) for joint in range(arm.n)]
    return tuple(_of_joint(study, bare, units, joint, not arm.screws[joint, :3].any()) for joint in range(arm.n))


def counterbalance_torques(study: Study, position: Array) -> Array:
    """What counterbalances give to the joints, at the shafts where motors are coupled [N m], (N, n)."""
    columns = [counterbalance_torque(task.counterbalances, position[:, i]) for i, task in enumerate(study.joints)]
    torque = np.column_stack(columns)
    return torque if study.arm is None else shaft_torques(study.arm, torque)


def drive_numbers(study: Study, joint: int, drive: Drive) -> Array:
    """The five numbers through which a drive loads the joints before it."""
    inertia = drive_inertia(drive)
    spinning = [inertia, inertia * rotor_ratio(drive, study.joints[joint])]
    moved = (0.0, 0.0, 0.0) if study.drive_mass is DriveMass.INCLUDED else drive_body(drive)
    return np.array([*moved, *spinning])


def all_numbers(study: Study, basis: JointBasis, drives: Mapping[int, Drive]) -> Array:
    """The numbers of all drives that load a joint, in the order of its basis."""
    nothing = np.zeros(NUMBERS)
    rows = [drive_numbers(study, k, drives[k]) if k in drives else nothing for k in basis.drives]
    return np.concatenate(rows) if rows else np.zeros(0)


def _loads(study: Study, arm: Arm, chosen: Any = slice(None)) -> Loads:
    """What a motion asks of an arm, at all samples or at some."""
    gear, wrench, carrier = _asked(study, arm, chosen)
    return Loads(gear.T, np.swapaxes(wrench, 0, 1), _inertia(arm, study.cycle.position[chosen]), carrier.T)


def _forces(study: Study, arm: Arm, chosen: Any = slice(None)) -> Loads:
    """The same without wrenches and inertias."""
    gear, _, carrier = _asked(study, arm, chosen)
    nothing = np.zeros((*gear.T.shape, 0))
    return Loads(gear.T, nothing, nothing, carrier.T)


def _asked(study: Study, arm: Arm, chosen: Any) -> tuple[Array, Array, Array]:
    """Gear torques, wrenches and carriers' accelerations at some samples, those of a base that moves left out."""
    cycle, still = study.cycle, 0
    motion = [rows[chosen] for rows in (cycle.position, cycle.velocity, cycle.acceleration)]
    if study.base is not None:
        arm, still = on_moving_base(arm), len(BASE_JOINTS)
        states = base_states(study.base, cycle.time[chosen])
        motion = [np.hstack(rows) for rows in zip(states, motion, strict=True)]
    found = joint_loads(arm, *motion)
    return found.gear[:, still:], found.wrench[:, still:], found.carrier_acceleration[:, still:]


def _inertia(arm: Arm, q: Array) -> Array:
    """The diagonal of the mass matrix, of shafts where motors are coupled, (n, N), as the torque of unit accelerations.

    The recursion is compiled anyway; the mass matrix would be compiled for this alone, which a first run would feel.
    """
    floating, rest = replace(arm, gravity=np.zeros(3)), np.zeros_like(q)
    turns = np.eye(arm.n) if arm.coupling is None else np.linalg.inv(arm.coupling)
    units = [np.broadcast_to(column, q.shape) for column in turns.T]
    return np.array([inverse_dynamics(floating, q, rest, unit) @ unit[0] for unit in units])


def _with_payloads(study: Study, arm: Arm, loads: Callable[..., Loads]) -> Loads:
    """What the task asks without drives, each sample with what it carries."""
    samples, names = len(study.cycle.time), ("force", "wrench", "inertia", "carrier_acceleration")
    parts: dict[str, list[Array]] = {name: [] for name in names}
    order = []
    for payload in np.unique(study.cycle.payload):
        chosen = np.flatnonzero(study.cycle.payload == payload)
        order.append(chosen)
        part = loads(study, carrying(study, arm, int(payload)), chosen)
        for name in names:
            parts[name].append(getattr(part, name))
    back = np.empty(samples, dtype=np.int64)
    back[np.concatenate(order)] = np.arange(samples)
    return Loads(*(np.concatenate(parts[name], axis=1)[:, back] for name in names))


def _units(study: Study, arm: Arm, reference: Loads, joint: int, loads: Callable[..., Loads]) -> list[Loads]:
    """What one unit of each number of one joint's drive adds to all joints."""
    mount = study.joints[joint].mount
    link, point = carrier_link(arm, joint, mount), mount_point(arm, joint, mount)
    axis = joint_axis(arm, seat(joint, mount))
    across = np.eye(3) - np.outer(axis, axis)

    def with_rotor(ratio: float) -> Loads:
        """With a rotor of unit inertia."""
        own = seated_rotor(arm, joint, mount, ratio, 1.0)
        return loads(study, with_rotors(arm, [own if index == joint else None for index in range(arm.n)]))

    forward, backward = with_rotor(1.0), with_rotor(-1.0)
    spinning = [
        _difference(_scaled_sum(forward, backward, 0.5), reference),
        _scaled_sum(forward, _negative(backward), 0.5),
    ]
    nothing = _difference(reference, reference)
    if link < 0 or study.drive_mass is DriveMass.INCLUDED:
        return [nothing, nothing, nothing, *spinning]
    # A body of mass 1 with no inertia, with one across its axis, and with one all round: differences are the units.
    point_mass = loads(study, with_body(arm, link, 1.0, point, np.zeros((3, 3))))
    rod = loads(study, with_body(arm, link, 1.0, point, across))
    ball = loads(study, with_body(arm, link, 1.0, point, np.eye(3)))
    moved = [_difference(point_mass, reference), _difference(rod, point_mass), _difference(ball, rod)]
    return [*moved, *spinning]


def loading_drives(study: Study, joint: int) -> tuple[int, ...]:
    """The drives that may load a joint, or where motors are coupled its shaft."""
    assert study.arm is not None
    names, linkage = [task.name for task in study.joints], study.arm.linkage
    carriers = [carrier_link(study.arm, k, task.mount) for k, task in enumerate(study.joints)]
    if linkage is not None:
        return tuple(k for k, carrier in enumerate(carriers) if joint in linkage.loops.moving(carrier))
    coupled = study.joints[joint].coupled
    first = min((names.index(name) for name in coupled), default=joint)
    riding = {k for k, carrier in enumerate(carriers) if carrier >= first}
    own = {joint} & riding
    others = riding if coupled else set[int]()
    return tuple(sorted({*range(joint + 1, len(names)), *own, *others}))


def _of_joint(study: Study, bare: Loads, units: list[list[Loads]], joint: int, slides: bool) -> JointBasis:
    drives = loading_drives(study, joint)
    rows = [unit for k in drives for unit in units[k]]

    def stacked(name: str) -> Array:
        """One row a number."""
        values = [getattr(unit, name)[joint].reshape(-1) for unit in rows]
        return np.stack(values) if values else np.zeros((0, getattr(bare, name)[joint].size))

    own = Loads(bare.force[joint], bare.wrench[joint], bare.inertia[joint], bare.carrier_acceleration[joint])
    inertia = stacked("inertia")
    if joint in drives:  # the load's inertia leaves the joint's own rotor out
        at = NUMBERS * drives.index(joint)
        inertia[at + 3 : at + NUMBERS] = 0.0
    told = not (slides or study.joints[joint].coupled or np.isnan(own.wrench).any())
    return JointBasis(own, slides, told, drives, stacked("force"), stacked("wrench"), inertia)


def _difference(first: Loads, second: Loads) -> Loads:
    return _scaled_sum(first, _negative(second), 1.0)


def _negative(loads: Loads) -> Loads:
    return replace(loads, force=-loads.force, wrench=-loads.wrench, inertia=-loads.inertia)


def _scaled_sum(first: Loads, second: Loads, scale: float) -> Loads:
    return replace(
        first,
        force=scale * (first.force + second.force),
        wrench=scale * (first.wrench + second.wrench),
        inertia=scale * (first.inertia + second.inertia),
    )


def _with_units(study: Study, arm: Arm, bare: Loads) -> tuple[JointBasis, ...]:
    """Every joint with what a unit of each number of the drives that load it adds."""
    cycle, n, samples = study.cycle, arm.n, len(study.cycle.time)
    mounts = [task.mount for task in study.joints]
    axes = [joint_axis(arm, i) for i in range(n)]
    riders = Riders(
        np.array([carrier_link(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([mount_point(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([axes[seat(k, mount)] for k, mount in enumerate(mounts)]),
        np.full(n, study.drive_mass is not DriveMass.INCLUDED),
    )
    frames = link_frames(arm)[1:, :3]
    frames[:, :, :3] = [frame_along(axis) for axis in axes]
    turns = np.eye(n) if arm.coupling is None else np.array(np.linalg.inv(arm.coupling).T)  # a row a shaft
    full, joints = bare.inertia.shape[-1], []
    for joint in range(n):
        drives = loading_drives(study, joint)
        force, wrench, inertia = (
            np.zeros((NUMBERS * len(drives), *shape)) for shape in ((samples,), (full, 6), (full,))
        )
        own = Loads(bare.force[joint], bare.wrench[joint], bare.inertia[joint], bare.carrier_acceleration[joint])
        slides = not arm.screws[joint, :3].any()
        told = not (slides or study.joints[joint].coupled)
        joints.append(JointBasis(own, slides, told, drives, force, wrench, inertia))
    for first in range(0, samples, AT_ONCE):
        part = slice(first, first + AT_ONCE)
        motion = [np.array(row[part]) for row in (cycle.position, cycle.velocity, cycle.acceleration)]
        shafts = [np.ascontiguousarray(shaft_motion(arm, row)) for row in motion[1:]]
        along = Along(*(np.zeros((n, *rows, len(motion[0]))) for rows in ((6,), (12,), (NUMBERS, 6), (6,))))
        go_along(np.array(arm.screws), frames, np.array(arm.gravity), riders, *motion, *shafts, along)
        for joint, basis in enumerate(joints):
            rows = (basis.force, basis.wrench, basis.inertia)
            for at, drive in enumerate(basis.drives):
                of = slice(NUMBERS * at, NUMBERS * (at + 1))
                fill_rows(along, riders, joint, drive, turns[joint], first, *(row[of] for row in rows))
                if joint == drive:  # the load's inertia leaves the joint's own rotor out
                    basis.inertia[of][3:] = 0.0
    return tuple(replace(one, wrench=one.wrench.reshape(len(one.wrench), 6 * full)) for one in joints)
