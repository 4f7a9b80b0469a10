"""The compiled judge against the functions of an evaluation: every figure of every check, verdicts, power, bounds."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetrain.drive import heat_state
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.demand.load_basis import drive_numbers
from drivetrain.sizing.judge.check_numbers import MOTOR_TORQUE, NAMES, UNCHECKED
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.judge import is_direct, judge
from drivetrain.sizing.judge.judge_kernels import (
    ASK,
    FALLS,
    HOLDS,
    LACKS,
    bound_joint,
    figures,
    holds_speed,
    judge_exact,
    least_energy,
    load_joint,
    may_hold,
    new_bounds,
    new_load,
    pair_power,
)
from drivetrain.sizing.judge.operation import operation
from drivetrain.sizing.judge.packed_task import chosen_numbers, pack
from drivetrain.sizing.results import Fallen
from drivetrain.sizing.search.fallen import beside, fallen_table
from drivetrain.study.read import load_study
from drivetrain.study.verdicts import ESSENTIAL, Verdict

PACKAGE = Path(heat_state.__file__).parents[1]
EXAMPLES = PACKAGE.parent / "examples"
CLOSE = 1e-9  # relative; both sum the same terms in another order


def _random_tasks():
    """The file beside this one; test folders are no packages."""
    name = "random_tasks"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name("random_tasks.py"))
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


TASKS = _random_tasks()


class Road:
    """A study on both roads, some drives in place."""

    def __init__(self, study, seed):
        self.study, self.rng, self.shelf = study, np.random.default_rng(seed), Shelf(study)
        self.packed = pack(study)
        self.task, self.load = self.packed.task, new_load(self.packed.task)
        first = self.task.first
        self.chosen = {j: int(self.rng.integers(first[j], first[j + 1])) for j in range(len(study.joints))}

    def drive(self, joint, pair):
        return self.shelf.drive(self.study.joints[joint], *self.packed.keys(pair))

    def operation(self, joint, pair):
        others = {k: self.drive(k, one) for k, one in self.chosen.items() if k != joint}
        own = self.drive(joint, pair)
        return operation(self.study, joint, self.packed.work.at(joint, others).demand(own), own)

    def some(self, joint, count):
        first, last = self.task.first[joint : joint + 2]
        return [int(pair) for pair in self.rng.permutation(np.arange(first, last))[:count]]

    def set_load(self, joint):
        load_joint(self.task, joint, chosen_numbers(self.packed, self.chosen), self.load)


def essential_lack(op, checks):
    made = {check.name for check in checks if check.verdict is not Verdict.NOT_CHECKED}
    skipped = ESSENTIAL[:1] if is_direct(op) else ()
    return [name for name in ESSENTIAL[:4] if name not in made and name not in skipped]  # those of one drive


def agree(road, joint, pair):
    """Every figure and verdict of one pair; the verdict's code."""
    op = road.operation(joint, pair)
    road.set_load(joint)
    made = judge(op)
    figures(road.task, joint, pair, road.load, True)
    found = {check.name: check for check in made}
    for row, name in zip(road.load.checks, NAMES, strict=True):
        check = found.get(name)
        if check is None or check.utilisation is None:
            assert row[2] == UNCHECKED, name
            continue
        assert row[2] == pytest.approx(check.utilisation, rel=CLOSE, abs=CLOSE), name
        assert row[0] == pytest.approx(check.required, rel=CLOSE, abs=CLOSE), name
        assert row[1] == pytest.approx(check.available, rel=CLOSE), name
    staged = judge(op, stop_at_fail=True)
    failed = [check for check in staged if check.verdict is Verdict.FAIL]
    lacking = essential_lack(op, made)
    verdict, code, used = figures(road.task, joint, pair, road.load, False)
    if failed:
        worst = max(failed, key=lambda one: one.utilisation)
        assert (verdict, NAMES[code]) == (FALLS, worst.name)
        assert used == pytest.approx(worst.utilisation, rel=CLOSE)
    else:
        assert verdict == (FALLS if lacking else HOLDS)
        assert not lacking or NAMES[code - LACKS] == lacking[0]
    holds = not lacking and all(check.verdict is not Verdict.FAIL for check in made)
    quick = judge_exact(road.task, joint, pair, road.load)
    if quick[0] != ASK:
        assert (quick[0] == HOLDS) == holds
    if quick[0] == HOLDS:
        binding = max((one for one in made if one.utilisation is not None), key=lambda one: one.utilisation)
        assert quick[2] == pytest.approx(binding.utilisation, rel=CLOSE)
    speeds = ("motor speed", "gear maximum input speed", "gear mean input speed")
    slow = any(one.verdict is Verdict.FAIL for one in made if one.name in speeds)
    assert holds_speed(road.task, joint, pair) == (not slow)
    if not op.missing:
        power = np.empty(len(op.demand.time))
        energy = pair_power(road.task, joint, pair, road.load, power)
        expected = op.balance.electrical
        np.testing.assert_allclose(power, expected, rtol=CLOSE, atol=CLOSE * np.abs(expected).max())
        scale = float(np.abs(expected) @ op.demand.weights)  # what comes in and goes out may nearly cancel
        assert energy == pytest.approx(float(expected @ op.demand.weights), abs=CLOSE * scale)
    return quick[0]


