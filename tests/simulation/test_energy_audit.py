"""Losses of whole arms, and energy in is energy stored and lost; tests/hard has every subset of effects at a joint."""

import numpy as np
import pytest
import yaml

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.study.template import study_template

GEAR = Gear("g", 100.0, kind="strain_wave", efficiency=0.8, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4)
TIME = np.linspace(0.0, 1.0, 201)
ALWAYS: list[Effect] = [
    FullRotor(3e-5, 100.0),
    MotorCurrent(Motor("m", 0.299, 0.0302)),
    GivenCurrent(TIME, 4.0 * np.sin(2 * np.pi * TIME)),
]
SOME: list[Effect] = [
    DryFriction(Friction(coulomb=0.015, static=0.025, stribeck_speed=5.0), "motor"),
    DryFriction(Friction(coulomb=0.7)),
    ViscousFriction(Friction(viscous=1e-4), "motor"),
    ViscousFriction(Friction(viscous=0.2, viscous_negative=0.3)),
    MeshLoss(GEAR),
    FlexibleJoint(GEAR, 4.0),
    WallSpring(30.0, 0.5, rest=0.1),
]


def test_losses_are_losses() -> None:
    run = simulate(joint_scene(Inertia(1.2, weight=3.0), [*ALWAYS, *SOME], 1.0))
    for name in ("joint_friction", "motor_friction", "mesh", "motor_viscous", "joint_viscous", "spring_damping"):
        assert (np.diff(run[f"joint.{name}_energy"]) >= -1e-15).all(), name
    assert (run["joint.copper_loss"] >= 0.0).all()


@pytest.mark.parametrize("kind", [FullRotor, ReflectedRotor])
def test_an_arm_with_rotors_springs_and_losses_balances(kind: type) -> None:
    arm = dt.load_arm("ur5")
    effects: dict[str, tuple[Effect, ...]] = {}
    for i, name in enumerate(arm.joint_names):
        more = [FlexibleJoint(GEAR, 4.0)] if i in (1, 4) else []
        law = Friction(coulomb=0.01, viscous=2e-5)
        losses = [DryFriction(law, "motor"), ViscousFriction(law, "motor"), MeshLoss(GEAR)]
        current = GivenCurrent(TIME, (2.0 - 0.3 * i) * np.sin(2 * np.pi * TIME))
        effects[name] = (kind(3e-5, 100.0), MotorCurrent(Motor("m", 0.3, 0.05)), current, *losses, *more)
    scene = Scene(arm, effects, 1.0, np.array([0.2, -1.0, 0.8, 0.3, 0.5, 0.1]))
    errors = []
    for step in (1e-3, 5e-4):
        run = simulate(scene, solver=FixedStep(step), interval=0.05)
        put_in = sum(np.abs(run[f"{name}.electrical_energy"]).max() for name in arm.joint_names)
        errors.append(np.abs(run["energy_error"]).max() / put_in)
    assert errors[0] < 1e-4
    assert errors[1] < 0.35 * errors[0]
    assert len(plan(scene).memory.states) == 12 + 4


def test_payloads_are_counted_once_at_instants_that_rounding_parts():
    """The study that `init` writes, whose payload goes at 1.3444... s: no energy is missed, and the rest falls."""
    study = yaml.safe_load(study_template("ur5-corrected"))
    large, small = ("AM_MF0095008_48V", "hd_CSG-25-160-2UH"), ("AM_MF0060008_48V", "hd_CSG-14-50-2UH")
    names = list(dt.load_study(study).cycle.joint_names)
    drives = dict(zip(names, [large] * 3 + [small] * 3, strict=True))
    evaluation = dt.evaluate(dt.load_study(study), drives)
    rests = []
    for step in (1e-3, 2.5e-4):
        found = dt.simulate(evaluation, solver=FixedStep(step))
        assert {one.name for one in found.events} <= {"breakaway", "stick", "mesh", "step"}
        rests.append(np.ptp(found["energy_error"]))
    assert rests[0] < 1e-3 and rests[1] < 0.3 * rests[0]  # of some 100 J that pass
