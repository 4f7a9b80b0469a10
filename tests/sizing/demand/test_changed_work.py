"""The work of a changed task in closed form against the arm run again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.demand.demand import workload
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


@pytest.fixture(scope="module")
def ur5():
    return load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")


def agree(family, change):
    fast, slow = family.at(change), workload(changed(family.study, change))
    np.testing.assert_array_equal(fast.weights, slow.weights)
    for one, other in zip(fast.basis, slow.basis, strict=True):
        assert one.drives == other.drives and one.slides == other.slides
        pairs = [(getattr(one, name), getattr(other, name)) for name in ("torque", "wrench", "inertia")]
        names = ("torque", "wrench", "inertia", "carrier_acceleration")
        pairs += [(getattr(one.bare, name), getattr(other.bare, name)) for name in names]
        for left, right in pairs:
            # Differences of sums of some hundred terms of the size of the largest.
            scale = max(1.0, float(np.abs(right).max(initial=0.0)))
            np.testing.assert_allclose(left, right, rtol=0.0, atol=1e-11 * scale)


@pytest.mark.parametrize(
    "change",
    [
        TaskChange(),
        TaskChange(payload=0.3),
        TaskChange(payload=0.0, time=1.8),
        TaskChange(payload=2.5, time=0.7, voltage=1.3, ambient=12.0),
    ],
)
def test_every_change_is_the_arm_run_again(ur5, change):
    agree(WorkFamily(ur5), change)


def test_one_payload_alone(ur5):
    names = (ur5.payloads[1].name,)
    agree(WorkFamily(ur5, names), TaskChange(payload=1.6, time=1.2, payloads=names))


def test_gravity_stays_when_the_motion_slows(make):
    study = make.study(make.sines(2, samples=41), arm=make.planar_arm([0.4, 0.3], [1.0, 0.7]))
    slow = WorkFamily(study).at(TaskChange(time=1e6)).basis[0].bare.torque
    held = workload(replace(study, cycle=replace(
        study.cycle, velocity=0.0 * study.cycle.velocity, acceleration=0.0 * study.cycle.acceleration
    ))).basis[0].bare.torque  # fmt: skip
    np.testing.assert_allclose(slow, held, atol=1e-9)
    assert np.abs(held).max() > 1.0


def test_a_load_table_keeps_its_torques(make):
    time = np.linspace(0.0, 1.0, 11)
    study = make.study(make.table_cycle(time, 5.0 + time, np.sin(time), np.cos(time)))
    work = WorkFamily(study).at(TaskChange(time=2.0))
    demand = work.at(0, {}).demand(None)
    np.testing.assert_array_equal(demand.gear_torque, 5.0 + time)
    np.testing.assert_allclose(demand.speed, 0.5 * np.sin(time))
