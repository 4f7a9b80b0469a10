"""The search against brute force: every objective, every check, k best sets, rules for all joints, bound and resumption."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.sizing.evaluate import evaluate
from drivetrain.sizing.packed_task import pack
from drivetrain.sizing.problem import problem
from drivetrain.sizing.search import select
from drivetrain.sizing.search_tree import Tree
from drivetrain.study.study import DriveMass, JointTask, Mount, Safety, Study, Wanted

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
    return make.study(
        cycle, arm=arm, joints=tasks, catalog=parts, supply=Supply(48.0, *limits), safety=safety, wanted=wanted,
        drive_mass=DriveMass.INCLUDED if rng.random() < 0.2 else DriveMass.ADDED,
    )  # fmt: skip


def joint_task(make, rng, name: str, pairs) -> JointTask:
    """One joint: where its drive sits, its friction, its amplifier, and sometimes a given drive."""
    return make.task(
        name, drive=pairs[int(rng.integers(len(pairs)))] if rng.random() < 0.1 else None, pairs=pairs,
        mount=Mount(str(rng.choice(["parent", "child", "base"])), 0.05 * rng.random()),
        friction=Friction(coulomb=rng.uniform(0, 1), viscous=rng.uniform(0, 0.5)),
        amplifier=Amplifier(*(rng.uniform(5, 40) if rng.random() < 0.5 else None for _ in range(2))),
    )  # fmt: skip


def every_set(study: Study):
    """All combinations that an evaluation finds feasible: (objective, drives), best first."""
    names, found = study.cycle.joint_names, []
    for pairs in itertools.product(*((t.drive,) if t.drive else t.pairs for t in study.joints)):
        drives = dict(zip(names, pairs, strict=True))
        evaluation = evaluate(study, drives)
        if evaluation.feasible:
            found.append((evaluation.objective, drives))
    return sorted(found, key=lambda one: one[0])


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


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), weights=st.sampled_from(OBJECTIVES), sets=st.integers(1, 7))
def test_k_best_sets_are_those_of_brute_force(make, seed, weights, sets):
    study = random_study(make, seed, Wanted(weights, sets=sets))
    expected = [objective for objective, _ in every_set(study)[:sets]]
    selection = select(study)
    # Compiled code and evaluation sum in different orders.
    assert [one.objective for one in selection.sets] == pytest.approx(expected, rel=1e-9)
    assert selection.feasible == bool(expected)
    assert "disagreements" not in selection.counters
    if expected:
        assert selection.proof == "optimal"
        assert selection.bound == pytest.approx(expected[0], rel=1e-9)
        assert len({tuple(one.drives.items()) for one in selection.sets}) == len(expected)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
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
    selection = select(study)
    assert [one.objective for one in selection.sets] == pytest.approx(expected, rel=1e-9)
    assert all(kept(study, one.drives) for one in selection.sets)
