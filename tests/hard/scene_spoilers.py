"""Scenes with every kind of effect in them, and one number of one effect, body or argument spoiled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from corruption import spoiled

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop, SampledCurrentLoop
from drivetrain.effects.motor.given import GivenCurrent, GivenVoltage
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply, SupplyBus
from drivetrain.effects.motor.winding import Winding
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene
from drivetrain.solvers.solver import Rodas4

MOTOR = Motor("m", 0.299, 0.0302, inductance=82e-6)
GEAR = Gear("g", 100.0, kind="strain_wave", efficiency=0.8, stiffness_1=2e4, backlash=1e-3)
LAW = Friction(coulomb=0.7, static=1.0, stribeck_speed=0.1, viscous=0.2)
NETWORK = ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0)
TIME, TABLE = np.array([0.0, 0.01, 0.01, 0.05]), np.array([0.0, 1.0, 2.0, 0.0])

Spec = tuple[type, dict[str, Any]]
TAIL: tuple[Spec, ...] = ((MotorCurrent, {"motor": MOTOR, "peak_current": 20.0, "voltage": 48.0}),)
JOINT: tuple[tuple[Spec, ...], ...] = (
    ((GivenTorque, {"time": TIME, "torque": TABLE, "side": "joint"}), (WallSpring, {
        "stiffness": 100.0, "damping": 1.0, "rest": 0.1, "speed": 0.01}), (Encoder, {"counts": 500})),
    ((DryFriction, {"friction": LAW, "side": "joint"}), (ViscousFriction, {"friction": LAW, "side": "motor"}),
     (MovingBelt, {"speed": 0.1})),
    ((FullRotor, {"inertia": 3e-5, "ratio": 100.0}), (MeshLoss, {"gear": GEAR}), *TAIL,
     (GivenCurrent, {"time": TIME, "current": TABLE})),
    ((ReflectedRotor, {"inertia": 3e-5, "ratio": 100.0}), (FlexibleJoint, {"gear": GEAR, "damping": 2.0})),
    ((ReflectedRotor, {"inertia": 3e-5, "ratio": 100.0}), (Backlash, {"gear": GEAR, "damping": 2.0})),
    ((Winding, {"motor": MOTOR, "current": 1.0}), (GivenVoltage, {"time": TIME, "voltage": TABLE})),
    ((CurrentLoop, {"motor": MOTOR, "bandwidth": 3000.0, "peak_current": 20.0, "fed_forward": 1.0}),
     (PositionLoop, {"stiffness": 100.0, "damping": 10.0, "torque_constant": 0.03}),
     (WindingHeat, {"network": NETWORK, "winding": 40.0, "housing": 30.0, "every": 0.01})),
    ((SampledCascade, {"position_gain": 20.0, "speed_gain": 0.05, "integral_time": 0.1, "peak_current": 20.0,
                       "every": 1e-3, "delay": 1, "notch": 700.0, "notch_zeros": 0.1, "notch_poles": 0.7}),
     (Encoder, {"counts": 4096}), *TAIL,
     (HoldingBrake, {"holding": 1.0, "sliding": 0.5, "engages": (0.01,), "releases": (0.03,), "closing": 1e-3,
                     "opening": 1e-3, "engaged": False})),
    ((CascadeLoop, {"position_gain": 20.0, "speed_gain": 0.05, "integral_time": 0.1, "peak_current": 20.0}), *TAIL,
     (Cogging, {"amplitudes": (0.01, 0.002), "orders": (12, 24), "phases": (0.0, 0.5)})),
    ((Winding, {"motor": MOTOR}), (SampledCurrentLoop, {
        "motor": MOTOR, "bandwidth": 3000.0, "every": 1e-4, "peak_current": 20.0, "slew": 1e5, "fed_forward": 1.0}),
     (GivenCurrent, {"time": TIME, "current": TABLE})),
    ((LuGreFriction, {"stiffness": 1e5, "coulomb": 0.7, "static": 1.0, "stribeck_speed": 0.01, "damping": 10.0,
                      "viscous": 0.1, "side": "joint"}),),
)  # fmt: skip
PLACES = np.array([[0.0], [0.1], [0.1]])
MOTION = {"name": "m", "joint_names": ("joint",), "time": np.array([0.0, 0.02, 0.05]), "position": PLACES,
          "velocity": np.array([[0.0], [3.0], [0.0]]), "acceleration": np.zeros((3, 1))}  # fmt: skip
WHOLE: tuple[Spec, ...] = (
    (StiffSupply, {"voltage": 48.0, "modulation": 0.95}),
    (SupplyBus, {"voltage": 48.0, "capacity": 0.01, "power": 500.0, "threshold": 60.0, "resistance": 5.0,
                 "modulation": 0.95}),
)  # fmt: skip
BODY = {"inertia": 1.0, "weight": 3.0, "phase": 0.1}
RUN = {"duration": 0.03, "interval": 0.01, "position": [0.1], "speed": [0.2], "step": 1e-3, "rtol": 1e-4}


def one_wrong(values: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Fields of which one is spoiled, one inside a description where it is one."""
    name = list(values)[rng.integers(len(values))]
    value = values[name]
    if dataclasses.is_dataclass(value) and not isinstance(value, type) and rng.random() < 0.7:
        numbers = [f.name for f in dataclasses.fields(value) if isinstance(getattr(value, f.name), float)]
        field = numbers[rng.integers(len(numbers))]
        # A closure, for what is wrong inside is told when it is built.
        return {**values, name: dataclasses.replace(value, **{field: spoiled(getattr(value, field), rng)})}
    if dataclasses.is_dataclass(value):
        value = 1.0
    return {**values, name: spoiled(value, rng)}


def spoiled_scene(rng: np.random.Generator, engine: int) -> tuple[str, Callable[[], Any]]:
    """What is spoiled, and a run of the scene."""
    specs = JOINT[rng.integers(len(JOINT))]
    body, run, motion, whole = dict(BODY), dict(RUN), dict(MOTION), WHOLE[rng.integers(len(WHOLE))]
    target, choice = int(rng.integers(len(specs))), rng.integers(10)
    seed = int(rng.integers(2**31))
    kind = specs[target][0].__name__ if choice < 7 else ("run", "motion or supply", "body")[choice - 7]

    def call() -> Any:
        own = np.random.default_rng(seed)
        effects = []
        for k, (effect, fields) in enumerate(specs):
            effects.append(effect(**(one_wrong(fields, own) if k == target and choice < 7 else fields)))
        wishes = one_wrong(run, own) if choice == 7 else run
        inside = one_wrong(body, own) if choice == 9 else body
        moves, supply = motion, whole[1]
        if choice == 8:
            moves, supply = (one_wrong(motion, own), supply) if own.random() < 0.5 else (moves, one_wrong(supply, own))
        placed = {"joint": tuple(effects), "scene": (CommandedMotion(Motion(**moves)), whole[0](**supply))}
        scene = Scene(Inertia(**inside), placed, wishes["duration"], wishes["position"], wishes["speed"])
        solver = FixedStep(wishes["step"]) if engine == 1 else Rodas4(wishes["rtol"])
        # Numbers such as a weight of 1e59 take steps without end: stopped at the first look, by the progress callback.
        return simulate(scene, solver=solver, interval=wishes["interval"], progress=lambda share: False)

    return f"{kind} in {[effect.__name__ for effect, _ in specs]}", call
