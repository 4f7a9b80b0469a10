"""What brakes and lifts the bus, what amplifiers take: worked by hand, against an integrated bus, deciding a choice."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply, bus_peak
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import build_mix
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.missing import missing_words
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.parts.selection import Wanted
from drivetrain.study.parts.verdicts import Verdict

PEAK, BUS = "supply peak braking power", "supply bus voltage"
NEVER = math.inf


def shared(evaluation):
    return {check.name: check for check in evaluation.shared}


def pulses(rng, count=400):
    """Some seconds of power drawn and fed back, more drawn than fed back."""
    time = np.cumsum(rng.uniform(5e-3, 1.5e-2, count))
    phase = rng.uniform(0.0, 6.0, 2)
    return time - time[0], 60.0 * np.sin(7.0 * time + phase[0]) + 25.0 * np.sin(23.0 * time + phase[1]) + 15.0


def integrated(voltage, capacity, threshold, resistance, time, power, rounds=2, parts=40):
    """C V dV = -P dt in small steps: a rectifier holds V up, a resistor above the threshold pulls it down."""
    volts = highest = voltage
    for _ in range(rounds):
        for k in range(len(time) - 1):
            for drawn in np.interp((np.arange(parts) + 0.5) / parts, [0.0, 1.0], power[k : k + 2]):
                h = (time[k + 1] - time[k]) / parts
                drawn += volts**2 / resistance if volts > threshold else 0.0
                volts = max(volts - drawn * h / (capacity * volts), voltage)
                highest = max(highest, volts)
    return highest


def test_a_braking_run_lifts_the_bus_by_its_energy():
    """7.4 J into 4.7 mF at 48 V: sqrt(48^2 + 2 7.4/0.0047) = 73.8 V."""
    time, power = np.array([0.0, 0.1, 0.2, 1.0]), np.array([0.0, -74.0, 0.0, 50.0])
    found = bus_peak(48.0, 4.7e-3, NEVER, NEVER, time, power, 48.0)
    assert found.voltage == pytest.approx(math.sqrt(48.0**2 + 2.0 * 7.4 / 4.7e-3), rel=1e-12)
    assert found.voltage == pytest.approx(73.8, abs=0.05) and found.sample == 2 and found.burnt == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_the_bus_is_that_of_its_differential_equation(seed):
    """Energies step by step against the voltage itself in 40 parts of every step."""
    time, power = pulses(np.random.default_rng(seed))
    plain = bus_peak(48.0, 5e-3, NEVER, NEVER, time, power, 48.0).voltage
    assert plain == pytest.approx(integrated(48.0, 5e-3, NEVER, NEVER, time, power), rel=2e-3)
    threshold = 0.5 * (48.0 + plain)
    for resistance in (20.0, 200.0):
        found = bus_peak(48.0, 5e-3, threshold, resistance, time, power, 48.0)
        wanted = integrated(48.0, 5e-3, threshold, resistance, time, power)
        assert found.voltage == pytest.approx(wanted, rel=2e-3)
        assert found.voltage < plain and found.burnt > 0.0


def test_a_resistor_that_is_too_weak_lets_the_bus_rise_to_where_it_burns_all():
    """400 W on 22 ohm: sqrt(400 22) = 93.8 V after many time constants of R C/2 = 52 ms, whatever the threshold."""
    for count in (3, 301):
        time = np.linspace(0.0, 3.0, count)
        power = np.where(time < 1.6, -400.0, 400.0)
        found = bus_peak(48.0, 4.7e-3, 60.0, 22.0, time, power, 48.0)
        assert found.voltage == pytest.approx(math.sqrt(400.0 * 22.0), rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_bus_does_not_depend_on_where_a_line_is_sampled(seed):
    """Power that changes its sign between samples: 20 samples of the same lines in every step, one at each zero."""
    rng = np.random.default_rng(seed)
    time, power = np.arange(41) * 0.02, rng.uniform(-40.0, 60.0, 41)
    turns = np.flatnonzero(power[:-1] * power[1:] < 0.0)
    zeros = time[turns] + 0.02 * power[turns] / (power[turns] - power[turns + 1])
    fine = np.unique(np.concatenate([np.linspace(0.0, time[-1], 801), time, zeros]))
    for threshold, resistance in ((NEVER, NEVER), (49.5, 49.5**2 / 60.0)):
        bus = 48.0, 4.7e-3, threshold, resistance
        wanted = bus_peak(*bus, fine, np.interp(fine, time, power), 48.0).voltage
        assert bus_peak(*bus, time, power, 48.0).voltage == pytest.approx(wanted, rel=1e-9)


def test_more_that_helps_lowers_the_bus():
    time, power = pulses(np.random.default_rng(9))
    volts = [bus_peak(48.0, c, NEVER, NEVER, time, power, 48.0).voltage for c in (1e-3, 3e-3, 1e-2)]
    assert volts == sorted(volts, reverse=True)
    volts = [bus_peak(48.0, 1e-3, 60.0, r, time, power, 48.0).voltage for r in (10.0, 40.0, NEVER)]
    assert volts == sorted(volts)


def test_a_cycle_that_feeds_back_more_than_it_takes_never_ends():
    time, power = np.linspace(0.0, 1.0, 11), np.full(11, -5.0)
    assert bus_peak(48.0, 1e-2, NEVER, NEVER, time, power, 48.0).voltage == math.inf
    burnt = bus_peak(48.0, 1e-2, 55.0, 55.0**2 / 20.0, time, power, 48.0)
    assert burnt.voltage == pytest.approx(55.0, rel=1e-2) and burnt.burnt == pytest.approx(5.0, rel=1e-6)


@pytest.fixture
def flywheel(make):
    """A table that speeds up an inertia of 0.2 kg m^2 to 10 rad/s and stops it; the same inertia as everything."""
    time = np.linspace(0.0, 1.0, 401)
    speed = 10.0 * np.sin(np.pi * time) ** 2
    acceleration = 10.0 * np.pi * np.sin(2.0 * np.pi * time)
    return make.study(make.table_cycle(time, 0.2 * acceleration, speed, acceleration))


def least_power(study, make, celsius=25.0):
    """Without gear loss and shaft friction, winding cold: G w (T/G + J G a + R/k^2 ...) by plain numpy."""
    cycle, motor, ratio = study.cycle, make.motor, 50.0
    ohms, constant = winding_resistance(motor, celsius), torque_constant(motor, celsius)
    torque = cycle.torque[:, 0] / ratio + (2e-5 + 1e-6) * ratio * cycle.acceleration[:, 0]
    return torque * ratio * cycle.velocity[:, 0] + ohms / constant**2 * torque**2


def test_what_comes_back_is_that_of_lossless_gears_and_cold_windings(flywheel, make):
    study = replace(flywheel, supply=Supply(48.0, capacity=4.7e-3, max_voltage=120.0))
    evaluation = evaluate(study)
    power, series = least_power(study, make), evaluation.joints["j1"].series
    np.testing.assert_allclose(series.least_power, np.minimum(power, series.electrical_power), rtol=1e-9, atol=1e-9)
    energy = np.trapezoid(np.minimum(power, 0.0), study.cycle.time)
    moving = 0.5 * (0.2 + 50.0**2 * 2.1e-5) * 10.0**2
    assert -energy < moving and -energy > 0.6 * moving  # the rest heats the winding
    told = shared(evaluation)[BUS]
    assert told.required == pytest.approx(math.sqrt(48.0**2 - 2.0 * energy / 4.7e-3), rel=1e-3)
    assert told.verdict is Verdict.PASS and told.time > 0.5
    assert shared(evaluation)[PEAK].verdict is Verdict.NOT_CHECKED  # the voltage says it all
    tight = replace(study, supply=Supply(48.0, capacity=4.7e-3, max_voltage=told.required - 0.5))
    assert shared(evaluate(tight))[BUS].verdict is Verdict.FAIL
    assert not evaluate(tight).feasible


def test_a_cold_start_feeds_back_more(flywheel, make):
    """At -20 C the winding takes less of the energy that brakes the load than at 25 C."""
    study = replace(flywheel, supply=Supply(48.0, capacity=4.7e-3, max_voltage=120.0))
    warm, cold = evaluate(study), evaluate(replace(study, cold_start=-20.0))
    series = cold.joints["j1"].series
    wanted = np.minimum(least_power(study, make, -20.0), series.electrical_power)
    np.testing.assert_allclose(series.least_power, wanted, rtol=1e-9, atol=1e-9)
    for name in (PEAK, BUS):
        assert shared(cold)[name].required > shared(warm)[name].required


def test_a_part_of_a_mix_begins_where_another_left_the_bus(flywheel, make):
    """One part ends as it brakes, the next one begins so: the bus is still high, and takes the energy of both."""
    late = flywheel.cycle
    half = len(late.time) // 2
    # the same run begun in its middle, at full speed, after which it rests
    order = [*range(half, len(late.time)), *range(1, half + 1)]
    early = replace(late, **{name: getattr(late, name)[order] for name in ("torque", "velocity", "acceleration")})
    mix = build_mix([late, early], [0.4, 0.6], names=["late", "early"])
    study = replace(flywheel, cycle=mix, supply=Supply(48.0, capacity=4.7e-3, max_voltage=200.0))
    power, parts = evaluate(study).joints["j1"].series.least_power, mix.parts
    volts = highest = 48.0
    for part in (0, 0, 1, 1, 0, 1):
        row, time = power[parts[part]], mix.time[parts[part]]
        for drawn in 0.5 * (row[1:] + row[:-1]) * np.diff(time):
            volts = max(math.sqrt(max(volts**2 - 2.0 * drawn / 4.7e-3, 0.0)), 48.0)
            highest = max(highest, volts)
    told = shared(evaluate(study))[BUS]
    assert told.required == pytest.approx(highest, rel=1e-9)
    alone = [shared(evaluate(replace(study, cycle=one)))[BUS].required for one in (late, early)]
    assert highest**2 - 48.0**2 > 1.9 * (max(alone) ** 2 - 48.0**2)
    assert "in early" in told.remark or told.time > mix.time[parts[1].start]


def test_the_resistor_must_burn_the_peak(flywheel, make):
    most = float(-least_power(flywheel, make).min())
    for share, verdict in ((0.9, Verdict.FAIL), (1.2, Verdict.PASS)):
        supply = Supply(48.0, threshold=60.0, resistance=60.0**2 / (share * most))
        told = shared(evaluate(replace(flywheel, supply=supply)))[PEAK]
        assert told.required == pytest.approx(most, rel=1e-9) and told.available == pytest.approx(share * most)
        assert told.verdict is verdict and "60 V squared" in told.source
    bare = shared(evaluate(flywheel))
    assert bare[PEAK].remark == "the study states no threshold and resistance"
    assert bare[BUS].remark == "the study states no capacity of the bus"


def test_a_resistor_saves_the_bus_and_says_how_long_it_is_on(flywheel):
    alone = Supply(48.0, capacity=1e-3, max_voltage=62.0)
    helped = replace(alone, threshold=56.0, resistance=20.0)
    assert shared(evaluate(replace(flywheel, supply=alone)))[BUS].verdict is Verdict.FAIL
    told = shared(evaluate(replace(flywheel, supply=helped)))[BUS]
    assert told.verdict in (Verdict.PASS, Verdict.MARGINAL)
    assert "in the mean, on" in told.remark
    weak = shared(evaluate(replace(flywheel, supply=replace(helped, resistance=200.0))))[BUS]
    assert told.required < weak.required and "does not hold the threshold of 56 V" in weak.remark


@pytest.mark.parametrize(("stated", "check"), [({}, PEAK), ({"max_voltage": 90.0}, BUS)])
def test_a_source_above_the_threshold_never_lets_the_resistor_go_off(flywheel, stated, check):
    """As where the voltage of a study is varied, which its file refuses."""
    supply = Supply(48.0, capacity=0.02, threshold=60.0, resistance=2.0, **stated)
    for voltage, fits in ((48.0, True), (59.9, True), (60.0, False), (70.0, False)):
        study = changed(replace(flywheel, supply=supply), TaskChange(voltage=voltage / 48.0))
        found = shared(evaluate(study))[check]
        assert (found.verdict is not Verdict.FAIL) == fits, voltage
        assert ("never goes off" in found.remark) != fits


def test_the_bus_decides_a_choice(flywheel, make):
    """The lighter motor's rotor is the larger one; it carries more energy back than the bus takes."""
    motors = {
        "m1": replace(make.motor, mass=0.3, rotor_inertia=6e-5),
        "m2": replace(make.motor, key="m2", mass=0.5, rotor_inertia=1e-5),
    }
    task = make.task(drive=None, pairs=(("m1", "g1"), ("m2", "g1")))
    study = replace(flywheel, joints=(task,), catalog=Catalog(motors, {"g1": make.gear}), wanted=Wanted())
    volts = {}
    for key in motors:
        free = replace(study, supply=Supply(48.0, capacity=4.7e-3, max_voltage=500.0))
        volts[key] = shared(evaluate(free, {"j1": (key, "g1")}))[BUS].required
    assert volts["m1"] > volts["m2"]
    tight = Supply(48.0, capacity=4.7e-3, max_voltage=0.5 * sum(volts.values()))
    assert select(replace(study, supply=Supply(48.0))).drives["j1"][0] == "m1"
    chosen = select(replace(study, supply=tight))
    assert chosen.drives["j1"][0] == "m2" and chosen.proof == "optimal"


