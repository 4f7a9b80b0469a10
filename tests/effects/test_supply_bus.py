"""The bus: charge and energy are kept, the resistor caps it, two drives share what one feeds back."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.drive.motor import Motor
from drivetrain.effects.given_current import GivenCurrent
from drivetrain.effects.motor_current import MotorCurrent
from drivetrain.effects.rotor import ReflectedRotor
from drivetrain.effects.supply_bus import StiffSupply, SupplyBus
from drivetrain.errors import InputError
from drivetrain.simulation.adaptive_step import AdaptiveStep
from drivetrain.simulation.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene

MOTOR = Motor(key="m", resistance=0.5, torque_constant=0.1)


def braking(bus: SupplyBus, *, step: float = 1e-3, adaptive: bool = False):
    """A rotor of 50 J brought from 100 rad/s to rest in a second, its motor feeding back."""
    given = GivenCurrent(np.array([0.0, 1.0, 1.0]), np.array([-10.0, -10.0, 0.0]))
    joint = (ReflectedRotor(0.0, 1.0), MotorCurrent(MOTOR), given)
    scene = Scene(Inertia(0.01), {"joint": joint, "scene": (bus,)}, 1.2, speed=[100.0])
    return simulate(scene, solver=AdaptiveStep() if adaptive else FixedStep(step), interval=0.01)


def test_what_is_fed_back_is_in_the_capacitor() -> None:
    run = braking(SupplyBus(48.0, 0.02))
    # 50 J less 10^2 0.5 W for a second: the last third of the braking takes from the bus again, nothing is left over.
    volts = run.series["scene.bus_voltage"].values
    energy = 0.01 * (volts**2 - 48.0**2)
    drawn = run.series["joint.electrical_energy"].values
    fed = run.series["scene.source_energy"].values
    assert energy == pytest.approx(fed - drawn, abs=1e-9)
    assert volts.max() > 50.0
    assert volts.min() == pytest.approx(48.0, abs=1e-9)
    assert abs(run.series["energy_error"].values).max() < 1e-3


def test_the_resistor_caps_the_voltage_and_burns_the_rest() -> None:
    free = braking(SupplyBus(48.0, 0.002))
    capped = braking(SupplyBus(48.0, 0.002, threshold=56.0, resistance=10.0))
    assert free.series["scene.bus_voltage"].values.max() > 80.0
    assert capped.series["scene.bus_voltage"].values.max() == pytest.approx(56.0, abs=0.01)
    assert capped.series["scene.brake_resistor_energy"].values[-1] > 5.0
    assert abs(capped.series["energy_error"].values).max() < 1e-3


def test_at_the_threshold_the_resistor_burns_what_comes_back_in_either_engine() -> None:
    """Switched on and off it burns far less than the 630 W of being on all the time."""
    bus = SupplyBus(48.0, 0.002, threshold=56.0, resistance=5.0)
    fixed, adaptive = braking(bus, step=1e-4), braking(bus, adaptive=True)
    burnt = fixed.series["scene.brake_resistor_energy"].values[-1]
    # The adaptive engine's powers are read at instants and summed between them.
    assert adaptive.series["scene.brake_resistor_energy"].values[-1] == pytest.approx(burnt, rel=0.02)
    assert abs(adaptive.series["energy_error"].values).max() < 0.02 * burnt


def test_a_weak_source_lets_the_bus_sink() -> None:
    given = GivenCurrent(np.array([0.0]), np.array([20.0]))
    joint = (ReflectedRotor(0.0, 1.0), MotorCurrent(MOTOR), given)
    bus = SupplyBus(48.0, 0.01, power=100.0)
    run = simulate(Scene(Inertia(0.01), {"joint": joint, "scene": (bus,)}, 0.5), interval=0.01)
    volts = run.series["scene.bus_voltage"].values
    assert volts[-1] < 47.0
    # The motor's voltage never exceeds what the bus has.
    assert (run.series["joint.voltage"].values <= volts + 1e-9).all()
    assert run.series["scene.source_power"].values.max() <= 100.0 + 1e-9


def test_a_stiff_supply_is_a_bus_of_endless_capacity() -> None:
    given = GivenCurrent(np.array([0.0]), np.array([200.0]))
    ends = []
    for supply in (StiffSupply(24.0), SupplyBus(24.0, 1e9)):
        joint = (ReflectedRotor(0.0, 1.0), MotorCurrent(MOTOR), given)
        run = simulate(Scene(Inertia(0.01), {"joint": joint, "scene": (supply,)}, 0.2))
        ends.append(run.series["joint.speed"].values[-1])
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    assert ends[0] < 240.0


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        SupplyBus(-48.0, 0.0, power=0.0, threshold=-50.0, resistance=0.0)
    assert len(error.value.faults) == 5
    with pytest.raises(InputError, match="needed with a threshold"):
        SupplyBus(48.0, 0.01, threshold=56.0)
