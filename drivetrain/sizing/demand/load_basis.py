"""Load basis: the loads of each joint as a linear function of the load parameters of the drives.

Newton and Euler are linear in mass and inertia. A drive loads the joints before it through five numbers: its mass,
its inertia across and along its axis, the inertia of its rotor, and that inertia times the ratio. What one unit of
each does to each joint over the cycle is computed once; any set of drives is then a weighted sum, for an evaluation
as for a search. Where motors are coupled, "joint" means the shaft behind the gear of the joint's drive. Everything is
told at the gear's output: of a joint that slides, a turn of what moves it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
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
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.demand.unit_loads import NUMBERS, PAIR, Riders, Rows, fill_rows
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


@dataclass(frozen=True, eq=False)
class Loads:
    """What is asked of a joint, or of n joints with a leading axis more."""

    force: Array  # torque of the gear's output, equation 8.110 [N m, or N where a motor pushes itself], (N,)
    wrench: Array  # moment [N m] and force [N] passed on, joint frame, (6, N); (6, 0) where the gear's bearing has none
    # diagonal of the mass matrix, rotors of other joints included [kg m^2 or kg], (N,); of shafts, with the other
    # shafts held still
    inertia: Array
    carrier_acceleration: Array  # angular, of the link before the joint along its axis [rad/s^2], (N,)


@dataclass(frozen=True, eq=False)
class JointBasis:
    """Loads of one joint without drives, and per unit of each load parameter of each drive.

    Attributes:
        bare: Of arm and payload.
        slides: Whether the joint is prismatic.
        on_bearing: Whether the wrench is one on the gear's bearing: not where a guide carries the joint, where the gear
            turns a shaft away from it, or where a loop closes around it.
        drives: Joints whose drives load this one, in the order of their rows.
        force, wrench, inertia: Added by one unit, NUMBERS rows a drive, (rows, N), (rows, 6, N), (rows, N).
    """

    bare: Loads
    slides: bool
    on_bearing: bool
    drives: tuple[int, ...]
    force: Array
    wrench: Array
    inertia: Array

    def rows(self, drive: int) -> slice:
        """Rows of one of the drives."""
        at = NUMBERS * self.drives.index(drive)
        return slice(at, at + NUMBERS)


def load_basis(study: Study, cycle: Cycle | None = None, *, forces_only: bool = False) -> tuple[JointBasis, ...]:
    """The basis of every joint, in the study's cycle or another motion; ``forces_only``: others have no samples."""
    if study.arm is None:
        return ()
    cycle = study.cycle if cycle is None else cycle
    bare = _with_payloads(study, cycle, forces_only)
    joints, rows, pairs = _empty_rows(study, bare)
    if study.arm.linkage is None and study.base is None:
        _fill_going_along(study, cycle, rows, pairs)
    else:
        _fill_by_runs(study, cycle, joints, forces_only)
    for joint, (basis, task) in enumerate(zip(joints, study.joints, strict=True)):
        if joint in basis.drives:  # the load's inertia leaves the joint's own rotor out
            basis.inertia[basis.rows(joint)][3:] = 0.0
        if task.travel_per_turn is not None:
            for loads in (basis, basis.bare):
                loads.force[:] *= task.travel_per_turn
                loads.inertia[:] *= task.travel_per_turn**2
    return tuple(joints)


def counterbalance_torques(study: Study, position: Array) -> Array:
    """Torques of the counterbalances on the joints, or on the shafts if motors are coupled [N m], (N, n)."""
    columns = [counterbalance_torque(task.counterbalances, position[:, i]) for i, task in enumerate(study.joints)]
    torque = np.column_stack(columns)
    return torque if study.arm is None else shaft_torques(study.arm, torque)


def drive_numbers(study: Study, joint: int, drive: Drive) -> Array:
    """Load parameters of a drive: mass, inertias across and along its axis, of its rotor, and that times the ratio."""
    inertia = drive_inertia(drive)
    spinning = [inertia, inertia * rotor_ratio(drive, study.joints[joint])]
    moved = (0.0, 0.0, 0.0) if study.drive_mass is DriveMass.INCLUDED else drive_body(drive)
    return np.array([*moved, *spinning])


