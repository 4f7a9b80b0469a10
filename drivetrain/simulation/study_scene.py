"""Scenes of studies: the arm with its drives, friction and losses, position loops, command and heating."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.closures import with_second_motors
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import Rotor
from drivetrain.arrays import Array
from drivetrain.drive.amplifier import available_voltage
from drivetrain.drive.drive import Drive, drive_inertia, shaft_friction, times_as_large, with_scaled
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear, complete, mesh, unknown_loss
from drivetrain.drive.motor import torque_constant
from drivetrain.drive.thermal.thermal_network import thermal_network
from drivetrain.dynamics.closed import main_chain
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.effect import Effect
from drivetrain.effects.fields import Side
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.payload_change import EMPTY, Body, PayloadChange
from drivetrain.effects.loads.tip_force import TipForce
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import Fault, Faults, InputError, raise_faults
from drivetrain.motion.duty_cycle import GAP_ALLOWED, Cycle
from drivetrain.motion.motion import Motion
from drivetrain.records import as_record, known
from drivetrain.simulation.engines.inverse import demanded
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import WHOLE, Inertia, Scene, without
from drivetrain.spatial.wrenches import turned
from drivetrain.study.model import JointTask, Study, refuse_moving_base
from drivetrain.study.parts.mounting import TWO_AS_ONE, as_single, loaded_arm, motor_pairs, run_apart, two_as_one


def refuse_unsimulated(study: Study, drives: Mapping[str, Drive] | None = None) -> None:
    """Raise InputError for what no engine supports, such as a moving base or two separate motors of a slide."""
    refuse_moving_base(study, "a simulation")
    if run_apart(study, drives or {}):
        hint = "without a preload and with equal drives they are simulated as one of twice the size"
        raise_faults(
            Fault(f"joints.{one.name}", "two motors of a joint that slides are not simulated apart", None, hint,
                  study.path)
            for one in study.joints if one.sharing[:1] == (one.name,) and one.travel_per_turn is not None
        )  # fmt: skip
    study = as_single(study)
    if study.arm is not None:
        return
    faults = Faults(study.path or "")
    if len(study.joints) > 1:
        hint = "axes that no arm couples can be studied one at a time"
        faults.add("joints", "without an arm one joint can be simulated", len(study.joints), hint)
    for task in study.joints:
        if task.load_inertia is None:
            hint = "such as 15 kg m^2: what the gear turns, whose acceleration is already in the table's torque"
            faults.add(f"joints.{task.name}.load_inertia", "is needed to simulate a load table", hint=hint)
    faults.raise_any()


def axis_motion(study: Study, repetitions: int) -> tuple[Motion, GivenTorque]:
    """Command and load torque of one axis that is given by a load table; InputError for a cycle without torques.

    The table gives the torque that the drive must provide, T = J a + load, so the torque on the link from outside is J
    a - T. A cycle that does not end at its start (a conveyor) is continued from its end.
    """
    cycle, task = study.cycle, study.joints[0]
    if cycle.torque is None:
        raise InputError(Fault("cycle", "holds no torques: it is no load table"))
    travel = cycle.position[-1] - cycle.position[0]
    starts = cycle.duration * np.arange(repetitions)
    # Rounding could make times decrease.
    time = np.maximum.accumulate(np.concatenate([start + cycle.time for start in starts]))
    position = np.concatenate([cycle.position + k * travel for k in range(repetitions)])
    velocity, acceleration = (np.tile(values, (repetitions, 1)) for values in (cycle.velocity, cycle.acceleration))
    load = (task.load_inertia or 0.0) * cycle.acceleration[:, 0] - cycle.torque[:, 0]
    motion = Motion(study.name, cycle.joint_names, time, position, velocity, acceleration, cycle.notes)
    return motion, GivenTorque(time, np.tile(load, repetitions))


@dataclass(frozen=True)
class SceneOptions:
    """Options for the scene of a study.

    Attributes:
        bandwidth: Natural frequency of the critically damped position loops [rad/s].
        feed_forward: Whether the currents that the command requires are fed forward.
        friction, mesh, heat, springs: Whether the scene contains these effects.
        damping: Damping ratio of the springs [-].
        repetitions: How often the cycle is run [-].
    """

    bandwidth: float = 40.0
    feed_forward: bool = True
    friction: bool = True
    mesh: bool = True
    heat: bool = True
    springs: bool = False
    damping: float = 0.02
    repetitions: int = 1


DEFAULT_OPTIONS = SceneOptions()


def scene_of(study: Study, drives: Mapping[str, Drive], *, options: SceneOptions = DEFAULT_OPTIONS) -> Scene:
    """The scene in which a study's arm runs its cycle with a set of drives.

    Args:
        study: Arm, cycle, amplifiers, supply and ambient temperature.
        drives: By joint name, one each, unknowns filled as ``Evaluation`` does. Two motors of an axis, equal and
            without a preload, run as one of twice the size; others each behind the spring and the play of its gear.
        options: Which effects, and how the loops are closed.

    Returns:
        The scene.

    Raises:
        InputError: Neither an arm nor one axis with a stated load inertia, a joint without a drive or with several
            amplifiers to choose from, two motors apart whose gears have no stiffness.
    """
    refuse_unsimulated(study, drives)
    study, drives = _with_separate_motors(study, drives) if run_apart(study, drives) else two_as_one(study, drives)
    faults = [Fault(f"joints.{task.name}", "has no drive") for task in study.joints if task.name not in drives]
    faults += _mix_faults(study.cycle)
    hint = "evaluate and select choose: take the study of what they find"
    for task in study.joints:
        if task.amplifiers:
            some = ", ".join(one.key for one in task.amplifiers)
            faults.append(Fault(f"joints.{task.name}.amplifier", "is still to be chosen", some, hint))
    raise_faults(faults)
    start, pairs = study.cycle.position[0], motor_pairs(study)
    body: Arm | Inertia
    if study.arm is None and pairs:
        body = _axis_arm(study, drives)
        moved = _moved_inertias(body, start)
    elif study.arm is None:
        task, drive = study.joints[0], drives[study.joints[0].name]
        body = Inertia(float(task.load_inertia or 0.0), name=task.name)
        # Reflected to the gear's output; without an arm the stator does not move.
        rotor = ReflectedRotor(drive_inertia(drive), drive.gear.ratio)
        moved = [body.inertia + rotor.ratio**2 * rotor.inertia]
    else:
        body = loaded_arm(study, drives, -1)
        moved = _moved_inertias(body, start)
    effects: dict[str, tuple[Effect, ...]] = {
        task.name: _joint(study, task, drives[task.name], moved[i], options) for i, task in enumerate(study.joints)
    }
    if study.arm is None:
        name, motion = study.joints[0].name, axis_motion(study, options.repetitions)[0]
        load = axis_motion(as_single(study), options.repetitions)[1]
        effects |= {name: (*effects[name], load), WHOLE: (CommandedMotion(motion),)}
    else:
        carried = (*_payloads(study, options.repetitions), *_tip_forces(study, body, options.repetitions))
        effects[WHOLE] = (CommandedMotion(study.cycle, options.repetitions), *carried)
    if isinstance(body, Inertia):
        effects[body.name] = (*effects[body.name], rotor)
    for added in study.simulation.add:
        where = added.joint or WHOLE
        effects[where] = (*effects[where], added.built(drives.get(where)))
    duration = study.cycle.duration * options.repetitions
    scene = Scene(
        body, effects, duration, start, study.cycle.velocity[0], study.name, _plan_notes(study, drives, options)
    )
    return with_feed_forward(scene) if options.feed_forward else scene


def _with_separate_motors(study: Study, drives: Mapping[str, Drive]) -> tuple[Study, dict[str, Drive]]:
    """The study and its drives for axes with two separate motors; InputError for a gear without stiffness between them.

    What acts at the joint of such an axis (friction, counterbalances) is assigned to its first motor.
    """
    whole, found, tasks = {task.name: task for task in as_single(study).joints}, dict(drives), list[JointTask]()
    hint = "its data sheet's torsional stiffness, such as 20 kN m/rad; backlash beside it, where there is any"
    raise_faults(
        Fault(f"gear {found[name].gear.key}.stiffness_1", f"is unknown: it parts the motors of {pair[0]}", None, hint)
        for pair in motor_pairs(study)
        for name in pair
        if name in found and found[name].gear.stiffness_1 is None
    )
    for task in study.joints:
        if task.sharing and task.name in found:
            own, first = found[task.name].joint_friction, task.name == task.axis_name
            law = times_as_large(own, 2.0) if first else Friction(load_share=own.load_share)
            found[task.name] = replace(found[task.name], joint_friction=law)
            task = replace(task, counterbalances=whole[task.name].counterbalances if first else ())
        tasks.append(task)
    return replace(study, joints=tuple(tasks)), found


def _axis_arm(study: Study, drives: Mapping[str, Drive]) -> Arm:
    """The axis of a load table with two motors, as an arm with one massless link that has the load's inertia."""
    [task], tensor = as_single(study).joints, np.zeros((1, 3, 3))
    tensor[0, 2, 2] = task.load_inertia or 0.0
    link = Arm.from_screws(
        np.eye(4)[None], [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]], [0.0], tensor, gravity=(0.0, 0.0, 0.0),
        joint_names=[task.name], check_inertias=False, name=study.name,
    )  # fmt: skip
    motors = [drives[one.name] for one in study.joints]
    return with_rotors(
        with_second_motors(link, [0]), [Rotor(one.gear.ratio, drive_inertia(one), carrier=-1) for one in motors]
    )


