"""Drawn samples: each as ``evaluate`` judges it, and probabilities that are known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from built_sample import built
from scipy import stats

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import torque_constant
from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.tolerance import tornado
from drivetrain.sizing.tolerance.draws import FRICTION, Source, deviated, drawn, sources
from drivetrain.sizing.tolerance.monte_carlo import Chance, robustness
from drivetrain.sizing.tolerance.sampling import (
    NAMES,
    SUPPLY_NAMES,
    candidate,
    figures_of,
    judged,
    nominal_of,
)
from drivetrain.sizing.tolerance.tornado import effects, variance_share
from drivetrain.study.parts.tolerances import Tolerance, Tolerances
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

ALL = Tolerances(
    Tolerance(0.05), Tolerance(0.05), Tolerance(0.3), Tolerance(0.05), Tolerance(0.1, normal=True),
    Tolerance(0.1, normal=True, absolute=True), Tolerance(8.0, absolute=True),
)  # fmt: skip
DRIVES = {
    "desktop_arm": {
        "base": ("maxon_DCX22L01EBKL637", "maxon_GPX22UPKLSL0138CPLW"),
        "shoulder": ("FH_4221G024BXTH", "FH_38A_R100:1"),
        "elbow": ("maxon_DCX26L01GBKL529", "maxon_GPX26HPKLSL0138CPLW"),
        "forearm_roll": ("maxon_351008", "maxon_143989"),
        "wrist_pitch": ("maxon_DCX19S01GBKL603", "maxon_GPX22CAKLSL0138CPLW"),
        "wrist_roll": ("FH_1724T024SR", "FH_15_10_R178:1"),
    },
    "ur5_pick_and_place": {
        "shoulder_pan_joint": ("AM_MF0060008_48V", "hd_CSG-17-100-2UH"),
        "shoulder_lift_joint": ("AM_MF0060020_48V", "hd_CSG-25-160-2UH"),
        "elbow_joint": ("AM_MF0060020_48V", "hd_CSG-17-100-2UH"),
        **dict.fromkeys(("wrist_1_joint", "wrist_2_joint", "wrist_3_joint"), ("AM_MF0060008_48V", "hd_CSG-14-100-2UH")),
    },
}  # fmt: skip


@pytest.fixture(scope="module", params=sorted(DRIVES))
def example(request):
    study = load_study(shipped("examples") / request.param / "study.yaml")
    safety = replace(study.safety, inertia_ratio=20.0, life=3.6e7)
    return replace(study, tolerances=ALL, safety=safety), DRIVES[request.param]


def figures(study, drives, draws):
    parts = list(judged(candidate(nominal_of(study), drives), draws))
    return np.concatenate([part.joints for part in parts]), np.concatenate([part.supply for part in parts])


def test_every_sample_is_judged_as_evaluate_does(example):
    study, drives = example
    draws = drawn(study, 8, 5)
    joints, supply = figures(study, drives, draws)
    seen = set()
    for sample in range(len(draws)):
        evaluation = evaluate(built(study, drives, draws, sample))
        expected = figures_of(evaluation)
        np.testing.assert_allclose(joints[sample], expected[0], rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(supply[sample], expected[1], rtol=1e-11, atol=1e-12)
        seen |= {NAMES[c] for c in np.flatnonzero(~np.isnan(expected[0]).all(axis=0))}
    assert {"winding temperature", "motor voltage", "inertia ratio", "gear repeated peak torque"} <= seen


def test_nominal_numbers_are_the_evaluation(example):
    study, drives = example
    nothing = deviated(study, 1, {})
    evaluation = evaluate(study, drives)
    again = evaluate(built(study, drives, nothing, 0))
    for one, other in zip(figures_of(evaluation), figures_of(again), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13)
    joints, _ = figures(study, drives, nothing)
    np.testing.assert_allclose(joints[0], figures_of(evaluation)[0], rtol=1e-11)


def test_wide_draws_too(example):
    """Halved resistances, doubled friction, no payload, hot air: far from every nominal number."""
    study, drives = example
    for seed, factor in enumerate((0.6, 1.5)):
        draws = drawn(study, 3, seed)
        wide = replace(
            draws, factors=np.clip(draws.factors * factor, 0.3, None), ambient=draws.ambient + 20.0,
            loads=draws.loads * (0.0 if seed else 1.3),
        )  # fmt: skip
        joints, supply = figures(study, drives, wide)
        for sample in range(3):
            expected = figures_of(evaluate(built(study, drives, wide, sample)))
            np.testing.assert_allclose(joints[sample], expected[0], rtol=1e-10, atol=1e-12)
            np.testing.assert_allclose(supply[sample], expected[1], rtol=1e-10, atol=1e-12)


# ------------------------------------------------------------ closed forms


@pytest.fixture
def one_axis(make):
    """One joint whose current limit depends on the torque constant alone."""
    time = np.linspace(0.0, 2.0, 201)
    rate = 2.0 * np.pi / 2.0
    cycle = make.table_cycle(time, 4.0 * np.sin(rate * time), np.cos(rate * time), -rate * np.sin(rate * time))
    study = make.study(cycle)
    return study


def of_peak_current(study, tolerance, name="torque_constant", limit=None):
    """A study whose motor peak current holds in nominal numbers by a chosen factor; its evaluation."""
    evaluation = evaluate(study)
    result = next(iter(evaluation.joints.values()))
    current = float(np.abs(result.series.motor_torque).max() / torque_constant(result.drive.motor, study.ambient))
    motors = {key: replace(one, peak_current=limit * current, magnet_coefficient=0.0)
              for key, one in study.catalog.motors.items()}  # fmt: skip
    changed = replace(study, catalog=replace(study.catalog, motors=motors), tolerances=Tolerances(**{name: tolerance}))
    return evaluate(changed)


@pytest.mark.parametrize(("tolerance", "limit", "expected"), [
    (Tolerance(0.1), 1.04, (1.1 - 1.0 / 1.04) / 0.2),
    (Tolerance(0.1), 0.97, (1.1 - 1.0 / 0.97) / 0.2),
    (Tolerance(0.03, normal=True), 1.02, stats.norm.sf((1.0 / 1.02 - 1.0) / 0.03)),
])  # fmt: skip
def test_a_probability_known_in_closed_form(one_axis, tolerance, limit, expected):
    """The current holds while the constant is above 1/limit of its nominal value."""
    evaluation = of_peak_current(one_axis, tolerance, limit=limit)
    found = robustness(evaluation, samples=10000, seed=3)
    joint = next(iter(evaluation.joints))
    chance = found.checks[joint]["motor peak current"]
    assert chance.standard_error == pytest.approx(math.sqrt(expected * (1.0 - expected) / 10000), rel=0.05)
    assert abs(chance.probability - expected) < 4.0 * chance.standard_error
    assert found.joints[joint].held <= min(one.held for one in found.checks[joint].values())
    assert found.whole.held <= min(one.held for one in found.joints.values())
    row = found.table.set_index(["joint", "check"]).loc[joint, "motor peak current"]
    assert row["probability"] == chance.probability and row["utilisation 50 %"] == pytest.approx(1.0 / limit, rel=5e-3)
    assert len(repr(found)) < 120 and "motor peak current" in found._repr_html_()


def test_the_standard_error_is_that_of_many_seeds(one_axis):
    evaluation = of_peak_current(one_axis, Tolerance(0.1), limit=1.04)
    runs = [robustness(evaluation, samples=400, seed=seed).whole for seed in range(60)]
    spread = float(np.std([one.probability for one in runs], ddof=1))
    told = float(np.mean([one.standard_error for one in runs]))
    # The standard deviation of 60 numbers is itself good to about 9 %.
    assert spread == pytest.approx(told, rel=0.3)
    exact = (1.1 - 1.0 / 1.04) / 0.2
    inside = sum(one.interval[0] <= exact <= one.interval[1] for one in runs)
    assert inside >= 51  # of 60 with 95 % each: below this once in a thousand


def test_seeds_repeat_and_more_samples_go_on(one_axis):
    evaluation = of_peak_current(one_axis, Tolerance(0.1), limit=1.04)
    one, other = robustness(evaluation, samples=5000, seed=9), robustness(evaluation, samples=5000, seed=9)
    assert one.whole == other.whole and one.utilisations == other.utilisations
    assert robustness(evaluation, samples=5000, seed=10).whole != one.whole
    few, many = drawn(evaluation.study, 10, 9), drawn(evaluation.study, 100, 9)
    np.testing.assert_array_equal(few.factors, many.factors[:10])


def test_wider_tolerances_hold_less_often(one_axis):
    before = 1.0
    for width in (0.01, 0.05, 0.1, 0.2):
        found = robustness(of_peak_current(one_axis, Tolerance(width), limit=1.03), samples=4000, seed=2)
        assert found.whole.probability <= before
        before = found.whole.probability
    assert before < 0.7


def test_wilson_near_the_ends():
    assert Chance(0, 100).interval[0] == 0.0 and Chance(100, 100).interval[1] == 1.0
    # Wilson (1927) with 95 %: 0 of 10 leaves 27.8 %.
    assert Chance(0, 10).interval[1] == pytest.approx(0.27753, abs=1e-5)
    assert Chance(100, 100).standard_error > 0.0


def test_nothing_scatters(one_axis):
    with pytest.raises(InputError, match="tolerances"):
        robustness(evaluate(one_axis))
    with pytest.raises(InputError, match="at least 1"):
        robustness(of_peak_current(one_axis, Tolerance(0.1), limit=1.0), samples=0)
    with pytest.raises(InputError, match="seed"):
        robustness(of_peak_current(one_axis, Tolerance(0.1), limit=1.0), seed=-1)
    for width in (math.nan, -0.1, math.inf):
        with pytest.raises(InputError, match="width"):
            Tolerance(width)


# ------------------------------------------------------------ tornado


def test_tornado_is_one_number_at_a_time(example, monkeypatch):
    monkeypatch.setattr(tornado, "ARMS", 64)  # of the shares, which nobody looks at here
    study, drives = example
    evaluation = evaluate(study, drives)
    found = effects(evaluation)
    worst = found.worst()[0]
    spans = [bar.span for bar in worst.bars]
    assert spans and spans == sorted(spans, reverse=True)
    for bar in worst.bars[:2]:
        for end, value in ((bar.low, bar.at_low), (bar.high, bar.at_high)):
            alone = built(study, drives, deviated(study, 1, {bar.source: np.array([end])}), 0)
            joints, *_ = figures_of(evaluate(alone))
            names = [task.name for task in study.joints]
            assert value == pytest.approx(joints[names.index(worst.joint), NAMES.index(worst.check)], rel=1e-6)


def test_tornado_of_the_torque_constant(one_axis):
    evaluation = of_peak_current(one_axis, Tolerance(0.1), limit=1.04)
    joint = next(iter(evaluation.joints))
    found = effects(evaluation).of(joint, "motor peak current")
    (bar,) = found.bars
    assert bar.source == Source("torque_constant", joint) and str(bar.source) == f"torque constant of {joint}"
    assert bar.at_low == pytest.approx(found.nominal / 0.9) and bar.at_high == pytest.approx(found.nominal / 1.1)
    assert sources(evaluation.study) == (bar.source,)
    assert evaluation.drives.keys() == {joint}
    assert SUPPLY_NAMES[0] == "supply peak power"


@pytest.mark.parametrize("power", [1, 2])
def test_shares_of_the_variance_known_in_closed_form(power):
    """3 x^p + 4 y + noise: the share of x is 9 Var x^p over the whole variance; what does nothing has none."""
    rng = np.random.default_rng(5)
    x, y, idle = rng.random((3, 4096))
    values = 3.0 * x**power + 4.0 * y
    of_x = 1.0 / 12.0 if power == 1 else 1.0 / 5.0 - 1.0 / 9.0
    share = 9.0 * of_x / (9.0 * of_x + 16.0 / 12.0)
    # The error of such a share is about 0.01 with 4096 arms.
    assert variance_share(values[np.argsort(x)]) == pytest.approx(share, abs=0.03)
    assert variance_share(values[np.argsort(y)]) == pytest.approx(1.0 - share, abs=0.03)
    assert variance_share(values[np.argsort(idle)]) < 0.015
    assert math.isnan(variance_share(np.ones(100))) and math.isnan(variance_share(np.append(x, np.inf)))


def test_the_one_number_that_acts_has_all_of_the_variance(one_axis):
    evaluation = of_peak_current(one_axis, Tolerance(0.1), limit=1.04)
    (bar,) = effects(evaluation).of(next(iter(evaluation.joints)), "motor peak current").bars
    assert bar.share > 0.99


@pytest.mark.parametrize("name", ["motor peak current", "supply peak power"])
def test_a_sample_that_missing_data_decide_does_not_hold(make, one_axis, name):
    """A motor whose sheet states no friction: in some samples a check is satisfied only without that friction."""
    silent = replace(make.motor, no_load_current=None, no_load_speed=None)
    plain = replace(one_axis, tolerances=Tolerances(friction=Tolerance(0.2)))

    def of(coulomb, limit):
        peak, power = (limit, 2000.0) if name.startswith("motor") else (30.0, limit)
        parts = Catalog({"m1": replace(silent, peak_current=peak)}, {"g1": make.gear})
        joints = (make.task(friction=Friction(coulomb=coulomb)),)
        return replace(plain, catalog=parts, joints=joints, supply=Supply(48.0, peak_power=power))

    nominal = evaluate(of(8.0, 30.0 if name.startswith("motor") else 2000.0))
    required = next(one.required for one in (*nominal.joints["j1"].checks, *nominal.shared) if one.name == name)
    more = (
        1.16 if name.startswith("motor") else nominal.joints["j1"].power_allowance[0]
    )  # friction may require [A or W]
    study = of(8.0, required + 1.03 * more)
    draws = drawn(study, 40, 3)
    (found,) = judged(candidate(nominal_of(study), {"j1": ("m1", "g1")}), draws)
    every = [evaluate(of(8.0 * float(one), required + 1.03 * more)) for one in draws.factors[:, 0, FRICTION]]
    assert found.feasible.tolist() == [one.feasible for one in every]
    assert 0 < sum(one.verdict is Verdict.NOT_CHECKED for one in every) < len(every)
