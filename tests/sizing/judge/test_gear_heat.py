"""Mesh, drag and their heat in verdicts: the UR5's joints by plain numpy, a cold start, and what a study may state."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

from drivetrain.catalog.read import Catalog, read_catalog
from drivetrain.drive.brake import Brake
from drivetrain.drive.friction import Friction
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

PAIRS = {
    "shoulder_pan_joint": ("AM_MF0076008_48V", "hd_CSG-25-100-2UH"),
    "shoulder_lift_joint": ("AM_MF0060020_48V", "hd_CSG-25-160-2UH"),
    "elbow_joint": ("AM_MF0060020_48V", "hd_CSG-17-100-2UH"),
    "wrist_1_joint": ("AM_MF0060008_48V", "hd_CSG-14-100-2UH"),
    "wrist_2_joint": ("AM_MF0060008_48V", "hd_CSG-14-100-2UH"),
    "wrist_3_joint": ("AM_MF0060008_48V", "hd_CSG-14-50-2UH"),
}
CUT = 1e-9  # relative: the same sums in another order


@cache
def ur5():
    return load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")


def operations(study):
    work, filled_parts = workload(study), FilledParts(study)
    mounted = {i: filled_parts.drive(task, *PAIRS[task.name]) for i, task in enumerate(study.joints)}
    for joint, drive in mounted.items():
        yield Operation(work.at(joint, mounted).demand(drive), drive, study, joint)


def factor(gear, temperature):
    above = min(max(temperature, -10.0), 40.0) - 20.0
    return math.exp(-gear.drag_temperature_1 * above + gear.drag_temperature_2 * above**2)


def torque_of(op, temperature):
    """The motor's torque while it turns, NaN at rest, written without any law of the package."""
    gear, demand = op.drive.gear, op.demand
    friction, load = op.drive.joint_friction, demand.gear_torque
    way = np.where(demand.at_rest, np.nan, np.sign(demand.speed))
    load = load + way * friction.coulomb + friction.viscous * demand.speed
    mu = 1.0 / gear.mesh_efficiency - 1.0
    mesh = (1.0 + mu * np.sign(load * demand.speed)) * load / gear.ratio
    turns = np.abs(gear.ratio * demand.speed)
    drag = gear.drag_torque * (turns / gear.drag_speed) ** gear.drag_speed_exponent * factor(gear, temperature)
    inertia = op.drive.motor.rotor_inertia + gear.inertia
    rotor = inertia * (gear.ratio * demand.acceleration + demand.carrier_acceleration)
    return mesh + way * (drag + gear.seal_drag_torque) + rotor, mu * np.abs(load * demand.speed), drag * turns


def copper(op, temperature):
    """Mean loss in the winding at a temperature of all of the motor [W], the torque straight between samples."""
    motor, torque, step = op.drive.motor, op.motor_torque, np.diff(op.demand.time)
    a, b, warmer = torque[:-1], torque[1:], temperature - motor.reference_temperature
    square = step @ (a * a + a * b + b * b) / 3.0 / step.sum()
    constant = motor.torque_constant * (1.0 + motor.magnet_coefficient * warmer)
    return square * motor.resistance * (1.0 + 0.0039 * warmer) / constant**2


def warmed(op, heat):
    """The temperature of one node that a heat depending on it brings it to [C]."""
    ambient, path = op.study.ambient, op.network.resistance_housing_ambient
    return brentq(lambda at: ambient + path * heat(at) - at, -50.0, 500.0, xtol=1e-10)


def test_the_ur5s_joints_by_plain_numpy():
    """Torque at every sample that turns, and the temperature of a gear and a winding that warm each other."""
    found = []
    for op in operations(ur5()):
        gear, demand = op.drive.gear, op.demand
        torque, meshed, dragged = torque_of(op, 20.0)
        turning = ~np.isnan(torque)
        np.testing.assert_allclose(op.motor_torque[turning], torque[turning], rtol=CUT, atol=CUT)
        mesh, drag = (demand.mean(np.where(turning, one, 0.0)) for one in (meshed, dragged))
        assert op.network.resistance_winding_housing == 0.0  # these sheets know one node
        lost = mesh + drag * factor(gear, warmed(op, settling(op, mesh, drag)))
        assert op.figures.gear_loss == pytest.approx(lost, rel=1e-6, abs=1e-12)
        assert op.figures.winding_temperature == pytest.approx(warmed(op, with_copper(op, lost)), abs=2e-4)
        found.append((lost, mesh + drag))
    assert found[0][0] < 0.7 * found[0][1]  # the pan's gear is warm


