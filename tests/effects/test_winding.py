"""Winding and current loop in a scene: closed forms, scipy on the same equations, energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenCurrent, GivenVoltage
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply
from drivetrain.effects.motor.winding import Winding
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene

MOTOR = Motor(key="m", resistance=0.299, torque_constant=0.0302, inductance=82e-6, rotor_inertia=3.3e-5)
RATIO, LOAD, DRAG = 100.0, 0.05, 1.0  # [-], [kg m^2], [N m s/rad]
WHOLE = LOAD + RATIO**2 * 3.3e-5


def last(recording, name):
    return float(recording.series[name].values[-1])


def test_a_held_rotor_follows_the_exponential_exactly() -> None:
    """No step is too long: 20 ms steps for a time constant of 0.27 ms."""
    scene = joint_scene(Inertia(1e30), [ReflectedRotor(0.0, 1.0), Winding(MOTOR), GivenVoltage((0.0,), (6.0,))], 0.1)
    for step in (0.02, 1e-3, 1e-4):
        run = simulate(scene, solver=FixedStep(step), interval=step)
        expected = 6.0 / 0.299 * (1.0 - np.exp(-run.time * 0.299 / 82e-6))
        assert run.series["joint.current"].values == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_voltage_driven_against_scipy() -> None:
    effects = [ReflectedRotor(3.3e-5, RATIO), Winding(MOTOR), GivenVoltage((0.0,), (12.0,))]
    scene = joint_scene(Inertia(LOAD), [*effects, ViscousFriction(Friction(viscous=DRAG))], 0.1)

    def rates(_: float, y: np.ndarray) -> list[float]:
        current, speed = y
        voltage = 12.0 - 0.299 * current - 0.0302 * RATIO * speed
        return [voltage / 82e-6, (RATIO * 0.0302 * current - DRAG * speed) / WHOLE]

    expected = solve_ivp(rates, (0.0, 0.1), [0.0, 0.0], method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    exact = simulate(scene, solver=AdaptiveStep())
    assert last(exact, "joint.current") == pytest.approx(expected[0], rel=1e-4)
    assert last(exact, "joint.speed") == pytest.approx(expected[1], rel=1e-5)
    errors = []
    for step in (2e-3, 1e-3):
        run = simulate(scene, solver=FixedStep(step))
        errors.append(abs(last(run, "joint.speed") / expected[1] - 1.0))
        assert abs(run.series["energy_error"].values[-1]) < 1e-3 * last(run, "joint.electrical_energy")
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 3.0  # second order


def test_the_recorded_current_is_not_half_a_step_late() -> None:
    """Where the step is 40 of its time constants the current follows the speed at once, not that of the middle."""
    given = GivenVoltage((0.0, 0.2, 0.2, 0.4), (12.0, 12.0, -6.0, -6.0))
    effects = [ReflectedRotor(3.3e-5, RATIO), Winding(MOTOR), given]
    scene = joint_scene(Inertia(1.0, weight=5.0), [*effects, ViscousFriction(Friction(viscous=DRAG))], 0.4)
    fine = simulate(scene, solver=FixedStep(1e-5))
    errors = []
    for step in (1e-2, 5e-3):
        run = simulate(scene, solver=FixedStep(step))
        size = np.sqrt(np.square(fine["joint.current"]).mean())
        errors.append(np.sqrt(np.square(run["joint.current"] - fine["joint.current"]).mean()) / size)
        moved = run["joint.acceleration"][5] * (1.0 + 0.33)
        torque = RATIO * 0.0302 * run["joint.current"][5] - DRAG * run["joint.speed"][5]
        assert moved == pytest.approx(torque - 5.0 * math.cos(run["joint.position"][5]), rel=1e-9)
    assert errors[0] < 0.01  # 12 % and more with the state itself
    assert errors[1] < errors[0] / 2.5


def test_a_loop_moves_on_from_the_motion_that_was_found() -> None:
    """A stiff position loop through a current loop: of second order from steps on that are longer than its lag."""
    loop = CurrentLoop(MOTOR, 1250.0)
    still = np.zeros((2, 1))
    command = CommandedMotion(Motion("stays", ("joint",), np.array([0.0, 0.2]), still, still, still))
    effects = [ReflectedRotor(3.3e-5, RATIO), loop, PositionLoop(5000.0, 100.0, 0.0302)]
    scene = joint_scene(Inertia(0.01), [*effects, command], 0.2, position=0.3)
    fine = simulate(scene, solver=FixedStep(1e-5))["joint.current"]
    size = float(np.sqrt(np.square(fine).mean()))
    errors = [
        np.sqrt(np.square(simulate(scene, solver=FixedStep(step))["joint.current"] - fine).mean()) / size
        for step in (2e-3, 1e-3)
    ]
    assert errors[0] < 0.015 and errors[1] < errors[0] / 3.0


@pytest.mark.parametrize("fed_forward", [0.0, 0.5, 1.0])
def test_a_loop_faster_than_the_step_against_scipy(fed_forward: float) -> None:
    loop = CurrentLoop(MOTOR, 6283.0, fed_forward=fed_forward)
    given = GivenCurrent(np.array([0.0, 0.01, 0.01]), np.array([0.0, 0.0, 5.0]))
    effects = [ReflectedRotor(3.3e-5, RATIO), loop, given, ViscousFriction(Friction(viscous=DRAG))]
    scene = joint_scene(Inertia(LOAD), effects, 0.05)

    def rates(_: float, y: np.ndarray) -> list[float]:
        current, integral, speed = y
        emf, kp, ki = 0.0302 * RATIO * speed, 82e-6 * 6283.0, 0.299 * 6283.0
        voltage = kp * (5.0 - current) + integral + fed_forward * emf
        turning = (RATIO * 0.0302 * current - DRAG * speed) / WHOLE
        return [(voltage - 0.299 * current - emf) / 82e-6, ki * (5.0 - current), turning]

    expected = solve_ivp(rates, (0.0, 0.04), [0.0, 0.0, 0.0], method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    # The speed is held over a step, so a loop that does not know the back-emf lags less than it should.
    for step, share in ((1e-3, 1e-2), (1e-4, 5e-4)):
        run = simulate(scene, solver=FixedStep(step))
        assert last(run, "joint.current") == pytest.approx(expected[0], rel=share)
        assert last(run, "joint.speed") == pytest.approx(expected[2], rel=share)


@pytest.mark.parametrize("feels", [False, True])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_motor_at_its_voltage_speeds_up_as_scipy_says(way: float, feels: bool) -> None:
    """Its loop asks in vain, also where the motion feeds back: 11 ms to speed up, steps of 2 and 1 ms, second order."""
    far = Motion("far", ("joint",), np.array([0.0, 0.03]), np.full((2, 1), way * 1e3), *np.zeros((2, 2, 1)))
    place = (CommandedMotion(far), PositionLoop(0.1, 0.02, 0.0302))
    asked = place if feels else (GivenCurrent(np.array([0.0]), np.array([way * 100.0])),)
    effects = [ReflectedRotor(3.3e-5, 1.0), CurrentLoop(MOTOR, 6283.0), *asked, StiffSupply(12.0)]
    scene = joint_scene(Inertia(0.0), effects, 0.03, position=0.0, speed=0.0)

    def rates(_: float, y: np.ndarray) -> list[float]:
        current, speed = y
        return [(way * 12.0 - 0.299 * current - 0.0302 * speed) / 82e-6, 0.0302 * current / 3.3e-5]

    def fastest(step: float) -> np.ndarray:
        run = simulate(scene, solver=FixedStep(step), interval=2e-3)
        start = [float(run["joint.current"][0]), 0.0]
        exact = solve_ivp(rates, (0.0, 0.03), start, method="Radau", t_eval=run.time, rtol=1e-10, atol=1e-12).y[1]
        return np.abs(run["joint.speed"] - exact).max() / np.abs(exact).max()

    errors = [fastest(step) for step in (2e-3, 1e-3)]
    assert errors[0] < 4e-3 and errors[1] < errors[0] / 3.0


@pytest.mark.parametrize("step", [1e-2, 1e-3])
def test_copper_loss_of_a_voltage_on_and_off_is_exact_at_any_step(step: float) -> None:
    """0.1 s at 6 V, then at none, the shaft held: V/R (1 - exp(-t R/L)), and down again."""
    lag, level, on = 82e-6 / 0.299, 6.0 / 0.299, 0.1
    given = GivenVoltage((0.0, on, on, 0.2), (6.0, 6.0, 0.0, 0.0))
    scene = joint_scene(Inertia(1e30), [ReflectedRotor(0.0, 1.0), Winding(MOTOR), given], 0.2)
    run = simulate(scene, solver=FixedStep(step), interval=0.1)
    rising, falling = on - 2.0 * lag + 0.5 * lag, 0.5 * lag  # exp(-on/lag) is nothing
    assert last(run, "joint.copper_loss_energy") == pytest.approx(0.299 * level**2 * (rising + falling), rel=1e-9)
    assert last(run, "joint.electrical_energy") == pytest.approx(6.0 * level * (on - lag), rel=1e-9)


def test_without_inductance_it_is_the_quasi_static_motor() -> None:
    """Shrinking L and the loop's lag tends to the motor that follows at once."""
    given = GivenCurrent(np.array([0.0, 0.1]), np.array([0.0, 8.0]))
    plain = simulate(joint_scene(Inertia(LOAD), [ReflectedRotor(3.3e-5, RATIO), MotorCurrent(MOTOR), given], 0.1))
    apart = []
    for bandwidth in (1e3, 1e4, 1e5):
        effects = [ReflectedRotor(3.3e-5, RATIO), CurrentLoop(MOTOR, bandwidth), given]
        run = simulate(joint_scene(Inertia(LOAD), effects, 0.1))
        apart.append(abs(last(run, "joint.speed") - last(plain, "joint.speed")))
    assert apart[1] < 0.15 * apart[0]  # first order in the lag
    assert apart[2] < 0.15 * apart[1]


