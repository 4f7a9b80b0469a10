"""The fixed implicit step with set-valued friction, against closed forms and references of tight tolerance."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.moving_belt import MovingBelt
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene


def test_order_two_without_friction_against_a_solver_of_order_eight() -> None:
    arm = dt.with_rotors(dt.load_arm("ur5"), [dt.Rotor(100.0, 6e-5)] * 6)
    q0, tau = np.array([0.1, -1.2, 1.0, 0.3, 0.5, 0.2]), np.array([10.0, -40.0, 20.0, 2.0, -1.0, 0.5])
    scene = Scene(arm, {n: (GivenTorque([0.0], [t]),) for n, t in zip(arm.joint_names, tau, strict=True)}, 0.5, q0)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[6:], dt.forward_dynamics(arm, y[:6], y[6:], tau)])

    exact = solve_ivp(rates, (0.0, 0.5), np.concatenate([q0, np.zeros(6)]), "DOP853", rtol=1e-11, atol=1e-11).y[:6, -1]
    errors = []
    for step in (2e-3, 1e-3, 5e-4):
        run = simulate(scene, solver=FixedStep(step))
        errors.append(max(abs(run[f"{n}.position"][-1] - x) for n, x in zip(arm.joint_names, exact, strict=True)))
    assert errors[1] < 1e-5
    for coarse, fine in itertools.pairwise(errors):
        assert coarse / fine == pytest.approx(4.0, rel=0.05)


def flexible(stiffness: float, duration: float = 0.2, damping: float = 0.0, **motion: float) -> Scene:
    gear = Gear("spring", 100.0, stiffness_1=stiffness)
    return joint_scene(Inertia(1.2), [FlexibleJoint(gear, damping), FullRotor(3e-5, 100.0)], duration, **motion)


def test_flexible_joint_swings_at_its_frequency_and_keeps_its_energy() -> None:
    link, rotor, stiffness = 1.2, 0.3, 2e4
    frequency = math.sqrt(stiffness * (1 / link + 1 / rotor)) / (2 * math.pi)
    run = simulate(flexible(stiffness, 2.0, speed=0.0), solver=FixedStep(1e-5), interval=1e-4)
    assert (run["joint.deflection"] == 0.0).all()
    pushed = [FlexibleJoint(Gear("s", 100.0, stiffness_1=stiffness)), FullRotor(3e-5, 100.0)]
    pushed.append(GivenTorque([0.0, 0.0, 1e-3, 1e-3, 1.0], [0.0, 100.0, 100.0, 0.0, 0.0]))
    run = simulate(joint_scene(link, pushed, 1.0), solver=FixedStep(2e-5), interval=2e-5)
    twist = run["joint.deflection"]
    crossings = run.time[1:][(twist[:-1] < 0.0) & (twist[1:] >= 0.0)]
    assert 1.0 / np.diff(crossings).mean() == pytest.approx(frequency, rel=1e-3)
    # After a jump a step is damped on purpose; from then on nothing is lost.
    free = run["energy_error"][run.time > 2e-3]
    assert np.ptp(free) < 1e-9 * run["stored_energy"].max()


@pytest.mark.parametrize("stiffness", [1e4, 1e6, 1e9])
def test_stiff_springs_stay_finite_at_a_millisecond(stiffness: float) -> None:
    effects = [
        FlexibleJoint(Gear("s", 100.0, stiffness_1=stiffness)),
        FullRotor(1e-6, 100.0),
        GivenTorque([0.0, 0.5, 0.5, 1.0], [5.0, 5.0, -5.0, -5.0]),
    ]
    run = simulate(joint_scene(Inertia(0.3, weight=2.0), effects, 1.0))
    # An undamped A-stable step rings but does not grow: the link goes as the rigid one does.
    rigid = simulate(joint_scene(Inertia(0.3, weight=2.0), [FullRotor(1e-6, 100.0), effects[2]], 1.0))
    # The one step after a jump that calms the spring is of first order: 1/2 34 rad/s^2 (1 ms)^2.
    np.testing.assert_allclose(run["joint.position"], rigid["joint.position"], atol=60.0 / stiffness + 2e-5)


def test_spring_in_three_pieces_starts_in_balance() -> None:
    gear = Gear("hd", 100.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4, torque_2=15.0, stiffness_3=3e4)
    effects = [FlexibleJoint(gear), FullRotor(3e-5, 100.0), DryFriction(Friction(coulomb=1.0), "motor")]
    run = simulate(joint_scene(Inertia(1.0, weight=25.0), effects, 0.1))
    # 5/1e4 + 10/2e4 + 10/3e4
    np.testing.assert_allclose(run["joint.deflection"], 5e-4 + 5e-4 + 10.0 / 3e4, rtol=1e-9)
    np.testing.assert_allclose(run["joint.position"], 0.0, atol=1e-15)


def worm(efficiency: float, torque: float, inertia: float = 3e-5, weight: float = 10.0) -> Scene:
    gear = Gear("worm", 50.0, kind="spur", efficiency=efficiency)
    effects = [MeshLoss(gear), FullRotor(inertia, 50.0), GivenTorque([0.0], [torque], "motor")]
    return joint_scene(Inertia(1.0, weight=weight), effects, 1.0)


def test_a_wall_and_a_belt_that_move_do_what_is_done_by_hand() -> None:
    """Taken along at the wall's own speed nothing pulls; a belt under a joint that a spring holds does w tau_c."""
    along = simulate(joint_scene(1.0, [WallSpring(100.0, 4.0, speed=0.2)], 1.0, speed=0.2), solver=FixedStep(1e-3))
    np.testing.assert_allclose(along["joint.position"], 0.2 * along.time, atol=1e-12)
    effects = [DryFriction(Friction(coulomb=1.0)), WallSpring(100.0), MovingBelt(0.5)]
    held = simulate(joint_scene(1.0, effects, 0.1, position=0.01), solver=FixedStep(1e-3))
    assert held["joint.position"] == pytest.approx(0.01, abs=1e-9)  # tau_c / k: it stays, and the belt slides
    assert held["joint.belt_power"][1:] == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize(("torque", "lifts"), [(0.26, True), (0.24, False)])