def settling(op, mesh, drag):
    return lambda at: copper(op, -10.0) + mesh + drag * factor(op.drive.gear, at)


def with_copper(op, lost):
    return lambda at: copper(op, at) + lost


def test_a_cold_start_by_plain_numpy():
    study = replace(ur5(), cold_start=-10.0)
    for op in operations(study):
        peak = np.abs(np.nan_to_num(torque_of(op, -10.0)[0])).max()
        motor = op.drive.motor
        gear, demand, at_rest = op.drive.gear, op.demand, op.demand.at_rest
        inertia = motor.rotor_inertia + gear.inertia
        rotor = (inertia * (gear.ratio * demand.acceleration + demand.carrier_acceleration))[at_rest]
        load = demand.gear_torque[at_rest]
        held = np.abs(load / gear.ratio + rotor)
        pushed = (load + np.sign(load) * breakaway(op.drive.joint_friction)) / gear.mesh_efficiency / gear.ratio
        start = np.abs(pushed + np.sign(load) * gear.starting_torque + rotor) * demand.moves
        peak = max(peak, held.max(initial=0.0), start.max(initial=0.0))
        assert op.figures.cold_torque == pytest.approx(peak, rel=CUT)
        colder = -10.0 - motor.reference_temperature
        constant = motor.torque_constant * (1.0 + motor.magnet_coefficient * colder)
        assert op.figures.cold_current == pytest.approx(op.figures.cold_torque / constant, rel=CUT)
        resistance = motor.resistance * (1.0 + 0.0039 * colder)
        assert op.figures.cold_voltage >= resistance * op.figures.cold_current * (1.0 - CUT)


def breakaway(friction: Friction) -> float:
    return friction.coulomb if friction.static is None else friction.static


def test_a_cold_start_is_told_where_it_is_stated(make):
    study = ur5()
    plain, cold = evaluate(study, PAIRS), evaluate(replace(study, cold_start=-10.0), PAIRS)
    for name in PAIRS:
        before = {check.name: check for check in plain.joints[name].checks}
        after = {check.name: check for check in cold.joints[name].checks}
        assert set(after) - set(before) == {"cold start torque", "cold start current", "cold start voltage"}
        assert all(after[check].verdict == before[check].verdict for check in before)
        assert after["cold start torque"].required >= before["motor peak torque"].required
        assert "-10 °C" in after["cold start torque"].remark


def test_where_a_gear_sits_and_how_warm_it_is_may_be_stated():
    study = ur5()
    plain = next(operations(study))
    apart = next(operations(replace(study, joints=tuple(replace(task, gear_heat=0.0) for task in study.joints))))
    stated = next(operations(replace(study, gear_temperature=40.0)))
    cold = next(operations(replace(study, ambient=0.0)))
    assert apart.figures.winding_temperature < plain.figures.winding_temperature
    np.testing.assert_array_equal(apart.motor_torque, plain.motor_torque)
    np.testing.assert_allclose(stated.motor_torque[1:-1], np.nan_to_num(torque_of(stated, 40.0)[0], nan=0.0)[1:-1]
                               + np.where(stated.demand.at_rest, stated.motor_torque, 0.0)[1:-1], atol=CUT)  # fmt: skip
    assert np.abs(cold.motor_torque).max() > np.abs(plain.motor_torque).max() > np.abs(stated.motor_torque).max()


@pytest.mark.parametrize("ratio", [10.0])
def test_a_planetary_gear_loses_its_idle_torque_beside_the_mesh(make, ratio):
    gear = replace(read_catalog().gears["beckhoff_TP010-MF_i10"], key="g1")
    time = np.linspace(0.0, 1.0, 11)
    speed, load = np.full(11, 20.0), np.full(11, 50.0)
    study = make.study(
        make.table_cycle(time, load, speed, np.zeros(11)), catalog=Catalog({"m1": make.motor}, {"g1": gear})
    )
    asked = next(check for check in evaluate(study).joints["j1"].checks if check.name == "motor peak torque")
    friction = make.motor.coulomb_friction or 0.0
    assert asked.required == pytest.approx(50.0 / (10.0 * 0.97) + 0.64 + friction, rel=0.02)


# One housing: gear, brake, amplifier and winding warm each other


