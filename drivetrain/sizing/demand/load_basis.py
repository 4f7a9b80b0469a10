"""What arm, payload and drives ask of each joint, as a sum over a few numbers of each drive.

Newton and Euler are linear in mass and inertia. A drive loads the joints before it through five numbers: its mass,
its inertia across and along its axis, the inertia of its rotor, and that inertia times the ratio. What one unit of
each does to each joint over the cycle is computed once; any set of drives is then a weighted sum, for an evaluation
as for a search. Where motors are coupled, "joint" means the shaft behind the gear of the joint's drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    mount_point,
    rotor_ratio,
    seat,
    seated_rotor,
)

AT_ONCE = 1024  # samples gone along at once: what rows are made of stays in a near cache


@dataclass(frozen=True, eq=False)
class Loads:
    """What is asked of joints, in each joint's own coordinate."""

    force: Array  # at the gear's output, equation 8.110 [N m or N], (n, N)
    wrench: Array  # moment [N m] and force [N] passed on, joint frame, (n, N, 6)
    # diagonal of the mass matrix, rotors of other joints included [kg m^2 or kg], (n, N); of shafts, with the other
    # shafts held still
    inertia: Array
    carrier_acceleration: Array  # angular, of the link before the joint along its axis [rad/s^2], (n, N)


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
    on_bearing: bool
    drives: tuple[int, ...]
    force: Array
    wrench: Array
    inertia: Array

    def rows(self, drive: int) -> slice:
        """Of one of the drives."""
        at = NUMBERS * self.drives.index(drive)
        return slice(at, at + NUMBERS)

    @cached_property
    def magnitude(self) -> Array:
        """Of ``force``."""
        return np.abs(self.force)


def load_basis(study: Study, *, forces_only: bool = False) -> tuple[JointBasis, ...]:
    """The basis of every joint; with ``forces_only`` wrenches and inertias are rows of no width."""
    if study.arm is None:
        return ()
    arm = emptied(study)
    bare = _with_payloads(study, arm, forces_only)
    joints = [_empty_rows(study, bare, joint) for joint in range(arm.n)]
    if arm.linkage is None and study.base is None:
        _fill_going_along(study, arm, joints)
    else:
        _fill_by_runs(study, arm, joints, forces_only)
    for joint, basis in enumerate(joints):
        if joint in basis.drives:  # the load's inertia leaves the joint's own rotor out
            basis.inertia[basis.rows(joint)][3:] = 0.0
    return tuple(replace(one, wrench=one.wrench.reshape(len(one.wrench), 6 * one.wrench.shape[1])) for one in joints)


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


def _loads(study: Study, arm: Arm, forces_only: bool, chosen: Any = slice(None)) -> Loads:
    """What a motion asks of an arm, at all samples or at some; wrenches and inertias may be left out."""
    gear, wrench, carrier = _loads_at(study, arm, chosen)
    if forces_only:
        nothing = np.zeros((*gear.T.shape, 0))
        return Loads(gear.T, nothing, nothing, carrier.T)
    return Loads(gear.T, np.swapaxes(wrench, 0, 1), _inertia(arm, study.cycle.position[chosen]), carrier.T)


def _loads_at(study: Study, arm: Arm, chosen: Any) -> tuple[Array, Array, Array]:
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
    moved = turns.copy()
    for pair in () if arm.linkage is None else map(list, arm.linkage.loops.shared):
        moved[np.ix_(pair, pair)] = 1.0  # two motors on one axis: one does not turn without the other
    units = [np.broadcast_to(column, q.shape) for column in moved.T]
    found = (inverse_dynamics(floating, q, rest, unit) for unit in units)
    return np.array([torque @ column for torque, column in zip(found, turns.T, strict=True)])


def _with_payloads(study: Study, arm: Arm, forces_only: bool) -> Loads:
    """What the task asks without drives, each sample with what it carries, and counterbalances' help."""
    carried, parts = study.cycle.payload, []
    for payload in np.unique(carried):
        chosen = np.flatnonzero(carried == payload)
        parts.append((chosen, _loads(study, carrying(study, arm, int(payload)), forces_only, chosen)))
    whole = []
    for name in ("force", "wrench", "inertia", "carrier_acceleration"):
        row = getattr(parts[0][1], name)
        whole.append(np.empty((arm.n, len(carried), *row.shape[2:])))
        for chosen, part in parts:
            whole[-1][:, chosen] = getattr(part, name)
    bare = Loads(*whole)
    return replace(bare, force=bare.force - counterbalance_torques(study, study.cycle.position).T)


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


