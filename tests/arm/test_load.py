"""One door for names and files."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import drivetrain as dt
from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import with_body
from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.rotors import MountedRotor
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError, PhysicsWarning

DATA = Path(__file__).with_name("data")
DRIVEN = """<robot name="one" xmlns:drake="http://drake.mit.edu">
<link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/></joint>
<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="1" velocity="1"/></joint>
<joint name="lift" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/></joint>
<transmission name="t"><joint name="turn"/><actuator name="m">
  <drake:rotor_inertia value="2e-5"/><drake:gear_ratio value="-80"/></actuator></transmission>
<transmission name="s"><joint name="slide"/><actuator name="m"><mechanicalReduction>628</mechanicalReduction>
  <drake:rotor_inertia value="3e-5"/></actuator></transmission>
<transmission name="l"><joint name="lift"/><actuator name="m">
  <drake:rotor_inertia value="1e-5"/></actuator></transmission>
</robot>"""


def test_names_and_paths_are_told_apart() -> None:
    assert load_arm("ur5").name == "ur5"
    assert load_arm(DATA / "ur10.urdf").name == "ur10"
    assert load_arm(str(DATA / "ur10.urdf"), tip="ee_link").tip[0, 3] > 1
    assert dt.load_arm("planar-2r", gravity=[0, 0, 0]).gravity.tolist() == [0, 0, 0]


def test_unknown_names_are_told_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'ur5'"):
        load_arm("ur-5")
    with pytest.raises(InputError, match="no such file"):
        load_arm("nowhere/arm.urdf")


@pytest.mark.parametrize(("name", "words"), [("arm.csv", r"dh: .*convention: classic"), ("arm.yaml", "load_study")])
def test_tables_and_studies_are_not_read_as_robot_files(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / name).write_text("name,a [m]\nj1,0.3\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        load_arm(tmp_path / name)


def test_doubts_of_a_file_warn_at_the_callers_line() -> None:
    for load in (load_arm, dt.load_arm):
        with pytest.warns(PhysicsWarning, match="wrist") as caught:
            load(ROBOTS / "ur5.urdf")
        assert caught[0].filename == __file__


def test_stated_rotors_are_mounted_and_told(tmp_path: Path) -> None:
    path = tmp_path / "one.urdf"
    path.write_text(DRIVEN)
    arm = load_arm(path)
    turn, slide, lift = arm.rotors
    assert isinstance(turn, MountedRotor) and isinstance(slide, MountedRotor)
    assert (turn.ratio, turn.axial_inertia, turn.carrier, turn.mass) == (-80.0, 2e-5, -1, 0.0)
    assert (slide.ratio, slide.axial_inertia, slide.carrier) == (628.0, 3e-5, 0)
    assert np.array_equal(slide.screw[:3], [1, 0, 0])
    assert lift is None
    assert any("turn, slide" in note for note in arm.notes)
    assert any("not used: lift" in note for note in arm.notes)


XACRO = """<robot name="made" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="reach" value="0.25"/><xacro:macro name="rod" params="name"><link name="${name}"/></xacro:macro>
<xacro:rod name="base"/><xacro:rod name="arm"/><xacro:rod name="tool0"/>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="end" type="fixed"><parent link="arm"/><child link="tool0"/><origin xyz="${2*reach} 0 0"/></joint>
</robot>"""


@pytest.mark.parametrize("name", ["made.xacro", "made.urdf.xacro"])
def test_xacro_files_are_expanded(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(XACRO)
    assert load_arm(path).tip[0, 3] == 0.5


def test_xacro_faults_and_absence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "bad.xacro"
    path.write_text(XACRO.replace("2*reach", "2*reech"))
    with pytest.raises(InputError, match="cannot expand"):
        load_arm(path)
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(InputError, match=r"drivetrain\[xacro\]"):
        load_arm(path)


PAIR = """
    <transmission name="pair"><type>transmission_interface/{kind}</type>
      <joint name="lift"><role>joint2</role><offset>0.5</offset>{second}</joint>
      <joint name="turn"><role>joint1</role><mechanicalReduction>2</mechanicalReduction></joint>
      <actuator name="b"><role>actuator2</role><mechanicalReduction>-30</mechanicalReduction>
        <drake:rotor_inertia value="3e-5"/><drake:gear_ratio value="-30"/></actuator>
      <actuator name="a"><role>actuator1</role>{first}</actuator></transmission>"""
FIRST = '<mechanicalReduction>20</mechanicalReduction><drake:rotor_inertia value="2e-5"/>'
SECOND = "<mechanicalReduction>0.5</mechanicalReduction>"


def pair_arm(folder: Path, text: str) -> Arm:
    joint = '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><axis xyz="0 0 1"/></joint>'
    chain = "".join(joint.format(n, p, c) for n, p, c in (("turn", "a", "b"), ("slide", "b", "c"), ("lift", "c", "d")))
    path = folder / "pair.urdf"
    path.write_text("<robot name='r'>" + "".join(f'<link name="{x}"/>' for x in "abcd") + chain + text + "</robot>")
    return load_arm(path)


@pytest.mark.parametrize(
    ("kind", "turns"),
    [
        # ros_control: x_a1 = n_a1 (n_j1 x_j1 + n_j2 x_j2), x_a2 = n_a2 (n_j1 x_j1 - n_j2 x_j2)
        ("DifferentialTransmission", [[40, 10], [-60, 15]]),
        # x_a1 = n_j1 n_a1 x_j1, x_a2 = n_a2 (x_j1 + n_j2 x_j2)
        ("FourBarLinkageTransmission", [[40, 0], [-30, -15]]),
    ],
)
def test_pairs_of_ros_control_are_coupled(tmp_path: Path, kind: str, turns: list[list[float]]) -> None:
    arm = pair_arm(tmp_path, PAIR.format(kind=kind, first=FIRST, second=SECOND))
    assert rotor_turns(arm)[np.ix_([0, 2], [0, 2])] == pytest.approx(np.array(turns, dtype=float))
    assert [r and r.axial_inertia for r in arm.rotors] == [2e-5, None, 3e-5]
    assert any("turn and lift coupled" in note for note in arm.notes)
    assert any("<offset> (1)" in note for note in arm.notes)


def test_pairs_that_cannot_be_read_are_told(tmp_path: Path) -> None:
    no_reduction = pair_arm(tmp_path, PAIR.format(kind="DifferentialTransmission", first="", second=SECOND))
    assert no_reduction.coupling is None and any("not read" in note for note in no_reduction.notes)
    text = PAIR.format(kind="FourBarLinkageTransmission", first=FIRST, second="")
    twice = pair_arm(tmp_path, text + text.replace('"pair"', '"again"'))
    assert twice.coupling[2, 2] == 1.0 and any("not used" in note for note in twice.notes)
    zero = PAIR.format(kind="DifferentialTransmission", first=FIRST, second=SECOND.replace("0.5", "0"))
    with pytest.raises(InputError, match="other than zero"):
        pair_arm(tmp_path, zero)


@pytest.mark.parametrize("source", [None, 5, b"ur5"])
def test_what_is_no_name_or_path_is_told(source: object) -> None:
    with pytest.raises(InputError, match="built-in arm"):
        load_arm(source)


def test_a_hand_behind_the_tip_is_told() -> None:
    """What the file holds behind the tip stays, and the notes say what and how much."""
    path = ROBOTS / "panda.urdf"
    cut, whole = load_arm(path, tip="panda_link8"), load_arm(path, tip="panda_hand_tcp")
    note = next(note for note in cut.notes if "behind the tip" in note)
    assert "panda_hand" in note and "0.76 kg" in note and "panda_link7" in note
    assert not any("behind the tip" in note for note in whole.notes if "finger" not in note)
    assert cut.masses[-1] == whole.masses[-1]


def test_link_frames_are_those_of_the_file() -> None:
    """Against pinocchio's placements of the same joints."""
    path = ROBOTS / "panda.urdf"
    arm, model = load_arm(path, tip="panda_hand_tcp"), pin.buildModelFromUrdf(str(path))
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    base = arm.link_frame(arm.link_names[0]) @ np.linalg.inv(data.oMi[1].homogeneous)
    for i, name in enumerate(arm.link_names):
        np.testing.assert_allclose(arm.link_frame(name), base @ data.oMi[i + 1].homogeneous, atol=1e-12)
        np.testing.assert_array_equal(arm.link_frame(arm.joint_names[i]), arm.link_frame(name))
    pin.updateFramePlacements(model, data)
    for name in ("panda_link0", "panda_link8", "panda_hand", "panda_hand_tcp"):  # fixed to another, or to the base
        np.testing.assert_allclose(arm.link_frame(name), data.oMf[model.getFrameId(name)].homogeneous, atol=1e-12)
        assert arm.link_index(name) == (-1 if name == "panda_link0" else 6)
    with pytest.raises(InputError, match="panda_hand"):
        arm.link_frame("pnada_hand")
    with pytest.raises(InputError, match=arm.link_names[0]):
        arm.link_frame(arm.link_names[0] + "x")


@pytest.mark.filterwarnings("ignore::drivetrain.errors.PhysicsWarning")  # of the published UR5's wrists
def test_a_body_given_in_the_frame_of_a_flange() -> None:
    """A sensor about ``ee_link``, which a fixed joint holds: pinocchio has the same mass matrix with it."""
    path, place = ROBOTS / "ur5.urdf", pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.5), np.array([0.01, 0.02, -0.03]))
    arm, model = load_arm(path), pin.buildModelFromUrdf(str(path))
    frame = arm.link_frame("ee_link") @ place.homogeneous
    loaded = with_body(arm, arm.link_index("ee_link"), 1.5, frame[:3, 3], np.zeros((3, 3)))
    held = model.frames[model.getFrameId("ee_link")]
    body = pin.Inertia(1.5, np.zeros(3), np.zeros((3, 3)))
    model.appendBodyToJoint(held.parentJoint, body, held.placement * place)
    q = np.linspace(-1.0, 1.5, 6)
    np.testing.assert_allclose(mass_matrix(loaded, q), pin.crba(model, model.createData(), q), atol=1e-12)
