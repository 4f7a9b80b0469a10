"""Free ratios: closed form against the numbers, the coupled arm against a grid, limits, and the catalogue beside it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.errors import InputError
from drivetrain.sizing.answers.free_ratio import Goal, free_ratios
from drivetrain.sizing.judge.evaluate import evaluate_drives
from drivetrain.study.model import FreeRatio

WIDE = FreeRatio(2.0, 2000.0)


def bare_motor(make, **changes):
    """Without friction of its own, so that formulas without friction hold."""
    return replace(make.motor, no_load_current=0.0, max_speed=None, **changes)


def inertia_study(make, load=0.4, hold=0.0):
    """One axis: an inertia, and a torque that is only held."""
    time = np.linspace(0.0, 2.0, 401)
    speed, acceleration = np.sin(np.pi * time), np.pi * np.cos(np.pi * time)
    study = make.study(make.table_cycle(time, load * acceleration + hold, speed, acceleration))
    return replace(study, catalog=Catalog({"m1": bare_motor(make)}, {"g1": make.gear}))


def test_a_pure_inertia_has_the_matched_ratio(make):
    study = inertia_study(make)
    found = free_ratios(study, free={"j1": WIDE})
    (joint,) = found.joints
    matched = math.sqrt(0.4 / study.catalog.motors["m1"].rotor_inertia)
    assert joint.best == pytest.approx(matched, rel=1e-4)
    assert joint.least_rms == pytest.approx(matched, rel=1e-6)


def test_an_ideal_gear_turns_as_fast_as_the_motor(make):
    """It has no limit of input speed, so none is assumed either: real gears without one count as made for 2000 rpm."""
    study = inertia_study(make)
    light = replace(study.catalog.motors["m1"], rotor_inertia=1e-6)
    (joint,) = free_ratios(replace(study, catalog=Catalog({"m1": light}, {"g1": make.gear})), free={"j1": WIDE}).joints
    assert joint.best == pytest.approx(math.sqrt(0.4 / 1e-6), rel=1e-4)
    assert joint.best * 2.0 / np.pi > 2000.0 * np.pi / 30.0  # mean speed of the motor over limit that is assumed


def test_any_load_has_the_fourth_root(make):
    study = inertia_study(make, hold=3.0)
    (joint,) = free_ratios(study, free={"j1": WIDE}).joints
    cycle = study.cycle
    mean = [float(cycle.weights @ x[:, 0] ** 2) for x in (cycle.torque, cycle.acceleration)]
    inertia = study.catalog.motors["m1"].rotor_inertia
    assert joint.best == pytest.approx((mean[0] / (inertia**2 * mean[1])) ** 0.25, rel=1e-4)
    # RMS^2 = A/G^2 + 2BJ + C J^2 G^2, read off the sweep at three ratios, predicts a fourth.
    g = joint.ratios[[3, 15, 30, 38]]
    squared = joint.rms_torque[[3, 15, 30, 38]] ** 2
    terms = np.linalg.solve(np.column_stack([g[:3] ** -2.0, np.ones(3), g[:3] ** 2.0]), squared[:3])
    assert terms @ [g[3] ** -2.0, 1.0, g[3] ** 2.0] == pytest.approx(squared[3], rel=1e-6)


def test_the_range_the_speed_and_the_voltage_end_it(make):
    study = inertia_study(make)
    (joint,) = free_ratios(study, free={"j1": FreeRatio(5.0, 20.0)}).joints
    assert joint.best == pytest.approx(20.0, rel=1e-7) and joint.ended_by == "end of the range"
    slow = replace(study, catalog=Catalog({"m1": replace(bare_motor(make), max_speed=60.0)}, {"g1": make.gear}))
    (joint,) = free_ratios(slow, free={"j1": WIDE}).joints
    assert joint.best == pytest.approx(60.0 / 1.0, rel=1e-6) and joint.ended_by == "motor speed"
    weak = replace(study, supply=replace(study.supply, voltage=5.0))
    (joint,) = free_ratios(weak, free={"j1": WIDE}).joints
    assert joint.ended_by == "motor voltage" and joint.best == pytest.approx(joint.high, rel=1e-6)
    assert joint.best < 100.0


def test_a_range_between_two_ratios_of_the_grid_is_found(make):
    """At 10.1 V only ratios about 110 are slow enough and need little enough current for the voltage."""
    motor = bare_motor(make, resistance=3.0, inductance=1e-5, peak_current=500.0)
    study = inertia_study(make, load=1.0, hold=6.0)
    weak = Catalog({"m1": replace(motor, max_speed=5000.0)}, {"g1": make.gear})
    study = replace(study, catalog=weak, supply=replace(study.supply, voltage=10.1))
    for shift in (1.0, 1.1, 1.2, 1.3, 1.4):  # of the grid
        (joint,) = free_ratios(study, free={"j1": FreeRatio(2.0 * shift, 2000.0 * shift)}).joints
        assert 95.0 < joint.low < 110.0 < joint.high < 130.0 and joint.low <= joint.best <= joint.high


def arm_study(make, goal_motor=None):
    motor = bare_motor(make, rotor_inertia=4e-4) if goal_motor is None else goal_motor
    study = make.study(make.sines(2, samples=61, duration=1.5, size=0.9), arm=make.planar_arm([0.4, 0.3], [1.0, 0.7]))
    supply = replace(study.supply, voltage=400.0)
    return replace(study, catalog=Catalog({"m1": motor}, {"g1": make.gear}), supply=supply)


def total_heat(study, ratios):
    """Copper loss of all motors, by drives written out by hand."""
    drives = {
        i: Drive(study.catalog.motors["m1"], Gear(f"i{i}", ratio, kind="ideal", efficiency=1.0), task.friction, None)
        for i, (task, ratio) in enumerate(zip(study.joints, ratios, strict=True))
    }
    found = evaluate_drives(study, {study.joints[i].name: drive for i, drive in drives.items()})
    weights, heat = study.cycle.weights, 0.0
    for i, result in enumerate(found.joints.values()):
        motor = drives[i].motor
        current = result.series.motor_torque / float(torque_constant(motor, study.ambient))
        heat += float(winding_resistance(motor, study.ambient)) * float(weights @ current**2) / float(weights.sum())
    return heat


def test_the_arm_is_no_worse_than_any_point_of_a_grid_and_than_each_motor_alone(make):
    study = arm_study(make)
    free = dict.fromkeys(("j1", "j2"), FreeRatio(5.0, 200.0))
    found = free_ratios(study, goal=Goal.HEAT, free=free)
    best = tuple(joint.best for joint in found.joints)
    assert found.value == pytest.approx(total_heat(study, best), rel=1e-9)
    assert found.value <= found.value_at_least_rms * (1.0 + 1e-9)
    around = [tuple(b * f for b, f in zip(best, factors, strict=True)) for factors in
              ((1.01, 1.0), (0.99, 1.0), (1.0, 1.01), (1.0, 0.99), (1.01, 1.01), (0.99, 1.01))]  # fmt: skip
    for ratios in [*around, *((a, b) for a in np.geomspace(5, 200, 7) for b in np.geomspace(5, 200, 7))]:
        assert total_heat(study, ratios) >= found.value * (1.0 - 1e-9)


def test_the_wrist_loads_the_shoulder(make):
    """A rotor of the second joint reacts on the first: the ratio best for the arm is not that best for itself."""
    study = arm_study(make)
    found = free_ratios(study, free=dict.fromkeys(("j1", "j2"), FreeRatio(5.0, 200.0)))
    wrist = found.joints[1]
    assert abs(wrist.best / wrist.least_rms - 1.0) > 1e-3
    assert found.value < found.value_at_least_rms


@pytest.mark.parametrize("goal", list(Goal))
def test_every_goal_is_least_at_its_ratios(make, goal):
    study = arm_study(make, bare_motor(make, rotor_inertia=1e-4))
    found = free_ratios(study, goal=goal, free={"j2": FreeRatio(10.0, 150.0)})
    (joint,) = found.joints
    assert found.value <= np.nanmin(joint.goal) * (1.0 + 1e-9)
    assert np.ptp(joint.goal) > 0.0 or goal is Goal.MASS  # an ideal gear has no mass


@pytest.mark.parametrize("goal", list(Goal))
def test_values_of_the_goals(make, goal):
    """Over both joints: sums of heat, energy and mass; the root of the mean square of used continuous currents."""
    motor = bare_motor(make, rotor_inertia=1e-4)
    study = arm_study(make, motor)
    found = free_ratios(study, goal=goal, free={"j2": FreeRatio(40.0, 60.0)})
    first = Drive(motor, make.gear, study.joints[0].friction, None)
    second = Drive(motor, found.joints[0].gear, study.joints[1].friction, None)
    result = evaluate_drives(study, {"j1": first, "j2": second})
    weights, series = study.cycle.weights, [one.series for one in result.joints.values()]
    constant = float(torque_constant(motor, study.ambient))
    squares = [float(weights @ one.motor_torque**2 / weights.sum()) / constant**2 for one in series]
    # Steady state at the winding's limit: the rise is that of R(T) I^2 through both thermal resistances.
    path = motor.resistance_winding_housing + motor.resistance_housing_ambient
    hot = float(winding_resistance(motor, motor.max_winding_temperature))
    lasting = (motor.max_winding_temperature - study.ambient) / (path * hot)
    lasting = min(lasting, motor.nominal_current**2)
    expected = {
        Goal.HEAT: float(winding_resistance(motor, study.ambient)) * sum(squares),
        Goal.CURRENT: math.sqrt(sum(squares) / (2.0 * lasting)),
        Goal.ENERGY: sum(float(weights @ one.electrical_power) for one in series),
        Goal.MASS: 2.0 * motor.mass + make.gear.mass,
    }[goal]
    assert found.value == pytest.approx(expected, rel=1e-9)


def series(make):
    found = {}
    for torque in (5.0, 15.0, 45.0, 135.0):
        for ratio in (50.0, 100.0):
            key = f"x{torque:g}-{ratio:g}"
            found[key] = Gear(
                key, ratio, kind="strain_wave", series="X", repeated_peak_torque=torque, momentary_torque=2.0 * torque,
                average_torque_limit=0.5 * torque, mass=0.1 * torque**0.7, inertia=2e-7 * torque**1.5, efficiency=0.75,
                max_input_speed=900.0,
            )  # fmt: skip
    return found


def test_a_scaled_gear_is_as_small_as_its_load_allows_and_the_catalogue_loses(make):
    study = arm_study(make, bare_motor(make))
    study = replace(study, catalog=Catalog(study.catalog.motors, series(make)))
    free = dict.fromkeys(("j1", "j2"), FreeRatio(40.0, 120.0, "X"))
    found = free_ratios(study, free=free, drives=dict.fromkeys(("j1", "j2"), ("m1", "x45-50")))
    for joint in found.joints:
        assert joint.gear.repeated_peak_torque >= 5.0
        sized = ("gear repeated peak torque", "gear average torque", "gear momentary peak torque")
        assert joint.utilisation <= 1.0 or joint.binding not in sized
        assert 40.0 <= joint.low <= joint.best <= joint.high <= 120.0
        holding = [gear for gear in joint.gears if gear.verdict != "FAIL"]
        # A row is larger than its load needs, so it heats more; rows that fall may be too small to.
        assert holding and all(gear.excess > 0.0 for gear in holding)
        assert list(joint.gears) == sorted(joint.gears, key=lambda g: abs(math.log(g.ratio / joint.best)))
    assert any("power laws" in note for note in found.notes)


def test_bad_input_is_told(make):
    study = arm_study(make)
    for arguments, word in (
        ({"free": {}}, "free_ratio"),
        ({"free": {"j3": WIDE}}, "j3"),
        ({"free": {"j1": FreeRatio(1.0, 9.0, "Y")}}, "series"),
        ({"free": {"j1": FreeRatio(1.0, 9.0, None, "m7")}}, "m1"),
        ({"free": {"j1": WIDE}, "goal": "heats"}, "heat"),
        ({"free": {"j1": WIDE}, "drives": {"j3": ("m1", "")}}, "drives.j3: is no joint"),
        ({"free": {"j1": WIDE}, "drives": {"j2": ("m1", "g9")}}, "drives.j2.gear: is not in the catalogue"),
    ):
        with pytest.raises(InputError, match=word):
            free_ratios(study, **arguments)
    unknown = replace(
        study, catalog=Catalog({"m1": replace(study.catalog.motors["m1"], rotor_inertia=None)}, study.catalog.gears)
    )
    with pytest.raises(InputError, match="rotor inertia"):
        free_ratios(unknown, free={"j1": WIDE}, drives={"j2": ("m1", "")})
