"""Arms judged many at once: every kind of task as ``evaluate`` says, whatever arms lie beside and in what blocks."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from scipy.linalg import expm

from drivetrain.sizing.judge.check_numbers import NAMES
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.tolerance import scatter_kernels
from drivetrain.sizing.tolerance.lanes import WIDTH, put, row
from drivetrain.sizing.tolerance.many_arms import figures_of, judged
from drivetrain.sizing.tolerance.scatter import Draws, built, deviated, drawn, streamed
from drivetrain.sizing.tolerance.scatter_blocks import NO_HEAT, ONE_NODE, STEADY_HEAT, TWO_NODES
from drivetrain.sizing.tolerance.scatter_exponentials import exponential_shares, matrix_exponential
from drivetrain.sizing.tolerance.scatter_numbers import KIND, TEMPERATURE
from drivetrain.sizing.tolerance.scatter_task import aimed, bench
from drivetrain.sizing.tolerance.scatter_torque import cube_root
from drivetrain.study.tolerances import Tolerance, Tolerances

ALL = Tolerances(
    Tolerance(0.05), Tolerance(0.05), Tolerance(0.3), Tolerance(0.05), Tolerance(0.1, normal=True),
    Tolerance(0.1, normal=True, absolute=True), Tolerance(8.0, absolute=True),
)  # fmt: skip
# Blocks carry heat to about 1e-9 of the rise; near a runaway the answer magnifies that, and ``evaluate`` finds the
# magnets to 1e-6 K. Nearer to a limit than 1e-6 the driver lets ``evaluate`` decide.
HEAT = 1e-6


def _random_tasks():
    """The tasks of the compiled judge's tests."""
    name = "random_tasks"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name("random_tasks.py"))
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


TASKS = _random_tasks()


def case(make, kind, seed):
    """A random study of a kind, with a payload where there is an arm, and random drives."""
    study, rng = TASKS.random_study(make, seed, kind), np.random.default_rng(1000 + seed)
    if study.arm is not None:
        carried = np.where(np.arange(len(study.cycle.time)) % 17 < 9, 0, -1)
        cycle = replace(study.cycle, payload=carried, payload_names=("part",))
        study = replace(study, cycle=cycle, payloads=(make.payload(1.0),))
    motors, gears = list(study.catalog.motors), [*study.catalog.gears, ""]
    drives = {task.name: (motors[rng.integers(6)], gears[rng.integers(7)]) for task in study.joints}
    return replace(study, tolerances=ALL), drives


def compiled(ready, draws):
    """Figures of the compiled judge alone, nothing asked of ``evaluate``."""
    used = np.full((len(draws), len(ready.study.joints), len(NAMES)), np.nan)
    supply = np.full((len(draws), 3), np.nan)
    scatter_kernels.judge_arms(
        aimed(ready, draws), draws.factors, draws.ambient, draws.payload, ready.memory(), used, supply
    )
    return used, supply


@pytest.mark.parametrize("kind", TASKS.KINDS)
def test_every_kind_of_task_is_judged_as_evaluate_does(make, kind):
    heats, seen = set(), set()
    for seed in range(12):
        study, drives = case(make, kind, seed)
        ready, draws = bench(study, drives), drawn(study, 2, seed)
        assert not ready.slow
        used, supply = compiled(ready, draws)
        for sample in range(2):
            expected = figures_of(evaluate(built(study, drives, draws, sample)))
            np.testing.assert_allclose(used[sample], expected[0], rtol=HEAT, atol=1e-12)
            np.testing.assert_allclose(supply[sample], expected[1], rtol=HEAT, atol=1e-12)
            seen |= {NAMES[check] for check in np.flatnonzero(~np.isnan(expected[0]).all(axis=0))}
        heats |= set(ready.task.numbers[:, KIND].tolist())
    assert {"winding temperature", "motor voltage", "motor RMS current", "gear average torque"} <= seen
    assert heats == {NO_HEAT, STEADY_HEAT, ONE_NODE, TWO_NODES} or kind == "table"


