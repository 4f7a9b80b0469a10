"""Over the shipped examples: the smallest change that is told lets a part pass, and a little less does not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drivetrain.drive.matching import scaled_gear
from drivetrain.sizing.answers.why_not import Standing, why_not
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

EXAMPLES = ("one_axis", "ur5_pick_and_place")
NAMED = 2  # pairs of each example at least, and more until changes of both kinds were tried
MOST = 12  # pairs that are asked about before the test gives up
LESS = 1e-3  # of the way from what is to what is told
TRIED = (0.15, 0.75, 1.3, 6.0)  # factors at which what no change can mend must fail


@cache
def chosen(example):
    study = load_study(shipped("examples") / example / "study.yaml")
    return study, select(study)


def verdict(study, joint, keys, what, factor):
    """Of one joint with one number of the task or of its gear changed, everything evaluated anew."""
    if what == "gear ratio":
        motor, gear = keys[joint]
        row = study.catalog.gears[gear]
        turned = replace(scaled_gear(row, abs(row.ratio) * factor), key="turned")
        catalog = replace(study.catalog, gears={**study.catalog.gears, "turned": turned})
        return evaluate(replace(study, catalog=catalog), {**keys, joint: (motor, "turned")}).joints[joint].verdict
    change = {
        "payload": TaskChange(payload=factor), "cycle time": TaskChange(time=factor),
        "supply voltage": TaskChange(voltage=factor),
    }[what]  # fmt: skip
    return evaluate(changed(study, change), keys).joints[joint].verdict


def outwards(what, factor):
    """Whether a factor is a change in the direction that is looked at, within its range."""
    return {"payload": factor < 1.0, "gear ratio": True}.get(what, factor > 1.0)


@pytest.mark.parametrize("example", EXAMPLES)
def test_what_is_told_lets_it_pass_and_a_little_less_does_not(example):
    study, selection = chosen(example)
    rng, mended, told, asked = np.random.default_rng(7), 0, 0, 0
    joints = study.joints
    while asked < NAMED or (asked < MOST and (mended < 2 or told < 2)):
        task = joints[int(rng.integers(len(joints)))]
        motor, gear = task.pairs[int(rng.integers(len(task.pairs)))]
        (answer,) = why_not(study, task.name, motor, gear, cost=False, selection=selection).answers
        if answer.standing is not Standing.REJECTED:
            continue
        asked += 1
        keys = {name: (one.motor, one.gear) for name, one in selection.evaluation.joints.items()}
        keys[task.name] = (motor, gear)
        assert evaluate(study, keys).joints[task.name].verdict is Verdict.FAIL
        for change in answer.changes:
            if change.after is None:
                told += 1
                if change.before > 0.0 and not (change.what == "gear ratio" and not gear):
                    for factor in TRIED:
                        if outwards(change.what, factor):
                            assert verdict(study, task.name, keys, change.what, factor) is Verdict.FAIL, change
                continue
            mended += 1
            factor, short = change.after / change.before, change.short / change.before
            assert verdict(study, task.name, keys, change.what, factor) is not Verdict.FAIL, change
            assert verdict(study, task.name, keys, change.what, short) is Verdict.FAIL, change
            less = 1.0 + (factor - 1.0) * (1.0 - LESS)
            assert verdict(study, task.name, keys, change.what, less) is Verdict.FAIL, change
    assert mended >= 2 and told >= 2
