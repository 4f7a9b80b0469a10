"""A gear's drag in motion and at rest, and its heat: against scipy, and against sizing by the same laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import drivetrain as dt
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import joint_scene
from drivetrain.simulation.study_scene import SceneOptions, scene_of
from drivetrain.solvers.solver import Rodas5P

RATED = 2000.0 * np.pi / 30.0  # rad/s, of the drag
GEAR = Gear(
    "g", 100.0, kind="strain_wave", mesh_efficiency=0.9, drag_torque=0.05, drag_speed=RATED, drag_speed_exponent=0.72,
    drag_temperature_1=0.0436, drag_temperature_2=0.00037, seal_drag_torque=0.01, starting_torque=0.04,
)  # fmt: skip
MOTOR = Motor("m", 0.4, 0.05, magnet_coefficient=0.0)
ENGINES = [FixedStep(1e-3), AdaptiveStep(Rodas5P(1e-7))]


def dragged(speed: float, temperature: float) -> float:
    """As the sheet's law is printed."""
    above = min(max(temperature, -10.0), 40.0) - 20.0
    return 0.05 * (abs(speed) / RATED) ** 0.72 * np.exp(-0.0436 * above + 0.00037 * above**2) + 0.01


@pytest.mark.parametrize("solver", ENGINES)
@pytest.mark.parametrize("temperature", [-10.0, 20.0, 35.0])
def test_a_gear_runs_down_by_its_drag(solver: Engine, temperature: float) -> None:
    """From 300 rad/s of the motor to where it stops, by the drag alone: scipy on the law as it is printed."""
    inertia = 3e-4 + 1.0 / 100.0**2
    effects = [FullRotor(3e-4, 100.0), GearDrag(GEAR, temperature)]
    run = simulate(joint_scene(1.0, effects, 4.0, speed=3.0), solver=solver, interval=0.05)

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [-dragged(y[0], temperature) / inertia]

    stops = solve_ivp(rates, (0.0, 10.0), [300.0], rtol=1e-10, atol=1e-10, events=lambda t, y: y[0] - 1e-6,
                      dense_output=True)  # fmt: skip
    end = float(stops.t_events[0][0])
    wanted = np.where(run.time < end, stops.sol(np.minimum(run.time, end))[0], 0.0)
    np.testing.assert_allclose(run["joint.motor_speed"], wanted, atol=0.02)
    moving = run.time < end - 0.01
    drag = np.array([dragged(speed, temperature) for speed in wanted[moving]])
    np.testing.assert_allclose(run["joint.gear_drag_power"][moving], drag * wanted[moving], atol=0.01)
    if end < 3.9:
        assert run["joint.speed"][-1] == 0.0


@pytest.mark.parametrize("solver", ENGINES)
def test_at_rest_it_holds_with_its_starting_torque(solver: Engine) -> None:
    """A current that rises until 0.04 N m start the motor: 0.8 A at 0.2 A/s."""
    ramp = GivenCurrent(np.array([0.0, 10.0]), np.array([0.0, 2.0]))
    effects = [FullRotor(3e-4, 100.0), MotorCurrent(MOTOR), ramp, GearDrag(GEAR)]
    run = simulate(joint_scene(1.0, effects, 5.0), solver=solver)
    (start,) = [event.time for event in run.events if event.name == "breakaway"]
    assert start == pytest.approx(4.0, abs=2e-3)
    assert (run["joint.speed"][run.time < 3.99] == 0.0).all()


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_its_loss_warms_the_housing_by_its_share(share: float) -> None:
    """Under a constant current, to the steady state: power into the housing against what runs off it."""
    network = ThermalNetwork(1.0, 2.0, 10.0, 60.0, 20.0)
    effects = [
        FullRotor(3e-4, 100.0), MotorCurrent(MOTOR), GivenCurrent([0.0], [4.0]), GearDrag(GEAR), MeshLoss(GEAR),
        WindingHeat(network, gear_heat=share), dt.ViscousFriction(dt.Friction(viscous=3.0)),
    ]  # fmt: skip
    run = simulate(joint_scene(1.0, effects, 1500.0), solver=Rodas5P(1e-6), interval=10.0)
    speed, housing = run["joint.motor_speed"][-1], run["joint.housing_temperature"][-1]
    winding = run["joint.winding_temperature"][-1]
    # The gear is as warm as the housing that it warms; else at the 20 C that were stated.
    drag = dragged(speed, housing if share > 0.0 else 20.0)
    assert speed > 100.0
    # Torque of the motor less drag, over mesh and ratio, against the load.
    load = 0.9 * (0.05 * 4.0 - drag) * 100.0
    assert load == pytest.approx(3.0 * speed / 100.0, rel=1e-5)
    gear = speed * (drag + 0.1 * (0.05 * 4.0 - drag))
    copper = 0.4 * (1.0 + 0.0039 * (winding - 25.0)) * 16.0
    assert (housing - 20.0) / 2.0 == pytest.approx(copper + share * gear, rel=1e-4)
    assert winding - housing == pytest.approx(copper, rel=1e-4)


