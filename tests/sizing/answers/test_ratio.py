"""The ratio's sweep against evaluations one by one, its window's ends from both sides, its marks by minimisation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from drivetrain.catalog.read import Catalog
from drivetrain.drive.drive import drive_inertia
from drivetrain.drive.friction import Friction
from drivetrain.drive.matching import scaled_gear
from drivetrain.errors import InputError
from drivetrain.sizing.answers.ratio import NEAR_GEARS, chosen_drives, ratio_studies, ratio_study
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.model import DriveMass, Mount
from drivetrain.study.parts.verdicts import Verdict

JOINT = "j2"


def arm_study(make, carrier="parent", **changes):
    """Two joints that lift and swing, lossy drives, friction on both sides of the gear."""
    cycle = make.sines(2, samples=81, duration=1.5, size=0.8)
    tasks = tuple(
        make.task(name, friction=Friction(0.3, viscous=0.1), mount=Mount(carrier, 0.02)) for name in cycle.joint_names
    )
    return make.study(cycle, arm=make.planar_arm([0.4, 0.35], [1.2, 0.9]), joints=tasks, **changes)


def one_axis(make, **changes):
    """A flywheel with some weight on it, given as a table."""
    time = np.linspace(0.0, 2.0, 201)
    speed = 3.0 * np.sin(np.pi * time)
    acceleration = 3.0 * np.pi * np.cos(np.pi * time)
    task = make.task(motor_friction=Friction(0.002, viscous=1e-6))
    return make.study(make.table_cycle(time, 0.4 * acceleration + 3.0, speed, acceleration), joints=(task,), **changes)


def evaluated(study, joint, ratio):
    """The public road: the same gear with another ratio in the catalogue."""
    row = scaled_gear(study.catalog.gears["g1"], ratio)
    catalog = replace(study.catalog, gears={**study.catalog.gears, "turned": replace(row, key="turned")})
    return evaluate(replace(study, catalog=catalog), {joint: ("m1", "turned")}).joints[joint]


def highest(result):
    return max(check.utilisation for check in result.checks if check.utilisation is not None)


@pytest.mark.parametrize("carrier", ["parent", "child", "base"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_points_are_evaluations(make, carrier, sign) -> None:
    catalog = Catalog({"m1": make.motor}, {"g1": replace(make.gear, ratio=50.0 * sign, no_load_torque=0.005)})
    study = arm_study(make, carrier, catalog=catalog)
    found = ratio_study(study, JOINT, ratios=[20.0, 47.0, 130.0])
    assert sorted({20.0, 47.0, 130.0} - set(found.ratios)) == []
    for point in found.points:
        result = evaluated(study, JOINT, point.ratio)
        assert result.drive.gear.ratio == sign * point.ratio
        expected = {check.name: check.utilisation for check in result.checks}
        assert list(point.utilisations) == list(expected)
        for name, used in expected.items():
            assert point.utilisations[name] == pytest.approx(math.nan if used is None else used, rel=1e-9, nan_ok=True)
        series = result.series
        weights = np.gradient(series.time)
        weights[[0, -1]] = 0.5 * (series.time[1] - series.time[0])
        rms = math.sqrt(series.motor_torque**2 @ weights / weights.sum())
        assert point.rms_torque == pytest.approx(rms, rel=1e-9)
        assert point.motor_speed == pytest.approx(np.abs(series.motor_speed).max(), rel=1e-12)
        assert point.winding_temperature == pytest.approx(series.winding_temperature.max(), abs=0.5)
    assert found.utilisation_of("motor speed") == pytest.approx(
        [point.motor_speed / make.motor.max_speed for point in found.points]
    )


@pytest.mark.parametrize("build", [arm_study, one_axis])
def test_window_ends_from_both_sides(make, build) -> None:
    study = build(make)
    joint = study.joints[-1].name
    found = ratio_study(study, joint)
    assert found.feasible
    for window in found.windows:
        ends = ((window.low, 1 - 1e-5, window.low_binding), (window.high, 1 + 1e-5, window.high_binding))
        for end, outwards, binding in ends:
            assert highest(evaluated(study, joint, end)) <= 1.0
            beyond = evaluated(study, joint, end * outwards)
            failed = {check.name for check in beyond.checks if check.verdict is Verdict.FAIL}
            assert failed == {binding}
        inside = [highest(evaluated(study, joint, g)) for g in np.geomspace(window.low, window.high, 7)]
        assert max(inside) <= 1.0
    outside = [point for point in found.points if not any(w.low <= point.ratio <= w.high for w in found.windows)]
    assert outside
    assert not any(point.fits for point in outside)


def test_ends_by_hand(make) -> None:
    # Cold magnets that do not weaken, a distant thermal limit: the lower end is the rated torque, the upper the speed.
    motor = replace(
        make.motor, magnet_coefficient=0.0, max_winding_temperature=900.0, peak_current=None, max_speed=150.0,
        resistance=0.01, inductance=None,
    )  # fmt: skip
    study = one_axis(make, catalog=Catalog({"m1": motor}, {"g1": replace(make.gear, max_input_speed=1e4)}))
    found = ratio_study(study, "j1")
    (window,) = found.windows
    rated = found.closed_forms.rated
    assert rated is not None
    assert (window.low_binding, window.high_binding) == ("motor RMS current", "motor speed")
    assert window.low == pytest.approx(rated[0].low, rel=1e-6)
    assert window.high == pytest.approx(150.0 / 3.0, rel=1e-6)
    assert found.limits.continuous_torque == pytest.approx(motor.nominal_current * motor.torque_constant)
    assert found.limits.motor_speed == 150.0


def test_marks_against_minimisation(make) -> None:
    study = arm_study(make)
    found = ratio_study(study, JOINT)

    def rms(logarithm):
        series = evaluated(study, JOINT, math.exp(logarithm)).series
        return float(np.trapezoid(series.motor_torque**2, series.time))

    best = minimize_scalar(rms, bounds=(0.0, 8.0), method="bounded", options={"xatol": 1e-9})
    assert found.closed_forms.least_rms == pytest.approx(math.exp(best.x), rel=1e-5)
    smallest = found.ratios[np.argmin(found.series("peak_torque"))]
    assert found.closed_forms.least_peak == pytest.approx(smallest, rel=0.15)  # a step of the grid
    inertia = evaluate(study).joints[JOINT].series.load_inertia
    rotor = drive_inertia(found.drive)
    weights = np.ones(81)
    weights[[0, -1]] = 0.5
    assert found.closed_forms.matching == pytest.approx(math.sqrt(inertia @ weights / weights.sum() / rotor), rel=1e-9)
    strains = [max(u for n, u in p.utilisations.items() if n.startswith("motor")) for p in found.points]
    assert found.best.ratio == pytest.approx(found.ratios[np.argmin(strains)], rel=1e-9)


def test_load_match_ends_have_the_rated_torque(make) -> None:
    # One direction of power only, so that the one efficiency is right: a load that is always driven.
    time = np.linspace(0.0, 2.0, 201)
    speed = 2.0 + np.sin(np.pi * time)
    acceleration = np.pi * np.cos(np.pi * time)
    study = make.study(
        make.table_cycle(time, 6.0 + 0.4 * acceleration, speed, acceleration),
        joints=(make.task(motor_friction=Friction()),),
    )
    found = ratio_study(study, "j1")
    match, rated = found.closed_forms.load_match, found.limits.continuous_torque
    assert match is not None
    assert match.range is not None
    for end in match.range:
        series = evaluated(study, "j1", end).series
        rms = math.sqrt(np.trapezoid(series.motor_torque**2, time) / 2.0)
        assert rms == pytest.approx(rated, rel=1e-9)
    assert found.closed_forms.rated[0] == pytest.approx(match.range, rel=1e-9)


def test_no_ratio_fits(make) -> None:
    weak = Catalog({"m1": replace(make.motor, nominal_current=0.5)}, {"g1": make.gear})
    found = ratio_study(one_axis(make, catalog=weak), "j1")
    assert not found.feasible
    assert found.windows == ()
    assert found.best.utilisation > 1.0
    assert found.best.binding
    assert found.reaction == {}


def test_a_sliver_between_two_ratios_of_the_grid_is_found(make) -> None:
    # A motor just good enough: its window is far narrower than a step of the sweep.
    study = one_axis(make)
    current = make.motor.nominal_current
    for _ in range(5):  # the least share of the rated current that is used goes as one over it
        catalog = Catalog({"m1": replace(make.motor, nominal_current=current)}, {"g1": make.gear})
        current *= ratio_study(replace(study, catalog=catalog), "j1").best.utilisation / 0.999999
    catalog = Catalog({"m1": replace(make.motor, nominal_current=current)}, {"g1": make.gear})
    (window,) = ratio_study(replace(study, catalog=catalog), "j1").windows
    assert window.high / window.low < 1.01


def test_a_joint_that_only_holds_has_no_upper_end(make) -> None:
    cycle = make.table_cycle([0.0, 1.0], [4.0, 4.0], [0.0, 0.0], [0.0, 0.0])
    study = make.study(cycle)
    found = ratio_study(study, "j1")
    assert found.closed_forms.least_rms == math.inf
    (window,) = found.windows
    assert window.high == math.inf
    assert window.high_binding == ""
    assert ratio_studies(study) == ()  # nothing moves


def test_reaction_is_the_rotors_reaction(make) -> None:
    study = arm_study(make)
    found = ratio_study(study, JOINT)
    (window,) = found.windows
    torques = []
    for end in (window.low, window.high):
        row = replace(scaled_gear(make.gear, end), key="turned")
        catalog = replace(study.catalog, gears={**study.catalog.gears, "turned": row})
        result = evaluate(replace(study, catalog=catalog), {JOINT: ("m1", "turned")})
        torques.append(result.joints["j1"].series.gear_torque)
    # Parallel axes: the faster rotor's reaction J G a.
    reaction = drive_inertia(found.drive) * (window.high - window.low) * study.cycle.acceleration[:, 1]
    np.testing.assert_allclose(torques[1] - torques[0], reaction, rtol=1e-9, atol=1e-12)
    friction = 0.3 * np.sign(study.cycle.velocity[:, 0]) + 0.1 * study.cycle.velocity[:, 0]
    expected = np.abs(reaction).max() / np.abs(torques[0] - friction).max()
    assert found.reaction == {"j1": pytest.approx(expected, rel=1e-9)}
    assert any("joints before" in note for note in found.notes)


def test_near_gears_are_judged_by_their_own_sheets(make) -> None:
    rng = np.random.default_rng(2)
    gears = {
        key: replace(make.gear, key=key, ratio=float(rng.uniform(10, 300)), efficiency=float(rng.uniform(0.6, 0.9)))
        for key in (f"g{i}" for i in range(2, 14))
    }
    catalog = Catalog({"m1": make.motor}, {"g1": make.gear, **gears}, {"m1": frozenset(gears)})
    study = arm_study(make, catalog=catalog)
    found = ratio_study(study, JOINT)
    assert len(found.gears) == NEAR_GEARS
    away = [abs(math.log(gear.ratio / found.best.ratio)) for gear in found.gears]
    assert away == sorted(away)
    for gear in found.gears:
        result = evaluate(study, {JOINT: ("m1", gear.key)}).joints[JOINT]
        assert gear.utilisation == pytest.approx(highest(result), rel=1e-9)
        assert gear.verdict is result.verdict
        assert gear.inside == any(w.low <= gear.ratio <= w.high for w in found.windows)
    listed = replace(study.joints[1], pairs=(("m1", "g5"), ("m1", ""), ("other", "g6")))
    only = ratio_study(replace(study, joints=(study.joints[0], listed)), JOINT)
    assert [gear.key for gear in only.gears] == ["g5"]


def test_an_ideal_gear_and_missing_data_are_told(make) -> None:
    study = one_axis(make)
    ideal = ratio_study(study, "j1", gear="")
    assert ideal.gear == ""
    assert any("ideal gear" in note for note in ideal.notes)
    assert not any(name.startswith("gear") for name in ideal.points[0].utilisations)
    blind = Catalog({"m1": replace(make.motor, rotor_inertia=None)}, {"g1": make.gear})
    unknown = ratio_study(replace(study, catalog=blind), "j1")
    assert "not checked at any ratio: motor RMS current" in unknown.notes
    assert unknown.closed_forms.matching is None


def test_without_a_continuous_current_there_is_no_rated_range(make) -> None:
    """The ratios of least torque need none."""
    silent = replace(make.motor, nominal_current=None, resistance_winding_housing=None, resistance_housing_ambient=None)
    found = ratio_study(one_axis(make, catalog=Catalog({"m1": silent}, {"g1": make.gear})), "j1", ratios=[40.0, 80.0])
    assert found.closed_forms.rated is None is found.closed_forms.load_match
    assert found.limits.continuous_torque is None and found.closed_forms.matching is None
    known = ratio_study(one_axis(make), "j1", ratios=[40.0, 80.0]).closed_forms
    assert found.closed_forms.least_rms == pytest.approx(known.least_rms, rel=1e-9)
    assert found.closed_forms.least_peak == pytest.approx(known.least_peak, rel=1e-9)


def test_every_moving_joint_and_chosen_drives(make) -> None:
    study = arm_study(make)
    found = ratio_studies(study)
    assert [one.joint for one in found] == ["j1", "j2"]
    assert found[1].windows == ratio_study(study, JOINT).windows
    open_tasks = tuple(replace(task, drive=None, pairs=(("m1", "g1"),)) for task in study.joints)
    assert chosen_drives(replace(study, joints=open_tasks)) == {"j1": ("m1", "g1"), "j2": ("m1", "g1")}


def test_drive_mass_stays_with_the_template(make) -> None:
    # Drives that load the joints before them do so alike at every ratio; only the rotor's reaction changes.
    study = arm_study(make, drive_mass=DriveMass.ADDED)
    assert ratio_study(study, "j1").reaction == {}


def test_bad_input(make) -> None:
    study = arm_study(make)
    with pytest.raises(InputError, match="known: j1, j2"):
        ratio_study(study, "j3")
    with pytest.raises(InputError, match="not in the catalogue"):
        ratio_study(study, JOINT, motor="m2")
    with pytest.raises(InputError) as caught:
        ratio_study(study, JOINT, ratios=[10.0, -1.0, math.inf, "a", None])
    assert [fault.place for fault in caught.value.faults] == [f"ratios[{i}]" for i in range(1, 5)]
    with pytest.raises(InputError, match="ratios"):
        ratio_study(study, JOINT, ratios=[])
    bare = replace(study, joints=(study.joints[0], replace(study.joints[1], drive=None)))
    with pytest.raises(InputError, match="has no drive"):
        ratio_study(bare, JOINT)


@pytest.mark.parametrize("unknown", ["max_speed", "max_winding_temperature"])
def test_a_window_ends_where_missing_data_leave_a_check_undecided(make, unknown) -> None:
    catalog = Catalog({"m1": replace(make.motor, **{unknown: None})}, {"g1": replace(make.gear, max_input_speed=1e4)})
    study = arm_study(make, catalog=catalog)
    found = ratio_study(study, JOINT)
    assert found.feasible
    (window,) = found.windows
    for inside, outside, binding in (
        (1.0001 * window.low, 0.9999 * window.low, window.low_binding),
        (0.9999 * window.high, 1.0001 * window.high, window.high_binding),
    ):
        assert not evaluated(study, JOINT, inside).lacking
        beyond = evaluated(study, JOINT, outside)
        undecided = {check.name for check in beyond.checks if check.essential and check.verdict is Verdict.NOT_CHECKED}
        name = binding.removesuffix(" (not checked)")
        assert (name in undecided) == (name != binding)
        assert name in undecided or beyond.verdict is Verdict.FAIL
