"""Arms written as URDF and read back: all fields, all rotor levels, and what the format cannot represent."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import builtin_names
from drivetrain.arm.coupling import belts_over, differential, placed, rotor_turns, with_coupling
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.files.model import read_model
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.inverse import drive_torques, inverse_dynamics
from drivetrain.errors import InputError, PhysicsWarning
from drivetrain.export.urdf import UrdfJointData, urdf_text, write_urdf
from drivetrain.spatial.poses import exp_pose, pose


def unit(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def random_arm(seed: int, kinds: str = "RPRRRP") -> Arm:
    """An arm with oblique axes, rotated home frames and tip, and limits on some joints."""
    rng = np.random.default_rng(seed)
    n = len(kinds)
    points, axes = rng.uniform(-0.5, 0.5, (n, 3)), [unit(rng) for _ in kinds]
    screws = [
        np.concatenate([a, np.cross(p, a)]) if k == "R" else np.concatenate([np.zeros(3), a])
        for k, p, a in zip(kinds, points, axes, strict=True)
    ]
    spread = [0.01 * a @ a.T for a in rng.normal(size=(n, 3, 3))]
    lower = np.where(np.arange(n) % 3 == 0, -np.inf, rng.uniform(-2, -1, n))
    return Arm.from_screws(
        [exp_pose(rng.normal(size=6)) for _ in kinds],
        screws,
        rng.uniform(0.5, 5.0, n),
        [np.trace(s) * np.eye(3) - s for s in spread],
        exp_pose(rng.normal(size=6)),
        joint_points=points,
        lower=lower,
        upper=np.where(np.arange(n) % 2 == 0, np.inf, rng.uniform(1, 2, n)),
        speed_limits=np.where(np.arange(n) % 2 == 1, np.inf, rng.uniform(1, 2, n)),
        joint_names=[f'joint "{i}" & <more> -- é' for i in range(n)],
        name="made up -->",
    )


def parallel_rotor(arm: Arm, joint: int, rng: np.random.Generator, turn: int) -> Rotor:
    """A balanced rotor parallel or antiparallel to the joint's axis, offset from it, on the previous link."""
    screw = arm.screws[joint]
    axis = turn * (screw[:3] if screw[:3].any() else screw[3:])
    point = arm.joint_points[joint] + rng.uniform(-0.2, 0.2, 3)
    across = np.cross(axis, unit(rng))
    across /= np.linalg.norm(across)
    home = pose(np.column_stack([across, np.cross(axis, across), axis]), point + 0.05 * axis)
    line = np.concatenate([axis, np.cross(point, axis)])
    return Rotor(rng.uniform(30, 120), np.diag([2e-4, 2e-4, 3e-4]), 0.7, home, line)


