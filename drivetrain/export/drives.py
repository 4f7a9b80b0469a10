"""An arm with its drives as other tools represent it: links with locked rotors, and parameters of each drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arrays import Array
from drivetrain.drive.amplifier import available_voltage
from drivetrain.drive.drive import drive_inertia, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import complete, drag_torque, mesh_of
from drivetrain.drive.motor import copper_coefficient, torque_constant, winding_resistance
from drivetrain.drive.thermal.thermal_network import thermal_network
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.export.losses import refuse_unsupported
from drivetrain.records import as_record
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.spatial.inertia import RigidBody, combined
from drivetrain.spatial.poses import inverse_pose, pose
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.mounting import loaded_arm, payload_index


@dataclass(frozen=True, eq=False)
class DriveData:
    """Parameters of one drive at its shaft: the joint, or for coupled motors the output of the gear."""

    joint: str  # its name
    ratio: float  # rotor angle over shaft angle [-], or over travel [rad/m]
    rotor_inertia: float  # of rotor and gear input [kg m^2]
    # torque constant [N m/A], resistance [ohm] and inductance [H] of the warm motor; an unknown inductance is 0
    constant: float
    resistance: float
    cold_resistance: float  # at the motor's reference temperature [ohm]
    inductance: float
    # limits of voltage [V] and current [A] at the terminals and of the motor's torque [N m]; the last two are infinite
    # if they are not stated
    volts: float
    current: float
    torque: float
    # limits at the shaft: effort [N m or N] by current, motor torque, the gear's repeated peak torque and its stages;
    # speed [rad/s or m/s] by voltage and the largest speeds of motor, gear and stages
    effort: float
    speed: float
    continuous: float  # continuous limit of effort [N m or N]; NaN if unknown
    # Coulomb friction [N m or N] and viscous friction [N m s/rad or N s/m] of joint and motor, including the gear's
    # drag at the mean speed of the cycle
    coulomb: float
    viscous: float
    # winding model: resistance to the housing [K/W], heat capacity [J/K], temperature coefficient of copper [1/K],
    # reference temperature of the electrical resistance [C], housing temperature [C]; None if unknown
    thermal: tuple[float, float, float, float, float] | None


def exported(evaluation: Evaluation, format_name: str, payload: str | None = None) -> tuple[Arm, list[DriveData]]:
    """The arm with its drives and a payload, rotors at the level ``reflected``, and the parameters of the drives."""
    study = evaluation.study
    if study.arm is None:
        raise InputError(Fault("arm", "is needed: a load table has nothing to export", hint="give the study an arm"))
    arm = loaded_arm(study, evaluation.mounted, payload_index(study, payload))
    refuse_unsupported(arm, format_name)
    data = [_drive(study, task, evaluation.joints[task.name]) for task in study.joints]
    return at_level(arm, RotorLevel.REFLECTED), data


@dataclass(frozen=True, eq=False)
class Body:
    """A body of an arm and the joint before it, in the frame of its link."""

    joint: str
    link: str
    before: int  # index of the parent body; -1 is the base
    slides: bool  # whether its joint is prismatic
    frame: Array  # pose of the link frame in the base frame with all joints at zero, origin on the joint's axis, (4, 4)
    axis: Array  # direction of its joint's axis in the link frame [-], (3,)
    lower: float
    upper: float
    locked: RigidBody  # the body including the rotors that it carries, which are locked
    drives: tuple[int, ...]  # indices of the drives of its joint: none, one, or two that share it


def arm_bodies(arm: Arm, format_name: str) -> list[Body]:
    """The bodies of an arm, followed by those of its linkages; helical joints, which no format has, are faults."""
    loops = None if arm.linkage is None else arm.linkage.loops
    chains = (arm,) if arm.linkage is None else arm.linkage.chains
    places = [(0, i) for i in range(arm.n)]
    if loops is not None:
        places = [(owner, loops.paths[owner].index(body)) for body, owner in enumerate(loops.owner)]
    driven = range(arm.n) if loops is None else loops.driven
    second = dict(loops.shared) if loops is not None else {}  # from the first to the second motor of an axis
    faults, found = Faults(), []
    for body, (owner, at) in enumerate(places):
        chain = chains[owner]
        home, name, pitch = chain.home[at], chain.joint_names[at], chain.pitches[at]
        if pitch:
            faults.add(f"joint {name}", f"is helical: {format_name} has no such joint", f"{pitch:.6g} m/rad")
        parts = [RigidBody(chain.masses[at], home[:3, 3], home[:3, :3] @ chain.inertias[at] @ home[:3, :3].T)]
        for rotor in arm.rotors:
            if rotor is not None and rotor.carrier == body:
                parts.append(rotor.body)
        frame = pose(home[:3, :3], chain.joint_points[at])
        own = [row for row, joint in enumerate(driven) if joint == body]
        drives = tuple(own + [second[row] for row in own if row in second])
        found.append(
            Body(name, chain.link_names[at] if owner == 0 else name, body - 1 if loops is None else loops.before(body),
                 chain.slides[at], frame, home[:3, :3].T @ chain.axes[at], chain.lower[at], chain.upper[at],
                 combined(parts).seen_from(inverse_pose(frame)), drives)
        )  # fmt: skip
    faults.raise_any()
    return found[: len(found) - len(second)]  # without the massless bodies of second motors, at the end


def pins(arm: Arm) -> list[tuple[int, int, Array]]:
    """Of each pin of a closed loop: its two bodies (if one is the base, -1, it is the second) and its point."""
    if arm.linkage is None:
        return []
    loops, found = arm.linkage.loops, []
    for first, second, point in loops.pins:
        ends = [loops.paths[chain][count - 1] if count else -1 for chain, count in (first, second)]
        found.append((max(ends), min(ends), point))
    return found


def in_frame(frame: Array, point: Array) -> Array:
    """A point of the base frame expressed in another frame, (3,)."""
    return np.asarray(frame[:3, :3].T @ (point - frame[:3, 3]))


def joint_limits(arm: Arm, drives: Sequence[DriveData]) -> tuple[Array, Array]:
    """Largest speed and effort of each joint, (n,) each; joints coupled with it are at rest and without load.

    The speed does not exceed the arm's own limit.
    """
    speed, effort = (np.array([getattr(drive, name) for drive in drives]) for name in ("speed", "effort"))
    if arm.coupling is not None:
        with np.errstate(divide="ignore"):
            turned, shared = np.abs(arm.coupling), np.abs(np.linalg.inv(arm.coupling).T)
            speed, effort = (speed[:, None] / turned).min(axis=0), (effort[:, None] / shared).min(axis=0)
    return np.minimum(speed, arm.speed_limits), effort


def coupling_rows(arm: Arm) -> list[Array | None]:
    """Speed of each motor's shaft per unit speed of every joint, (n,); None if the shaft is the joint."""
    if arm.coupling is None:
        return [None] * arm.n
    return [None if (row == np.eye(arm.n)[i]).all() else row for i, row in enumerate(arm.coupling)]


