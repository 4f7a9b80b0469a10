"""Inverse kinematics and motions of a tool, against forward kinematics of another library and written-out geometry."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import random_arm

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.kinematics import tip_jacobian, tip_pose
from drivetrain.arm.pose_solver import inverse_kinematics
from drivetrain.arm.tool_moves import Move, ToolLimits, tool_motion
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.motion.point_to_point import MotionLimits
from drivetrain.motion.profiles import Quintic, SCurve, Trapezoid
from drivetrain.spatial.rotations import exp_rotation

START = np.array([0.1, -1.2, 1.4, -1.7, -1.5, 0.3])
TOOL = ToolLimits(speed=0.25, acceleration=2.0, jerk=20.0)


@pytest.fixture(scope="module")
def ur5() -> Arm:
    return load_arm("ur5")


def place(arm: Arm, q: np.ndarray = START) -> np.ndarray:
    return np.array(tip_pose(arm, q)[:3, 3])


def steps(motion: Motion) -> np.ndarray:
    return np.diff(motion.time)[:, None]


def hangs_together(motion: Motion) -> None:
    """Positions, speeds and accelerations are each other's derivatives: Simpson-like sums, error of order h^4."""
    h = steps(motion)
    gained = 0.5 * h * (motion.velocity[1:] + motion.velocity[:-1])
    gained -= h**2 / 12.0 * np.diff(motion.acceleration, axis=0)
    assert gained == pytest.approx(np.diff(motion.position, axis=0), abs=2e-8)


@pytest.mark.parametrize("name", ["ur5", "puma560"])
def test_the_arm_is_where_it_is_wanted_by_another_library(name: str) -> None:
    arm, random = load_arm(name), np.random.default_rng(3)
    twin = InPinocchio(arm, rotors=False)
    for _ in range(10):
        q = np.clip(random.uniform(-1.5, 1.5, arm.n), arm.lower, arm.upper)
        wanted = tip_pose(arm, q)
        found = inverse_kinematics(arm, wanted, q + random.uniform(-0.4, 0.4, arm.n))
        pin.forwardKinematics(twin.model, twin.data, found)
        moved = twin.data.oMi[arm.n].homogeneous
        pin.forwardKinematics(twin.model, twin.data, np.zeros(arm.n))
        there = moved @ np.linalg.inv(twin.data.oMi[arm.n].homogeneous) @ arm.tip
        assert there == pytest.approx(wanted, abs=1e-10)
        assert ((found >= arm.lower) & (found <= arm.upper)).all()


def test_two_links_by_the_law_of_cosines() -> None:
    arm = load_arm("planar-2r")
    target = np.array([0.9, 0.8, 0.0])
    elbow = np.arccos((target @ target - 2.0) / 2.0)
    for side in (-1.0, 1.0):
        shoulder = np.arctan2(0.8, 0.9) - side * np.arctan2(np.sin(elbow), 1.0 + np.cos(elbow))
        wanted = np.eye(4)
        wanted[:3, 3] = target
        found = inverse_kinematics(arm, wanted, [0.3, side * 0.5], rotation=False)
        assert found == pytest.approx([shoulder, side * elbow], abs=1e-10)


def test_what_is_out_of_reach_says_how_far() -> None:
    wanted = np.eye(4)
    wanted[:3, 3] = [2.5, 0.0, 0.0]
    with pytest.raises(InputError, match="misses it by 500 mm"):
        inverse_kinematics(load_arm("planar-2r"), wanted, [0.3, 0.5], rotation=False)


def test_a_line_is_straight_and_no_quicker_than_said(ur5: Arm) -> None:
    a, move = place(ur5), np.array([-0.1, 0.25, 0.1])
    turned = tip_pose(ur5, START)
    turned[:3, :3] = exp_rotation([0.0, 0.0, 0.6]) @ turned[:3, :3]
    turned[:3, 3] = a + move
    for profile in (Trapezoid(), SCurve(), Quintic()):
        motion = tool_motion("line", ur5, START, [Move("line", turned)], profile=profile, tool=TOOL if profile !=
                             Trapezoid() else ToolLimits(0.25, 2.0))  # fmt: skip
        poses = tip_pose(ur5, motion.position)
        way = poses[:, :3, 3] - a
        along = way @ move / np.linalg.norm(move)
        assert np.linalg.norm(way - along[:, None] * move / np.linalg.norm(move), axis=1).max() < 1e-9
        assert poses[-1] == pytest.approx(turned, abs=1e-9)
        jacobian = tip_jacobian(ur5, motion.position)
        speed = np.linalg.norm((jacobian @ motion.velocity[:, :, None])[:, 3:, 0], axis=1)
        assert speed.max() == pytest.approx(0.25, rel=1e-6)  # half a metre is enough to reach it
        assert np.abs(np.diff(along)[steps(motion)[:, 0] > 0] / steps(motion)[steps(motion) > 0]).max() < 0.25 + 1e-6
        hangs_together(motion)


