"""Properties of any motion: mirroring changes no verdict, losses only cost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetrain.drive.friction import Friction
from drivetrain.sizing.judge.evaluate import evaluate

TORQUES = st.lists(st.floats(-60, 60), min_size=6, max_size=6)
SPEEDS = st.lists(st.floats(-20, 20), min_size=6, max_size=6)
ACCELERATIONS = st.lists(st.floats(-100, 100), min_size=6, max_size=6)


def table(make, torque, speed, acceleration):
    return make.table_cycle(np.linspace(0.0, 1.5, 6), torque, speed, acceleration)


def numbers(evaluation):
    checks = [*evaluation.joints["j1"].checks, *evaluation.shared]
    return {c.name: (c.required, c.available, c.utilisation, c.verdict, c.time) for c in checks}


@settings(max_examples=60, deadline=None)
@given(TORQUES, SPEEDS, ACCELERATIONS)
def test_mirrored_motion_has_the_same_verdicts(make, torque, speed, acceleration):
    friction = make.task(friction=Friction(coulomb=0.5, viscous=0.02, static=0.8))
    there = make.study(table(make, torque, speed, acceleration), joints=(friction,))
    back = make.study(table(make, *(-np.array(x) for x in (torque, speed, acceleration))), joints=(friction,))
    assert numbers(evaluate(there)) == numbers(evaluate(back))


@settings(max_examples=40, deadline=None)
@given(TORQUES, SPEEDS, ACCELERATIONS)
def test_gear_turning_the_other_way_has_the_same_verdicts(make, torque, speed, acceleration):
    study = make.study(table(make, torque, speed, acceleration))
    wheel = replace(make.gear, ratio=-make.gear.ratio)
    turned = replace(study, catalog=replace(study.catalog, gears={"g1": wheel}))
    assert numbers(evaluate(study)) == numbers(evaluate(turned))


@settings(max_examples=60, deadline=None)
@given(TORQUES, SPEEDS, ACCELERATIONS)
def test_electrical_power_covers_output_and_losses(make, torque, speed, acceleration):
    """At every sample that moves, in every quadrant: what is drawn is at least what comes out and what is stored."""
    series = evaluate(make.study(table(make, torque, speed, acceleration))).joints["j1"].series
    moving = np.abs(series.speed) > 1e-9 * np.abs(series.speed).max()
    useful = series.gear_torque * series.speed + series.rotor_torque * series.motor_speed
    size = np.abs(series.electrical_power).max() + np.abs(useful).max() + 1.0
    assert np.all((series.electrical_power - useful)[moving] >= -1e-9 * size)
