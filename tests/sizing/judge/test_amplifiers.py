"""Amplifiers from a catalogue: which one a drive takes, what it is held against, and that `select` finds the same."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from random_tasks import feasible_sets

from drivetrain.catalog.read import Catalog, read_catalog
from drivetrain.drive.amplifier import Amplifier, AmplifierSheet, best_of, limits_of, overload_share
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.errors import InputError
from drivetrain.simulation.study_scene import scene_of
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.pareto.front import pareto_front
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Study
from drivetrain.study.parts.selection import SelectionOptions
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study

OVERLOAD, HIGHEST, LOWEST = "amplifier overload (I2t)", "amplifier highest supply", "amplifier lowest supply"


def amplifier(key, steady, peak, **more) -> Amplifier:
    volts = {"min_voltage": 12.0, "max_voltage": 60.0}
    return limits_of(AmplifierSheet(key, continuous_current=steady, peak_current=peak, **{**volts, **more}))


def one_joint(make, amplifiers, **changes) -> Study:
    cycle = make.sines(1, samples=41, duration=2.0, size=0.6)
    task = make.task("j1", amplifier=best_of(amplifiers), amplifiers=amplifiers, **changes)
    return make.study(cycle, arm=make.planar_arm([0.4], [1.5]), joints=(task,))


def checks_of(evaluation):
    return {check.name: check for check in evaluation.joints["j1"].checks}


def test_a_drive_takes_the_first_amplifier_that_holds(make):
    asked = checks_of(evaluate(one_joint(make, (amplifier("any", 90.0, 90.0),))))
    steady, peak = asked["motor RMS current"].required, asked["motor peak current"].required
    some = (
        amplifier("faint", 0.9 * steady, 2.0 * peak), amplifier("short", 2.0 * steady, 0.9 * peak),
        amplifier("low", 2.0 * steady, 2.0 * peak, max_voltage=40.0), amplifier("fits", 1.2 * steady, 1.2 * peak),
        amplifier("strong", 9.0 * steady, 9.0 * peak),
    )  # fmt: skip
    found = evaluate(one_joint(make, some))
    assert found.joints["j1"].amplifier.key == "fits" and found.study.joints[0].amplifier.key == "fits"
    assert found.feasible and checks_of(found)[HIGHEST].utilisation == pytest.approx(48.0 / 60.0)
    assert checks_of(found)["amplifier peak current"].source.startswith("peak current of amplifier fits")
    none = evaluate(one_joint(make, some[:3]))
    assert none.verdict is Verdict.FAIL and none.joints["j1"].amplifier.key == "short"  # the faint one has no end
    assert checks_of(evaluate(one_joint(make, some[2:3])))[HIGHEST].verdict is Verdict.FAIL
    dull = one_joint(make, (amplifier("dull", 9.0, 90.0, min_voltage=50.0),))
    assert checks_of(evaluate(dull))[LOWEST].verdict is Verdict.FAIL
    assert HIGHEST not in checks_of(evaluate(make.study(dull.cycle, arm=dull.arm)))


def test_where_a_drive_fails_by_itself_the_amplifier_told_is_still_one_that_bears_it(make):
    some = (amplifier("short", 90.0, 3.0), amplifier("strong", 90.0, 90.0))
    study = one_joint(make, some)
    assert checks_of(evaluate(study))["amplifier peak current"].required > 3.0
    weak = replace(make.gear, key="g1", repeated_peak_torque=0.01, momentary_torque=0.01)
    found = evaluate(replace(study, catalog=Catalog(study.catalog.motors, {"g1": weak})))
    assert found.verdict is Verdict.FAIL and found.joints["j1"].amplifier.key == "strong"
    assert checks_of(found)["amplifier peak current"].verdict is Verdict.PASS


def test_currents_of_a_row_are_told_in_its_ampere_too(tmp_path):
    table = tmp_path / "amplifiers.csv"
    table.write_text("key,current_basis,continuous_current [A],peak_current [A]\nA,rms,5,10\n", encoding="utf-8")
    own = limits_of(read_catalog(tmp_path).amplifiers["A"])
    assert own.peak_current == pytest.approx(10.0 * 1.5**0.5) and own.current_basis == "rms"


@pytest.mark.parametrize("model", [{"peak_time": 0.2}, {"thermal_time_constant": 0.3}])
def test_overload_is_that_of_the_current_over_the_cycle(make, model):
    study = one_joint(make, (amplifier("any", 90.0, 90.0),))
    current = evaluate(study).joints["j1"].series.current
    square = (current[:-1] ** 2 + current[:-1] * current[1:] + current[1:] ** 2) / 3.0
    steady = 1.05 * float(np.sqrt(square @ np.diff(study.cycle.time) / study.cycle.duration))
    own = AmplifierSheet("own", continuous_current=steady, peak_current=2.0 * steady, **model)
    found = checks_of(evaluate(one_joint(make, (limits_of(own),))))[OVERLOAD]
    step = np.append(np.diff(study.cycle.time), 0.0)
    used = overload_share(own, current, 1.0, step, np.array([0, len(step)]))
    assert found.required == pytest.approx(used, rel=1e-9) and found.required > 0.0
    assumed = checks_of(evaluate(study))[OVERLOAD]  # no time is told: a second at the peak current stands in
    assert assumed.verdict is Verdict.PASS and assumed.source.startswith("assumed: ") and assumed.required == 0.0
    short = AmplifierSheet("short", continuous_current=steady, peak_current=1.0001 * np.abs(current).max())
    untold, timed = (
        checks_of(evaluate(one_joint(make, (limits_of(replace(short, peak_time=time)),))))[OVERLOAD]
        for time in (None, 1.0)
    )
    assert untold.required == timed.required
    assert (untold.verdict is Verdict.NOT_CHECKED and untold.essential) == (timed.verdict is Verdict.FAIL)
    factor = replace(one_joint(make, (limits_of(own),)), safety=replace(study.safety, rms=1.2))
    assert checks_of(evaluate(factor))[OVERLOAD].verdict is Verdict.FAIL


OBJECTIVES = (
    (("mass", 1.0),), (("price", 1.0),), (("price", 1.0), ("energy", 5.0)), (("mass", 100.0), ("price", 1.0)),
)  # fmt: skip


def two_joints(make, rng, weights) -> Study:
    """Motors, gears and amplifiers of random strength and price; of some amplifiers nobody tells it."""
    motors = {
        f"m{i}": replace(
            make.motor, key=f"m{i}", mass=float(m), torque_constant=float(k), nominal_current=9.0,
            price=float(rng.uniform(50.0, 200.0)),
        )
        for i, (m, k) in enumerate(zip(rng.uniform(0.3, 0.9, 3), rng.uniform(0.03, 0.09, 3), strict=True))
    }  # fmt: skip
    gears = {
        f"g{i}": replace(make.gear, key=f"g{i}", ratio=r, mass=0.3 + 0.1 * i, price=float(rng.uniform(40.0, 150.0)))
        for i, r in enumerate((30.0, 70.0))
    }
    some = sorted(
        (
            amplifier(
                f"a{i}", float(rng.uniform(1.0, 9.0)), float(rng.uniform(3.0, 20.0)),
                peak_time=float(rng.uniform(0.05, 1.0)), price=float(rng.uniform(20.0, 400.0)),
            )
            for i in range(3)
        ),
        key=lambda one: one.price,
    )  # fmt: skip
    if rng.random() < 0.3:
        some[2] = replace(some[2], price=None)
    pairs, cycle = tuple(itertools.product(motors, gears)), make.sines(2, samples=31, duration=3.0, size=0.5)
    task = {"drive": None, "pairs": pairs, "amplifier": best_of(some), "amplifiers": tuple(some)}
    study = make.study(
        cycle, arm=make.planar_arm([0.35, 0.3], [0.6, 0.5]), catalog=Catalog(motors, gears),
        joints=tuple(make.task(name, **task) for name in cycle.joint_names),
    )  # fmt: skip
    return replace(study, wanted=SelectionOptions(weights))


def every_set(study):
    """Every pair and every amplifier of all joints, each judged by itself: price, energy, mass and whether it holds."""
    names = study.cycle.joint_names
    for taken in itertools.product(study.joints[0].amplifiers, repeat=len(names)):
        tasks = tuple(replace(one, amplifier=own, amplifiers=()) for one, own in zip(study.joints, taken, strict=True))
        fixed = replace(study, joints=tasks)  # one for all drives: its motion is prepared once
        motors, gears = study.catalog.motors, study.catalog.gears
        for one in feasible_sets(fixed):
            parts = [(motors[joint.motor], gears[joint.gear]) for joint in one.joints.values()]
            prices = [[motor.price, gear.price, own.price] for (motor, gear), own in zip(parts, taken, strict=True)]
            yield one.criteria | {"price": np.sum(np.array(prices, dtype=float))}


@pytest.fixture(scope="module")
def cases(make):
    """Studies, each with all its sets: the search and the front are held against the same."""
    studies = [two_joints(make, np.random.default_rng((seed, 2)), OBJECTIVES[0]) for seed in range(5)]
    return [(study, list(every_set(study))) for study in studies]


def test_a_scene_runs_behind_the_amplifier_that_was_chosen(make):
    found = evaluate(one_joint(make, (amplifier("weak", 4.0, 5.0), amplifier("strong", 90.0, 90.0))))
    drives = {name: joint.drive for name, joint in found.joints.items()}
    limit = next(
        one.peak_current for one in scene_of(found.study, drives).effects["j1"] if isinstance(one, MotorCurrent)
    )
    assert limit == found.joints["j1"].amplifier.peak_current
    with pytest.raises(InputError, match=r"joints\.j1\.amplifier: is still to be chosen \(found 'weak, strong'\)"):
        scene_of(one_joint(make, (amplifier("weak", 4.0, 5.0), amplifier("strong", 90.0, 90.0))), drives)


def test_selection_with_amplifiers_is_brute_force(cases):
    chosen = {weights: set() for weights in OBJECTIVES}
    for study, every in cases:
        for weights in OBJECTIVES:
            best = np.nanmin([np.inf, *(sum(weight * found[name] for name, weight in weights) for found in every)])
            found = select(replace(study, wanted=SelectionOptions(weights)), advise=False)
            assert "disagreements" not in found.counters
            assert found.feasible == np.isfinite(best)
            if found.feasible:
                assert found.objective == pytest.approx(best, rel=1e-9)
                chosen[weights] |= {joint.amplifier.key for joint in found.evaluation.joints.values()}
                assert all(fallen.joint in study.cycle.joint_names for fallen in found.rejected_pairs)
    assert all(len(some) > 1 for some in chosen.values())


def test_the_front_knows_what_amplifiers_cost(cases):
    for study, sets in cases:
        every = [(found["mass"], found["price"]) for found in sets if np.isfinite(found["price"])]
        best = {
            one
            for one in every
            if not any(other[0] <= one[0] and other[1] <= one[1] and other != one for other in every)
        }
        front = pareto_front(study, ("mass", "price"))
        assert front.complete and "disagreements" not in front.counters
        found = sorted((one.criteria["mass"], one.criteria["price"]) for one in front.points)
        np.testing.assert_allclose(found, sorted({(round(m, 9), round(p, 9)) for m, p in best}), rtol=1e-8)


def test_amplifiers_without_a_price_are_told(make):
    study = two_joints(make, np.random.default_rng(1), (("price", 1.0),))
    silent = tuple(replace(own, price=None) for own in study.joints[0].amplifiers)
    unpriced = replace(study, joints=tuple(replace(task, amplifiers=silent) for task in study.joints))
    nothing = select(unpriced)
    assert "none of the 6 candidates of j1 and j2 has a known price" in nothing.proof
    assert "fill the column price: 3 of 3 amplifiers have none, such as a" in " ".join(nothing.advice)
    given = replace(
        study,
        joints=tuple(
            replace(task, amplifier=replace(best_of(silent), key="own"), amplifiers=()) for task in study.joints
        ),
    )
    left = select(given)
    assert left.feasible and "price of j1, j2 not known" in " ".join(left.notes) and np.isfinite(left.objective)


STUDY = """
schema_version: 1
motions: {swing: {table: swing.csv}}
supply: {voltage: 48 V}
joints:
  axis: {drive: {motor: maxon_625858, gear: hd_CSG-14-50-2UH}, amplifier: %s}