def _empty_rows(study: Study, bare: Loads, joint: int) -> JointBasis:
    """One joint with rows for the drives that load it, to be filled; those of wrenches (rows, N, 6)."""
    assert study.arm is not None
    drives, slides = loading_drives(study, joint), study.arm.slides[joint]
    own = Loads(bare.force[joint], bare.wrench[joint], bare.inertia[joint], bare.carrier_acceleration[joint])
    on_bearing = not (slides or study.joints[joint].coupled or np.isnan(own.wrench).any())
    full, rows = bare.inertia.shape[-1], NUMBERS * len(drives)
    force, wrench, inertia = (np.zeros((rows, *shape)) for shape in (own.force.shape, (full, 6), (full,)))
    return JointBasis(own, slides, on_bearing, drives, force, wrench, inertia)


# Of the arm, of rotors of inertia 1 and ratio 1 and -1, and of bodies of mass 1 on the drive's link: a point, one with
# an inertia across its axis, one with the same all round.
_OF_RUNS = np.array([
    [-1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, -1.0, 1.0],
    [-1.0, 0.5, 0.5, 0.0, 0.0, 0.0], [0.0, 0.5, -0.5, 0.0, 0.0, 0.0],
])  # fmt: skip


def _fill_by_runs(study: Study, arm: Arm, joints: Sequence[JointBasis], forces_only: bool) -> None:
    """What a unit of each number adds, as differences of whole runs, for loops and bases that move."""
    for k, task in enumerate(study.joints):
        link, point, axis = (
            carrier_link(arm, k, task.mount), mount_point(arm, k, task.mount), arm.axes[seat(k, task.mount)],
        )  # fmt: skip
        rotors = [seated_rotor(arm, k, task.mount, ratio, 1.0) for ratio in (1.0, -1.0)]
        arms = [arm, *(with_rotors(arm, [own if i == k else None for i in range(arm.n)]) for own in rotors)]
        weighs = link >= 0 and study.drive_mass is not DriveMass.INCLUDED
        for inertia in (np.zeros((3, 3)), np.eye(3) - np.outer(axis, axis), np.eye(3)) if weighs else ():
            arms.append(with_body(arm, link, 1.0, point, inertia))
        runs = [_loads(study, one, forces_only) for one in arms]
        for name in ("force", "wrench", "inertia"):
            units = np.tensordot(_OF_RUNS[:, : len(runs)], [getattr(one, name) for one in runs], 1)
            units[: 0 if weighs else 3] = 0.0
            for joint, basis in enumerate(joints):
                if k in basis.drives:
                    rows = getattr(basis, name)[basis.rows(k)]
                    rows[:] = units[:, joint].reshape(rows.shape)


def _fill_going_along(study: Study, arm: Arm, joints: Sequence[JointBasis]) -> None:
    """The same of an open chain, in one pass over the motion."""
    cycle, n, samples = study.cycle, arm.n, len(study.cycle.time)
    mounts = [task.mount for task in study.joints]
    axes = arm.axes
    riders = Riders(
        np.array([carrier_link(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([mount_point(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([axes[seat(k, mount)] for k, mount in enumerate(mounts)]),
        np.full(n, study.drive_mass is not DriveMass.INCLUDED),
    )
    frames = link_frames(arm)[1:, :3]
    frames[:, :, :3] = [frame_along(axis) for axis in axes]
    turns = np.eye(n) if arm.coupling is None else np.array(np.linalg.inv(arm.coupling).T)  # a row a shaft
    for first in range(0, samples, AT_ONCE):
        part = slice(first, first + AT_ONCE)
        motion = [np.array(row[part]) for row in (cycle.position, cycle.velocity, cycle.acceleration)]
        shafts = [np.ascontiguousarray(shaft_motion(arm, row)) for row in motion[1:]]
        along = Along(*(np.zeros((n, *rows, len(motion[0]))) for rows in ((6,), (12,), (NUMBERS, 6), (6,))))
        go_along(np.array(arm.screws), frames, np.array(arm.gravity), riders, *motion, *shafts, along)
        for joint, basis in enumerate(joints):
            for drive in basis.drives:
                rows = (row[basis.rows(drive)] for row in (basis.force, basis.wrench, basis.inertia))
                fill_rows(along, riders, joint, drive, turns[joint], first, *rows)