def test_starting_against_the_mesh_takes_the_loss_of_driving(torque: float, lifts: bool) -> None:
    # 10 N m over 50, through eta = 0.8: 0.25 N m.
    run = simulate(worm(0.8, torque))
    assert bool(run["joint.speed"][-1] > 0.0) is lifts
    assert lifts or (run["joint.position"] == 0.0).all()


@pytest.mark.parametrize("efficiency", [0.8, 0.95])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_acceleration_with_mesh_loss_in_both_directions_of_power(efficiency: float, way: float) -> None:
    # Driving: N = I a + r, motor: J a + N (1 + mu) = tau G. Driven back: N (1 - mu).
    mu, inertia, rotor, load = 1 / efficiency - 1, 1.0, 0.075, 10.0
    torque = 0.5 if way > 0.0 else 0.05
    factor = 1 + mu if way > 0.0 else 1 - mu
    expected = (torque * 50.0 - factor * load) / (rotor + factor * inertia)
    gear = Gear("g", 50.0, kind="spur", efficiency=efficiency)
    effects = [
        MeshLoss(gear),
        FullRotor(3e-5, 50.0),
        GivenTorque([0.0], [torque], "motor"),
        GivenTorque([0.0], [-load]),
    ]
    run = simulate(joint_scene(Inertia(inertia), effects, 0.1))
    assert run["joint.acceleration"][-1] == pytest.approx(expected, rel=1e-9)
    assert run["joint.speed"][-1] == pytest.approx(0.1 * expected, rel=1e-9)


