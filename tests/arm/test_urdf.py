"""The URDF reader against pinocchio's on published and made-up files, and its answers to every kind of bad file."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.checks import checked_inertia
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.files.model import read_model
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError, PhysicsWarning
from drivetrain.spatial.poses import exp_pose, inverse_pose

DATA = Path(__file__).with_name("data")
INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'


def written(folder: Path, body: str, name: str = "arm.urdf") -> Path:
    path = folder / name
    path.write_text(f'<robot name="test">{textwrap.dedent(body)}</robot>', encoding="utf-8")
    return path


def faults_of(path: Path, **options: str) -> str:
    with pytest.raises(InputError) as error:
        load_arm(path, **options)
    return str(error.value)


def tip_at(arm: Arm, q: np.ndarray) -> np.ndarray:
    pose = arm.tip
    for screw, value in zip(arm.screws[::-1], q[::-1], strict=True):
        pose = exp_pose(screw * value) @ pose
    return pose


def assert_same_as_pinocchio(arm: Arm, path: Path, tip: str, locked: tuple[str, ...] = ()) -> None:
    model = pin.buildModelFromUrdf(str(path))
    model = pin.buildReducedModel(model, [model.getJointId(name) for name in locked], pin.neutral(model))
    data = model.createData()
    assert tuple(model.names)[1:] == arm.joint_names
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    for i in range(arm.n):
        body, placement = model.inertias[i + 1], data.oMi[i + 1].homogeneous
        home_in_joint = inverse_pose(placement) @ arm.home[i]
        assert arm.masses[i] == pytest.approx(body.mass, rel=1e-14)
        assert home_in_joint[:3, 3] == pytest.approx(body.lever, abs=1e-14)
        turn = home_in_joint[:3, :3]
        rounding = 5e-15 * max(1.0, np.abs(body.inertia).max())  # sums of some ten products
        assert turn @ arm.inertias[i] @ turn.T == pytest.approx(body.inertia, abs=rounding)
        assert arm.joint_points[i] == pytest.approx(placement[:3, 3], abs=1e-14)
    rng = np.random.default_rng(1)
    for q in rng.uniform(-1.0, 1.0, size=(5, arm.n)):
        pin.framesForwardKinematics(model, data, pin.integrate(model, pin.neutral(model), q))
        assert tip_at(arm, q) == pytest.approx(data.oMf[model.getFrameId(tip)].homogeneous, abs=1e-13)


def test_ur10_agrees_with_pinocchio() -> None:
    arm = load_arm(DATA / "ur10.urdf")
    assert_same_as_pinocchio(arm, DATA / "ur10.urdf", "tool0")
    assert arm.speed_limits[0] == 2.16
    assert arm.lower[2] == pytest.approx(-np.pi)


def test_ur5_agrees_with_pinocchio_and_warns_of_its_wrists() -> None:
    with pytest.warns(PhysicsWarning) as caught:
        arm = load_arm(ROBOTS / "ur5.urdf", tip="ee_link")
    assert_same_as_pinocchio(arm, ROBOTS / "ur5.urdf", "ee_link")
    named = [str(w.message).split(":")[0] for w in caught]
    assert named == ["link wrist_1_link", "link wrist_2_link", "link wrist_3_link"]
    assert all(w.filename == __file__ for w in caught)
    assert sum("wrist" in note for note in arm.notes) == 3


def test_panda_agrees_with_pinocchio_and_holds_its_fingers() -> None:
    path = ROBOTS / "panda.urdf"
    arm = load_arm(path, tip="panda_hand_tcp")
    fingers = ("panda_finger_joint1", "panda_finger_joint2")
    assert_same_as_pinocchio(arm, path, "panda_hand_tcp", fingers)
    assert any(all(finger in note for finger in fingers) for note in arm.notes)


def random_urdf(rng: np.random.Generator) -> str:
    """A chain with oblique axes and turned inertials, a fixed flange, and a side branch in the middle."""

    def link(name: str) -> str:
        a = rng.normal(size=(3, 3))
        second = 0.01 * a @ a.T  # second moments of mass: any positive matrix is some body's
        i = np.trace(second) * np.eye(3) - second
        xyz, rpy = (" ".join(map(str, rng.normal(size=3))) for _ in range(2))
        return (
            f'<link name="{name}"><inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass value="{rng.uniform(1, 3)}"/>'
            f'<inertia ixx="{i[0, 0]}" ixy="{i[0, 1]}" ixz="{i[0, 2]}" '
            f'iyy="{i[1, 1]}" iyz="{i[1, 2]}" izz="{i[2, 2]}"/></inertial></link>'
        )

    def joint(name: str, kind: str, parent: str, child: str) -> str:
        xyz, rpy, axis = (" ".join(map(str, rng.normal(size=3))) for _ in range(3))
        axis = "" if kind == "fixed" else f'<axis xyz="{axis}"/><limit lower="-2" upper="2" effort="1" velocity="3"/>'
        return (
            f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<parent link="{parent}"/><child link="{child}"/>{axis}</joint>'
        )

    links = [link(name) for name in ("base", "a", "b", "c", "flange", "tool", "box", "lid")]
    joints = [
        joint("j1", "revolute", "base", "a"),
        joint("j2", "prismatic", "a", "b"),
        joint("j3", "continuous", "b", "c"),
        joint("bolt", "fixed", "c", "flange"),
        joint("j4", "revolute", "flange", "tool"),
        joint("screws", "fixed", "b", "box"),
        joint("hinge", "revolute", "box", "lid"),
    ]
    return "".join(links + joints)


@pytest.mark.parametrize("seed", range(5))
def test_made_up_trees_agree_with_pinocchio(tmp_path: Path, seed: int) -> None:
    path = written(tmp_path, random_urdf(np.random.default_rng(seed)))
    arm = load_arm(path, tip="tool")
    assert_same_as_pinocchio(arm, path, "tool", ("hinge",))
    assert arm.link_names == ("a", "b", "c", "tool")
    assert arm.lower.tolist() == [-2, -2, -np.inf, -2]
    assert arm.speed_limits.tolist() == [3, 3, 3, 3]


def test_a_tip_within_the_tree_carries_the_rest_held_at_zero(tmp_path: Path) -> None:
    path = written(tmp_path, random_urdf(np.random.default_rng(0)))
    arm = load_arm(path, tip="flange")
    assert_same_as_pinocchio(arm, path, "flange", ("hinge", "j4"))


TURN = '<axis xyz="0 0 2"/><limit lower="-1" upper="1" velocity="2" effort="3"/>'


def chain(extra: str = "", joint: str = TURN) -> str:
    return f"""
        <link name="base"/><link name="arm">{INERTIAL}</link><link name="tool0"/>
        <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>{joint}</joint>
        <joint name="bolt" type="fixed"><parent link="arm"/><child link="tool0"/><origin xyz="0.3 0 0"/></joint>
        {extra}"""


def test_quaternions_agree_with_pinocchio(tmp_path: Path) -> None:
    """URDF 1.1 writes rotations so, too, of whatever length; older files and readers ignore them."""
    origin = '<origin xyz="0.1 0 0.2" quat_xyzw="0.4 -0.2 0.6 1.6"/>'
    path = tmp_path / "arm.urdf"
    link = f'<link name="b">{INERTIAL.replace("<inertial>", f"<inertial>{origin}")}</link>'
    joint = f'<joint name="j" type="continuous"><parent link="a"/><child link="b"/>{origin}<axis xyz="0 0 1"/></joint>'
    path.write_text(f'<robot name="r" version="1.1"><link name="a"/>{link}{joint}</robot>')
    assert_same_as_pinocchio(load_arm(path), path, "b")


@pytest.mark.parametrize("left_out", ['xyz="0 0 0"', 'rpy="0 0 0"'])
def test_what_an_origin_leaves_out_is_zero(tmp_path: Path, left_out: str) -> None:
    place = {'xyz="0 0 0"': ('rpy="0.3 0.2 0.1"', 'quat_xyzw="0.5 0.5 0.5 0.5"'), 'rpy="0 0 0"': ('xyz="0.3 0.2 0.1"',)}
    for stated in place[left_out]:
        whole = written(tmp_path, chain(joint=f"{TURN}<origin {left_out} {stated}/>"))
        part = written(tmp_path, chain(joint=f"{TURN}<origin {stated}/>"), "part.urdf")
        np.testing.assert_array_equal(load_arm(whole).home, load_arm(part).home)
        np.testing.assert_array_equal(load_arm(whole).screws, load_arm(part).screws)


def test_axis_is_made_unit_and_gravity_can_be_chosen(tmp_path: Path) -> None:
    arm = load_arm(written(tmp_path, chain()), gravity=[0, 9.81, 0])
    assert arm.screws[0].tolist() == [0, 0, 1, 0, 0, 0]
    assert arm.gravity.tolist() == [0, 9.81, 0]
    assert arm.tip[:3, 3].tolist() == [0.3, 0, 0]


def test_every_ignored_tag_and_attribute_is_told_once_with_its_count(tmp_path: Path) -> None:
    body = chain(
        extra='<gazebo/><gazebo reference="arm"/><material name="red"/>'
        '<link name="cover"><visual/><visual/><collision/></link>'
        '<joint name="clip" type="fixed"><parent link="arm"/><child link="cover"/><calibration rising="0"/></joint>'
    )
    (note,) = [note for note in load_arm(written(tmp_path, body)).notes if note.startswith("ignored")]
    for words in ("<visual> (2)", "<collision> (1)", "<gazebo> (2)", "<material> (1)", "<calibration> (1)",
                  "<limit effort=...> (1)"):  # fmt: skip
        assert words in note
    assert "inertial" not in note


def test_what_the_file_leaves_open_is_told(tmp_path: Path) -> None:
    arm = load_arm(written(tmp_path, chain(joint="")))
    assert arm.screws[0, :3].tolist() == [1, 0, 0]
    assert arm.upper.tolist() == [np.inf]
    assert any("no <axis>" in note and "no <limit>" in note for note in arm.notes)


def test_moving_links_without_mass_are_allowed_and_told(tmp_path: Path) -> None:
    body = chain().replace(INERTIAL, "")
    arm = load_arm(written(tmp_path, body))
    assert arm.masses.tolist() == [0.0]
    assert any("without mass: arm" in note for note in arm.notes)


def test_mimic_joints_are_told(tmp_path: Path) -> None:
    body = chain(
        extra='<link name="c"/><joint name="follow" type="revolute"><parent link="tool0"/><child link="c"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="1" velocity="1" effort="1"/><mimic joint="turn"/></joint>'
    )
    assert any("follow" in note and "mimic turn" in note for note in load_arm(written(tmp_path, body)).notes)


def test_of_several_fixed_ends_the_usual_one_is_taken(tmp_path: Path) -> None:
    camera = (
        '<link name="camera"/><joint name="m" type="fixed"><parent link="tool0"/><child link="mount"/></joint>'
        '<link name="mount"/><joint name="k" type="fixed"><parent link="arm"/><child link="camera"/></joint>'
    )
    arm = load_arm(written(tmp_path, chain(camera)))
    assert any("tip: mount" in note for note in arm.notes)  # the farther of the two ends
    camera = '<link name="eye"/><joint name="k" type="fixed"><parent link="arm"/><child link="eye"/></joint>'
    assert any("tip: tool0" in note for note in load_arm(written(tmp_path, chain(camera))).notes)


def test_several_chains_need_a_choice() -> None:
    message = faults_of(ROBOTS / "panda.urdf")
    for leaf in ("panda_hand_tcp", "panda_leftfinger", "panda_rightfinger"):
        assert leaf in message


def joined(kind: str, parent: str, child: str) -> str:
    return f"<link name='x'/><joint name='j' {kind}><parent link='{parent}'/><child link='{child}'/></joint>"


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("<link name='a'/><link>", "malformed XML"),
        ("", "has no <link>"),
        ("<link name='a'/>", "no movable joint"),
        ("<link name='a'/><link name='b'/>", "several hang on no joint"),
        ("<link/>", 'needs the attribute "name"'),
        (chain("<link name='arm'/>"), "must not be used twice"),
        (chain("<joint name='turn' type='fixed'><parent link='arm'/><child link='base'/></joint>"), "used twice"),
        (chain("<joint name='j' type='fixed'><parent link='arn'/><child link='base'/></joint>"), "did you mean 'arm'"),
        (chain("<joint name='j' type='fixed'><parent link='tool0'/><child link='base'/></joint>"), "loop"),
        (chain(joined("type='fixed'", "x", "arm")), "child of two joints"),
        (chain().replace('type="revolute"', 'type="floating"'), "turn: is of a kind that a serial arm cannot have"),
        (chain(joined("type='ball'", "arm", "x")), "ball"),
        (chain(joined("", "arm", "x")), '"type"'),
        (chain("<link name='x'/><joint name='j' type='fixed'><child link='x'/></joint>"), "needs <parent>"),
        (chain(joint="<axis xyz='0 0 0'/>"), "must have a direction"),
        (chain(joint="<axis xyz='0 0'/>"), "3 finite number"),
        (chain(joint="<axis xyz='0 0 nan'/>"), "3 finite number"),
        (chain(joint="<limit lower='${-pi}' upper='1'/>"), "must be a number"),
        (chain(joint="<origin xyz='${h} 0 0'/>"), "suffix .xacro"),
        (chain(joint="<limit lower='2' upper='1'/>"), "above its upper limit"),
        (chain("<link name='x'><inertial><mass value='-1'/></inertial></link>"), "must not be negative"),
        (chain("<link name='x'><inertial><mass value='1'/></inertial></link>"), "needs <inertia>"),
        (chain("<link name='x'><inertial><mass/></inertial></link>"), '"value"'),
        (chain().replace('ixy="0"', ""), '"ixy"'),
        (chain().replace('ixx="0.1"', 'ixx="-0.1"'), "negative moment"),
    ],
)  # fmt: skip
def test_bad_files_are_told_with_the_file_and_the_mend(tmp_path: Path, body: str, words: str) -> None:
    path = written(tmp_path, body)
    message = faults_of(path)
    assert words in message
    assert str(path) in message


def test_faults_that_do_not_touch_the_arm_do_not_stop_it(tmp_path: Path) -> None:
    """As converters write them: axes and limits of fixed joints, joints of parts taken away, moments by rounding."""
    oddities = """
        <link name="camera"/><link name="box"/><link name="finger"/>
        <joint name="screwed" type="fixed"><parent link="arm"/><child link="camera"/><axis xyz="0 0 0"/>
          <limit lower="1" upper="-1" effort="0" velocity="0"/></joint>
        <joint name="lying" type="floating"><parent link="base"/><child link="box"/></joint>
        <joint name="grip" type="prismatic"><parent link="tool0"/><child link="finger"/><axis xyz="0 1 0"/>
          <limit lower="0" upper="0.1" effort="1" velocity="1"/><mimic joint="other_finger"/></joint>
        <transmission name="hand"><type>transmission_interface/SimpleTransmission</type><joint name="thumb"/>
          <actuator name="m"><mechanicalReduction>7</mechanicalReduction></actuator></transmission>"""
    plain = load_arm(written(tmp_path, chain(), "plain.urdf"))
    whole = written(tmp_path, chain(oddities))
    arm = load_arm(whole, tip="tool0")
    samples = np.random.default_rng(7).normal(size=(3, 5, 1))
    np.testing.assert_array_equal(inverse_dynamics(arm, *samples), inverse_dynamics(plain, *samples))
    notes = "; ".join(arm.notes)
    assert "transmission hand not used: the file has no joint thumb" in notes
    assert "held at zero, off the chain: lying, grip" in notes
    assert "mimic other_finger" in "; ".join(load_arm(whole, tip="finger").notes)


def test_moments_that_are_negative_by_rounding_are_zero() -> None:
    tensor = checked_inertia([[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, -5e-20]], "inertia")
    np.testing.assert_array_equal(np.diag(tensor), [1e-3, 1e-3, 0.0])
    with pytest.raises(InputError, match="no negative moment"):
        checked_inertia([[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, -1e-8]], "inertia")


@pytest.mark.parametrize("encoding", ["shift_jis", "utf-7", "nonsense"])
def test_an_encoding_that_cannot_be_read_is_a_message(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(f'<?xml version="1.0" encoding="{encoding}"?><robot name="arm"/>', encoding="ascii")
    assert "must be UTF-8" in faults_of(path)


def test_all_faults_of_a_file_at_once(tmp_path: Path) -> None:
    body = chain(joint="<axis xyz='0 0 0'/>").replace('mass value="2"', 'mass value="two"').replace('iyz="0"', "")
    with pytest.raises(InputError) as error:
        load_arm(written(tmp_path, body))
    assert len(error.value.faults) == 3


def test_names_given_must_be_in_the_file(tmp_path: Path) -> None:
    path = written(tmp_path, chain())
    assert "did you mean 'tool0'" in faults_of(path, tip="tool1")


def test_no_such_file_and_no_robot(tmp_path: Path) -> None:
    assert "no such file" in faults_of(tmp_path / "none.urdf")
    path = tmp_path / "a.urdf"
    path.write_text("<sdf/>")
    assert "must be a <robot>" in faults_of(path)


DRIVES = """
    <transmission name="ros1"><type>transmission_interface/SimpleTransmission</type>
      <joint name="turn"><hardwareInterface>E</hardwareInterface></joint>
      <actuator name="m"><mechanicalReduction>{ros1}</mechanicalReduction>{drake}</actuator></transmission>
    <ros2_control name="c" type="system"><hardware/><joint name="turn"/>
      <transmission name="t"><plugin>transmission_interface/SimpleTransmission</plugin>
      <joint name="turn" role="j"><mechanical_reduction>{ros2}</mechanical_reduction></joint>
      <actuator name="m" role="a"/></transmission></ros2_control>"""


def test_all_dialects_of_a_drive(tmp_path: Path) -> None:
    drake = '<drake:rotor_inertia value="1.5e-4"/><drake:gear_ratio value="-120"/>'
    joint = '<axis xyz="0 0 1"/><dynamics damping="0.5" friction="0.25"/>'
    one = written(tmp_path, chain(DRIVES.format(ros1=101, ros2=101, drake=""), joint))
    drive = read_model(one).drives["turn"]
    assert (drive.damping, drive.friction, drive.ratio, drive.rotor_inertia) == (0.5, 0.25, 101.0, None)
    assert (
        "friction in the file, not used (a study states `friction` of a joint): turn 0.25 N m and 0.5 N m per rad/s"
        in (load_arm(one).notes)
    )
    two = written(tmp_path, chain(DRIVES.format(ros1=1, ros2=1, drake=drake), joint))
    assert read_model(two).drives["turn"].ratio == -120.0  # the undeclared prefix is no error either
    assert read_model(two).drives["turn"].rotor_inertia == 1.5e-4
    assert any("gear_ratio -120 taken, not the reduction 1" in note for note in load_arm(two).notes)
    three = written(tmp_path, chain(joint=joint + drake))
    assert read_model(three).drives["turn"].ratio == -120.0
    four = written(tmp_path, chain())
    assert read_model(four).drives == {"turn": type(drive)()}


def test_ros2_reduction_alone_and_pr2_style(tmp_path: Path) -> None:
    ros2 = DRIVES[DRIVES.index("<ros2") :].format(ros2=50)
    assert read_model(written(tmp_path, chain(ros2))).drives["turn"].ratio == 50.0
    pr2 = (
        '<transmission type="pr2_mechanism_model/SimpleTransmission" name="t"><actuator name="m"/><joint name="turn"/>'
        "<mechanicalReduction>-3.5</mechanicalReduction></transmission>"
    )
    assert read_model(written(tmp_path, chain(pr2))).drives["turn"].ratio == -3.5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DRIVES.format(ros1=50, ros2=60, drake=""), "another reduction than 50"),
        (DRIVES.format(ros1=0, ros2=1, drake=""), "other than zero"),
        (DRIVES.format(ros1="x", ros2=1, drake=""), "other than zero"),
        (DRIVES.format(ros1=1, ros2=1, drake="<drake:rotor_inertia/>"), '"value"'),
        (DRIVES.format(ros1=1, ros2=1, drake='<drake:rotor_inertia value="-1"/>'), "must not be negative"),
        (DRIVES.format(ros1=1, ros2=1, drake='<drake:gear_ratio value="0"/>'), "must not be zero"),
    ],
)
def test_bad_drives(tmp_path: Path, text: str, words: str) -> None:
    assert words in faults_of(written(tmp_path, chain(text)))


def test_coupled_transmissions_are_told_not_read(tmp_path: Path) -> None:
    text = (
        '<transmission name="wrist"><type>transmission_interface/DifferentialTransmission</type><joint name="turn"/>'
        '<joint name="bolt"/><actuator name="m"><mechanicalReduction>9</mechanicalReduction></actuator></transmission>'
    )
    path = written(tmp_path, chain(text))
    assert read_model(path).drives["turn"].ratio is None
    assert any("DifferentialTransmission" in note for note in load_arm(path).notes)
