"""Doubts about inertias: the UR5's faulty wrists are found, honest links of every shape are not."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.checks import implausible, mean_density
from drivetrain.arm.files.load import load_arm
from drivetrain.errors import PhysicsWarning
from drivetrain.spatial.inertia import RigidBody, cuboid, cylinder, ellipsoid
from drivetrain.spatial.poses import pose

ORIGIN = np.zeros(3)


def test_the_faulty_wrist_and_its_mended_self() -> None:
    joints = [ORIGIN, np.array([0.0, 0.093, 0.0])]
    (warning,) = implausible("wrist", cylinder(1.219, 0.6, 0.12), joints)
    assert warning.startswith("link wrist: 0.2194 kg m^2")
    assert implausible("wrist", cylinder(1.219, 0.06, 0.12), joints) == []


@pytest.mark.parametrize(
    ("file", "tip"), [("panda.urdf", "panda_hand_tcp"), ("../../../tests/arm/data/ur10.urdf", "tool0")]
)
def test_clean_files_do_not_warn(file: str, tip: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_arm(ROBOTS / file, tip=tip)


@pytest.mark.parametrize("fault", [10.0, 30.0])
def test_a_fault_in_one_link_of_a_clean_file_is_found_by_name(tmp_path: Path, fault: float) -> None:
    """A radius too large by ten or more in one wrist of the UR10."""
    text = (ROBOTS / "../../../tests/arm/data/ur10.urdf").read_text()
    clean, radius = 'ixx="0.0051082479567', 0.075 * fault
    assert text.count(clean) == 2
    wrong = cylinder(1.96, radius, 0.12).inertia
    at = text.index(clean)
    end = text.index("/>", at)
    tensor = f'ixx="{wrong[0, 0]}" iyy="{wrong[1, 1]}" izz="{wrong[2, 2]}" ixy="0" ixz="0" iyz="0"'
    path = tmp_path / "ur10.urdf"
    path.write_text(text[:at] + tensor + text[end:])
    with pytest.warns(PhysicsWarning, match="wrist_1_link") as caught:
        load_arm(path)
    assert len(caught) == 1


def test_a_placeholder_of_one_is_found() -> None:
    assert implausible("a", RigidBody(1.0, ORIGIN, np.eye(3)), [ORIGIN, np.array([0.3, 0, 0])])


@pytest.mark.parametrize(
    "body",
    [
        cuboid(7.85, 1.0, 1.0, 0.001),  # a steel sheet on one joint
        cuboid(0.3, 1.0, 0.02, 0.02).seen_from(pose(point=[0.5, 0, 0])),  # a rod of wood
        ellipsoid(0.5, 0.1, 0.1, 0.1),  # a hollow wrist, joints at one point
        RigidBody(1.0, ORIGIN, np.zeros((3, 3))),  # a point mass
        RigidBody(0.0, ORIGIN, np.eye(3)),  # nothing
        cylinder(400.0, 0.3, 1.2),  # a heavy column
    ],
)
def test_honest_bodies_raise_no_doubt_even_with_all_joints_at_one_point(body: RigidBody) -> None:
    assert implausible("a", body, [ORIGIN]) == []


def test_impossible_tensors_are_told_for_a_link_that_is_lumped(tmp_path: Path) -> None:
    """The sum of carrier and rider is a possible body; the rider alone is not."""
    inertial = '<inertial><mass value="{}"/><inertia ixx="{}" iyy="{}" izz="{}" ixy="0" ixz="0" iyz="0"/></inertial>'
    path = tmp_path / "arm.urdf"
    path.write_text(
        f"""<robot name="r"><link name="base"/><link name="arm">{inertial.format(9, 1, 1, 1)}</link>
        <link name="box">{inertial.format(1, 0.01, 0.01, 0.03)}</link>
        <joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
        <joint name="k" type="fixed"><parent link="arm"/><child link="box"/><origin xyz="1 0 0"/></joint></robot>"""
    )
    with pytest.warns(PhysicsWarning, match="link box") as caught:
        load_arm(path)
    assert len(caught) == 1


def test_mean_density_of_a_steel_ball_and_of_a_point() -> None:
    mass = 7850.0 * 4 / 3 * np.pi * 0.05**3
    assert mean_density(ellipsoid(mass, 0.05, 0.05, 0.05)) == pytest.approx(7850.0)
    assert mean_density(RigidBody(1.0, ORIGIN, np.zeros((3, 3)))) == float("inf")
