"""Command, current and loops: what is commanded arrives, limits hold, and a computed torque follows its model."""

import math

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque, SampledComputedTorque
from drivetrain.effects.control.encoder import Encoder
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene, joint_scene

MOTOR = Motor("m", 0.5, 0.03)
FRICTION = Friction(viscous=0.5)


def quintic(duration: float = 1.0, count: int = 11) -> Motion:
    """One radian from rest to rest, of fifth order: its samples hold all of it."""
    u = np.linspace(0.0, 1.0, count)
    q = u**3 * (10 - 15 * u + 6 * u**2)
    v = 30 * u**2 * (1 - u) ** 2 / duration
    a = 60 * u * (1 - u) * (1 - 2 * u) / duration**2
    return Motion("move", ("joint",), u * duration, q[:, None], v[:, None], a[:, None])


def test_command_between_samples_is_the_polynomial_itself() -> None:
    run = simulate(joint_scene(1.0, [CommandedMotion(quintic())], 1.2), interval=7e-3)
    u = np.minimum(run.time, 1.0)
    np.testing.assert_allclose(run["joint.command_position"], u**3 * (10 - 15 * u + 6 * u**2), atol=1e-14)
    np.testing.assert_allclose(run["joint.command_speed"], 30 * u**2 * (1 - u) ** 2, atol=1e-13)
    np.testing.assert_allclose(run["joint.command_acceleration"], 60 * u * (1 - u) * (1 - 2 * u), atol=1e-11)


def test_command_repeats_and_then_holds() -> None:
    back = quintic()
    run = simulate(joint_scene(1.0, [CommandedMotion(back, repetitions=2)], 2.5), interval=0.125)
    np.testing.assert_allclose(run["joint.command_position"][1:8], run["joint.command_position"][9:16], atol=1e-13)
    assert (run["joint.command_speed"][run.time >= 2.0] == 0.0).all()


@pytest.mark.parametrize("engine", [FixedStep(), AdaptiveStep()])
def test_a_command_that_ends_moving_moves_at_its_end_and_stands_after_it(engine: Engine) -> None:
    """The last row of a run is no row of the stop that would follow: that would take 1 rad/s x 2 A s/rad more."""
    time, one = np.array([0.0, 0.3, 0.7]), np.ones((3, 1))
    motion = CommandedMotion(Motion("m", ("joint",), time, time[:, None], one, 0.0 * one))
    effects = [motion, PositionLoop(0.0, 2.0, 1.0), MotorCurrent(Motor("m", 1.0, 1.0)), ViscousFriction(FRICTION)]
    run = simulate(joint_scene(1.0, effects, 0.7, speed=1.0), solver=engine, interval=0.1)
    assert run["joint.command_speed"] == pytest.approx(1.0, abs=1e-12) and run["joint.current"][-1] > 0.0
    after = simulate(joint_scene(1.0, effects, 1.0, speed=1.0), solver=engine, interval=0.1)
    assert after["joint.current"][:7] == pytest.approx(run["joint.current"][:7], abs=1e-12)
    assert (after["joint.command_speed"][after.time > 0.75] == 0.0).all()
    # Braked from v(0.7) by 2 + 0.5 N m s/rad.
    braked = run["joint.speed"][-1] * np.exp(-2.5 * 0.3)
    assert after["joint.speed"][-1] == pytest.approx(braked, rel=1e-5)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_voltage_limit_leads_to_the_speed_of_no_load(way: float) -> None:
    effects = [
        MotorCurrent(MOTOR, peak_current=30.0, voltage=12.0),
        FullRotor(1e-5),
        GivenCurrent([0.0], [way * 100.0]),
    ]
    run = simulate(joint_scene(0.0, effects, 0.5), interval=1e-3)
    assert np.abs(run["joint.current"]).max() <= 24.0 + 1e-12  # 12 V / 0.5 ohm, below the amplifier's
    assert np.abs(run["joint.voltage"]).max() <= 12.0 + 1e-12
    assert run["joint.speed"][-1] == pytest.approx(way * 400.0, rel=1e-6)
    # On its way as 1 - exp(-t kt^2 / (R J)); 5.6 ms. The slope of the limit is in the step: no ringing at 1 ms.
    rise = way * 400.0 * (1.0 - np.exp(-run.time * 0.03**2 / (0.5 * 1e-5)))
    np.testing.assert_allclose(run["joint.speed"], rise, atol=0.01 * 400.0)


