"""Arms from MJCF and SDF files, against MuJoCo's and Drake's own reading of the same file."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError, PhysicsWarning
from drivetrain.study.read import load_study
from drivetrain.study.template import study_template
from drivetrain.study.written import written

MJCF = """<mujoco model="crane"><compiler angle="{angle}" eulerseq="{sequence}"/><option gravity="0 1 -9"/>
<default><joint damping="0.3"/>
<default class="big"><joint axis="0 1 0" range="-90 90" frictionloss="2"/></default></default>
<worldbody><geom type="plane" size="1 1 1"/>
<body name="post" pos="0.1 0 0.2" euler="10 20 -30" childclass="big">
 <inertial pos="0.1 0.02 0" quat="0.9 0.1 -0.2 0.3" mass="3" diaginertia="0.03 0.02 0.025"/>
 <joint name="swing" pos="0 0.05 0.02"/><joint name="out" type="slide" axis="1 0 0.5" range="-0.1 0.4"/>
 <body name="plate" pos="0.2 0 0" axisangle="0 1 1 25"><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.01"/>
  <body name="boom" pos="0.3 0 0.1" xyaxes="0 1 0 -1 0.1 0">
   <inertial pos="0 0.1 0.2" mass="2" fullinertia="0.02 0.03 0.04 0.001 0.002 -0.003"/>
   <joint name="lift" class="main" axis="0.3 0 1" pos="0.01 0 0"/><geom size="0.1"/>
   <body name="hook" pos="0 0 0.4"><site name="a"/><site name="b" pos="0 0 0.1" quat="0.9 0.1 -0.2 0.3"/></body>
  </body></body></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("sequence", ["xyz", "ZYX", "zyx"])
@pytest.mark.parametrize("angle", ["degree", "radian"])
def test_mujoco_reads_the_same_arm(tmp_path: Path, angle: str, sequence: str) -> None:
    """Torques at random motions, gravity as the file says; limits and frictions too."""
    path = tmp_path / "crane.xml"
    path.write_text(MJCF.format(angle=angle, sequence=sequence))
    arm, model = load_arm(path), mujoco.MjModel.from_xml_path(str(path))
    assert arm.joint_names == ("swing", "out", "lift")
    np.testing.assert_allclose(np.stack([arm.lower, arm.upper], axis=1)[:2], model.jnt_range[:2], rtol=1e-12)
    assert np.isinf(arm.upper[2])
    data, rng = mujoco.MjData(model), np.random.default_rng(4)
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    for q, qd, qdd in rng.uniform(-2.0, 2.0, (6, 3, 3)):
        q[1] *= 0.1
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(inverse_dynamics(arm, q, qd, qdd), data.qfrc_inverse, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(tip_pose(arm, q)[:3, 3], data.body("hook").xpos, atol=1e-12)
        at_site = tip_pose(load_arm(path, tip="b"), q)
        np.testing.assert_allclose(at_site[:3, 3], data.site("b").xpos, atol=1e-12)
        np.testing.assert_allclose(at_site[:3, :3].ravel(), data.site("b").xmat, atol=1e-12)


@pytest.mark.filterwarnings("ignore::drivetrain.errors.PhysicsWarning")  # of the published UR5's wrists
@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_a_file_that_mujoco_wrote(tmp_path: Path, name: str) -> None:
    """A URDF through MuJoCo's compiler and its own writer comes back as the same arm."""
    tip = {"ur5": "wrist_3_link", "panda": "panda_hand_tcp"}[name]
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", (ROBOTS / f"{name}.urdf").read_text(), flags=re.S)
    model = mujoco.MjModel.from_xml_string(
        text.replace("<robot ", '<robot xmlns:z="z" ', 1).replace(
            "</robot>", '<mujoco><compiler balanceinertia="false" fusestatic="false"/></mujoco></robot>'
        )
    )
    path = tmp_path / "saved.xml"
    mujoco.mj_saveLastXML(str(path), model)
    arm, data, rng = load_arm(path, tip=tip), mujoco.MjData(model), np.random.default_rng(5)
    for q in rng.uniform(-1.5, 1.5, (4, model.nq)):
        if name == "panda":
            q[7:] = 0.0  # the fingers, which are held
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        whole = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, whole)
        # Six digits are what MuJoCo's writer prints.
        np.testing.assert_allclose(mass_matrix(arm, q[: arm.n]), whole[: arm.n, : arm.n], atol=2e-5)


