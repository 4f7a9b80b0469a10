"""A study of an arm with closed loops: loads as of the arm with its drives, the search against brute force, faults."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import yaml

from drivetrain.dynamics.inverse import joint_loads
from drivetrain.errors import InputError
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.search.search import select
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.read import load_study

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "palletiser"


def document(**changes):
    data = yaml.safe_load((EXAMPLE / "study.yaml").read_text(encoding="utf-8"))
    data["arm"] = str(EXAMPLE / data["arm"])
    return data | changes


@pytest.fixture(scope="module")
def study():
    return load_study(document())


def test_loads_are_those_of_the_loaded_arm(study):
    """The sum over the drives' numbers, against the arm with their masses and rotors at once."""
    keys = dict(zip(study.arm.joint_names, [("servo_5", "cycloid_2500"), ("servo_2", "cycloid_1200")] * 2, strict=True))
    parts = FilledParts(study)
    drives = {task.name: parts.drive(task, *keys[task.name]) for task in study.joints}
    by_index = dict(enumerate(drives.values()))
    cycle = study.cycle
    for payload in np.unique(cycle.payload):
        at = np.flatnonzero(cycle.payload == payload)[::200]
        arm = loaded_arm(study, drives, int(payload))
        loads = joint_loads(arm, cycle.position[at], cycle.velocity[at], cycle.acceleration[at])
        for joint, drive in by_index.items():
            demand = workload(study).at(joint, by_index).demand(drive)
            size = np.abs(loads.gear).max()
            np.testing.assert_allclose(demand.gear_torque[at], loads.gear[:, joint], rtol=1e-9, atol=1e-9 * size)
            np.testing.assert_allclose(demand.carrier_acceleration[at], loads.carrier_acceleration[:, joint], atol=1e-9)


def test_search_is_brute_force():
    """Every set of the four joints, judged one by one, of two pairs each."""
    data = document()
    data["joints"]["default"]["candidates"]["motors"]["keys"] = ["servo_5"]
    data["joints"]["default"]["candidates"]["gears"]["keys"] = ["cycloid_1200", "cycloid_2500"]
    small = load_study(data)
    sets = itertools.product(*(task.pairs for task in small.joints))
    found = [evaluate(small, dict(zip(small.arm.joint_names, one, strict=True))) for one in sets]
    fitting = [one.objective for one in found if one.feasible]
    assert 0 < len(fitting) < len(found)
    assert select(small).objective == pytest.approx(min(fitting), rel=1e-12)


def test_what_a_study_with_closures_must_state():
    """Every fault at once, with its place."""
    data = document(stop={}, passive=["elbow", "wrist_pich"])
    with pytest.raises(InputError, match="wrist_pitch"):
        load_study(data)
    joints = {"default": {**document()["joints"]["default"], "output_bearing": "gear"}}
    with pytest.raises(InputError) as error:
        load_study(document(stop={}, joints=joints))
    told = str(error.value)
    assert "along a ramp" in told and "must be external" in told
    with pytest.raises(InputError, match="coupling"):
        load_study(document(coupling=[{"joints": ["turn", "lower"], "type": "differential"}]))
    with pytest.raises(InputError, match="closures"):
        load_study(document(stiffness={"first_resonance": "5 Hz"}))
