"""Arms on tracks and on bases that move: closed forms, and pinocchio with the same base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio
import pytest

import drivetrain as dt
from drivetrain.arm.bodies import on_moving_base
from drivetrain.dynamics.inverse import drive_torques, inverse_dynamics


def samples(n, count=6, seed=2):
    rng = np.random.default_rng(seed)
    return [scale * rng.uniform(-1.0, 1.0, (count, n)) for scale in (1.0, 2.0, 5.0)]


def geared():
    arm = dt.load_arm("puma560")
    rotors = [dt.Rotor(60.0 + i, 2e-4, mass=0.3, carrier=-1 if i == 1 else None) for i in range(6)]
    return dt.with_rotors(arm, rotors)


def test_base_at_rest_changes_nothing():
    arm = geared()
    q, qd, qdd = samples(6)
    wide = [np.hstack([np.zeros((6, 6)), values]) for values in (q, qd, qdd)]
    for name in ("gear", "motor"):
        own, found = (
            getattr(one, name) for one in (drive_torques(arm, q, qd, qdd), drive_torques(on_moving_base(arm), *wide))
        )
        np.testing.assert_allclose(found[:, 6:], own, rtol=1e-12, atol=1e-12)


def test_accelerating_base_is_another_gravity():
    """Einstein's lift: a base that accelerates by a, and gravity less a."""
    arm, push = geared(), np.array([1.5, -2.0, 3.0])
    q, qd, qdd = samples(6)
    base = np.zeros((6, 6))
    base[:, :3] = push
    wide = [np.hstack([np.zeros((6, 6)), q]), np.hstack([np.zeros((6, 6)), qd]), np.hstack([base, qdd])]
    lifted = inverse_dynamics(replace(arm, gravity=arm.gravity - push), q, qd, qdd)
    np.testing.assert_allclose(inverse_dynamics(on_moving_base(arm), *wide)[:, 6:], lifted, rtol=1e-11, atol=1e-11)


def test_turning_base_throws_a_slide_outwards():
    """A mass on a radial slide of a turning base: m (a - w^2 r), and the base bears 2 m r v w + m r^2 dw about z."""
    home, mass, r, v, a, w, dw = np.eye(4), 3.0, 0.8, 0.5, 1.1, 2.0, 0.7
    arm = dt.Arm.from_screws([home], [[0, 0, 0, 1, 0, 0]], [mass], [np.zeros((3, 3))])
    at = [np.array([*np.zeros(6), r]), np.array([0, 0, 0, w, 0, 0, v]), np.array([0, 0, 0, dw, 0, 0, a])]
    torque = inverse_dynamics(on_moving_base(arm), *at)
    assert torque[6] == pytest.approx(mass * (a - w**2 * r), rel=1e-12)
    assert torque[3] == pytest.approx(2 * mass * r * v * w + mass * r**2 * dw, rel=1e-12)


def test_any_motion_of_the_base_against_pinocchio():
    """The same chain in pinocchio, its base on three slides and three hinges."""
    arm = dt.load_arm("ur5")
    model, whole = pinocchio.Model(), on_moving_base(arm)
    model.gravity.linear = arm.gravity
    kinds = [*"XYZ", "yaw", "pitch", "roll"]
    made = {
        "X": pinocchio.JointModelPX, "Y": pinocchio.JointModelPY, "Z": pinocchio.JointModelPZ,
        "yaw": pinocchio.JointModelRZ, "pitch": pinocchio.JointModelRY, "roll": pinocchio.JointModelRX,
    }  # fmt: skip
    parent, place = 0, np.zeros(3)
    for kind in kinds:
        parent = model.addJoint(parent, made[kind](), pinocchio.SE3.Identity(), kind)
    for i, screw in enumerate(arm.screws):
        here = arm.joint_points[i]
        joint = pinocchio.JointModelRevoluteUnaligned(screw[:3])
        parent = model.addJoint(parent, joint, pinocchio.SE3(np.eye(3), here - place), arm.joint_names[i])
        rotation = arm.home[i, :3, :3]
        tensor = rotation @ arm.inertias[i] @ rotation.T
        body = pinocchio.Inertia(arm.masses[i], arm.home[i, :3, 3] - here, tensor)
        model.appendBodyToJoint(parent, body, pinocchio.SE3.Identity())
        place = here
    data = model.createData()
    for q, qd, qdd in zip(*samples(12, seed=7), strict=True):
        found = inverse_dynamics(whole, q, qd, qdd)
        np.testing.assert_allclose(found, pinocchio.rnea(model, data, q, qd, qdd), rtol=1e-9, atol=1e-9)


def test_a_track_is_a_first_joint_that_slides():
    """An arm on a track: the force that accelerates it, and at the arm's joints another gravity."""
    arm = dt.load_arm("ur5")
    track = dt.Arm.from_screws(
        [np.eye(4), *arm.home],
        [[0, 0, 0, 0, 1, 0], *arm.screws],
        [40.0, *arm.masses],
        [np.eye(3), *arm.inertias],
        arm.tip,
    )
    q, rest = np.concatenate([[0.0], samples(6)[0][0]]), np.zeros(7)
    pushed = inverse_dynamics(track, q, rest, np.eye(7)[0] * 2.0)
    assert pushed[0] == pytest.approx(2.0 * (40.0 + arm.masses.sum()), rel=1e-12)
    lifted = replace(arm, gravity=arm.gravity - np.array([0.0, 2.0, 0.0]))
    np.testing.assert_allclose(pushed[1:], inverse_dynamics(lifted, q[1:], rest[1:], rest[1:]), rtol=1e-10, atol=1e-10)
