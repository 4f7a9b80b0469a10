"""The arm with a set of drives: their masses on the links that carry them, and their rotors behind the gears."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import with_body, with_payload
from drivetrain.arm.closures import second_motor, with_second_motors
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.arrays import Array
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.drive import Drive, drive_inertia, times_as_large
from drivetrain.drive.motor import whole_mass
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.spatial.poses import axis_screw
from drivetrain.study.model import DriveMass, JointTask, Mount, Study

DRIVE_DENSITY = 5200.0  # kg/m^3; median of the rows that print diameter, length and mass: 5180 motors, 5370 gears


def loaded_arm(study: Study, drives: Mapping[str, Drive], payload_index: int) -> Arm:
    """The arm with drives in its joints and a payload at its tip.

    With ``drive_mass: replaced``, the mass of the contained drive is first removed at every joint, as a point mass (its
    own inertia is unknown and remains: a small excess on the safe side). ``added`` and ``replaced`` add each drive as
    solid cylinders; ``included`` changes no mass. The rotor behind its gear is added in all three cases.
    """
    arm = emptied(study)
    rotors: list[Rotor | None] = [None] * arm.n
    for joint, task in enumerate(study.joints):
        if task.name in drives:
            drive, link = drives[task.name], carrier_link(arm, joint, task.mount)
            rotors[joint] = seated_rotor(arm, joint, task.mount, rotor_ratio(drive, task), drive_inertia(drive))
            mass, across, along = drive_body(drive)
            if study.drive_mass is not DriveMass.INCLUDED and mass > 0.0:
                axis = arm.axes[seat(joint, task.mount)]
                inertia = across * np.eye(3) + (along - across) * np.outer(axis, axis)
                arm = with_body(arm, link, mass, mount_point(arm, joint, task.mount), inertia)
    return carrying(study, with_rotors(arm, rotors), payload_index)


def payload_index(study: Study, name: str | None) -> int:
    """Index of a payload of the study by its name; -1 for none (None). InputError if the study has none of the name."""
    names = [one.name for one in study.payloads]
    if name is not None and name not in names:
        raise InputError(Fault("payload", "is none of the study's", name, nearest(name, names)))
    return -1 if name is None else names.index(name)


@lru_cache(maxsize=8)
def carrying(study: Study, arm: Arm, payload_index: int) -> Arm:
    """An arm with one of the study's payloads at its tip (index -1: none).

    The result is cached, so that the arrays that kernels need are computed once per arm.
    """
    if payload_index < 0 or study.payloads[payload_index].mass == 0.0:
        return arm
    payload = study.payloads[payload_index]
    return with_payload(arm, payload.mass, payload.com, payload.inertia)


def drive_mass(drive: Drive) -> float | None:
    """Mass of motor and gear together [kg]; an ideal gear weighs nothing; None when one of them is unknown."""
    gear = 0.0 if drive.gear.kind == "ideal" and drive.gear.mass is None else drive.gear.mass
    motor = whole_mass(drive.motor)
    return None if motor is None or gear is None else motor + gear


def mass_counts(study: Study, joint: int) -> bool:
    """Whether the mass of a joint's drive loads the arm."""
    if study.arm is None or study.drive_mass not in (DriveMass.ADDED, DriveMass.REPLACED):
        return False
    return carrier_link(study.arm, joint, study.joints[joint].mount) >= 0


def drive_body(drive: Drive) -> tuple[float, float, float]:
    """Motor and gear as solid cylinders: mass [kg], inertia about the centre across and along the axis [kg m^2].

    The rotor is a separate body, so its inertia about the axis is left out. Dimensions that a data sheet does not give
    follow from DRIVE_DENSITY; if diameter and length are unknown, they are taken as equal.
    """
    motor, gear = drive.motor, drive.gear
    cylinders = [cylinder_inertia(part.mass, part.diameter, part.length) for part in (motor, gear)]
    across, along = (sum(values) for values in zip(*cylinders, strict=True))
    mass = (motor.mass or 0.0) + (gear.mass or 0.0)
    return mass, across, along - min(motor.rotor_inertia or 0.0, along)