def all_numbers(study: Study, basis: JointBasis, drives: Mapping[int, Drive]) -> Array:
    """The load parameters of all drives that load a joint, in the order of its basis; zeros for missing drives."""
    nothing = np.zeros(NUMBERS)
    rows = [drive_numbers(study, k, drives[k]) if k in drives else nothing for k in basis.drives]
    return np.concatenate(rows) if rows else np.zeros(0)


def _loads(study: Study, cycle: Cycle, arm: Arm, forces_only: bool, chosen: Any = slice(None)) -> Loads:
    """What a motion asks of an arm, at all samples or at some; wrenches and inertias may be left out."""
    motion, still = [rows[chosen] for rows in (cycle.position, cycle.velocity, cycle.acceleration)], 0
    if study.base is not None:
        moved, still = on_moving_base(arm), len(BASE_JOINTS)
        states = base_states(study.base, cycle.time[chosen])
        found = joint_loads(moved, *(np.hstack(rows) for rows in zip(states, motion, strict=True)))
    else:
        found = joint_loads(arm, *motion)
    gear, wrench, carrier = (np.moveaxis(one[:, still:], 0, -1) for one in (
        found.gear, found.wrench, found.carrier_acceleration,
    ))  # fmt: skip
    if forces_only:
        return Loads(gear, wrench[..., :0], gear[:, :0], carrier)
    return Loads(gear, wrench, _inertia(arm, motion[0]), carrier)


@lru_cache(maxsize=8)
def _weightless(arm: Arm) -> Arm:
    return replace(arm, gravity=np.zeros(3))


def _inertia(arm: Arm, q: Array) -> Array:
    """The diagonal of the mass matrix, of shafts where motors are coupled, (n, N), as the torque of unit accelerations.

    The recursion is compiled anyway; the mass matrix would be compiled for this alone, which a first run would feel.
    """
    rest = np.zeros_like(q)
    turns = np.eye(arm.n) if arm.coupling is None else np.linalg.inv(arm.coupling)
    moved = turns.copy()
    for pair in () if arm.linkage is None else map(list, arm.linkage.loops.shared):
        moved[np.ix_(pair, pair)] = 1.0  # two motors on one axis: one does not turn without the other
    units = [np.broadcast_to(column, q.shape) for column in moved.T]
    found = (inverse_dynamics(_weightless(arm), q, rest, unit) for unit in units)
    return np.array([torque @ column for torque, column in zip(found, turns.T, strict=True)])


def _with_payloads(study: Study, cycle: Cycle, forces_only: bool) -> Loads:
    """What the task asks without drives, each sample with what it carries, and counterbalances' help."""
    arm, carried, parts = emptied(study), cycle.payload, []
    for payload in np.unique(carried):
        chosen = np.flatnonzero(carried == payload)
        parts.append((chosen, _loads(study, cycle, carrying(study, arm, int(payload)), forces_only, chosen)))
    whole = []
    for name in ("force", "wrench", "inertia", "carrier_acceleration"):
        row = getattr(parts[0][1], name)
        whole.append(np.empty((*row.shape[:-1], len(carried) if row.shape[-1] else 0)))
        for chosen, part in parts if row.shape[-1] else ():
            whole[-1][..., chosen] = getattr(part, name)
    bare = Loads(*whole)
    return replace(bare, force=bare.force - counterbalance_torques(study, cycle.position).T)


def loading_drives(study: Study, joint: int) -> tuple[int, ...]:
    """The drives that may load a joint, or where motors are coupled its shaft."""
    assert study.arm is not None
    names, linkage = [task.name for task in study.joints], study.arm.linkage
    carriers = [carrier_link(study.arm, k, task.mount) for k, task in enumerate(study.joints)]
    coupled = study.joints[joint].coupled
    if linkage is not None:
        turned = {joint, *(names.index(name) for name in coupled)}
        return tuple(k for k, carrier in enumerate(carriers) if turned & {*linkage.loops.moving(carrier)})
    first = min((names.index(name) for name in coupled), default=joint)
    riding = {k for k, carrier in enumerate(carriers) if carrier >= first}
    own = {joint} & riding
    others = riding if coupled else set[int]()
    return tuple(sorted({*range(joint + 1, len(names)), *own, *others}))