def _moved_inertias(arm: Arm, position: Array) -> list[float]:
    """Inertia that each motor moves, referred to its joint, or to the gear's output shaft where motors are coupled."""
    if arm.linkage is not None:
        moved = np.diag(plan(Scene(arm, {}, 1.0, position)).inertia)
        return [float(one) for one in moved @ arm.linkage.loops.mean]
    mass = mass_matrix(arm, position)
    if arm.coupling is not None:
        turns = np.linalg.inv(arm.coupling)
        mass = turns.T @ mass @ turns
    return [float(one) for one in np.diag(mass)]


def _plan_notes(study: Study, drives: Mapping[str, Drive], options: SceneOptions) -> tuple[str, ...]:
    """Notes for the reader of the plan on what the scene does not contain."""
    bound = [task.name for task in study.joints if task.coupled and drives[task.name].gear.stiffness_1 is not None]
    separate_gears = {drives[name].gear.key: drives[name].gear for pair in motor_pairs(study) for name in pair}
    note = "play of gear {}, which its data sheet does not give"
    notes = [note.format(key) for key, gear in separate_gears.items() if gear.backlash is None]
    notes += [f"what is apart in {name}: {TWO_AS_ONE}" for name, one in drives.items() if TWO_AS_ONE in one.assumptions]
    if bound and options.springs:
        notes.append(f"springs in the gears of {', '.join(bound)}: their motors are coupled")
    return tuple(notes)