def again(arm: Arm, folder: Path) -> Arm:
    """The arm written and read back, with the data that URDF cannot represent set afterwards."""
    path = folder / "arm.urdf"
    write_urdf(arm, path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # the warnings were given when the arm was made
        found = load_arm(path, gravity=arm.gravity)
    return at_level(found, arm.level)


def motion(arm: Arm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    return rng.uniform(-3, 3, (6, arm.n)), rng.uniform(-2, 2, (6, arm.n)), rng.uniform(-5, 5, (6, arm.n))


def assert_same_dynamics(found: Arm, arm: Arm, *, motors: float | np.ndarray = 1.0) -> None:
    """Torques agree to 1e-12 of the largest; ``motors`` is the sign of each motor's direction."""
    q, qd, qdd = motion(arm)
    load = np.random.default_rng(8).normal(size=6) * 10.0
    wanted = inverse_dynamics(arm, q, qd, qdd, tip_wrench=load)
    assert inverse_dynamics(found, q, qd, qdd, tip_wrench=load) == pytest.approx(
        wanted, abs=1e-12 * np.abs(wanted).max()
    )
    drives, others = drive_torques(arm, q, qd, qdd), drive_torques(found, q, qd, qdd)
    # Shafts of coupled motors may have the opposite sign, but not their effect on the joints.
    gear, other = (d.gear if a.coupling is None else d.gear @ a.coupling for a, d in ((arm, drives), (found, others)))
    assert other == pytest.approx(gear, abs=1e-12 * np.abs(gear).max())
    assert motors * others.motor == pytest.approx(drives.motor, abs=1e-12 * np.abs(drives.motor).max())


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_arms_read_back_as_they_were(name: str, tmp_path: Path) -> None:
    arm = load_arm(name)
    found = again(arm, tmp_path)
    assert found.joint_names == arm.joint_names and found.link_names == arm.link_names and found.name == arm.name
    for field in ("home", "screws", "inertias", "tip", "joint_points"):
        # Rounding of products of n frames.
        assert getattr(found, field) == pytest.approx(getattr(arm, field), abs=4e-15), field
    assert np.array_equal(found.masses, arm.masses)
    for field in ("lower", "upper", "speed_limits"):
        assert np.array_equal(getattr(found, field), getattr(arm, field)), field
    assert [r and r.axial_inertia for r in found.rotors] == [r and r.axial_inertia for r in arm.rotors]
    assert rotor_turns(found) == pytest.approx(rotor_turns(arm), rel=1e-15)
    assert_same_dynamics(found, arm)


@pytest.mark.parametrize("seed", range(4))
def test_made_up_arms_read_back_as_they_were(seed: int, tmp_path: Path) -> None:
    arm = random_arm(seed)
    found = again(arm, tmp_path)
    q = motion(arm)[0]
    assert tip_pose(found, q) == pytest.approx(tip_pose(arm, q), abs=1e-13)
    assert found.joint_points == pytest.approx(arm.joint_points, abs=1e-14)
    assert found.joint_names == arm.joint_names
    for field in ("lower", "upper", "speed_limits"):
        assert np.array_equal(getattr(found, field), getattr(arm, field)), field
    assert_same_dynamics(found, arm)


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("seed", range(3))
def test_parallel_rotors_beside_their_joints_are_kept_whole(seed: int, level: RotorLevel, tmp_path: Path) -> None:
    rng = np.random.default_rng(100 + seed)
    bare = random_arm(seed)
    turns = rng.choice([-1, 1], bare.n)
    arm = with_rotors(bare, [parallel_rotor(bare, i, rng, t) for i, t in enumerate(turns)], level=level)
    found = again(arm, tmp_path)
    if level is RotorLevel.NONE:
        q, qd, qdd = motion(arm)
        wanted = inverse_dynamics(arm, q, qd, qdd)
        assert inverse_dynamics(found, q, qd, qdd) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
        ratios = [drive.ratio for drive in read_model(tmp_path / "arm.urdf").drives.values()]
        assert ratios == [t * r.ratio for t, r in zip(turns, arm.rotors, strict=True)]
        return
    # A rotor that turns in the opposite direction has a negative ratio about the joint's axis.
    assert_same_dynamics(found, arm, motors=turns)


def test_first_rotor_may_have_any_pose_on_the_base(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    bare, axis = random_arm(1, "RRR"), unit(rng)
    oblique = Rotor(80.0, np.eye(3) * 2e-4, 1.0, None, np.concatenate([axis, np.cross([0.1, 0.2, 0.3], axis)]))
    arm = with_rotors(bare, [oblique, None, None])
    assert_same_dynamics(again(arm, tmp_path), arm)


PAIRS = {
    "differential": differential(1.0, 1.68),
    "differential, the other way round": np.array([[1.0, -1.0 / 1.68], [-1.0, -1.0 / 1.68]]),
    "differential of unlike wheels": np.array([[0.7, 1.2], [1.4, -2.4]]),
    "belt": belts_over([1.0]),
    "belt of unlike wheels": np.array([[2.0, 0.0], [-0.3, 0.8]]),
    "belt from the far end": np.array([[1.5, 0.4], [0.0, 1.0]]),
}


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("kind", PAIRS)
def test_couplings_of_two_motors_with_two_joints(kind: str, level: RotorLevel, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    bare = random_arm(4, "RPRRR")
    # Joints 1 and 3 are not adjacent; the shaft of joint 4 turns in the opposite direction.
    matrix = placed(PAIRS[kind], (0, 2), 5) @ np.diag([1.0, 1.0, 1.0, 1.0, -2.0])
    rotors = [parallel_rotor(bare, i, rng, 1) for i in range(5)]
    arm = with_rotors(bare, rotors, level=level, coupling=matrix)
    found = again(arm, tmp_path)
    q, qd, qdd = motion(arm)
    wanted = inverse_dynamics(arm, q, qd, qdd)
    assert inverse_dynamics(found, q, qd, qdd) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
    if level is not RotorLevel.NONE:
        turns = rotor_turns(arm)
        assert rotor_turns(found) == pytest.approx(turns, rel=1e-12)
        motors = drive_torques(arm, q, qd, qdd).motor
        assert drive_torques(found, q, qd, qdd).motor == pytest.approx(motors, abs=1e-12 * np.abs(motors).max())


def test_transmissions_as_ros_control_defines_them(tmp_path: Path) -> None:
    """The formulas of ros_control with the numbers of the written file."""
    bare = random_arm(4, "RR")
    matrix = np.array([[1.0, -1.0 / 1.68], [-1.0, -1.0 / 1.68]])
    arm = with_rotors(bare, [Rotor(28.25, 1e-4, carrier=-1)] * 2, level=RotorLevel.REFLECTED, coupling=matrix)
    write_urdf(arm, tmp_path / "arm.urdf")
    text = (tmp_path / "arm.urdf").read_text(encoding="utf-8")
    assert text.count("transmission_interface/DifferentialTransmission") == 1
    joint = [float(x) for x in re.findall(r"<role>joint.</role>\s*<mechanicalReduction>(.*?)<", text)]
    motor = [float(x) for x in re.findall(r"<role>actuator.</role>\s*<mechanicalReduction>(.*?)<", text)]
    q = np.array([0.3, -0.8])
    turned = [motor[0] * (joint[0] * q[0] + joint[1] * q[1]), motor[1] * (joint[0] * q[0] - joint[1] * q[1])]
    assert turned == pytest.approx(rotor_turns(arm) @ q, rel=1e-14)


def test_other_couplings_are_noted_or_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(10)
    bare = random_arm(5, "RRR")
    rotors = [parallel_rotor(bare, i, rng, 1) for i in range(3)]
    arm = with_rotors(bare, rotors, coupling=belts_over([1.0, 1.0]))
    with pytest.raises(InputError, match="no words for"):
        urdf_text(arm)
    locked = at_level(arm, RotorLevel.NONE)
    notes = write_urdf(locked, tmp_path / "arm.urdf")
    assert sum("no words for" in note for note in notes) == 1
    q, qd, qdd = motion(arm)
    wanted = inverse_dynamics(locked, q, qd, qdd)
    assert inverse_dynamics(again(locked, tmp_path), q, qd, qdd) == pytest.approx(wanted, abs=1e-12 * wanted.max())
    direct = with_coupling(bare, np.diag([1.0, 2.0, 1.0]))
    assert any("no words for" in note for note in write_urdf(direct, tmp_path / "arm.urdf"))
    spun = write_urdf(at_level(arm, RotorLevel.REFLECTED), tmp_path / "arm.urdf")
    assert any("inertia of their spin left out" in note for note in spun)


def test_ratio_without_inertia_is_kept(tmp_path: Path) -> None:
    arm = with_rotors(random_arm(2), [Rotor(-50.0, 0.0)] * 6)
    assert_same_dynamics(again(arm, tmp_path), arm)


def awkward_rotors(arm: Arm) -> list[Rotor | None]:
    axis = unit(np.random.default_rng(6))
    return [
        None,
        Rotor(80.0, 2e-4, 0.5, None, np.concatenate([axis, np.zeros(3)])),  # oblique
        Rotor(80.0, np.diag([1e-4, 2e-4, 2.5e-4]), 0.5),  # uneven
        Rotor(80.0, 2e-4, 0.5, pose(point=arm.joint_points[3] + 0.1)),  # off its axis
        Rotor(80.0, 2e-4, 0.5, carrier=-1),
        Rotor(80.0, 2e-4, 0.5, carrier=5),
    ]


def test_rotors_that_urdf_cannot_hold_are_refused_all_at_once() -> None:
    bare = random_arm(3)
    with pytest.raises(InputError) as error:
        urdf_text(with_rotors(bare, awkward_rotors(bare)))
    message = str(error.value)
    assert len(error.value.faults) == 5
    for word in ("not parallel", "not balanced", "by the base", "by link_6", "at_level"):
        assert word in message


@pytest.mark.parametrize("level", [RotorLevel.REFLECTED, RotorLevel.NONE])
def test_awkward_rotors_are_written_reflected_or_locked(level: RotorLevel, tmp_path: Path) -> None:
    bare = random_arm(3)
    arm = with_rotors(bare, awkward_rotors(bare), level=level)
    found = again(arm, tmp_path)
    q, qd, qdd = motion(arm)
    wanted = inverse_dynamics(arm, q, qd, qdd)
    assert inverse_dynamics(found, q, qd, qdd) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
    assert any(f"level {level.value}" in note for note in write_urdf(arm, tmp_path / "noted.urdf"))


def test_link_without_inertia_cannot_spare_a_rotors(tmp_path: Path) -> None:
    bare = replace(random_arm(0, "RRR"), inertias=np.zeros((3, 3, 3)))
    arm = with_rotors(bare, [None, Rotor(80.0, 2e-4, carrier=-1), None], level=RotorLevel.REFLECTED)
    with pytest.raises(InputError, match="too little inertia"):
        urdf_text(arm)


def test_helical_joints_are_refused() -> None:
    arm = random_arm(0)
    screws = arm.screws.copy()
    screws[2, 3:] += 0.02 * screws[2, :3]
    with pytest.raises(InputError, match=r"helical.*0\.02 m/rad"):
        urdf_text(replace(arm, screws=screws))


def test_what_is_not_in_the_format_stands_in_notes_and_comments(tmp_path: Path) -> None:
    arm = replace(random_arm(0), gravity=np.array([0.0, 0.0, -1.62]), joint_points=np.ones((6, 3)))
    arm = replace(arm, lower=np.full(6, 0.5), upper=np.full(6, 0.5), notes=("seen -- here",))
    notes = write_urdf(arm, tmp_path / "arm.urdf")
    text = (tmp_path / "arm.urdf").read_text(encoding="utf-8")
    for word in ("-1.62 m/s^2", "joint points moved", "limit agree"):
        assert sum(word in note for note in notes) == 1
    assert "-1.62 m/s^2" in text and "limit agree" in text
    assert "note: seen - - here" in text
    assert write_urdf(load_arm("ur5"), tmp_path / "plain.urdf") == ()


def test_writing_again_gives_the_same_names_and_frames(tmp_path: Path) -> None:
    first = again(random_arm(1), tmp_path)
    second = again(first, tmp_path)
    assert second.link_names == first.link_names and second.joint_names == first.joint_names
    assert second.home == pytest.approx(first.home, abs=1e-14)


def test_names_of_the_ends() -> None:
    arm = replace(random_arm(0, "RRR"), link_names=("base_link", "tool0", "c"))
    text = urdf_text(arm)
    assert '<link name="base_link_" />' in text and '<link name="tool0_" />' in text
    assert '<link name="world" />' in urdf_text(arm, base="world", tip="hand")
    with pytest.raises(InputError, match="moving link"):
        urdf_text(arm, tip="c")
    with pytest.raises(InputError, match="another name"):
        urdf_text(arm, tip="x", base="x")


def test_data_that_an_arm_does_not_hold(tmp_path: Path) -> None:
    arm = random_arm(0, "RRR")
    data = UrdfJointData(effort=[1.0, 2.0, 3.0], damping=[0.1, 0.2, 0.3], friction=[4.0, 5.0, 6.0])
    write_urdf(arm, tmp_path / "arm.urdf", data=data)
    drives = read_model(tmp_path / "arm.urdf").drives
    assert [(d.damping, d.friction) for d in drives.values()] == [(0.1, 4.0), (0.2, 5.0), (0.3, 6.0)]
    assert 'effort="2"' in (tmp_path / "arm.urdf").read_text(encoding="utf-8")
    with pytest.raises(InputError) as error:
        urdf_text(arm, data=UrdfJointData(effort=[1.0], damping=[np.nan] * 3))
    assert len(error.value.faults) == 2


def test_a_failure_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text("old", encoding="utf-8")
    with pytest.raises(InputError):
        write_urdf(random_arm(0), path, tip="link_1")
    assert path.read_text(encoding="utf-8") == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["arm.urdf"]
    write_urdf(random_arm(0), tmp_path / "new" / "arm.urdf")
    assert (tmp_path / "new" / "arm.urdf").is_file()
    with pytest.raises(InputError, match="cannot be written"):
        write_urdf(random_arm(0), path / "below_a_file.urdf")
    with pytest.raises(InputError, match="cannot be written"):
        write_urdf(random_arm(0), tmp_path)
