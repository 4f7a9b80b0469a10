"""The FMU of a drive, run by fmpy, against our simulation and against equations of motion and heat in this test."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest
from export.driven_arms import coupled, ur5
from scipy.integrate import solve_ivp

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import differential, placed, with_coupling
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.drive import drive_inertia
from drivetrain.drive.friction import Friction
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.export.fmu import axis_of, read_axis, write_fmu
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene
from drivetrain.simulation.study_scene import drive_effects, surroundings
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.model import DriveMass

STEP, END = 0.01, 1.5  # [s] communication step and end of the run
VISCOUS, OUTSIDE = 2e-6, Friction(coulomb=0.2, viscous=0.05)


@pytest.fixture(scope="module")
def found(make):
    """Two joints at a high supply voltage, with heat, friction and counterbalances."""
    motor = replace(make.motor, coulomb_friction=0.008, viscous_friction=VISCOUS, no_load_current=None)
    tasks = tuple(
        make.task(name, friction=OUTSIDE, amplifier=Amplifier(peak_current=40.0), gear_heat=0.5)
        for name in ("j1", "j2")
    )
    tasks = (replace(tasks[0], counterbalances=(Counterbalance(torque=1.5),)), tasks[1])
    arm = make.planar_arm([0.3, 0.3], [1.5, 1.0])
    catalog = Catalog({"m1": motor}, {"g1": make.gear})
    return evaluate(make.study(make.sines(2), arm=arm, joints=tasks, supply=Supply(300.0), catalog=catalog))


@pytest.fixture(scope="module")
def file(found, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("fmu") / "deep" / "j1.fmu"
    notes = write_fmu(found, path, joint="j1")
    assert any("springs" in note for note in notes)
    return path


def given(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Current and load at the communication points: the axis drives, is driven by its load, and reverses."""
    return 12.0 * np.sin(4.0 * t) + 6.0 * np.cos(9.0 * t), 8.0 * np.cos(5.0 * t)


@pytest.fixture(scope="module")
def recorded(file: Path):
    t = np.arange(0.0, END + 0.5 * STEP, STEP)
    inputs = np.array(
        list(zip(t, *given(t), strict=True)),
        dtype=[("time", float), ("current_command", float), ("load_torque", float)],
    )
    return fmpy.simulate_fmu(
        str(file), stop_time=END, output_interval=STEP, input=inputs,
        fmi_call_logger=None, start_values={"start_speed": 0.5},
    )  # fmt: skip


def test_the_file_follows_the_standard(file: Path, found) -> None:
    """Checked with fmpy's rules and schema; parameters are the values of the rows with their units."""
    assert fmpy.validation.validate_fmu(str(file)) == []
    described = {one.name: one for one in fmpy.read_model_description(str(file)).modelVariables}
    motor, gear = found.joints["j1"].drive.motor, found.joints["j1"].drive.gear
    for name, value, unit in (
        ("motor.resistance", motor.resistance, "ohm"), ("motor.rotor_inertia", motor.rotor_inertia, "kg m^2"),
        ("gear.efficiency", gear.efficiency, None), ("motor.torque_constant", motor.torque_constant, "N m/A"),
    ):  # fmt: skip
        assert (float(described[name].start), described[name].unit) == (value, unit)
    # Point masses at the ends of both links, the second drive at its joint, 1e-4 kg m^2 per link about its centre.
    other, q = found.joints["j2"].drive, found.study.cycle.position[0, 1]
    mass = (1.5 + other.motor.mass + other.gear.mass) * 0.3**2 + 1.0 * 0.3**2 * (2.0 + 2.0 * np.cos(q)) + 2e-4
    assert float(described["load_inertia"].start) == pytest.approx(mass, rel=1e-3)  # the rotor of the second drive


def test_it_is_our_simulation(found, recorded) -> None:
    """A scene built in this test, with the inputs as step functions, in a single run."""
    task, drive = found.study.joints[0], found.joints["j1"].drive
    axis = axis_of(found, "j1")
    t = np.arange(0.0, END + 0.5 * STEP, STEP)
    stairs = np.repeat(t, 2)[1:-1]
    held = [np.repeat(values[:-1], 2) for values in given(t)]
    effects = [
        *drive_effects(task, drive, surroundings(found.study)), ReflectedRotor(drive_inertia(drive), drive.gear.ratio),
        GivenCurrent(stairs, held[0]), GivenTorque(stairs, held[1]),
    ]  # fmt: skip
    scene = joint_scene(Inertia(axis.load_inertia), effects, END, position=axis.position, speed=0.5)
    run = simulate(scene, solver=FixedStep(1e-3), interval=STEP)
    for ours in ("position", "speed", "winding_temperature", "housing_temperature"):
        np.testing.assert_allclose(recorded[ours], run[f"joint.{ours}"], rtol=1e-9, atol=1e-9)