def rotor_ratio(drive: Drive, task: JointTask) -> float:
    """Rotor angle over the joint's coordinate [-], or [rad/m] where the joint slides."""
    return drive.gear.ratio / (task.travel_per_turn or 1.0)


def carrier_link(arm: Arm, joint: int, mount: Mount) -> int:
    """Index of the link that holds the stator."""
    at = seat(joint, mount)
    if mount.carrier == "base":
        return -1
    return arm.body_before(at) if mount.carrier == "parent" else arm.body_after(at)


def seat(joint: int, mount: Mount) -> int:
    """Index of the joint at which a drive is mounted."""
    return joint if mount.joint is None else mount.joint


def seated_rotor(arm: Arm, joint: int, mount: Mount, ratio: float, inertia: float) -> Rotor:
    """A rotor at the place of its drive, along the axis of the joint there; ratio [- or rad/m], inertia [kg m^2]."""
    line = axis_screw(arm.axes[seat(joint, mount)], arm.joint_points[seat(joint, mount)])
    return Rotor(ratio, inertia, screw=line, carrier=carrier_link(arm, joint, mount))


@lru_cache(maxsize=4)
def emptied(study: Study) -> Arm:
    """The study's arm without rotors and, with ``drive_mass: replaced``, without its contained drives; cached.

    Rotors that an arm states belong to its own drives; the drives of the study have their own. All joints whose links
    are lighter than the contained drive are faults.
    """
    arm = study.arm
    if arm is None:
        raise InputError(Fault("arm", "is needed to load it with drives", hint="a load table already holds its torque"))
    arm = with_rotors(arm, [None] * arm.n)
    faults: list[Fault] = []
    if study.drive_mass is DriveMass.REPLACED:
        for joint, task in enumerate(study.joints):
            try:
                arm = _without(arm, joint, task)
            except InputError as error:
                place = f"joints.{task.name}.contained"
                faults += [replace(fault, place=f"{place}: {fault.place}") for fault in error.faults]
    raise_faults(faults)
    return arm


def _without(arm: Arm, joint: int, task: JointTask) -> Arm:
    """The arm without the contained drive of one joint, removed as a point mass."""
    held = task.contained
    if held is None or held.mass == 0.0:
        return arm
    point = mount_point(arm, joint, held.mount)
    return with_body(arm, carrier_link(arm, joint, held.mount), -held.mass, point, np.zeros((3, 3)))


def mount_point(arm: Arm, joint: int, mount: Mount) -> Array:
    """Centre of mass of a drive in the base frame with all joints at zero [m], (3,)."""
    at = seat(joint, mount)
    point: Array = arm.joint_points[at] + mount.offset * arm.axes[at]
    return point


def with_counterbalances(arm: Arm, joints: Sequence[JointTask]) -> Arm:
    """The arm with the masses of the joints' counterbalances, as points."""
    for joint, task in enumerate(joints):
        for one in task.counterbalances:
            if one.mass:
                point = arm.joint_points[joint] + one.com
                arm = with_body(arm, joint if one.moves else joint - 1, one.mass, point, np.zeros((3, 3)))
    return arm


def cylinder_inertia(mass: float | None, diameter: float | None, length: float | None) -> tuple[float, float]:
    """Inertia of a motor or gear as a solid cylinder about its centre, across and along its axis [kg m^2].

    Unknown dimensions follow from ``cylinder_size``; an unknown mass counts as zero.
    """
    if not mass:
        return 0.0, 0.0
    diameter, length = cylinder_size(mass, diameter, length)
    # Modern Robotics, figure 8.5; plain floats for speed, because a search calls it for every candidate
    return mass * (0.75 * diameter**2 + length**2) / 12.0, mass * diameter**2 / 8.0


