"""Drawn samples judged many at once: every kind of task as ``evaluate`` says, in whatever blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import random_tasks as TASKS
from built_sample import built

from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.tolerance import sampling
from drivetrain.sizing.tolerance.draws import Draws, deviated, drawn, streamed
from drivetrain.sizing.tolerance.monte_carlo import robustness
from drivetrain.sizing.tolerance.sampling import (
    ARM_NAMES,
    NAMES,
    SUPPLY_NAMES,
    candidate,
    figures_of,
    judged,
    nominal_of,
)
from drivetrain.study.parts.tolerances import Tolerance, Tolerances

ALL = Tolerances(
    Tolerance(0.05), Tolerance(0.05), Tolerance(0.3), Tolerance(0.05), Tolerance(0.1, normal=True),
    Tolerance(0.1, normal=True, absolute=True), Tolerance(8.0, absolute=True), Tolerance(0.4),
    Tolerance(0.5),
)  # fmt: skip


def case(make, kind, seed):
    """A random study of a kind, with a payload and forces at the tip where there is an arm, and random drives."""
    study, rng = TASKS.random_study(make, seed, kind), np.random.default_rng(1000 + seed)
    if study.arm is not None:
        carried = np.where(np.arange(len(study.cycle.time)) % 17 < 9, 0, -1)
        wrench = 5.0 * np.random.default_rng(seed).normal(size=(3, 6))[np.arange(len(carried)) % 3]
        cycle = replace(study.cycle, payload=carried, payload_names=("part",), tip_wrench=wrench)
        study = replace(study, cycle=cycle, payloads=(make.payload(1.0),))
    motors, gears, drives = list(study.catalog.motors), [*study.catalog.gears, ""], {}
    for task in study.joints:
        plain = motors[rng.integers(6)], gears[rng.integers(7)]
        drives[task.name] = task.pairs[rng.integers(len(task.pairs))] if task.brakes else plain
    return replace(study, tolerances=ALL), drives


def figures(study, drives, draws):
    parts = list(judged(candidate(nominal_of(study), drives), draws))
    return np.concatenate([part.joints for part in parts]), np.concatenate([part.supply for part in parts])


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_every_kind_of_task_is_judged_as_evaluate_does(make, kind):
    """The same judge on the same numbers, whether they come as a study of their own or as records: to rounding."""
    seen = set()
    for seed in range(4):
        study, drives = case(make, kind, seed)
        draws = drawn(study, 2, seed)
        used, supply = figures(study, drives, draws)
        for sample in range(2):
            expected = figures_of(evaluate(built(study, drives, draws, sample)))
            np.testing.assert_allclose(used[sample], expected[0], rtol=1e-11, atol=1e-12)
            np.testing.assert_allclose(supply[sample], expected[1], rtol=1e-11, atol=1e-12)
            seen |= {NAMES[check] for check in np.flatnonzero(~np.isnan(expected[0]).all(axis=0))}
    assert {"winding temperature", "motor voltage", "motor RMS current", "gear average torque"} <= seen


@pytest.mark.parametrize(("kind", "seed"), [("table", 1), ("table", 2), ("mix", 3), ("mix", 5)])
def test_windings_that_run_away_do_so_in_the_same_samples(make, kind, seed):
    """Thermal resistances from a third to thrice their nominal value: some samples have no steady state."""
    study, drives = case(make, kind, seed)
    study = replace(study, cycle=replace(study.cycle, tip_wrench=None))
    factors = np.tile(drawn(study, 1, 0).factors, (12, 1, 1))
    factors[:, :, 4] = np.geomspace(0.3, 3.0, 12)[:, np.newaxis]
    draws = Draws(factors, np.full(12, 25.0), np.ones((12, len(study.payloads) + 1)))
    used, _ = figures(study, drives, draws)
    expected = [figures_of(evaluate(built(study, drives, draws, sample)))[0] for sample in range(12)]
    found, told = (one[:, :, NAMES.index("winding temperature")] for one in (used, np.array(expected)))
    np.testing.assert_array_equal(np.isinf(found), np.isinf(told))
    assert np.isinf(told).any() and np.isfinite(told).any()
    near = told < 3.0  # beyond, the rise grows so steeply that both answers are rounding
    np.testing.assert_allclose(found[near], told[near], rtol=1e-9)


def test_no_number_depends_on_blocks_or_threads(make, monkeypatch):
    study, drives = case(make, "mix", 3)
    ready, draws = candidate(nominal_of(study), drives), drawn(study, 53, 2)
    (plain,) = judged(ready, draws)
    monkeypatch.setattr(sampling, "BLOCK", 7)
    for threads in (1, 3):
        parts = list(judged(ready, draws, threads=threads))
        assert len(parts) == 8
        np.testing.assert_array_equal(np.concatenate([part.joints for part in parts]), plain.joints)
        np.testing.assert_array_equal(np.concatenate([part.supply for part in parts]), plain.supply)


def test_samples_come_in_the_same_stream_however_many_at_once(make):
    study, _ = case(make, "arm", 1)
    whole, parts = drawn(study, 100, 9), list(streamed(study, 100, 9, most=33))
    for name in ("factors", "ambient", "loads"):
        np.testing.assert_array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
    assert deviated(study, 2, {}).ambient.tolist() == [study.ambient] * 2


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_probabilities_are_the_shares_of_the_samples(make, kind):
    """Of every check, joint, the supply and the arm, counted once more from the same samples."""
    study, drives = case(make, kind, 3)
    found = robustness(evaluate(study, drives), samples=40, seed=5)
    (part,) = judged(candidate(nominal_of(study), drives), drawn(study, 40, 5))
    tables = [(task.name, part.joints[:, i], NAMES) for i, task in enumerate(study.joints)]
    tables += [("supply", part.supply, SUPPLY_NAMES), ("arm", part.arm, ARM_NAMES)]
    for (place, used, names), failed in zip(tables, part.failed.T, strict=True):
        made = np.flatnonzero(~np.isnan(used).all(axis=0)).tolist()
        if not made:
            assert place not in found.checks
            continue
        shares = {names[k]: sum(used[:, k] <= 1.0) / 40 for k in made}
        assert {name: one.probability for name, one in found.checks[place].items()} == pytest.approx(shares)
        assert found.joints[place].probability == pytest.approx(1.0 - failed.mean())
        assert found.utilisations[place].keys() == shares.keys()
        for k in made:  # the 2nd, 20th and 38th of 40 in order
            assert found.utilisations[place][names[k]] == tuple(np.sort(used[:, k])[[1, 19, 37]].tolist())
    assert found.whole.probability == pytest.approx(part.feasible.mean())