def test_it_follows_the_equations(found, recorded) -> None:
    """Rotor, mesh loss by direction, friction on both sides and two thermal nodes, by scipy between steps of inputs."""
    axis, size = axis_of(found, "j1"), 50.0
    motor, inertia = axis.motor, axis.load_inertia
    rotor = motor.rotor_inertia + axis.gear.inertia
    back = 2.0 - 1.0 / 0.8
    capacities = 20.0 / 1.0, 800.0 / 4.0  # time constants over thermal resistances [J/K]

    def rates(t: float, y: np.ndarray, current: float, load: float) -> list[float]:
        _, speed, winding, housing = y
        constant = motor.torque_constant * (1.0 - 0.001 * (housing - 25.0))
        shaft = np.sign(speed) * 0.008 + VISCOUS * size * speed
        given_torque = constant * current - shaft  # at the motor's shaft, for rotor and mesh
        outside = load + 1.5 - np.sign(speed) * 0.2 - 0.05 * speed
        for share, driving in ((1.0 / 0.8, True), (back, False)):  # torque at the shaft over torque behind the mesh
            acceleration = (size * given_torque + share * outside) / (inertia * share + size**2 * rotor)
            mesh = inertia * acceleration - outside
            if bool(mesh * speed >= 0.0) is driving:
                break
        lost = abs(mesh * speed) * (share - 1.0 if driving else 1.0 - share)
        copper = motor.resistance * (1.0 + 0.0039 * (winding - 25.0)) * current**2
        inner, outer = (winding - housing) / 1.0, (housing - 25.0) / 4.0
        heat = shaft * size * speed + 0.5 * lost
        return [speed, acceleration, (copper - inner) / capacities[0], (heat + inner - outer) / capacities[1]]

    t = np.arange(0.0, END + 0.5 * STEP, STEP)
    state, rows = np.array([axis.position, 0.5, 25.0, 25.0]), []
    for k, (current, load) in enumerate(zip(*given(t), strict=True)):
        rows.append(state)
        run = solve_ivp(rates, (t[k], t[k] + STEP), state, args=(current, load), rtol=1e-8, atol=1e-10)
        state = run.y[:, -1]
    theirs = np.array(rows)
    for i, name in enumerate(("position", "speed", "winding_temperature", "housing_temperature")):
        spread = np.ptp(theirs[:, i])
        # Measured 5e-4: reversals and changes of the mesh's direction occur within fixed steps of 1 ms.
        np.testing.assert_allclose(recorded[name], theirs[:, i], atol=1e-3 * spread)
    assert np.ptp(np.sign(theirs[5:, 1])) == 2.0 and np.ptp(theirs[:, 2]) > 1.0