@pytest.mark.parametrize("engine", [FixedStep(), AdaptiveStep()])
@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("command, volts", [(4.0, 1e3), (30.0, 1e3), (30.0, 2.0)])
def test_the_loop_starts_without_a_layer(command: float, volts: float, way: float, engine: Engine) -> None:
    """At its command, at its peak, or at what the voltage leaves: the shaft turns on and on at 20 rad/s."""
    loop = CurrentLoop(MOTOR, 6283.0, peak_current=10.0, fed_forward=0.4)
    effects = [ReflectedRotor(0.0, 1.0), loop, GivenCurrent(np.array([0.0]), np.array([way * command]))]
    run = simulate(
        joint_scene(Inertia(1e12), [*effects, StiffSupply(volts)], 0.01, speed=20.0), solver=engine, interval=1e-3
    )
    room = (volts - way * 0.0302 * 20.0) / 0.299
    np.testing.assert_allclose(run["joint.current"], way * min(command, 10.0, room), rtol=1e-9)


def test_bad_parts_are_refused_together() -> None:
    bare = Motor(key="bare", resistance=1.0, torque_constant=0.1)
    with pytest.raises(InputError) as error:
        CurrentLoop(bare, -1.0, peak_current=math.nan)
    assert all(word in str(error.value) for word in ("inductance", "bandwidth", "peak_current"))
    with pytest.raises(InputError, match="MotorCurrent"):
        Winding(bare)


