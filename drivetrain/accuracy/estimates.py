"""What every effect is estimated to change at every joint: the command inverted, and bounds from its series."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.accuracy.decision import Basis
from drivetrain.accuracy.scenes import SPRINGS, choices, place_of
from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level
from drivetrain.arm.kinematics import body_jacobian
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arrays import Array
from drivetrain.drive.drive import resting
from drivetrain.drive.friction import friction_torque
from drivetrain.drive.gear_loss import drag_torque
from drivetrain.drive.motor import Motor, copper_coefficient, torque_constant
from drivetrain.drive.thermal.heat import periodic_temperature
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.effects.bounds import OVERSHOOT, bounded, mean_of, rms_of
from drivetrain.effects.control.cascade_loop import CascadeLoop
from drivetrain.effects.control.position_loop import PositionLoop
from drivetrain.effects.control.sampled_cascade import SampledCascade
from drivetrain.effects.effect import Effect, Place
from drivetrain.effects.estimate import Conditions, Estimate, TaskSeries
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.backlash import Backlash
from drivetrain.effects.gear.flexible_joint import FlexibleJoint
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.errors import InputError
from drivetrain.simulation.cost_results import Change, Choice
from drivetrain.simulation.engines.inverse_demand import Demand, demanded
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.scene import WHOLE, Scene
from drivetrain.simulation.study_scene import command_times

MOST_POSES = 400  # at which inertias and lever arms are looked at
COSTS = {
    "FlexibleJoint": 6.0, "Backlash": 6.0, "MeshLoss": 3.0, "LuGreFriction": 3.0, "CurrentLoop": 2.0,
    "SampledCurrentLoop": 8.0, "SampledCascade": 2.0, "Encoder": 0.5,
    "DryFriction": 2.0, "GearDrag": 2.0, "ViscousFriction": 1.0, "Cogging": 1.0, "WindingHeat": 0.5, "FullRotor": 0.5,
}  # fmt: skip
"""What keeping an effect is thought to cost, relative to others: states and coordinates more, bounds to be solved."""
BESIDE = 1.25  # the simulated motion lies beside the commanded one, on which the inverse run stands
SWUNG = 2.0 * OVERSHOOT * BESIDE  # a step of torque swings a spring to twice its size, and the loop answers that


@dataclass(frozen=True, eq=False)
class Task:
    """The command of a scene, inverted.

    Attributes:
        plan: Of the scene.
        demand: What the command takes; None: it cannot be inverted.
        conditions: Of each joint, by name; empty where nothing is known.
        couplings: |M_ij| / M_jj at its largest: acceleration of joint j felt as torque at joint i over its own, (n, n).
        levers: Largest speed of the tip over that of each joint [m/rad], (n,).
        why: What keeps the command from being inverted; empty for nothing.
    """

    plan: Plan
    demand: Demand | None
    conditions: dict[str, Conditions]
    couplings: Array
    levers: Array
    why: str = ""


def task_of(scene: Scene, basis: Basis) -> Task:
    """A scene's command inverted, and what estimates ask of it."""
    ready, n = plan(scene), len(scene.joints)
    try:
        demand = demanded(ready, command_times(scene))
    except InputError as error:
        return Task(ready, None, {}, np.zeros((n, n)), np.ones(n), error.faults[0].problem)
    mass, couplings, levers = _poses(scene, demand)
    conditions = {
        name: _conditions(ready, demand, i, basis, mass)
        for i, name in enumerate(scene.joints)
        if np.isfinite(demand.current[:, i]).all()
    }
    return Task(ready, demand, conditions, couplings, levers)