def test_an_elastic_gear(found, tmp_path: Path) -> None:
    """Rotor and load with a spring and backlash, with scipy; the backlash is crossed at every reversal."""
    judged = found.joints["j1"]
    gear = replace(judged.drive.gear, stiffness_1=4e3, backlash=0.01, efficiency=1.0)
    judged = replace(judged, drive=replace(judged.drive, gear=gear))
    stiff = replace(found, joints=found.joints | {"j1": judged})
    with pytest.raises(InputError, match="stiffness"):
        write_fmu(found, tmp_path / "x.fmu", joint="j1", springs=True)
    write_fmu(stiff, tmp_path / "x.fmu", joint="j1", springs=True)
    axis, size, half = axis_of(stiff, "j1", springs=True), 50.0, 0.005
    motor, rotor, load = axis.motor, axis.motor.rotor_inertia + gear.inertia, axis.load_inertia
    damping = 0.02 * 2.0 * np.sqrt(4e3 * (load + size**2 * rotor))
    constant = motor.torque_constant

    def rates(t: float, y: np.ndarray, current: float, outside: float) -> list[float]:
        _, speed, twist, turning = y  # wind-up: rotor angle at the output minus link angle
        over = twist - np.clip(twist, -half, half)
        force = 4e3 * over + damping * (turning - speed) if over else 0.0
        force = force if force * over > 0.0 else 0.0  # tooth flanks cannot pull
        shaft = constant * current - 0.008 * np.tanh(turning * size / 0.01) - VISCOUS * size * turning
        link = outside + 1.5 - 0.2 * np.tanh(speed / 1e-3) - 0.05 * speed
        return [speed, (force + link) / load, turning - speed, (size * shaft - force) / (size**2 * rotor)]

    t = np.arange(0.0, 0.6 + 0.5 * STEP, STEP)
    drawn, outside = 20.0 * np.sin(12.0 * t), 4.0 * np.cos(7.0 * t)
    inputs = np.array(list(zip(t, drawn, outside, strict=True)),
                      dtype=[("time", float), ("current_command", float), ("load_torque", float)])  # fmt: skip
    recorded = fmpy.simulate_fmu(
        str(tmp_path / "x.fmu"), stop_time=0.6, output_interval=STEP, input=inputs,
        start_values={"start_speed": 0.5, "motor.magnet_coefficient": 0.0},
    )  # fmt: skip
    state, rows = np.array([axis.position, 0.5, -half - 5.275 / 4e3, 0.5]), []  # initially the spring carries the load
    for k in range(len(t)):
        rows.append(state)
        run = solve_ivp(rates, (t[k], t[k] + STEP), state, "LSODA", args=(drawn[k], outside[k]), rtol=1e-8, atol=1e-10)
        state = run.y[:, -1]
    theirs = np.array(rows)
    # Measured 5e-6 and 2e-3: the rotor oscillates at 45 Hz, which steps of 0.2 ms damp slightly.
    np.testing.assert_allclose(recorded["position"], theirs[:, 0], atol=2e-5 * np.ptp(theirs[:, 0]))
    np.testing.assert_allclose(recorded["motor_speed"] / size, theirs[:, 3], atol=4e-3 * np.ptp(theirs[:, 3]))
    assert np.ptp(theirs[:, 2]) > 4.0 * half


@pytest.mark.parametrize(("which", "joint"), [(ur5, "elbow_joint"), (coupled, "j1")])
def test_a_joint_of_an_arm_runs_up(make, tmp_path: Path, which, joint: str) -> None:
    """A constant current with rotor, arm and viscous friction, against the closed form."""
    found = which(make)
    write_fmu(found, tmp_path / "x.fmu", joint=joint)
    axis = axis_of(found, joint)
    whole = axis.load_inertia + 80.0**2 * (axis.motor.rotor_inertia + 1e-6)
    recorded = fmpy.simulate_fmu(
        str(tmp_path / "x.fmu"), stop_time=0.3, output_interval=0.05,
        start_values={"current_command": 2.0, "load_torque": 1.0, "motor.magnet_coefficient": 0.0, "start_speed": 0.0},
    )  # fmt: skip
    most = (80.0 * axis.motor.torque_constant * 2.0 + 1.0) / 0.4
    speed = most * (1.0 - np.exp(-0.4 / whole * recorded["time"]))
    # Steps of 1 ms with inputs held from their start.
    np.testing.assert_allclose(recorded["speed"], speed, atol=1e-3 * speed.max())
    with pytest.raises(InputError, match="shares"):
        write_fmu(coupled(make), tmp_path / "y.fmu", joint="j3")


def test_parameters_and_limits(file: Path) -> None:
    """A parameter set before the run is used; the amplifier's current and the supply voltage limit the command."""
    short = {"stop_time": 0.05, "output_interval": 0.01}
    still = {"load_inertia": 1e6, "start_speed": 0.0, "motor.coulomb_friction": 0.0}
    run = fmpy.simulate_fmu(str(file), start_values=still | {"peak_current": 3.0, "current_command": 9.0}, **short)
    np.testing.assert_allclose(run["current"], 3.0)
    np.testing.assert_allclose(run["motor_torque"], 0.15, rtol=1e-3)
    low = {"supply_voltage": 1.0, "motor.resistance": 0.5, "current_command": 9.0}
    run = fmpy.simulate_fmu(str(file), start_values=still | low, **short)
    # At rest the voltage is R I; the winding warms up.
    np.testing.assert_allclose(run["current"], 0.95 / 0.5, rtol=5e-3)
    np.testing.assert_allclose(run["voltage"], 0.95, rtol=1e-6)


