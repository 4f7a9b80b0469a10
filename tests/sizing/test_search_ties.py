"""Sets of equal objective: in which order they come, and that nothing but the sets themselves decides it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Study
from drivetrain.study.selection import Wanted

SAME = 1e-9  # relative: objectives that differ by less are equal
RESERVE = 2e-3  # of utilisation: what differs by less at two joints comes in the order of the study


def wound_study(make, seed: int, sets: int, term: str = "mass") -> Study:
    """Two joints, motors in several windings of one mass and price: many sets of equal objective."""
    rng = np.random.default_rng(seed)
    motors = {}
    for size, winding in itertools.product((0.8, 1.2), (0.7, 0.85, 1.0, 1.2)):
        key = f"m{size}w{winding}"
        motors[key] = replace(
            make.motor, key=key, mass=0.4 * size, price=100.0 * size, nominal_current=9.0 * size / winding,
            peak_current=40.0 * size / winding, torque_constant=0.05 * size * winding,
            resistance=0.3 * winding**2 / size * float(rng.uniform(0.9, 1.1)),
        )  # fmt: skip
    gears = {f"g{i}": replace(make.gear, key=f"g{i}", ratio=float(rng.uniform(40, 90))) for i in range(2)}
    cycle = make.sines(2, samples=31, duration=4.0, size=0.5)
    pairs = tuple(itertools.product(motors, gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names)
    return make.study(
        cycle, arm=make.planar_arm([0.4, 0.3], [0.8, 0.5]), joints=tasks, catalog=Catalog(motors, gears),
        supply=Supply(48.0), wanted=Wanted(((term, 1.0),), sets=sets),
    )  # fmt: skip


def reserve_used(evaluation) -> float:
    """The sum of the joints' largest utilisations."""
    used = ([c.utilisation for c in joint.checks if c.utilisation is not None] for joint in evaluation.joints.values())
    return sum(max(one) for one in used)


@pytest.mark.parametrize("term", ["mass", "price"])
@pytest.mark.parametrize("seed", range(3))
def test_equal_sets_come_in_the_order_of_their_reserve(make, seed, term):
    study = wound_study(make, seed, 12, term)
    names, every = study.cycle.joint_names, []
    for pairs in itertools.product(*(task.pairs for task in study.joints)):
        found = evaluate(study, dict(zip(names, pairs, strict=True)))
        if found.feasible:
            every.append((found.objective, reserve_used(found)))
    selection = select(study)
    told = [(one.objective, reserve_used(evaluate(study, one.drives))) for one in selection.sets]
    assert len(every) > 12
    least = min(every)[0]
    assert sum(objective <= least * (1 + SAME) for objective, _ in every) > 3  # many are equal
    expected = sorted((round(objective / least, 9), used) for objective, used in every)[:12]
    assert [one for one, _ in told] == pytest.approx([least * one for one, _ in expected], rel=SAME)
    assert [used for _, used in told] == pytest.approx([used for _, used in expected], abs=RESERVE)


def test_order_of_equals_is_the_same_however_often_a_search_is_stopped(make):
    study = wound_study(make, 1, 9)
    whole = select(study)
    part = select(study, wanted=replace(study.wanted, time_limit=0.0))
    while part.state is not None:
        part = select(study, resume=part, wanted=replace(study.wanted, time_limit=0.0))
    assert [one.drives for one in part.sets] == [one.drives for one in whole.sets]


def test_what_is_equal_in_every_number_comes_in_the_order_of_the_study(make):
    study = wound_study(make, 2, 4)
    motors = {
        f"{key}{copy}": replace(row, key=f"{key}{copy}") for key, row in study.catalog.motors.items() for copy in "ab"
    }
    pairs = tuple(itertools.product(motors, study.catalog.gears))
    tasks = tuple(replace(task, pairs=pairs) for task in study.joints)
    sets = select(replace(study, joints=tasks, catalog=Catalog(motors, study.catalog.gears))).sets
    copies = ["".join(motor[-1] for motor, _ in one.drives.values()) for one in sets]
    assert copies == ["aa", "ab", "ba", "bb"]


def test_trifles_that_order_equals_are_not_told(make):
    study = wound_study(make, 0, 3)
    selection = select(study)
    best = evaluate(study, selection.drives)
    assert selection.objective == best.objective == selection.sets[0].objective == selection.bound