def _empty_rows(study: Study, bare: Loads) -> tuple[list[JointBasis], Rows, Any]:
    """All joints with rows to be filled, these in one, and which of them a drive at a joint fills, as records PAIR."""
    arm = emptied(study)
    drives = [loading_drives(study, joint) for joint in range(arm.n)]
    samples, full = bare.force.shape[-1], bare.inertia.shape[-1]
    whole = Rows(*(np.zeros((NUMBERS * sum(map(len, drives)), *some)) for some in ((samples,), (6, full), (full,))))
    joints: list[JointBasis] = []
    pairs: list[tuple[int, int, int, bool]] = []
    for joint, some in enumerate(drives):
        own = Loads(bare.force[joint], bare.wrench[joint], bare.inertia[joint], bare.carrier_acceleration[joint])
        on_bearing = not (arm.slides[joint] or study.joints[joint].coupled or np.isnan(own.wrench).any())
        rows, width = slice(NUMBERS * len(pairs), NUMBERS * (len(pairs) + len(some))), full if on_bearing else 0
        pairs += [(joint, drive, rows.start + NUMBERS * i, on_bearing) for i, drive in enumerate(some)]
        own = replace(own, wrench=own.wrench[:, :width])
        force, wrench, inertia = whole.force[rows], whole.wrench[rows, :, :width], whole.inertia[rows]
        joints.append(JointBasis(own, arm.slides[joint], on_bearing, some, force, wrench, inertia))
    return joints, whole, np.array(pairs, PAIR)


# Of the arm, of rotors of inertia 1 and ratio 1 and -1, and of bodies of mass 1 on the drive's link: a point, one with
# an inertia across its axis, one with the same all round.
_OF_RUNS = np.array([
    [-1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, -1.0, 1.0],
    [-1.0, 0.5, 0.5, 0.0, 0.0, 0.0], [0.0, 0.5, -0.5, 0.0, 0.0, 0.0],
])  # fmt: skip


def _fill_by_runs(study: Study, cycle: Cycle, joints: Sequence[JointBasis], forces_only: bool) -> None:
    """What a unit of each number adds, as differences of whole runs, for loops and bases that move."""
    arm = emptied(study)
    for k, task in enumerate(study.joints):
        link, point, axis = (
            carrier_link(arm, k, task.mount), mount_point(arm, k, task.mount), arm.axes[seat(k, task.mount)],
        )  # fmt: skip
        rotors = [seated_rotor(arm, k, task.mount, ratio, 1.0) for ratio in (1.0, -1.0)]
        arms = [arm, *(with_rotors(arm, [own if i == k else None for i in range(arm.n)]) for own in rotors)]
        weighs = link >= 0 and study.drive_mass is not DriveMass.INCLUDED
        for inertia in (np.zeros((3, 3)), np.eye(3) - np.outer(axis, axis), np.eye(3)) if weighs else ():
            arms.append(with_body(arm, link, 1.0, point, inertia))
        runs = [_loads(study, cycle, one, forces_only) for one in arms]
        for name in ("force", "wrench", "inertia"):
            units = np.tensordot(_OF_RUNS[:, : len(runs)], [getattr(one, name) for one in runs], 1)
            units[: 0 if weighs else 3] = 0.0
            for joint, basis in enumerate(joints):
                rows = getattr(basis, name)
                if k in basis.drives and rows.size:
                    rows[basis.rows(k)] = units[:, joint]


def _fill_going_along(study: Study, cycle: Cycle, rows: Rows, pairs: Any) -> None:
    """The same of an open chain, in one pass over the motion."""
    arm, mounts = emptied(study), [task.mount for task in study.joints]
    axes = arm.axes
    riders = Riders(
        np.array([carrier_link(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([mount_point(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([axes[seat(k, mount)] for k, mount in enumerate(mounts)]),
        np.full(arm.n, study.drive_mass is not DriveMass.INCLUDED),
    )
    frames = link_frames(arm)[1:, :3]
    frames[:, :, :3] = [frame_along(axis) for axis in axes]
    turns = np.eye(arm.n) if arm.coupling is None else np.array(np.linalg.inv(arm.coupling).T)  # a row a shaft
    motion = [np.array(row) for row in (cycle.position, cycle.velocity, cycle.acceleration)]
    shafts = [np.ascontiguousarray(shaft_motion(arm, row)) for row in motion[1:]]
    fill_rows(np.array(arm.screws), frames, np.array(arm.gravity), riders, turns, pairs, *motion, *shafts, rows)
