"""Modern Robotics, exercise 8.12: URDF numbers turned into the book's lists, given to the book's own algorithm."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import modern_robotics as book
import numpy as np
import pytest

from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.files.load import load_arm
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.export.urdf import write_urdf
from drivetrain.spatial.poses import inverse_pose

PAGE = Path(__file__).resolve().parents[2] / "examples" / "chapter8" / "08_urdf.py"


@pytest.fixture(scope="module")
def page() -> ModuleType:
    spec = importlib.util.spec_from_file_location("urdf_page", PAGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("written", [False, True], ids=["as published", "as written"])
def test_the_books_algorithm_agrees_on_the_ur5(page: ModuleType, written: bool, tmp_path: Path) -> None:
    arm = load_arm("ur5")
    path = ROBOTS / "ur5.urdf"
    if written:
        path = tmp_path / "ur5.urdf"
        write_urdf(arm, path)
    steps, tensors, screws = page.chapter_lists(path)
    assert screws == pytest.approx(arm.screws, abs=1e-11)  # the file prints pi/2 to twelve digits
    to_tip = inverse_pose(arm.home[-1]) @ arm.tip
    rng = np.random.default_rng(12)
    for q, qd, qdd in rng.uniform(-2, 2, (5, 3, 6)):
        load = rng.normal(size=6)
        torque = book.InverseDynamics(
            q, qd, qdd, arm.gravity, load, [*steps, to_tip], list(tensors), np.array(screws).T
        )  # fmt: skip
        assert inverse_dynamics(arm, q, qd, qdd, tip_wrench=load) == pytest.approx(torque, abs=1e-10)


def test_ur5_lists_as_the_book_prints_the_arm(page: ModuleType) -> None:
    """Section 4.1.2: W1 = 109 mm, W2 = 82 mm, L1 = 425 mm, L2 = 392 mm, H1 = 89 mm, H2 = 95 mm, seen along -x."""
    _, tensors, screws = page.chapter_lists(ROBOTS / "ur5.urdf")
    h1, h2, l1, l2, w1 = 0.089, 0.095, 0.425, 0.392, 0.109
    printed = [
        [0, 0, 1, 0, 0, 0],
        [0, 1, 0, -h1, 0, 0],
        [0, 1, 0, -h1, 0, l1],
        [0, 1, 0, -h1, 0, l1 + l2],
        [0, 0, -1, -w1, l1 + l2, 0],
        [0, 1, 0, h2 - h1, 0, l1 + l2],
    ]
    assert screws == pytest.approx(np.array(printed), abs=1e-3)
    assert np.diag(tensors[1]) == pytest.approx([0.22689, 0.22689, 0.0151074, 8.393, 8.393, 8.393], abs=1e-5)
