"""Why a part was not chosen: rules, checks, the smallest change, and what a set with it costs."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.matching import scaled_gear
from drivetrain.errors import InputError
from drivetrain.report.pages.why_not_page import why_not_lines
from drivetrain.sizing.answers.why_not import Standing, why_not
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.vary import worst_of
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.parts.verdicts import Verdict


def weak_catalog(make):
    """A strong pair, a weak motor, a weak gear, a motor without data, and ratios to choose from."""
    motors = {
        "strong": replace(
            make.motor, key="strong", mass=0.8, nominal_current=18.0, peak_current=60.0, part_number="S-1"
        ),
        "weak": replace(make.motor, key="weak", mass=0.3, nominal_current=4.1, peak_current=8.0),
        "unknown": replace(make.motor, key="unknown", rotor_inertia=None),
        "massless": replace(make.motor, key="massless", mass=None, nominal_current=18.0, peak_current=60.0),
    }
    gears = {
        f"g{ratio}": replace(
            make.gear,
            key=f"g{ratio}",
            ratio=float(ratio),
            series="G",
            size=1.0,
            repeated_peak_torque=60.0,
            average_torque_limit=40.0,
        )
        for ratio in (20, 50, 80, 120)
    }
    gears["tiny"] = replace(make.gear, key="tiny", mass=0.1, repeated_peak_torque=0.5, momentary_torque=2.0)
    return Catalog(motors, gears)


@pytest.fixture
def arm_study(make):
    catalog = weak_catalog(make)
    pairs = tuple(itertools.product(catalog.motors, catalog.gears))
    cycle = replace(make.sines(2, samples=61, duration=2.5, size=0.8), payload=np.zeros(61, dtype=int),
                    payload_names=("part",))  # fmt: skip
    tasks = tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names)
    return make.study(
        cycle, arm=make.planar_arm([0.4, 0.3], [1.0, 0.6]), joints=tasks, catalog=catalog,
        payloads=(make.payload(1.5),),
    )  # fmt: skip


def utilisation(evaluation, joint):
    return worst_of(evaluation.joints[joint].checks).utilisation


def test_a_smallest_change_passes_and_a_little_less_does_not(arm_study):
    found = why_not(arm_study, "j1", "weak", "g50", cost=False)
    (answer,) = found.answers
    assert answer.standing is Standing.REJECTED and answer.failed is not None
    assert answer.failed.utilisation > 1.0
    keys = {name: (one.motor, one.gear) for name, one in found.selection.evaluation.joints.items()}
    keys["j1"] = ("weak", "g50")
    made = {
        "payload": lambda value: changed(arm_study, TaskChange(payload=value / 1.5)),
        "cycle time": lambda value: changed(arm_study, TaskChange(time=value / 2.5)),
        "supply voltage": lambda value: changed(arm_study, TaskChange(voltage=value / 48.0)),
    }
    mended = 0
    for change in answer.changes:
        if change.after is None:
            assert change.reason
            continue
        mended += 1
        assert change.after == pytest.approx(change.short, rel=1e-5)
        if change.what == "gear ratio":
            row = arm_study.catalog.gears["g50"]
            studies = []
            for value in (change.after, change.short):
                gears = {**arm_study.catalog.gears, "new": replace(scaled_gear(row, value), key="new")}
                studies.append(replace(arm_study, catalog=replace(arm_study.catalog, gears=gears)))
            pairs = {**keys, "j1": ("weak", "new")}
        else:
            studies, pairs = [made[change.what](value) for value in (change.after, change.short)], keys
        assert utilisation(evaluate(studies[0], pairs), "j1") <= 1.0
        assert utilisation(evaluate(studies[1], pairs), "j1") > 1.0
        assert change.set_holds == evaluate(studies[0], pairs).feasible
    assert mended >= 2


def test_a_smallest_change_leaves_no_check_undecided(arm_study):
    """With a larger ratio the peak current suffices before the continuous one, which is not known, surely does."""
    catalog = arm_study.catalog
    motors = {**catalog.motors, "weak": replace(catalog.motors["weak"], nominal_current=None)}
    study = replace(arm_study, catalog=replace(catalog, motors=motors))
    found = why_not(study, "j1", "weak", "g50", cost=False)
    (answer,) = found.answers
    assert answer.standing is Standing.REJECTED
    change = next(one for one in answer.changes if one.what == "gear ratio")
    gears = {name: replace(scaled_gear(catalog.gears["g50"], ratio), key=name)
             for name, ratio in (("after", change.after), ("short", change.short))}  # fmt: skip
    study = replace(study, catalog=replace(study.catalog, gears={**catalog.gears, **gears}))
    drives = found.selection.evaluation.drives
    after, short = (evaluate(study, {**drives, "j1": ("weak", name)}).joints["j1"] for name in gears)
    assert after.verdict in (Verdict.PASS, Verdict.MARGINAL)
    assert change.check == f"{short.lacking[0].name} (not checked)"


def test_what_voltage_cannot_mend_is_told(arm_study):
    (answer,) = why_not(arm_study, "j1", "weak", "g50", cost=False).answers
    voltage = next(change for change in answer.changes if change.what == "supply voltage")
    assert voltage.after is None and "does not depend on it" in voltage.reason


def test_static_torque_no_slowness_mends(arm_study):
    (answer,) = why_not(arm_study, "j1", "strong", "tiny", cost=False).answers
    time = next(change for change in answer.changes if change.what == "cycle time")
    assert time.after is None and "almost at standstill" in time.reason
    ratio = next(change for change in answer.changes if change.what == "gear ratio")
    assert ratio.after is None and "whatever the ratio" in ratio.reason


def test_the_nearest_gear_of_the_catalogue_passes_with_its_own_sheet(arm_study):
    found = why_not(arm_study, "j1", "weak", "g20", cost=False)
    (answer,) = found.answers
    ratio = answer.changes[0]
    if ratio.gear is not None:
        keys = {name: (one.motor, one.gear) for name, one in found.selection.evaluation.joints.items()}
        result = evaluate(arm_study, {**keys, "j1": ("weak", ratio.gear.key)}).joints["j1"]
        assert result.verdict is not Verdict.FAIL


def test_what_holds_tells_what_the_best_set_with_it_costs(arm_study):
    found = why_not(arm_study, "j2", "strong", "g80")
    (answer,) = found.answers
    assert answer.standing is Standing.FEASIBLE and answer.changes == ()
    assert answer.best is not None and answer.best.feasible
    assert answer.best.drives["j2"] == ("strong", "g80")
    assert answer.best.objective >= found.selection.objective
    expected = math.inf
    for keys in arm_study.joints[0].pairs:
        evaluation = evaluate(arm_study, {"j1": keys, "j2": ("strong", "g80")})
        if evaluation.feasible and not math.isnan(evaluation.objective):
            expected = min(expected, evaluation.objective)
    assert answer.best.objective == pytest.approx(expected, rel=1e-12)


def test_the_chosen_one_is_chosen_also_when_only_its_motor_is_named(arm_study):
    found = why_not(arm_study, "j2", "weak")
    motor, gear = found.selection.drives["j2"]
    (answer,) = why_not(arm_study, "j2", motor, selection=found.selection).answers
    assert answer.standing is Standing.CHOSEN and (answer.motor, answer.gear) == (motor, gear)


def test_one_answer_a_joint_when_none_is_named(arm_study):
    found = why_not(arm_study, gear="tiny", cost=False)
    assert [one.joint for one in found.answers] == ["j1", "j2"]
    assert all(one.partners == 4 for one in found.answers)


def test_missing_data_are_named(arm_study):
    found = why_not(arm_study, "j1", "unknown", "g50")
    (answer,) = found.answers
    assert answer.standing is Standing.NOT_JUDGED
    assert "motor peak torque" in answer.lacking
    (remark,) = (check.remark for check in answer.result.lacking if check.name == "motor peak torque")
    assert remark and f"Motor peak torque: {remark}." in why_not_lines(found, answer)
    assert not why_not(arm_study, "j1", "unknown", "g50").holds
    (massless,) = why_not(arm_study, "j2", "massless", "g50", cost=False).answers
    assert any("mass is unknown" in word for word in massless.passed_over)


def test_a_part_number_names_its_row_and_unknown_names_are_told_together(arm_study):
    assert why_not(arm_study, "j1", "s-1", "g50", cost=False).motor == "strong"
    with pytest.raises(InputError) as error:
        why_not(arm_study, "j9", "wek", "g51")
    text = str(error.value)
    assert len(error.value.faults) == 3
    assert "'weak'" in text and "'g50'" in text and "j1" in text
    with pytest.raises(InputError, match="name a motor"):
        why_not(arm_study, "j1")
    rows = replace(arm_study.catalog, motors={"strong": arm_study.catalog.motors["strong"]})
    only = tuple(replace(task, drive=("strong", "g50"), pairs=()) for task in arm_study.joints)
    other = select(replace(arm_study, catalog=rows, joints=only), advise=False)
    with pytest.raises(InputError, match="another study"):
        why_not(arm_study, "j1", "weak", selection=other)


PUBLISHED = {"strong": ("g20", "g50"), "weak": ("g50", "g80", "tiny"), "massless": ("g120",)}
FEW = (("strong", "g50"), ("strong", "g80"), ("unknown", ""))


@pytest.mark.parametrize(
    ("pairs", "drive", "motor", "gear", "partners"),
    [
        (FEW, None, "strong", None, {("strong", "g50"), ("strong", "g80")}),  # those of the study
        (FEW, None, None, "g80", {("strong", "g80")}),
        (FEW, None, "unknown", "", {("unknown", "")}),
        (FEW, None, None, "none", {("unknown", "")}),
        (FEW, None, "weak", "g120", {("weak", "g120")}),  # both are named: whatever is published
        (FEW, None, "weak", None, {("weak", "g50"), ("weak", "g80")}),  # published, with gears of the study
        (FEW, None, None, "g20", {("strong", "g20")}),  # published, with motors of the study
        (FEW, None, None, "tiny", set()),
        (FEW, None, None, "g120", set()),
        (FEW[:2], None, None, "", set()),  # no direct drive is published
        ((), ("strong", "g50"), "weak", None, {("weak", "g50"), ("weak", "g80"), ("weak", "tiny")}),  # every gear
        ((), ("strong", "g50"), None, "g80", {("weak", "g80")}),  # every motor
        ((), ("strong", "g50"), None, "g50", {("strong", "g50")}),
    ],
)
def test_partners_of_a_part(make, pairs, drive, motor, gear, partners):
    """Written out: pairs that the study allows, else published ones of parts that it considers."""
    own = make.task("j1", drive=drive, pairs=pairs)
    made = make.study(make.sines(1), arm=make.planar_arm([0.3], [1.0]), joints=(own,),
                      catalog=replace(weak_catalog(make), pairs=PUBLISHED))  # fmt: skip
    chosen = select(made, advise=False)
    (answer,) = why_not(made, motor=motor, gear=gear, selection=chosen, cost=False).answers
    assert answer.partners == len(partners)
    if partners:
        assert (answer.motor, answer.gear) in partners
    else:
        assert answer.standing is Standing.NO_PARTNER and answer.passed_over and answer.result is None
