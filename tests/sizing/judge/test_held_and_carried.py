"""Checks of what stands still and of what a bearing carries, worked by hand, each deciding a verdict or a choice."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog, read_catalog
from drivetrain.drive.friction import Friction
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.missing import missing_words
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Safety
from drivetrain.study.parts.verdicts import Verdict

HOUR = 3600.0
CSG_17 = read_catalog().gears["hd_CSG-17-100-2UH"]
ROLLERS = {
    name: getattr(CSG_17, f"bearing_{name}") for name in ("dynamic_rating", "static_rating", "pitch_diameter", "offset")
}


def checks_of(evaluation, joint="j1"):
    return {check.name: check for check in evaluation.joints[joint].checks}


@pytest.fixture
def overhung(make):
    """A joint about the vertical with a heavy arm reaching out: nearly all of its weight tilts the bearing."""
    arm = make.planar_arm([0.5], [20.0])
    arm = replace(arm, gravity=np.array([0.0, 9.81, 0.0]))  # along the joint's axis
    gear = replace(
        make.gear, tilting_moment_limit=500.0, axial_load_limit=1e4, radial_load_limit=1e4,
        **{f"bearing_{name}": value for name, value in ROLLERS.items()},
    )  # fmt: skip
    cycle = make.sines(1, duration=8.0)
    return make.study(cycle, arm=arm, catalog=Catalog({"m1": make.motor}, {"g1": gear}))


def bearing_by_hand(wrench, offset, diameter):
    """Largest moment, P0 and P at every sample, from wrenches carried over to both sides by the cross product."""
    moments = []
    for side in (offset, -offset):
        moved = wrench[:, :3] - np.cross([0.0, 0.0, side], wrench[:, 3:])
        moments.append(np.hypot(moved[:, 0], moved[:, 1]))
    moment, radial, axial = np.maximum(*moments), np.hypot(wrench[:, 3], wrench[:, 4]), np.abs(wrench[:, 5])
    across = radial + 2.0 * moment / diameter
    static = radial.max() + 2.0 * moment.max() / diameter + 0.44 * axial.max()
    return moment.max(), static, np.where(axial <= 1.5 * across, across + 0.45 * axial, 0.67 * (across + axial))


@pytest.mark.parametrize("factor", [1.2, 1.5])
def test_the_bearing_of_an_overhung_arm(overhung, factor):
    """About 98 N m and 196 N along the axis on a CSG-17, as the pan of a UR5 carries."""
    study = replace(overhung, safety=Safety(bearing_load_factor=factor))
    evaluation = evaluate(study)
    found, series = checks_of(evaluation), evaluation.joints["j1"].series
    moment, static, loads = bearing_by_hand(series.bearing_load, ROLLERS["offset"], ROLLERS["pitch_diameter"])
    assert moment == pytest.approx(98.0, rel=0.05)
    assert found["output bearing tilting moment"].required == pytest.approx(moment, rel=1e-12)
    forces = series.bearing_load[:, 3:]
    assert found["output bearing axial load"].required == pytest.approx(np.abs(forces[:, 2]).max(), rel=1e-12)
    assert found["output bearing radial load"].required == pytest.approx(np.hypot(*forces[:, :2].T).max(), rel=1e-12)
    told = found["output bearing static load"]
    assert told.actual == pytest.approx(static, rel=1e-12)
    assert told.utilisation == pytest.approx(1.5 * static / 7550.0, rel=1e-12)
    assert told.verdict is (Verdict.FAIL if 1.5 * static > 7550.0 else Verdict.MARGINAL)
    weights = np.gradient(series.time)
    weights[[0, -1]] *= 0.5
    travel = np.abs(series.speed) * weights
    mean = (travel @ loads ** (10 / 3) / travel.sum()) ** 0.3
    rpm = travel.sum() / weights.sum() * 30.0 / math.pi
    hours = 1e6 / (60.0 * rpm) * (5290.0 / (factor * mean)) ** (10 / 3)
    told = found["output bearing life L10"]
    assert told.available == pytest.approx(hours, rel=1e-9)
    assert told.verdict is Verdict.NOT_CHECKED and "requires no life" in told.remark


def test_static_load_and_life_of_the_bearing_decide_a_choice(overhung, make):
    """Of three gears the lightest is too weak when it stands, the next wears out; everything else holds."""
    gear = overhung.catalog.gears["g1"]
    strong = replace(gear, key="g3", mass=0.6, bearing_static_rating=3e4, bearing_dynamic_rating=5e4)
    worn = replace(strong, key="g2", mass=0.5, bearing_dynamic_rating=5290.0)
    weak = replace(strong, key="g1", mass=0.4, bearing_static_rating=6000.0)
    gears = {one.key: one for one in (weak, worn, strong)}
    task = make.task(drive=None, pairs=tuple(("m1", key) for key in gears))
    study = replace(
        overhung, joints=(task,), catalog=replace(overhung.catalog, gears=gears), safety=Safety(life=1e4 * HOUR)
    )
    chosen = select(study)
    assert chosen.drives == {"j1": ("m1", "g3")} and chosen.proof == "optimal"
    fell = {one.gear: one.check for one in chosen.rejected_pairs}
    assert fell == {"g1": "output bearing static load", "g2": "output bearing life L10"}


def test_a_bearing_without_its_centre_proves_nothing(overhung):
    gear = replace(overhung.catalog.gears["g1"], bearing_offset=None)
    evaluation = evaluate(replace(overhung, catalog=replace(overhung.catalog, gears={"g1": gear})))
    told = checks_of(evaluation)["output bearing tilting moment"]
    assert told.verdict is Verdict.NOT_CHECKED and told.essential
    assert "offset" in told.remark and evaluation.verdict is not Verdict.PASS


# A joint that never moves


def held(make, torque, **safety):
    """A joint that holds a torque for ever."""
    time = np.linspace(0.0, 2.0, 21)
    still = np.zeros(21)
    gear = replace(make.gear, average_torque_limit=5.0)
    cycle, parts = make.table_cycle(time, np.full(21, torque), still, still), Catalog({"m1": make.motor}, {"g1": gear})
    return make.study(cycle, catalog=parts, safety=Safety(**safety))


def test_what_is_held_for_ever_is_held_against_static_limits(make):
    """4.8 N m on a gear of 5 N m; then 5.2 N m, which no average would have told."""
    found = checks_of(evaluate(held(make, 4.8)))
    told = found["gear average torque"]
    assert told.required == pytest.approx(4.8) and told.verdict is Verdict.MARGINAL
    assert "never moves" in told.remark
    evaluation = evaluate(held(make, 5.2))
    failed = [check.name for check in evaluation.joints["j1"].checks if check.verdict is Verdict.FAIL]
    assert failed == ["gear average torque"] and not evaluation.feasible


def test_at_rest_one_phase_carries_the_amplitude(make):
    """T/(G kt) A, times sqrt(2), against what motor and amplifier carry for ever."""
    evaluation = evaluate(held(make, 15.0))
    found, series = checks_of(evaluation), evaluation.joints["j1"].series
    current = 15.0 / 50.0 * series.current[0] / series.motor_torque[0]
    for name in ("motor RMS current", "amplifier continuous current"):
        assert found[name].required == pytest.approx(math.sqrt(2.0) * current, rel=1e-12)
        assert "one phase" in found[name].remark
    limit = math.sqrt(2.0) * current / 1.01  # it would carry the plain RMS
    weak = make.task(amplifier=replace(make.task().amplifier, continuous_current=limit))
    told = checks_of(evaluate(replace(held(make, 15.0), joints=(weak,))))["amplifier continuous current"]
    assert told.verdict is Verdict.FAIL


def moved_and_held(make, **sheet):
    """Half of the time at 1 A, half of it holding 6 A, for 200 s each; all heat is the winding's."""
    time = np.concatenate([np.linspace(0.0, 200.0, 201), np.linspace(200.0, 400.0, 101)])
    moves = np.arange(302) < 201
    speed = np.where(moves, 0.1 * np.sin(np.pi * time / 200.0), 0.0)
    speed[[0, 200]] = 0.0
    told = {
        "no_load_current": None, "no_load_speed": None, "coulomb_friction": 0.0, "viscous_friction": 0.0,
        "magnet_coefficient": 0.0, "max_winding_temperature": 75.0,
    }  # fmt: skip
    motor = replace(make.motor, **told | sheet)
    cycle = make.table_cycle(time, np.where(moves, 2.5, 15.0), speed, np.zeros(302))
    parts = Catalog({"m1": motor}, {"g1": replace(make.gear, efficiency=1.0)})
    return make.study(cycle, catalog=parts, joints=(make.task(gear_heat=0.0),))