def test_axes_without_an_fmu_are_errors(found, make, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="j1"):
        write_fmu(found, tmp_path / "x.fmu", joint="j3")
    with pytest.raises(InputError, match=r"\.fmu"):
        write_fmu(found, tmp_path / "x.zip", joint="j1")
    names = ("j2", "j3")
    arm = with_coupling(make.planar_arm([0.4, 0.3, 0.3], [1.5, 1.0, 0.6]), placed(differential(), (1, 2), 3))
    tasks = tuple(make.task(f"j{i}", coupled=names if i > 1 else ()) for i in (1, 2, 3))
    wrist = evaluate(make.study(make.sines(3), arm=arm, joints=tasks))
    with pytest.raises(InputError, match="shares"):
        write_fmu(wrist, tmp_path / "x.fmu", joint="j3")
    write_fmu(wrist, tmp_path / "x.fmu", joint="j1")
    assert fmpy.simulate_fmu(str(tmp_path / "x.fmu"), stop_time=0.02)["time"][-1] == pytest.approx(0.02)
    time = np.linspace(0.0, 1.0, 11)
    with pytest.raises(InputError, match="load_inertia"):
        axis_of(evaluate(make.study(make.table_cycle(time, time, time, time))), "j1")
    axis = axis_of(found, "j1")
    assert read_axis(axis.text()) == axis
    sliding = replace(axis, travel_per_turn=0.01)
    assert [sliding.unit(*one) for one in (("position", "rad"), ("motor_speed", "rad/s"))] == ["m", "rad/s"]


def started(evaluation, path: Path, joint: str) -> dict[str, float]:
    """What the file states that an axis starts with."""
    write_fmu(evaluation, path, joint=joint)
    described = fmpy.read_model_description(str(path)).modelVariables
    return {one.name: float(one.start) for one in described if one.start is not None}


def test_axes_of_an_arm_with_a_slide(make, tmp_path: Path) -> None:
    """The start of the cycle, where the slide is 0.2 m out: two masses and their inertias, no payload, no weight.

    The slide, driven through 80 %, runs up by the current at the constant rate of mass and rotor.
    """
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, 0, 3] = 0.3, 0.5
    arm = Arm.from_screws(
        home, [[0, -1.0, 0, 0, 0, 0], [0, 0, 0, 1.0, 0, 0]], [1.5, 1.0], np.tile(1e-4 * np.eye(3), (2, 1, 1)),
        gravity=(0.0, 0.0, -9.81), joint_points=[[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]], joint_names=("j1", "j2"),
    )  # fmt: skip
    swing = make.sines(2, size=0.3)
    out = swing.position * [1.0, 0.5] + [0.1, 0.2] - swing.position[0] * [1.0, 0.5]
    cycle = make.arm_cycle(swing.time, out, swing.velocity * [1.0, 0.5], swing.acceleration * [1.0, 0.5],
                           np.zeros(101, dtype=int), ("part",))  # fmt: skip
    motor = replace(make.motor, no_load_current=None)
    tasks = make.task("j1"), make.task("j2", travel_per_turn=0.01, amplifier=Amplifier())
    study = make.study(cycle, arm=arm, joints=tasks, payloads=(make.payload(2.0),), supply=Supply(300.0),
                       drive_mass=DriveMass.INCLUDED, catalog=Catalog({"m1": motor}, {"g1": make.gear}))  # fmt: skip
    evaluation = evaluate(study)
    first, second = (started(evaluation, tmp_path / f"{name}.fmu", name) for name in ("j1", "j2"))
    moved = 1.5 * 0.3**2 + 1.0 * 0.7**2 + 2.0 * 1e-4
    assert first["load_inertia"] == pytest.approx(moved, rel=1e-9)
    assert second["load_inertia"] == pytest.approx(1.0, rel=1e-9)
    assert (first["start_position"], second["start_position"]) == pytest.approx((0.1, 0.2), abs=1e-12)
    speeds = 0.3 * np.pi, 0.5 * 0.15 * np.pi * np.cos(0.7)
    assert (first["start_speed"], second["start_speed"]) == pytest.approx(speeds, rel=1e-12)
    recorded = fmpy.simulate_fmu(
        str(tmp_path / "j2.fmu"), stop_time=0.05, output_interval=0.01,
        start_values={"current_command": 2.0, "motor.magnet_coefficient": 0.0, "start_speed": 0.0},
    )  # fmt: skip
    rate = 0.05 * 2.0 / (2.1e-5 * 5000.0 + 1.0 / (5000.0 * 0.8))
    np.testing.assert_allclose(recorded["speed"], rate * recorded["time"], atol=1e-6)


def test_a_load_table_states_its_inertia(make, tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 11)
    study = make.study(make.table_cycle(time, time, time + 0.5, time), joints=(make.task("j1", load_inertia=15.0),))
    start = started(evaluate(study), tmp_path / "x.fmu", "j1")
    assert (start["load_inertia"], start["start_position"], start["start_speed"]) == (15.0, 0.0, 0.5)