SDF = """<?xml version="1.0"?><sdf version="1.9" xmlns:drake="http://drake.mit.edu"><model name="crane">
<link name="base"><pose>0.1 0 0 0 0 0.3</pose></link>
<frame name="mark" attached_to="base"><pose>0 0.2 0.3 0.1 0 0</pose></frame>
<frame name="eye" attached_to="lid"/><frame name="lid" attached_to="post"><pose>0 0.1 0.2 0.3 0 0</pose></frame>
<link name="post"><pose relative_to="mark">0.1 0 0.2 0.3 0.2 0.1</pose>
 <inertial><pose>0.1 0 0.2 0.1 0.2 0.3</pose><mass>3</mass>
 <inertia><ixx>0.03</ixx><iyy>0.02</iyy><izz>0.025</izz><ixy>0.001</ixy><ixz>0</ixz><iyz>-0.002</iyz></inertia></inertial></link>
<link name="boom"><pose relative_to="lift">0.05 0 0 0 0.4 0</pose><inertial><pose>0 0.1 0.2 0 0 0</pose><mass>2</mass>
 <inertia><ixx>0.03</ixx><iyy>0.03</iyy><izz>0.02</izz></inertia></inertial></link>
<joint name="hold" type="fixed"><parent>world</parent><child>base</child></joint>
<joint name="swing" type="revolute"><pose>0.01 0.02 0.03 0.1 0 0</pose><parent>base</parent><child>post</child>
 <axis><xyz expressed_in="__model__">0 0.6 0.8</xyz>
 <limit><lower>-1</lower><upper>2</upper><velocity>3</velocity><effort>50</effort></limit>
 <dynamics><damping>0.4</damping></dynamics></axis>
 <drake:rotor_inertia>2e-5</drake:rotor_inertia><drake:gear_ratio>100</drake:gear_ratio></joint>
<joint name="lift" type="prismatic"><pose relative_to="post">0 0 0.3 0 0.5 0</pose>
 <parent>post</parent><child>boom</child>
 <axis><xyz>1 0 0</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis></joint>
</model></sdf>"""


