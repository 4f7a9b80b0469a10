"""Shapes of a URDF's links, held against where pinocchio places the same geometry."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial import ConvexHull

from drivetrain.arm.files.load import load_arm
from drivetrain.arm.files.shapes import CELLS, link_shapes
from drivetrain.arm.kinematics import link_poses
from drivetrain.spatial.mesh_inertia import read_mesh

INERTIAL = (
    '<inertial><origin xyz="0.1 0 0.02"/><mass value="2"/>'
    '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'
)
URDF = f"""<robot name="shapes">
<link name="base"><visual><origin xyz="0 0 0.05"/><geometry><cylinder radius="0.08" length="0.1"/></geometry></visual>
</link>
<link name="upper">{INERTIAL}
  <visual><geometry><mesh filename="package://shapes/missing.dae"/></geometry></visual>
  <collision><origin xyz="0.2 0.03 0" rpy="0.3 0.2 -0.4"/><geometry><box size="0.4 0.1 0.06"/></geometry></collision>
</link>
<link name="lower">{INERTIAL}
  <visual><origin rpy="0 0.5 0"/>
    <geometry><mesh filename="package://shapes/ball.stl" scale="0.001 0.001 0.002"/></geometry></visual></link>
<link name="hand"><visual><origin xyz="0 0 0.1"/><geometry><sphere radius="0.05"/></geometry></visual></link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="0 0.2 0.1"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0" rpy="0.4 0 0"/>
  <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="c" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0.3 0 0.1" rpy="1 0 0"/></joint>
</robot>"""


@pytest.fixture
def file(tmp_path):
    """The arm, and a ball of 100 mm with far more corners than a picture needs."""
    path = tmp_path / "shapes" / "arm.urdf"
    path.parent.mkdir()
    path.write_text(URDF)
    trimesh.creation.icosphere(subdivisions=4, radius=50.0).export(path.parent / "ball.stl")
    return path


def test_they_are_where_pinocchio_puts_them(file):
    arm = load_arm(file, tip="hand")
    found = link_shapes(arm)
    assert [link for link, _ in found] == [-1, 0, 1, 1]
    model = pin.buildModelFromUrdf(str(file))
    data, q = model.createData(), np.array([0.7, -1.1])
    pin.forwardKinematics(model, data, q)
    pin.updateFramePlacements(model, data)
    moved = np.concatenate([[np.eye(4)], link_poses(arm, q) @ np.linalg.inv(arm.home)])
    own = {"base": ([0, 0, 0.05], [0, 0, 0]), "upper": ([0.2, 0.03, 0], [0.3, 0.2, -0.4]),
           "lower": ([0, 0, 0], [0, 0.5, 0]), "hand": ([0, 0, 0.1], [0, 0, 0])}  # fmt: skip
    half = {"base": [0.08, 0.08, 0.05], "upper": [0.2, 0.05, 0.03], "lower": [0.05, 0.05, 0.1], "hand": [0.05] * 3}
    for (link, (corners, faces)), (name, (xyz, rpy)) in zip(found, own.items(), strict=True):
        at = data.oMf[model.getFrameId(name)] * pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz, dtype=float))
        points = corners @ moved[link + 1][:3, :3].T + moved[link + 1][:3, 3]
        inside = (points - at.translation) @ at.rotation
        size = 2.0 * np.array(half[name])
        # Corners merged in cells: their mean is off the surface by at most a cell.
        slack = size.max() / CELLS if name == "lower" else 1e-8
        assert np.ptp(inside, axis=0) == pytest.approx(size, abs=slack)
        assert 0.5 * (inside.min(axis=0) + inside.max(axis=0)) == pytest.approx(np.zeros(3), abs=slack)
        a, b, c = np.moveaxis(inside[faces], 1, 0)  # all of them are convex: outwards is away from the middle
        assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > -1e-12).all()
        volume = np.einsum("ij,ij->", np.cross(a, b), c) / 6.0  # closed: of a coarse mesh, with dents
        assert volume == pytest.approx(ConvexHull(corners).volume, rel=0.05 if name == "lower" else 1e-9)


def test_a_fine_mesh_becomes_coarse(file):
    fine = read_mesh(file.parent / "ball.stl")
    (corners, faces), *_ = [shape for link, shape in link_shapes(load_arm(file)) if len(shape[0]) > 100]
    assert len(fine.faces) == 5120 and len(faces) < 1000 and len(corners) < 500


def test_what_cannot_be_read_has_no_shape(file):
    (file.parent / "ball.stl").write_text("no mesh")
    file.write_text(URDF.replace('radius="0.05"', 'radius="small"'))
    assert [link for link, _ in link_shapes(load_arm(file, tip="hand"))] == [-1, 0]
    assert link_shapes(load_arm("ur5")) == []


@pytest.mark.parametrize(
    ("stated", "instead"),
    [('xyz="0 0 0.1"/>', 'xyz="0 0 high"/>'), ('xyz="0 0 0.1"/>', 'xyz="0 0.1"/>'),
     ('xyz="0 0 0.1"/>', 'rpy="nan 0 0"/>'),
     ('radius="0.05"', 'radius="inf"'), ('radius="0.05"', "")],
)  # fmt: skip
def test_a_malformed_number_is_not_guessed(file, stated, instead):
    head, hand = URDF.split('<link name="hand">')
    assert stated in hand
    file.write_text(f'{head}<link name="hand">{hand.replace(stated, instead, 1)}')
    assert [link for link, _ in link_shapes(load_arm(file, tip="hand"))] == [-1, 0, 1]