def cylinder_size(mass: float, diameter: float | None, length: float | None) -> tuple[float, float]:
    """Diameter and length of a motor or gear as a solid cylinder of DRIVE_DENSITY [m]; known values are kept."""
    area = 4.0 * mass / (DRIVE_DENSITY * math.pi)  # diameter squared times length
    if diameter is None:
        diameter = area ** (1.0 / 3.0) if length is None else math.sqrt(area / length)
    return diameter, area / diameter**2 if length is None else length


# Two motors on one axis: each carries half of the load, plus or minus a preload.
#
# The two gears are braced against each other by the preload, so that neither changes its tooth flank while the load of
# the axis is less than twice the preload. For all checks of drives, the second motor is a joint of its own with the
# same motion.


def with_sharing(
    arm: Arm | None, cycle: Cycle, joints: Sequence[JointTask]
) -> tuple[Arm | None, Cycle, tuple[JointTask, ...]]:
    """Arm, cycle and joints with each second motor as a joint after the first one; unchanged if there is none."""
    pairs = [i for i, task in enumerate(joints) if task.preload is not None]
    if not pairs:
        return arm, cycle, tuple(joints)
    names = [task.name for task in joints]
    taken = {second_motor(names[i]) for i in pairs} & {*names}
    if taken:
        raise InputError([Fault("joints", "has the name that the second motor of an axis gets", one) for one in taken])
    found = [one for task in joints for one in ([task] if task.preload is None else _both(task, task.preload))]
    rows = np.repeat(np.arange(len(joints)), [1 if task.preload is None else 2 for task in joints])
    shares = np.array([1.0 if task.preload is None else 0.5 for task in found])
    cycle = _of_rows(cycle, rows, shares, found)
    return None if arm is None else with_second_motors(arm, pairs), cycle, tuple(found)


def _of_rows(cycle: Cycle, rows: Any, shares: Array, joints: Sequence[JointTask]) -> Cycle:
    """A cycle whose joints are columns of another one, with the torques of a load table multiplied by ``shares``."""
    series = {name: getattr(cycle, name)[:, rows] for name in ("position", "velocity", "acceleration")}
    torque = None if cycle.torque is None else cycle.torque[:, rows] * shares
    return replace(cycle, joint_names=tuple(task.name for task in joints), torque=torque, **series)


def _both(task: JointTask, preload: float) -> tuple[JointTask, JointTask]:
    """The tasks of the first and the second motor of an axis; the preload [N m] is positive for the first."""
    sharing, inertia = (task.name, second_motor(task.name)), task.load_inertia
    half = replace(
        task, friction=times_as_large(task.friction, 0.5), load_inertia=None if inertia is None else 0.5 * inertia,
        sharing=sharing, counterbalances=(),
    )  # fmt: skip
    own = tuple(replace(_balance(one, 0.5), mass=0.0) for one in task.counterbalances)
    own = tuple(one for one in own if one.stiffness or one.gas_force or one.torque or one.torques)
    halves = []
    for name, push in zip(sharing, (preload, -preload), strict=True):
        halves.append(replace(half, name=name, preload=push, counterbalances=own + _pushed(half, push)))
    return halves[0], replace(halves[1], contained=None)  # the contained drive is removed once


def _pushed(task: JointTask, push: float) -> tuple[Counterbalance, ...]:
    """The preload of one of two motors as a constant torque of a counterbalance, in the joint's coordinate."""
    return (Counterbalance(torque=-push / (task.travel_per_turn or 1.0)),) if push else ()


def _balance(one: Counterbalance, times: float) -> Counterbalance:
    return replace(times_as_large(one, times), torques=tuple(times * torque for torque in one.torques))


TWO_AS_ONE = "two motors are computed as one of twice the size; currents and torques are the sum of both"


