"""The recursion's frames and constants for difficult geometry."""

from __future__ import annotations

import numpy as np
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotation

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.core.packed import link_frames, packed
from drivetrain.dynamics.inverse import inverse_dynamics


def check(arm: Arm) -> None:
    q, qd, qdd = motion(30, arm.n)
    twin = InPinocchio(arm, rotors=False)
    wanted = np.array([twin.torques(*sample)[0] for sample in zip(q, qd, qdd, strict=True)])
    assert error(inverse_dynamics(arm, q, qd, qdd), wanted) < 1e-13


def along(axes: np.ndarray, points: np.ndarray) -> Arm:
    rng = np.random.default_rng(31)
    n = len(axes)
    home = np.tile(np.eye(4), (n, 1, 1))
    home[:, :3, :3] = [rotation(rng) for _ in axes]
    home[:, :3, 3] = points + rng.uniform(-0.1, 0.1, (n, 3))
    screws = np.hstack([axes, np.cross(points, axes)])
    return Arm.from_screws(home, screws, np.ones(n), [np.eye(3) * 0.01] * n, joint_points=points)


@pytest.mark.parametrize("tilt", [0.0, 1e-16, 1e-13, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_nearly_parallel_axes(tilt: float, turned: float) -> None:
    """Common normals of such axes are far away or undefined; these frames do not need them."""
    axes = np.array([[0, 0, 1.0], [tilt, 0, turned], [0, tilt, 1.0], [1.0, 0, 0], [1.0, tilt, -tilt]])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    points = np.array([[0, 0, 0], [0.4, 0, 0.1], [0.8, 0.1, 0.0], [0.9, 0, 0], [1.2, 0.1, 0.1]])
    check(along(axes, points))


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
def test_frames_are_rotations_on_the_axes(joints: str) -> None:
    arm = random_arm(32, joints)
    frames = link_frames(arm)
    for frame in frames:
        assert np.abs(frame[:3, :3].T @ frame[:3, :3] - np.eye(3)).max() < 4e-16
        assert np.linalg.det(frame[:3, :3]) == pytest.approx(1.0)
    np.testing.assert_allclose(frames[1:, :3, 2], arm.axes, atol=1e-15)
    across = np.sum(frames[1:-1, :3, 0] * arm.axes[1:], axis=1)
    assert np.abs(across).max() < 1e-15
    np.testing.assert_allclose(frames[1:, :3, 3], arm.joint_points, atol=1e-15)


def test_joint_points_off_the_axis_are_brought_onto_it() -> None:
    arm = random_arm(33)
    q, qd, qdd = motion(33, 6)
    moved = Arm.from_screws(
        arm.home, arm.screws, arm.masses, arm.inertias, arm.tip, arm.gravity, joint_points=arm.joint_points + 0.05
    )
    assert error(inverse_dynamics(moved, q, qd, qdd), inverse_dynamics(arm, q, qd, qdd)) < 1e-13


def test_far_from_the_base_frame() -> None:
    """A base frame 100 m away costs digits: squares of 1e2 m, where the result depends on 1e-1 m."""
    arm = random_arm(34)
    shift = np.array([100.0, -50.0, 30.0])
    home = arm.home.copy()
    home[:, :3, 3] += shift
    screws = arm.screws.copy()
    screws[:, 3:] += np.cross(shift, screws[:, :3])
    far = Arm.from_screws(
        home, screws, arm.masses, arm.inertias, gravity=arm.gravity, joint_points=arm.joint_points + shift
    )
    q, qd, qdd = motion(34, 6)
    assert error(inverse_dynamics(far, q, qd, qdd), inverse_dynamics(arm, q, qd, qdd)) < 1e-12


def test_an_arm_is_packed_once() -> None:
    arm = random_arm(35)
    assert packed(arm) is packed(arm)


def test_the_usual_rotor_needs_no_record_of_its_own() -> None:
    bare = random_arm(36, "RRPR")
    usual = with_rotors(bare, [Rotor(100, 1e-4, 0.3)] * 4)
    # Only the rotor of the prismatic joint, whose carrier rotates, has an own record.
    assert packed(usual).rotors.tolist() == [(2, 1, 1)]
    for level in (RotorLevel.NONE, RotorLevel.REFLECTED):
        assert len(packed(with_rotors(bare, usual.rotors, level=level)).rotors) == 0
    elsewhere = with_rotors(bare, [Rotor(100, 1e-4, 0.3, carrier=3), None, None, Rotor(100, np.eye(3), carrier=-1)])
    assert packed(elsewhere).rotors.tolist() == [(0, 3, 1)]
    uneven = with_rotors(bare, [Rotor(100, np.diag([1.0, 2.0, 2.5])), None, None, None])
    assert packed(uneven).rotors.tolist() == [(0, -1, 0)]