def _mix_faults(cycle: Cycle) -> list[Fault]:
    """Faults for parts of a mix that do not begin where the part before them ends, so that one run is impossible."""
    faults = []
    for k, part in enumerate(cycle.parts):
        ahead = cycle.parts[(k + 1) % len(cycle.parts)]
        gap = float(np.abs(cycle.position[ahead.start] - cycle.position[part.stop - 1]).max())
        if len(cycle.parts) > 1 and cycle.torque is None and gap > GAP_ALLOWED:
            ends, begins = cycle.part_names[k], cycle.part_names[(k + 1) % len(cycle.parts)]
            problem = f"{begins} begins elsewhere than {ends} ends: one run cannot go through both"
            hint = "simulate each part as a study of its own, or let them begin and end at one place"
            faults.append(Fault("mix", problem, gap, hint))
    return faults


def _payloads(study: Study, repetitions: int) -> tuple[Effect, ...]:
    """The payload changes over all repetitions of the cycle; empty if the tip never carries a payload."""
    payload, time = study.cycle.payload, study.cycle.time
    if (payload < 0).all():
        return ()
    changes = [0, *(np.flatnonzero(np.diff(payload)) + 1)]
    bodies = {-1: EMPTY} | {k: Body(one.mass, one.com, one.inertia) for k, one in enumerate(study.payloads)}
    carried: dict[float, Body] = {}
    for k in range(repetitions):
        for at in changes:
            carried[float(time[at]) + k * study.cycle.duration] = bodies[int(payload[at])]
    return (PayloadChange(np.array(list(carried)), tuple(carried.values())),)


