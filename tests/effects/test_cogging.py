"""Cogging: energy kept, the frequency of the small swing, nothing left of teeth that fly past."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.drive.friction import Friction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene

SIZE, ORDER, INERTIA, RATIO = 0.02, 84, 3e-5, 50.0


def swinging(start: float, step: float, duration: float = 0.2):
    """A rotor alone, its angle at the start given at the motor."""
    effects = [ReflectedRotor(INERTIA, RATIO), Cogging((SIZE,), (ORDER,))]
    scene = joint_scene(Inertia(0.0), effects, duration, position=start / RATIO)
    return simulate(scene, solver=FixedStep(step), interval=step)


def test_a_small_swing_has_the_frequency_of_the_pull() -> None:
    run = swinging(1e-4, 1e-4)
    angle = run.series["joint.motor_position"].values
    crossings = np.flatnonzero(np.diff(np.signbit(angle)))
    period = 2.0 * 1e-4 * np.diff(crossings).mean()
    assert period == pytest.approx(2.0 * math.pi * math.sqrt(INERTIA / (SIZE * ORDER)), rel=0.01)


def test_energy_is_kept_to_the_square_of_the_step() -> None:
    errors = [abs(swinging(0.02, step).series["energy_error"].values).max() for step in (2e-4, 1e-4)]
    assert errors[1] < errors[0] / 3.0
    assert errors[1] < 1e-2 * 2.0 * SIZE / ORDER


def test_teeth_that_fly_past_leave_nothing() -> None:
    """At 4 teeth a step the samples of a sine would be a torque of any size."""
    effects = [ReflectedRotor(INERTIA, 1.0), Cogging((SIZE,), (ORDER,))]
    speed = 4.0 * 2.0 * math.pi / ORDER / 1e-3
    run = simulate(joint_scene(Inertia(0.0), effects, 0.5, speed=speed))
    assert run.series["joint.speed"].values == pytest.approx(speed, abs=1e-6 * speed)


def test_it_rests_on_a_tooth() -> None:
    effects = [ReflectedRotor(INERTIA, 1.0), Cogging((SIZE,), (ORDER,)), ViscousFriction(Friction(viscous=1e-3))]
    run = simulate(joint_scene(Inertia(0.0), effects, 1.0, position=0.06))
    tooth = 2.0 * math.pi / ORDER  # 0.06 is nearest to the first
    assert run.series["joint.position"].values[-1] == pytest.approx(tooth, abs=1e-6)


def test_harmonics_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match="whole numbers"):
        Cogging((0.1,), (0,))
    with pytest.raises(InputError, match="as many"):
        Cogging((0.1, 0.2), (12,))