def test_amplifiers_take_their_share(flywheel, make):
    """Standby power all the time, two switches in the way of every current."""
    fitted = make.task(amplifier=Amplifier(40.0, 20.0, standby_power=7.0, on_resistance=0.05))
    plain, found = evaluate(flywheel), evaluate(replace(flywheel, joints=(fitted,)))
    series = plain.joints["j1"].series
    asked = series.electrical_power + 7.0 + 2.0 * 0.05 * series.current**2
    weights = flywheel.cycle.weights / flywheel.cycle.weights.sum()
    assert shared(found)["supply peak power"].required == pytest.approx(asked.max(), rel=1e-12)
    assert shared(found)["supply mean power"].required == pytest.approx(np.maximum(asked, 0.0) @ weights, rel=1e-12)
    assert shared(found)["supply regenerated power"].required == pytest.approx(np.maximum(-asked, 0.0) @ weights)
    assert found.criteria["energy"] == pytest.approx((asked - 7.0) @ flywheel.cycle.weights, rel=1e-12)
    assert found.joints["j1"].series.least_power == pytest.approx(series.least_power)
    limit = 0.5 * (asked.max() + series.electrical_power.max())
    tight = replace(flywheel, supply=Supply(48.0, peak_power=limit))
    assert evaluate(tight).feasible and not evaluate(replace(tight, joints=(fitted,))).feasible