def test_what_a_sheet_does_not_tell_is_refused() -> None:
    with pytest.raises(InputError, match="efficiency"):
        GearDrag(Gear("g", 100.0, kind="planetary"))
    with pytest.raises(InputError, match="temperature"):
        GearDrag(GEAR, float("inf"))
    with pytest.raises(InputError, match="gear_heat"):
        WindingHeat(ThermalNetwork(1.0, 2.0, 10.0, 100.0, 25.0), gear_heat=1.2)


STUDY = """
schema_version: 1
name: turning
motions: {turn: {table: load.csv}}
supply: {voltage: 48 V}
ambient: 20 degC
gear_temperature: 25 degC
gear_heat: 60 %
joints:
  axis:
    drive: {motor: MOTOR, gear: hd_CSG-17-100-2UH}
    load_inertia: 0.5 kg m^2
"""


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> dt.Evaluation:
    """An axis that lifts 15 N m for 2 s and lowers it for 2 s, at 12 rpm, on a gear with drag."""
    folder = tmp_path_factory.mktemp("turning")
    rows = ["time [s],torque_axis [N m],speed_axis [rpm]", "0,15,0", "0.2,15,12", "2,15,12", "2.4,15,-12", "4,15,-12"]
    (folder / "load.csv").write_text("\n".join([*rows, "4.2,15,0"]) + "\n", encoding="utf-8")
    (folder / "study.yaml").write_text(STUDY.replace("MOTOR", "maxon_614949"), encoding="utf-8")
    return dt.evaluate(dt.load_study(folder / "study.yaml"))


def test_sizing_and_simulation_take_the_same_torque_and_heat(turning: dt.Evaluation) -> None:
    """Lifting, lowering and turning round, without what the loops lag; then the periodic temperatures of the cycle."""
    joint, study = turning.joints["axis"], turning.study
    drives = {"axis": joint.drive}
    assert joint.drive.gear.drag_torque is not None
    run = simulate(scene_of(study, drives, options=SceneOptions(heat=False)), interval=0.01)
    series = joint.series
    sized = np.interp(run.time, series.time, series.motor_torque)
    speed, before = (np.interp(run.time - late, series.time, series.speed) for late in (0.0, 0.1))
    steady = (np.abs(np.abs(speed) - 12.0 * np.pi / 30.0) < 1e-6) & (np.abs(before - speed) < 1e-6)
    assert steady.sum() > 200
    np.testing.assert_allclose(run["axis.motor_torque"][steady], sized[steady], rtol=2e-3)
    lifting, lowering = sized[run.time < 1.0].max(), sized[run.time > 3.0].min()
    assert lifting > 1.3 * abs(lowering)
    assert series.winding_temperature is not None and series.housing_temperature is not None
    begun = (float(series.winding_temperature[0]), float(series.housing_temperature[0]))
    # Begun where sizing says that the cycle begins when it repeats for ever, it ends there too.
    cycles = 40
    scene = scene_of(study, drives, options=SceneOptions(repetitions=cycles))
    effects = [
        replace(one, winding=begun[0], housing=begun[1]) if isinstance(one, WindingHeat) else one
        for one in scene.effects["axis"]
    ]
    kept = simulate(replace(scene, effects={**scene.effects, "axis": tuple(effects)}), interval=0.1)
    rise = begun[1] - 20.0
    assert rise > 3.0
    assert kept["axis.housing_temperature"][-1] == pytest.approx(begun[1], abs=0.01 * rise)
    assert kept["axis.winding_temperature"][-1] == pytest.approx(begun[0], abs=0.03 * (begun[0] - 20.0))
