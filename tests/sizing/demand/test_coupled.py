"""Drives behind coupled shafts: the search against brute force, who loads whom, and what is told of them."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from random_tasks import feasible_sets

from drivetrain.arm.coupling import belts_over, differential, placed, with_coupling
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.drive.friction import Friction
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.demand.load_basis import loading_drives
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Mount
from drivetrain.study.parts.verdicts import Verdict

GROUP = (1, 2)
NAMES = ("j2", "j3")
GROUP_MOUNT = Mount("parent", 0.0, 1)


def rows(make, seed):
    """Rows around a common size, so that some fit and some do not."""
    rng = np.random.default_rng(seed)
    motors, gears = {}, {}
    for i, size in enumerate(rng.uniform(0.3, 2.5, 2)):
        motors[f"m{i}"] = replace(
            make.motor, key=f"m{i}", mass=0.4 * size, nominal_current=5.0 * size, peak_current=18.0 * size,
            rotor_inertia=2e-5 * size**2, resistance=0.3 / size,
        )  # fmt: skip
    for i, size in enumerate(rng.uniform(0.3, 2.5, 2)):
        gears[f"g{i}"] = replace(
            make.gear, key=f"g{i}", ratio=float([40.0, -90.0][i]), mass=0.4 * size, repeated_peak_torque=35.0 * size,
            average_torque_limit=25.0 * size,
        )  # fmt: skip
    return Catalog(motors, gears)


def study(make, seed, matrix, mounts, given=None):
    """Three joints, the last two coupled."""
    rng = np.random.default_rng(seed)
    bare = make.planar_arm([0.4, 0.35, 0.3], rng.uniform(0.5, 1.5, 3))
    arm = with_coupling(bare, placed(matrix, GROUP, 3))
    catalog = rows(make, seed)
    pairs = tuple(itertools.product(catalog.motors, catalog.gears))
    tasks = tuple(
        make.task(f"j{i + 1}", drive=given, pairs=pairs, mount=mounts[i], coupled=NAMES if i in GROUP else (),
                  friction=Friction(0.2, 0.2, 0.1, 0.1))
        for i in range(3)
    )  # fmt: skip
    cycle = make.sines(3, samples=31, duration=2.0, size=rng.uniform(0.3, 1.0))
    return make.study(cycle, arm=arm, joints=tasks, catalog=catalog, supply=Supply(48.0, peak_power=600.0))


MOUNTS = {
    "before the group": (Mount(), GROUP_MOUNT, GROUP_MOUNT),
    "on the base": (Mount(), Mount("base"), Mount("base")),
    "the last one within": (Mount(), Mount(), Mount()),
}


@pytest.mark.parametrize("place", MOUNTS)
@pytest.mark.parametrize(("seed", "kind"), [(0, "differential"), (1, "belt"), (2, "belt"), (5, "differential")])
def test_search_is_brute_force(make, seed, kind, place):
    matrix = differential() if kind == "differential" else belts_over([1.0])
    task = study(make, seed, matrix, MOUNTS[place])
    selection = select(task, advise=False)
    best = min((one.objective for one in feasible_sets(task)), default=math.inf)
    assert selection.feasible == math.isfinite(best)
    if selection.feasible:
        assert selection.proof == "optimal"
        assert selection.objective == pytest.approx(best, rel=1e-14)


def test_both_answers_occur(make):
    found = [
        select(study(make, s, differential(), MOUNTS["before the group"]), advise=False).feasible for s in (0, 1, 2, 5)
    ]
    assert any(found) and not all(found)


def test_who_loads_whom(make):
    def loads(mounts):
        task = study(make, 0, differential(), mounts)
        return [loading_drives(task, joint) for joint in range(3)]

    assert loads(MOUNTS["before the group"]) == [(1, 2), (2,), ()]
    assert loads(MOUNTS["the last one within"]) == [(1, 2), (2,), (2,)]
    assert loads((Mount(), Mount("child"), GROUP_MOUNT)) == [(1, 2), (1, 2), (1,)]


def test_a_drive_that_loads_a_shaft_after_it_is_chosen_as_well(make):
    """The search decides no joint before another, so a drive may load shafts on both sides of it."""
    task = study(make, 1, differential(), (Mount(), Mount("child"), GROUP_MOUNT))
    best = sorted(one.objective for one in feasible_sets(task))[:5]
    selection = select(task)
    assert [one.objective for one in selection.best_sets] == pytest.approx(best, rel=1e-14)


def test_the_heavy_drive_within_the_group_counts_for_every_shaft(make):
    """Evaluation has no order: all shafts of a group feel a drive that rides on it."""
    task = study(make, 0, differential(), MOUNTS["the last one within"], given=("m0", "g0"))
    heavy = replace(task, catalog=replace(task.catalog, motors={
        **task.catalog.motors, "m0": replace(task.catalog.motors["m0"], mass=20.0)}))  # fmt: skip
    for name in NAMES:
        light, loaded = (np.abs(evaluate(one).joints[name].series.gear_torque).max() for one in (task, heavy))
        assert loaded > 3.0 * light


def test_series_are_those_of_the_shaft(make):
    matrix = np.array([[1.0, 0.0], [1.0, 1.0]])
    task = study(make, 1, matrix, MOUNTS["on the base"], given=("m0", "g0"))
    evaluation = evaluate(task)
    cycle, shaft = task.cycle, evaluation.joints["j3"].series
    np.testing.assert_allclose(shaft.speed, cycle.velocity[:, 1] + cycle.velocity[:, 2], atol=1e-14)
    np.testing.assert_allclose(shaft.position, cycle.position[:, 1] + cycle.position[:, 2], atol=1e-14)
    np.testing.assert_allclose(shaft.motor_speed, 40.0 * shaft.speed, atol=1e-12)
    result = evaluation.joints["j3"]
    assert any("drives j2, j3 together" in remark for remark in result.remarks)
    bearing = [check for check in result.checks if check.name.startswith("output bearing")]
    assert len(bearing) == 5 and all(check.verdict is Verdict.NOT_CHECKED for check in bearing)
    assert all("away from the joint" in check.remark for check in bearing)
    assert not any("away from" in check.remark for check in evaluation.joints["j1"].checks)
    assert len(current_commands(evaluation)) == 3 * len(cycle.time)


def test_a_mirrored_differential_asks_the_same(make):
    """Both motors changed over, and the second joint turned the other way: the same arm, seen from behind."""
    mounts = MOUNTS["before the group"]
    one = evaluate(study(make, 2, differential(), mounts, given=("m1", "g0")))
    other = evaluate(study(make, 2, differential()[::-1], mounts, given=("m1", "g0")))
    for a, b in (("j2", "j3"), ("j3", "j2")):
        for name in ("motor_torque", "current", "electrical_power"):
            pair = getattr(one.joints[a].series, name), getattr(other.joints[b].series, name)
            np.testing.assert_allclose(*pair, rtol=1e-12, atol=1e-12)  # sums in another order
        assert one.joints[a].verdict is other.joints[b].verdict


def test_a_differential_shares_the_load(make):
    """Both motors lift the second joint together: each shaft bears half of what one alone would."""
    alone = study(make, 2, np.eye(2), (Mount(), Mount("base"), Mount("base")), given=("m1", "g0"))
    alone = replace(alone, joints=tuple(replace(task, coupled=(), friction=Friction()) for task in alone.joints))
    still = replace(alone, cycle=replace(
        alone.cycle, position=np.zeros_like(alone.cycle.position), velocity=np.zeros_like(alone.cycle.velocity),
        acceleration=np.zeros_like(alone.cycle.acceleration)))  # fmt: skip
    shared = replace(still, arm=with_coupling(still.arm, placed(differential(), GROUP, 3)))
    one, two = evaluate(still), evaluate(shared)
    held = [one.joints[name].series.gear_torque for name in NAMES]
    found = [two.joints[name].series.gear_torque for name in NAMES]
    np.testing.assert_allclose(found[0], 0.5 * (held[0] + held[1]), rtol=1e-12)
    np.testing.assert_allclose(found[1], 0.5 * (held[0] - held[1]), rtol=1e-12)
