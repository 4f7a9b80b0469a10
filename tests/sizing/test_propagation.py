"""What propagation rules out can be part of no set that holds, and what it promises no set undercuts."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.packed_task import pack
from drivetrain.sizing.search.choices import all_choices, segment
from drivetrain.sizing.search.power_bound import power_range
from drivetrain.sizing.search.problem import problem
from drivetrain.sizing.search.propagation import OPEN, propagate
from drivetrain.study.model import Mount
from drivetrain.study.selection import Wanted


def study_of(make, seed: int, wanted: Wanted):
    """Two joints, strong enough drives at both, bearings and heat near their limits."""
    rng = np.random.default_rng(seed)
    motors = {
        f"m{i}": replace(
            make.motor, key=f"m{i}", mass=float(rng.uniform(0.3, 1.2)), resistance=float(rng.uniform(0.15, 0.6)),
            nominal_current=float(rng.uniform(4, 15)), rotor_inertia=float(rng.uniform(1e-5, 8e-5)),
        )
        for i in range(3)
    }  # fmt: skip
    gears = {
        f"g{i}": replace(
            make.gear, key=f"g{i}", mass=float(rng.uniform(0.2, 1.0)), ratio=float(rng.uniform(25, 110)),
            tilting_moment_limit=float(rng.uniform(15, 60)), repeated_peak_torque=float(rng.uniform(20, 90)),
            average_torque_limit=float(rng.uniform(15, 60)),
        )
        for i in range(3)
    }  # fmt: skip
    cycle = make.sines(2, samples=41, duration=float(rng.uniform(2, 4)), size=0.5)
    carrier = str(rng.choice(["parent", "child"]))
    pairs = tuple(itertools.product(motors, gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs, mount=Mount(carrier)) for name in cycle.joint_names)
    arm = make.planar_arm([0.4, 0.3], rng.uniform(0.5, 1.5, 2))
    return make.study(cycle, arm=arm, joints=tasks, catalog=Catalog(motors, gears), wanted=wanted)


def holding_sets(study):
    """Pairs by keys of every set whose joints hold, with its objective and its power."""
    for pairs in itertools.product(*(task.pairs for task in study.joints)):
        found = evaluate(study, dict(zip(study.cycle.joint_names, pairs, strict=True)))
        if found.feasible:
            power = sum(joint.series.electrical_power for joint in found.joints.values())
            yield pairs, found.objective, power


@pytest.mark.parametrize("weights", [(("mass", 1.0),), (("energy", 1.0),)])
@pytest.mark.parametrize("seed", range(4))
def test_no_part_of_a_set_that_holds_is_ruled_out(make, seed, weights):
    study = study_of(make, seed, Wanted(weights))
    asked = problem(pack(study), study.wanted)
    choices, task = all_choices(asked.known, asked.setting), asked.packed.task
    code, _ = propagate(task, asked.setting, choices, np.inf, 10**9, 8, asked.memory)
    sets = list(holding_sets(study))
    if code != OPEN:
        assert not sets
        return
    total = np.empty((2, len(study.cycle.time)))
    power_range(task, asked.setting, choices, asked.memory, True, total)
    assert np.isfinite(total).all()
    left = [{asked.packed.keys(int(pair)) for pair in segment(choices, joint)} for joint in range(2)]
    for pairs, objective, power in sets:
        assert all(keys in there for keys, there in zip(pairs, left, strict=True))
        assert choices.least.sum() <= objective * (1 + 1e-9)
        slack = 1e-6 * np.abs(power).max()
        assert (total[0] <= power + slack).all()
        assert (total[1] >= power - slack).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_limit_keeps_what_is_cheaper(make, seed):
    study = study_of(make, seed, Wanted())
    asked = problem(pack(study), study.wanted)
    sets = sorted(objective for _, objective, _ in holding_sets(study))
    for limit in sets[:5]:
        choices = all_choices(asked.known, asked.setting)
        code, _ = propagate(asked.packed.task, asked.setting, choices, limit * (1 + 1e-9), 10**9, 8, asked.memory)
        assert code == OPEN
        assert choices.least.sum() <= limit * (1 + 1e-9)  # equals are put in order by less than that