def in_one_housing(make, load, ambient, **changes):
    """A joint to and fro, its gear, its brake's coil and its amplifier in the motor's housing by stated shares."""
    brake = Brake("b", "motor", static_torque=2.0, power=4.0, inertia=0.0, mass=0.1)
    motor = replace(
        make.motor, key="m1", no_load_current=None, no_load_speed=None, coulomb_friction=0.01, viscous_friction=2e-5,
        brake=brake,
    )  # fmt: skip
    gear = replace(
        make.gear, efficiency=None, mesh_efficiency=0.85, drag_torque=0.03, drag_speed=200.0, drag_speed_exponent=0.6,
        drag_temperature_1=0.0436, drag_temperature_2=0.00037, seal_drag_torque=0.005, max_temperature=60.0,
    )  # fmt: skip
    time = np.linspace(0.0, 2.0, 401)
    rate = np.pi * time
    amplifier = replace(make.task().amplifier, on_resistance=0.08, standby_power=2.0)
    joint = make.task(amplifier=amplifier, **{"gear_heat": 0.6, "amplifier_heat": 0.7, **changes})
    cycle = make.table_cycle(time, load * (1.0 + np.cos(rate)), 4.0 * np.sin(rate), 4.0 * np.pi * np.cos(rate))
    catalog = Catalog({"m1": motor}, {"g1": gear})
    return make.study(cycle, catalog=catalog, joints=(joint,), ambient=ambient)


def periodic_by_ode(study):
    """Winding and housing over a cycle that repeats, from the heat balance alone; the start by a root of the period."""
    motor, gear, task = study.catalog.motors["m1"], study.catalog.gears["g1"], study.joints[0]
    time, speed = study.cycle.time, study.cycle.velocity[:, 0]
    load, turns = study.cycle.torque[:, 0], gear.ratio * speed
    way, mu = np.sign(np.round(speed, 12)), 1.0 / 0.85 - 1.0
    drag = gear.drag_torque * (np.abs(turns) / gear.drag_speed) ** gear.drag_speed_exponent
    rubs = motor.coulomb_friction * way + motor.viscous_friction * turns
    inertia = (motor.rotor_inertia + gear.inertia) * gear.ratio * study.cycle.acceleration[:, 0]
    taken = drag * factor(gear, min(20.0, study.ambient))  # torque is checked with the drag at 20 C, or in colder air
    torque = (load + mu * np.abs(load) * way) / gear.ratio + way * (taken + gear.seal_drag_torque) + rubs + inertia
    meshed = mu * np.abs(load * speed) + gear.seal_drag_torque * np.abs(turns)
    dragged, rubbed = drag * np.abs(turns), rubs * turns
    winding, housing = 20.0 / 1.0, 800.0 / 4.0  # time constants over resistances
    weak = motor.torque_constant * (1.0 + motor.magnet_coefficient * (motor.max_winding_temperature - 25.0))

    def rates(t, state):
        tau, mesh, dragging, rub = (np.interp(t, time, row) for row in (torque, meshed, dragged, rubbed))
        warm, case = state
        constant = motor.torque_constant * (1.0 + motor.magnet_coefficient * (case - 25.0))
        copper = motor.resistance * (1.0 + 0.0039 * (warm - 25.0)) * (tau / constant) ** 2
        bridge = task.amplifier.standby_power + 2.0 * task.amplifier.on_resistance * (tau / weak) ** 2
        lost = task.gear_heat * (mesh + dragging * factor(gear, case)) + task.amplifier_heat * bridge + rub + 4.0
        inwards = (warm - case) / 1.0
        return [(copper - inwards) / winding, (inwards + lost - (case - study.ambient) / 4.0) / housing]

    def period(start):
        return solve_ivp(rates, (0.0, 2.0), start, rtol=1e-8, atol=1e-8, max_step=0.01)

    start = root(lambda x: period(x).y[:, -1] - x, [study.ambient + 40.0] * 2, tol=1e-6).x
    found = period(start)
    return found.y[0].max(), np.trapezoid(found.y[1], found.t) / 2.0


def figures_of(study):
    drive = FilledParts(study).drive(study.joints[0], "m1", "g1")
    return Operation(workload(study).at(0, {}).fixed, drive, study, 0).figures