def _poses(scene: Scene, demand: Demand) -> tuple[Array, Array, Array]:
    """Inertia of each joint over the motion, rotors left in; couplings; lever arms."""
    if not isinstance(scene.body, Arm):
        return np.array([[scene.body.inertia]]), np.zeros((1, 1)), np.ones(1)
    some = demand.position[:: max(1, len(demand.time) // MOST_POSES)]
    # Where motors are coupled what a motor moves is seen from its shaft.
    turns = np.eye(scene.body.n) if scene.body.coupling is None else np.linalg.inv(scene.body.coupling)
    mass = turns.T @ mass_matrix(scene.body, some) @ turns
    diagonal = np.einsum("kii->ki", mass)
    couplings = np.abs(mass / diagonal[:, None, :]).max(axis=0)
    np.fill_diagonal(couplings, 0.0)
    levers = np.linalg.norm(body_jacobian(scene.body, some)[:, 3:, :] @ turns, axis=1).max(axis=0)
    return diagonal, couplings, levers


def _conditions(ready: Plan, demand: Demand, joint: int, basis: Basis, mass: Array) -> Conditions:
    """Of one joint."""
    scene, body = ready.scene, ready.body
    name = scene.joints[joint]
    effects = scene.effects.get(name, ())
    time, current, torque = demand.time, demand.current[:, joint], demand.mesh_torque[:, joint]
    speed = demand.shaft_speed[:, joint]
    series = TaskSeries(
        time, speed, demand.shaft_acceleration[:, joint], torque, current, np.asarray(resting(speed), dtype=bool)
    )
    motor = basis.motors[name]
    own = float(body.rotors[joint])
    inertia = mass[:, joint] - (own if isinstance(scene.body, Arm) and joint not in body.springs else 0.0)
    constant = float(torque_constant(motor, motor.reference_temperature))
    stiffness, damping, period = _loop(effects, constant * float(body.ratios[joint]) ** 2)
    mesh = next((effect for effect in effects if isinstance(effect, MeshLoss)), None)
    limits = [float(getattr(effect, "peak_current", math.inf)) for effect in effects]
    base = Conditions(
        peak_current=float(np.abs(current).max()),
        rms_current=rms_of(current, time),
        peak_torque=float(np.abs(torque).max()),
        rms_torque=rms_of(torque, time),
        peak_speed=float(np.abs(speed).max()),
        move_time=shortest_move(series),
        inertia=max(float(inertia.max()), 1e-12),
        rotor_inertia=own,
        free=float(np.abs(current).max()) < min(limits, default=math.inf),
        series=series,
        torque_constant=constant,
        mesh_share=1.0 if mesh is None else 1.0 + mesh.own(_place(ready, joint)).driving,
        loop_stiffness=stiffness,
        loop_damping=damping,
        sample_period=period,
    )
    return _warmed(base, motor, basis.networks.get(name), _shaft_loss(effects, speed * body.ratios[joint]))


def _loop(effects: Sequence[Effect], scale: float) -> tuple[float, float, float]:
    """Stiffness and damping of a position loop at the joint, and its period; ``scale`` takes a current there."""
    for effect in effects:
        if isinstance(effect, PositionLoop):
            return effect.stiffness, effect.damping, 0.0
        if isinstance(effect, CascadeLoop | SampledCascade):
            damping = effect.speed_gain * scale
            return effect.position_gain * damping, damping, effect.period or 0.0
    return math.inf, math.inf, 0.0


def _place(ready: Plan, joint: int) -> Place:
    return next(one.place for one in ready.instances if one.place.joint == joint)


def _warmed(base: Conditions, motor: Motor, network: ThermalNetwork | None, loss: Array) -> Conditions:
    """With what the periodic state of the task's own torque tells."""
    if network is None or base.series is None:
        return base
    strictly = np.append(True, np.diff(base.series.time) > 0.0)
    time, current = base.series.time[strictly], base.series.current[strictly]
    loss = loss[strictly]
    found = periodic_temperature(network, motor, time, current * motor.torque_constant, housing_loss=loss)
    if found.runaway:
        return replace(base, heat_gain=math.inf)
    share = float(motor.torque_constant / torque_constant(motor, found.magnet_temperature)) - 1.0
    resistance = network.resistance_winding_housing + network.resistance_housing_ambient
    slope = motor.resistance * copper_coefficient(motor.reference_temperature) * resistance
    square, friction = rms_of(current, time) ** 2, network.resistance_housing_ambient * mean_of(loss, time)
    rise = found.peak_winding - network.ambient
    cold = motor.resistance * resistance * square + friction
    return replace(
        base,
        heat_gain=slope * square * (1.0 + share) ** 2,
        cold_share=abs(rise - cold) / rise if rise > 0.0 else 0.0,
        magnet_share=abs(share),
        rise=rise if rise > 0.0 else math.inf,
        housing_resistance=network.resistance_housing_ambient,
    )


def _shaft_loss(effects: Sequence[Effect], speed: Array) -> Array:
    """What friction at the motor's shaft puts into its housing [W]."""
    laws = [
        replace(effect.friction, viscous=0.0, viscous_negative=None)
        if isinstance(effect, DryFriction)
        else replace(effect.friction, coulomb=0.0, coulomb_negative=None, static=None, stribeck_speed=None)
        for effect in effects
        if isinstance(effect, DryFriction | ViscousFriction) and effect.side == "motor"
    ]
    drags = [effect for effect in effects if isinstance(effect, GearDrag)]
    lost = [np.asarray(drag_torque(one.mesh, speed, one.temperature)) * speed for one in drags]
    lost += [friction_torque(law, speed) * speed for law in laws]
    return np.asarray(sum(lost, start=np.zeros(len(speed))))


def shortest_move(series: TaskSeries) -> float:
    """The shortest time between two rests.

    Returns:
        [s]; infinite for a joint that never moves.
    """
    moves = np.logical_not(series.resting)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moves, [False]]).astype(np.int8)))
    last = len(series.time) - 1
    lengths = [
        float(series.time[min(end, last)] - series.time[max(begin - 1, 0)])
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
    ]
    # A joint that passes through rest for an instant is still on its way.
    return min((length for length in lengths if length > 0.02 * max(lengths)), default=math.inf)


