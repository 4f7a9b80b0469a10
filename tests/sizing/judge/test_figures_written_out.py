"""Figures of single axes where one thing decides, by formulas written out here; test_random_axes.py has them all."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from one_axis import AMBIENT, COPPER, PEAK, axis, constant, rates, resistance
from scipy.optimize import brentq

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.friction import Friction
from drivetrain.study.model import DriveMass, Safety, StiffnessWish, Stop

WINDING_LIMIT = 125.0


@pytest.mark.parametrize(("inductance", "terminal"), [(1e-9, 0.3), (0.02, 0.3), (0.02, 3.0)])
def test_the_largest_voltage(make, inductance, terminal):
    """Cold and as warm as the cycle makes it, with the safety factor on torque and without; rising current counted.

    Of much resistance a warm winding needs the most, of little the cold motor, whose magnets are stronger.
    """
    motor = replace(make.motor, resistance=terminal, inductance=inductance, magnet_coefficient=-0.002)
    op = axis(make, motor)
    torque, speed, found = op.motor_torque, op.motor_speed, []
    for magnets, winding in ((AMBIENT, AMBIENT), (op.figures.magnet_temperature, op.winding_temperature)):
        k, ohms = constant(motor, magnets), resistance(motor, winding)
        found += [k * speed + (ohms * torque + inductance * rates(op)) / k * more for more in (1.0, PEAK)]
    largest = np.abs(found).max(axis=1)
    assert (largest[2:].max() > largest[:2].max()) == (terminal > 1.0)
    assert op.figures.voltage == pytest.approx(largest.max(), rel=1e-9)


def test_starting_takes_voltage_of_a_hot_winding(make):
    """Held under a load, then let go against much friction that sticks: what the start takes is the largest voltage."""
    time, zero = np.array([0.0, 0.5, 1.0, 1.0, 1.1, 1.2]), np.zeros(6)
    speed = np.array([0.0, 0.0, 0.0, 0.0, 0.01, 0.0])
    friction = Friction(coulomb=1.0, static=9.0)
    cycle = make.table_cycle(time, zero + 8.0, speed, np.array([0.0, 0.0, 0.0, 0.1, 0.0, -0.1]))
    motor = replace(make.motor, magnet_coefficient=-0.002, inductance=1e-9)
    op = axis(make, motor, cycle=cycle, task={"friction": friction})
    start = op.figures.motor_torque
    assert start > 1.5 * np.abs(op.motor_torque[[0, 1]]).max()
    at_rest = np.flatnonzero(op.demand.speed == 0.0)[:4]
    hottest = resistance(motor, op.winding_temperature[at_rest]).max()
    k = constant(motor, op.figures.magnet_temperature)
    assert op.figures.voltage == pytest.approx(PEAK * hottest * start / k, rel=2e-3)  # which rest sample is hottest


@pytest.mark.parametrize("ratio", [50.0, -50.0])
def test_speeds_of_a_gear_whichever_way_it_turns(make, ratio):
    op = axis(make, gear=replace(make.gear, ratio=ratio))
    speed, time = op.demand.speed, op.demand.time
    mean = np.trapezoid(np.abs(speed), time) / time[-1]
    assert op.figures.input_speed == pytest.approx(50.0 * np.abs(speed).max(), rel=1e-12)
    assert op.figures.mean_input_speed == pytest.approx(50.0 * mean, rel=1e-12)


@pytest.mark.parametrize(("cold", "ratio"), [(None, 50.0), (-15.0, -50.0)])
def test_a_blocked_output(make, cold, ratio):
    """Energy of the rotor at its highest speed goes into the gear's spring, and the motor pushes on at its current."""
    motor = replace(make.motor, magnet_coefficient=-0.002)
    gear, stiff = replace(make.gear, ratio=ratio, stiffness_1=4e3), 1.3 * 4e3  # as stiff as it may be
    amplifier = Amplifier(peak_current=12.0, continuous_current=10.0)
    op = axis(make, motor, gear, task={"amplifier": amplifier, "stop": Stop()}, cold_start=cold)
    turn = gear.ratio * np.abs(op.demand.speed).max()
    energy = 0.5 * (motor.rotor_inertia + gear.inertia) * turn**2
    assert op.figures.coast_torque == pytest.approx(math.sqrt(2.0 * stiff * energy), rel=1e-9)
    # Magnets as strong as in the cold, or as at 25 C where they are no colder; then k x^2 / 2 = energy + push x.
    push = 50.0 * (motor.torque_constant if cold is None else constant(motor, cold)) * 12.0
    x = brentq(lambda x: 0.5 * stiff * x * x - energy - push * x, 0.0, 1.0)
    assert op.figures.jam_torque == pytest.approx(stiff * x, rel=1e-9)


def test_friction_that_no_sheet_states(make):
    """Its torque, current and voltage at a winding at its limit, and the rise that it adds to one just below it."""
    motor = replace(make.motor, magnet_coefficient=-0.002, no_load_current=None, no_load_speed=None)
    op = axis(
        make,
        motor,
        task={"motor_friction": None, "stop": Stop()},
        safety=Safety(peak_torque=PEAK, temperature_margin=5.0),
    )
    limit = WINDING_LIMIT - 5.0
    k, ohms = constant(motor, limit), resistance(motor, limit)
    found = op.judgement.case.allowance
    friction = found.torque
    more = friction / k
    inner, outer = motor.resistance_winding_housing, motor.resistance_housing_ambient
    assert friction > 0.0
    assert found.stop_torque == pytest.approx(2.0 * 50.0 * friction / (2.0 - 1.0 / 0.8), rel=1e-9)
    # What heats the winding to its limit beside the friction's own loss, and how warm less current leaves it.
    left = limit - AMBIENT - outer * friction * op.figures.mean_input_speed
    current = math.sqrt(left / ((inner + outer) * ohms)) - more
    rise = brentq(lambda x: (inner + outer) * current**2 * resistance(motor, AMBIENT + x) - x, 0.0, 200.0)
    assert found.temperature == pytest.approx(limit - AMBIENT - rise, rel=1e-9)
    assert found.winding_temperature == pytest.approx(found.temperature, rel=1e-9)
    weaker = op.figures.motor_current * 0.002 * found.temperature
    assert found.current == pytest.approx(more + weaker, rel=1e-9)
    warmer = motor.resistance * COPPER * found.temperature
    assert found.resistance == pytest.approx(warmer, rel=1e-9)
    assert found.voltage == pytest.approx(PEAK * (ohms * more + op.figures.motor_current * warmer), rel=1e-9)


