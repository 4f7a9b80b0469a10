"""Denavit-Hartenberg tables: both conventions against products of the textbook matrices, and against each other."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.dh import DHConvention, DHRow, JointKind, arm_from_dh
from drivetrain.errors import InputError
from drivetrain.spatial.poses import exp_pose, pose
from drivetrain.spatial.rotations import exp_rotation


def classic_matrix(a: float, alpha: float, d: float, theta: float) -> np.ndarray:
    """Written out as in Spong, Hutchinson and Vidyasagar, equation 3.10."""
    ct, st, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
    return np.array([[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1.0]])


def modified_matrix(a: float, alpha: float, d: float, theta: float) -> np.ndarray:
    """Written out as in Craig, Introduction to Robotics, equation 3.6."""
    ct, st, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
    return np.array([[ct, -st, 0, a], [st * ca, ct * ca, -sa, -sa * d], [st * sa, ct * sa, ca, ca * d], [0, 0, 0, 1.0]])


MATRIX = {DHConvention.CLASSIC: classic_matrix, DHConvention.MODIFIED: modified_matrix}


def random_rows(rng: np.random.Generator, n: int = 6) -> list[DHRow]:
    kinds = [JointKind.REVOLUTE, JointKind.PRISMATIC]
    return [
        DHRow(*rng.normal(size=4), kind=kinds[int(rng.integers(2))], mass=1.0 + i, com=rng.normal(size=3))
        for i in range(n)
    ]


def frames(rows: list[DHRow], q: np.ndarray, convention: DHConvention) -> list[np.ndarray]:
    frame, found = np.eye(4), []
    for row, value in zip(rows, q, strict=True):
        theta = row.theta + (value if row.kind is JointKind.REVOLUTE else 0.0)
        d = row.d + (value if row.kind is JointKind.PRISMATIC else 0.0)
        frame = frame @ MATRIX[convention](row.a, row.alpha, d, theta)
        found.append(frame)
    return found


def moved(arm: Arm, q: np.ndarray, link: int, home: np.ndarray) -> np.ndarray:
    """Product of exponentials, links 0 to ``link``."""
    for screw, value in zip(arm.screws[link::-1], q[link::-1], strict=True):
        home = exp_pose(screw * value) @ home
    return home


@pytest.mark.parametrize("convention", list(DHConvention))
@pytest.mark.parametrize("seed", range(5))
def test_kinematics_are_the_textbooks(convention: DHConvention, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = random_rows(rng)
    base = pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))
    tool = pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))
    arm = arm_from_dh(rows, convention=convention, base=base, tool=tool)
    q = rng.normal(size=6)
    wanted = frames(rows, q, convention)
    assert moved(arm, q, 5, arm.tip) == pytest.approx(base @ wanted[-1] @ tool, abs=1e-13)
    for i, row in enumerate(rows):
        assert moved(arm, q, i, arm.home[i]) == pytest.approx(base @ wanted[i] @ pose(point=row.com), abs=1e-13)


def test_classic_and_modified_describe_one_arm() -> None:
    """The same geometry in both tables: a and alpha move one row down, and the last ones into the tool."""
    rng = np.random.default_rng(9)
    a, alpha, d, theta = rng.normal(size=(4, 4))
    classic = [DHRow(a[i], alpha[i], d[i], theta[i], mass=1.0) for i in range(4)]
    modified = [DHRow(a[i - 1] if i else 0.0, alpha[i - 1] if i else 0.0, d[i], theta[i], mass=1.0) for i in range(4)]
    tool = pose(exp_rotation([alpha[3], 0, 0]), [a[3], 0, 0])
    one = arm_from_dh(classic, convention=DHConvention.CLASSIC)
    other = arm_from_dh(modified, convention=DHConvention.MODIFIED, tool=tool)
    assert one.screws == pytest.approx(other.screws, abs=1e-14)
    assert one.tip == pytest.approx(other.tip, abs=1e-14)


def test_the_wrong_convention_gives_another_arm() -> None:
    rows = [DHRow(0.4, pi / 2, 0.1), DHRow(0.3, 0.2, 0.0)]
    one = arm_from_dh(rows, convention=DHConvention.CLASSIC)
    other = arm_from_dh(rows, convention=DHConvention.MODIFIED)
    assert np.abs(one.tip - other.tip).max() > 0.05


def test_inertia_is_in_the_link_frame() -> None:
    tensor = np.array([[0.3, 0.01, 0.02], [0.01, 0.2, 0.03], [0.02, 0.03, 0.4]])
    arm = arm_from_dh([DHRow(1.0, 0.3, 0.2, 0.4, mass=2.0, inertia=tensor)], convention=DHConvention.CLASSIC)
    assert np.array_equal(arm.inertias[0], tensor)
    assert arm.home[0] == pytest.approx(classic_matrix(1.0, 0.3, 0.2, 0.4))


def test_convention_and_numbers_must_be_right() -> None:
    with pytest.raises(TypeError):
        arm_from_dh([DHRow(1, 0, 0)])  # type: ignore[call-arg]
    with pytest.raises(InputError, match="classic or modified"):
        arm_from_dh([DHRow(1, 0, 0)], convention="paul")  # type: ignore[arg-type]
    with pytest.raises(InputError) as error:
        arm_from_dh(
            [DHRow(np.nan, 0, 0), DHRow(1, 0, 0, kind="screw"), DHRow(1, 0, 0, com=[0, 0])],  # type: ignore[arg-type]
            convention=DHConvention.CLASSIC,
        )
    assert len(error.value.faults) == 3