@pytest.mark.parametrize("bandwidth", [500.0, 6283.0])
@pytest.mark.parametrize("step", [1e-2, 1e-3])
def test_copper_loss_of_a_rectangular_command_is_exact_at_any_step(bandwidth: float, step: float) -> None:
    """0.1 s on, 0.3 s off, the shaft held; the current rises and falls as one exponential of the loop's bandwidth."""
    motor = Motor("m", 0.45, 0.03, inductance=1.3e-4, magnet_coefficient=0.0)
    cycles, on, level = 5, 0.1, 6.5
    starts = 0.2 + 0.4 * np.arange(cycles)[:, None]
    times = np.concatenate([[0.0], (starts + np.array([0.0, 0.0, on, on])).ravel()])
    given = GivenCurrent(times, np.concatenate([[0.0], np.tile([0.0, level, level, 0.0], cycles)]))
    held = DryFriction(Friction(coulomb=1e3))
    scene = joint_scene(1.0, [CurrentLoop(motor, bandwidth), given, StiffSupply(1e3), held], 0.4 * cycles + 0.2)
    run = simulate(scene, solver=FixedStep(step), interval=0.1)
    lag = 1.0 / bandwidth
    rising = on - 2.0 * lag * (1.0 - math.exp(-on / lag)) + 0.5 * lag * (1.0 - math.exp(-2.0 * on / lag))
    falling = 0.5 * lag * (1.0 - math.exp(-on / lag)) ** 2  # down to nothing before the next
    wanted = cycles * 0.45 * level**2 * (rising + falling)
    assert last(run, "joint.copper_loss_energy") == pytest.approx(wanted, rel=1e-9)
    # What the amplifier gives is told by voltage times current, the loss by the current alone: the audit compares.
    assert np.abs(run["energy_error"]).max() < 1e-9 * last(run, "joint.copper_loss_energy")
