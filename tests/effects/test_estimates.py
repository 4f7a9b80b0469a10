"""A-priori estimates: no smaller than what dropping the effect really changes, and not wildly larger."""

import math

import numpy as np
import pytest

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.effects.effect import Effect, Place
from drivetrain.effects.estimate import Conditions
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.flexible_joint import FlexibleJoint
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene, without

PLACE = Place(0, "joint", ("joint",), (100.0,), (True,), 1)
INERTIA, ROTOR, MOVE, TRAVEL = 0.4, 0.33, 0.5, 1.0
T = np.linspace(0.0, MOVE, 501)
SPEED = 30 * (T / MOVE) ** 2 * (1 - T / MOVE) ** 2 * TRAVEL / MOVE
ACCELERATION = 60 * (T / MOVE) * (1 - T / MOVE) * (1 - 2 * T / MOVE) * TRAVEL / MOVE**2
RIGID = (INERTIA + ROTOR) * ACCELERATION
CONDITIONS = Conditions(
    peak_current=1.0, rms_current=1.0, peak_torque=np.abs(RIGID).max(), rms_torque=math.sqrt(np.mean(RIGID**2)),
    peak_speed=SPEED.max(), move_time=MOVE, inertia=INERTIA, rotor_inertia=ROTOR,
)  # fmt: skip


@pytest.mark.parametrize(
    ("effect", "added"),
    [
        (DryFriction(Friction(coulomb=0.3)), 0.3 * np.sign(SPEED)),
        (DryFriction(Friction(coulomb=0.003), "motor"), 0.3 * np.sign(SPEED)),
        (ViscousFriction(Friction(viscous=0.1)), 0.1 * SPEED),
        (MeshLoss(Gear("g", 100.0, kind="spur", efficiency=0.9)), np.abs(INERTIA * ACCELERATION) / 9.0),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Effect) else "",
)
def test_losses_change_no_more_than_estimated(effect: Effect, added: np.ndarray) -> None:
    estimate = effect.estimate(PLACE, CONDITIONS)
    whole = RIGID + added
    peak = abs(np.abs(whole).max() / np.abs(RIGID).max() - 1.0)
    rms = abs(math.sqrt(np.mean(whole**2) / np.mean(RIGID**2)) - 1.0)
    assert estimate.valid
    assert peak <= estimate.current * 1.001 and rms <= estimate.torque * 1.001
    assert estimate.current < 20.0 * max(peak, rms)


@pytest.mark.parametrize("stiffness", [1e4, 1e5])
def test_twist_of_a_spring_is_estimated_within_a_third(stiffness: float) -> None:
    gear = Gear("g", 100.0, stiffness_1=stiffness)
    effects = [FullRotor(ROTOR / 1e4, 100.0), FlexibleJoint(gear, 2.0), GivenTorque(T, RIGID / 100.0, "motor")]
    run = simulate(joint_scene(INERTIA, effects, MOVE), interval=1e-3)
    estimate = effects[1].estimate(PLACE, CONDITIONS)
    # The spring carries the link's share of the peak torque only.
    carried = estimate.deviation * INERTIA / (INERTIA + ROTOR)
    assert np.abs(run["joint.deflection"]).max() == pytest.approx(carried, rel=0.33)


def test_estimates_tell_where_they_do_not_hold() -> None:
    soft = FlexibleJoint(Gear("g", 100.0, stiffness_1=10.0)).estimate(PLACE, CONDITIONS)
    assert not soft.valid and soft.why


def test_dropped_effects_leave_what_stands_in_for_them() -> None:
    law = Friction(coulomb=1.0)
    scene = joint_scene(Inertia(1.0), [FullRotor(1e-5, 50.0), DryFriction(law)], 1.0)
    reflected = without(scene, FullRotor)
    assert {type(effect) for effect in reflected.effects["joint"]} == {ReflectedRotor, DryFriction}
    assert without(scene, DryFriction).effects["joint"] == (FullRotor(1e-5, 50.0),)
    assert isinstance(reflected, Scene)
