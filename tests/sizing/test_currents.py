"""The current table: complete, its parts add up, and it says where the drive runs out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.drive import drive_inertia
from drivetrain.drive.friction import Friction
from drivetrain.dynamics.inverse import gravity_torque, velocity_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.export.currents import write_currents
from drivetrain.sizing.currents import PARTS, current_commands
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.parts.mounting import loaded_arm

FLAGS = ("joint", "saturated", "over current", "over torque", "over voltage")


@pytest.fixture
def evaluation(make):
    return evaluate(make.study(make.sines(2), arm=make.planar_arm([0.3, 0.3], [1.5, 1.0])))


def test_one_row_per_sample_and_joint(evaluation):
    table = current_commands(evaluation)
    samples = len(evaluation.study.cycle.time)
    assert len(table) == 2 * samples
    assert list(table["joint"].unique()) == ["j1", "j2"]
    assert table["joint"].value_counts().eq(samples).all()
    assert not table.isna().any().any()
    assert all("[" in name for name in table.columns if name not in FLAGS)


def test_parts_add_up_to_the_command(evaluation):
    table = current_commands(evaluation)
    parts = table[["gear torque current [A]", "rotor inertia current [A]", "friction current [A]"]].sum(axis=1)
    np.testing.assert_allclose(parts, table["current [A]"], atol=1e-12)
    torque = table["current [A]"] / table["motor torque [N m]"]
    for joint in ("j1", "j2"):  # one torque constant a joint, weaker than the cold one
        ratios = torque[(table["joint"] == joint) & (table["motor torque [N m]"].abs() > 1e-6)]
        assert ratios.std() / ratios.mean() < 1e-9
        assert ratios.mean() > 1 / 0.05


def test_no_current_is_told_that_lacks_a_part(evaluation, make, tmp_path):
    """Of a motor that tells no rotor inertia: the load's share alone is known, and no file is written."""
    silent = replace(make.motor, rotor_inertia=None)
    study = replace(evaluation.study, catalog=Catalog({"m1": silent}, {"g1": make.gear}))
    half = evaluate(study)
    table, whole = current_commands(half), current_commands(evaluation)
    for name in ("current [A]", "voltage [V]", "rotor inertia current [A]", "lost acceleration [rad/s^2]"):
        assert table[name].isna().all(), name
    np.testing.assert_allclose(table["gravity current [A]"], whole["gravity current [A]"], rtol=0.1)
    with pytest.raises(InputError, match=r"joints\.j1: lacks the motor's rotor inertia") as told:
        write_currents(half, tmp_path / "currents.csv", {})
    assert len(told.value.faults) == 2 and not list(tmp_path.iterdir())


def test_phase_currents_heat_as_much(evaluation):
    table = current_commands(evaluation)
    # R I^2 of the DC equivalent is 3 (R / 2) I_rms^2 of the phases; a sine's peak is sqrt(2) of its RMS.
    np.testing.assert_allclose(table["phase current RMS [A]"] ** 2 * 1.5, table["current [A]"] ** 2)
    np.testing.assert_allclose(table["phase current peak [A]"], np.sqrt(2) * table["phase current RMS [A]"])


def test_saturation_is_flagged_where_it_happens(evaluation, make):
    assert not current_commands(evaluation)["saturated"].any()
    study = evaluation.study
    limit = 0.5 * np.abs(evaluation.joints["j1"].series.current).max()
    tasks = tuple(replace(task, amplifier=Amplifier(peak_current=float(limit))) for task in study.joints)
    table = current_commands(evaluate(replace(study, joints=tasks)))
    over = table["current [A]"].abs() > limit
    assert over.any() and not over.all()
    np.testing.assert_array_equal(table["saturated"], over)


