"""A wall pushes and never pulls; static balance, a bounce against its closed form, energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.arm.arm import Arm
from drivetrain.drive.friction import Friction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.errors import InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene


def slider(mass: float = 2.0) -> Arm:
    """One mass that slides along x, its tip in it."""
    home = np.eye(4)[np.newaxis]
    screws = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
    inertia = np.eye(3)[np.newaxis] * 1e-3
    return Arm.from_screws(home, screws, [mass], inertia, tip=np.eye(4), gravity=(0.0, 0.0, 0.0))


def run(wall: TipContact, *, speed: float = 0.0, push: float = 0.0, step: float = 1e-3, drag: float = 0.0):
    arm = slider()
    joint = (GivenTorque([0.0], [push]), ViscousFriction(Friction(viscous=drag)))
    scene = Scene(arm, {arm.joint_names[0]: joint, "scene": (wall,)}, 1.0, speed=[speed])
    return simulate(scene, solver=FixedStep(step), interval=step), arm.joint_names[0]


WALL = TipContact((0.1, 0.0, 0.0), (-2.0, 0.0, 0.0), 5e4)  # met by moving to larger x; the normal need not be a unit


def test_at_rest_the_wall_bears_the_push() -> None:
    found, name = run(WALL, push=50.0, drag=400.0, step=1e-3)
    assert found.series["scene.contact_force"].values[-1] == pytest.approx(50.0, rel=1e-6)
    assert found.series[f"{name}.position"].values[-1] == pytest.approx(0.1 + 50.0 / 5e4, rel=1e-6)


def test_a_bounce_gives_the_speed_back() -> None:
    """Half a period of the spring in touch, the speed turned round."""
    apart = []
    for step in (1e-3, 1e-4, 1e-5):
        found, name = run(WALL, speed=1.0, step=step)
        assert (found.series["scene.contact_force"].values >= 0.0).all()
        apart.append(abs(found.series[f"{name}.speed"].values[-1] + 1.0))
    assert apart[0] < 0.2
    assert apart[2] < 1e-3
    touching = found.time[found.series["scene.contact_force"].values > 0.0]
    assert touching[-1] - touching[0] == pytest.approx(math.pi * math.sqrt(2.0 / 5e4), rel=1e-2)


def test_a_damped_wall_takes_energy_and_never_pulls() -> None:
    wall = TipContact((0.1, 0.0, 0.0), (-1.0, 0.0, 0.0), 5e4, 200.0)
    found, name = run(wall, speed=1.0, step=1e-4)
    assert (found.series["scene.contact_force"].values >= 0.0).all()
    speed = found.series[f"{name}.speed"].values[-1]
    assert -1.0 < speed < -0.2
    lost = found.series["scene.contact_energy"].values[-1]
    assert 0.5 * 2.0 * (1.0 - speed**2) == pytest.approx(lost, abs=0.02)
    assert abs(found.series["energy_error"].values[-1]) < 0.02


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        TipContact((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, -1.0)
    assert len(error.value.faults) == 3


@pytest.mark.parametrize("engine", [AdaptiveStep(), FixedStep(1e-4)])
def test_force_power_and_energy_are_those_of_how_deep_the_tip_is(engine: Engine) -> None:
    arm = slider()
    joint = (GivenTorque([0.0, 0.5, 1.0], [60.0, -20.0, 60.0]), ViscousFriction(Friction(viscous=5.0)))
    wall, normal = TipContact((0.1, 0.3, -0.2), (-2.0, 1.0, 0.5), 5e3, 300.0), np.array([-2.0, 1.0, 0.5]) / 5.25**0.5
    scene = Scene(arm, {arm.joint_names[0]: joint, "scene": (wall,)}, 1.0)
    found = simulate(scene, solver=engine, interval=1e-3)
    place, speed = (np.stack([found[f"scene.tip{kind}_{axis}"] for axis in "xyz"]) for kind in ("", "_speed"))
    deep, into = normal @ ([[0.1], [0.3], [-0.2]] - place), -normal @ speed
    force = np.where(deep > 0.0, np.maximum(5e3 * deep + 300.0 * into, 0.0), 0.0)
    assert (force > 0.0).sum() > 50 and (deep < 0.0).sum() > 50
    assert found["scene.contact_force"] == pytest.approx(force, rel=1e-9, abs=1e-9)
    power = np.where(deep > 0.0, (force - 5e3 * deep) * into, 0.0)
    assert found["scene.contact_power"] == pytest.approx(power, rel=1e-9, abs=1e-9)
    assert found["scene.contact_spring_energy"] == pytest.approx(2.5e3 * np.maximum(deep, 0.0) ** 2, abs=1e-12)


def test_the_motion_of_the_tip_is_recorded_where_it_is_computed() -> None:
    """Without an effect at the tip it is not computed: zeros would be wrong numbers."""
    arm, still = dt.load_arm("planar-2r"), np.array([0.3, -0.5])
    rotors = {name: (dt.ViscousFriction(dt.Friction(viscous=1.0)),) for name in arm.joint_names}
    plain = dt.simulate(dt.Scene(arm, rotors, 0.01, still))
    assert not [name for name in plain.series if "tip" in name]
    none = dt.TipForce([0.0], np.zeros((1, 3)), np.zeros((1, 3)))
    run = dt.simulate(dt.Scene(arm, {**rotors, "scene": (none,)}, 0.01, still))
    place = [run[f"scene.tip_{axis}"][0] for axis in "xyz"]
    np.testing.assert_allclose(place, dt.tip_pose(arm, still)[:3, 3], atol=1e-14)
    for name in plain.series:
        np.testing.assert_array_equal(run[name], plain[name])
