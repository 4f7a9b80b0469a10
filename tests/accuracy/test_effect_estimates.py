"""Estimates held against what leaving an effect out really changes, on random joints and arms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from random_scenes import estimated_and_measured, pair, ratio, single

from drivetrain.accuracy.auto import _unresolved_peaks, estimates
from drivetrain.accuracy.costs import run_to_end
from drivetrain.accuracy.decision import basis_of
from drivetrain.accuracy.scenes import choices, without
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.recording import Recording, Series
from drivetrain.simulation.scene import WHOLE, Scene

CASES = [*((single, seed) for seed in range(101, 109)), *((pair, seed) for seed in range(201, 205))]


@pytest.mark.parametrize(("kind", "seed"), CASES)
def test_no_estimate_is_a_fifth_too_small_or_ten_times_too_large(kind: Callable[[int], Scene], seed: int) -> None:
    """``python benchmarks/estimates.py`` does so on a hundred, and on the shipped studies."""
    scene = kind(seed)
    rows = estimated_and_measured(scene, basis_of(scene), step=2e-4)
    assert all(told.valid for told, *_ in rows) and len({told.choice for told, *_ in rows}) > 5
    assert not [row for row in rows if not 0.8 <= ratio(row) <= 10.0]
    assert max(row[4] for row in rows) > 0.01  # some of them matter


def test_what_touches_the_arm_is_estimated_too() -> None:
    scene = pair(201)
    wall = TipContact(np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]), 1e4)
    touching = replace(scene, effects=scene.effects | {WHOLE: (*scene.effects[WHOLE], wall)})
    told = estimates(touching, basis_of(touching))
    assert len(told) == len(choices(touching)) > 3
    assert all(one.valid and one.changes for one in told)


def test_what_a_step_does_not_resolve_of_a_peak() -> None:
    """A ramp that friction ends: its rise within a step. A smooth peak, a jump: next to nothing."""
    scene = single(101)
    basis, time = basis_of(scene), np.linspace(0.0, 1.0, 101)

    def unresolved(current: np.ndarray) -> float:
        series = {"joint.current": Series("A", current)}
        return _unresolved_peaks(Recording(time, series), scene, basis)["joint"]

    ramp = np.where(time < 0.7, 2.0 * time, np.maximum(1.4 - 20.0 * (time - 0.7), 0.0))
    assert unresolved(ramp) == pytest.approx(0.02 / 1.4)
    for sure in (np.sin(np.pi * time), np.where(time < 0.5, 0.0, 1.0), np.where(time < 0.5, 1.0, 0.0)):
        assert unresolved(sure) == 0.0
    assert unresolved(np.zeros(101)) == 0.0


def test_decisions_of_fixed_steps_see_every_node() -> None:
    scene = single(101)
    assert len(run_to_end(plan(without(scene, ())), FixedStep(1e-4)).time) > 0.99 * scene.duration / 1e-4
    assert scene.duration / 1e-4 > 20_000
