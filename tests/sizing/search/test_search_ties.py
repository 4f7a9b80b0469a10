"""Sets of equal objective: energy, then the largest utilisation order them, all are counted, and that is proven."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_tasks import KINDS, feasible_sets
from random_tasks import random_study as random_task

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search import tree as search_tree
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Stop, Study
from drivetrain.study.parts.selection import Wanted

SAME = 1e-9  # relative: objectives, and energies, that differ by less are equal


def wound_study(make, seed: int, sets: int, term: str = "mass", supply: Supply | None = None) -> Study:
    """Two joints, motors in several windings of one mass and price: many sets of equal objective."""
    rng = np.random.default_rng(seed)
    motors = {}
    for size, winding in itertools.product((0.8, 1.2), (0.7, 0.85, 1.0)):
        key = f"m{size}w{winding}"
        motors[key] = replace(
            make.motor, key=key, mass=0.4 * size, price=100.0 * size, nominal_current=9.0 * size / winding,
            peak_current=40.0 * size / winding, torque_constant=0.05 * size * winding, series=key[:4],
            resistance=0.3 * winding**2 / size * float(rng.uniform(0.9, 1.1)),
        )  # fmt: skip
    gears = {f"g{i}": replace(make.gear, key=f"g{i}", ratio=float(rng.uniform(40, 90))) for i in range(2)}
    cycle = make.sines(2, samples=31, duration=4.0, size=0.5)
    pairs = tuple(itertools.product(motors, gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names)
    return make.study(
        cycle, arm=make.planar_arm([0.4, 0.3], [0.8, 0.5]), joints=tasks, catalog=Catalog(motors, gears),
        supply=supply or Supply(48.0), wanted=Wanted(((term, 1.0),), sets=sets),
    )  # fmt: skip


def every_set(study: Study):
    """Objective, energy, largest utilisation and evaluation of all feasible sets in their order, by brute force."""
    found = [(one.objective, one.criteria["energy"], one.criteria["utilisation"], one) for one in feasible_sets(study)]
    least = min((one[0] for one in found), default=1.0)
    return sorted(found, key=lambda one: (round(one[0] / least / SAME), *one[1:3]))


def agrees(selection, expected) -> None:
    """A selection tells the first sets of brute force, in that order, and how many are as good as the first."""
    sets = selection.study.wanted.sets
    told = [(one.objective, one.criteria["energy"], one.criteria["utilisation"]) for one in selection.best_sets]
    assert np.array(told) == pytest.approx(np.array([one[:3] for one in expected[:sets]]), rel=SAME)
    if expected:
        assert selection.proof == "optimal"
        equal = sum(objective <= expected[0][0] * (1 + SAME) for objective, *_ in expected)
        assert (selection.equals, selection.all_equals) == (equal, True)


@pytest.mark.parametrize("term", ["mass", "price"])
def test_equal_sets_come_by_energy_then_utilisation(make, term):
    for seed in range(2):
        study = wound_study(make, seed, 1, term)
        expected = every_set(study)
        assert sum(one[0] <= expected[0][0] * (1 + SAME) for one in expected) > 3  # many are equal
        for sets in (1, 5, 60):
            agrees(select(replace(study, wanted=replace(study.wanted, sets=sets))), expected)


def test_a_supply_that_rules_out_some_of_the_equals_does_not_upset_their_order(make):
    free = every_set(wound_study(make, 0, 8))
    for limit in ("peak_power", "mean_power"):
        name = f"supply {limit.replace('_', ' ')}"
        drawn = [check.required for *_, found in free for check in found.shared if check.name == name]
        study = wound_study(make, 0, 8, supply=Supply(48.0, **{limit: float(np.median(drawn[: len(drawn) // 2]))}))
        expected = every_set(study)
        assert 8 < len(expected) < len(drawn)
        agrees(select(study), expected)


def test_rules_for_all_joints_leave_the_order_of_equals(make):
    study = wound_study(make, 1, 6)
    expected = [one for one in every_set(study) if len({motor for motor, _ in one[3].drives.values()}) == 1]
    agrees(select(replace(study, wanted=replace(study.wanted, most_motor_types=1))), expected)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), kind=st.sampled_from(KINDS), sets=st.integers(1, 4))
def test_random_tasks_with_few_masses_agree_with_brute_force(make, seed, kind, sets):
    """Masses in round numbers, so that sums are often equal; four pairs a joint."""
    study, rng = random_task(make, seed, kind), np.random.default_rng(seed)
    motors = {key: replace(row, mass=float(rng.choice([0.3, 0.5]))) for key, row in study.catalog.motors.items()}
    gears = {key: replace(row, mass=float(rng.choice([0.2, 0.4]))) for key, row in study.catalog.gears.items()}
    tasks = [
        replace(task, pairs=tuple(task.pairs[i] for i in rng.permutation(len(task.pairs))[:4])) for task in study.joints
    ]
    study = replace(study, joints=tuple(tasks), catalog=Catalog(motors, gears), wanted=Wanted(sets=sets))
    agrees(select(study, advise=False), every_set(study))


def test_many_equals_are_counted_to_a_limit_and_their_order_is_proven_all_the_same(make, monkeypatch):
    study = wound_study(make, 1, 3)
    expected = every_set(study)
    monkeypatch.setattr(search_tree, "MAX_COUNTED", 0)
    monkeypatch.setattr(search_tree, "MAX_ENUMERATED", 1)
    selection = select(study)
    told = [one.criteria["energy"] for one in selection.best_sets]
    assert told == pytest.approx([one[1] for one in expected[:3]], rel=SAME)
    assert selection.proof == "optimal"
    assert not selection.all_equals
    assert 3 <= selection.equals <= sum(one[0] <= expected[0][0] * (1 + SAME) for one in expected)


def test_where_all_joints_stop_at_a_current_only_sets_that_may_precede_are_judged(make):
    """Stops of the whole arm take long; the sets are those of brute force all the same."""
    study = wound_study(make, 1, 3)
    stopped = replace(study, joints=tuple(replace(task, stop=Stop()) for task in study.joints))
    gears = {key: replace(row, momentary_torque=limit) for (key, row), limit in
             zip(study.catalog.gears.items(), (190.0, 320.0), strict=True)}  # fmt: skip
    stopped = replace(stopped, catalog=Catalog(study.catalog.motors, gears))
    expected, selection = every_set(stopped), select(stopped)
    told = [(one.objective, one.criteria["energy"], one.criteria["utilisation"]) for one in selection.best_sets]
    assert np.array(told) == pytest.approx(np.array([one[:3] for one in expected[:3]]), rel=SAME)
    assert selection.proof == "optimal"
    equal = sum(one[0] <= expected[0][0] * (1 + SAME) for one in expected)
    assert selection.counters["equal sets judged"] < equal
    assert not selection.all_equals
    assert 3 <= selection.equals <= equal


def test_order_of_equals_is_the_same_however_often_a_search_is_stopped(make):
    study = wound_study(make, 1, 9)
    whole = select(study)
    part = select(study, wanted=replace(study.wanted, time_limit=0.0))
    while part.state is not None:
        assert part.proof != "optimal"
        part = select(study, resume=part, wanted=replace(study.wanted, time_limit=0.0))
    assert [one.drives for one in part.best_sets] == [one.drives for one in whole.best_sets]
    assert (part.equals, part.all_equals) == (whole.equals, True)


def test_what_is_equal_in_every_number_comes_in_the_order_of_the_study(make):
    study = wound_study(make, 2, 4)
    motors = {
        f"{key}{copy}": replace(row, key=f"{key}{copy}") for key, row in study.catalog.motors.items() for copy in "ab"
    }
    pairs = tuple(itertools.product(motors, study.catalog.gears))
    tasks = tuple(replace(task, pairs=pairs) for task in study.joints)
    sets = select(replace(study, joints=tasks, catalog=Catalog(motors, study.catalog.gears))).best_sets
    copies = ["".join(motor[-1] for motor, _ in one.drives.values()) for one in sets]
    assert copies == ["aa", "ab", "ba", "bb"]


def test_the_objective_told_is_that_of_the_evaluation(make):
    study = wound_study(make, 0, 3)
    selection = select(study)
    best = evaluate(study, selection.drives)
    assert selection.objective == best.objective == selection.best_sets[0].objective == selection.bound