def test_drake_reads_the_same_arm(tmp_path: Path) -> None:
    """Mass matrices; ours with the rotor as a body, whose own inertia Drake leaves away."""
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    path = tmp_path / "crane.sdf"
    path.write_text(SDF)
    arm, plant = load_arm(path), MultibodyPlant(time_step=0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert arm.joint_names == ("swing", "lift") and arm.upper.tolist() == [2.0, np.inf] and arm.speed_limits[0] == 3.0
    for q in np.random.default_rng(6).uniform(-1.0, 1.0, (5, 2)):
        plant.SetPositions(context, q)
        np.testing.assert_allclose(mass_matrix(arm, q), plant.CalcMassMatrix(context), atol=1e-12)
        gravity = -plant.CalcGravityGeneralizedForces(context)
        np.testing.assert_allclose(inverse_dynamics(arm, q, [0, 0], [0, 0]), gravity, atol=1e-10)


@pytest.mark.parametrize("frame", ["claw", "post", "base"])
def test_a_frame_of_an_sdf_is_the_tip(tmp_path: Path, frame: str) -> None:
    """A frame on the last link, on the first of two, and a link: against the pose that Drake computes."""
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    path, at = tmp_path / "crane.sdf", {"claw": "boom", "post": "post"}.get(frame, "base")
    tool = f'<frame name="tool" attached_to="{at}"><pose>0.1 0.2 -0.3 0.4 -0.5 0.6</pose></frame></model>'
    path.write_text(SDF.replace("</model>", tool))
    if at == "base":
        with pytest.raises(InputError, match="no movable joint between"):
            load_arm(path, tip="tool")
        return
    arm, plant = load_arm(path, tip="tool"), MultibodyPlant(time_step=0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for q in np.random.default_rng(6).uniform(-1.0, 1.0, (3, 2)):
        plant.SetPositions(context, q)
        wanted = plant.GetFrameByName("tool").CalcPoseInWorld(context).GetAsMatrix4()
        np.testing.assert_allclose(tip_pose(arm, q[: arm.n]), wanted, atol=1e-12)


@pytest.mark.parametrize(
    ("file", "change", "told"),
    [
        ("a.xml", ('name="lift"', 'type="ball" name="lift"'), "floating"),
        ("a.xml", ('<inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.01"/>', '<geom size="1"/>'), "geoms"),
        ("a.xml", ('pos="0 0 0.4"', 'pos="0 0"'), "3 finite"),
        ("a.xml", ("<worldbody>", '<include file="x.xml"/><worldbody>'), "include"),
        ("a.xml", ('mass="2"', 'mass="-2"'), "negative"),
        ("a.xml", ('name="plate"', 'name="post"'), "twice"),
        ("a.xml", ("<compiler ", '<compiler inertiafromgeom="true" '), "inertiafromgeom"),
        ("a.xml", ("<compiler ", '<compiler boundmass="3" '), "boundmass"),
        ("a.xml", ('eulerseq="xyz"', 'eulerseq="xy"'), "eulerseq"),
        ("a.sdf", ('<model name="crane">', '<model name="crane"><static>1</static>'), "static"),
        ("a.sdf", ('relative_to="mark"', 'relative_to="mrak"'), "mark"),
        ("a.sdf", ('relative_to="lift"', 'relative_to="boom"'), "itself"),
        ("a.sdf", ('type="prismatic"', 'type="universal"'), "floating"),
        ("a.sdf", ("<mass>2</mass>", "<mass>two</mass>"), "finite"),
        ("a.sdf", ("<inertial><pose>0 0.1", '<inertial auto="true"><pose>0 0.1'), "collision"),
        ("a.sdf", ('<model name="crane">', '<model name="crane"><pose relative_to="hall">1 2 3 0 0 0</pose>'), "hall"),
        ("a.sdf", ("<parent>base</parent>", "<parent>bse</parent>"), "base"),
        ("a.sdf", ('<model name="crane">', "<world>"), "malformed|one <model>"),
    ],
)
def test_files_that_hold_no_arm(tmp_path: Path, file: str, change: tuple[str, str], told: str) -> None:
    text = MJCF.format(angle="degree", sequence="xyz") if file.endswith("xml") else SDF
    assert change[0] in text
    (tmp_path / file).write_text(text.replace(*change))
    with pytest.raises(InputError, match=told):
        load_arm(tmp_path / file)


SITES = '<site site="a"/><site site="b"/>'


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (("<compiler ", '<option><flag gravity="disable"/></option><compiler autolimits="true"/><compiler '), ""),
        (('<joint name="swing"', '<joint stiffness="5" name="swing"'), "stiffness"),
        (("</mujoco>", f'<tendon><spatial name="coil">{SITES}</spatial></tendon></mujoco>'), "coil"),
        (
            (
                "</mujoco>",
                '<tendon><fixed name="pull"><joint joint="swing" coef="1"/><joint joint="lift" coef="2"/></fixed>'
                '</tendon><actuator><motor name="m" tendon="pull" gear="50"/></actuator></mujoco>',
            ),
            "not as many motors",
        ),
        (
            (
                "</mujoco>",
                '<actuator><motor name="m" joint="lift" gear="50" armature="1e-5"/><motor name="n" joint="lift"'
                ' gear="50" armature="1e-5"/></actuator></mujoco>',
            ),
            "actuator m, actuator n",
        ),
        (("</mujoco>", '<equality><joint joint1="swing" joint2="lift"/></equality></mujoco>'), "closures"),
    ],
)
def test_mujoco_options_that_count(tmp_path: Path, change: tuple[str, str], note: str) -> None:
    """Weight switched off, options in several places, springs that are not taken over."""
    text = MJCF.format(angle="degree", sequence="xyz")
    assert change[0] in text
    path = tmp_path / "arm.xml"
    path.write_text(text.replace(*change, 1))
    arm, model = load_arm(path), mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    assert not note or any(note in one for one in arm.notes)
    for q in np.random.default_rng(8).uniform(-1.0, 1.0, (4, arm.n)):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        still = np.zeros(arm.n)
        np.testing.assert_allclose(inverse_dynamics(arm, q, still, still), data.qfrc_bias, atol=1e-10)


