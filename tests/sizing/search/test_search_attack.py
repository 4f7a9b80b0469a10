"""The search against an evaluation of every set, over random studies of every kind: no set may be told apart."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import random_tasks as TASKS

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.sizing.judge.checks import SUPPLY_CHECKS
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.search import select
from drivetrain.sizing.search.tree import NO_TEST_LIMIT, Tree
from drivetrain.study.model import Study
from drivetrain.study.parts.selection import Wanted, family

WEIGHTS = (
    (("mass", 1.0),), (("price", 1.0),), (("energy", 1.0),), (("mass", 1.0), ("price", 0.01), ("energy", 0.02)),
    (("price", 1.0), ("energy", 1.0)), (("mass", 1.0), ("energy", 0.5)),
)  # fmt: skip
SEEDS = range(3)
EACH = {1: 14, 2: 8, 3: 4}  # candidates of a joint, by joints


def stronger(study: Study, rng) -> Study:
    """The same study with rows whose essential numbers are there and that hold more often; one motor comes twice."""
    motors = {
        key: replace(
            row, mass=row.mass or 0.5, rotor_inertia=row.rotor_inertia or 1e-5, inductance=row.inductance or 1e-4,
            max_winding_temperature=row.max_winding_temperature or 125.0, resistance=0.5 * row.resistance,
            peak_current=6.0 * (row.peak_current or 20.0), nominal_current=6.0 * (row.nominal_current or 8.0),
            peak_torque=None if row.peak_torque is None else 6.0 * row.peak_torque,
            max_speed=None if rng.random() < 0.5 else 2500.0, series=f"s{rng.integers(2)}",
            winding_time_constant=row.winding_time_constant or 10.0,
            brake=replace(row.brake, static_torque=20.0) if row.brake.key else row.brake,
        )
        for key, row in study.catalog.motors.items()
    }  # fmt: skip
    gears = {
        key: replace(
            row, mass=row.mass or 0.5, efficiency=row.efficiency or 0.7, inertia=row.inertia or 1e-6,
            repeated_peak_torque=4.0 * (row.repeated_peak_torque or 50.0),
            momentary_torque=row.momentary_torque and 12.0 * row.momentary_torque,
            ratcheting_torque=None, buckling_torque=row.buckling_torque and 4.0 * row.buckling_torque,
            average_torque_limit=None if row.average_torque_limit is None else 4.0 * row.average_torque_limit,
            tilting_moment_limit=1e3, axial_load_limit=1e5, radial_load_limit=1e5,
            bearing_offset=row.bearing_offset or 0.01, series=f"t{rng.integers(2)}",
        )
        for key, row in study.catalog.gears.items()
    }  # fmt: skip
    motors["m0x"] = replace(motors["m0"], key="m0x", resistance=1.1 * motors["m0"].resistance)
    tasks = tuple(
        replace(
            task, pairs=(*task.pairs, *(() if task.brakes else (("m0x", key) for key in gears))),
            amplifier=task.amplifier if rng.random() < 0.3 else Amplifier(None, None),
            motor_friction=task.motor_friction if rng.random() < 0.3 else None,
            output_bearing="external" if rng.random() < 0.8 else task.output_bearing,
            stop=replace(
                task.stop, current=task.stop.current and 6.0 * task.stop.current, jam=False,
                stops_per_day=task.stop.stops_per_day and 0.1,
            ),
        )
        for task in study.joints
    )  # fmt: skip
    safety = replace(study.safety, life=None, inertia_ratio=None)
    return replace(study, catalog=Catalog(motors, gears), joints=tasks, safety=safety, ambient=25.0)


def fewer(study: Study, rng) -> Study:
    """The same study with few candidates a joint, most of which may hold, and sometimes a given drive."""
    what = build_problem(build_candidates(study), Wanted())
    node = Tree(what).propagate(what.domains(), NO_TEST_LIMIT, None)
    domains = what.domains() if node is None else node.domains
    tasks = []
    for joint, task in enumerate(study.joints):
        left = [what.candidates.keys(int(pair)) for pair in rng.permutation(domains[joint].pairs)]
        others = [task.pairs[i] for i in rng.permutation(len(task.pairs))]
        pairs = tuple(dict.fromkeys([*left[: EACH[len(study.joints)] - 1], *others]))[: EACH[len(study.joints)]]
        tasks.append(replace(task, pairs=pairs, drive=pairs[0] if rng.random() < 0.08 else None))
    return replace(study, joints=tuple(tasks))


def asked(study: Study, rng) -> Study:
    """The same study with wishes drawn at random."""
    names = [task.name for task in study.joints]
    return replace(
        study,
        wanted=Wanted(
            WEIGHTS[rng.integers(len(WEIGHTS))], sets=int(rng.integers(1, 8)),
            most_motor_types=int(rng.integers(1, 3)) if rng.random() < 0.25 else None,
            most_gear_types=int(rng.integers(1, 3)) if rng.random() < 0.2 else None,
            same_family=(tuple(names[-2:]),) if rng.random() < 0.2 and len(names) > 1 else (),
        ),
    )  # fmt: skip


def limited(study: Study, rng) -> Study:
    """The same study with limits of supply near what some set that holds asks."""
    held = TASKS.feasible_sets(study)
    if not held or rng.random() < 0.5:
        return study
    asked = {check.name: check.required for check in held[rng.integers(len(held))].shared}
    limits = {
        row.limit: asked[row.name] * rng.uniform(0.7, 1.2) + 1e-9
        for row in SUPPLY_CHECKS
        if asked[row.name] is not None and row.limit != "braking_power" and rng.random() < 0.6
    }
    if rng.random() < 0.5:
        braking = asked["supply peak braking power"] or 1.0
        limits |= {"threshold": 60.0, "resistance": 3600.0 / braking * rng.uniform(0.8, 1.5)}
    if rng.random() < 0.5:
        limits |= {"capacity": 0.01 * rng.random(), "max_voltage": 48.0 * rng.uniform(1.05, 1.6)}
    return replace(study, supply=Supply(study.supply.voltage, **limits))


def kept(study: Study, drives) -> bool:
    """Whether a set keeps the rules, counted by hand."""
    wanted, rows = study.wanted, study.catalog
    if len({motor for motor, _ in drives.values()}) > (wanted.most_motor_types or 99):
        return False
    if len({gear for _, gear in drives.values()} - {""}) > (wanted.most_gear_types or 99):
        return False
    for group in wanted.same_family:
        motors = {family(rows.motors[drives[name][0]]) for name in group}
        gears = {family(rows.gears[drives[name][1]]) if drives[name][1] else "" for name in group}
        if len(motors) > 1 or len(gears) > 1:
            return False
    return True


def test_search_and_evaluation_never_disagree(make):
    some = 0
    for kind, seed in itertools.product(TASKS.KINDS, SEEDS):
        rng = np.random.default_rng([seed, 99])
        study = limited(asked(fewer(stronger(TASKS.random_study(make, seed, kind), rng), rng), rng), rng)
        found = [one.objective for one in TASKS.feasible_sets(study, partial(kept, study))]
        expected = sorted(one for one in found if not np.isnan(one))[: study.wanted.sets]
        selection = select(study, advise=False)
        slack = 1e-9 * max(map(abs, expected), default=0.0)
        assert [one.objective for one in selection.best_sets] == pytest.approx(expected, rel=1e-9, abs=slack), (
            kind,
            seed,
        )
        assert "disagreements" not in selection.counters
        if expected:
            some += 1
            assert selection.proof == "optimal"
            assert selection.bound == pytest.approx(expected[0], rel=1e-9, abs=slack)
    assert some >= 3  # most random studies ask too much of random rows
