"""Load basis: the loads of each joint as a linear function of the load parameters of the drives.

The equations of Newton and Euler are linear in mass and inertia. A drive loads the joints before it through five load
parameters: its mass, its inertia across and along its axis, the inertia of its rotor, and that times the ratio. The
load of each joint per unit of each parameter is computed once over the motion; the load by any set of drives is then a
weighted sum, in an evaluation as in a search.

All quantities refer to the output of the gear: of a prismatic joint, to the turning part that moves it. If motors are
coupled to several joints, "joint" means the shaft behind the gear of the joint's drive.
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
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.inverse import WEIGHTLESS, inverse_dynamics, joint_loads
from drivetrain.dynamics.samples import run
from drivetrain.motion.base import BASE_JOINTS, base_states
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.demand.unit_loads import INFLUENCE, PARAMETERS, MountedDrives, UnitLoadRows, compute_unit_loads
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
    """Loads of a joint over N samples, or of n joints in arrays with one more leading axis."""

    torque: Array  # torque of the gear's output, equation 8.110 [N m, or N of a linear motor], (N,)
    wrench: Array  # moment [N m] and force [N] through the joint, joint frame, (6, N); (6, 0) if not on the bearing
    # diagonal of the mass matrix, rotors of other joints included [kg m^2 or kg], (N,); if motors are coupled, of the
    # shafts, with the other shafts held
    inertia: Array
    carrier_acceleration: Array  # angular acceleration of the link before the joint along its axis [rad/s^2], (N,)


@dataclass(frozen=True, eq=False)
class JointBasis:
    """Loads of one joint without drives, and per unit of each load parameter of each drive that loads it."""

    bare: Loads  # loads by arm, payload and counterbalances, without drives
    slides: bool  # whether the joint is prismatic
    # whether the wrench acts on the gear's output bearing: not if a guide carries the joint, if the gear turns a shaft
    # away from it, or if a loop closes around it
    on_bearing: bool
    drives: tuple[int, ...]  # joints whose drives load this one, in the order of their rows
    # loads per unit of each parameter, PARAMETERS rows for each drive, as in ``Loads``, (rows, N)
    torque: Array
    inertia: Array
    wrench: Array  # the same for arms with loops, (rows, 6, N); without samples for others (``drive_wrenches.py``)

    def rows(self, drive: int) -> slice:
        """Rows of one of the drives."""
        first = PARAMETERS * self.drives.index(drive)
        return slice(first, first + PARAMETERS)


def load_basis(study: Study, cycle: Cycle | None = None, *, torques_only: bool = False) -> tuple[JointBasis, ...]:
    """The basis of every joint for a motion, that of the study by default; empty without an arm.

    ``torques_only``: wrenches and inertias are left out; their arrays then have no samples.
    """
    if study.arm is None:
        return ()
    cycle = study.cycle if cycle is None else cycle
    joints, rows, influences = _empty_basis(study, _loads_without_drives(study, cycle, torques_only))
    if study.arm.linkage is None and study.base is None:
        _fill_open_chain(study, cycle, rows, influences)
    else:
        _fill_by_differences(study, cycle, joints, torques_only)
    for joint, (basis, task) in enumerate(zip(joints, study.joints, strict=True)):
        if joint in basis.drives:  # the load inertia excludes the joint's own rotor
            basis.inertia[basis.rows(joint)][3:] = 0.0
        if task.travel_per_turn is not None:
            for loads in (basis, basis.bare):
                loads.torque[:] *= task.travel_per_turn
                loads.inertia[:] *= task.travel_per_turn**2
    return tuple(joints)


def counterbalance_torques(study: Study, position: Array) -> Array:
    """Torques of the counterbalances on the joints, or on the shafts if motors are coupled [N m], (N, n)."""
    columns = [counterbalance_torque(task.counterbalances, position[:, i]) for i, task in enumerate(study.joints)]
    torque = np.column_stack(columns)
    return torque if study.arm is None else shaft_torques(study.arm, torque)


def load_parameters(study: Study, joint: int, drive: Drive) -> Array:
    """The load parameters of a drive, (PARAMETERS,).

    Mass [kg], inertia across and along its axis, rotor inertia, and that times the ratio [kg m^2]. The first three are
    zero if the links of the arm include the drives.
    """
    inertia = drive_inertia(drive)
    rotor = [inertia, inertia * rotor_ratio(drive, study.joints[joint])]
    body = (0.0, 0.0, 0.0) if study.drive_mass is DriveMass.INCLUDED else drive_body(drive)
    return np.array([*body, *rotor])


def all_load_parameters(study: Study, basis: JointBasis, drives: Mapping[int, Drive]) -> Array:
    """The load parameters of all drives that load a joint, in the order of its basis; zeros for missing drives."""
    missing = np.zeros(PARAMETERS)
    rows = [load_parameters(study, k, drives[k]) if k in drives else missing for k in basis.drives]
    return np.concatenate(rows) if rows else np.zeros(0)


def joint_motion(study: Study, cycle: Cycle, samples: Any = slice(None)) -> tuple[Array, ...]:
    """Positions, speeds and accelerations of all joints, those of a moving base first, (N, joints) each."""
    motion = [np.array(rows[samples]) for rows in (cycle.position, cycle.velocity, cycle.acceleration)]
    if study.base is None:
        return tuple(motion)
    return tuple(map(np.hstack, zip(base_states(study.base, cycle.time[samples]), motion, strict=True)))


def _arm_loads(
    study: Study, cycle: Cycle, arm: Arm, torques_only: bool, samples: Any = slice(None), tip: Array | None = None
) -> Loads:
    """Loads of all joints of an arm in a motion, at all samples or at some; ``tip``: its ``Cycle.tip_wrench`` there."""
    base_joints = 0 if study.base is None else len(BASE_JOINTS)
    whole, motion = on_moving_base(arm) if base_joints else arm, joint_motion(study, cycle, samples)
    found = joint_loads(whole, *motion, tip_wrench=tip)
    torque, wrench, carrier = (np.moveaxis(one[:, base_joints:], 0, -1) for one in (
        found.gear, found.wrench, found.carrier_acceleration,
    ))  # fmt: skip
    if torques_only:
        return Loads(torque, wrench[..., :0], torque[:, :0], carrier)
    return Loads(torque, wrench, _load_inertia(arm, cycle.position[samples]), carrier)


@lru_cache(maxsize=8)
def _without_gravity(arm: Arm) -> Arm:
    return replace(arm, gravity=np.zeros(3))


def _load_inertia(arm: Arm, q: Array) -> Array:
    """The diagonal of the mass matrix, of the shafts if motors are coupled, (n, N): the torque of unit accelerations.

    The recursion is compiled for the loads anyway; ``mass_matrix`` would have to be compiled for this alone, which
    lengthens a first run.
    """
    rest = np.zeros_like(q)
    turns = np.eye(arm.n) if arm.coupling is None else np.linalg.inv(arm.coupling)
    moved = turns.copy()
    for pair in () if arm.linkage is None else map(list, arm.linkage.loops.shared):
        moved[np.ix_(pair, pair)] = 1.0  # two motors on one axis turn together
    units = [np.broadcast_to(column, q.shape) for column in moved.T]
    if arm.linkage is None:
        model, q = packed(arm), np.array(q)
        torques = (run(model, (q, rest, np.ascontiguousarray(unit)), gravity=WEIGHTLESS) for unit in units)
    else:
        torques = (inverse_dynamics(_without_gravity(arm), q, rest, unit) for unit in units)
    return np.array([torque @ column for torque, column in zip(torques, turns.T, strict=True)])


def _loads_without_drives(study: Study, cycle: Cycle, torques_only: bool) -> Loads:
    """Loads by arm, counterbalances and, at each sample, the payload that it carries and the force at its tip."""
    arm, carried, pressed, parts = emptied(study), cycle.payload, cycle.tip_wrench, []
    for payload in np.unique(carried):
        samples = np.flatnonzero(carried == payload)
        loaded = carrying(study, arm, int(payload))
        tip = None if pressed is None else pressed[samples]
        parts.append((samples, _arm_loads(study, cycle, loaded, torques_only, samples, tip)))
    joined = []
    for name in ("torque", "wrench", "inertia", "carrier_acceleration"):
        first = getattr(parts[0][1], name)
        empty = first.shape[-1] == 0
        joined.append(np.empty((*first.shape[:-1], 0 if empty else len(carried))))
        for samples, part in () if empty else parts:
            joined[-1][..., samples] = getattr(part, name)
    bare = Loads(*joined)
    return replace(bare, torque=bare.torque - counterbalance_torques(study, cycle.position).T)


def rides(study: Study, joint: int, drive: int) -> bool:
    """Whether the body of a drive is carried by links that a joint moves."""
    assert study.arm is not None
    carrier, linkage = carrier_link(study.arm, drive, study.joints[drive].mount), study.arm.linkage
    return carrier >= joint if linkage is None else joint in linkage.loops.moving(carrier)


def loading_drives(study: Study, joint: int) -> tuple[int, ...]:
    """The drives that may load a joint, or its shaft if motors are coupled."""
    assert study.arm is not None
    names, linkage = study.joint_names, study.arm.linkage
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


def _empty_basis(study: Study, bare: Loads) -> tuple[list[JointBasis], UnitLoadRows, Any]:
    """The basis of all joints with loads per unit still zero, the arrays that hold the rows of all of them, and the
    drives that load each joint, records INFLUENCE.
    """
    arm = emptied(study)
    drives = [loading_drives(study, joint) for joint in range(arm.n)]
    count, samples, with_inertia = PARAMETERS * sum(map(len, drives)), bare.torque.shape[-1], bare.inertia.shape[-1]
    rows = UnitLoadRows(np.zeros((count, samples)), np.zeros((count, with_inertia)))
    joints: list[JointBasis] = []
    influences: list[tuple[int, int, int]] = []
    for joint, loading in enumerate(drives):
        own = Loads(bare.torque[joint], bare.wrench[joint], bare.inertia[joint], bare.carrier_acceleration[joint])
        on_bearing = not (arm.slides[joint] or study.joints[joint].coupled or np.isnan(own.wrench).any())
        width = with_inertia if on_bearing else 0
        part = slice(PARAMETERS * len(influences), PARAMETERS * (len(influences) + len(loading)))
        influences += [(joint, drive, part.start + PARAMETERS * i) for i, drive in enumerate(loading)]
        own = replace(own, wrench=own.wrench[:, :width])
        wrench = np.zeros((PARAMETERS * len(loading), 6, 0 if arm.linkage is None else width))
        own_rows = rows.torque[part], rows.inertia[part], wrench
        joints.append(JointBasis(own, arm.slides[joint], on_bearing, loading, *own_rows))
    return joints, rows, np.array(influences, INFLUENCE)


# The load per unit of each parameter, a row each, as a combination of the loads of six arms: without drives; with a
# rotor of inertia 1 and ratio 1, and ratio -1; with a body of mass 1 that is a point, that has inertia 1 across the
# axis, and that has inertia 1 about every axis.
_COMBINATIONS = np.array([
    [-1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, -1.0, 1.0],
    [-1.0, 0.5, 0.5, 0.0, 0.0, 0.0], [0.0, 0.5, -0.5, 0.0, 0.0, 0.0],
])  # fmt: skip


def _fill_by_differences(study: Study, cycle: Cycle, joints: Sequence[JointBasis], torques_only: bool) -> None:
    """Loads per unit as differences between arms with and without a unit drive: for loops and moving bases."""
    arm = emptied(study)
    for k, task in enumerate(study.joints):
        link, point, axis = (
            carrier_link(arm, k, task.mount), mount_point(arm, k, task.mount), arm.axes[seat(k, task.mount)],
        )  # fmt: skip
        rotors = [seated_rotor(arm, k, task.mount, ratio, 1.0) for ratio in (1.0, -1.0)]
        arms = [arm, *(with_rotors(arm, [own if i == k else None for i in range(arm.n)]) for own in rotors)]
        has_body = link >= 0 and study.drive_mass is not DriveMass.INCLUDED
        for inertia in (np.zeros((3, 3)), np.eye(3) - np.outer(axis, axis), np.eye(3)) if has_body else ():
            arms.append(with_body(arm, link, 1.0, point, inertia))
        loads = [_arm_loads(study, cycle, one, torques_only) for one in arms]
        for name in ("torque", "wrench", "inertia"):
            units = np.tensordot(_COMBINATIONS[:, : len(arms)], [getattr(one, name) for one in loads], 1)
            units[: 0 if has_body else 3] = 0.0
            for joint, basis in enumerate(joints):
                rows = getattr(basis, name)
                if k in basis.drives and rows.size:
                    rows[basis.rows(k)] = units[:, joint]


def mounted_drives(study: Study) -> MountedDrives:
    """Where the drives of a study are mounted."""
    arm, mounts = study.arm, [task.mount for task in study.joints]
    assert arm is not None
    axes = arm.axes
    return MountedDrives(
        np.array([carrier_link(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([mount_point(arm, k, mount) for k, mount in enumerate(mounts)]),
        np.array([axes[seat(k, mount)] for k, mount in enumerate(mounts)]),
        np.full(arm.n, study.drive_mass is not DriveMass.INCLUDED),
    )


def _fill_open_chain(study: Study, cycle: Cycle, rows: UnitLoadRows, influences: Any) -> None:
    """Loads per unit of an open chain, in one pass over the motion."""
    arm = emptied(study)
    turns = np.eye(arm.n) if arm.coupling is None else np.array(np.linalg.inv(arm.coupling).T)
    motion = joint_motion(study, cycle)
    shafts = [np.ascontiguousarray(shaft_motion(arm, row)) for row in motion[1:]]
    compute_unit_loads(
        np.array(arm.screws), np.array(arm.gravity), mounted_drives(study), turns, influences, *motion, *shafts, rows
    )