def _drive(study: Study, task: JointTask, joint: JointResult) -> DriveData:
    motor, gear, amplifier = joint.drive.motor, complete(joint.drive.gear), joint.amplifier
    warm = study.ambient if joint.housing_temperature is None else joint.housing_temperature
    travel, size, mesh = task.travel_per_turn or 1.0, abs(gear.ratio), mesh_of(as_record(gear))
    constant, resistance = float(torque_constant(motor, warm)), float(winding_resistance(motor, warm))
    volts = available_voltage(amplifier, study.supply.voltage)
    current = min((one for one in (amplifier.peak_current, motor.peak_current) if one is not None), default=math.inf)
    most = math.inf if motor.peak_torque is None else motor.peak_torque
    torque = min(constant * current, most)
    peak = min(gear.repeated_peak_torque or gear.continuous_torque or math.inf, gear.stage_torque or math.inf)
    fastest = min(volts / constant, motor.max_speed or math.inf, gear.max_input_speed or math.inf)
    rms = next((one.available for one in joint.checks if one.name == "motor RMS current"), None)
    turning = size * float(np.abs(joint.series.speed).mean())
    drag = abs(float(drag_torque(mesh, turning, float(study.drag_temperature(study.ambient)))))
    shaft, outside = shaft_friction(joint.drive), joint.drive.joint_friction
    network = thermal_network(motor, study.ambient, housing_to_ambient=task.housing_to_ambient)
    thermal = None
    if network is not None and network.winding_capacity is not None and network.resistance_winding_housing > 0.0:
        thermal = (
            network.resistance_winding_housing, network.winding_capacity,
            float(copper_coefficient(motor.reference_temperature)), motor.reference_temperature, warm,
        )  # fmt: skip
    return DriveData(
        task.name, gear.ratio / travel, drive_inertia(joint.drive), constant,
        resistance, motor.resistance, motor.inductance or 0.0, volts, current, most,
        effort=min(torque * size / max(mesh.driving, 1.0), peak) / travel,
        speed=min(fastest / size, gear.stage_speed or math.inf) * travel,
        continuous=math.nan if rms is None else rms * constant * size / travel,
        coulomb=(_coulomb(outside) + size * (_coulomb(shaft) + drag)) / travel,
        viscous=(_viscous(outside) + size**2 * _viscous(shaft)) / travel**2, thermal=thermal,
    )  # fmt: skip


def _coulomb(law: Friction) -> float:
    """Mean Coulomb friction of both directions."""
    return 0.5 * (law.coulomb + (law.coulomb if law.coulomb_negative is None else law.coulomb_negative))


def _viscous(law: Friction) -> float:
    return 0.5 * (law.viscous + (law.viscous if law.viscous_negative is None else law.viscous_negative))