@pytest.fixture
def lossy(make):
    """Two joints with friction at joint and motor, falling from its static torque, and a gear with loss and drag."""
    rough = Friction(coulomb=0.4, viscous=0.3, static=0.7, stribeck_speed=0.2)
    tasks = tuple(make.task(name, friction=rough, motor_friction=Friction(0.01, viscous=1e-5)) for name in ("j1", "j2"))
    arm = make.planar_arm([0.3, 0.3], [1.5, 1.0])
    gear = replace(make.gear, no_load_torque=0.02)
    return make.study(make.sines(2), arm=arm, joints=tasks, catalog=Catalog({"m1": make.motor}, {"g1": gear}))


def test_what_the_current_is_for_adds_up(lossy):
    table = current_commands(evaluate(lossy))
    parts = table[[f"{name} current [A]" for name in PARTS]].sum(axis=1)
    np.testing.assert_allclose(parts, table["current [A]"], atol=1e-12)  # A, of some amperes
    old = table["gear torque current [A]"]  # joint friction counted as of the sample's own speed: at rest there is none
    moving = table["motor speed [rad/s]"].abs() > 1e-6
    lossless = table[[f"{name} current [A]" for name in PARTS[:6]]].sum(axis=1)
    np.testing.assert_allclose(lossless[moving], old[moving], atol=1e-12)
    assert (
        table[[f"{name} current [A]" for name in PARTS if name not in ("given torque", "counterbalance")]].abs().max()
        > 1e-4
    ).all()


def test_inertia_gravity_and_velocity_are_the_arms_own(lossy):
    """Against the arm with its drives in it, asked for each by itself: M qdd, g(q), c(q, qd)."""
    found = evaluate(lossy)
    drives = {name: joint.drive for name, joint in found.joints.items()}
    arm, cycle = loaded_arm(lossy, drives, -1), lossy.cycle
    own = np.diag([drive_inertia(drives[name]) * 50.0**2 for name in drives])  # its own rotor stands in another part
    weight, speeds = gravity_torque(arm, cycle.position), velocity_torque(arm, cycle.position, cycle.velocity)
    mass = mass_matrix(arm, cycle.position) - own
    inertia = np.einsum("kij,kj->ki", mass, cycle.acceleration)
    # A rotor that is carried along takes a share of its own, which is no part of the gear's torque (8.110).
    inertia[:, 1] -= 50.0 * drive_inertia(drives["j2"]) * cycle.acceleration[:, 0]
    table = current_commands(found)
    for i, name in enumerate(drives):
        rows = table[table["joint"] == name]
        constant = (rows["motor torque [N m]"] / rows["current [A]"]).to_numpy()[0]
        for part, torque in (("inertia", inertia), ("gravity", weight), ("velocity", speeds)):
            expected = torque[:, i] / 50.0 / constant
            np.testing.assert_allclose(rows[f"{part} current [A]"], expected, atol=1e-10)


def test_a_table_of_torques_is_one_part(make):
    time = np.linspace(0.0, 1.0, 51)
    cycle = make.table_cycle(time, 3.0 * np.cos(6.0 * time), np.sin(6.0 * time), 6.0 * np.cos(6.0 * time))
    table = current_commands(evaluate(make.study(cycle)))
    parts = table[[f"{name} current [A]" for name in PARTS]].sum(axis=1)
    np.testing.assert_allclose(parts, table["current [A]"], atol=1e-12)
    assert not table[["inertia current [A]", "gravity current [A]", "velocity current [A]"]].any().any()


def test_what_saturation_costs_is_what_the_missing_torque_would_accelerate(lossy):
    whole = evaluate(lossy)
    limit = 0.6 * float(np.abs(whole.joints["j1"].series.current).max())
    tasks = tuple(replace(task, amplifier=Amplifier(peak_current=limit)) for task in lossy.joints)
    found = evaluate(replace(lossy, joints=tasks))
    table = current_commands(found)
    rows, joint = table[table["joint"] == "j1"], found.joints["j1"]
    over = rows["over current"].to_numpy()
    assert over.any() and not rows[["over torque", "over voltage"]].any().any()
    assert (rows["lost acceleration [rad/s^2]"].to_numpy() != 0.0)[over].all()
    assert not rows["lost acceleration [rad/s^2]"].to_numpy()[~over].any()
    asked = torque_with_less_acceleration(joint, rows["lost acceleration [rad/s^2]"].to_numpy())
    constant = (joint.series.motor_torque / joint.series.current)[0]
    np.testing.assert_allclose(np.abs(asked[over] / constant), limit, rtol=1e-9)