def _tip_forces(study: Study, arm: Arm | Inertia, repetitions: int) -> tuple[Effect, ...]:
    """The force on the tip over all repetitions of the cycle, in the direction of the commanded pose."""
    cycle = study.cycle
    if cycle.tip_wrench is None or not isinstance(arm, Arm):
        return ()
    rotation = tip_pose(*main_chain(arm, cycle.position))[:, :3, :3]
    moment, force = np.hsplit(-turned(rotation, cycle.tip_wrench), 2)
    return (TipForce(cycle.time, force, moment, repetitions),)


def _joint(study: Study, task: JointTask, drive: Drive, inertia: float, options: SceneOptions) -> tuple[Effect, ...]:
    """The effects of one joint: position loop, drive, and the gear's spring; ``inertia`` is that at the joint."""
    constant = torque_constant(drive.motor, drive.motor.reference_temperature)
    loop = PositionLoop(inertia * options.bandwidth**2, 2.0 * inertia * options.bandwidth, constant)
    effects: list[Effect] = [loop, *drive_effects(task, drive, surroundings(study), options)]
    if task.sharing:
        gear = replace(drive.gear, backlash=drive.gear.backlash or 0.0)
        spring = Backlash(gear, spring_damping(gear, inertia, options.damping))
        return (*effects, Preload(drive.motor, task.preload or 0.0), spring)
    single = task.travel_per_turn is None and not task.coupled
    if options.springs and drive.gear.stiffness_1 is not None and single:
        effects.append(FlexibleJoint(drive.gear, spring_damping(drive.gear, inertia, options.damping)))
    return tuple(effects)


def spring_damping(gear: Gear, inertia: float, share: float = DEFAULT_OPTIONS.damping) -> float:
    """Damping of a gear's spring from a damping ratio ``share``, with the inertia at the joint [N m s/rad]."""
    return share * 2.0 * math.sqrt((gear.stiffness_1 or 0.0) * inertia)


@dataclass(frozen=True)
class Surroundings:
    """Supply and ambient conditions of a drive."""

    supply_voltage: float  # [V]
    ambient: float  # ambient temperature [C]
    drag_temperature: float  # temperature of the gear for its drag [C]
    drag_follows: bool  # whether the gear follows the temperature of the housing instead, if that is simulated


def surroundings(study: Study) -> Surroundings:
    """Supply and ambient conditions of a study's drives."""
    cold = float(study.drag_temperature(study.ambient))
    return Surroundings(study.supply.voltage, study.ambient, cold, study.gear_temperature is None)


def drive_effects(
    task: JointTask, drive: Drive, around: Surroundings, options: SceneOptions = DEFAULT_OPTIONS
) -> list[Effect]:
    """The effects of a drive without control: motor, friction, gear losses, counterbalances, heating."""
    volts = available_voltage(task.amplifier, around.supply_voltage)
    effects: list[Effect] = [MotorCurrent(drive.motor, task.amplifier.peak_current or math.inf, volts)]
    if options.friction:
        law = at_joint(drive.joint_friction, task.travel_per_turn or 1.0)
        effects += _friction(law, "shaft" if task.coupled else "joint")
        effects += _friction(shaft_friction(drive), "motor")
    if known(unknown_loss(as_record(complete(drive.gear)))):
        effects += [MeshLoss(drive.gear)] if options.mesh else []
        effects += _drag(drive, around) if options.friction else []
    elif options.friction and drive.gear.no_load_torque:
        effects.append(DryFriction(Friction(coulomb=drive.gear.no_load_torque), "motor"))
    effects += [CounterbalanceTorque(one, k + 1) for k, one in enumerate(task.counterbalances)]
    network = thermal_network(drive.motor, around.ambient, housing_to_ambient=task.housing_to_ambient)
    if options.heat and network is not None and network.winding_capacity is not None:
        other = task.constant_loss(drive.motor, task.amplifier)
        effects.append(WindingHeat(network, gear_heat=task.gear_heat, constant_loss=other))
    return effects


