"""A mix judged: averages by share, peaks by the worst, heat over a common housing; and the search agrees."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drivetrain.motion.duty_cycle import build_mix
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.demand.series import difference_factors
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.change import slowed
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


@pytest.fixture(scope="module")
def study():
    return load_study(shipped("examples") / "one_axis" / "study.yaml")


@pytest.fixture(scope="module")
def drives(study):
    return select(study).drives


def mixed(study, shares, factor=1.6):
    cycle = build_mix([study.cycle, slowed(study.cycle, factor)], shares, names=["fast", "slow"])
    return replace(study, cycle=cycle)


def checks(evaluation):
    (result,) = evaluation.joints.values()
    return {check.name: check for check in result.checks}


def test_rms_and_means_are_those_of_the_parts_by_share(study, drives):
    cold = {key: replace(one, magnet_coefficient=0.0) for key, one in study.catalog.motors.items()}
    study = replace(study, catalog=replace(study.catalog, motors=cold))
    parts = [checks(evaluate(replace(study, cycle=one), drives)) for one in (study.cycle, slowed(study.cycle, 1.6))]
    for share in (0.2, 0.7):
        found = checks(evaluate(mixed(study, [share, 1.0 - share]), drives))
        square = [part["motor RMS current"].required ** 2 for part in parts]
        assert found["motor RMS current"].required ** 2 == pytest.approx(share * square[0] + (1.0 - share) * square[1])
        speeds = [part["gear mean input speed"].required for part in parts]
        expected = share * speeds[0] + (1.0 - share) * speeds[1]
        assert found["gear mean input speed"].required == pytest.approx(expected)
        for name in ("motor voltage", "motor peak torque", "gear repeated peak torque"):
            # the housing that they share is warmer than that of one part and cooler than that of the other
            assert found[name].required == pytest.approx(max(part[name].required for part in parts), rel=3e-3)
            assert "in fast" in found[name].remark


def test_equal_parts_are_the_plain_cycle(study, drives):
    plain, found = checks(evaluate(study, drives)), checks(evaluate(mixed(study, [0.3, 0.7], 1.0), drives))
    assert plain.keys() == found.keys()
    for name, check in plain.items():
        assert found[name].verdict is check.verdict
        if check.utilisation is not None:
            assert found[name].utilisation == pytest.approx(check.utilisation, rel=1e-9), name


def test_heat_lies_between_the_parts(study, drives):
    slow = checks(evaluate(replace(study, cycle=slowed(study.cycle, 1.6)), drives))["winding temperature"].required
    found = [
        checks(evaluate(mixed(study, [share, 1.0 - share]), drives))["winding temperature"].required
        for share in (0.0, 0.3, 0.7)
    ]
    # The slow part holds the door's spring longer at a stretch, the fast one warms the housing more.
    assert found == sorted(found) and found[0] < found[-1]
    assert slow <= found[0] < slow + 1.0  # the fast part, however rare, may leave the winding warmer than the slow one


def test_the_search_judges_a_mix_as_evaluate_does(study):
    task = mixed(study, [0.4, 0.6])
    selection = select(task)
    again = evaluate(task, selection.drives)
    assert selection.feasible and again.feasible
    assert selection.objective == pytest.approx(again.objective)
    # A part of share 0 leaves only its peaks, so the choice is never heavier with less of the hard part.
    easier = select(mixed(study, [0.1, 0.9]))
    assert easier.objective <= selection.objective + 1e-12


def test_no_current_is_differentiated_across_the_joint(study, drives):
    task = mixed(study, [0.5, 0.5])
    demand = workload(task).at(0, {}).demand(None)
    joint = task.cycle.parts[1].start
    current = np.where(np.arange(len(demand.time)) < joint, 0.0, 5.0)
    before, at, after = difference_factors(demand)
    rate = before * np.roll(current, 1) + at * current + after * np.roll(current, -1)
    # Across the joint it would be 5 A over a step, some thousand; three products of a constant leave their rounding.
    assert np.abs(rate).max() < 1e-14 * 5.0 * np.abs(at).max() + 1e-300
    table = current_commands(evaluate(task, drives))
    assert len(table) == len(task.cycle.time)


@pytest.mark.parametrize("seed", range(20))
def test_rates_of_change_are_the_mean_slope_of_the_sides_that_do_not_step(seed):
    """At every sample: where time, direction, payload and part of a mix stay, the slope counts, else the other side."""
    rng, samples = np.random.default_rng(seed), 14
    time = np.cumsum(rng.choice([0.0, 0.1, 0.3], samples, p=[0.2, 0.4, 0.4]))
    payload, speed = rng.choice([0, 0, 0, 1, -1], samples), rng.choice([1.0, 1.0, 2.0, -1.0], samples)
    at_rest, part = rng.random(samples) < 0.2, np.repeat([0, 1], [5, samples - 5])
    demand = SimpleNamespace(
        time=time, payload=payload, speed=np.where(at_rest, 1e-12, speed), at_rest=at_rest,
        cycle=SimpleNamespace(parts=(slice(0, 5), slice(5, samples))),
    )  # fmt: skip
    current, way = rng.normal(size=samples), np.where(at_rest, 0.0, np.sign(speed))
    before, at, after = difference_factors(demand)
    found = before * np.append(0.0, current[:-1]) + at * current + after * np.append(current[1:], 0.0)
    for i in range(samples):
        slopes = [
            (current[k + 1] - current[k]) / (time[k + 1] - time[k]) for k in (i - 1, i)
            if 0 <= k < samples - 1 and time[k + 1] > time[k] and way[k + 1] == way[k]
            and payload[k + 1] == payload[k] and part[k + 1] == part[k]
        ]  # fmt: skip
        assert found[i] == pytest.approx(np.mean(slopes or [0.0]), rel=1e-12, abs=1e-13)


def test_energy_is_that_of_the_mean_use(study, drives):
    fast, slow = (evaluate(replace(study, cycle=one), drives) for one in (study.cycle, slowed(study.cycle, 1.6)))
    task = mixed(study, [0.25, 0.75])
    power = 0.25 * fast.criteria["energy"] / fast.study.cycle.duration
    power += 0.75 * slow.criteria["energy"] / slow.study.cycle.duration
    found = evaluate(task, drives).criteria["energy"] / task.cycle.duration
    # Windings of the parts are not quite as warm as alone.
    assert found == pytest.approx(power, rel=2e-2)
