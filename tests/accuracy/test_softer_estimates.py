"""Estimates of soft springs, play and bristles against what leaving them out really changes, on random scenes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from test_effect_estimates import STEP, UNSAFE, measured, pair, single

from drivetrain.accuracy.costs import ran
from drivetrain.accuracy.decision import basis_of
from drivetrain.accuracy.estimates import estimates, task_of
from drivetrain.accuracy.scenes import without
from drivetrain.drive.gear import Gear
from drivetrain.effects.bounds import LARGEST_ANSWER
from drivetrain.effects.control.position_loop import PositionLoop
from drivetrain.effects.effect import Effect
from drivetrain.effects.estimate import Conditions, TaskSeries
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.gear import twisting
from drivetrain.effects.gear.backlash import Backlash
from drivetrain.effects.gear.flexible_joint import FlexibleJoint
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import WHOLE, Inertia, Scene

Rng = np.random.Generator
KINDS = ("FlexibleJoint", "Backlash", "LuGreFriction")


def changed(scene: Scene, change: Callable[[Effect, tuple[Effect, ...]], Effect]) -> Scene:
    """Each effect of a joint replaced by what a function makes of it beside the others."""
    effects = {
        name: own if name == WHOLE else tuple(change(effect, own) for effect in own)
        for name, own in scene.effects.items()
    }
    return replace(scene, effects=effects)


def soft(scene: Scene, rng: Rng) -> Scene:
    """Springs of 0.3 to 1.9 times the loop, where the motor does not hold still."""

    def change(effect: Effect, own: tuple[Effect, ...]) -> Effect:
        if not isinstance(effect, FlexibleJoint):
            return effect
        loop = next(one for one in own if isinstance(one, PositionLoop))
        stiffness = loop.stiffness * rng.uniform(0.3, 1.9)
        load = scene.body.inertia if isinstance(scene.body, Inertia) else loop.stiffness / 1600.0
        return FlexibleJoint(
            replace(effect.gear, stiffness_1=stiffness), rng.uniform(0.04, 0.2) * math.sqrt(stiffness * load)
        )

    return changed(scene, change)


def played(scene: Scene, rng: Rng) -> Scene:
    """0.1 to 1 mrad of play; single joints under a weight that mostly keeps them on one flank."""

    def change(effect: Effect, own: tuple[Effect, ...]) -> Effect:
        if not isinstance(effect, FlexibleJoint):
            return effect
        return Backlash(replace(effect.gear, backlash=10 ** rng.uniform(-4.0, -3.0)), effect.damping)

    body = scene.body
    heavy = replace(body, weight=60.0 * body.inertia) if isinstance(body, Inertia) else body
    return replace(changed(scene, change), body=heavy)


def bristled(scene: Scene, rng: Rng) -> Scene:
    """Bristles in the place of dry friction, bent by 1e-3 to 0.1 rad at the motor before they slip."""

    def change(effect: Effect, own: tuple[Effect, ...]) -> Effect:
        if not isinstance(effect, DryFriction):
            return effect
        low = effect.friction.coulomb
        stiff = low / 10 ** rng.uniform(-3.0, -1.0)
        return LuGreFriction(
            stiff, low, low * rng.uniform(1.0, 1.6), 10 ** rng.uniform(-1.0, 1.0), damping=1e-3 * stiff * rng.random(),
            viscous=low * 1e-3 * rng.random(), side="motor",
        )  # fmt: skip

    return changed(scene, change)


CASES = [
    *((soft, single, seed) for seed in (811, 812, 813)), (soft, pair, 821),
    *((played, single, seed) for seed in (831, 832, 833)), (played, pair, 841),
    *((bristled, single, seed) for seed in (851, 852)), (bristled, pair, 861),
]  # fmt: skip


@pytest.mark.parametrize(("make", "kind", "seed"), CASES)
def test_no_valid_estimate_is_on_the_unsafe_side(
    make: Callable[[Scene, Rng], Scene], kind: Callable[[int], Scene], seed: int
) -> None:
    scene = make(kind(seed), np.random.default_rng(seed))
    rows = measured(scene, KINDS)
    assert rows
    assert not [row for row in rows if row[1] and row[3] > UNSAFE]


def ways_apart(scene: Scene, kind: str) -> tuple[float, float, float]:
    """Estimate over measurement of max |dI| and of max |dq| at the joint, and whether the estimate is valid."""
    basis = basis_of(scene)
    (told,) = [one for one in estimates(scene, task_of(scene, basis)) if one.choice.kind == kind]
    full, less = (ran(plan(without(scene, gone)), STEP) for gone in ((), [told.choice]))
    peak = task_of(scene, basis).conditions["joint"].peak_current
    current = np.abs(full["joint.current"] - less["joint.current"]).max() / peak
    place = np.abs(full["joint.position"] - less["joint.position"]).max()
    return told.changes["joint"].peak_current / current, told.changes["joint"].tip / place, told.valid


@pytest.mark.parametrize("seed", [871, 872, 873, 874])
def test_soft_springs_are_told_within_t44s_range(seed: int) -> None:
    current, place, valid = ways_apart(soft(single(seed), np.random.default_rng(seed)), "FlexibleJoint")
    assert valid
    assert 0.8 < place < 3.0
    assert 0.8 < current < 3.0


@pytest.mark.parametrize("seed", [881, 882, 883, 884, 885, 886])
def test_play_is_told_within_t44s_range_where_one_flank_carries(seed: int) -> None:
    current, place, valid = ways_apart(played(single(seed), np.random.default_rng(seed)), "Backlash")
    if valid:
        assert 0.8 < place < 3.0
        assert current > 0.8


@pytest.mark.parametrize("seed", [891, 892, 893, 894])
def test_bristles_are_told_within_t44s_range(seed: int) -> None:
    current, place, valid = ways_apart(bristled(single(seed), np.random.default_rng(seed)), "LuGreFriction")
    assert valid
    assert 0.8 < place < 3.0
    assert 0.8 < current < 3.0


def test_both_answers_of_play_occur() -> None:
    told = []
    for seed in range(831, 837):
        scene = played(single(seed), np.random.default_rng(seed))
        task = task_of(scene, basis_of(scene))
        (one,) = [one for one in estimates(scene, task) if one.choice.kind == "Backlash"]
        torque = task.conditions["joint"].series.torque
        assert not one.valid or (np.sign(torque) == np.sign(torque[0])).all()
        told.append(one.valid)
    assert any(told) and not all(told)


def task(time: np.ndarray, torque: np.ndarray) -> Conditions:
    still = np.zeros(len(time))
    told = TaskSeries(time, still, still, torque, torque, still.astype(bool))
    return Conditions(
        1.0, 1.0, 1.0, 1.0, 1.0, 1.0, inertia=0.8, rotor_inertia=0.3, series=told, loop_stiffness=900.0,
        loop_damping=60.0,
    )  # fmt: skip


def test_motor_loop_and_load_are_the_linear_system_that_is_written() -> None:
    rng = np.random.default_rng(0)
    time, torque = np.linspace(0.0, 1.0, 51), np.cumsum(rng.normal(size=51))
    conditions, gear, damping = task(time, torque), Gear("g", 100.0, stiffness_1=700.0), 4.0

    def rates(t: float, y: np.ndarray) -> list[float]:
        now = float(np.interp(t, time, torque))
        spring = 700.0 * (y[0] - y[2]) + damping * (y[1] - y[3])
        return [y[1], (now - 900.0 * y[0] - 60.0 * y[1] - spring) / 0.3, y[3], (spring - now) / 0.8]

    start = [0.0, 0.0, -torque[0] / 700.0, 0.0]
    exact = solve_ivp(rates, (0.0, 1.0), start, rtol=1e-9, atol=1e-12, max_step=1e-3)
    wanted = np.abs(exact.y[2]).max(), np.abs(900.0 * exact.y[0] + 60.0 * exact.y[1]).max()
    found = twisting._together(gear, damping, conditions, conditions.series)  # type: ignore[arg-type]
    # The largest value is looked for at parts of an interval.
    assert (found[0].max(), found[1].max()) == pytest.approx(wanted, rel=0.02)
    matrix = rng.normal(size=(6, 6)) * 3.0
    np.testing.assert_allclose(twisting._exponential(matrix), expm(matrix), rtol=1e-10, atol=1e-10)


def test_a_bounded_torque_is_answered_by_no_more_than_the_area_says() -> None:
    t = np.linspace(0.0, 40.0, 2_000_001)
    area = np.trapezoid(np.abs(2.0 - t) * np.exp(-t), t)
    assert pytest.approx(area, rel=1e-6) == LARGEST_ANSWER
