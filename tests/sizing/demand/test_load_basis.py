"""The one pass that makes the rows of a reduction, against the recursion of the arm with its drives mounted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_tasks import random_study

from drivetrain.drive.drive import drive_inertia
from drivetrain.dynamics.core.blocks import BLOCK
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.sizing.demand.demand import Workload, workload
from drivetrain.sizing.demand.load_basis import load_basis, load_parameters
from drivetrain.sizing.judge.vary import named_drives
from drivetrain.study.parts.mounting import loaded_arm, rotor_ratio
from drivetrain.study.read import load_study

UR5 = Path(__file__).parents[3] / "examples" / "ur5_pick_and_place" / "study.yaml"
CLOSE = 1e-11  # of the largest: both sum some hundred numbers


def turned(study):
    """The same with axes along x, y and z in turn, so that nothing lies in one plane, and a joint that is a screw."""
    screws = np.array(study.arm.screws)
    screws[0] = [0.0, 0.0, 1.0, 0.0, 0.0, 0.02]
    screws[-1] = [1.0, 0.0, 0.0, 0.0, 0.0, -study.arm.joint_points[-1][1]]
    return replace(study, arm=replace(study.arm, screws=screws))


@pytest.mark.parametrize("kind", ["arm", "sliding", "coupled"])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("change", [lambda study: study, turned])
def test_rows_and_numbers_are_the_loads_of_the_arm_with_its_drives(make, seed, kind, change):
    study = change(random_study(make, seed, kind))
    cycle = make.sines(3, samples=2 * BLOCK + 17, duration=3.0, size=0.9)  # the last block is not full
    joints = tuple(replace(task, counterbalances=()) for task in study.joints)
    study = replace(study, cycle=cycle, joints=joints)
    known = [key for key, row in study.catalog.motors.items() if row.rotor_inertia and row.mass]
    gears = [key for key, row in study.catalog.gears.items() if row.inertia and row.mass]
    keys = {task.name: (known[i % len(known)], gears[i % len(gears)]) for i, task in enumerate(study.joints)}
    drives = named_drives(study, keys)
    arm = loaded_arm(study, {task.name: drives[i] for i, task in enumerate(study.joints)}, -1)
    wanted = joint_loads(arm, cycle.position, cycle.velocity, cycle.acceleration)
    matrix, work = mass_matrix(arm, cycle.position), Workload(study, load_basis(study), cycle.weights)
    for joint, task in enumerate(study.joints):
        found, travel = work.at(joint, drives).demand(drives[joint]), task.travel_per_turn or 1.0
        near(found.gear_torque, wanted.gear[:, joint] * travel)
        if found.wrench is not None:
            near(found.wrench, wanted.wrench[:, joint])
            basis, some = work.basis[joint], np.arange(1, len(cycle.time), 7)
            units = work.unit_wrenches(joint, basis.drives, some)
            amounts = [load_parameters(study, k, drives[k]) for k in basis.drives]
            by_drives = np.tensordot(np.concatenate([np.zeros(0), *amounts]), units, 1)
            near((basis.bare.wrench[:, some] + by_drives).T, wanted.wrench[some, joint])
        if task.mount.carrier == "parent" and not task.coupled and kind != "coupled":
            own = drive_inertia(drives[joint]) * rotor_ratio(drives[joint], task) ** 2
            near(found.load_inertia, (matrix[:, joint, joint] - own) * travel**2, scale=matrix.max())


def test_memory_of_the_basis():
    """For every sample of six joints, of which 19 pairs load each other: 95 torques, as many inertias, and the load
    without drives; no wrenches per unit.
    """
    basis = workload(load_study(UR5)).basis
    arrays = [one for joint in basis for part in (joint, joint.bare) for one in vars(part).values()]
    owners = {id(one): one for one in (_owner(array) for array in arrays if isinstance(array, np.ndarray))}
    assert sum(one.nbytes for one in owners.values()) <= 2000 * len(basis[0].torque[0])


def _owner(array):
    """The array whose memory a view refers to."""
    return array if array.base is None else _owner(array.base)


def near(found, wanted, scale=0.0):
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=CLOSE * max(float(np.abs(wanted).max()), scale, 0.01))
