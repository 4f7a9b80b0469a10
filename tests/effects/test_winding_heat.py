"""Heat on its own clock: exact under constant loss, close under a duty cycle, and fed back to resistance and torque."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.motor.given import GivenCurrent, GivenVoltage
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.winding import Winding
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import joint_scene
from drivetrain.solvers.solver import Rodas5P

NETWORK = ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0)
STIFF = DryFriction(Friction(coulomb=10.0), "motor")  # the shaft is held, so that only copper is warmed


def held(motor: Motor, network: ThermalNetwork, current: object, duration: float, step: float = 0.01) -> object:
    effects = [STIFF, MotorCurrent(motor), WindingHeat(network), current]
    return simulate(joint_scene(1.0, effects, duration), solver=FixedStep(step), interval=duration / 50)


def test_constant_loss_is_exact_at_any_step() -> None:
    # Resistance that does not change: warmed about its own reference only by a thousandth of a kelvin.
    motor = Motor("m", 0.3, 0.03, reference_temperature=25.0)
    run = held(motor, NETWORK, GivenCurrent([0.0], [0.05]), 500.0, 0.05)
    loss = 0.3 * 0.05**2
    flow = np.array([[-1 / (21.8 * 1.9), 1 / (21.8 * 1.9)], [1 / (241 * 1.9), -1 / (241 * 1.9) - 1 / (241 * 4.65)]])
    end = np.linalg.solve(-flow, [loss / 21.8, 0.0])
    exact = np.array([25.0 + (np.eye(2) - expm(flow * t)) @ end for t in run.time])
    # At every instant that is recorded, though the slow clock goes by 0.2 s at a time; the loss grows
    # by 0.4 % a kelvin of the 5 mK by which the winding warms.
    np.testing.assert_allclose(run["joint.winding_temperature"], exact[:, 0], rtol=0.0, atol=2e-7)
    np.testing.assert_allclose(run["joint.housing_temperature"], exact[:, 1], rtol=0.0, atol=2e-7)


def test_recorded_temperatures_do_not_wait_for_the_slow_clock() -> None:
    motor = Motor("m", 0.3, 0.03, reference_temperature=25.0)
    effects = [STIFF, MotorCurrent(motor), GivenCurrent([0.0, 2.0], [0.0, 3.0])]
    runs = [
        simulate(joint_scene(1.0, [*effects, WindingHeat(NETWORK, every=every)], 2.0), interval=0.05)
        for every in (1.0, 1e-3)
    ]
    slow, fast = (run["joint.winding_temperature"] for run in runs)
    # Only what the mean of a growing loss hides: the curvature of the last second.
    np.testing.assert_allclose(slow, fast, rtol=0.0, atol=0.02 * (fast[-1] - 25.0))
    assert np.diff(slow).min() >= 0.0 and np.diff(slow)[5:].min() > 0.0
    # The mechanics do not see it: they take the temperature of the last step of the slow clock.
    sparse = simulate(joint_scene(1.0, [*effects, WindingHeat(NETWORK, every=1.0)], 2.0), interval=0.4)
    np.testing.assert_array_equal(sparse["joint.winding_temperature"], slow[::8])


def test_resistance_follows_the_winding() -> None:
    motor = Motor("m", 0.3, 0.03)
    run = held(motor, NETWORK, GivenCurrent([0.0], [4.0]), 20000.0, 0.2)
    # 0.3 (1 + 0.0039 dT) 16 A^2 6.55 K/W = dT
    rise = 0.3 * 16 * 6.55 / (1 - 0.0039 * 0.3 * 16 * 6.55)
    assert run["joint.winding_temperature"][-1] == pytest.approx(25.0 + rise, rel=1e-4)
    assert run["joint.voltage"][-1] == pytest.approx(4.0 * 0.3 * (1 + 0.0039 * rise), rel=1e-4)


def test_weaker_magnets_give_less_torque() -> None:
    motor = Motor("m", 0.3, 0.03, magnet_coefficient=-0.001)
    effects = [MotorCurrent(motor), WindingHeat(NETWORK, housing=85.0, winding=85.0), GivenCurrent([0.0], [1.0])]
    run = simulate(joint_scene(1.0, effects, 0.1))
    assert run["joint.acceleration"][0] == pytest.approx(0.03 * 0.94, rel=1e-12)


def test_three_hours_of_duty_against_the_exact_answer() -> None:
    # 12 A for 2 s of every 20 s, resistance constant: superposed exponentials, stepped exactly by matrix exponentials.
    motor = Motor("m", 0.3, 0.03, reference_temperature=25.0)
    cold = ThermalNetwork(1.9e-3, 4.65e-3, 21.8e3, 241.0e3, 25.0)  # the same time constants, a thousandth of the rise
    times = np.arange(0.0, 3 * 3600.0, 20.0)
    table = np.ravel([[t, t + 2.0, t + 2.0, t + 20.0] for t in times])
    amps = np.ravel([[12.0, 12.0, 0.0, 0.0] for _ in times])
    run = held(motor, cold, GivenCurrent(table, amps), 3 * 3600.0, 0.1)
    flow = np.array([[-1 / (21.8 * 1.9), 1 / (21.8 * 1.9)], [1 / (241 * 1.9), -1 / (241 * 1.9) - 1 / (241 * 4.65)]])
    end = np.linalg.solve(-flow, [0.3 * 144 / 21.8e3, 0.0])
    on, off, state = expm(flow * 2.0), expm(flow * 18.0), np.zeros(2)
    for _ in times:
        state = off @ (on @ state + (np.eye(2) - on) @ end)
    # Resistance rises by 0.02 %, the slow clock averages over 0.2 s.
    assert run["joint.winding_temperature"][-1] - 25.0 == pytest.approx(state[0], rel=5e-4)


def test_a_network_without_a_time_constant_is_refused() -> None:
    with pytest.raises(InputError, match="time constant"):
        WindingHeat(ThermalNetwork(1.9, 4.65, None, None, 25.0))


@pytest.mark.parametrize("interval", [10.0, 0.5])
def test_under_a_tolerance_heat_is_as_exact_as_asked(interval: float) -> None:
    """A current that more than doubles the loss as the winding warms: nothing but the heat moves."""
    motor, network = Motor("m", 0.3, 0.03, magnet_coefficient=0.0), ThermalNetwork(1.0, 2.0, 10.0, 100.0, 25.0)

    def rates(_: float, rise: np.ndarray) -> list[float]:
        flow = rise[0] - rise[1]
        return [(0.3 * (1.0 + 0.0039 * rise[0]) * 15.0**2 - flow) / 10.0, (flow - rise[1] / 2.0) / 100.0]

    errors = []
    for rtol in (1e-4, 1e-6, 1e-8):
        effects = [STIFF, MotorCurrent(motor), WindingHeat(network), GivenCurrent([0.0], [15.0])]
        run = simulate(joint_scene(1.0, effects, 300.0), solver=Rodas5P(rtol), interval=interval)
        known = solve_ivp(rates, (0.0, 300.0), [0.0, 0.0], method="Radau", rtol=1e-11, atol=1e-9, t_eval=run.time)
        errors.append(np.abs(run["joint.winding_temperature"] - 25.0 - known.y[0]).max())
    assert errors[0] < 0.05 and errors[1] < 2e-3 and errors[2] < 5e-5


def test_a_housing_that_warms_at_once_does_not_shake_the_current() -> None:
    """Drag warms the magnets by 90 K/s, while the winding alone is slow: against Radau on the equations written out."""
    motor = Motor("m", 0.03, 0.4, inductance=3e-6)
    network, drag = ThermalNetwork(3.0, 5.0, 10.0, 5.0, 25.0), 0.05
    effects = [
        GivenVoltage([0.0], [40.0]), Winding(motor), WindingHeat(network),
        ViscousFriction(Friction(viscous=drag), "motor"),
    ]  # fmt: skip
    run = simulate(joint_scene(0.5, effects, 1.0, speed=99.0), interval=2e-3)

    def rates(_: float, x: np.ndarray) -> list[float]:
        current, speed, winding, housing = x
        resistance, constant = 0.03 * (1.0 + 0.0039 * (winding - 25.0)), 0.4 * (1.0 - 0.001 * (housing - 25.0))
        flow = (winding - housing) / 3.0
        return [
            (40.0 - resistance * current - constant * speed) / 3e-6, (constant * current - drag * speed) / 0.5,
            (resistance * current**2 - flow) / 10.0, (flow + drag * speed**2 - (housing - 25.0) / 5.0) / 5.0,
        ]  # fmt: skip

    known = solve_ivp(rates, (0.0, 1.0), [0.0, 99.0, 25.0, 25.0], method="Radau", rtol=1e-9, t_eval=run.time)
    assert known.y[3, -1] > 100.0
    # In steps of 0.15 s the torque constant would fall by 1.4 % each: 18 A at once.
    late = run.time > 0.01
    assert np.abs(run["joint.current"] - known.y[0])[late].max() < 1.0
    for name, values in zip(("speed", "winding_temperature", "housing_temperature"), known.y[1:], strict=True):
        assert run[f"joint.{name}"][-1] == pytest.approx(values[-1], rel=3e-3)