def two_as_one(study: Study, drives: Mapping[str, Drive]) -> tuple[Study, dict[str, Drive]]:
    """A study and its drives with the two motors of each axis replaced by one of twice the size.

    This is exact if both are equal and take half of the load each: their currents add, at the voltage of one. Motors
    that differ or have a preload are faults.
    """
    pairs = motor_pairs(study)
    if not pairs:
        return study, dict(drives)
    raise_faults(replace(fault, file=study.path) for fault in _apart(study, drives))
    names = {first for first, _ in pairs}
    study = as_single(study)
    return study, {
        task.name: _twice(drives[task.name]) if task.name in names else drives[task.name]
        for task in study.joints if task.name in drives
    }  # fmt: skip


def run_apart(study: Study, drives: Mapping[str, Drive]) -> bool:
    """Whether two motors of an axis have a preload or differ, so that one of twice the size cannot replace them."""
    return bool(_apart(study, drives))


def motor_pairs(study: Study) -> list[tuple[str, str]]:
    """Names of the first and the second motor of each axis that has two."""
    return [(task.sharing[0], task.sharing[1]) for task in study.joints if task.sharing[:1] == (task.name,)]


def _apart(study: Study, drives: Mapping[str, Drive]) -> list[Fault]:
    tasks = {task.name: task for task in study.joints}
    return [
        Fault(f"joints.{name}.preload", "two motors with a preload against each other are not computed here",
              tasks[name].preload, "without a preload they are computed as one of twice the size; simulate covers both")
        for name, _ in motor_pairs(study) if tasks[name].preload
    ] + [
        Fault(f"joints.{name}", "has two motors that are not equal, which is not computed here")
        for name, second in motor_pairs(study) if name in drives and drives[name] != drives.get(second, drives[name])
    ]  # fmt: skip


def as_single(study: Study) -> Study:
    """A study in which each axis with two motors has a single task, with the sum of both motors and no preload."""
    if not motor_pairs(study):
        return study
    rows = [i for i, task in enumerate(study.joints) if task.axis_name == task.name]
    cycle, joints = study.cycle, tuple(_whole(study.joints[i]) for i in rows)
    times = np.array([2.0 if study.joints[i].sharing else 1.0 for i in rows])
    cycle = _of_rows(cycle, rows, times, joints)
    arm = None if study.arm is None or study.arm.linkage is None else study.arm.linkage.chains[0]
    return replace(study, arm=arm, cycle=cycle, joints=joints)


def _whole(task: JointTask) -> JointTask:
    """The task of both motors of an axis as a single one; other tasks are returned unchanged."""
    if not task.sharing:
        return task
    inertia, way, pushed = task.load_inertia, task.housing_to_ambient, _pushed(task, task.preload or 0.0)
    return replace(
        task, sharing=(), preload=None, friction=times_as_large(task.friction, 2.0),
        motor_friction=None if task.motor_friction is None else times_as_large(task.motor_friction, 2.0),
        load_inertia=None if inertia is None else 2.0 * inertia, housing_to_ambient=None if way is None else 0.5 * way,
        amplifier=times_as_large(task.amplifier, 2.0), stop=times_as_large(task.stop, 2.0),
        amplifiers=tuple(times_as_large(one, 2.0) for one in task.amplifiers),
        brakes=tuple(times_as_large(one, 2.0) for one in task.brakes),
        counterbalances=tuple(_balance(one, 2.0) for one in task.counterbalances if one not in pushed),
    )  # fmt: skip


def _twice(drive: Drive) -> Drive:
    """Two equal drives as one of twice the size; motors and gears keep their length and diameter."""
    parts: dict[str, Any] = {}
    for name in ("motor", "gear", "joint_friction", "motor_friction"):
        part = getattr(drive, name)
        if name in ("motor", "gear") and part.mass:
            diameter, length = cylinder_size(part.mass, part.diameter, part.length)
            part = replace(part, diameter=diameter, length=length)
        parts[name] = None if part is None else times_as_large(part, 2.0)
    parts["motor"] = replace(parts["motor"], brake=times_as_large(drive.motor.brake, 2.0))
    return replace(drive, **parts, assumptions=(*drive.assumptions, TWO_AS_ONE))