@pytest.mark.parametrize(
    "change",
    [
        (
            "<worldbody>",
            '<default><joint range="-10 20"/></default><default><joint damping="0"/></default><worldbody>',
        ),
        ('<joint name="swing"', '<joint range="0 0" name="swing"'),
        ('<joint name="swing"', '<joint damping="0.3 1 2" stiffness="0 0" name="swing"'),
        ('diaginertia="0.03 0.02 0.025"/>', 'diaginertia="0.03 0.02 0.09"/>'),
        ("</mujoco>", '<actuator><motor joint="lift" gear="5e4"/></actuator></mujoco>'),
        ("</mujoco>", '<actuator><position jointinparent="lift" gear="5e4"/></actuator></mujoco>'),
    ],
)
@pytest.mark.filterwarnings("ignore::drivetrain.errors.PhysicsWarning")
def test_mass_matrix_and_limits_are_mujoco_s(tmp_path: Path, change: tuple[str, str]) -> None:
    """Defaults in two sections and of all kinds of actuators, limits taken away, numbers of higher powers."""
    text = MJCF.format(angle="degree", sequence="xyz").replace("<compiler ", '<compiler balanceinertia="true" ')
    text = text.replace("<default><joint", '<default><general armature="1e-9"/><joint')
    assert change[0] in text
    path = tmp_path / "arm.xml"
    path.write_text(text.replace(*change, 1))
    arm, model = load_arm(path), mujoco.MjModel.from_xml_path(str(path))
    limits = np.where(model.jnt_limited[:, None], model.jnt_range, [-np.inf, np.inf])
    np.testing.assert_allclose(np.stack([arm.lower, arm.upper], axis=1), limits, rtol=1e-12)
    data, whole = mujoco.MjData(model), np.zeros((arm.n, arm.n))
    for q in np.random.default_rng(8).uniform(-1.0, 1.0, (4, arm.n)):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        # MuJoCo counts a rotor's inertia at its own joint only, not the 1e-9 kg m^2 by which its carrier turns.
        np.testing.assert_allclose(mass_matrix(at_level(arm, RotorLevel.REFLECTED), q), whole, rtol=1e-8, atol=1e-8)


