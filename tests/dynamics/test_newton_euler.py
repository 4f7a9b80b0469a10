"""Inverse dynamics: samples and batches, checks of input, large angles, drive torques and joint wrenches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.inverse import drive_torques, inverse_dynamics, joint_loads
from drivetrain.errors import InputError


@pytest.fixture(scope="module")
def arm() -> Arm:
    bare = random_arm(21, EVERY_JOINT)
    return with_rotors(bare, rotors_of(21, "mixed", bare.n))


def test_nothing_is_written_back(arm: Arm) -> None:
    inputs = [*motion(24, arm.n, 5), np.ones((5, 6))]
    copies = [value.copy() for value in inputs]
    joint_loads(arm, *inputs[:3], tip_wrench=inputs[3])
    for value, copy in zip(inputs, copies, strict=True):
        np.testing.assert_array_equal(value, copy)


@given(st.integers(0, 2), st.integers(0, 5), st.sampled_from([np.nan, np.inf]))
def test_nan_and_infinity_are_never_missed(field: int, joint: int, value: float) -> None:
    sample = [np.zeros(6), np.zeros(6), np.zeros(6)]
    sample[field][joint] = value
    # Joint 0 has a vertical axis, so its angle has no effect on any torque.
    upright = Arm.from_screws(
        [np.eye(4)] * 6, [[0, 0, 1.0, 0, 0, 0]] * 6, [1.0] * 6, [np.eye(3)] * 6, joint_points=np.zeros((6, 3))
    )
    with pytest.raises(InputError):
        inverse_dynamics(upright, *sample)


def test_wrong_shapes_are_all_named(arm: Arm) -> None:
    n, good = arm.n, np.zeros(arm.n)
    with pytest.raises(InputError) as caught:
        inverse_dynamics(arm, np.zeros(n + 1), good, np.zeros((2, 2, n)))
    assert [fault.place for fault in caught.value.faults] == ["q", "qdd"]
    with pytest.raises(InputError) as caught:
        inverse_dynamics(arm, good, "fast", good)
    assert [fault.place for fault in caught.value.faults] == ["qd"]
    with pytest.raises(InputError) as caught:
        inverse_dynamics(arm, np.zeros((3, n)), np.zeros((4, n)), good)
    assert [fault.place for fault in caught.value.faults] == ["qd", "qdd"]
    with pytest.raises(InputError, match="tip_wrench"):
        inverse_dynamics(arm, good, good, good, tip_wrench=np.zeros(5))
    with pytest.raises(InputError, match=r"tip_wrench.*N = 3"):
        inverse_dynamics(arm, *[np.zeros((3, n))] * 3, tip_wrench=np.zeros((2, 6)))
    with pytest.raises(InputError, match="tip_wrench"):
        inverse_dynamics(arm, good, good, good, tip_wrench=[0, 0, np.nan, 0, 0, 0])


@pytest.mark.parametrize("size", [1e2, 1e5, 1e7])
def test_rotor_angles_far_from_zero(size: float) -> None:
    """The gravity torque of an unbalanced rotor on the base is that at its own angle, ratio times the joint's."""
    offset = np.eye(4)
    offset[:3, 3] = [0.05, 0.02, 0.0]
    rotor = Rotor(100.0, np.diag([1e-3, 2e-3, 2.5e-3]), 0.5, home=offset, screw=[0.6, 0.0, 0.8, 0.0, 0.1, 0.0])
    arm = with_rotors(Arm.from_screws([np.eye(4)], [[0, 0, 1, 0, 0, 0]], [1.0], [np.eye(3)]), [rotor])
    # Integers, so that a hundred times them is exact.
    q = np.round(np.random.default_rng(27).uniform(-size, size, (70, 1)))
    near = np.arctan2(np.sin(100.0 * q), np.cos(100.0 * q)) / 100.0
    rates = np.ones_like(q)
    found, wanted = (drive_torques(arm, x, rates, rates).motor for x in (q, near))
    assert np.ptp(found) > 0.01
    assert error(found, wanted) < 1e-13


def test_drive_torques_of_a_direct_drive_are_the_joint_torques() -> None:
    arm = random_arm(28, EVERY_JOINT)
    q, qd, qdd = motion(28, arm.n)
    drives = drive_torques(arm, q, qd, qdd)
    torque = inverse_dynamics(arm, q, qd, qdd)
    np.testing.assert_array_equal(drives.gear, torque)
    np.testing.assert_array_equal(drives.motor, torque)


def test_wrench_carries_the_weight_behind_the_joint() -> None:
    """At rest the joint carries the weight of all links after it; z of a vertical joint's frame is up."""
    home = np.eye(4)
    home[:3, 3] = [0.5, 0.0, 0.3]
    arm = Arm.from_screws([home], [[0, 0, 1, 0, 0, 0]], [2.0], [np.zeros((3, 3))], joint_points=[[0, 0, 0.1]])
    still = np.zeros(1)
    loads = joint_loads(arm, [0.0], still, still)
    np.testing.assert_allclose(loads.wrench, [[0, -2 * 9.81 * 0.5, 0, 0, 0, 2 * 9.81]], atol=1e-14)
    # The frame rotates with the link, so the angle has no effect; the reaction of the tip wrench is opposite.
    pushed = joint_loads(arm, [0.7], still, still, tip_wrench=[0, 0, 0, 0, 0, -2 * 9.81])
    np.testing.assert_allclose(pushed.wrench, np.zeros((1, 6)), atol=1e-14)


def test_wrench_moves_with_a_prismatic_joint() -> None:
    """The frame moves with a prismatic joint, so the lever arm of the weight is constant."""
    home = np.eye(4)
    home[:3, 3] = [0.0, 0.0, 0.4]
    arm = Arm.from_screws([home], [[0, 0, 0, 1, 0, 0]], [3.0], [np.zeros((3, 3))], joint_points=[[0, 0, 0]])
    still = np.zeros(1)
    for q in (0.0, 1.5):
        loads = joint_loads(arm, [q], still, [2.0])
        # For a joint axis along x, the frame's z is the base's x, its x the base's -z, its y the base's y.
        np.testing.assert_allclose(loads.wrench[0], [0, 0.4 * 3 * 2.0, 0, -3 * 9.81, 0, 3 * 2.0], atol=1e-13)
        np.testing.assert_allclose(loads.torque, [6.0], rtol=1e-14)