def test_a_long_hold_is_judged_by_its_hottest_phase(make):
    """Against small steps of both nodes and of what one phase has above its share: 36 A^2 R twice at rest."""
    winding, housing, extra, peak, step = 25.0, 25.0, 0.0, 0.0, 0.05
    for k in range(12 * 8000):
        rests = k % 8000 >= 4000
        amperes = 36.0 if rests else 1.0
        copper, own = (amperes * 0.3 * (1.0 + 0.0039 * (at - 25.0)) for at in (winding, winding + extra))
        out = winding - housing
        winding += step * (copper - out) / 20.0
        housing += step * (out - (housing - 25.0) / 4.0) / 200.0
        extra += step * ((1.0 + rests) * own - copper - extra) / 20.0
        peak = max(peak, winding + extra)
    found = checks_of(evaluate(moved_and_held(make)))
    told = found["phase temperature at rest"]
    assert -1e-3 * (peak - 25.0) <= told.required - peak <= 0.02 * (peak - 25.0)
    assert told.verdict is Verdict.FAIL and told.required - extra < 75.0
    assert {found[name].verdict for name in ("motor RMS current", "winding temperature")} == {Verdict.PASS}


def test_a_long_hold_asks_the_amplifier_for_the_amplitude(make):
    """(1 + 2 x 36)/2 A^2 of one phase, (1 + 36)/2 A^2 of all."""
    study = moved_and_held(make)
    weak = replace(study.joints[0], amplifier=replace(study.joints[0].amplifier, continuous_current=5.0))
    found = checks_of(evaluate(replace(study, joints=(weak,))))
    told, mean = found["amplifier phase current at rest"], found["amplifier continuous current"]
    assert told.actual == pytest.approx(36.5**0.5, rel=5e-3) and told.verdict is Verdict.FAIL
    assert mean.actual == pytest.approx(18.5**0.5, rel=5e-3) and mean.verdict is Verdict.PASS