%s
"""


def written(tmp_path, entry, more=""):
    (tmp_path / "swing.csv").write_text("time [s],torque_axis [N m],speed_axis [rad/s]\n0,2,0\n1,2,0.5\n2,2,0\n")
    (tmp_path / "study.yaml").write_text(STUDY % (entry, more))
    return load_study(tmp_path / "study.yaml").joints[0]


def test_a_study_names_its_amplifiers(tmp_path):
    one = written(tmp_path, "beckhoff_ELM7211")
    assert one.amplifiers == () and one.amplifier.key == "beckhoff_ELM7211"
    assert one.amplifier.continuous_current == pytest.approx(4.5 * np.sqrt(1.5))
    every = written(tmp_path, "true").amplifiers
    assert {"beckhoff_ELM7211", "synapticon_Circulo_7"} <= {own.key for own in every}
    assert "beckhoff_EL7411" not in {own.key for own in every}  # nobody says which supply it bears
    some = written(tmp_path, "[beckhoff_ELM7231, beckhoff_ELM7211]")
    assert [own.key for own in some.amplifiers] == ["beckhoff_ELM7211", "beckhoff_ELM7231"]  # the weaker first
    stated = written(tmp_path, "{current_basis: rms, peak_current: 10 A, peak_time: 2 s, max_voltage: 60 V}").amplifier
    assert (stated.key, stated.peak_time, stated.max_voltage) == ("", 2.0, 60.0)


@pytest.mark.parametrize(
    ("entry", "more", "told"),
    [
        ("beckhoff_ELM7212", "", "no amplifier has this key"), ("{peak_current: 3 A}", "", "current_basis"),
        ("true", "selection: {holds: 0.9}\ntolerances: {resistance: 5 %}", "must be a single one if selection.holds"),
    ],
)  # fmt: skip
def test_faults_of_amplifiers_are_told(tmp_path, entry, more, told):
    with pytest.raises(InputError) as error:
        written(tmp_path, entry, more)
    assert told in str(error.value)
