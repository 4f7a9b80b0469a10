"""Deflection of the tip by flexible drives and links over the motion: wind-up, bending, lost motion, vibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_lighter_rotors
from drivetrain.arm.kinematics import link_poses, tip_pose
from drivetrain.arrays import Array
from drivetrain.drive.gear import sprung_stages
from drivetrain.drive.spring import tangent_stiffness
from drivetrain.dynamics.flexibility import (
    NO_BEAMS,
    carried_to,
    check_beams,
    free_frequencies,
    locked_frequencies,
)
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.errors import Fault, InputError
from drivetrain.sizing.as_one import judged_as_one
from drivetrain.sizing.judge.missing import lacking_joints
from drivetrain.sizing.judge.stiffness import (
    carried_stages,
    joint_plays,
    joint_twists,
    loaded_arms,
    lost_motion,
    tip_levers,
)
from drivetrain.sizing.results import Evaluation
from drivetrain.spatial.beams import Beam, end_deflection
from drivetrain.spatial.poses import inverse_pose
from drivetrain.spatial.rotations import frame_along
from drivetrain.study.model import refuse_moving_base
from drivetrain.study.parts.mounting import loaded_arm


@dataclass(frozen=True, eq=False)
class TipDeflection:
    """Deviation of the tip from its position with rigid drives and links; base axes.

    Torques are those of the planned motion: the deflection is quasi-static.

    Attributes:
        time: Time [s], (N,).
        joint_names, link_names: Names of joints and links, (n,) each.
        twist: Wind-up of each gear without backlash [rad or m], (N, n); of the shafts if motors are coupled to
            several joints.
        joints: Displacement of the tip by each wind-up [m], (N, n, 3).
        links: Displacement of the tip by the bending of each link [m], (N, n, 3).
        backlash: Displacement of the tip by each joint's backlash, from its middle to the side on which the torque
            holds it [m], (N, n, 3).
        lost_motion: Largest distance between two tip positions within the backlash of all joints [m], (N,).
        rigid: Joints assumed rigid, as the stiffness of their gear is unknown.
        unknown_play: Joints whose backlash is unknown and assumed to be 0.
    """

    time: Array
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    twist: Array
    joints: Array
    links: Array
    backlash: Array
    lost_motion: Array
    rigid: tuple[str, ...]
    unknown_play: tuple[str, ...]

    @property
    def displacement(self) -> Array:
        """Total displacement of the tip [m], (N, 3)."""
        return np.asarray((self.joints + self.links + self.backlash).sum(axis=1))

    @property
    def size(self) -> Array:
        """Magnitude of the displacement [m], (N,)."""
        return np.asarray(np.linalg.norm(self.displacement, axis=1))

    @property
    def worst_case(self) -> Array:
        """Sum of the magnitudes of all contributions: the displacement if they had the same direction [m], (N,)."""
        parts = np.concatenate([self.joints, self.links, self.backlash], axis=1)
        return np.asarray(np.linalg.norm(parts, axis=2).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Vibration:
    """Natural frequencies over the motion, with the spring stiffness at the torque of each instant.

    Attributes:
        time: Time [s], (N,).
        stiffness: Stiffness of the joints at their torque [N m/rad or N/m], (N, n); infinite where rigid.
        locked: Frequencies with all rotors held by their motors, lowest first [Hz], (N, m) for m sprung joints.
        free: Frequencies with constant motor torques, links oscillating against rotors, lowest first [Hz], (N, m).
        rigid: Joints assumed rigid, as their gear's data sheet gives no stiffness.
    """

    time: Array
    stiffness: Array
    locked: Array
    free: Array
    rigid: tuple[str, ...]


def tip_deflection(evaluation: Evaluation, *, beams: Mapping[int, Beam] = NO_BEAMS) -> TipDeflection:
    """The tip's deflection over the motion under weight, payload, inertia and forces: gears, links and backlash.

    Args:
        evaluation: Evaluation of the drives; its study must have an arm.
        beams: The flexible part of a link, by link index, in the base frame with every joint at zero [m, N m^2]; other
            links count as rigid.

    Returns:
        The deflection, small enough to be linear.

    Raises:
        InputError: The study has no arm, or the arm does not have the link of a beam.

    Reference:
        Modern Robotics, section 8.9.5. A spring under the torque T that its joint gives lags by phi(T), so the joint
        stands at the motor's angle over the ratio less phi(T); friction at the joint's own bearings loads the spring.
    """
    study = evaluation.study
    arm = _arm(evaluation)
    check_beams(arm, beams)
    if beams:
        refuse_moving_base(study, "the bending of links")
    cycle = study.cycle
    results = tuple(evaluation.joints.values())
    torque = np.column_stack([joint.series.gear_torque for joint in results])
    twist, play = joint_twists(study, evaluation.mounted, torque), joint_plays(study, evaluation.mounted, torque)
    jacobian = tip_levers(study)
    return TipDeflection(
        time=cycle.time,
        joint_names=arm.joint_names,
        link_names=arm.link_names,
        twist=twist,
        joints=-twist[:, :, None] * jacobian,
        links=_link_deflection(evaluation, beams),
        backlash=-0.5 * (play * np.sign(torque))[:, :, None] * jacobian,
        lost_motion=lost_motion(play[:, :, None] * jacobian),
        rigid=lacking_joints(evaluation.mounted, "stiffness_1"),
        unknown_play=lacking_joints(evaluation.mounted, "backlash"),
    )


def vibration(evaluation: Evaluation) -> Vibration:
    """The natural frequencies of the arm on its joint springs over the motion.

    Args:
        evaluation: Evaluation of the drives; its study must have an arm.

    Returns:
        The frequencies; for joints with backlash those with their teeth in contact. Two motors of an axis count as one
        of twice the size, so their oscillation against each other is not included.

    Raises:
        InputError: The study has no arm; the arm has closed loops or a preload between two motors; or the rotor inertia
        of a sprung joint is unknown.
    """
    _arm(evaluation)
    evaluation = judged_as_one(evaluation)
    cycle = evaluation.study.cycle
    stiffness = joint_stiffness(evaluation)
    sprung = int(np.isfinite(stiffness).all(axis=0).sum())
    locked, free = np.empty((2, len(cycle.time), sprung))
    drives = evaluation.mounted
    staged = carried_stages(evaluation.study, drives)
    # the rotors of a loaded arm have all stages on the motor's side of the spring
    moved = np.array([sprung_stages(one.gear) / one.gear.ratio**2 for one in drives.values()])
    for arm, chosen in loaded_arms(evaluation.study, drives):
        q, springs = cycle.position[chosen], stiffness[chosen]
        locked[chosen] = locked_frequencies(arm, q, springs, added=staged)
        free[chosen] = free_frequencies(with_lighter_rotors(arm, moved), q, springs, added=staged)
    return Vibration(cycle.time, stiffness, locked, free, lacking_joints(evaluation.mounted, "stiffness_1"))


def joint_stiffness(evaluation: Evaluation) -> Array:
    """Stiffness of every joint at its torque at each instant [N m/rad or N/m], (N, n)."""
    columns = []
    for joint, task in zip(evaluation.joints.values(), evaluation.study.joints, strict=True):
        slope = tangent_stiffness(joint.drive.gear, joint.series.gear_torque)
        unknown = np.full(len(joint.series.time), np.inf)
        columns.append(unknown if slope is None else slope / (task.travel_per_turn or 1.0) ** 2)
    return np.column_stack(columns)


def _arm(evaluation: Evaluation) -> Arm:
    arm = evaluation.study.arm
    if arm is None:
        hint = "a load table gives torque and speed, not where a tip is"
        raise InputError(Fault("arm", "is needed to compute how its tip deflects", hint=hint))
    return arm


def _link_deflection(evaluation: Evaluation, beams: Mapping[int, Beam]) -> Array:
    """Displacement of the tip by the bending of each link, (N, n, 3) [m]."""
    cycle = evaluation.study.cycle
    found = np.zeros((*cycle.position.shape, 3))
    if not beams:
        return found
    empty = loaded_arm(evaluation.study, evaluation.mounted, -1)
    for arm, chosen in loaded_arms(evaluation.study, evaluation.mounted):
        motion = (cycle.position[chosen], cycle.velocity[chosen], cycle.acceleration[chosen])
        passed = _base_wrenches(arm, motion, None if cycle.tip_wrench is None else cycle.tip_wrench[chosen])
        # The load of the tip leaves the last link at its end and is not part of the link's own load.
        leaving = np.concatenate([passed[:, 1:], (passed - _base_wrenches(empty, motion))[:, -1:]], axis=1)
        moved = link_poses(arm, motion[0]) @ np.array([inverse_pose(home) for home in arm.home])
        tips = tip_pose(arm, motion[0])[:, :3, 3]
        for link, beam in beams.items():
            found[chosen, link] = _bending(beam, moved[:, link], passed[:, link], leaving[:, link], tips)
    return found


def _base_wrenches(arm: Arm, motion: tuple[Array, Array, Array], tip_wrench: Array | None = None) -> Array:
    """Wrench of each joint on the link after it, about the base's origin, base axes, (N, n, 6) [N m, N]."""
    wrench = joint_loads(arm, *motion, tip_wrench=tip_wrench).wrench
    moved = link_poses(arm, motion[0]) @ np.array([inverse_pose(home) for home in arm.home])
    axes = np.array([frame_along(s[:3] if s[:3].any() else s[3:]) for s in arm.screws])
    rotation = moved[..., :3, :3] @ axes
    points = (moved[..., :3, :3] @ arm.joint_points[:, :, None])[..., 0] + moved[..., :3, 3]
    moment, force = ((rotation @ part[..., None])[..., 0] for part in (wrench[..., :3], wrench[..., 3:]))
    return np.concatenate([moment + np.cross(points, force), force], axis=-1)


def _bending(beam: Beam, moved: Array, passed: Array, leaving: Array, tips: Array) -> Array:
    """Tip displacement by the bending of one beam, from wrenches about the base's origin in base axes, (N, 3) [m]."""
    rotation = moved[:, :3, :3] @ beam.axes
    ends = [moved[:, :3, :3] @ point + moved[:, :3, 3] for point in (beam.start, beam.end)]
    local = []
    for wrench, point in zip((passed, leaving), ends, strict=True):
        moment, force = wrench[:, :3] - np.cross(point, wrench[:, 3:]), wrench[:, 3:]
        local.append(np.concatenate([np.einsum("nji,nj->ni", rotation, part) for part in (moment, force)], axis=1))
    motion = end_deflection(beam.section, beam.length, *local)
    turn, shift = (np.einsum("nij,nj->ni", rotation, part) for part in (motion[:, :3], motion[:, 3:]))
    carried = carried_to(tips - ends[1]) @ np.concatenate([turn, shift], axis=1)[:, :, None]
    return np.asarray(carried[:, 3:, 0])
