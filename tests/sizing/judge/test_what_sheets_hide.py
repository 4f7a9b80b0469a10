"""What is added to a figure, or to its limit, where the data sheet of a motor is silent: friction, heat, inductance.

Worked out by numpy from docs/checks.md, on axes whose numbers are all different; both sides of each case.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from one_axis import BRAKE, SAFETY, constant, mean, random_axis, rates, resistance
from scipy.optimize import brentq

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.friction import Friction
from drivetrain.sizing.judge.cases import power_allowance
from drivetrain.study.model import Stop

CLOSE = 1e-9  # relative: the same sums in another order
WARMEST, LEAST_LIMIT, POOREST_PATH, QUICKEST, WINDING, NOMINAL = 155.0, 84.0, 5.2, 3.5, 0.55, 0.58
QUIET = dict.fromkeys(("no_load_current", "no_load_speed"))
COOL = dict.fromkeys(("resistance_winding_housing", "resistance_housing_ambient"))
SLOW = {"winding_time_constant": None}
HARD, HIDDEN = {"stop": Stop(current=30.0), "motor_friction": None}, {"motor_friction": None}
SPRING = {"stiffness_1": 5e3, "stiffness_2": 6e3, "stiffness_3": 8e3, "torque_1": 3.0, "torque_2": 9.0}
KINDS = {  # changes of motor, gear, task and study
    "friction": (QUIET, {}, HIDDEN, {}),
    "friction in a stop": (QUIET, {}, HARD, {}),
    "friction in a stop on a stiffening spring": (QUIET, {"ratio": -50.0, **SPRING}, HARD, {}),
    "friction in a stop on a spring half known": (QUIET, {"stiffness_1": 5e3, "stiffness_2": 6e3}, HARD, {}),
    "friction in a stop on a softening spring": (QUIET, {**SPRING, "stiffness_3": 4e3}, HARD, {}),
    "friction in a stop of a mesh that locks": (QUIET, {"backdriving_efficiency": -0.2}, HARD, {}),
    "friction in a stop of a mesh that nearly locks": (QUIET, {"backdriving_efficiency": 0.05}, HARD, {}),
    "friction that alone warms too much": (QUIET | {"max_winding_temperature": 36.0}, {}, HIDDEN, {}),
    "friction that leaves no current": (QUIET | {"max_winding_temperature": 42.5}, {}, HIDDEN, {}),
    "friction of a motor without a limit": (QUIET | {"max_winding_temperature": None}, {}, HIDDEN, {}),
    "friction and heat": (QUIET | COOL, {}, HIDDEN, {}),
    "stated friction": (QUIET, {}, {}, {}),
    "a joint that never moves": (QUIET | COOL | SLOW, {}, HIDDEN, {"moves": False}),
    "factors below 1": (QUIET | COOL | SLOW, {}, HIDDEN, {"safety": replace(SAFETY, peak_torque=0.7)}),
    "stronger magnets": (QUIET | COOL | {"magnet_coefficient": 0.001}, {}, HIDDEN, {}),
    "heat": (COOL | SLOW, {}, {}, {}),
    "heat of a slow winding": (COOL | {"winding_time_constant": 0.7}, {}, {}, {}),
    "heat of a motor that may be hot": (COOL | SLOW | {"max_winding_temperature": 170.0}, {}, {}, {}),
    "heat without a limit": (COOL | SLOW | {"max_winding_temperature": None}, {}, {}, {}),
    "heat without a limit in cold air": (COOL | SLOW | {"max_winding_temperature": None}, {}, {}, {"ambient": 9.0}),
    "no limit": (SLOW | {"max_winding_temperature": None}, {}, {}, {}),
    "heat of a motor of unknown mass": (COOL | SLOW | {"mass": None}, {}, {}, {}),
    "heat through a mounting": (COOL | SLOW, {}, {"housing_to_ambient": 1.9}, {}),
    "heat through a poor mounting": (COOL | SLOW, {}, {"housing_to_ambient": 5.6}, {}),
    "too much heat": (COOL | SLOW | {"max_winding_temperature": 60.0}, {}, {}, {}),
    "heat of two parts": (COOL | {"winding_time_constant": 0.2}, {}, {}, {"mixed": True}),
    "heat with drag": (COOL | SLOW, {
        "mesh_efficiency": 0.85, "drag_torque": 0.013, "drag_speed": 40.0, "drag_speed_exponent": 0.45, "kind": "rv",
        "drag_temperature_1": 0.021, "drag_temperature_2": 1.7e-4, "seal_drag_torque": 0.004}, {},
        {"gear_temperature": 5.0}),
    "no continuous current": ({"nominal_current": None}, {}, {}, {}),
    "neither limit nor continuous current": (
        {"nominal_current": None, "max_winding_temperature": None}, {}, {}, {}),
    "inductance": ({"inductance": None}, {}, {}, {}),
    "inductance of a joint that hardly holds": ({"inductance": None}, {}, {"friction": Friction()}, {
        "size": 1e-4, "moves": False}),
    "inductance without a limit": ({"inductance": None, "max_winding_temperature": None}, {}, {}, {}),
}  # fmt: skip


@pytest.fixture(params=KINDS)
def op(make, request):
    motor, gear, task, changes = KINDS[request.param]
    return random_axis(make, motor, gear, task, **changes)


def limit_of(op):
    """Highest temperature of the winding, or None."""
    limit = op.drive.motor.max_winding_temperature
    return None if limit is None else limit - op.safety.temperature_margin


def more_torque(op):
    return max(op.safety.peak_torque, 1.0)


def friction_of(op):
    """14 % of the continuous torque at 25 C, of a joint that moves and whose study states none."""
    motor = op.drive.motor
    if motor.no_load_current is not None or op.task.motor_friction is not None or not op.demand.moves:
        return 0.0
    current, limit = motor.nominal_current, motor.max_winding_temperature
    if limit is not None and motor.resistance_housing_ambient is not None:
        path = motor.resistance_winding_housing + motor.resistance_housing_ambient
        current = min(current, math.sqrt((limit - 25.0) / (path * resistance(motor, limit))))
    return 0.14 * motor.torque_constant * current


def friction_rise(op):
    """By what the loss of a hidden friction may warm a winding that is just below its limit without it [K]."""
    motor, friction, air = op.drive.motor, friction_of(op), op.study.ambient
    if friction == 0.0 or motor.resistance_housing_ambient is None:
        return 0.0
    limit = limit_of(op) or WARMEST
    path = motor.resistance_winding_housing + motor.resistance_housing_ambient
    left = limit - air - motor.resistance_housing_ambient * friction * op.figures.mean_input_speed
    whole = math.sqrt(max(left, 0.0) / (path * resistance(motor, limit)))
    current = max(whole - friction / constant(motor, limit), 0.0)
    return limit - air - brentq(lambda x: path * current**2 * resistance(motor, air + x) - x, -1.0, 400.0, xtol=1e-12)


def response(values, steps, constant):
    """The largest value of a first-order response to values that hold from sample to sample of a repeated cycle."""
    left, reached = np.exp(-steps / constant), 0.0
    for value, stays in zip(values, left, strict=True):
        reached = reached * stays + value * (1.0 - stays)
    reached, found = reached / (1.0 - np.prod(left)), []
    for value, stays in zip(values, left, strict=True):
        found.append(reached)
        reached = reached * stays + value * (1.0 - stays)
    return max(found)


def heating(op):
    """Current that a winding needs in reserve where its temperature is not known [A]."""
    motor, demand, gear, traces = op.drive.motor, op.demand, op.drive.gear, op.judgement.series.traces
    k, torque, rms = constant(motor, op.figures.magnet_temperature), op.motor_torque, op.figures.rms_current
    slowest = motor.winding_time_constant or QUICKEST * math.sqrt(motor.mass or 0.03)
    still, largest = demand.at_rest, rms**2
    share = np.where(still & (np.roll(still, 1) | np.roll(still, -1)), 1.0, 0.0)  # a sample alone is no rest
    for part in demand.cycle.parts:
        rows, values = range(part.start, part.stop - 1), []
        for i in rows:
            if share[i] and share[i + 1]:
                ratios = _phase_share(op, i), _phase_share(op, i + 1)
                excess = [one * torque[n] ** 2 for one, n in zip(ratios, (i, i + 1), strict=True)]
                values.append(2.0 * np.mean(excess) / k**2)  # all of the loss of one phase
            elif _phase_share(op, i) and _phase_share(op, i + 1):
                raise AssertionError("two samples that rest in part, but not between them")
            else:
                values.append(rms**2 + WINDING * ((torque[i] / k) ** 2 - rms**2))
        largest = max(largest, response(np.array(values), np.diff(demand.time[part]), slowest))
    warm, own = op.study.gear_temperature, 0.0
    if gear.drag_torque:
        d = min(max(20.0 if warm is None else warm, -10.0), 40.0) - 20.0
        own = math.exp(-gear.drag_temperature_1 * d + gear.drag_temperature_2 * d * d)
    heat = mean(op, traces.friction_loss + op.task.gear_heat * (traces.mesh_loss + own * traces.drag_loss))
    largest *= (k / constant(motor, WARMEST)) ** 2
    limit, stated = limit_of(op) or LEAST_LIMIT, limit_of(op) is not None
    mounting = op.task.housing_to_ambient
    room = limit - op.study.ambient
    left = room - (mounting or POOREST_PATH / (motor.mass or 0.03) ** (2.0 / 3.0)) * heat
    if left <= 0.0 or (mounting and mounting * resistance(motor, limit) * largest > left):
        return math.inf
    rated = room if stated else limit - min(op.study.ambient, 25.0)
    return max(math.sqrt(largest * rated / left) - rms, 0.0)


def _phase_share(op, k):
    """Share of the time around a sample in which the joint rests."""
    time, still, found = op.demand.time, op.demand.at_rest, []
    part = next(one for one in op.demand.cycle.parts if one.start <= k < one.stop)
    for i in (k - 1, k):
        if part.start <= i < part.stop - 1:
            found.append((time[i + 1] - time[i], still[i] and still[i + 1]))
    return sum(step for step, rests in found if rests) / sum(step for step, _ in found)


def test_allowances(op):
    motor, figures, more = op.drive.motor, op.figures, more_torque(op)
    limit, friction, peak = limit_of(op), friction_of(op), figures.motor_current
    hottest, rise, found = limit or WARMEST, friction_rise(op), op.judgement.case.allowance
    magnets, known = figures.magnet_temperature, motor.resistance_housing_ambient is not None
    assert found.torque == pytest.approx(friction, rel=CLOSE)
    assert found.temperature == pytest.approx(rise, rel=1e-8)
    current = friction / constant(motor, hottest)
    volts = more * resistance(motor, hottest) * current
    unknown = 0.0 if known else max(WARMEST - (motor.max_winding_temperature or op.study.ambient), 0.0)
    if motor.winding_time_constant is not None or not known:
        assert found.winding_temperature == pytest.approx(rise, rel=1e-8)
    warmer = resistance(motor, rise + unknown) - resistance(motor, 0.0)
    assert found.resistance == pytest.approx(warmer, rel=1e-8)
    current += peak * abs(motor.magnet_coefficient) * rise
    volts += more * peak * warmer
    rms = current
    if limit is None or not known:
        rms += heating(op)
        current += (constant(motor, magnets) / constant(motor, WARMEST) - 1.0) * peak
    if motor.nominal_current is None:
        rms += (1.0 / NOMINAL - 1.0) * figures.rms_current
    if motor.inductance is None:
        weak = constant(motor, op.study.ambient if limit is None else limit)
        volts += more * 2e-3 * motor.resistance * np.abs(rates(op)).max() / weak
    assert found.current == pytest.approx(current, rel=1e-8) and (found.overload == 0.0 or current > 0.0)
    assert found.rms_current == pytest.approx(rms, rel=1e-8)
    assert found.voltage == pytest.approx(volts, rel=1e-8)
    gear, stop = op.drive.gear, 0.0
    if friction and op.task.stop.ramp is None:
        stiffens = (gear.stiffness_3 or 2.2 * gear.stiffness_1) / gear.stiffness_1 if gear.stiffness_2 else 1.0
        driven = 2.0 - 1.0 / 0.8 if gear.backdriving_efficiency is None else gear.backdriving_efficiency
        swings = 2.0 * max(stiffens, 1.0)
        stop = swings * abs(gear.ratio) * friction / driven if driven > 0.0 else math.nan
    assert found.stop_torque == pytest.approx(stop, rel=CLOSE, nan_ok=True)


def test_power_that_no_sheet_tells(op):
    """Of hidden friction at its speed, and of the current and the resistance that it adds: once, and in the mean."""
    found, motor, figures = op.judgement.case.allowance, op.drive.motor, op.figures
    ohms = resistance(
        motor, op.study.ambient if motor.max_winding_temperature is None else motor.max_winding_temperature
    )
    wanted = []
    for speed, amperes in (
        (figures.input_speed, figures.motor_current),
        (figures.mean_input_speed, figures.rms_current),
    ):
        lost = ohms * ((amperes + found.current) ** 2 - amperes**2)
        wanted.append(found.torque * speed + lost + found.resistance * (amperes + found.current) ** 2)
    told = power_allowance(op.judgement.case.reshape(1))[0]
    np.testing.assert_allclose(told, wanted, rtol=1e-8)


NOTHING = [  # a number that is not known, and next to nothing
    ("motor", "rotor_inertia", 1e-30), ("gear", "inertia", 0.0), ("motor", "inductance", 1e-30),
    ("brake", "power", 1e-30), ("amplifier", "standby_power", 0.0), ("amplifier", "on_resistance", 1e-30),
]  # fmt: skip


@pytest.mark.parametrize(("part", "name", "least"), NOTHING)
def test_what_is_not_known_counts_as_nothing(make, part, name, least):
    """In the series that are told for information, and in figures whose allowance is told beside."""
    ops = []
    for value in (None, least):
        changes = {one: {name: value} if one == part else {} for one in ("motor", "gear", "brake", "amplifier")}
        row = {"peak_current": 40.0, "continuous_current": 9.0, "on_resistance": 0.02, "standby_power": 5.0}
        task = {"amplifier": Amplifier(**row | changes["amplifier"])}
        brake = replace(BRAKE, inertia=0.0, **changes["brake"])
        ops.append(random_axis(make, changes["motor"], changes["gear"], task, brake=brake))
    one, other = ops
    np.testing.assert_allclose(one.motor_torque, other.motor_torque, rtol=1e-9)
    np.testing.assert_allclose(one.judgement.power, other.judgement.power, rtol=1e-9, atol=1e-12)
    assert one.figures.stop_torque == pytest.approx(other.figures.stop_torque, rel=1e-9)
    assert one.figures.housing_temperature == pytest.approx(other.figures.housing_temperature, rel=1e-9)
    if not one.missing:
        assert one.figures.voltage == pytest.approx(other.figures.voltage, rel=1e-9)


@pytest.mark.parametrize("nominal", [6.0, 0.3])
def test_hidden_friction_in_the_overload_of_an_amplifier(make, nominal):
    """As much more as a factor on the current that adds the same amperes, many or few."""
    amplifier = Amplifier(peak_current=40.0, continuous_current=4.3, peak_time=1.2)
    motor, task = QUIET | {"nominal_current": nominal}, {"motor_friction": None, "amplifier": amplifier}
    op = random_axis(make, motor, task=task)
    found, grown = op.judgement.case.allowance, 1.0 + op.judgement.case.allowance.current / op.figures.motor_current
    stronger = random_axis(make, motor, task=task, safety=replace(SAFETY, rms=SAFETY.rms * grown))
    assert 0.0 < op.figures.overload < stronger.figures.overload < math.inf
    assert found.overload == pytest.approx(stronger.figures.overload - op.figures.overload, rel=CLOSE)


@pytest.mark.parametrize("limit", [60.0, 300.0])
def test_a_winding_of_unknown_time_constant(make, limit):
    """As hot as with the shortest that it may have, where that is too hot; else a bound of it is enough."""
    row = {"max_winding_temperature": limit, "housing_time_constant": 3e3}
    op = random_axis(make, row | {"winding_time_constant": None})
    quick = random_axis(make, row | {"winding_time_constant": QUICKEST * math.sqrt(op.drive.motor.mass)})
    more, found = quick.figures.phase_temperature - op.figures.phase_temperature, op.judgement.case.allowance
    assert more > 0.2
    if limit < 100.0:
        assert found.winding_temperature == pytest.approx(more, rel=1e-6)
    else:
        assert more < found.winding_temperature < 30.0 + more
    # The temperatures at the samples are those of the mean.
    np.testing.assert_allclose(op.winding_temperature, op.winding_temperature[0], rtol=1e-3)