def test_a_circle_is_round_and_its_pull_is_limited(ur5: Arm) -> None:
    a = place(ur5)
    end, via = np.add(a, [0.0, 0.3, 0.0]), np.add(a, [-0.15, 0.15, 0.0])
    motion = tool_motion("arc", ur5, START, [Move("circle", end, via)], profile=Trapezoid(), tool=ToolLimits(1.0, 1.5))
    centre = np.add(a, [0.0, 0.15, 0.0])
    way = tip_pose(ur5, motion.position)[:, :3, 3] - centre
    assert np.linalg.norm(way, axis=1) == pytest.approx(0.15, abs=1e-9)
    velocity = (tip_jacobian(ur5, motion.position) @ motion.velocity[:, :, None])[:, 3:, 0]
    along = np.linalg.norm(velocity, axis=1)
    h = steps(motion)[:, 0]
    pull = np.diff(along)[h > 0] / h[h > 0]
    across = (0.5 * (along[1:] + along[:-1]))[h > 0] ** 2 / 0.15
    assert np.hypot(pull, across).max() == pytest.approx(1.5, rel=0.01)
    hangs_together(motion)


def test_a_rounded_corner_does_not_stop_the_tool(ur5: Arm) -> None:
    a = place(ur5)
    corner, end = np.add(a, [-0.2, 0.0, 0.0]), np.add(a, [-0.2, 0.2, 0.0])
    moves = [Move("line", corner, blend=0.05), Move("line", end, dwell=0.1)]
    motion = tool_motion("corner", ur5, START, moves, profile=SCurve(), tool=TOOL)
    running = (motion.time > 0.3) & (motion.time < motion.time[-1] - 0.4)
    velocity = (tip_jacobian(ur5, motion.position) @ motion.velocity[:, :, None])[:, 3:, 0]
    assert np.linalg.norm(velocity[running], axis=1).min() > 0.1
    nearest = np.linalg.norm(tip_pose(ur5, motion.position)[:, :3, 3] - corner, axis=1).min()
    assert nearest == pytest.approx(0.05 * 0.1875 * np.sqrt(2.0), rel=1e-3)  # both shares at u = 1/2
    hangs_together(motion)


def test_joints_slow_a_path_that_is_too_quick_for_them(ur5: Arm) -> None:
    moves = [Move("line", np.add(place(ur5), [-0.3, 0.2, 0.0]))]
    free = tool_motion("free", ur5, START, moves, profile=SCurve(), tool=TOOL)
    limit = 0.5 * np.abs(free.velocity).max()
    held = tool_motion("held", ur5, START, moves, profile=SCurve(), tool=TOOL, limits=MotionLimits(speed=limit))
    assert np.abs(held.velocity).max() == pytest.approx(limit, rel=1e-5)
    assert held.time[-1] == pytest.approx(2.0 * free.time[-1], rel=1e-3)
    assert any("2 times slower" in note and "speed of joint" in note for note in held.notes)


def test_a_redundant_arm_moves_as_its_rates_say() -> None:
    arm = random_arm(4, "RRRRRRR")
    q = np.array([0.3, 0.7, -0.4, 1.1, 0.5, -0.8, 0.2])
    a = place(arm, q)
    motion = tool_motion("line", arm, q, [Move("line", np.add(a, [0.02, -0.03, 0.02]))], profile=Quintic(), tool=TOOL)
    assert tip_pose(arm, motion.position)[-1, :3, 3] == pytest.approx(np.add(a, [0.02, -0.03, 0.02]), abs=1e-9)
    hangs_together(motion)


def test_poses_and_joints_between(ur5: Arm) -> None:
    a = place(ur5)
    moves = [Move("to", np.add(a, [0.0, 0.1, -0.1])), Move("joints", START)]
    motion = tool_motion("there", ur5, START, moves, profile=SCurve(), limits=MotionLimits(2.0, 8.0, 80.0))
    assert motion.position[-1] == pytest.approx(START, abs=1e-12)
    turning = int(np.argmax(np.linalg.norm(motion.position - START, axis=1)))
    assert place(ur5, motion.position[turning]) == pytest.approx(np.add(a, [0.0, 0.1, -0.1]), abs=1e-9)


@pytest.mark.parametrize(
    ("moves", "words"),
    [
        ([Move("line", [1.5, 0.4, 0.4])], r"move 1: goes out of reach at t = .* s of it, after .* mm, tool at \["),
        ([Move("to", [1.5, 0.4, 0.4])], r"move 1: pose: at \[1500, 400, 400\] mm is out of reach"),
        ([Move("line", [0.4, 0.2, 0.4], blend=0.1)], "move 1: blend: rounds the corner"),
        ([Move("circle", [0.4, 0.2, 0.4])], "move 1: via: a circle needs a point between"),
        ([Move("wave", [0.4, 0.2, 0.4])], "move 1: must be one of: joints, to, line, circle"),  # type: ignore[arg-type]
        ([], "needs at least one move"),
    ],
)
def test_what_cannot_be_is_one_clear_message(ur5: Arm, moves: list[Move], words: str) -> None:
    with pytest.raises(InputError, match=words):
        tool_motion("m", ur5, START, moves, profile=Trapezoid(), tool=ToolLimits(0.25, 2.0))


def test_a_line_through_a_singular_pose_says_where() -> None:
    """The elbow of two equal links stretches as the tip passes the circle's rim; through the base it folds."""
    arm = load_arm("planar-2r")
    q = np.array([0.4, 2.4])
    a = place(arm, q)
    with pytest.raises(InputError, match=r"comes to a singular pose.* at t = .* s of it, after") as caught:
        tool_motion("m", arm, q, [Move("line", -a)], profile=Trapezoid(), tool=ToolLimits(0.25, 2.0))
    after = float(str(caught.value).split("after ")[1].split(" mm")[0])
    assert after == pytest.approx(1e3 * np.hypot(*a[:2]), rel=0.01)  # at the base itself