@dataclass(frozen=True)
class Told:
    """What leaving one effect out is thought to change.

    Attributes:
        choice: The effect.
        changes: Bounds by joint; the tip's stands at the effect's own joint.
        valid: Whether the derivation holds here.
        why: The derivation, or what it lacks.
    """

    choice: Choice
    changes: Mapping[str, Change]
    valid: bool
    why: str


def estimates(scene: Scene, task: Task) -> tuple[Told, ...]:
    """The estimate of every effect that may be left out."""
    found = []
    for choice in choices(scene):
        if choice.kind == "FullRotor":
            found.append(_rotors(scene, task, choice))
            continue
        effects = [one for one in scene.effects[choice.joint] if type(one).__name__ == choice.kind]
        found.append(_own(scene, task, choice, effects))
    return tuple(found)


def _own(scene: Scene, task: Task, choice: Choice, effects: list[Effect]) -> Told:
    """Of the effects of one kind at one joint, added up."""
    conditions = task.conditions.get(choice.joint)
    if conditions is None:
        why = task.why or "no motor is known there"
        return Told(choice, {}, False, f"the command cannot be inverted: {why}")
    place = place_of(scene, choice.joint)
    told = [effect.estimate(place, conditions) for effect in effects]
    lever = float(task.levers[place.joint])
    own = joined(sum, [_changed(one, lever) for one in told])
    changes = {choice.joint: own}
    if choice.kind in SPRINGS:
        swing = sum(one.swing(conditions) for one in effects if isinstance(one, FlexibleJoint | Backlash))
        twist = sum(one.deviation for one in told)
        changes |= _elsewhere(scene, task, place.joint, np.asarray(swing), float(twist))
    valid = all(one.valid for one in told) and not any(math.isnan(share) for share in own.shares[:3])
    return Told(choice, changes, valid, "; ".join(dict.fromkeys(one.why for one in told)))


def _elsewhere(scene: Scene, task: Task, joint: int, swing: np.ndarray, twist: float) -> dict[str, Change]:
    """What the swing and the twist of one joint do to the others, through the mass matrix."""
    found = {}
    for i, name in enumerate(scene.joints):
        conditions = task.conditions.get(name)
        if i == joint or conditions is None or conditions.series is None:
            continue
        torque = task.couplings[i, joint] * swing + twist * conditions.peak_torque
        error = torque * conditions.mesh_share / (abs(task.plan.body.ratios[i]) * conditions.torque_constant)
        found[name] = _changed(bounded(conditions, error, ""), 0.0)
    return found


def _rotors(scene: Scene, task: Task, choice: Choice) -> Told:
    """The inverse run with rotors as bodies, less that with rotors reflected: exact while the command is followed."""
    demand = task.demand
    if demand is None or not isinstance(scene.body, Arm):
        return Told(choice, {}, False, "without an arm, or a command that can be inverted, it is kept")
    if choice.joint != WHOLE:
        return Told(choice, {}, False, "a rotor of its own at one joint: keep it")
    other = Scene(
        at_level(scene.body, RotorLevel.REFLECTED), scene.effects, scene.duration, scene.position, scene.speed
    )
    less = demanded(plan(other), demand.time)
    slack = SWUNG if task.plan.body.springs else BESIDE
    changes, away = {}, 0.0
    for i, name in enumerate(scene.joints):
        conditions = task.conditions.get(name)
        if conditions is None:
            return Told(choice, {}, False, "a joint has no motor: keep it")
        error = np.abs(less.current[:, i] - demand.current[:, i])
        torque = float(error.max()) * conditions.torque_constant * abs(task.plan.body.ratios[i])
        turned = float(torque / conditions.loop_stiffness)
        away += turned * float(task.levers[i])
        told = _changed(bounded(conditions, slack * error, "", deviation=turned), 0.0)
        carried = np.abs(less.mesh_torque[:, i] - demand.mesh_torque[:, i])
        share = slack * rms_of(carried, demand.time) / conditions.rms_torque if conditions.rms_torque else 0.0
        changes[name] = replace(told, rms_torque=max(told.rms_torque, share))
    first = scene.joints[0]
    changes[first] = Change(*changes[first].shares, float(away))
    return Told(choice, changes, True, "the inverse run both ways")


def _changed(estimate: Estimate, lever: float) -> Change:
    """An estimate as a change, its turned joint as a way of the tip."""
    return Change(estimate.current, estimate.torque, estimate.torque, estimate.temperature, estimate.deviation * lever)


def joined(rule: Callable[[tuple[float, ...]], float], parts: Iterable[Change]) -> Change:
    """Changes made one by a rule for each quantity, such as ``sum``; none changes nothing."""
    return Change(*(rule(values) for values in zip(*((*part.shares, part.tip) for part in parts), strict=True)))


def added(parts: list[Mapping[str, Change]], joints: tuple[str, ...]) -> dict[str, Change]:
    """Bounds of several effects together, the tip's those of all joints."""
    tip = sum(change.tip for part in parts for change in part.values())
    sums = {name: joined(sum, [part[name] for part in parts if name in part]) for name in joints}
    return {name: Change(*own.shares, tip) for name, own in sums.items()}
