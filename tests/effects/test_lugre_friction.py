"""Bristles: the closed form of small bends, the limit of sliding, stiff ones in long steps, energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene


def pushed(friction: LuGreFriction, torque: float, *, step: float = 1e-3, duration: float = 2.0, speed: float = 0.0):
    scene = joint_scene(Inertia(1.0), [friction, GivenTorque([0.0], [torque])], duration, speed=speed)
    return simulate(scene, solver=FixedStep(step))


def test_before_sliding_it_is_a_spring() -> None:
    run = pushed(LuGreFriction(1e4, 1.5, damping=100.0), 0.3)
    assert run.series["joint.position"].values[-1] == pytest.approx(0.3 / 1e4, rel=0.3)
    assert run.series["joint.joint_lugre_torque"].values[-1] == pytest.approx(0.3, rel=1e-6)


def test_sliding_it_is_coulomb_friction() -> None:
    run = pushed(LuGreFriction(1e4, 1.0, 1.5, 0.01, viscous=0.5), 3.0, duration=20.0)
    assert run.series["joint.speed"].values[-1] == pytest.approx((3.0 - 1.0) / 0.5, rel=1e-3)


def test_against_an_implicit_solver() -> None:
    """The equations as the docstring writes them."""
    s0, s1, fc, fs, vs = 1e5, 300.0, 1.0, 1.5, 0.05

    def rates(t: float, y: np.ndarray) -> list[float]:
        _, speed, bend = y
        slip = fc + (fs - fc) * math.exp(-((speed / vs) ** 2))
        rate = speed - s0 * abs(speed) / slip * bend
        return [speed, 2.0 - s0 * bend - s1 * rate, rate]

    expected = solve_ivp(rates, (0.0, 1.0), [0.0, 0.0, 0.0], method="Radau", rtol=1e-8, atol=1e-11).y[:, -1]
    apart = []
    for step in (1e-3, 2.5e-4):
        run = pushed(LuGreFriction(s0, fc, fs, vs, s1), 2.0, step=step, duration=1.0)
        apart.append(abs(run.series["joint.position"].values[-1] - expected[0]))
    assert apart[0] < 2e-3 * expected[0]
    assert apart[1] < 0.5 * apart[0]


def test_stiff_bristles_in_long_steps() -> None:
    """1e6 N m/rad: an explicit method would need steps of a microsecond; the bend stays within what slides."""
    scene = joint_scene(Inertia(1.0), [LuGreFriction(1e6, 1.0)], 3.0, position=0.0, speed=1.0)
    run = simulate(scene, solver=FixedStep(1e-3))
    bend = run.series["joint.joint_bristle_bend"].values
    assert np.isfinite(bend).all()
    assert abs(bend).max() <= 1.0 / 1e6 * (1.0 + 1e-9)
    assert run.series["joint.position"].values[-1] == pytest.approx(0.5, abs=2e-3)  # v^2 / 2 at a unit of friction
    assert abs(run.series["joint.speed"].values[-1]) < 1e-3  # the bristles have no damping


@pytest.mark.parametrize("side, ratio", [("joint", 1.0), ("motor", -3.0)])
def test_what_bends_comes_back_and_what_slips_is_lost(side: str, ratio: float) -> None:
    """Work put in is in the bristles, in the body or lost, but for an error of the second power of the step."""
    time, errors = np.linspace(0.0, 2.0, 201), []
    push = GivenTorque(time, 1.4 * abs(ratio) * np.sin(6.0 * time))  # slips, sticks, turns about
    law = LuGreFriction(1e3, 1.0, 1.5, 0.05, damping=3.0, viscous=0.1, side=side)
    for step in (1e-3, 2.5e-4):
        scene = joint_scene(Inertia(1.0), [law, push, ReflectedRotor(0.1, ratio)], 2.0)
        run = simulate(scene, solver=FixedStep(step))
        assert (np.diff(run[f"joint.{side}_lugre_energy"]) >= 0.0).all()
        errors.append(np.abs(run["energy_error"]).max() / run[f"joint.{side}_lugre_energy"][-1])
    assert errors[0] < 2e-6 and errors[1] < 0.09 * errors[0]  # 1/16, and a little of the next power


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        LuGreFriction(0.0, -1.0, 0.5, 0.0, -1.0, math.nan, "middle")
    assert len(error.value.faults) == 6
