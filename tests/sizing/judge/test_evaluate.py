"""Given drives judged: every check able to fail and to be left out; test_random_axes.py has the figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.errors import InputError
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.checks import REQUIREMENTS, factors
from drivetrain.sizing.judge.evaluate import evaluate, evaluated, holding_figures
from drivetrain.sizing.judge.missing import missing_words
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.sizing.search.search import select
from drivetrain.study.model import GearAssumption, MotorAssumption, Safety, Stop
from drivetrain.study.parts.verdicts import Check, Verdict

LOAD = 0.4  # kg m^2 at the gear's output
TOP = 4.0  # rad/s
RAMP = 0.5  # s, up and down


def trapezoid(make, load=LOAD):
    """Up in RAMP, 1 s at TOP, down in RAMP, 1 s of rest; samples doubled where the acceleration steps."""
    time = np.array([0.0, RAMP, RAMP, 1 + RAMP, 1 + RAMP, 1 + 2 * RAMP, 1 + 2 * RAMP, 2 + 2 * RAMP])
    speed = np.array([0.0, TOP, TOP, TOP, TOP, 0.0, 0.0, 0.0])
    acceleration = np.array([TOP, TOP, 0, 0, -TOP, -TOP, 0, 0]) / RAMP
    return make.table_cycle(time, load * acceleration, speed, acceleration)


def check_of(result: Evaluation | JointResult, name: str) -> Check:
    checks = result.shared if isinstance(result, Evaluation) else result.checks
    return next(check for check in checks if check.name == name)


@pytest.fixture
def one_axis(make):
    """A lossy drive accelerating and braking a flywheel; no motor friction."""
    frictionless = make.task(motor_friction=Friction())
    return make.study(trapezoid(make), joints=(frictionless,))


def test_efficiency_towards_one_is_lossless(one_axis, make):
    def current(efficiency):
        catalog = replace(one_axis.catalog, gears={"g1": replace(make.gear, efficiency=efficiency)})
        return evaluate(replace(one_axis, catalog=catalog)).joints["j1"].series.motor_torque

    lossless = current(1.0)
    errors = [np.abs(current(1.0 - step) - lossless).max() for step in (1e-2, 1e-4, 1e-6)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-6


SHRUNK = {
    "gear repeated peak torque": ("gear", "repeated_peak_torque", 1e-3),
    "gear momentary peak torque": ("gear", "momentary_torque", 1e-3),
    "gear average torque": ("gear", "average_torque_limit", 1e-3),
    "gear maximum input speed": ("gear", "max_input_speed", 1e-3),
    "gear mean input speed": ("gear", "average_input_speed_limit", 1e-3),
    "gear life L10": ("gear", "rated_life", 1.0),
    "output bearing tilting moment": ("gear", "tilting_moment_limit", 1e-3),
    "output bearing axial load": ("gear", "axial_load_limit", 1e-3),
    "output bearing radial load": ("gear", "radial_load_limit", 1e-3),
    "gear momentary peaks": ("gear", "momentary_waves", 1e-3),
    "gear torque in a jam": ("gear", "momentary_torque", 1e-3),
    "gear ratcheting in a jam": ("gear", "ratcheting_torque", 1e-3),
    "gear buckling in a jam": ("gear", "buckling_torque", 1e-3),
    "current to stop": ("stop", "current", 1e-5),
    "output bearing static load": ("gear", "bearing_static_rating", 1.0),
    "output bearing life L10": ("gear", "bearing_dynamic_rating", 1.0),
    "motor speed": ("motor", "max_speed", 1e-3),
    "motor peak torque": ("motor", "peak_torque", 1e-5),
    "motor peak current": ("motor", "peak_current", 1e-5),
    "motor RMS current": ("motor", "nominal_current", 1e-5),
    "winding temperature": ("motor", "max_winding_temperature", 25.01),
    "gear temperature": ("gear", "max_temperature", 25.01),
    "amplifier peak current": ("amplifier", "peak_current", 1e-5),
    "amplifier continuous current": ("amplifier", "continuous_current", 1e-5),
    "motor voltage": ("supply", "voltage", 1e-3),
    "inertia ratio": ("safety", "inertia_ratio", 1e-6),
    "supply peak power": ("supply", "peak_power", 1e-6),
    "supply mean power": ("supply", "mean_power", 1e-6),
    "supply regenerated power": ("supply", "regenerated_power", 0.0),
}
ALSO = {"current to stop": ("amplifier", "peak_current")}
BUS = {"supply peak braking power", "supply bus voltage"}  # see test_supply_checks.py
ROLLERS = {
    "bearing_dynamic_rating": 2e4, "bearing_static_rating": 2e4, "bearing_pitch_diameter": 0.05,
    "bearing_offset": 0.01,
}  # fmt: skip
REMOVED_WITH = {  # what else must go before nobody states the limit
    "gear repeated peak torque": ("continuous_torque",),
    "gear average torque": ("continuous_torque",),
    "motor peak torque": ("peak_current", "nominal_voltage"),
    "motor RMS current": ("resistance_housing_ambient",),
}


@pytest.fixture
def swinging(make):
    """A two-link arm whose joints turn about horizontal axes, tilted so that no bearing load is zero."""
    arm = make.planar_arm([0.3, 0.3], [2.0, 1.0])
    arm = replace(arm, gravity=np.array([0.5, 3.0, -9.2]))
    gear = replace(
        make.gear, momentary_torque=2000.0, momentary_waves=1e6, stiffness_1=1e4, ratcheting_torque=2000.0,
        buckling_torque=2000.0, max_temperature=110.0, **ROLLERS,
    )  # fmt: skip
    study = make.study(
        make.sines(2, size=0.8), arm=arm, safety=Safety(life=3.6e6, inertia_ratio=1e6),
        catalog=Catalog({"m1": make.motor}, {"g1": gear}),
    )  # fmt: skip
    stop = Stop(ramp=0.03, stops_per_day=2.0, service_life=10 * 365 * 86400.0, jam=True)
    return replace(study, joints=tuple(replace(task, stop=stop) for task in study.joints))


def changed(study, where, field, value):
    if where in ("gear", "motor"):
        rows = {"gear": study.catalog.gears, "motor": study.catalog.motors}[where]
        key = next(iter(rows))
        row = {key: replace(rows[key], **{field: value})}
        return replace(study, catalog=replace(study.catalog, **{f"{where}s": row}))
    if where == "stop":
        return replace(study, joints=tuple(replace(t, stop=replace(t.stop, **{field: value})) for t in study.joints))
    if where == "amplifier":
        tasks = tuple(replace(t, amplifier=replace(t.amplifier, **{field: value})) for t in study.joints)
        return replace(study, joints=tasks)
    return replace(study, **{where: replace(getattr(study, where), **{field: value})})


def found(evaluation, name):
    everything = [*evaluation.joints["j1"].checks, *evaluation.shared]
    return next(check for check in everything if check.name == name)


@pytest.mark.parametrize("name", SHRUNK)
def test_every_check_can_fail_and_can_be_missing(swinging, name):
    where, field, small = SHRUNK[name]
    plain = found(evaluate(swinging), name)
    if name != "motor peak torque":  # not printed: from the peak current
        assert plain.verdict in (Verdict.PASS, Verdict.MARGINAL), plain
    shrunk = found(evaluate(changed(swinging, where, field, small)), name)
    assert shrunk.verdict is Verdict.FAIL
    assert shrunk.utilisation > 1
    if name == "motor voltage":
        return  # a study always has a supply voltage
    without = changed(swinging, where, field, None)
    for other in REMOVED_WITH.get(name, ()):
        without = changed(without, where, other, None)
    if name in ALSO:
        without = changed(without, *ALSO[name], None)
    missing = found(evaluate(without), name)
    if missing.source.startswith("assumed: "):  # what such a part bears at least stands in: too little, it is no proof
        assert missing.available and missing.required
        without = replace(without, safety=replace(without.safety, speed=100.0, peak_torque=100.0))
        if name == "gear average torque":
            without = changed(without, "gear", "repeated_peak_torque", 1e-3)
        evaluation = evaluate(without)
        missing = found(evaluation, name)
        assert missing.essential and "more than is assumed" in missing.remark
    assert missing.verdict is Verdict.NOT_CHECKED
    assert missing.utilisation is None
    assert missing.remark


def test_every_check_is_in_the_table_of_tests(swinging):
    evaluation = evaluate(swinging)
    names = {check.name for check in [*evaluation.joints["j1"].checks, *evaluation.shared]}
    assert names == set(SHRUNK) | BUS | {"amplifier overload (I2t)"}  # see test_amplifiers.py


def test_verdicts_leave_the_wanted_reserve(one_axis, make):
    required = check_of(evaluate(one_axis).joints["j1"], "gear repeated peak torque").required
    verdicts = []
    for share in (0.85, 0.95, 1.05):
        study = changed(one_axis, "gear", "repeated_peak_torque", required / share)
        verdicts.append(check_of(evaluate(study).joints["j1"], "gear repeated peak torque").verdict)
    assert verdicts == [Verdict.PASS, Verdict.MARGINAL, Verdict.FAIL]


def test_the_factor_on_torque_is_in_the_voltage_of_a_change_of_current_too(swinging):
    """With 100 H nearly all of the voltage is that of the changing current: to 1 % twice as much with a factor of 2."""
    slow = changed(swinging, "motor", "inductance", 100.0)
    volts = [
        found(evaluate(replace(slow, safety=replace(slow.safety, peak_torque=factor))), "motor voltage").required
        for factor in (1.0, 2.0)
    ]
    assert volts[1] == pytest.approx(2.0 * volts[0], rel=0.01)


@pytest.mark.parametrize(("share", "made"), [(0.0, False), (0.05, True)])
def test_a_gear_has_a_temperature_of_its_own_where_any_of_its_heat_stays(swinging, share, made):
    tasks = tuple(replace(task, gear_heat=share) for task in swinging.joints)
    check = found(evaluate(replace(swinging, joints=tasks)), "gear temperature")
    assert (check.utilisation is not None) is made


def test_the_lives_that_are_required_are_those_of_the_study_in_hours(swinging):
    evaluation = evaluate(swinging)
    for name in ("gear life L10", "output bearing life L10"):
        assert found(evaluation, name).required == pytest.approx(3.6e6 / 3600.0, rel=1e-15)


FACTORED = {
    "peak_torque": {
        "gear repeated peak torque", "gear momentary peak torque", "gear torque in a jam", "gear ratcheting in a jam",
        "gear buckling in a jam", "output bearing tilting moment", "output bearing axial load",
        "output bearing radial load", "torque behind the gear", "motor peak torque", "cold start torque",
        "cold start current", "motor peak current", "amplifier peak current", "current to stop",
    },
    "rms": {"motor RMS current", "amplifier continuous current", "amplifier phase current at rest"},
    "speed": {"gear maximum input speed", "gear mean input speed", "motor speed", "speed behind the gear"},
    "voltage": {"motor voltage", "cold start voltage"},
    "brake": {"holding brake torque"},
    "bearing_static_safety": {"output bearing static load"},
}  # fmt: skip


def test_every_check_has_the_factor_of_its_kind():
    """A table of its own: what is held against a peak has the factor on peaks, and so on; nothing else has one."""
    safety = Safety(peak_torque=1.5, rms=1.25, speed=1.2, voltage=1.1, brake=1.3, bearing_static_safety=1.7)
    told = {name: getattr(safety, kind) for kind, names in FACTORED.items() for name in names}
    assert factors(safety) == {name: told.get(name, 1.0) for name in factors(safety)}
    lives = {"gear life L10", "output bearing life L10"}
    assert {row.name: row.scale for row in REQUIREMENTS if row.scale != 1.0} == dict.fromkeys(lives, 1.0 / 3600.0)


def test_factor_times_actual_value_is_what_is_required(one_axis):
    safety = Safety(peak_torque=1.5, rms=1.25, speed=1.2, voltage=1.1)
    plain, safe = evaluate(one_axis), evaluate(replace(one_axis, safety=safety))
    pairs = list(zip(plain.joints["j1"].checks, safe.joints["j1"].checks, strict=True))
    pairs += zip(plain.shared, safe.shared, strict=True)
    assert {factors(safety).get(check.name, 1.0) for _, check in pairs} == {1.0, 1.1, 1.2, 1.25, 1.5}
    for bare, check in pairs:
        assert bare.factor == factors(Safety()).get(check.name, 1.0)
        assert check.factor == factors(safety).get(check.name, 1.0)
        assert (check.actual is None) == (check.required is None)
        if check.required is not None:
            assert check.factor * check.actual == pytest.approx(check.required, rel=1e-15)
            if check.name == "motor voltage":  # the factor on peak torque is in it too
                assert check.actual > bare.actual
            else:
                assert check.actual == pytest.approx(bare.actual, rel=1e-12), check.name


def test_unknown_efficiency_is_not_judged_but_may_be_assumed(one_axis):
    silent = changed(one_axis, "gear", "efficiency", None)
    evaluation = evaluate(silent)
    joint = evaluation.joints["j1"]
    for name in ("motor peak torque", "motor voltage", "motor RMS current", "winding temperature"):
        check = check_of(joint, name)
        assert check.verdict is Verdict.NOT_CHECKED
        assert "efficiency" in check.remark
    assert {check.verdict for check in evaluation.shared} == {Verdict.NOT_CHECKED}
    assumed = replace(silent, gear_assumptions={"planetary": GearAssumption(efficiency=0.8, source="a guess")})
    np.testing.assert_array_equal(
        evaluate(assumed).joints["j1"].series.current, evaluate(one_axis).joints["j1"].series.current
    )
    assert any("80 %" in words and "a guess" in words for words in evaluate(assumed).joints["j1"].drive.assumptions)


def test_motor_assumptions_fill_only_what_is_unknown(one_axis):
    assumption = {"brushless": MotorAssumption(max_winding_temperature=80.0, source="a guess")}
    known = evaluate(replace(one_axis, motor_assumptions=assumption)).joints["j1"]
    assert check_of(known, "winding temperature").available == 125.0
    silent = changed(one_axis, "motor", "max_winding_temperature", None)
    filled = evaluate(replace(silent, motor_assumptions=assumption)).joints["j1"]
    assert check_of(filled, "winding temperature").available == 80.0


def test_runaway_heat_fails_without_bound(one_axis):
    hot = changed(one_axis, "motor", "resistance_housing_ambient", 4000.0)
    check = check_of(evaluate(hot).joints["j1"], "winding temperature")
    assert check.verdict is Verdict.FAIL
    assert check.utilisation == math.inf


def test_direct_drive_has_no_gear_checks(one_axis):
    joint = evaluate(one_axis, {"j1": ("m1", "")}).joints["j1"]
    assert not any(check.name.startswith(("gear", "output bearing")) for check in joint.checks)
    np.testing.assert_allclose(joint.series.motor_speed, joint.series.speed)


def test_start_from_rest_counts_for_peaks_and_holding_for_heat(make):
    time = np.linspace(0.0, 1.0, 101)
    speed = np.where(time < 0.5, 0.0, np.sin(2 * np.pi * (time - 0.5)) ** 2)
    hold = make.table_cycle(time, np.full(101, 10.0), speed, np.gradient(speed, time))
    study = make.study(hold, joints=(make.task(motor_friction=Friction()),))
    joint = evaluate(study).joints["j1"]
    eta, ratio = make.gear.efficiency, make.gear.ratio
    assert joint.series.motor_torque[0] == pytest.approx(10.0 / ratio)
    assert check_of(joint, "motor peak torque").required >= 10.0 / eta / ratio * (1 - 1e-12)
    for choice, factor in (("least", 2 - 1 / eta), ("lossless", 1.0), ("most", 1 / eta)):
        chosen = evaluate(replace(study, holding=choice)).joints["j1"]
        assert chosen.series.motor_torque[0] == pytest.approx(10.0 * factor / ratio)
        assert check_of(chosen, "motor peak torque").required == check_of(joint, "motor peak torque").required
        assert holding_figures(evaluate(study))["j1"][choice] == (
            check_of(chosen, "motor RMS current").actual, check_of(chosen, "winding temperature").required
        )  # fmt: skip
    two = replace(study, joints=(*study.joints, replace(study.joints[0], name="j2")))
    assert holding_figures(replace(evaluate(study), study=two)) == {}  # a joint has no drive, as reports may have it
    still = make.study(make.table_cycle(time, np.full(101, 10.0), 0 * time, 0 * time), joints=study.joints)
    joint = evaluate(still).joints["j1"]
    assert check_of(joint, "motor peak torque").required == pytest.approx(10.0 / ratio)


def test_breaking_loose_counts_for_the_gear_only_if_the_joint_moves(make):
    time = np.linspace(0.0, 1.0, 101)
    speed = np.where(time < 0.5, 0.0, 0.1 * np.sin(2 * np.pi * (time - 0.5)) ** 2)
    sticky = make.task(friction=Friction(coulomb=1.0, static=4.0))
    required = [
        check_of(evaluate(make.study(cycle, joints=(sticky,))).joints["j1"], "gear repeated peak torque").required
        for cycle in (
            make.table_cycle(time, np.full(101, -10.0), speed, 0 * time),
            make.table_cycle(time, np.full(101, -10.0), 0 * time, 0 * time),
        )
    ]
    assert required == [14.0, 10.0]


def test_supply_sums_joints_instant_by_instant(make):
    time = np.linspace(0.0, 1.0, 201)
    speed = np.sin(2 * np.pi * time)
    torque = np.stack([5.0 * np.ones_like(time), -5.0 * np.ones_like(time)], axis=1)
    cycle = make.table_cycle(time, torque, np.stack([speed, speed], axis=1), np.zeros((201, 2)))
    evaluation = evaluate(make.study(cycle))
    total = sum(joint.series.electrical_power for joint in evaluation.joints.values())
    peak = check_of(evaluation, "supply peak power")
    assert peak.required == pytest.approx(total.max()) and peak.time == time[np.argmax(total)]
    drawn = np.trapezoid(np.maximum(total, 0), time)
    fed_back = np.trapezoid(np.maximum(-total, 0), time)
    assert check_of(evaluation, "supply mean power").required == pytest.approx(drawn)
    assert check_of(evaluation, "supply regenerated power").required == pytest.approx(fed_back, abs=1e-12)
    # One drives while the other brakes: together they draw less than the driving one alone.
    alone = [joint.series.electrical_power.max() for joint in evaluation.joints.values()]
    assert check_of(evaluation, "supply peak power").required < max(alone)


def test_every_fault_of_the_drives_at_once(one_axis):
    with pytest.raises(InputError) as error:
        evaluate(one_axis, {"j1": ("m2", "gg1"), "k1": ("m1", "g1")})
    text = str(error.value)
    assert len(error.value.faults) == 3
    assert "known: m1" in text and "'g1'" in text and "known: j1" in text
    with pytest.raises(InputError, match="has no drive"):
        evaluate(replace(one_axis, joints=(replace(one_axis.joints[0], drive=None),)))


def test_unknown_limits_of_amplifier_are_not_passes(one_axis, make):
    bare = replace(one_axis, joints=(make.task(amplifier=Amplifier()),), supply=Supply(48.0))
    evaluation = evaluate(bare)
    joint = evaluation.joints["j1"]
    assert check_of(joint, "amplifier peak current").verdict is Verdict.NOT_CHECKED
    assert {check.verdict for check in evaluation.shared} == {Verdict.NOT_CHECKED}
    assert all(check.required is not None for check in evaluation.shared if check.name != "supply bus voltage")


def test_a_drive_whose_torque_is_unknown_is_no_pass(one_axis):
    """What could be checked passes, but the motor itself was never held against the task."""
    for part, field in (("motor", "rotor_inertia"), ("gear", "efficiency")):
        evaluation = evaluate(changed(one_axis, part, field, None))
        assert Verdict.PASS in {check.verdict for check in evaluation.joints["j1"].checks}
        assert evaluation.joints["j1"].verdict is Verdict.NOT_CHECKED
        assert evaluation.verdict is Verdict.NOT_CHECKED
        assert not evaluation.feasible
    failing = replace(changed(one_axis, "gear", "efficiency", None), safety=Safety(speed=100.0))
    assert evaluate(failing).verdict is Verdict.FAIL


def test_a_direct_drive_may_be_named_as_in_a_study(one_axis):
    plain = evaluate(one_axis, {"j1": ("m1", "")})
    assert plain.joints["j1"].gear == ""
    for gear in ("none", None):
        assert evaluate(one_axis, {"j1": ("m1", gear)}).joints["j1"].checks == plain.joints["j1"].checks


@pytest.mark.parametrize("drives", [{"j1": "m1"}, {"j1": ("m1",)}, {"j1": ("m1", "g1", "x")}, [("m1", "g1")]])
def test_what_is_no_pair_of_keys_is_told(one_axis, drives):
    with pytest.raises(InputError, match="motor key"):
        evaluate(one_axis, drives)


def test_what_is_no_study_is_refused() -> None:
    with pytest.raises(InputError, match="must be a study"):
        evaluate(None)  # type: ignore[arg-type]


def test_a_task_prepared_once_gives_what_each_evaluation_gives(make):
    """What the brute force of other tests rests on: only the work of the joints is kept from set to set."""
    cycle = make.sines(2, samples=31)
    study = make.study(cycle, arm=make.planar_arm([0.4, 0.3], [1.0, 0.6]))
    work = workload(study)
    for gear in ("g1", ""):
        drives = {"j1": ("m1", "g1"), "j2": ("m1", gear)}
        one, other = evaluate(study, drives), evaluated(work, drives)
        assert one.criteria == other.criteria and one.shared == other.shared
        for name, joint in one.joints.items():
            assert joint.checks == other.joints[name].checks


def test_a_joint_on_its_gears_own_bearing_needs_the_bearings_limits(make):
    """A missing limit is an essential lack; a joint with a bearing of its own is not asked."""
    names = ("output bearing tilting moment", "output bearing axial load", "output bearing radial load")
    sound = make.study(make.sines(1), arm=make.planar_arm([0.4], [1.0]))
    joint = evaluate(sound).joints["j1"]
    assert joint.verdict is Verdict.PASS and all(check_of(joint, name).verdict is Verdict.PASS for name in names)
    for name, column in zip(names, ("tilting_moment_limit", "axial_load_limit", "radial_load_limit"), strict=True):
        bare = replace(sound, catalog=replace(sound.catalog, gears={"g1": replace(make.gear, **{column: None})}))
        found = evaluate(bare)
        check = check_of(found.joints["j1"], name)
        assert check.verdict is Verdict.NOT_CHECKED and check.essential
        assert "is not in the catalogue row" in check.remark and "output_bearing: external" in check.remark
        assert found.verdict is Verdict.NOT_CHECKED and not found.feasible
        assert column in missing_words(found)[0]
        wanted = replace(bare, joints=tuple(replace(t, drive=None, pairs=(("m1", "g1"),)) for t in bare.joints))
        assert not select(wanted).feasible
        beside = replace(bare, joints=tuple(replace(t, output_bearing="external") for t in bare.joints))
        told = evaluate(beside)
        assert told.verdict is Verdict.PASS
        for one in names:
            check = check_of(told.joints["j1"], one)
            assert check.verdict is Verdict.NOT_CHECKED and not check.essential and "of its own" in check.remark
        free = replace(beside, joints=tuple(replace(t, drive=None, pairs=(("m1", "g1"),)) for t in beside.joints))
        assert select(free).feasible