@pytest.mark.parametrize(("load", "ambient"), [(9.0, 25.0), (10.0, 30.0), (9.0, 45.0)])
def test_one_housing_against_an_ode_of_the_repeated_cycle(make, load, ambient):
    """Warmer than 40 C, where the drag's law ends: to what straight lines of losses between samples make of it."""
    study = in_one_housing(make, load, ambient)
    figures = figures_of(study)
    peak, housing = periodic_by_ode(study)
    assert housing > 41.0
    close = 1e-3 * (peak - ambient)
    assert figures.winding_temperature == pytest.approx(peak, abs=close)
    assert figures.housing_temperature == figures.gear_temperature == pytest.approx(housing, abs=close)


def test_a_gear_that_stays_cool_is_taken_a_little_cooler_than_it_is(make):
    """Its drag is found with the copper loss of a cold winding, so it is never less than the real one; by a kelvin."""
    study = in_one_housing(make, 1.0, -20.0)
    figures = figures_of(study)
    peak, housing = periodic_by_ode(study)
    assert housing < 35.0
    assert 0.1 < figures.winding_temperature - peak < 1.0
    assert 0.1 < figures.housing_temperature - housing < 1.0


def test_what_sits_elsewhere_warms_nothing(make):
    plain = in_one_housing(make, 9.0, 25.0)
    lost = {}
    for name in ("gear_heat", "amplifier_heat"):
        apart = in_one_housing(make, 9.0, 25.0, **{name: 0.0})
        was, now = (periodic_by_ode(one)[1] for one in (plain, apart))
        checks = {check.name: check for check in evaluate(apart).joints["j1"].checks}
        lost[name] = checks["gear temperature"], was - now
        assert was - now > 2.0
    assert lost["gear_heat"][0].required is None and "another housing" in lost["gear_heat"][0].remark
    assert lost["amplifier_heat"][0].required == pytest.approx(periodic_by_ode(apart)[1], abs=0.05)


def test_a_gear_beside_a_motor_that_tells_neither_friction_nor_limit_is_not_proven_cool(make):
    """What friction may warm it by counts up to a winding of 155 C, where no limit of it is told."""
    study = in_one_housing(make, 9.0, 25.0)
    silent = dict.fromkeys(("no_load_current", "no_load_speed", "coulomb_friction", "viscous_friction"))
    motor = replace(study.catalog.motors["m1"], max_winding_temperature=None, **silent)

    def told(limit):
        gear = replace(study.catalog.gears["g1"], max_temperature=limit)
        parts = replace(study.catalog, motors={"m1": motor}, gears={"g1": gear})
        return next(
            c for c in evaluate(replace(study, catalog=parts)).joints["j1"].checks if c.name == "gear temperature"
        )

    housing = told(300.0).required
    assert told(300.0).verdict is Verdict.PASS and told(housing + 2.0).verdict is Verdict.NOT_CHECKED
    assert told(housing - 2.0).verdict is Verdict.FAIL


def test_a_gear_may_not_be_warmer_than_its_sheet_says(make):
    """The rise over ambient against the sheet's; nothing is asked of a direct drive, nor where the sheet is silent."""
    study = in_one_housing(make, 9.0, 25.0)
    told = {check.name: check for check in evaluate(study).joints["j1"].checks}["gear temperature"]
    assert told.available == 60.0 and told.utilisation == pytest.approx((told.required - 25.0) / 35.0)
    hot = {check.name: check for check in evaluate(replace(study, ambient=45.0)).joints["j1"].checks}
    assert hot["gear temperature"].verdict is Verdict.FAIL
    stated = replace(study, gear_temperature=55.0)
    warm = figures_of(stated)
    assert warm.gear_temperature == max(55.0, warm.housing_temperature)
    cool = figures_of(replace(study, gear_temperature=20.0))  # stated for its drag: its housing is no cooler for that
    assert cool.gear_temperature == cool.housing_temperature > told.required > 41.0
    gears = {"g1": replace(study.catalog.gears["g1"], max_temperature=None)}
    silent = evaluate(replace(study, catalog=replace(study.catalog, gears=gears))).joints["j1"].checks
    assert next(c for c in silent if c.name == "gear temperature").verdict is Verdict.NOT_CHECKED
    assert "gear temperature" not in {c.name for c in evaluate(study, {"j1": ("m1", "")}).joints["j1"].checks}
    shipped_gears = read_catalog().gears.values()
    assert {row.max_temperature for row in shipped_gears if row.key.startswith("beckhoff")} == {90.0}