def test_inductance_that_no_sheet_states(make):
    """L di/dt of the steepest torque, with magnets as weak as they become."""
    motor = replace(make.motor, magnet_coefficient=-0.002, inductance=None)
    op = axis(make, motor)
    steepest = np.abs(rates(op)).max()
    henry = op.judgement.case.motor.inductance_allowance
    wanted = PEAK * henry * steepest / constant(motor, WINDING_LIMIT)
    assert henry > 0.0 and op.judgement.case.allowance.voltage == pytest.approx(wanted, rel=1e-9)


def test_data_that_the_torque_hangs_on(make):
    """Without the gear's efficiency, or a rotor inertia, nothing that the motor's torque decides is known."""
    for motor, gear in (
        (make.motor, replace(make.gear, efficiency=None)),
        (replace(make.motor, rotor_inertia=None), make.gear),
    ):
        figures = axis(make, motor, gear).figures
        names = ("motor_torque", "rms_torque", "voltage", "winding_temperature", "phase_temperature", "motor_current")
        assert all(math.isnan(figures[name]) for name in (*names, "gear_loss", "gear_temperature"))


def test_load_inertia_against_the_rotor(make):
    """A point mass on a beam: m l^2 against the rotor at the gear's output, and the spring that swings it as wished."""
    arm = make.planar_arm([0.4], [3.0])
    op = axis(
        make, cycle=make.sines(1, samples=9), arm=arm, drive_mass=DriveMass.INCLUDED, stiffness=StiffnessWish(7.0)
    )
    inertia = 3.0 * 0.4**2 + 1e-4
    rotor = make.motor.rotor_inertia + make.gear.inertia
    assert op.figures.inertia_ratio == pytest.approx(inertia / (50.0**2 * rotor), rel=1e-9)
    assert op.figures.required_stiffness == pytest.approx((2.0 * math.pi * 7.0) ** 2 * inertia, rel=1e-9)


@pytest.mark.parametrize("times", [1.0 - 1e-6, 1.0 + 1e-6])
def test_a_limit_that_holds_only_without_what_no_sheet_states(make, times):
    """The safety factor counts on both: just below their sum nothing is proven, just above it the check is made."""
    motor, joint = replace(make.motor, no_load_current=None, no_load_speed=None), {"motor_friction": None}
    op = axis(make, motor, task=joint)
    asked, more = op.figures.motor_current, op.judgement.case.allowance.current
    peak = PEAK * (asked + more) * times
    op = axis(make, motor, task={"amplifier": Amplifier(peak_current=peak, continuous_current=20.0), **joint})
    used = op.judgement.used["amplifier peak current"]
    if times < 1.0:
        assert more > 0.0 and math.isnan(used)
    else:
        assert used == pytest.approx(PEAK * asked / peak, rel=1e-9)


@pytest.mark.parametrize("ratio", [50.0, -50.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_start_of_a_motion_with_more_friction_than_one_against_the_load(make, ratio, way):
    """A light load of 2 N m helps a joint that sticks with 11 N m where it starts, with 1 N m the other way."""
    time = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 5.0, 5.0, 6.0])
    speed = -way * np.array([0.0, 0.0, 0.0, 0.1, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    acceleration = -way * np.array([0.0, 0.0, 0.1, 0.1, 0.0, 0.0, -0.1, -0.1, 0.0, 0.0, 0.0, 0.0])
    cycle = make.table_cycle(time, np.full(12, way * 2.0), speed, acceleration)
    joint = Friction(1.0, 11.0, tanh_speed=3.0) if way > 0.0 else Friction(11.0, 1.0, tanh_speed=3.0)
    shaft = Friction(0.01, 0.04) if way * ratio > 0.0 else Friction(0.04, 0.01)
    gear = replace(make.gear, ratio=ratio, starting_torque=0.003, inertia=0.0)
    op = axis(make, replace(make.motor, rotor_inertia=1e-15), gear, cycle, {"friction": joint, "motor_friction": shaft})
    assert op.figures.load_torque == pytest.approx(11.0 - 2.0, rel=1e-12)
    assert op.figures.motor_torque == pytest.approx((11.0 - 2.0) / 0.8 / 50.0 + 0.04 + 0.003, rel=1e-12)
    loosening = np.abs(op.demand.loosening_torque)
    assert loosening.max() == pytest.approx(9.0, rel=1e-12) and time[loosening.argmax()] == 1.0


@pytest.mark.parametrize(("share", "stated"), [(0.0, 35.0), (1.0, 35.0), (1.0, 300.0)])
def test_the_temperature_of_a_gear(make, share, stated):
    """As stated where it does not warm the motor, else that of the housing, and no cooler than stated."""
    op = axis(make, task={"gear_heat": share}, gear_temperature=stated)
    housing = op.figures.housing_temperature
    assert AMBIENT < housing < 300.0
    assert op.figures.gear_temperature == (stated if share == 0.0 else max(housing, stated))
