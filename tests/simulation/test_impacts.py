"""Flanks, bends and walls within a step of the fixed engine: no energy from them, none passed untouched."""

from __future__ import annotations

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.spring import answer, gear_spring, mean_touch, touch, twist_under
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene


@pytest.mark.parametrize("seed", range(60))
def test_random_impacts_gain_no_energy_and_pass_no_flank(seed: int) -> None:
    """Steps of 0.1 to 2 ms, 1e3 to 1e7 N m/rad, rotors of 1e-7 to 1e-3 kg m^2; without damping nothing is lost."""
    rng = np.random.default_rng(seed)
    step, stiffness = 10 ** rng.uniform(-4.0, np.log10(2e-3)), 10 ** rng.uniform(3.0, 7.0)
    rotor, ratio = 10 ** rng.uniform(-7.0, -3.0), float(rng.choice([1.0, 10.0, 50.0, 100.0]))
    load, play, speed = 10 ** rng.uniform(-2.0, 1.0), 10 ** rng.uniform(-4.0, -2.0), 10 ** rng.uniform(-1.0, 1.5)
    damping = stiffness * 10 ** rng.uniform(-5.0, -3.0) if seed % 2 else 0.0
    pieces = {"torque_1": stiffness * 1e-4, "stiffness_2": 2 * stiffness} if seed % 3 else {}
    gear = Gear("g", ratio, stiffness_1=stiffness, backlash=play, **pieces)
    kick = GivenTorque([0.0, 20 * step, 20 * step], np.array([1.0, 1.0, 0.0]) * load * speed / (20 * step))
    scene = joint_scene(Inertia(load), [ReflectedRotor(rotor, ratio), Backlash(gear, damping), kick], 400 * step)
    run = simulate(scene, solver=FixedStep(step), interval=step)
    free = run.time > 21.5 * step
    energy, twist, torque = (run[name][free] for name in ("stored_energy", "joint.deflection", "joint.flank_torque"))
    # 1e-9 is asked at an impact; rounding leaves less of hundreds of them.
    assert np.diff(energy).max() <= 1e-10 * energy[0]
    assert energy.max() <= energy[0] * (1.0 + 1e-10)
    if not damping:
        assert energy.min() >= energy[0] * (1.0 - 1e-10)
    # Deeper than all energy can press it a flank never is: that it was passed untouched would show here.
    deepest = max(float(np.abs(twist).max()) - 0.5 * play, 0.0)
    assert 0.5 * stiffness * deepest**2 <= energy[0] * (1.0 + 1e-9)
    assert (torque * twist >= 0.0).all()
    momentum = load * run["joint.speed"] + rotor * ratio * run["joint.motor_speed"]
    assert np.abs(momentum[free] / momentum[free][0] - 1.0).max() < 1e-12


def test_a_light_rotor_is_caught_by_its_flank_within_a_step() -> None:
    """1e-7 kg m^2 at 2000 rad/s would go 40 mrad of the gear a step; the play is 2 mrad."""
    gear = Gear("g", 50.0, stiffness_1=1e6, backlash=2e-3)
    kick = GivenTorque([0.0, 1e-3, 1e-3], [0.2, 0.2, 0.0], "motor")
    run = simulate(joint_scene(5.0, [ReflectedRotor(1e-7, 50.0), Backlash(gear), kick], 0.1), solver=FixedStep(1e-3),
                   interval=1e-3)  # fmt: skip
    assert np.abs(run["joint.deflection"]).max() < 1e-3 + np.sqrt(2.0 * run["stored_energy"].max() / 1e6) + 1e-12
    assert run["joint.speed"][-1] > 0.0  # it has pushed the load


@pytest.mark.parametrize("step", [1e-4, 1e-3, 2e-3])
def test_a_spring_in_three_pieces_keeps_its_energy(step: float) -> None:
    gear = Gear("g", 100.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=5e4, torque_2=20.0, stiffness_3=2e5)
    push = GivenTorque([0.0, 0.05, 0.05], [60.0, 60.0, 0.0])
    scene = joint_scene(0.5, [ReflectedRotor(1e-6, 100.0), FlexibleJoint(gear), push], 1.0)
    run = simulate(scene, solver=FixedStep(step), interval=step)
    free = run.time > 0.05 + 1.5 * step
    energy = run["stored_energy"][free]
    assert np.ptp(run["joint.deflection"][free]) > 0.0
    assert np.ptp(energy) < 1e-10 * energy[0]


