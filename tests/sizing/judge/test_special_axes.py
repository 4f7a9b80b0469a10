"""Axes of which something is not there: no motion, no current of a stop, no limit in a sheet, one thermal node."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from one_axis import AMBIENT, BRAKE, COPPER, FRICTIONS, SAFETY, constant, random_axis, resistance, rubbed
from scipy.optimize import brentq

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.friction import Friction
from drivetrain.study.model import StiffnessWish, Stop

CLOSE = 1e-9  # relative: the same sums in another order
RPM = math.pi / 30.0


STAGES = {"stage_driving": 1.06, "stage_driven": 0.94, "stage_inertia": 4e-6, "staged": 1.0, "inertia": 1e-5}


@pytest.mark.parametrize(("stop", "stages"), [(Stop(ramp=0.35), {}), (Stop(current=30.0), STAGES)])
def test_a_joint_that_never_moves(make, stop, stages):
    """It holds its load, without friction, for ever in one phase; nothing breaks loose and nothing stops."""
    bearing = {"bearing_pitch_diameter": 0.11, "bearing_offset": 0.043, "bearing_dynamic_rating": 9e3, **stages}
    op = random_axis(make, gear=bearing, task={"stop": stop}, moves=False)
    torque, figures, time = op.demand.gear_torque, op.figures, op.demand.time
    largest, k = np.abs(torque).max(), constant(op.drive.motor, op.figures.magnet_temperature)
    held = math.sqrt(np.trapezoid((torque / 50.0) ** 2, time) / time[-1])
    wanted = {
        "joint_torque": largest, "load_torque": largest, "average_load_torque": largest, "momentary_torque": largest,
        "motor_torque": largest / 50.0, "rms_torque": held, "phase_torque": math.sqrt(2.0) * held,
        "phase_current": math.sqrt(2.0) * held / k, "rms_current": math.sqrt(2.0) * held / k, "stop_torque": 0.0,
        "stop_motor_torque": 0.0, "stop_travel": 0.0, "permitted_peaks": math.inf, "input_speed": 0.0,
        "mean_input_speed": 0.0, "gear_loss": 0.0, "gear_life": math.inf,
        "bearing_life": math.inf,
    }  # fmt: skip
    assert {name: figures[name] for name in wanted} == pytest.approx(wanted, rel=CLOSE)
    mirrored = replace(op, demand=replace(op.demand, gear_torque=-torque))
    assert mirrored.figures.load_torque == pytest.approx(largest, rel=CLOSE)
    amplifier = Amplifier(peak_current=40.0, continuous_current=9.0, thermal_time_constant=1e6)
    hot = random_axis(make, task={"stop": stop, "amplifier": amplifier}, moves=False)
    mean = (torque[:-1] ** 2 + torque[:-1] * torque[1:] + torque[1:] ** 2) / 3.0
    square = (
        2.0 * np.diff(time) @ mean / time[-1] / (50.0 * constant(hot.drive.motor, hot.figures.magnet_temperature)) ** 2
    )
    assert hot.figures.overload == pytest.approx(SAFETY.rms**2 * square / 9.0**2, rel=1e-5)


def test_a_single_pose(make):
    """Held for ever: every figure is that of its one sample, and one phase carries twice its share of the loss."""
    op = random_axis(make, moves=False)
    cycle = op.demand.cycle
    names = ("time", "position", "velocity", "acceleration", "torque", "payload", "segment")
    pose = replace(cycle, **{name: getattr(cycle, name)[:1] for name in names})
    names = ("time", "position", "speed", "acceleration", "carrier_acceleration", "gear_torque", "payload", "wrench")
    rows = {name: getattr(op.demand, name)[:1] for name in (*names, "load_inertia", "static_torque")}
    one = replace(op, demand=replace(op.demand, cycle=pose, weights=np.zeros(1), **rows))
    torque, figures, motor = abs(op.demand.gear_torque[0]) / 50.0, one.figures, op.drive.motor
    k, mx, my, _, fx, fy, fz = constant(motor, figures.magnet_temperature), *op.demand.wrench[0]
    wanted = {
        "motor_torque": torque, "rms_torque": torque, "phase_torque": math.sqrt(2.0) * torque,
        "rms_current": math.sqrt(2.0) * torque / k, "tilting_moment": math.hypot(mx, my),
        "radial_load": math.hypot(fx, fy), "axial_load": abs(fz),
        "holding_torque": abs(op.demand.static_torque[0]) / 50.0,
        "inertia_ratio": op.demand.load_inertia[0] / 50.0**2 / (motor.rotor_inertia + 1e-6),
    }  # fmt: skip
    assert {name: figures[name] for name in wanted} == pytest.approx(wanted, rel=CLOSE)
    # Losses of winding, coil and amplifier warm the housing; the phase that carries the amplitude is warmer yet.
    switched = 2.0 * 0.02 * (torque / constant(motor, motor.max_winding_temperature)) ** 2
    square, inner, outer = (torque / k) ** 2, motor.resistance_winding_housing, motor.resistance_housing_ambient
    lost = square * resistance(motor, figures.winding_temperature)
    housing = AMBIENT + outer * (lost + BRAKE.power + 0.35 * (switched + 5.0))
    assert figures.housing_temperature == pytest.approx(housing, rel=1e-6)
    assert figures.winding_temperature == pytest.approx(housing + inner * lost, rel=1e-6)
    slope = motor.resistance * COPPER * square
    rise = inner * lost / (1.0 - 2.0 * inner * slope)
    assert figures.phase_temperature == pytest.approx(housing + inner * lost + rise, rel=1e-6)


def test_the_overload_of_a_joint_that_moves(make):
    """The mean of I^2 where the amplifier follows nothing; its current is straight between samples."""
    amplifier = Amplifier(peak_current=40.0, continuous_current=9.0, thermal_time_constant=1e6)
    op = random_axis(make, task={"amplifier": amplifier})
    torque, time = op.motor_torque, op.demand.time
    mean = (torque[:-1] ** 2 + torque[:-1] * torque[1:] + torque[1:] ** 2) / 3.0
    square = np.diff(time) @ mean / time[-1] / constant(op.drive.motor, op.figures.magnet_temperature) ** 2
    assert op.figures.overload == pytest.approx(SAFETY.rms**2 * square / 9.0**2, rel=1e-5)


UNKNOWN = {  # changes of motor and task: a stop of which nothing is known
    "no current": ({}, {"stop": Stop(), "amplifier": Amplifier()}),
    "a rotor of unknown inertia": ({"rotor_inertia": None}, {"stop": Stop(current=30.0)}),
}


@pytest.mark.parametrize("what", UNKNOWN)
def test_a_stop_that_is_not_known(make, what):
    """The momentary torque is not known either, but where the cycle alone, with the factor on it, is too much."""
    motor, task = UNKNOWN[what]
    for share, known in ((1.0001, False), (0.9999, True)):
        load = random_axis(make, task={"stop": Stop(current=30.0)}).figures.load_torque
        op = random_axis(make, motor, {"momentary_torque": share * SAFETY.peak_torque * load}, task)
        assert math.isnan(op.figures.stop_torque) and op.figures.load_torque == pytest.approx(load, rel=CLOSE)
        assert op.figures.momentary_torque == (
            op.figures.load_torque if known else pytest.approx(math.nan, nan_ok=True)
        )


def test_a_stop_whose_load_is_not_known(make):
    """Without an inertia nothing stops at a current; on a ramp the way is known, the torque is not."""
    op = random_axis(make, task={"stop": Stop(current=30.0)})
    bare = replace(op, demand=replace(op.demand, load_inertia=None))
    assert math.isnan(bare.figures.stop_torque) and math.isnan(bare.figures.stop_travel)
    assert math.isnan(bare.figures.inertia_ratio) and math.isnan(bare.figures.required_stiffness)
    ramp = random_axis(make)
    nothing = ramp.demand.stop._replace(**{name: np.zeros(0) for name in ramp.demand.stop._fields})
    bare = replace(ramp, demand=replace(ramp.demand, stop=nothing))
    assert math.isnan(bare.figures.stop_torque) and math.isnan(bare.figures.momentary_torque)
    assert bare.figures.stop_travel == pytest.approx(0.5 * 0.35 * np.abs(ramp.demand.speed).max(), rel=CLOSE)


@pytest.mark.parametrize("share", [0.9999, 1.0001])
def test_a_stop_that_loads_the_gear_no_more_than_a_cycle_may(make, share):
    """Counts for nothing: as many as one likes."""
    gear, task = {"kind": "strain_wave"}, {"stop": Stop(current=30.0)}
    torque = random_axis(make, gear=gear, task=task).figures.stop_torque
    op = random_axis(make, gear={**gear, "repeated_peak_torque": share * SAFETY.peak_torque * torque}, task=task)
    assert (op.figures.permitted_peaks == math.inf) == (share > 1.0)


def test_a_current_that_does_not_stop_the_load(make):
    op = random_axis(make, task={"stop": Stop(current=0.5)})
    assert op.figures.stop_travel == math.inf and op.figures.stop_torque < math.inf


def test_a_load_that_stops_by_itself(make):
    """It is lifted from every state, so all of its weight brakes, beside the current, through a gear without losses."""
    op = random_axis(make, task={"stop": Stop(current=0.5), "motor_friction": Friction()})
    speed, zero = op.demand.speed, np.zeros(len(op.demand.time))
    lifted, inertia = (12.0 + np.abs(op.demand.gear_torque)) * np.sign(speed), 0.02 + zero
    demand = replace(
        op.demand, gear_torque=lifted, load_inertia=inertia, acceleration=zero, carrier_acceleration=zero
    )  # fmt: skip
    moving, motor = speed != 0.0, op.drive.motor
    whole = 0.02 + 50.0**2 * (motor.rotor_inertia + op.drive.gear.inertia)
    slowing = (50.0 * motor.torque_constant * 0.5 + np.abs(lifted[moving])) / whole
    travel = (0.5 * speed[moving] ** 2 / slowing).max()
    assert replace(op, demand=demand).figures.stop_travel == pytest.approx(travel, rel=CLOSE)


def test_an_inertia_ratio_without_that_of_the_gear(make):
    """Of rotor and brake alone."""
    op = random_axis(make, gear={"inertia": None})
    rotor = 50.0**2 * (make.motor.rotor_inertia + BRAKE.inertia)
    assert op.figures.inertia_ratio == pytest.approx(op.demand.load_inertia.max() / rotor, rel=CLOSE)
    speed = 50.0 * np.abs(op.demand.speed).max()
    held = np.abs(op.demand.static_torque).max() / 50.0
    heat = 0.5 * (op.demand.load_inertia.max() + rotor) / 50.0**2 * speed**2 * 0.9 / (0.9 - held)
    assert op.figures.stopping_energy == pytest.approx(heat, rel=CLOSE)


def test_forces_of_a_joint_that_states_none(make):
    op = random_axis(make)
    figures = replace(op, demand=replace(op.demand, wrench=None, static_torque=None)).figures
    names = ("tilting_moment", "radial_load", "axial_load", "bearing_static_load", "bearing_life", "holding_torque")
    assert all(math.isnan(figures[name]) for name in (*names, "stopping_energy"))


def test_limits_of_a_sheet_and_those_that_are_assumed(make):
    """Printed ones, what stands in for them, and what the shipped catalogue's weakest rows print."""
    gear = {"repeated_peak_torque": 37.0, "continuous_torque": 21.0, "average_torque_limit": 19.0, "stiffness_1": 5e3}
    op = random_axis(make, gear=gear, stiffness=StiffnessWish(7.0, scatter=0.3))
    limits, assumed = op.judgement.case.limits, op.judgement.case.assumed_limits
    found = limits.repeated_peak_torque, limits.average_torque, limits.winding_temperature, limits.stiffness
    assert found == pytest.approx((37.0, 19.0, 121.0, 3.5e3), rel=CLOSE)
    weakest = assumed.momentary_torque, assumed.input_speed, assumed.mean_input_speed, assumed.motor_speed
    assert weakest == pytest.approx((1.4 * 37.0, 3500.0 * RPM, 0.38 * 1000.0, 0.92 * 950.0), rel=CLOSE)
    assert assumed.brake_energy == pytest.approx(26.0 * BRAKE.static_torque, rel=CLOSE)
    bare = dict.fromkeys(("repeated_peak_torque", "average_torque_limit", "max_input_speed"))
    op = random_axis(make, gear=gear | bare)
    limits, assumed = op.judgement.case.limits, op.judgement.case.assumed_limits
    found = limits.repeated_peak_torque, limits.average_torque, assumed.momentary_torque, assumed.mean_input_speed
    assert found == pytest.approx((21.0, 21.0, 1.4 * 21.0, 2000.0 * RPM), rel=CLOSE)


