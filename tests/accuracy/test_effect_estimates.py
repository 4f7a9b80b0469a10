"""Estimates held against what leaving an effect out really changes, on random joints and arms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from random_scenes import estimated_and_measured, pair, ratio, single

from drivetrain.accuracy.auto import estimates
from drivetrain.accuracy.decision import basis_of
from drivetrain.accuracy.scenes import choices
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.simulation.scene import WHOLE, Scene

CASES = [*((single, seed) for seed in range(101, 109)), *((pair, seed) for seed in range(201, 205))]


@pytest.mark.parametrize(("kind", "seed"), CASES)
def test_no_estimate_is_a_fifth_too_small_or_ten_times_too_large(kind: Callable[[int], Scene], seed: int) -> None:
    """``python benchmarks/estimates.py`` does so on a hundred, and on the shipped studies."""
    scene = kind(seed)
    rows = estimated_and_measured(scene, basis_of(scene))
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
