"""What NOT CHECKED means: the same to an evaluation and to a search, for every set of catalogues full of holes."""

from __future__ import annotations

import itertools
import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetrain.catalog.read import Catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.sizing.evaluate import evaluate
from drivetrain.sizing.missing import gaps
from drivetrain.sizing.ratio import ratio_study
from drivetrain.sizing.results import ESSENTIAL, lacking, verdict_of
from drivetrain.sizing.search import select
from drivetrain.sizing.why_not import why_not
from drivetrain.study.study import DriveMass, Mount, Study, Wanted
from drivetrain.study.verdicts import Check, Verdict

MASS, PRICE, ENERGY = (("mass", 1.0),), (("price", 1.0),), (("energy", 1.0),)


def optional(kind: type[Motor] | type[Gear]) -> list[str]:
    """Columns that a sheet may leave empty."""
    return [one.name for one in fields(kind) if one.default is None]


def with_holes(rng, row, share):
    """A sheet in which each number that may be missing is, now and then."""
    return replace(row, **{name: None for name in optional(type(row)) if rng.random() < share})


def holed_study(make, seed: int, weights) -> Study:
    """A light task, so that most drives whose data are whole hold; sheets with holes."""
    rng = np.random.default_rng(seed)
    joints, share = int(rng.choice([1, 2, 2])), float(rng.choice([0.03, 0.08, 0.2]))
    motors = {f"m{i}": with_holes(rng, replace(make.motor, key=f"m{i}", mass=0.5 + 0.1 * i), share) for i in range(3)}
    gears = {f"g{i}": with_holes(rng, replace(make.gear, key=f"g{i}", mass=0.4 + 0.1 * i), share) for i in range(2)}
    cycle = make.sines(joints, samples=21, duration=4.0, size=0.3)
    pairs = (*itertools.product(motors, gears), *((key, "") for key in list(motors)[:1]))
    tasks = tuple(
        make.task(
            name, pairs=pairs, drive=pairs[int(rng.integers(len(pairs)))] if rng.random() < 0.25 else None,
            mount=Mount(str(rng.choice(["parent", "child", "base"]))),
        )
        for name in cycle.joint_names
    )  # fmt: skip
    mass = (DriveMass.ADDED, DriveMass.INCLUDED)[int(rng.integers(2))]
    arm = make.planar_arm([0.3, 0.25][:joints], [0.6, 0.4][:joints])
    return make.study(
        cycle, arm=arm, joints=tasks, catalog=Catalog(motors, gears), drive_mass=mass,
        wanted=Wanted(weights, sets=60),
    )  # fmt: skip


def sets_of(study: Study):
    """Every set of drives that the study leaves open, with its evaluation."""
    names = [task.name for task in study.joints]
    for pairs in itertools.product(*((t.drive,) if t.drive else t.pairs for t in study.joints)):
        drives = dict(zip(names, pairs, strict=True))
        yield drives, evaluate(study, drives)


def given_lack(study: Study, evaluation) -> bool:
    """Whether no check failed and data are missing of given drives alone, counted by hand."""
    given_names = {task.name for task in study.joints if task.drive}
    if evaluation.verdict is not Verdict.NOT_CHECKED:
        return False
    return {gap.joint for gap in gaps(evaluation)} <= given_names


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), weights=st.sampled_from([MASS, PRICE, ENERGY]))
def test_the_search_and_the_evaluation_see_one_world(make, seed, weights):
    """Every set that can be ranked is found if and only if an evaluation calls it feasible."""
    study = holed_study(make, seed, weights)
    given_names = {task.name for task in study.joints if task.drive}
    feasible, excused = {}, {}
    for drives, found in sets_of(study):
        assert found.feasible == (not found.lacking and found.verdict is not Verdict.FAIL)
        assert (found.verdict is Verdict.NOT_CHECKED) == (bool(found.lacking) and not fails(found))
        assert bool(gaps(found)) == bool(found.lacking)
        if math.isnan(found.objective) and not given_names:
            continue  # of unknown price or mass: nothing ranks it
        if math.isnan(found.objective) and unranked(study, found) - given_names:
            continue
        if found.feasible:
            feasible[tuple(drives.items())] = found.objective
        elif given_lack(study, found):
            excused[tuple(drives.items())] = found.objective
    selection = select(study)
    chosen = {tuple(one.drives.items()) for one in selection.sets}
    assert "disagreements" not in selection.counters
    assert chosen == set(feasible) | set(excused)
    if selection.drives:
        assert selection.feasible == evaluate(study, selection.drives).feasible
        assert math.isfinite(selection.objective)
        told = " ".join(selection.advice)
        assert all(f"{gap}" in told for gap in gaps(selection.evaluation))
    else:
        assert not selection.feasible


def fails(evaluation) -> bool:
    checks = [check for joint in evaluation.joints.values() for check in joint.checks]
    return any(check.verdict is Verdict.FAIL for check in [*checks, *evaluation.shared])


def unranked(study: Study, evaluation) -> set[str]:
    """Joints whose share of the objective is not known."""
    (term, _), = study.wanted.weights
    if term == "energy":
        return {name for name, joint in evaluation.joints.items() if not joint.torque_known}
    found = set()
    for name, joint in evaluation.joints.items():
        parts = [joint.drive.motor] + ([joint.drive.gear] if joint.drive.gear.key else [])
        if any(getattr(part, term) is None for part in parts if not (term == "mass" and part.key == "")):
            found.add(name)
    return found
