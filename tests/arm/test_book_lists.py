"""Arms to the book's lists and back."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.lists import arm_from_lists, book_lists
from drivetrain.errors import InputError
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import inverse_pose, pose
from drivetrain.spatial.rotations import exp_rotation


def test_there_and_back() -> None:
    arm = load_arm("ur5-corrected")
    found = arm_from_lists(*book_lists(arm), arm.gravity)
    np.testing.assert_array_equal(found.scale, np.ones(6))
    for name in ("home", "screws", "masses", "inertias", "tip", "gravity"):
        assert getattr(found.arm, name) == pytest.approx(getattr(arm, name), abs=1e-15)


def test_frames_off_the_centres_of_mass_and_longer_screws() -> None:
    """The same arm, its link frames turned and moved about, its screws stretched."""
    rng = np.random.default_rng(0)
    arm = load_arm("ur5-corrected")
    lists = book_lists(arm)
    shifts = [np.eye(4), *(pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3) * 0.1) for _ in range(6))]
    poses = [inverse_pose(a) @ m @ b for a, m, b in zip(shifts[:6], lists.Mlist[:6], shifts[1:], strict=True)]
    poses.append(inverse_pose(shifts[6]) @ lists.Mlist[6])
    inertias = [
        RigidBody(m, np.zeros(3), tensor).spatial_inertia(inverse_pose(shift))
        for m, tensor, shift in zip(arm.masses, arm.inertias, shifts[1:], strict=True)
    ]
    stretch = np.array([1.0, 2.0, 0.5, 3.0, 1.0, 0.1])
    found = arm_from_lists(poses, inertias, lists.Slist * stretch)
    assert found.scale == pytest.approx(stretch)
    assert found.arm.screws == pytest.approx(arm.screws, abs=1e-14)
    assert found.arm.home[:, :3, 3] == pytest.approx(arm.home[:, :3, 3], abs=1e-14)
    assert found.arm.tip == pytest.approx(arm.tip, abs=1e-14)
    for k in range(6):
        turn, wanted = found.arm.home[k, :3, :3], arm.home[k, :3, :3]
        assert turn @ found.arm.inertias[k] @ turn.T == pytest.approx(wanted @ arm.inertias[k] @ wanted.T, abs=1e-14)


def test_rotors_have_no_place() -> None:
    with pytest.raises(InputError, match=r"rotors\[1\]"):
        book_lists(load_arm("planar-2r"))
    assert len(book_lists(with_rotors(load_arm("planar-2r"), [None, None])).Mlist) == 3


def test_massless_links_are_allowed() -> None:
    lists = book_lists(load_arm("ur5-corrected"))
    inertias = lists.Glist.copy()
    inertias[2] = 0.0
    assert arm_from_lists(lists.Mlist, inertias, lists.Slist).arm.masses[2] == 0.0
    inertias[2, 0, 4], inertias[2, 4, 0] = 0.1, 0.1
    with pytest.raises(InputError, match=r"Glist\[2\]"):
        arm_from_lists(lists.Mlist, inertias, lists.Slist)
