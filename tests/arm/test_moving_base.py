"""Arms on tracks and on bases that move: closed forms, and pinocchio with the same base."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pinocchio
import pytest

import drivetrain as dt
from drivetrain.arm.bodies import on_external_axes, on_moving_base
from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.closures import LoopLink
from drivetrain.arm.kinematics import tip_pose
from drivetrain.dynamics.inverse import drive_torques, inverse_dynamics
from drivetrain.errors import InputError


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


TRACK = LoopLink("track", [0, 1, 0], [0, 0, 0.1], 60.0, [0.1, 0.2, 0.1], np.diag([2.0, 1.0, 2.0]), slides=True)
TABLE = LoopLink("table", [0, 0.6, 0.8], [0.1, 0.2, 0.3], 20.0, [0.1, 0.25, 0.25], np.diag([0.5, 0.4, 0.8]))
STANDS = ([0.3, -0.1, 0.4], [0.1, 0.2, 1.0])  # m, rad


@pytest.mark.filterwarnings("ignore::drivetrain.errors.PhysicsWarning")  # of the published UR5's wrists
def test_a_track_and_a_table_under_an_arm_against_pinocchio(tmp_path):
    """The same axes written into the arm's file as links of it: torques, tip, frames, with the arm set askew."""
    text = (ROBOTS / "ur5.urdf").read_text(encoding="utf-8")
    text, feet = re.subn(r'(<link name="base_link">.*?)<inertial>.*?</inertial>', r"\1", text, count=1, flags=re.S)
    assert feet == 1  # the arm's foot is no part of an Arm
    links, joints, before = "", "", "ground"
    for one, kind, at in ((TRACK, "prismatic", TRACK.point), (TABLE, "continuous", TABLE.point - TRACK.point)):
        xx, yy, zz = np.diag(one.inertia)
        links += f"""<link name="{one.joint}"><inertial><origin xyz="{" ".join(map(str, one.com - one.point))}"/>
            <mass value="{one.mass}"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/>
            </inertial></link>"""
        joints += f"""<joint name="{one.joint}_axis" type="{kind}"><parent link="{before}"/><child link="{one.joint}"/>
            <origin xyz="{" ".join(map(str, at))}"/><axis xyz="{" ".join(map(str, one.axis))}"/>
            <limit lower="-9" upper="9" effort="1" velocity="1"/></joint>"""
        before = one.joint
    place, turn = (" ".join(map(str, values)) for values in (STANDS[0] - TABLE.point, STANDS[1]))
    joints += f"""<joint name="stand" type="fixed"><parent link="table"/><child link="world"/>
        <origin xyz="{place}" rpy="{turn}"/></joint>"""
    path = tmp_path / "whole.urdf"
    path.write_text(text.replace("</robot>", f'<link name="ground"/>{links}{joints}</robot>'))
    model = pinocchio.buildModelFromUrdf(str(path))
    data, whole = model.createData(), on_external_axes(dt.load_arm("ur5"), [TRACK, TABLE], *STANDS)
    assert whole.joint_names[:2] == ("track", "table") and whole.link_index("base_link") == 1
    rng = np.random.default_rng(12)
    for q, qd, qdd in rng.uniform(-2.0, 2.0, (6, 3, 8)):
        pinocchio.framesForwardKinematics(model, data, pinocchio.integrate(model, pinocchio.neutral(model), q))
        there = data.oMf[model.getFrameId("tool0")].homogeneous
        np.testing.assert_allclose(tip_pose(whole, q), there, atol=1e-12)
        wanted = pinocchio.rnea(model, data, pinocchio.integrate(model, pinocchio.neutral(model), q), qd, qdd)
        np.testing.assert_allclose(inverse_dynamics(whole, q, qd, qdd), wanted, rtol=1e-10, atol=1e-10)
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    for name in ("base_link", "forearm_link", "ee_link"):
        frame = data.oMf[model.getFrameId(name)].homogeneous
        np.testing.assert_allclose(whole.link_frame(name), frame, atol=1e-12)
    origins = [data.oMi[i + 1].translation for i in range(whole.n)]
    np.testing.assert_allclose(whole.joint_points, origins, atol=1e-12)


def test_rotors_of_an_arm_go_with_it_onto_a_track():
    """The track at rest and the arm askew: its torques are those of the arm alone, weight turned into its base."""
    rotors = [dt.Rotor(100, 2e-5, mass=0.5)] * 6
    geared = dt.with_coupling(dt.with_rotors(dt.load_arm("ur5-corrected"), rotors), _belt())
    whole = on_external_axes(geared, [TRACK], *STANDS)
    turn = dt.spatial.rotation_from_rpy(STANDS[1])
    alone = replace(geared, gravity=turn.T @ geared.gravity)
    for q, qd, qdd in np.random.default_rng(3).uniform(-2.0, 2.0, (5, 3, 6)):
        still = [np.concatenate([[0.0], one]) for one in (q, qd, qdd)]
        found, wanted = drive_torques(whole, *still), drive_torques(alone, q, qd, qdd)
        np.testing.assert_allclose(found.gear[1:], wanted.gear, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(found.motor[1:], wanted.motor, rtol=1e-10, atol=1e-10)


def _belt():
    """The last joint's motor turns with the one before, as by a belt."""
    matrix = np.eye(6)
    matrix[5, 4] = 1.0
    return matrix


def test_a_study_with_a_track():
    """What moves it is all that it carries; names, places and what is missing are told."""
    time = np.linspace(0.0, 2.0, 201)
    q = np.zeros((201, 7))
    q[:, 0], q[:, 1:] = 0.5 * np.sin(np.pi * time) ** 2, [0.0, -1.2, 1.4, -1.7, -1.5, 0.0]
    link = {"joint": "track", "kind": "prismatic", "axis": [0, 1, 0], "point": [0.0, 0.0, 0.2], "mass": 60.0}
    axes = {"links": [link], "point": [0.0, 0.0, 0.4], "rpy": [0.0, 0.0, "90 deg"]}
    given = {
        "motion": (time, q),
        "drive_mass": "included",
        "supply": "48 V",
        "joints": {"track": {"travel_per_turn": 0.02}},
    }
    study = dt.study(arm="ur5", external_axes=axes, **given)
    assert [task.name for task in study.joints][:2] == ["track", "shoulder_pan_joint"]
    whole = study.arm.masses.sum()
    force = inverse_dynamics(study.arm, study.cycle.position, study.cycle.velocity, study.cycle.acceleration)[:, 0]
    np.testing.assert_allclose(force, whole * study.cycle.acceleration[:, 0], atol=1e-9 * np.abs(force).max())
    assert whole == pytest.approx(60.0 + dt.load_arm("ur5").masses.sum())
    for wrong, told in (
        ({"links": [link | {"joint": "elbow_joint"}]}, "elbow_joint"), ({"links": []}, "links"),
        ({"links": [link | {"axis": [0, 0, 0]}]}, "axis"), (axes | {"pont": [0, 0, 0]}, "point"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=told):
            dt.study(arm="ur5", external_axes=wrong, **given)