def test_a_tendon_that_weighs(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    tendon = '<tendon><fixed name="belt" armature="1" damping="0 2"><joint joint="swing" coef="1"/></fixed></tendon>'
    path.write_text(MJCF.format(angle="degree", sequence="xyz").replace("</mujoco>", f"{tendon}</mujoco>"))
    assert any("belt: its armature" in note for note in load_arm(path).notes)


@pytest.mark.parametrize(
    "change",
    [
        ('<model name="crane">', '<model name="crane"><pose>1 2 3 0.4 -0.5 0.6</pose>'),
        ('<joint name="hold" type="fixed"><parent>world</parent><child>base</child></joint>', ""),
        (
            '<link name="base"><pose>0.1 0 0 0 0 0.3</pose></link>',
            '<link name="base"><pose>0 0 0 0.5 0 1</pose></link>',
        ),
        ('<model name="crane">', '<model name="crane" placement_frame="lift"><pose>1 2 3 0.4 -0.5 0.6</pose>'),
        (
            '<model name="crane">',
            '<model name="crane"><pose rotation_format="quat_xyzw">1 2 3  0.48 0 0.36 0.8</pose>',
        ),
        ("<parent>base</parent>", "<parent>mark</parent>"),
        ("<child>post</child>", "<child>eye</child>"),
    ],
)
def test_drake_s_model_stands_askew(tmp_path: Path, change: tuple[str, str]) -> None:
    """The model turned in the world, or its root link in the model: weight falls along the world's z all the same.

    Joints between frames, too.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    path = tmp_path / "crane.sdf"
    text = SDF.replace("<pose>0.1 0 0 0 0 0.3</pose>", "<pose>0.1 0 0 0.2 0.7 0.3</pose>") if not change[1] else SDF
    assert change[0] in text
    path.write_text(text.replace(*change))
    arm, plant = load_arm(path), MultibodyPlant(time_step=0.0)
    Parser(plant).AddModels(str(path))
    if not change[1]:
        free = MultibodyPlant(time_step=0.0)
        Parser(free).AddModels(str(path))
        free.Finalize()
        stands = free.EvalBodyPoseInWorld(free.CreateDefaultContext(), free.GetBodyByName("base"))
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"), stands)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for q in np.random.default_rng(9).uniform(-1.0, 1.0, (4, 2)):
        plant.SetPositions(context, q)
        gravity = -plant.CalcGravityGeneralizedForces(context)
        np.testing.assert_allclose(inverse_dynamics(arm, q, [0, 0], [0, 0]), gravity, atol=1e-10)
        np.testing.assert_allclose(mass_matrix(arm, q), plant.CalcMassMatrix(context), atol=1e-12)


@pytest.mark.parametrize(
    "older",
    [
        ('version="1.9"', 'version="1.4"', ""),
        ('version="1.9"', 'version="1.6"', "<use_parent_model_frame>true</use_parent_model_frame>"),
    ],
)
def test_axes_of_older_sdf(tmp_path: Path, older: tuple[str, str, str]) -> None:
    """In the model's frame up to version 1.4, later where the file says so: as the newer ``expressed_in``."""
    axis = '<xyz expressed_in="__model__">0 0.6 0.8</xyz>'
    for name, text in {
        "new": SDF,
        "old": SDF.replace(*older[:2]).replace(axis, f"<xyz>0 0.6 0.8</xyz>{older[2]}"),
    }.items():
        (tmp_path / f"{name}.sdf").write_text(text.replace("<xyz>1 0 0</xyz>", axis))
    new, old = (load_arm(tmp_path / f"{name}.sdf") for name in ("new", "old"))
    if older[2]:  # of that joint alone
        np.testing.assert_allclose(old.screws[0], new.screws[0], atol=1e-12)
    else:
        np.testing.assert_allclose(old.screws, new.screws, atol=1e-12)


def test_a_world_s_gravity_and_what_is_not_used(tmp_path: Path) -> None:
    path = tmp_path / "crane.sdf"
    text = SDF.replace("<model", "<world name='moon'><gravity>0 0.1 -1.6</gravity><model").replace(
        "</sdf>", "</world></sdf>"
    )
    text = text.replace('<link name="boom">', '<link name="boom"><gravity>false</gravity>')
    path.write_text(text.replace("<damping>", "<spring_stiffness>3</spring_stiffness><damping>"))
    arm = load_arm(path)
    assert arm.gravity.tolist() == [0.0, 0.1, -1.6] and load_arm(path, gravity=(0, 0, -1)).gravity[2] == -1.0
    assert any("boom: <gravity>" in note for note in arm.notes) and any(
        "swing: its spring" in note for note in arm.notes
    )


def test_links_that_sdf_makes_heavy(tmp_path: Path) -> None:
    """Without <inertial> a link has SDF's 1 kg and 1 kg m^2; the notes say so, and that it is hard to believe."""
    path = tmp_path / "crane.sdf"
    path.write_text(re.sub(r"<inertial><pose>0 0.1 0.2.*?</inertial>", "", SDF, flags=re.S))
    with pytest.warns(PhysicsWarning, match="boom"):
        arm = load_arm(path)
    assert arm.masses[1] == 1.0 and any("boom: no <inertial>" in note for note in arm.notes)
    np.testing.assert_allclose(arm.inertias[1], np.eye(3), atol=1e-12)


def test_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ROS 1 and ROS 2 places, and a package that is nowhere."""
    folder = tmp_path / "share" / "crane_description"
    folder.mkdir(parents=True)
    (folder / "crane.sdf").write_text(SDF)
    address = "package://crane_description/crane.sdf"
    elsewhere = tmp_path / "studies"
    elsewhere.mkdir()
    for name, value in (("ROS_PACKAGE_PATH", tmp_path / "share"), ("AMENT_PREFIX_PATH", tmp_path)):
        with monkeypatch.context() as patch:
            patch.setenv(name, str(value))
            assert load_arm(address).joint_names == ("swing", "lift")
            (elsewhere / "study.yaml").write_text(study_template(address, elsewhere))
            study = load_study(elsewhere / "study.yaml")
            assert study.arm is not None and study.arm.joint_names == ("swing", "lift")
            assert f"arm: {address}" in written(study.document, tmp_path)  # written to another folder it stays
    with pytest.raises(InputError, match="crane_description"):
        load_arm(address)
    with pytest.raises(InputError, match="crane_description"):
        load_study(elsewhere / "study.yaml")