@pytest.mark.parametrize("mixed", [False, True])
def test_heat_of_a_motor_of_one_thermal_node(make, mixed):
    """Each part of a mix warms the whole motor by itself, its gear's drag with it; the hottest one counts."""
    nodes = dict.fromkeys(("resistance_winding_housing", "resistance_housing_ambient"))
    gear = {
        "mesh_efficiency": 0.85, "drag_torque": 0.013, "drag_speed": 40.0, "drag_speed_exponent": 0.45,
        "drag_temperature_1": 0.021, "drag_temperature_2": 1.7e-4, "seal_drag_torque": 0.004,
    }  # fmt: skip
    op = random_axis(make, nodes | {"resistance_winding_ambient": 2.6}, gear, mixed=mixed)
    motor, demand, turn, torque, path = op.drive.motor, op.demand, op.motor_speed, op.motor_torque, 2.6
    load = demand.gear_torque + rubbed(FRICTIONS[0], demand.speed)
    loss, power = 1.0 / 0.85 - 1.0, load * demand.speed
    mesh = loss * np.abs(power) + 0.004 * np.abs(turn)
    dragged = 0.013 * (np.abs(turn) / 40.0) ** 0.45 * np.abs(turn)
    switched = 2.0 * 0.02 * (torque / constant(motor, motor.max_winding_temperature)) ** 2
    rubs = rubbed(FRICTIONS[1], turn) * turn + 0.35 * (switched + 5.0) + BRAKE.power
    parts, lost = [], 0.0
    for part, share in zip(demand.cycle.parts, demand.cycle.shares, strict=True):
        time, a, b = demand.time[part], torque[part][:-1], torque[part][1:]
        square = np.diff(time) @ (a * a + a * b + b * b) / 3.0 / np.ptp(time)
        meshed, own, heat = (np.trapezoid(one[part], time) / np.ptp(time) for one in (mesh, dragged, rubs))

        def warm(temperature):
            d = min(max(temperature, -10.0), 40.0) - 20.0
            return math.exp(1.7e-4 * d * d - 0.021 * d)

        def rise(at, copper, meshed=meshed, own=own, heat=heat):
            return AMBIENT + path * (copper + heat + 0.6 * (meshed + own * warm(at)))

        coil = square * resistance(motor, -10.0) / constant(motor, -10.0) ** 2
        settled = brentq(lambda at, rise=rise, coil=coil: rise(at, coil) - at, 0.0, 900.0, xtol=1e-9)
        lost += share * (meshed + own * warm(settled))
        parts.append((square, heat + 0.6 * (meshed + own * warm(settled))))
    assert op.figures.gear_loss == pytest.approx(lost, rel=1e-6)
    k = constant(motor, op.figures.magnet_temperature)
    slope = motor.resistance * 0.0039 / k**2
    cold = resistance(motor, AMBIENT) / k**2
    rises = [path * (square * cold + heat) / (1.0 - path * square * slope) for square, heat in parts]
    assert op.figures.winding_temperature == pytest.approx(AMBIENT + max(rises), abs=2e-2)  # 1.5 s of 2e4 s
    assert op.figures.magnet_temperature == pytest.approx(AMBIENT + max(rises), abs=2e-2)