def test_peak_current_holds() -> None:
    effects = [MotorCurrent(MOTOR, peak_current=5.0), GivenCurrent([0.0, 1.0], [-20.0, 20.0])]
    run = simulate(joint_scene(1.0, effects, 1.0))
    assert run["joint.current"].min() == -5.0 and run["joint.current"].max() == 5.0


def test_position_loop_is_a_spring_and_a_damper() -> None:
    hold = Motion("hold", ("joint",), np.array([0.0, 1.0]), np.full((2, 1), 0.2), np.zeros((2, 1)), np.zeros((2, 1)))
    loop = PositionLoop(100.0, 2.0, MOTOR.torque_constant)
    effects = [CommandedMotion(hold), loop, MotorCurrent(MOTOR), ReflectedRotor(1e-5, 100.0)]
    run = simulate(joint_scene(0.9, effects, 1.0, position=0.3), solver=FixedStep(1e-4))
    decay, swing = 1.0, math.sqrt(100.0 - 1.0)  # inertia 0.9 + 0.1
    exact = 0.2 + 0.1 * np.exp(-decay * run.time) * (
        np.cos(swing * run.time) + decay / swing * np.sin(swing * run.time)
    )
    np.testing.assert_allclose(run["joint.position"], exact, atol=2e-6)


def test_stiff_loop_does_not_ring_at_a_long_step() -> None:
    # A bandwidth of 1e5 rad/s at a step of a millisecond: an explicit loop would be gone at once.
    hold = Motion("hold", ("joint",), np.array([0.0, 1.0]), np.zeros((2, 1)), np.zeros((2, 1)), np.zeros((2, 1)))
    effects = [CommandedMotion(hold), PositionLoop(1e10, 2e5, MOTOR.torque_constant), MotorCurrent(MOTOR)]
    run = simulate(joint_scene(1.0, effects, 1.0, position=1e-3))
    assert np.abs(run["joint.position"]).max() <= 1.1e-3


def test_computed_torque_follows_a_model_that_is_true() -> None:
    arm = dt.with_rotors(dt.load_arm("ur5"), [dt.Rotor(100.0, 6e-5)] * 6)
    t = np.linspace(0.0, 1.0, 201)
    swing = np.array([0.6, 0.4, 0.5, 0.7, 0.6, 0.8])
    q = np.array([0.0, -1.2, 1.0, 0.3, 0.5, 0.0]) + swing * np.sin(3.0 * t[:, None])
    motion = Motion(
        "m", arm.joint_names, t, q, 3 * swing * np.cos(3.0 * t[:, None]), -9 * swing * np.sin(3.0 * t[:, None])
    )
    effects = {name: (MotorCurrent(Motor("m", 0.5, 0.1)),) for name in arm.joint_names}
    servo = ComputedTorque(30.0, tuple((name, 0.1) for name in arm.joint_names))
    run = simulate(Scene(arm, effects | {"scene": (CommandedMotion(motion), servo)}, 1.0), interval=0.05)
    for i, name in enumerate(arm.joint_names):
        np.testing.assert_allclose(run[f"{name}.position"], np.interp(run.time, t, q[:, i]), atol=5e-5)
        wanted = dt.drive_torques(arm, q[::10], motion.velocity[::10], motion.acceleration[::10]).motor[:, i]
        # At its very end the command holds still, and is told so.
        torque = run[f"{name}.current"][:-1] * 0.1
        np.testing.assert_allclose(torque, wanted[:-1], atol=2e-3 * np.abs(wanted).max() + 1e-4)


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_sampled_computed_torque_is_its_recursion(delay: int) -> None:
    """One inertia whose motor holds each sample's torque: places and speeds at the samples have a closed form."""
    inertia, ratio, kt, every, w, wanted = 0.8, -60.0, 0.05, 2e-3, 40.0, 0.3
    hold = Motion("hold", ("joint",), np.array([0.0, 1.0]), np.full((2, 1), wanted), np.zeros((2, 1)), np.zeros((2, 1)))
    effects = [FullRotor(2e-5, ratio), MotorCurrent(Motor("m", 0.5, kt)), Encoder()]
    servo = SampledComputedTorque(w, (("joint", kt),), every, delay)
    scene = joint_scene(inertia, [*effects, CommandedMotion(hold), servo], 0.2, position=0.1)
    run = simulate(scene, solver=AdaptiveStep(dt.Rodas5P(rtol=1e-9)), interval=every)
    q, v, before, waiting = 0.1, 0.0, 0.1, [0.0] * delay
    for k in range(len(run.time)):
        assert run["joint.position"][k] == pytest.approx(q, abs=1e-9)
        pull = w**2 * (wanted - q) - 2.0 * w * (q - before) / every
        before, waiting = q, [*waiting, pull]
        given = waiting.pop(0)
        q, v = q + v * every + given * every**2 / 2.0, v + given * every