def _drag(drive: Drive, around: Surroundings) -> list[Effect]:
    """The drag of the gear, if it has any: at a stated temperature, else at that of the housing."""
    found = mesh(drive.gear)
    if found.drag + found.seal + found.starting == 0.0:
        return []
    return [GearDrag(drive.gear, around.drag_temperature, follows=around.drag_follows)]


def _friction(law: Friction, side: Side) -> list[Effect]:
    """The effects of a friction law: dry friction, and its part that is smooth in the speed."""
    effects: list[Effect] = []
    if not law.tanh_speed and (law.coulomb or law.coulomb_negative or law.static):
        effects.append(DryFriction(law, side))
    if law.tanh_speed or law.viscous or law.viscous_negative:
        effects.append(ViscousFriction(law, side))
    return effects


def at_joint(law: Friction, travel: float) -> Friction:
    """A friction law of a rotating shaft, referred to its prismatic joint with a travel per angle [m/rad]."""
    torques = dict.fromkeys(("coulomb", "coulomb_negative", "static"), 1.0 / travel)
    viscous = dict.fromkeys(("viscous", "viscous_negative"), 1.0 / travel**2)
    speeds = dict.fromkeys(("stribeck_speed", "tanh_speed"), travel)
    scaled: Friction = with_scaled(law, torques | viscous | speeds)
    return scaled


def with_feed_forward(scene: Scene) -> Scene:
    """A scene with the currents that its command requires, computed by the inverse engine, as feed-forward.

    Args:
        scene: A scene with a command and a motor for every joint.

    Returns:
        The scene with tables of current, sampled at the times of the command and on both sides of its jumps.

    Raises:
        InputError: A joint without a command.
    """
    ready = plan(without(scene, HoldingBrake))  # no controller pushes against an engaged brake
    times = command_times(scene)
    demand = demanded(ready, times)
    after = np.append(times[1:], np.inf)
    table = np.where(after - times < 1e-12, after, times)  # both sides of a jump get the time of the jump
    effects = dict(scene.effects)
    for i, name in enumerate(scene.joints):
        own = scene.effects.get(name, ())
        pushed = sum(one.current(ready.body.ratios[i]) for one in own if isinstance(one, Preload))
        if np.isfinite(demand.current[:, i]).all():
            effects[name] = (*own, GivenCurrent(table, demand.current[:, i] - pushed))
    return replace(scene, effects=effects)


def command_times(scene: Scene, longest: float = 2e-3) -> Array:
    """Times at which a command is sampled completely [s], (N,).

    Its own samples, both sides of its jumps, and further times not further apart than ``longest`` [s].
    """
    instants = {0.0, scene.duration}
    jumps: set[float] = set()
    rests: set[float] = set()
    for effect in scene.effects.get(WHOLE, ()):
        if isinstance(effect, CommandedMotion):
            time = effect.motion.time - effect.motion.time[0]
            for k in range(effect.repetitions):
                instants |= {float(t) for t in time + k * time[-1]}
            breakpoints, end = effect.breakpoints(), float(time[-1]) * effect.repetitions
            jumps |= {t for t in breakpoints if 0.0 < t <= scene.duration}
            if end < breakpoints[-1] and end <= scene.duration:  # it ends moving, and stops just after
                rests.add(breakpoints[-1])
    marks = np.array(sorted(t for t in instants if t <= scene.duration))
    parts = [np.linspace(a, b, max(2, 1 + math.ceil((b - a) / longest)))[:-1] for a, b in pairwise(marks)]
    grid = np.unique(np.concatenate([*parts, [scene.duration], [*rests]]))
    left = [np.nextafter(t, -np.inf) for t in jumps | rests]
    return np.sort(np.concatenate([grid, left]))