@pytest.mark.parametrize("name", ["one_axis", "ur5_pick_and_place", "desktop_arm", "puma560"])
def test_examples_agree_check_by_check(name):
    road = Road(load_study(EXAMPLES / name / "study.yaml"), 1)
    for joint in range(len(road.study.joints)):
        for pair in road.some(joint, 8):
            agree(road, joint, pair)


@pytest.mark.parametrize("kind", TASKS.KINDS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_random_studies_agree_check_by_check(make, kind, seed):
    road = Road(TASKS.random_study(make, seed, kind), seed)
    for joint in range(len(road.study.joints)):
        for pair in road.some(joint, 4):
            agree(road, joint, pair)


def test_random_studies_have_all_answers(make):
    found = set()
    for seed in range(8):
        for kind in TASKS.KINDS:
            road = Road(TASKS.random_study(make, seed, kind), seed)
            found |= {
                agree(road, joint, pair) for joint in range(len(road.study.joints)) for pair in road.some(joint, 3)
            }
    assert {HOLDS, FALLS} <= found


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_numbers_masses_and_prices_are_those_of_the_drives(make, kind):
    road = Road(TASKS.random_study(make, 3, kind), 0)
    for joint in range(len(road.study.joints)):
        for pair in road.some(joint, 8):
            drive = road.drive(joint, pair)
            expected = drive_numbers(road.study, joint, drive)
            np.testing.assert_allclose(road.task.numbers[pair], expected, rtol=1e-14, atol=1e-18)
            ideal = drive.gear.key == ""
            parts = [drive.motor.mass, 0.0 if ideal else drive.gear.mass]
            prices = [drive.motor.price, 0.0 if ideal else drive.gear.price]
            for value, summands in ((road.packed.mass[pair], parts), (road.packed.price[pair], prices)):
                assert np.isnan(value) if None in summands else value == pytest.approx(sum(summands))


@pytest.mark.parametrize("kind", TASKS.KINDS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_bounds_never_rule_out_what_holds(make, kind, seed):
    road = Road(TASKS.random_study(make, seed, kind), seed)
    rng, bounds = road.rng, new_bounds(road.task)
    power = np.empty(road.task.series.shape[2])
    for joint in range(len(road.study.joints)):
        size = 10.0 ** rng.uniform(-3, 0.3) * (np.abs(road.task.bare[joint]).max() + 0.1)
        middle = road.task.bare[joint] * rng.uniform(0.0, 1.2) + size * rng.standard_normal()
        low = middle - size * rng.random(len(middle)) * rng.choice([0.0, 1.0])
        high = middle + size * rng.random(len(middle)) * rng.choice([0.0, 1.0])
        bound_joint(road.task, joint, low, high, bounds)
        for share in (0.0, 1.0, rng.random(len(middle)), np.clip(-low / np.maximum(high - low, 1e-30), 0.0, 1.0)):
            bare = np.array(road.task.bare)
            bare[joint] = low + share * (high - low)
            history = road.task._replace(bare=bare)
            for pair in road.some(joint, 5):
                load_joint(history, joint, np.zeros_like(road.load.drives), road.load)
                verdict, code, _ = judge_exact(history, joint, pair, road.load)
                if verdict != FALLS:
                    assert may_hold(road.task, joint, pair, bounds), (code, NAMES[code])
                    energy = pair_power(history, joint, pair, road.load, power)
                    weights = road.task.series[joint, 9]
                    slack = 1e-9 * float(np.abs(power) @ weights)
                    assert least_energy(road.task, joint, pair, bounds) <= energy + slack


@pytest.mark.parametrize("kind", ["arm", "table", "dwell"])
def test_bounds_without_width_rule_out_nearly_as_much_as_the_judge(make, kind):
    fell = missed = 0
    for seed in range(12):
        road = Road(TASKS.random_study(make, seed, kind), seed)
        bounds = new_bounds(road.task)
        for joint in range(len(road.study.joints)):
            road.set_load(joint)
            force = road.load.base[0].copy()
            bound_joint(road.task, joint, force, force, bounds)
            for pair in road.some(joint, 20):
                verdict, code, _ = judge_exact(road.task, joint, pair, road.load)
                if verdict == FALLS and code not in (6, 7, 8, 10):  # bearing loads and inertia are not bounded
                    fell += 1
                    missed += may_hold(road.task, joint, pair, bounds)
    assert fell > 100
    assert missed < 0.1 * fell  # the ripple of the winding is not bounded


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_table_of_the_fallen_says_what_an_evaluation_says(make, kind):
    road = Road(TASKS.random_study(make, 11, kind), 2)
    share = road.packed.mass
    parts, unknown, expected = [], {}, []
    for joint in reversed(range(len(road.study.joints))):
        pairs = np.array(road.some(joint, 12))
        unknown[joint] = pairs[np.isnan(share[pairs])]
        known = pairs[~np.isnan(share[pairs])]
        parts.append(beside(road.packed, joint, known, road.chosen))
        for pair in known.tolist():
            op = road.operation(joint, pair)
            checks = judge(op, stop_at_fail=True)
            failed = [check for check in checks if check.verdict is Verdict.FAIL]
            lacking = essential_lack(op, checks)
            keys = road.study.joints[joint].name, *road.packed.keys(pair)
            if failed:
                worst = max(failed, key=lambda one: one.utilisation)
                numbers = worst.required, worst.available, worst.unit, worst.utilisation
                expected.append((*keys, worst.name, *numbers, share[pair]))
            elif lacking:
                told = next(check for check in checks if check.name == lacking[0])
                required = np.nan if told.required is None else told.required
                expected.append(
                    (*keys, f"{lacking[0]} (not checked)", required, np.nan, told.unit, np.inf, share[pair])
                )
            else:
                assert pair in parts[-1].held
        names = (road.study.joints[joint].name,)
        expected += [
            (*names, *road.packed.keys(pair), "mass (not known)", np.nan, np.nan, "kg", np.inf, np.nan)
            for pair in unknown[joint].tolist()
        ]
    table = fallen_table(road.packed, parts, share, unknown)
    assert len(table) == len(expected)
    frame = table.frame()
    for row, wanted in enumerate(expected):
        for found in (table[row], Fallen(*(frame.iloc[row][name] for name in Fallen.__dataclass_fields__))):
            values = [getattr(found, name) for name in Fallen.__dataclass_fields__]
            for value, one in zip(values, wanted, strict=True):
                assert value == one if isinstance(one, str) else value == pytest.approx(one, rel=CLOSE, nan_ok=True)
    assert [one.motor for one in table[1:3]] == [one[1] for one in expected[1:3]]


def test_near_a_limit_the_evaluation_is_asked(make):
    road = Road(TASKS.random_study(make, 5, "arm"), 0)
    joint = 2
    for pair in road.some(joint, 40):
        road.set_load(joint)
        if judge_exact(road.task, joint, pair, road.load)[0] == HOLDS:
            break
    peak = road.load.checks[MOTOR_TORQUE, 0]
    motors = np.array(road.task.motors)
    for limit, verdict in ((peak * (1 + 1e-11), ASK), (peak * (1 - 1e-11), ASK), (peak * (1 - 1e-6), FALLS)):
        motors[joint, road.task.pairs[pair, 0], 8] = limit
        assert judge_exact(road.task._replace(motors=motors), joint, pair, road.load)[0] == verdict


def test_work_given_is_the_one_packed(make):
    study = TASKS.random_study(make, 0, "arm")
    work = workload(study)
    assert pack(study, work).work is work