def test_sampled_computed_torque_tends_to_the_continuous_one() -> None:
    arm = dt.with_rotors(dt.load_arm("planar-2r"), [dt.Rotor(100.0, 3e-5)] * 2)
    t = np.linspace(0.0, 0.5, 101)
    u, swing = t[:, None] / 0.5, np.array([0.6, -0.4])
    rise, speed, push = 10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u)
    motion = Motion("m", arm.joint_names, t, rise * swing, speed * swing / 0.5, push * swing / 0.25)
    constants = tuple((name, 0.1) for name in arm.joint_names)

    def off(servo: Effect) -> np.ndarray:
        joints = {name: (MotorCurrent(Motor("m", 0.5, 0.1)), Encoder()) for name in arm.joint_names}
        scene = Scene(arm, {**joints, "scene": (CommandedMotion(motion), servo)}, 0.5, position=(0.05, 0.0))
        run = simulate(scene, solver=FixedStep(2.5e-4), interval=0.025)
        return np.array([run[f"{name}.position"] for name in arm.joint_names])

    exact = off(ComputedTorque(30.0, constants))
    far, near = (np.abs(off(SampledComputedTorque(30.0, constants, h, 0)) - exact).max() for h in (4e-3, 1e-3))
    assert 0.0 < near < far / 3.0  # of first order: a quarter
    assert near < 2e-3


def test_feedback_on_an_arm_with_reflected_rotors_of_either_sign() -> None:
    hold = Motion("hold", ("joint",), np.array([0.0, 1.0]), np.full((2, 1), 0.2), np.zeros((2, 1)), np.zeros((2, 1)))
    ends = []
    for ratio in (50.0, -50.0):
        effects = [
            CommandedMotion(hold),
            PositionLoop(100.0, 20.0, MOTOR.torque_constant),
            MotorCurrent(MOTOR),
            FullRotor(1e-5, ratio),
            ViscousFriction(Friction(viscous=1e-3), "motor"),
        ]
        ends.append(simulate(joint_scene(0.9, effects, 1.0, position=0.3))["joint.position"])
    np.testing.assert_array_equal(ends[0], ends[1])


def test_bad_numbers_are_refused_where_they_are_given() -> None:
    with pytest.raises(InputError, match="stiffness"):
        PositionLoop(-1.0, 0.0, 0.1)
    with pytest.raises(InputError, match="peak_current"):
        MotorCurrent(MOTOR, 0.0)
    with pytest.raises(InputError, match="never decrease"):
        GivenCurrent([1.0, 0.0], [0.0, 0.0])
    with pytest.raises(InputError, match="says nothing of joint"):
        plan(joint_scene(1.0, [CommandedMotion(Motion("m", ("other",), np.arange(2.0), *[np.zeros((2, 1))] * 3))], 1.0))


@pytest.mark.parametrize("constants", [(0.1, 0.2), {"joint": 0.1}, (("joint",),), (("joint", "0.1"),)])
def test_torque_constants_are_pairs(constants: object) -> None:
    with pytest.raises(InputError, match="each a text with a number"):
        ComputedTorque(30.0, constants)  # type: ignore[arg-type]
