"""The adaptive engine: closed forms of dry friction, the limit of the fixed step, heat, resumption, refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop, SampledCascade
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.solvers.solver import DormandPrince853, Rodas4, Rodas5P

MOTOR = Motor(key="m", resistance=0.299, torque_constant=0.0302, inductance=82e-6)
STICKY = Friction(coulomb=1.0, static=1.5)


def instants(run: Recording, name: str) -> list[float]:
    return [event.time for event in run.events if event.name == name]


@pytest.mark.parametrize(("rtol", "within"), [(1e-4, 1e-5), (1e-6, 1e-7), (1e-9, 1e-10)])
def test_coulomb_oscillator_stops_where_and_when_it_must(rtol: float, within: float) -> None:
    # Five half cycles of amplitude falling by 2 Fc / k each: 0.103 - 5 * 0.02, on the other side; pi / w each.
    effects = [DryFriction(Friction(coulomb=1.0)), WallSpring(100.0)]
    run = simulate(joint_scene(1.0, effects, 3600.0, position=0.103), solver=Rodas4(rtol), interval=10.0)
    assert run["joint.position"][-1] == pytest.approx(-0.003, abs=within)
    turns = [event.time for event in run.events]
    np.testing.assert_allclose(turns, np.arange(1, 6) * math.pi / 10.0, atol=20.0 * within)
    assert [event.name for event in run.events] == ["reversal"] * 4 + ["stick"]
    assert (run["joint.speed"][1:] == 0.0).all()
    assert len(np.unique(run["joint.position"][1:])) == 1  # no creep in an hour
    assert run.counters["steps"] < 2000


@pytest.mark.parametrize("seed", range(24))
def test_stick_slip_with_any_stribeck_speed(seed: int) -> None:
    # Friction that falls within 1e-9 to 1e-5 rad/s lets the joint run away in no time; an L-stable method whose step is
    # longer than that holds it there, or throws it to 1e13 rad.
    rng = np.random.default_rng(seed)
    inertia, stiffness, speed, fall = 10.0 ** rng.uniform([-3, 0, -3, -9], [1, 4, 0, -5])
    coulomb = 10.0 ** rng.uniform(-2, 1)
    static = coulomb * rng.uniform(1.02, 2.5)
    period = 2.0 * math.pi * math.sqrt(inertia / stiffness) + 2.0 * (static - coulomb) / stiffness / speed
    duration = min(3.0 * period + static / stiffness / speed, 20.0)
    law = Friction(coulomb=coulomb, static=static, stribeck_speed=fall)
    scene = joint_scene(inertia, [DryFriction(law), WallSpring(stiffness, speed=speed)], duration)
    run = simulate(scene, solver=AdaptiveStep(most_steps=50_000), interval=duration / 100.0)
    assert run.stopped_by is None
    assert not [event for event in run.events if event.name == "energy"]
    # The wall pulls with no more than what holds, and the joint overshoots by no more than the spring then gives.
    stretch = run["joint.position"] - speed * run.time
    most = (2.0 * static - coulomb) / stiffness + speed * math.sqrt(inertia / stiffness)
    assert np.abs(stretch).max() < 1.01 * most


def test_a_step_budget_stops_a_run_that_can_go_on() -> None:
    scene = joint_scene(1.0, [WallSpring(100.0)], 10.0, position=0.1)
    whole = simulate(scene, solver=AdaptiveStep())
    first = simulate(scene, solver=AdaptiveStep(most_steps=100))
    assert first.stopped_by is not None and first.stopped_by.name == "budget"
    assert first.counters["steps"] == 100
    rest = simulate(scene, solver=AdaptiveStep(), resume=first)
    assert rest["joint.position"][-1] == whole["joint.position"][-1]
    with pytest.raises(InputError, match="most_steps"):
        AdaptiveStep(most_steps=0)


@pytest.mark.parametrize("belt", [False, True])
def test_stick_slip_has_its_period(belt: bool) -> None:
    """Pulled at v: slip about the kinetic level from a stretch of (Fs - Fk)/k, through rest again, then stick."""
    stiffness, pull, speed = 100.0, 0.5, 0.01
    w, stretch = math.sqrt(stiffness), pull / stiffness
    # In the frame of the pull it swings: x = stretch cos wt + v/w sin wt; it sticks when it moves as at its start.
    slip = (2.0 * math.pi - 2.0 * math.atan2(stretch * w, speed)) / w
    period = slip + 2.0 * stretch / speed
    spring = [WallSpring(stiffness), MovingBelt(speed)] if belt else [WallSpring(stiffness, speed=speed)]
    scene = joint_scene(1.0, [DryFriction(STICKY), *spring], 14.0, speed=speed if belt else 0.0)
    for rtol, within in ((1e-6, 1e-5), (1e-9, 1e-8)):
        run = simulate(scene, solver=Rodas4(rtol), interval=0.5)
        times = instants(run, "breakaway")
        assert len(times) == 10 and len(run.events) == 19
        assert np.diff(times).mean() == pytest.approx(period, rel=within)


def worm(efficiency: float, torque: float) -> Scene:
    gear = Gear("worm", 50.0, kind="spur", efficiency=efficiency)
    effects = [MeshLoss(gear), FullRotor(1e-3, 50.0), GivenTorque([0.0], [torque], "motor")]
    return joint_scene(Inertia(1.0, weight=10.0), effects, 1.0)


def test_a_locking_worm_lets_its_load_go() -> None:
    needed = (1 / 0.45 - 2.0) * 10.0 / 50.0
    freed = simulate(worm(0.45, -1.01 * needed), solver=Rodas4(1e-8))
    fixed = simulate(worm(0.45, -1.01 * needed), solver=FixedStep(1e-5))
    assert freed["joint.position"][-1] == pytest.approx(fixed["joint.position"][-1], rel=1e-5)
    assert freed["joint.position"][-1] < 0.0


def wave() -> CommandedMotion:
    time = np.linspace(0.0, 0.5, 51)
    columns = (
        0.5 * (1.0 - np.cos(2.0 * np.pi * time)),
        np.pi * np.sin(2.0 * np.pi * time),
        2.0 * np.pi**2 * np.cos(2.0 * np.pi * time),
    )
    return CommandedMotion(Motion("wave", ("joint",), time, *(column[:, np.newaxis] for column in columns)))


def lossy() -> Scene:
    gear, law = (
        Gear("g", -50.0, kind="spur", efficiency=0.7),
        Friction(coulomb=0.02, coulomb_negative=0.05, static=0.06),
    )
    push = GivenTorque([0.0, 0.2, 0.2, 0.6, 1.0], [0.0, 1.0, -0.4, 0.3, 0.0], "motor")
    return joint_scene(0.5, [MeshLoss(gear), FullRotor(3e-5, -50.0), DryFriction(law, "motor"), push], 1.0)


def springy() -> Scene:
    gear = Gear("hd", 100.0, kind="spur", efficiency=0.8, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4)
    parts = [FlexibleJoint(gear, 2.0), FullRotor(3e-5, 100.0), MeshLoss(gear)]
    parts += [DryFriction(Friction(coulomb=1.0, static=2.0)), DryFriction(Friction(coulomb=0.01, static=0.02), "motor")]
    push = GivenTorque([0.0, 0.1, 0.1, 0.4, 0.6], [0.3, 0.6, -0.2, 0.4, 0.0], "motor")
    return joint_scene(Inertia(1.0, weight=15.0), [*parts, push], 0.6)


def servo(*loop: Effect) -> Scene:
    drive = (ReflectedRotor(3.3e-5, 10.0), MotorCurrent(MOTOR), *loop)
    return Scene(Inertia(0.01), {"joint": drive, "scene": (wave(),)}, 0.4)


def slider(damping: float) -> Scene:
    home, screws = np.eye(4)[np.newaxis], np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
    arm = dt.Arm.from_screws(
        home, screws, [2.0], np.eye(3)[np.newaxis] * 1e-3, tip=np.eye(4), gravity=(0.0, 0.0, 0.0), joint_names=["joint"]
    )
    wall = TipContact((0.1, 0.0, 0.0), (-1.0, 0.0, 0.0), 5e4, damping)
    drag = ViscousFriction(Friction(viscous=40.0))
    return Scene(arm, {"joint": (GivenTorque([0.0], [50.0]), drag), "scene": (wall,)}, 0.5, speed=[1.0])


@pytest.mark.parametrize(
    ("scene", "step", "within"),
    [
        (lossy(), 2e-6, 2e-6),
        (springy(), 2e-6, 2e-6),
        (servo(CascadeLoop(20.0, 0.05, 0.02)), 1e-5, 1e-8),
        (servo(Encoder(), SampledCascade(20.0, 0.05, 0.02, every=1e-3, delay=1)), 1e-3, 1e-12),
        (slider(0.0), 1e-5, 1e-6),
        (slider(200.0), 1e-5, 1e-6),
    ],
    ids=["mesh and dry friction", "springs", "loops", "samples", "wall", "damped wall"],
)
def test_limit_of_the_fixed_step(scene: Scene, step: float, within: float) -> None:
    """Both engines solve the same equations by other means: they meet where steps are short and tolerances tight."""
    fixed = simulate(scene, solver=FixedStep(step))
    errors = []
    # The looser is so loose that its own error counts: of springs that of 1e-5 is 3e-7 to 1e-5, as rounding has it.
    for rtol in (1e-4, 1e-8):
        run = simulate(scene, solver=Rodas4(rtol))
        assert run.stopped_by is None
        np.testing.assert_allclose(run.time, fixed.time, atol=1e-12)
        errors.append(np.abs(run["joint.position"] - fixed["joint.position"]).max())
    assert errors[1] < within
    assert errors[1] <= 1.5 * errors[0] + 1e-12  # where the fixed step is the one that errs, both are its error


@pytest.mark.parametrize("scene", [lossy(), springy()], ids=["mesh", "springs"])
def test_ten_times_tighter_is_better_and_energy_is_kept(scene: Scene) -> None:
    best = simulate(scene, solver=Rodas4(1e-10))
    errors, audits = [], []
    for rtol in (1e-4, 1e-6, 1e-8):
        run = simulate(scene, solver=Rodas4(rtol))
        errors.append(np.abs(run["joint.position"] - best["joint.position"]).max())
        audits.append(np.abs(run["energy_error"]).max())
    assert all(later < 0.3 * before for before, later in pairwise(errors))
    assert audits[2] < 1e-6 * np.abs(best["joint.motor_speed"] * 1.0).max()


def test_heat_follows_the_losses_and_not_the_steps() -> None:
    network = ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0)
    scene = servo(CascadeLoop(20.0, 0.05, 0.02), WindingHeat(network, every=1e-3))
    fixed, ours = (simulate(scene, solver=solver) for solver in (FixedStep(1e-4), Rodas4(1e-7)))
    name = next(name for name in ours.series if name.endswith("winding_temperature"))
    assert np.ptp(ours[name]) > 1e-3
    np.testing.assert_allclose(ours[name], fixed[name], atol=5e-3 * np.ptp(ours[name]))


def test_stopped_run_goes_on_to_the_last_bit() -> None:
    scene = servo(Encoder(), SampledCascade(20.0, 0.05, 0.02, every=1e-4, delay=1), DryFriction(Friction(coulomb=0.05)))
    whole = simulate(scene, solver=Rodas4(1e-6))
    half = simulate(scene, solver=Rodas4(1e-6), duration=0.2)
    rest = simulate(scene, solver=Rodas4(1e-6), resume=half)
    assert half.stopped_by is None and rest.stopped_by is None
    joined = np.concatenate([half["joint.position"], rest["joint.position"]])
    np.testing.assert_array_equal(np.concatenate([half.time, rest.time]), whole.time)
    np.testing.assert_array_equal(joined, whole["joint.position"])
    with pytest.raises(InputError, match="another scene"):
        simulate(lossy(), solver=Rodas4(), resume=half)
    with pytest.raises(InputError, match="another scene"):
        simulate(scene, solver=Rodas4(), resume=simulate(scene, solver=FixedStep(1e-3), duration=0.2))


def test_solvers_that_do_not_run_compiled_are_refused() -> None:
    with pytest.raises(InputError, match="runs compiled"):
        simulate(lossy(), solver=AdaptiveStep(DormandPrince853()))


def test_progress_can_stop_it() -> None:
    scene = servo(Encoder(), SampledCascade(20.0, 0.05, 0.02, every=1e-5, delay=1))
    told: list[float] = []

    def stop(share: float) -> bool:
        told.append(share)
        return False

    part = simulate(scene, solver=Rodas4(1e-6), progress=stop)
    assert part.stopped_by is not None and part.stopped_by.name == "stopped" and len(told) == 1
    rest = simulate(scene, solver=Rodas4(1e-6), resume=part)
    whole = simulate(scene, solver=Rodas4(1e-6))
    joined = np.concatenate([part["joint.position"], rest["joint.position"]])
    np.testing.assert_array_equal(joined, whole["joint.position"])


def test_an_integrator_comes_to_rest_at_the_limit() -> None:
    """A lift by hardly more current than its load: the integrator would grow and fall back again at any instant."""
    still = np.zeros((2, 1))
    to_one = CommandedMotion(Motion("to one", ("joint",), np.array([0.0, 3.0]), still + 1.0, still, still))
    effects: list[Effect] = [
        MotorCurrent(Motor("m", 1.0, 1.0)), CascadeLoop(5.0, 2.0, 0.05, peak_current=11.0), to_one,
    ]  # fmt: skip
    scene = joint_scene(Inertia(1.0, 10.0), effects, 3.0, position=0.0)
    run = simulate(scene, solver=AdaptiveStep(dt.Rodas5P(1e-7)))
    assert run.stopped_by is None
    fixed = simulate(scene, solver=FixedStep(5e-5))
    np.testing.assert_allclose(run["joint.position"], fixed["joint.position"], atol=2e-3)


def quintic(reach: Any) -> Motion:
    """From rest to rest in half a second; acceleration begins as time does."""
    reach = np.atleast_1d(reach)
    u = np.linspace(0.0, 1.0, 101)
    ways = 10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - 3 * u + 2 * u**2)
    names = tuple(f"j{k}" for k in range(len(reach)))
    return Motion("move", names, 0.5 * u, *(np.outer(way, reach) / 0.5**k for k, way in enumerate(ways)))


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_a_mesh_without_load_or_friction_starts_from_rest(weight: float) -> None:
    """Under a loop whose command begins as the cube of time the first push is as small as numbers go, or rounding."""
    motor = Motor("m", 0.3, 0.03, inductance=8e-5)
    effects = [
        FullRotor(2e-5, 50.0), MeshLoss(Gear("g", 50.0, kind="spur", efficiency=0.8)), CurrentLoop(motor, 3000.0),
        CascadeLoop(20.0, 0.5, 0.02, 30.0), CommandedMotion(replace(quintic(1.0), joint_names=("joint",))),
    ]  # fmt: skip
    scene = joint_scene(Inertia(1.0, weight, 0.5 * math.pi), effects, 0.7)
    run, fixed = simulate(scene, solver=AdaptiveStep()), simulate(scene, solver=FixedStep(2e-5))
    assert run.stopped_by is None
    assert np.abs(run["joint.position"] - fixed["joint.position"]).max() < 2e-6


def test_wrists_in_balance_start_from_rest() -> None:
    """Meshes that carry nothing but rounding, behind springs, while others move their joints."""
    rng = np.random.default_rng(3)
    arm = dt.with_rotors(dt.load_arm("ur5"), [dt.Rotor(100.0, 3e-5)] * 6)
    start, motor = rng.uniform(-1.0, 1.0, 6), Motor("m", 0.3, 0.1, inductance=1e-4)
    moved = np.diag(dt.mass_matrix(arm, start))
    effects: dict[str, tuple[Effect, ...]] = {}
    for name, inertia in zip(arm.joint_names, moved, strict=True):
        gear = Gear("g", 100.0, kind="spur", efficiency=0.8, stiffness_1=inertia * 4e4)
        effects[name] = (
            CurrentLoop(motor, 3000.0), CascadeLoop(25.0, inertia * 0.1, 0.1), MeshLoss(gear),
            DryFriction(Friction(coulomb=1.0, static=1.3)), FlexibleJoint(gear, 2.0),
        )  # fmt: skip
    motion = quintic(rng.uniform(-1.0, 1.0, 6))
    motion = replace(motion, joint_names=arm.joint_names, position=start + motion.position)
    run = simulate(Scene(arm, effects | {"scene": (CommandedMotion(motion),)}, 0.1), solver=AdaptiveStep())
    assert run.stopped_by is None


@pytest.mark.parametrize(("seed", "tolerance"), [(7, 1e-8), (9, 1e-6), (23, 1e-8)])
def test_a_last_wrist_without_load_starts_from_rest(seed: int, tolerance: float) -> None:
    """Its mesh has no bound, and what pushes it at the start is rounding of other joints: one way, then the other."""
    rng, arm = np.random.default_rng(seed), dt.load_arm("ur5")
    start, motor = np.array([0.2, -1.2, 1.0, 0.3, 0.5, 0.1]), Motor("m", 0.3, 0.09, inductance=3e-4)
    effects: dict[str, tuple[Effect, ...]] = {}
    for name, inertia in zip(arm.joint_names, np.diag(dt.mass_matrix(arm, start)), strict=True):
        stiffness, whole = float(10 ** rng.uniform(3.0, 4.8)), float(inertia) + 0.5
        gear = Gear("g", 100.0, kind="spur", efficiency=0.6, stiffness_1=stiffness)
        effects[name] = (
            FullRotor(5e-5, 100.0), CurrentLoop(motor, 3000.0), PositionLoop(whole * 225.0, whole * 30.0, 0.09),
            MeshLoss(gear), FlexibleJoint(gear, 10.0 * math.sqrt(stiffness * inertia)),
        )  # fmt: skip
    motion = quintic(rng.uniform(-0.6, 0.6, 6))
    motion = replace(motion, joint_names=arm.joint_names, position=start + motion.position)
    scene = Scene(arm, effects | {"scene": (CommandedMotion(motion),)}, 1e-3)
    assert simulate(scene, solver=AdaptiveStep(Rodas5P(tolerance))).stopped_by is None


def test_a_run_that_ends_where_a_brake_releases_has_no_event_there() -> None:
    """The release belongs to what follows, as in a run that goes on."""
    held = HoldingBrake(holding=1.0, releases=(0.1,), engaged=True)
    effects = (ReflectedRotor(0.1, 1.0), held, DryFriction(Friction(coulomb=0.1)), GivenTorque([0.0, 1.0], [0.4, 0.5]))
    scene = Scene(Inertia(0.1), {"joint": effects}, 0.1)
    first = simulate(scene, solver=Rodas4(1e-6))
    assert first.events == ()
    run = simulate(scene, solver=Rodas4(1e-6), duration=0.2, resume=first)
    assert [(event.name, event.time) for event in run.events] == [("breakaway", 0.1)]
