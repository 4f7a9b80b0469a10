"""The search against brute force: objectives, checks, k best sets, rules for all joints, bounds, resumption."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import random_tasks as TASKS
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.problem import Problem, build_problem
from drivetrain.sizing.search.search import select
from drivetrain.sizing.search.tree import Tree
from drivetrain.study.model import DriveMass, JointTask, Mount, Safety, StiffnessWish, Study
from drivetrain.study.parts.selection import Wanted
from drivetrain.study.parts.verdicts import Check, Verdict
from drivetrain.study.read import load_study

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
OBJECTIVES = (
    (("mass", 1.0),),
    (("price", 1.0),),
    (("energy", 1.0),),
    (("mass", 1.0), ("price", 0.01), ("energy", 0.02)),
)


def catalog(make, rng, motors, gears):
    """Parts around a common size; some sheets lack heat, life, friction or price."""
    rows, wheels = {}, {}
    for i in range(motors):
        size = 1.5 * rng.uniform(0.4, 2.5)
        silent = {"resistance_winding_housing": None, "max_winding_temperature": None} if rng.random() < 0.2 else {}
        rows[f"m{i}"] = replace(
            make.motor, key=f"m{i}", mass=0.4 * size * rng.uniform(0.8, 1.3), nominal_current=5.0 * size,
            peak_current=18.0 * size, rotor_inertia=2e-5 * size**2, resistance=0.3 / size * rng.uniform(0.7, 1.4),
            price=float(rng.uniform(50, 200)), series=f"s{rng.integers(2)}", **silent,
        )  # fmt: skip
    for i in range(gears):
        size = 1.5 * rng.uniform(0.4, 2.5)
        wheels[f"g{i}"] = replace(
            make.gear, key=f"g{i}", ratio=float(rng.choice([-30.0, 30.0, 60.0, 100.0])), mass=0.4 * size,
            repeated_peak_torque=35.0 * size, average_torque_limit=25.0 * size, momentary_torque=80.0 * size,
            continuous_torque=20.0 * size, efficiency=rng.uniform(0.6, 0.9), tilting_moment_limit=60.0 * size,
            radial_load_limit=90.0 * size, price=float(rng.uniform(40, 150)), series=f"t{rng.integers(2)}",
        )  # fmt: skip
    return Catalog(rows, wheels)


def random_study(make, seed: int, wanted: Wanted) -> Study:
    """A small task in which any check may bind: heat, life, bearing, supply, inertia ratio, amplifier."""
    rng = np.random.default_rng(seed)
    joints = int(rng.choice([1, 2, 2, 2, 3]))
    parts = catalog(make, rng, 3 if joints < 3 else 2, 3 if joints < 3 else 2)
    cycle = make.sines(joints, samples=31, duration=rng.uniform(1.5, 5.0), size=rng.uniform(0.3, 1.0))
    arm = make.planar_arm([0.4, 0.35, 0.3][:joints], rng.uniform(0.5, 2.0, joints))
    pairs = tuple(itertools.product(parts.motors, parts.gears))
    tasks = tuple(joint_task(make, rng, name, pairs) for name in cycle.joint_names)
    limits = [rng.uniform(*span) if rng.random() < 0.5 else None for span in ((50, 400), (10, 120), (0.5, 40))]
    safety = Safety(
        peak_torque=rng.uniform(1.0, 1.3), rms=rng.uniform(1.0, 1.2),
        inertia_ratio=rng.uniform(1.0, 30.0) if rng.random() < 0.3 else None,
        life=rng.uniform(1e6, 3e8) if rng.random() < 0.4 else None,
        temperature_margin=rng.uniform(0.0, 40.0),
    )  # fmt: skip
    bus = bus_limits(np.random.default_rng((seed, 5)))
    study = make.study(
        cycle, arm=arm, joints=tasks, catalog=parts, supply=Supply(48.0, *limits, **bus), safety=safety, wanted=wanted,
        drive_mass=DriveMass.INCLUDED if rng.random() < 0.2 else DriveMass.ADDED,
    )  # fmt: skip
    return TASKS.held_by_brakes(study, seed, silent=0.0)


def bus_limits(rng):
    """Of the bus behind the supply, often none."""
    found = {}
    if rng.random() < 0.3:
        found |= {"capacity": rng.uniform(1e-3, 2e-2), "max_voltage": rng.uniform(52.0, 90.0)}
    if rng.random() < 0.3:
        found |= {"threshold": rng.uniform(50.0, 80.0), "resistance": rng.uniform(10.0, 400.0)}
    return found


def joint_task(make, rng, name: str, pairs) -> JointTask:
    """One joint: where its drive sits, its friction, its amplifier, and sometimes a given drive."""
    return make.task(
        name, drive=pairs[int(rng.integers(len(pairs)))] if rng.random() < 0.1 else None, pairs=pairs,
        mount=Mount(str(rng.choice(["parent", "child", "base"])), 0.05 * rng.random()),
        friction=Friction(coulomb=rng.uniform(0, 1), viscous=rng.uniform(0, 0.5)),
        amplifier=Amplifier(
            *(rng.uniform(5, 40) if rng.random() < 0.5 else None for _ in range(2)), standby_power=3.0,
            on_resistance=0.02,
        ),
    )  # fmt: skip


def every_set(study: Study):
    """All combinations that an evaluation finds feasible: (objective, drives), best first."""
    return sorted(((one.objective, one.drives) for one in TASKS.feasible_sets(study)), key=lambda one: one[0])


def kept(study: Study, drives) -> bool:
    """Whether a set keeps the rules, counted by hand."""
    wanted, rows = study.wanted, study.catalog
    motors, gears = ({pair[i] for pair in drives.values()} for i in range(2))
    if len(motors) > (wanted.most_motor_types or 99) or len(gears) > (wanted.most_gear_types or 99):
        return False
    for group in wanted.same_family:
        of_motors = {rows.motors[drives[name][0]].series for name in group}
        of_gears = {rows.gears[drives[name][1]].series for name in group}
        if len(of_motors) > 1 or len(of_gears) > 1:
            return False
    return True


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), weights=st.sampled_from(OBJECTIVES), sets=st.integers(1, 7))
def test_k_best_sets_are_those_of_brute_force(make, seed, weights, sets):
    study = random_study(make, seed, Wanted(weights, sets=sets))
    expected = [objective for objective, _ in every_set(study)[:sets]]
    selection = select(study, advise=False)
    # Compiled code and evaluation sum in different orders.
    assert [one.objective for one in selection.best_sets] == pytest.approx(expected, rel=1e-9)
    assert selection.feasible == (bool(expected) and not selection.evaluation.lacking)
    assert "disagreements" not in selection.counters
    assert selection.proof == ("optimal" if expected else "no set fits: every combination was ruled out")
    if expected:
        assert selection.bound == pytest.approx(expected[0], rel=1e-9)
        assert len({tuple(one.drives.items()) for one in selection.best_sets}) == len(expected)


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    seed=st.integers(0, 10**6), weights=st.sampled_from(OBJECTIVES),
    motors=st.sampled_from([None, 1, 2]), gears=st.sampled_from([None, 1, 2]), family=st.booleans(),
)  # fmt: skip
def test_rules_leave_what_brute_force_leaves(make, seed, weights, motors, gears, family):
    study = random_study(make, seed, Wanted(weights, sets=3))
    names = study.cycle.joint_names
    groups = (names[-2:],) if family and len(names) > 1 else ()
    wanted = replace(study.wanted, most_motor_types=motors, most_gear_types=gears, same_family=groups)
    study = replace(study, wanted=wanted)
    expected = [objective for objective, drives in every_set(study) if kept(study, drives)][:3]
    selection = select(study, advise=False)
    assert [one.objective for one in selection.best_sets] == pytest.approx(expected, rel=1e-9)
    assert all(kept(study, one.drives) for one in selection.best_sets)


def wide_study(make, seed: int = 3, wanted: Wanted | None = None, supply: Supply | None = None) -> Study:
    """Three joints with 36 pairs each, most of which hold: many sets, near each other."""
    rng = np.random.default_rng(seed)
    rows = catalog(make, rng, 6, 6)
    motors = {key: replace(row, nominal_current=3 * row.nominal_current) for key, row in rows.motors.items()}
    parts = Catalog(motors, rows.gears)
    pairs = tuple(itertools.product(parts.motors, parts.gears))
    cycle = make.sines(3, samples=41, duration=5.0, size=0.4)
    return make.study(
        cycle, arm=make.planar_arm([0.4, 0.35, 0.3], [1.0, 0.8, 0.5]), catalog=parts, supply=supply or Supply(48.0),
        joints=tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names),
        wanted=wanted or Wanted((("price", 1.0),)),
    )  # fmt: skip


def as_told(selection):
    return [(one.objective, one.drives) for one in selection.best_sets]


@pytest.mark.parametrize("weights", OBJECTIVES)
def test_a_search_stopped_at_every_node_ends_as_one_that_was_not(make, weights):
    study = wide_study(make, wanted=Wanted(weights))
    whole = select(study)
    assert whole.proof == "optimal" and whole.state is None
    steps, bounds = 0, []
    part = select(study, wanted=replace(study.wanted, time_limit=0.0))
    while part.state is not None:
        bounds.append(part.bound)
        assert part.bound <= whole.objective * (1 + 1e-9)
        if part.best_sets:
            assert part.objective >= whole.objective * (1 - 1e-9)
            assert part.proof.startswith("not proven") or part.objective <= part.bound * (1 + 1e-9)
        part = select(study, resume=part, wanted=replace(study.wanted, time_limit=0.0))
        steps += 1
        assert steps < 3000
    assert as_told(part) == as_told(whole)
    assert bounds == sorted(bounds)


def test_a_finished_search_has_nothing_to_resume(make):
    study = wide_study(make)
    whole = select(study)
    assert select(study, resume=whole) is whole


def test_resumption_asks_for_the_same(make):
    study = wide_study(make)
    part = select(study, wanted=replace(study.wanted, time_limit=0.0))
    assert part.state is not None
    with pytest.raises(InputError, match="another study"):
        select(wide_study(make, seed=4), resume=part)
    with pytest.raises(InputError, match="something else"):
        select(study, resume=part, wanted=replace(study.wanted, sets=2))


@pytest.mark.parametrize("weights", OBJECTIVES)
@pytest.mark.parametrize("seed", [3, 11])
def test_no_node_promises_too_little(make, weights, seed):
    """The bound of every node is below every set in it."""
    study = random_study(make, seed, Wanted(weights, sets=3))
    sets = every_set(study)
    chosen_from = build_problem(build_candidates(study), study.wanted)
    tree = Tree(chosen_from)
    while not tree.finished:
        for _, _, node in tree.open:
            pools = [set(one.tolist()) for one in _pools(node.domains)]
            inside = [
                objective for objective, drives in sets
                if all(any(chosen_from.candidates.keys(p) == keys for p in pool)
                       for pool, keys in zip(pools, drives.values(), strict=True))
            ]  # fmt: skip
            assert all(node.bound <= objective * (1 + 1e-9) + 1e-9 for objective in inside)
        tree.run(0.0, lambda *_: None)
    assert [one.objective for one in tree.best] == pytest.approx([objective for objective, _ in sets[:3]], rel=1e-9)


def _pools(domains):
    return [domain.pairs for domain in domains]


def test_greedy_from_the_tip_misses_the_optimum(make):
    """A light drive at the wrist may be dear, and a cheap heavy one makes the shoulder dearer than it saves."""
    for seed, lost in ((7, 1.06), (20, 1.15)):
        study = wide_study(make, seed)
        best = select(study)
        greedy: dict[str, tuple[str, str]] = {}
        for task in reversed(study.joints):
            by_price = sorted(task.pairs, key=lambda pair: price(study, pair))
            fixed = {t.name: t for t in study.joints}
            for pair in by_price:
                drives = {name: greedy.get(name, by_price[-1]) for name in fixed} | {task.name: pair}
                if evaluate(study, drives).joints[task.name].verdict in ("PASS", "MARGINAL"):
                    greedy[task.name] = pair
                    break
        assert len(greedy) == 3
        total = sum(price(study, pair) for pair in greedy.values())
        assert best.proof == "optimal"
        assert total > lost * best.objective


@pytest.mark.parametrize(("seed", "nodes"), [(23, 350), (42, 400), (50, 100)])
def test_the_cheapest_set_is_proven_in_few_nodes_where_price_buys_lightness(seed, nodes, monkeypatch):
    """900 pairs a joint; cheap motors whose voltage is too low or whose winding is too hot only when they are warm."""
    monkeypatch.syspath_prepend(str(EXAMPLES.parent / "benchmarks"))
    tasks, drawn = (import_module(name) for name in ("selection_tasks", "selection_random"))
    study = tasks.with_pairs(tasks.resampled(load_study(tasks.EXAMPLE), 200), *drawn.dear_catalog(900, seed))
    tree = Tree(build_problem(build_candidates(study), replace(study.wanted, weights=(("price", 1.0),), sets=1)))
    tree.run(math.inf, lambda *_: None)
    assert tree.best and tree.finished
    assert tree.counters["nodes made"] < nodes


def price(study, pair):
    return study.catalog.motors[pair[0]].price + study.catalog.gears[pair[1]].price


def test_a_supply_that_binds_does_not_make_it_enumerate(make):
    free = select(wide_study(make))
    power = sum(joint.series.electrical_power for joint in free.evaluation.joints.values())
    peak = float(power.max())
    for share in (0.9, 0.7, 0.5):
        study = wide_study(make, supply=Supply(48.0, peak_power=share * peak))
        selection = select(study)
        assert selection.counters["nodes made"] < 1500  # of 46 656 sets
        if selection.feasible:
            assert selection.objective >= free.objective
            assert evaluate(study, selection.drives).feasible
    nothing = select(wide_study(make, supply=Supply(48.0, peak_power=0.1 * peak)))
    assert not nothing.feasible
    assert nothing.proof == "no set fits: every combination was ruled out"
    assert nothing.counters["nodes made"] < 300


def test_power_fed_back_is_bounded_before_sets_are_whole(make):
    wanted = Wanted((("energy", 1.0),), sets=2)
    free = select(wide_study(make, wanted=wanted))
    power = sum(joint.series.electrical_power for joint in free.evaluation.joints.values())
    weights = free.study.cycle.weights
    back = float(np.maximum(-power, 0.0) @ weights / weights.sum())
    assert back > 0.0  # the least energy feeds back the most
    for share in (0.8, 0.4):
        study = wide_study(make, wanted=wanted, supply=Supply(48.0, regenerated_power=share * back))
        selection = select(study)
        assert selection.proof == "optimal"
        assert selection.counters["nodes made"] < 3000  # of 46 656 sets
        assert all(evaluate(study, one.drives).feasible for one in selection.best_sets)
        assert selection.objective > free.objective


@pytest.mark.parametrize("example", ["ur5_pick_and_place", "desktop_arm", "one_axis"])
def test_energy_of_the_examples_is_proven(example):
    study = load_study(EXAMPLES / example / "study.yaml")
    selection = select(study, wanted=Wanted((("energy", 1.0),), sets=2))
    assert selection.proof == "optimal"
    assert selection.counters["nodes made"] < 2000
    assert evaluate(study, selection.drives).criteria["energy"] == pytest.approx(selection.objective, rel=1e-12)


def test_a_set_that_an_evaluation_refuses_is_left_out_and_told(make, monkeypatch):
    """It does not happen; if it did, the other sets would still be found."""
    study = wide_study(make)
    first, second = select(study).best_sets[:2]
    real = Problem.evaluate

    def refusing(self, pairs):
        found = real(self, pairs)
        drives = {name: (one.motor, one.gear) for name, one in found.joints.items()}
        bad = Check("made up", 2.0, 1.0, "1", 2.0, Verdict.FAIL)
        return replace(found, shared=(*found.shared, bad)) if drives == first.drives else found

    monkeypatch.setattr(Problem, "evaluate", refusing)
    selection = select(study)
    assert selection.counters["disagreements"] == 1
    assert selection.drives == second.drives


def test_contradicting_rules_are_an_answer(make):
    study = wide_study(make, wanted=Wanted(most_motor_types=1))
    tasks = tuple(replace(t, drive=(f"m{i}", "g0")) if i < 2 else t for i, t in enumerate(study.joints))
    selection = select(replace(study, joints=tasks))
    assert not selection.feasible
    assert "motor types" in " ".join(selection.advice)


def test_load_tables_without_an_arm(make):
    rng = np.random.default_rng(5)
    time = np.linspace(0.0, 4.0, 33)
    speed = np.stack([np.sin(np.pi * time / 2), np.cos(np.pi * time / 2)], axis=1)
    cycle = make.table_cycle(time, 9.0 * speed, speed, np.gradient(speed, time, axis=0))
    parts = catalog(make, rng, 4, 4)
    pairs = tuple(itertools.product(parts.motors, parts.gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names)
    study = make.study(cycle, joints=tasks, catalog=parts, supply=Supply(48.0))
    expected = [objective for objective, _ in every_set(study)[:5]]
    assert len(expected) == 5
    assert [one.objective for one in select(study).best_sets] == pytest.approx(expected, rel=1e-9)


ALONE = {
    "gear repeated peak torque": "repeated_peak_torque", "gear momentary peak torque": "momentary_torque",
    "gear average torque": "average_torque_limit", "gear maximum input speed": "max_input_speed",
    "gear mean input speed": "average_input_speed_limit", "gear stiffness": "stiffness_1",
    "output bearing tilting moment": "tilting_moment_limit", "output bearing axial load": "axial_load_limit",
    "output bearing radial load": "radial_load_limit", "output bearing static load": "bearing_static_rating",
    "torque behind the gear": "stage_torque", "speed behind the gear": "stage_speed", "motor speed": "max_speed",
    "motor peak torque": "peak_torque", "motor peak current": "peak_current",
}  # fmt: skip


def generous(make) -> Study:
    """Two joints whose nine pairs each hold whatever the set; axes that lean, so that a bearing feels all of a load."""
    sizes, wheels = (0.6, 1.0, 1.7), ((30.0, 0.5), (60.0, 1.0), (100.0, 2.0))
    motors = {
        f"m{i}": replace(make.motor, key=f"m{i}", mass=size, nominal_current=90.0, peak_current=400.0, max_speed=3e3,
                         rotor_inertia=2e-5 * size, peak_torque=20.0, max_winding_temperature=None)
        for i, size in enumerate(sizes)
    }  # fmt: skip
    gears = {
        f"g{i}": replace(make.gear, key=f"g{i}", ratio=ratio, mass=mass, repeated_peak_torque=1e4, momentary_torque=1e5,
                         average_torque_limit=1e4, tilting_moment_limit=1e4, axial_load_limit=1e5,
                         radial_load_limit=1e5, bearing_static_rating=1e6, bearing_pitch_diameter=0.05,
                         bearing_offset=0.01, max_input_speed=3e3, average_input_speed_limit=3e3, stiffness_1=1e7,
                         stage_torque=1e4, stage_speed=1e3, staged=1.0)
        for i, (ratio, mass) in enumerate(wheels)
    }  # fmt: skip
    arm = make.planar_arm([0.4, 0.35], [1.0, 0.7])
    arm = replace(arm, gravity=np.array([1.0, -9.0, 4.0]))
    pairs = tuple(itertools.product(motors, gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs, mount=Mount("child", 0.05)) for name in arm.joint_names)
    return make.study(
        make.sines(2, samples=31, duration=3.0, size=0.6), arm=arm, joints=tasks, catalog=Catalog(motors, gears),
        supply=Supply(480.0), wanted=Wanted(sets=5), stiffness=StiffnessWish(first_resonance=2.0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def every_generous(make):
    found = TASKS.feasible_sets(generous(make))
    assert len(found) == 81
    return found


@pytest.mark.parametrize("check", ALONE)
def test_each_limit_that_alone_decides_is_that_of_brute_force(make, every_generous, check):
    """The middle of what sets ask at the first joint is the limit of all parts, the least of that the limit of one."""
    study, column = generous(make), ALONE[check]
    used = sorted(one.utilisation for found in every_generous for one in found.joints["j1"].checks if one.name == check)

    def limited(rows):
        return {
            key: replace(row, **{column: getattr(row, column) * (0.999 * used[0] if key[1] == "0" else used[40])})
            if hasattr(row, column) else row for key, row in rows.items()
        }  # fmt: skip

    tight = replace(study, catalog=Catalog(limited(study.catalog.motors), limited(study.catalog.gears)))
    left = every_set(tight)
    assert 0 < len(left) < 81
    selection = select(tight, advise=False)
    assert [one.objective for one in selection.best_sets] == pytest.approx([one for one, _ in left[:5]], rel=1e-9)
    assert selection.proof == "optimal"
    assert {check} == set(selection.rejected["check"])
