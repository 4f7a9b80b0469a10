"""Moves of the tool in a study: the same as from Python, every rotation, every fault with its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.tool_moves import Move, ToolLimits, tool_motion
from drivetrain.errors import InputError
from drivetrain.motion.point_to_point import MotionLimits
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.spatial.poses import pose, pose_from_xyz_rpy
from drivetrain.spatial.rotations import rotation_from_rpy
from drivetrain.study.model import Study
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

FILE = shipped("examples") / "ur5_pick_and_place" / "drawing.yaml"


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(FILE)


def changed(before: str, after: str) -> str:
    text = FILE.read_text(encoding="utf-8")
    assert before in text
    return text.replace(before, after)


def test_the_pen_draws_what_the_file_says(study: Study) -> None:
    """The chosen drives hold it; the tool, 120 mm before the flange, is on the lines and the arc, pointing down."""
    assert evaluate(study).feasible
    assert study.arm is not None
    pen = tip_pose(study.arm, study.cycle.position)
    place = pen[:, :3, 3] + 0.12 * pen[:, :3, 2]
    drawing = np.abs(place[:, 2] - 0.1) < 1e-9
    assert drawing.sum() > 500
    assert pen[drawing][:, :3, :3] == pytest.approx(
        np.tile(rotation_from_rpy([np.pi, 0.0, 0.0]), (drawing.sum(), 1, 1)), abs=1e-9
    )
    x, y, _ = place[drawing].T
    on_line = (np.abs(x - 0.35) < 1e-9) | (np.abs(y - 0.25) < 1e-9)
    on_arc = np.abs(np.hypot(x - 0.4375, y - 0.1) - 0.1625) < 1e-9
    rounded = (x < 0.38) & (y > 0.22)
    assert (on_line | on_arc | rounded).all() and on_arc.sum() > 100


def test_python_says_the_same(study: Study) -> None:
    assert study.arm is not None
    q = study.cycle.position[0]
    arm = replace(study.arm, tip=study.arm.tip @ pose(None, [0.0, 0.0, 0.12]))
    down = pose_from_xyz_rpy([0.35, 0.0, 0.1], [np.pi, 0.0, 0.0])
    limits = MotionLimits(*np.radians([150.0, 500.0, 5000.0]))
    motion = tool_motion(
        "draw", arm, q, [Move("to", down), Move("line", [0.35, 0.25, 0.1])], profile="s_curve",
        limits=limits, tool=ToolLimits(0.25, 2.0, 20.0),
    )  # fmt: skip
    both = int(
        np.searchsorted(
            motion.time, 0.99 * motion.time[np.argmax(tip_pose(arm, motion.position)[:, 2, 3] < 0.1 + 1e-9)]
        )
    )
    assert study.cycle.position[:both] == pytest.approx(motion.position[:both], abs=1e-12)


@pytest.mark.parametrize(
    "rotation",
    ["quaternion: [0, 1, 0, 0]", "quaternion: [0, 2, 0, 0]", "axis_angle: {axis: [1, 0, 0], angle: 180 deg}"],
)
def test_rotations_in_other_words(study: Study, rotation: str) -> None:
    other = load_study(changed("rpy: [180 deg, 0 deg, 0 deg]", rotation))
    assert other.cycle.position == pytest.approx(study.cycle.position, abs=1e-9)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("start: [0, -90", "# start: [0, -90", "start: is missing: joint positions before the first move"),
        ("profile: s_curve", "profile: trapezoid", "a trapezoid cannot hold a jerk limit"),
        ("rpy: [180 deg, 0 deg, 0 deg]", "rpy: [180, 0, 0]", r"moves\[0\].to.rpy: needs a unit"),
        ("rpy: [180 deg", "quaternion: [1, 0, 0, 0], rpy: [180 deg", "at most one of: rpy, quaternion, axis_angle"),
        ("rpy: [180 deg, 0 deg, 0 deg]", "quaternion: [0, 0, 0, 0]", "quaternion must not be zero"),
        ("blend: 30 mm", "blend: 300 mm", "move 2 to 3: blend: the moves at corner 1 leave 150 mm for its rounding"),
        ("via: [600 mm", "bia: [600 mm", r"moves\[3\].bia: is not known here; did you mean 'via'"),
        (
            "position: [500 mm, -50",
            "position: [1500 mm, -50",
            r"move 4: (goes out of reach|comes to a singular).*at t =",
        ),
        ("speed: 250 mm/s", "speed: 250 deg/s", "tool.speed: must be a speed"),
        ("speed: 250 mm/s", "speed: 0 mm/s", "tool speed: must be above 0"),
        ("joints: [0, -90", "joints: [-90", "must be a list of 6 values"),
    ],
)
def test_faults_have_their_place(before: str, after: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_study(changed(before, after))