@pytest.mark.parametrize("gone", [["winding_time_constant"], ["winding_time_constant", "max_winding_temperature"]])
def test_a_long_hold_is_not_proven_by_a_row_that_tells_less(make, gone):
    evaluation = evaluate(moved_and_held(make, **dict.fromkeys(gone)))
    assert not evaluation.feasible
    if len(gone) == 2:
        told = checks_of(evaluation)["motor RMS current"]
        assert told.verdict is Verdict.NOT_CHECKED and told.required < 0.8 * told.available
        assert "winding_time_constant" in " ".join(missing_words(evaluation))


@pytest.mark.parametrize("sheet", [{}, {"housing_time_constant": None}, {"winding_time_constant": 60.0}])
@pytest.mark.parametrize("size", [0.5, 4.0])
def test_a_row_without_a_time_constant_is_taken_for_the_quickest_winding(make, sheet, size):
    """With what it may ask on top no cooler than a winding of 3.5 s at a kilogram, and hardly hotter."""
    row = {"mass": size, "max_winding_temperature": 155.0, "winding_time_constant": 3.5 * size**0.5} | sheet
    told = checks_of(evaluate(moved_and_held(make, **row)))
    silent = checks_of(evaluate(moved_and_held(make, **row | {"winding_time_constant": None})))
    for name in ("winding temperature", "phase temperature at rest"):
        more = float(re.search(r"may require ([\d.]+) K more", silent[name].remark)[1])
        most = silent["phase temperature at rest"].required + more - 25.0
        assert told[name].required - 25.0 <= most * (1.0 + 2e-3)  # the remark has three digits
        if not sheet:
            assert name == "winding temperature" or most <= 1.1 * (told[name].required - 25.0)