@pytest.mark.parametrize(("kind", "seed"), [("table", 7), ("table", 11), ("mix", 2), ("mix", 3)])
def test_windings_that_run_away_do_so_in_the_same_arms(make, kind, seed):
    """Thermal resistances from a third to thrice their nominal value: some arms are cool, some have no steady state."""
    study, drives = case(make, kind, seed)
    factors = np.tile(drawn(study, 1, 0).factors, (24, 1, 1))
    factors[:, :, 4] = np.geomspace(0.3, 3.0, 24)[:, np.newaxis]
    draws = Draws(factors, np.full(24, 25.0), np.ones((24, len(study.payloads))))
    used, _ = compiled(bench(study, drives), draws)
    expected = [figures_of(evaluate(built(study, drives, draws, sample)))[0] for sample in range(24)]
    found, told = used[:, :, TEMPERATURE], np.array(expected)[:, :, TEMPERATURE]
    np.testing.assert_array_equal(np.isinf(found), np.isinf(told))
    assert np.isinf(told).any() and np.isfinite(told).any()
    near = told < 3.0  # beyond, the rise grows so steeply that both answers are rounding
    np.testing.assert_allclose(found[near], told[near], rtol=HEAT)


def test_no_number_depends_on_blocks_or_threads(make, monkeypatch):
    study, drives = case(make, "mix", 3)
    ready, draws = bench(study, drives), drawn(study, 3 * WIDTH + 5, 2)
    plain = next(iter(judged(ready, draws)))
    monkeypatch.setattr("drivetrain.sizing.tolerance.many_arms.CHUNK", 7)
    for threads in (1, 3):
        parts = list(judged(ready, draws, threads=threads))
        assert len(parts) == 8
        np.testing.assert_array_equal(np.concatenate([part.joints for part in parts]), plain.joints)
        np.testing.assert_array_equal(np.concatenate([part.supply for part in parts]), plain.supply)


def test_arms_come_in_the_same_stream_however_many_at_once(make):
    study, _ = case(make, "arm", 1)
    whole, parts = drawn(study, 100, 9), list(streamed(study, 100, 9, most=33))
    for name in ("factors", "ambient", "payload"):
        np.testing.assert_array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
    assert deviated(study, 2, {}).ambient.tolist() == [study.ambient] * 2


# ------------------------------------------------------------ numbers of many arms at once


@njit
def _roots(x, out):
    for i in range(len(x)):
        put(out, i, cube_root(row(x, i)))


@njit
def _maps(matrix, sources, out):
    found = matrix_exponential(
        row(matrix, 0), row(matrix, 1), row(matrix, 2), row(matrix, 3), row(sources, 0), row(sources, 1),
        row(sources, 2), row(sources, 3),
    )  # fmt: skip
    for i, value in enumerate(found):
        put(out, i, value)


@njit
def _shares(x, out):
    first, second = exponential_shares(row(x, 0))
    put(out, 0, first)
    put(out, 1, second)


def test_cube_roots():
    x = np.exp(np.random.default_rng(1).uniform(-300.0, 300.0, (50, WIDTH)))
    x[0, 0] = 0.0
    out = np.empty_like(x)
    _roots(x, out)
    np.testing.assert_allclose(out, np.cbrt(x), rtol=1e-15)


def test_matrix_exponentials_from_tiny_to_long():
    rng = np.random.default_rng(2)
    size = np.geomspace(1e-8, 30.0, WIDTH)
    a, b, c, d = (rng.uniform(0.1, 1.0, WIDTH) * size for _ in range(4))
    matrix, sources = np.array([-a, b, c, -d]), rng.uniform(-1.0, 1.0, (4, WIDTH))
    out = np.empty((8, WIDTH))
    _maps(matrix, sources, out)
    for lane in range(WIDTH):
        whole = np.zeros((4, 4))
        whole[:2, :2], whole[:2, 2:] = matrix[:, lane].reshape(2, 2), sources[:, lane].reshape(2, 2).T
        told = expm(whole)
        expected = [*told[:2, :2].ravel(), *told[:2, 2], *told[:2, 3]]
        np.testing.assert_allclose(out[:, lane], expected, rtol=1e-11, atol=1e-13)


def test_shares_of_exponentials():
    x = np.array([np.concatenate([-np.geomspace(1e-9, 40.0, WIDTH // 2), np.geomspace(1e-9, 3.0, WIDTH // 2)])])
    out = np.empty((2, WIDTH))
    _shares(x, out)
    first = np.where(np.abs(x[0]) < 1e-5, 1.0 + x[0] / 2.0, np.expm1(x[0]) / x[0])
    np.testing.assert_allclose(out[0], first, rtol=1e-10)
    # The second from the series where the difference has no digits.
    small = np.abs(x[0]) < 1e-2
    second = np.where(small, 0.5 + x[0] / 6.0 + x[0] ** 2 / 24.0 + x[0] ** 3 / 120.0, (first - 1.0) / x[0])
    np.testing.assert_allclose(out[1], second, rtol=1e-9)
