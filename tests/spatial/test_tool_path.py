"""Paths of a tool: lines, arcs, smooth corners, and rates that are the derivatives of the poses."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation, log_rotation
from drivetrain.spatial.tool_path import STRAIGHT, Piece, ToolPath

START = pose(exp_rotation([0.2, -0.1, 0.4]), [0.4, 0.0, 0.3])
CORNER = pose(exp_rotation([1.1, 0.3, 0.4]), [0.4, 0.2, 0.3])
END = pose(exp_rotation([2.6, -1.0, 0.2]), [0.1, 0.3, 0.4])
VIA = np.array([0.2, 0.35, 0.33])


def chain(*blends: float) -> ToolPath:
    pieces = (Piece(START, CORNER), Piece(CORNER, END, VIA), Piece(END, START))
    return ToolPath(pieces[: len(blends) + 1], blends)


def test_rates_are_those_of_the_poses() -> None:
    """By central differences of rotation and position, through line, corner, arc, corner, line; error of order h^2."""
    path, h = chain(0.05, 0.08), 1e-5
    s = np.linspace(0.01, path.length - 0.01, 301)
    here, before, after = path.at(s), path.at(s - h), path.at(s + h)
    turned = [log_rotation(b[:3, :3] @ a[:3, :3].T) for a, b in zip(before.poses, after.poses, strict=True)]
    way = after.poses[:, :3, 3] - before.poses[:, :3, 3]
    assert here.first == pytest.approx(np.hstack([turned, way]) / (2.0 * h), abs=2e-7)
    assert here.second == pytest.approx((after.first - before.first) / (2.0 * h), abs=2e-4)


def test_the_path_goes_from_pose_to_pose_with_roundings_of_the_stated_size() -> None:
    path = chain(0.05, 0.08)
    ends = path.at(np.array([0.0, path.length])).poses
    assert ends == pytest.approx(np.array([START, START]), abs=1e-14)
    sharp, s = ToolPath(path.pieces, (1e-9, 1e-9)), np.linspace(0.0, path.length, 2001)
    off = np.linalg.norm(path.at(s).poses[:, :3, 3] - sharp.at(s).poses[:, :3, 3], axis=1)
    first, second = path.pieces[0].length, path.pieces[0].length + path.pieces[1].length
    rounded = (np.abs(s - first) < 0.05) | (np.abs(s - second) < 0.08)
    assert off[~rounded].max() < 1e-14 and 0.005 < off[rounded].max() < 0.08


def test_rates_are_continuous_at_corners() -> None:
    path = chain(0.05)
    for place in path.pieces[0].length + np.array([-0.05, 0.0, 0.05]):
        low, high = (np.hstack(path.at(np.array([place + side]))[1:]) for side in (-1e-9, 1e-9))
        assert low == pytest.approx(high, abs=1e-4)


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, np.pi, 4.0, 6.0])
def test_an_arc_passes_through_its_middle_point(angle: float) -> None:
    turns = np.array([0.0, 0.4 * angle, angle])
    points = np.stack([1.0 + 0.25 * np.cos(turns), 0.25 * np.sin(turns), np.full(3, 0.5)], axis=1)
    piece = Piece(pose(None, points[0]), pose(None, points[2]), points[1])
    assert piece.length == pytest.approx(0.25 * angle, rel=1e-9)
    there = ToolPath((piece,)).at(np.linspace(0.0, piece.length, 50)).poses[:, :3, 3]
    assert np.linalg.norm(there - [1.0, 0.0, 0.5], axis=1) == pytest.approx(0.25, rel=1e-9)
    assert there[-1] == pytest.approx(points[2], abs=1e-9)


def test_invalid_circles_and_corners_are_errors() -> None:
    line = Piece(START, CORNER, 0.5 * (START[:3, 3] + CORNER[:3, 3]))
    with pytest.raises(InputError, match="no line holds"):
        ToolPath((line,)).length  # noqa: B018
    with pytest.raises(InputError, match="corner 2 leave 262 mm for its rounding"):
        chain(0.15, 0.3)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_what_counts_as_straight_does_not_depend_on_the_size(size: float) -> None:
    """Via is half way and off the chord by ``bend`` of it, so that the sine of the angle at the start is ``2 bend``."""
    for bend, valid in ((2.0 * STRAIGHT, True), (0.2 * STRAIGHT, False)):
        piece = Piece(pose(), pose(None, [size, 0.0, 0.0]), size * np.array([0.5, bend, 0.0]))
        if valid:
            assert piece.length == pytest.approx(size, rel=1e-6)
        else:
            with pytest.raises(InputError, match="no line holds"):
                piece.length  # noqa: B018