@pytest.mark.parametrize(("holding", "factor"), [("least", 0.9), ("lossless", 1.0), ("most", 1.1)])
def test_friction_that_grows_with_the_load_holds_a_direct_drive_too(make, holding, factor):
    study = held(make, 0.2)
    task = replace(study.joints[0], friction=Friction(load_share=0.1))
    evaluation = evaluate(replace(study, joints=(task,), holding=holding), {"j1": ("m1", "")})
    assert np.abs(evaluation.joints["j1"].series.motor_torque) == pytest.approx(0.2 * factor, rel=1e-12)


# Voltage with the factored torque


def test_voltage_holds_with_the_factored_torque(make):
    """kt w + f R i at the top of a ramp, where a plain look at the voltage passes."""
    time = np.linspace(0.0, 1.0, 201)
    speed = 16.0 * np.sin(np.pi * time) ** 2
    torque, acceleration = 15.0 * np.sin(np.pi * time) ** 2, np.gradient(speed, time)
    motor = replace(make.motor, inductance=None)
    cycle = make.table_cycle(time, torque, speed, acceleration)
    study = make.study(cycle, catalog=Catalog({"m1": motor}, {"g1": make.gear}))
    wanted, volts = [], []
    for factor in (0.8, 1.0, 1.3, 1.6):
        evaluation = evaluate(replace(study, safety=Safety(peak_torque=factor)))
        series = evaluation.joints["j1"].series
        hot = motor.resistance * (1.0 + 0.0039 * (series.winding_temperature - 25.0))
        warm = (series.motor_torque / series.current)[100], hot
        largest = 0.0
        for constant, ohms in (warm, (motor.torque_constant, motor.resistance)):  # and cold
            asked = constant * series.motor_speed + max(factor, 1.0) * ohms * series.motor_torque / constant
            largest = max(largest, np.abs(asked).max())
        wanted.append(largest)
        volts.append(checks_of(evaluation)["motor voltage"].required)
    assert volts[0] == volts[1] < volts[2] < volts[3]
    assert volts == pytest.approx(wanted, rel=1e-9)
    tight = replace(study, supply=replace(study.supply, voltage=0.5 * (volts[1] + volts[3]) / 0.95))
    verdicts = [
        checks_of(evaluate(replace(tight, safety=Safety(peak_torque=f))))["motor voltage"].verdict for f in (1.0, 1.6)
    ]
    assert verdicts[0] is not Verdict.FAIL and verdicts[1] is Verdict.FAIL


# The inertia ratio


def test_a_limit_of_the_inertia_ratio_decides_a_choice(make):
    """I/(G^2 J): the lighter motor has too small a rotor for the wish."""
    small = replace(make.motor, rotor_inertia=5e-6, mass=0.4)
    motors = {"m1": small, "m2": replace(make.motor, key="m2")}
    arm = make.planar_arm([0.4], [1.0])
    task = make.task(drive=None, pairs=(("m1", "g1"), ("m2", "g1")))
    study = make.study(make.sines(1), arm=arm, joints=(task,), catalog=Catalog(motors, {"g1": make.gear}))
    inertia = 1e-4 + 1.0 * 0.4**2
    ratios = {key: inertia / (50.0**2 * (row.rotor_inertia + 1e-6)) for key, row in motors.items()}
    free, wished = select(study), select(replace(study, safety=Safety(inertia_ratio=0.5 * sum(ratios.values()))))
    assert free.drives["j1"][0] == "m1" and wished.drives["j1"][0] == "m2"
    (fell,) = wished.rejected_pairs
    assert fell.check == "inertia ratio" and fell.required == pytest.approx(ratios["m1"], rel=1e-9)