def torque_with_less_acceleration(joint, lost):
    """The torque that a joint of ``lossy`` asks of its motor with that much less acceleration at its output [N m]."""
    series = joint.series
    power = np.sign(series.gear_torque * series.speed)
    factor = np.where(power > 0, 1.0 / 0.8, 0.75)  # of a printed efficiency of 0.8: 1/eta driving, 2 - 1/eta driven
    share = 0.02 * 50.0 / 20.0  # no-load torque, counted apart from the mesh
    factor = np.where(power > 0, factor - share, factor + share)
    return series.motor_torque - (50.0 * drive_inertia(joint.drive) + factor / 50.0 * series.load_inertia) * lost


def test_too_little_voltage_costs_acceleration_too(lossy):
    """With that much less acceleration the remaining current needs just the available voltage, at the same speed."""
    found = evaluate(replace(lossy, supply=Supply(4.0)))
    table = current_commands(found)
    for name, joint in found.joints.items():
        rows, series = table[table["joint"] == name], joint.series
        over, constant = rows["over voltage"].to_numpy(), (series.motor_torque / series.current)[0]
        asked = torque_with_less_acceleration(joint, rows["lost acceleration [rad/s^2]"].to_numpy())
        resistance = 0.3 * (1.0 + 0.0039 * (series.winding_temperature - 25.0))
        volts = series.voltage - resistance * (series.current - asked / constant)
        np.testing.assert_allclose(np.abs(volts[over]), 0.95 * 4.0, rtol=1e-9)
    assert table["over voltage"].any() and not table["over current"].any()
    np.testing.assert_array_equal(table["over voltage"], table["voltage [V]"].abs() > 0.95 * 4.0)
    assert ((table["lost acceleration [rad/s^2]"] != 0.0) == table["over voltage"]).all()


@pytest.mark.parametrize("hold", [0, 1])
def test_commands_at_the_amplifiers_rate(lossy, hold):
    found = evaluate(lossy)
    plain, fast = current_commands(found), current_commands(found, rate=1e3, hold=hold)
    assert fast.attrs == {"rate": 1e3, "hold": hold}
    assert list(plain.columns) == list(fast.columns)
    for name, rows in fast.groupby("joint", sort=False):
        old, time = plain[plain["joint"] == name], rows["time [s]"].to_numpy()
        np.testing.assert_allclose(np.diff(time), 1e-3, rtol=1e-9)
        assert len(time) == 2001
        known, values = old["time [s]"].to_numpy(), old["current [A]"].to_numpy()
        at = np.minimum(np.floor(time / 0.02 + 1e-9).astype(int), 100)
        expected = np.interp(time, known, values) if hold else values[at]
        np.testing.assert_allclose(rows["current [A]"], expected, atol=1e-9)
        parts = rows[[f"{one} current [A]" for one in PARTS]].sum(axis=1)
        np.testing.assert_allclose(parts, rows["current [A]"], atol=1e-12)


def test_after_a_jump_the_later_sample_counts(make):
    time = np.array([0.0, 0.5, 0.5, 1.0])
    cycle = make.table_cycle(time, [1.0, 1.0, 3.0, 3.0], [1.0] * 4, [0.0] * 4)
    table = current_commands(evaluate(make.study(cycle)), rate=10.0)
    current = table["given torque current [A]"].to_numpy()
    np.testing.assert_allclose(current[5:] / current[:6].min(), 3.0)
    np.testing.assert_allclose(current[:5], current[0])


@pytest.mark.parametrize("wrong", [{"rate": 0.0}, {"rate": -5.0}, {"hold": 2}, {"rate": float("nan")}])
def test_rates_that_are_none(evaluation, wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        current_commands(evaluation, **wrong)