def test_mirrored_motion_has_mirrored_losses() -> None:
    gear, law = (
        Gear("g", -50.0, kind="spur", efficiency=0.7),
        Friction(coulomb=0.02, coulomb_negative=0.05, static=0.06),
    )
    mirror = Friction(coulomb=0.05, coulomb_negative=0.02, static=0.06)
    table = np.array([0.0, 0.2, 0.2, 0.6, 1.0]), np.array([0.0, 1.0, -0.4, 0.3, 0.0])
    ends = []
    for sign, friction in ((1.0, law), (-1.0, mirror)):
        effects = [
            MeshLoss(gear),
            FullRotor(3e-5, -50.0),
            DryFriction(friction, "motor"),
            GivenTorque(table[0], sign * table[1], "motor"),
        ]
        ends.append(simulate(joint_scene(0.5, effects, 1.0))["joint.position"])
    np.testing.assert_array_equal(ends[0], -ends[1])


def test_an_arm_without_power_holds_itself_for_ever() -> None:
    arm = dt.load_arm("ur5")
    pose = np.array([0.3, -0.9, 1.1, 0.2, 0.5, 0.1])
    gravity = np.abs(dt.gravity_torque(arm, pose))
    # Friction a little above what gravity asks, in every joint at once; loss of the mesh helps the first.
    effects = {
        name: (DryFriction(Friction(coulomb=0.5 * g + 0.01, static=1.02 * g + 0.02)), FullRotor(6e-5, 100.0))
        for name, g in zip(arm.joint_names, gravity, strict=True)
    }
    run = simulate(Scene(arm, effects, 100.0, pose), interval=10.0)
    assert run.counters["steps"] == 100_000
    for i, name in enumerate(arm.joint_names):
        assert (run[f"{name}.position"] == pose[i]).all()
        assert (run[f"{name}.speed"] == 0.0).all()


def test_an_arm_with_a_sliding_joint_falls_as_it_must() -> None:
    home = np.tile(np.eye(4), (2, 1, 1))
    home[1, 0, 3] = 0.3
    screws = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0]], dtype=float)
    arm = dt.Arm.from_screws(home, screws, [2.0, 1.0], np.tile(0.01 * np.eye(3), (2, 1, 1)), gravity=(0.0, -9.81, 0.0))
    effects = {"joint_2": (WallSpring(200.0, 3.0), FullRotor(1e-5, 300.0))}
    run = simulate(Scene(arm, effects, 0.5), solver=FixedStep(2e-4))
    assert run.unit("joint_2.position") == "m" and run.unit("joint_2.joint_torque") == "N"
    geared = dt.with_rotors(arm, [None, dt.Rotor(300.0, 1e-5)])

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[2:], dt.forward_dynamics(geared, y[:2], y[2:], [0.0, -200.0 * y[1] - 3.0 * y[3]])])

    exact = solve_ivp(rates, (0.0, 0.5), np.zeros(4), "DOP853", rtol=1e-10, atol=1e-10).y[:, -1]
    found = [run[f"joint_{i}.{what}"][-1] for what in ("position", "speed") for i in (1, 2)]
    np.testing.assert_allclose(found, exact, atol=2e-5 * np.abs(exact).max())


def test_a_spring_far_from_home_has_no_noise() -> None:
    # As a difference of two angles of 1e6 rad the twist would be good to 1e-10 rad, which is 1e-4 N m here.
    twists = []
    for position in (0.0, 1e6):
        effects = [
            FlexibleJoint(Gear("s", 100.0, stiffness_1=1e6), 10.0),
            FullRotor(1e-5, 100.0),
            GivenTorque([0.0, 0.1, 0.2], [0.0, 1.0, -1.0], "motor"),
        ]
        twists.append(simulate(joint_scene(0.5, effects, 0.2, position=position))["joint.deflection"])
    np.testing.assert_allclose(twists[1], twists[0], rtol=0.0, atol=1e-9 * np.abs(twists[0]).max())