def random_arm(seed: int) -> tuple[Scene, float, bool]:
    """Play and springs in all joints of a UR5 that falls onto a stiff wall."""
    rng = np.random.default_rng(seed)
    lossless = seed % 2 == 0
    arm = dt.with_rotors(dt.load_arm("ur5"), [dt.Rotor(100.0, 10 ** rng.uniform(-7.0, -4.0)) for _ in range(6)])
    effects: dict[str, tuple[Effect, ...]] = {}
    for i, name in enumerate(arm.joint_names):
        k = 10 ** rng.uniform(3.5, 6.5)
        gear = Gear("g", 100.0, stiffness_1=k, backlash=10 ** rng.uniform(-4.0, -2.3), torque_1=5.0, stiffness_2=2 * k,
                    torque_2=15.0, stiffness_3=3 * k, efficiency=0.8)  # fmt: skip
        own: list[Effect] = [Backlash(gear, 0.0 if lossless else 1e-4 * k)] if i % 2 else [FlexibleJoint(gear)]
        if not lossless:
            own += [DryFriction(Friction(coulomb=1.0, static=1.5)), MeshLoss(gear)]
            own.append(DryFriction(Friction(coulomb=0.01), "motor"))
        effects[name] = tuple(own)
    wall = TipContact((0.0, 0.0, -0.2), (0.0, 0.0, 1.0), 10 ** rng.uniform(3.0, 6.5), 0.0 if lossless else 100.0)
    start, step = np.array([0.1, -1.2, 1.0, 0.3, 0.5, 0.2]), 10 ** rng.uniform(-4.0, -2.7)
    return Scene(arm, effects | {"scene": (wall,)}, 500 * step, start, rng.normal(size=6)), step, lossless


@pytest.mark.parametrize("seed", range(8))
def test_an_arm_with_play_everywhere_falls_on_a_wall(seed: int) -> None:
    scene, step, lossless = random_arm(seed)
    run = simulate(scene, solver=FixedStep(step), interval=step)
    assert run.stopped_by is None
    assert run.counters["unsettled"] == 0
    assert run.counters["solves"] < 12 * run.counters["steps"]
    # What is left is how the arm's inertia changes within a step, not the kinks: of second order.
    wrong = np.abs(run["energy_error"] - run["energy_error"][0]).max() / run["stored_energy"].max()
    assert wrong < 5e-3
    if lossless:
        assert run["energy_error"][-1] < 5e-3 * run["stored_energy"].max()


def test_without_kinks_no_step_is_looked_at_twice() -> None:
    gear = Gear("g", 100.0, stiffness_1=1e5)
    scene = joint_scene(Inertia(1.0, 5.0), [ReflectedRotor(1e-5, 100.0), FlexibleJoint(gear)], 0.1, speed=1.0)
    run = simulate(scene)
    assert run.counters["solves"] == run.counters["steps"] == 100


PIECES = gear_spring(Gear("g", 1.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=3e4, torque_2=26.0, stiffness_3=2e4))


@pytest.mark.parametrize("flanks", [(-1e-3, 1e-3), (0.0, 0.0), (-np.inf, 2e-4)])
def test_the_mean_along_a_step_is_that_of_many_instants(flanks: tuple[float, float]) -> None:
    rng = np.random.default_rng(3)
    h = 1e-3
    for _ in range(15):
        twist, rate, damping = rng.uniform(-3e-3, 3e-3), rng.uniform(-5.0, 5.0), rng.uniform(0.0, 8.0)
        way = twist + h * rate * (np.arange(20000) + 0.5) / 20000 - 0.5 * h * rate
        wanted = np.mean([touch(PIECES, flanks, damping, at, rate)[0] for at in way])
        torque, slope, slowing = mean_touch(PIECES, flanks, damping, twist, rate, h)
        assert torque == pytest.approx(wanted, abs=5e-3)  # 20000 samples, jumps of 40 N m between two
        small = 1e-7
        more, less = (mean_touch(PIECES, flanks, damping, twist + k * 0.5 * h * small, rate + k * small, h)[0]
                      for k in (1.0, -1.0))  # fmt: skip
        # The beginning of the step stays: twist and rate go together.
        assert slowing + 0.5 * h * slope == pytest.approx((more - less) / (2.0 * small), rel=1e-3, abs=1e-3)
        assert slowing + 0.5 * h * slope >= 0.0


def test_what_flanks_do_is_what_the_spring_stores() -> None:
    rng = np.random.default_rng(4)
    for _ in range(100):
        begin, rate, h = rng.uniform(-3e-3, 3e-3), rng.uniform(-9.0, 9.0), 1e-3
        end = begin + h * rate
        torque, _, _ = mean_touch(PIECES, (-1e-3, 1e-3), 0.0, 0.5 * (begin + end), rate, h)
        stored = [answer(PIECES, max(abs(at) - 1e-3, 0.0))[2] for at in (begin, end)]
        assert torque * h * rate == pytest.approx(stored[1] - stored[0], abs=1e-13)


def test_the_twist_is_the_inverse_of_the_spring() -> None:
    for torque in (1.0, 5.0, 12.0, 40.0, 90.0):
        assert answer(PIECES, twist_under(PIECES, torque))[0] == pytest.approx(torque, rel=1e-14)
