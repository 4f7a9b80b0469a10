"""A changed task: what changes, how, and what stays."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.study.change import TaskChange, changed, slowed
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


@pytest.fixture(scope="module")
def study():
    return load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")


def test_no_change_is_none(study):
    same = changed(study, TaskChange())
    assert same.cycle is study.cycle
    assert same.supply == study.supply and same.ambient == study.ambient
    assert [one.mass for one in same.payloads] == [one.mass for one in study.payloads]


def test_slowed_motion_is_the_derivative_of_its_own_positions(study):
    cycle = slowed(study.cycle, 1.7)
    assert cycle.duration == pytest.approx(1.7 * study.cycle.duration, rel=1e-14)
    steps = np.diff(cycle.time)
    smooth = steps > 0.0
    # The trapezoid of the slower speed is the same path: error as large as that of the motion as it was.
    travelled = 0.5 * (cycle.velocity[1:] + cycle.velocity[:-1]) * steps[:, np.newaxis]
    before = 0.5 * (study.cycle.velocity[1:] + study.cycle.velocity[:-1]) * np.diff(study.cycle.time)[:, np.newaxis]
    np.testing.assert_allclose(travelled, before, atol=1e-15)
    gained = 0.5 * (cycle.acceleration[1:] + cycle.acceleration[:-1]) * steps[:, np.newaxis]
    change = np.diff(cycle.velocity, axis=0)
    # Trapezoids of samples some milliseconds apart.
    assert np.abs(gained - change)[smooth].max() < 1e-2 * np.abs(cycle.velocity).max()
    assert np.array_equal(cycle.position, study.cycle.position)


def test_weights_of_a_slowed_cycle_are_longer(study):
    np.testing.assert_allclose(slowed(study.cycle, 2.5).weights, 2.5 * study.cycle.weights, rtol=1e-12)


def test_one_payload_of_several(study):
    names = [one.name for one in study.payloads]
    assert len(names) == 2
    some = changed(study, TaskChange(payload=0.5, payloads=(names[1],)))
    assert some.payloads[0] is study.payloads[0]
    assert some.payloads[1].mass == 0.5 * study.payloads[1].mass
    np.testing.assert_array_equal(some.payloads[1].inertia, 0.5 * study.payloads[1].inertia)
    np.testing.assert_array_equal(some.payloads[1].com, study.payloads[1].com)


def test_every_fault_at_once():
    with pytest.raises(InputError) as error:
        TaskChange(payload=-1.0, time=0.0, voltage=float("nan"))
    assert len(error.value.faults) == 3


def test_unknown_payload_is_told_with_its_neighbour(study):
    with pytest.raises(InputError, match="gripper"):
        changed(study, TaskChange(payload=0.5, payloads=("griper",)))