@pytest.mark.parametrize("stated", [{"max_voltage": 60.0}, {"threshold": 55.0}, {"resistance": 10.0}])
def test_half_a_bus_is_refused(stated):
    with pytest.raises(InputError, match="is needed beside"):
        Supply(48.0, **stated)


def test_a_supply_is_not_proven_by_a_motor_silent_on_friction(flywheel, make):
    """The lighter motor may rub; the supply would not bear that, and bears the heavier one, whose sheet tells."""
    silent = dict.fromkeys(("coulomb_friction", "viscous_friction", "no_load_current", "no_load_speed"))
    motors = {
        "m1": replace(make.motor, mass=0.3, **silent),
        "m2": replace(make.motor, key="m2", mass=0.5, coulomb_friction=0.0, viscous_friction=0.0),
    }
    task = make.task(drive=None, pairs=(("m1", "g1"), ("m2", "g1")))
    free = replace(flywheel, joints=(task,), catalog=Catalog(motors, {"g1": make.gear}), wanted=Wanted())
    found = evaluate(free, {"j1": ("m1", "g1")})
    needs, more = shared(found)["supply peak power"].required, found.joints["j1"].power_allowance[0]
    assert more > 0.0 and select(free).drives["j1"][0] == "m1"
    enough, tight = (replace(free, supply=Supply(48.0, peak_power=needs + part * more)) for part in (1.01, 0.5))
    assert evaluate(enough, {"j1": ("m1", "g1")}).feasible and select(enough).drives["j1"][0] == "m1"
    doubtful = evaluate(tight, {"j1": ("m1", "g1")})
    assert doubtful.verdict is Verdict.NOT_CHECKED
    assert any("no_load_current" in line and "supply peak power" in line for line in missing_words(doubtful))
    chosen = select(tight)
    assert chosen.drives["j1"][0] == "m2" and chosen.proof == "optimal" and "disagreements" not in chosen.counters
    alone = select(replace(tight, joints=(replace(task, pairs=(("m1", "g1"),)),)))
    assert not alone.drives and alone.verdict is Verdict.NOT_CHECKED
