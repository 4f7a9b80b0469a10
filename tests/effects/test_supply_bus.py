"""The bus: charge and energy are kept, the resistor caps it, two drives share what one feeds back."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import CascadeLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.supply_bus import StiffSupply, SupplyBus
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.solvers.solver import Rodas5P

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
    volts, drawn = capped["scene.bus_voltage"], capped["scene.delivered_power"]
    held, full = abs(volts - 48.0) < 1e-6, abs(volts - 56.0) < 1e-6
    assert min(held.sum(), full.sum(), (~held & ~full).sum()) > 10
    assert capped["scene.source_power"] == pytest.approx(np.where(held, np.maximum(drawn, 0.0), 0.0), abs=1e-9)
    assert capped["scene.brake_resistor_power"] == pytest.approx(np.where(full, -drawn, 0.0), abs=1e-9)


def test_at_the_threshold_the_resistor_burns_what_comes_back_in_either_engine() -> None:
    """Switched on and off it burns far less than the 630 W of being on all the time."""
    bus = SupplyBus(48.0, 0.002, threshold=56.0, resistance=5.0)
    fixed, adaptive = braking(bus, step=1e-4), braking(bus, adaptive=True)
    burnt = fixed.series["scene.brake_resistor_energy"].values[-1]
    # The adaptive engine's powers are read at instants and summed between them.
    assert adaptive.series["scene.brake_resistor_energy"].values[-1] == pytest.approx(burnt, rel=0.02)
    assert abs(adaptive.series["energy_error"].values).max() < 0.02 * burnt


@pytest.mark.parametrize("adaptive", [False, True])
def test_a_bus_of_microwatts_is_that_of_watts(adaptive: bool) -> None:
    """Currents, torques, inertia and capacity a ten-millionth, resistances ten million times: the same voltages."""
    runs = []
    for scale in (1.0, 1e-7):
        motor = Motor(key="m", resistance=0.5 / scale, torque_constant=0.1)
        given = GivenCurrent(np.array([0.0, 1.0, 1.0]), scale * np.array([-10.0, -10.0, 0.0]))
        bus = SupplyBus(48.0, 0.002 * scale, power=30.0 * scale, threshold=56.0, resistance=5.0 / scale)
        joint = (ReflectedRotor(0.0, 1.0), MotorCurrent(motor), given)
        scene = Scene(Inertia(0.01 * scale), {"joint": joint, "scene": (bus,)}, 1.2, speed=[100.0])
        runs.append(simulate(scene, solver=AdaptiveStep() if adaptive else FixedStep(1e-3), interval=0.01))
    assert runs[0]["scene.bus_voltage"].max() > 55.0
    assert runs[1]["scene.bus_voltage"] == pytest.approx(runs[0]["scene.bus_voltage"], rel=1e-4)


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


LOOP = Motor(key="m", resistance=0.299, torque_constant=0.0302, inductance=82e-6)
INERTIA, BANDWIDTH, COMMAND = 1.1e-4, 3000.0, 25.0
WEAK = SupplyBus(24.0, 2e-3, power=80.0, threshold=30.0, resistance=3.0)


def speeding(bus: SupplyBus, solver: Engine) -> Recording:
    """A motor brought up to speed under more current than the source can carry."""
    given = GivenCurrent(np.array([0.0, 0.02]), np.array([0.0, COMMAND]))
    joint = (ReflectedRotor(0.0, 1.0), CurrentLoop(LOOP, BANDWIDTH), given)
    return simulate(Scene(Inertia(INERTIA), {"joint": joint, "scene": (bus,)}, 0.15), solver=solver, interval=1e-3)


def written_out(times: np.ndarray) -> np.ndarray:
    """Speed, current, integrator and bus voltage of that, by the equations as one would write them down."""
    r, k, inductance = LOOP.resistance, LOOP.torque_constant, LOOP.inductance
    kp, ki = inductance * BANDWIDTH, r * BANDWIDTH

    def rates(t: float, y: np.ndarray) -> list[float]:
        speed, current, integral, volts = y
        error = min(t / 0.02, 1.0) * COMMAND - current
        asked = kp * error + integral + k * speed
        voltage = min(max(asked, -volts), volts)
        surplus = WEAK.power - voltage * current
        held = volts >= WEAK.voltage and surplus > 0.0
        return [
            k * current / INERTIA, (voltage - r * current - k * speed) / inductance,
            ki * error + (voltage - asked) * ki / kp, 0.0 if held else surplus / (WEAK.capacity * volts),
        ]  # fmt: skip

    found = solve_ivp(
        rates, (0.0, 0.15), [0.0, 0.0, 0.0, WEAK.voltage], method="Radau", rtol=1e-9, atol=1e-9, t_eval=times,
        max_step=2e-5,
    )  # fmt: skip
    return found.y


def test_a_bus_that_breaks_down_is_solved_with_the_currents() -> None:
    """80 W against 25 A: it sinks to a third within 30 ms, by time scales shorter than the default step."""
    fixed, fine = speeding(WEAK, FixedStep(1e-3)), speeding(WEAK, AdaptiveStep(Rodas5P(1e-7)))
    speed, current, _, volts = written_out(fixed.time)
    assert volts.min() < 15.0
    # Along the ramp a command held over each step tells the current half a step late: 0.3 A, and 0.06 V of the bus.
    for run, within, of_bus in ((fixed, 1e-3, 3e-3), (fine, 1e-5, 2e-5)):  # the bus is stiff: 100 times the tolerance
        assert np.abs(run["joint.speed"] - speed).max() < within * speed.max()
        assert np.abs(run["scene.bus_voltage"] - volts).max() < of_bus * volts.max()
    assert np.abs(fixed["joint.current"] - current).max() < 0.02 * COMMAND
    assert np.abs(fine["joint.current"] - current).max() < 1e-4 * COMMAND
    passed = np.ptp(fixed["joint.electrical_energy"])
    assert np.abs(fixed["energy_error"]).max() < 1e-6 * passed
    assert 0 < fixed.counters["substeps"] < 1000
    # What that is off by is said, with the step that holds it; one as short says nothing more.
    (told,) = (event for event in fixed.events if event.name == "bus")
    step = float(re.findall(r"a step of (\S+) s holds 0.1 %", told.detail)[0])
    finer = speeding(WEAK, FixedStep(step))
    assert np.abs(finer["scene.bus_voltage"] - written_out(finer.time)[3]).max() < 1e-3 * WEAK.voltage
    assert not [event for event in (*finer.events, *fine.events) if event.name == "bus"]


def test_a_quick_move_on_a_weak_supply_at_the_default_step() -> None:
    """Breakdown, current limit, energy fed back up to the chopper and through it, under a servo."""
    u = np.linspace(0.0, 1.0, 101)
    place = 2.0 * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
    speed, turn = 60.0 * u**2 * (1.0 - u) ** 2 / 0.25, 120.0 * u * (1.0 - 3.0 * u + 2.0 * u**2) / 0.25**2
    motion = Motion("move", ("joint",), 0.25 * u, place[:, None], speed[:, None], turn[:, None])
    effects = [
        FullRotor(3.3e-5, 100.0), CascadeLoop(20.0, 0.5, 0.02, 30.0), CurrentLoop(LOOP, BANDWIDTH, peak_current=30.0),
        CommandedMotion(motion), DryFriction(Friction(coulomb=0.01), "motor"), WEAK,
    ]  # fmt: skip
    scene = joint_scene(0.8, effects, 1.0)
    best = simulate(scene, solver=AdaptiveStep(Rodas5P(1e-9)))
    runs = {rtol: simulate(scene, solver=AdaptiveStep(Rodas5P(rtol))) for rtol in (1e-4, 1e-6)}
    runs |= {step: simulate(scene, solver=FixedStep(step)) for step in (1e-4, 1e-3)}
    assert best["scene.bus_voltage"].min() < 8.0 and best["scene.bus_voltage"].max() > 29.9
    for setting, within in ((1e-6, 1e-6), (1e-4, 1e-4), (1e-3, 1e-3)):
        run = runs[setting]
        assert np.abs(run["joint.position"] - best["joint.position"]).max() < 2.0 * within
        assert np.abs(run["energy_error"]).max() < 1e-4 * np.ptp(run["joint.electrical_energy"])
    # What a step is off by is said, and a step that holds it.
    (told,) = (event for event in runs[1e-3].events if event.name == "bus")
    held = simulate(scene, solver=FixedStep(float(re.findall(r"a step of (\S+) s holds 0.1 %", told.detail)[0])))
    close = simulate(scene, solver=AdaptiveStep(Rodas5P(1e-9)), interval=1e-4)
    volts = np.interp(held.time, close.time, close["scene.bus_voltage"])
    assert np.abs(held["scene.bus_voltage"] - volts).max() < 1e-3 * WEAK.voltage
    drawn = best["scene.source_energy"][-1]
    assert runs[1e-3]["scene.source_energy"][-1] == pytest.approx(drawn, rel=3e-3)
    # Tighter is better, of the voltage that the tolerance is of.
    off = [np.abs(runs[rtol]["scene.bus_voltage"] - best["scene.bus_voltage"]).max() for rtol in (1e-4, 1e-6)]
    assert off[1] < 0.1 * off[0] < 0.02


@pytest.mark.parametrize("solver", [FixedStep(1e-3), AdaptiveStep(Rodas5P(1e-6))])
def test_a_run_that_stops_while_the_bus_sinks_goes_on_as_if_it_had_not(solver: Engine) -> None:
    given = GivenCurrent(np.array([0.0, 0.02]), np.array([0.0, COMMAND]))
    joint = (ReflectedRotor(0.0, 1.0), CurrentLoop(LOOP, BANDWIDTH), given)
    scene = Scene(Inertia(INERTIA), {"joint": joint, "scene": (WEAK,)}, 0.05)
    whole = simulate(scene, solver=solver, interval=1e-3)
    half = simulate(scene, solver=solver, interval=1e-3, duration=0.018)
    rest = simulate(scene, solver=solver, interval=1e-3, resume=half)
    for name in ("scene.bus_voltage", "joint.current", "scene.source_energy"):
        joined = np.concatenate([half[name], rest[name][rest.time > half.time[-1] + 1e-9]])
        # An engine that controls its error ends a step where the run stops, which the whole run does not.
        exact = isinstance(solver, FixedStep)
        np.testing.assert_allclose(joined, whole[name], rtol=0.0 if exact else 1e-4, atol=0.0 if exact else 1e-4)


def test_time_scales_are_those_of_source_and_resistor() -> None:
    told = {one.name: one.seconds for _, one in plan(Scene(Inertia(1.0), {"scene": (WEAK,)}, 1.0)).time_scales}
    assert told == {"brake resistor": pytest.approx(6e-3), "source fills the bus": pytest.approx(7.2e-3)}
