"""Play in a gear: flanks meet within a step, push and never pull; energy, momentum, and the spring without play."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.drive.gear import Gear
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene

ROTOR, LOAD, RATIO = 0.33, 0.5, 10.0  # kg m^2 at the joint, kg m^2, -


def gear(stiffness: float, play: float | None = 2e-3) -> Gear:
    return Gear(key="g", ratio=RATIO, stiffness_1=stiffness, backlash=play)


def pushed(stiffness: float, step: float, damping: float = 0.0, duration: float = 2.0):
    """A torque for a tenth of a second sets the load off through the play; then nothing acts from outside."""
    push = GivenTorque(np.array([0.0, 0.1, 0.1]), np.array([1.0, 1.0, 0.0]))
    effects = [ReflectedRotor(ROTOR / RATIO**2, RATIO), Backlash(gear(stiffness), damping), push]
    return simulate(joint_scene(Inertia(LOAD), effects, duration), solver=FixedStep(step), interval=step)


def momentum(run):
    return LOAD * run.series["joint.speed"].values + ROTOR / RATIO * run.series["joint.motor_speed"].values


def test_the_end_is_one_body_that_moves_on() -> None:
    run = pushed(1e5, 2e-4, damping=300.0, duration=20.0)
    both = 0.1 / (LOAD + ROTOR)
    assert run.series["joint.speed"].values[-1] == pytest.approx(both, rel=0.05)
    assert run.series["joint.motor_speed"].values[-1] / RATIO == pytest.approx(both, rel=0.05)


def test_without_play_it_is_a_flexible_joint() -> None:
    push = GivenTorque(np.array([0.0, 0.1, 0.1]), np.array([5.0, 5.0, 0.0]))
    ends = []
    for spring in (Backlash(gear(1e5, 0.0), 5.0), FlexibleJoint(gear(1e5, 0.0), 5.0)):
        effects = [ReflectedRotor(ROTOR / RATIO**2, RATIO), spring, push]
        run = simulate(joint_scene(Inertia(LOAD), effects, 0.3), solver=FixedStep(1e-4))
        ends.append([run.series[f"joint.{name}"].values[-1] for name in ("position", "speed", "deflection")])
    # The step's mean of a straight spring is its middle; the damper of touching flanks differs where it would pull.
    assert ends[0] == pytest.approx(ends[1], rel=5e-2)


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        Backlash(gear(1e5, None), -1.0)
    assert len(error.value.faults) == 2
