"""What is known of every joint's task before the forward run: the inverse engine's series, and heat from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.accuracy.decision import Basis
from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.drive.drive import resting
from drivetrain.drive.friction import friction_torque
from drivetrain.drive.heat import periodic_temperature
from drivetrain.drive.motor import Motor, copper_coefficient, torque_constant
from drivetrain.drive.thermal_network import ThermalNetwork
from drivetrain.dynamics.kinematics import body_jacobian
from drivetrain.dynamics.mass_matrix import mass_matrix
from drivetrain.effects.bounds import mean_of, rms_of
from drivetrain.effects.cascade_loop import CascadeLoop
from drivetrain.effects.dry_friction import DryFriction
from drivetrain.effects.effect import Effect, Place
from drivetrain.effects.estimate import Conditions, TaskSeries
from drivetrain.effects.mesh_loss import MeshLoss
from drivetrain.effects.position_loop import PositionLoop
from drivetrain.effects.sampled_cascade import SampledCascade
from drivetrain.effects.viscous_friction import ViscousFriction
from drivetrain.errors import InputError
from drivetrain.simulation.inverse import Demand, demanded
from drivetrain.simulation.plan import Plan, plan
from drivetrain.simulation.scene import Scene
from drivetrain.simulation.study_scene import command_times

MOST_POSES = 400  # at which inertias and lever arms are looked at


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
    return np.asarray(sum((friction_torque(law, speed) * speed for law in laws), start=np.zeros(len(speed))))


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
