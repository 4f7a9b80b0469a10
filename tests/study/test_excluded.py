"""Which rule of a study excludes a part."""

from __future__ import annotations

import itertools

import pytest

from drivetrain.study.parts.candidates import excluded_by
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


@pytest.fixture(scope="module")
def study():
    return load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")


def test_every_pair_is_either_a_candidate_or_put_aside(study):
    task, catalog = study.joints[0], study.catalog
    allowed = set(task.pairs)
    assert allowed
    for pair in itertools.islice(itertools.product(catalog.motors, catalog.gears), 0, None, 7):
        assert bool(excluded_by(task, catalog, *pair)) == (pair not in allowed), pair


def test_the_rule_is_named_with_the_value(study):
    task, catalog = study.joints[0], study.catalog
    gear = next(key for key, row in catalog.gears.items() if row.kind == "planetary")
    motor = task.pairs[0][0]
    words = excluded_by(task, catalog, motor, gear)
    assert f"gears rule 'kind: strain_wave': that of {gear} is planetary" in words
    assert any("not built around" in word for word in words)
    wound = next(key for key, row in catalog.motors.items() if row.nominal_voltage == 24.0)
    found = excluded_by(task, catalog, wound, None)
    assert any("nominal_voltage: 40 to 60 V" in word and "24 V" in word for word in found)


def test_a_frameless_motor_too_wide_tells_by_how_much(study):
    task, catalog = study.joints[0], study.catalog
    kept = {motor for motor, _ in task.pairs}
    wide = max(kept, key=lambda key: catalog.motors[key].diameter)
    small = min((key for _, key in task.pairs), key=lambda key: catalog.gears[key].pitch_diameter)
    if (wide, small) not in task.pairs:
        (word,) = excluded_by(task, catalog, wide, small)
        share = catalog.motors[wide].diameter / catalog.gears[small].pitch_diameter
        assert f"{share:.3g} of the gear's pitch diameter" in word


def test_direct_drives_and_given_drives(study, tmp_path):
    task, catalog = study.joints[0], study.catalog
    motor = task.pairs[0][0]
    assert excluded_by(task, catalog, motor, "") == ("direct drives are not considered at shoulder_pan_joint",)
    given = load_study(shipped("examples") / "one_axis" / "study.yaml")
    joint = given.joints[0]
    if joint.drive is not None:
        assert excluded_by(joint, given.catalog, *joint.drive) == ()
