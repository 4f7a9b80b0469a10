"""Agreement with pinocchio on the same numbers, to 1e-10 of the largest value."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import body_jacobian, link_poses, space_jacobian, tip_pose
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.derivatives import coriolis_matrix
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import drive_torques, gravity_torque, inverse_dynamics, joint_loads
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.spatial.rotations import frame_along

TOLERANCE = 1e-10  # asked for; what is found is some 1e-14
SEEDS = range(5)
ARMS = ["RRRRRR", "RRRRRRR", "RPRPR", "PRRP", "HRPH", EVERY_JOINT, "R", "P", "PPP"]


@pytest.mark.parametrize("joints", ARMS)
@pytest.mark.parametrize("seed", SEEDS)
def test_without_rotors(seed: int, joints: str) -> None:
    arm = random_arm(seed, joints)
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=(len(q), 6)) * 20
    twin = InPinocchio(arm)
    model, data = twin.model, twin.data
    wanted = [pin.rnea(model, data, *sample) for sample in zip(q, qd, qdd, strict=True)]
    assert error(inverse_dynamics(arm, q, qd, qdd), np.array(wanted)) < TOLERANCE
    loaded = [twin.torques(*sample)[0] for sample in zip(q, qd, qdd, tip, strict=True)]
    assert error(inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip), np.array(loaded)) < TOLERANCE
    held = [pin.computeGeneralizedGravity(model, data, x) for x in q]
    assert error(gravity_torque(arm, q), np.array(held)) < TOLERANCE
    masses = [np.triu(m) + np.triu(m, 1).T for m in (pin.crba(model, data, x) for x in q)]
    assert error(mass_matrix(arm, q), np.array(masses)) < TOLERANCE
    bias = [pin.computeCoriolisMatrix(model, data, x, v) @ v for x, v in zip(q, qd, strict=True)]
    assert error(np.einsum("kij,kj->ki", coriolis_matrix(arm, q, qd), qd), np.array(bias)) < TOLERANCE
    free = [pin.aba(model, data, x, v, t) for x, v, t in zip(q, qd, wanted, strict=True)]
    # Both solve with a matrix whose condition number is up to 1e5 here.
    assert error(forward_dynamics(arm, q, qd, wanted), np.array(free)) < TOLERANCE


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "HRPH", "P"])
@pytest.mark.parametrize("kind", ["coaxial", "balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("seed", SEEDS)
def test_rotors_as_bodies(seed: int, kind: str, joints: str) -> None:
    bare = random_arm(seed, joints)
    arm = with_rotors(bare, rotors_of(seed, kind, bare.n))
    q, qd, qdd = motion(seed, arm.n)
    tip = np.random.default_rng(seed).normal(size=6) * 20
    twin = InPinocchio(arm)
    wanted = np.array([twin.torques(*sample, tip) for sample in zip(q, qd, qdd, strict=True)])
    found = drive_torques(arm, q, qd, qdd, tip_wrench=tip)
    assert error(found.gear, wanted[:, 0]) < TOLERANCE
    assert error(found.motor, wanted[:, 1]) < TOLERANCE
    ratios = [1.0 if rotor is None else rotor.ratio for rotor in arm.rotors]
    assert error(inverse_dynamics(arm, q, qd, qdd, tip_wrench=tip), wanted[:, 1] * ratios) < TOLERANCE


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
@pytest.mark.parametrize("seed", SEEDS)
def test_joint_loads(seed: int, joints: str) -> None:
    bare = random_arm(seed, joints)
    arm = with_rotors(bare, rotors_of(seed, "mixed", bare.n))
    q, qd, qdd = motion(seed, arm.n)
    twin = InPinocchio(arm)
    loads = joint_loads(arm, q, qd, qdd)
    drives = drive_torques(arm, q, qd, qdd)
    np.testing.assert_array_equal(loads.gear, drives.gear)
    np.testing.assert_allclose(loads.motor, drives.motor, rtol=1e-15)
    np.testing.assert_array_equal(loads.torque, inverse_dynamics(arm, q, qd, qdd))
    for k, sample in enumerate(zip(q, qd, qdd, strict=True)):
        twin.torques(*sample)
        pin.forwardKinematics(twin.model, twin.data, *(twin.spread(values) for values in sample))
        wrenches, carried = np.zeros((arm.n, 6)), np.zeros(arm.n)
        for i, joint in enumerate(twin.ids[1:]):
            axis = arm.screws[i, :3] if arm.screws[i, :3].any() else arm.screws[i, 3:]
            turn = frame_along(axis).T
            wrenches[i] = np.concatenate([turn @ twin.data.f[joint].angular, turn @ twin.data.f[joint].linear])
            carried[i] = axis @ twin.data.a[twin.ids[i]].angular if i else 0.0
        assert error(loads.wrench[k], wrenches) < TOLERANCE
        assert error(loads.carrier_acceleration[k], carried) < TOLERANCE


def test_locked_rotors_are_parts_of_their_carriers() -> None:
    for seed in SEEDS:
        bare = random_arm(seed, EVERY_JOINT)
        rotors = rotors_of(seed, "mixed", bare.n)
        arm = with_rotors(bare, rotors, level=RotorLevel.NONE)
        q, qd, qdd = motion(seed, arm.n)
        twin = InPinocchio(arm)
        full = []
        for sample in zip(q, qd, qdd, strict=True):
            spread = [twin.spread(x) for x in sample]
            for values in spread:
                for joint in twin.rotor_ids.values():
                    values[twin.model.joints[joint].idx_v] = 0.0
            torque = pin.rnea(twin.model, twin.data, *spread)
            full.append([torque[twin.model.joints[j].idx_v] for j in twin.ids[1:]])
        assert error(inverse_dynamics(arm, q, qd, qdd), np.array(full)) < TOLERANCE
        axial = np.array([0.0 if r is None else r.axial_inertia * r.ratio**2 for r in arm.rotors])
        reflected = inverse_dynamics(at_level(arm, RotorLevel.REFLECTED), q, qd, qdd)
        assert error(reflected, np.array(full) + axial * qdd) < TOLERANCE


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
@pytest.mark.parametrize("seed", SEEDS)
def test_kinematics(seed: int, joints: str) -> None:
    arm = random_arm(seed, joints)
    q, _, _ = motion(seed, arm.n)
    twin = InPinocchio(arm)
    model, data = twin.model, twin.data
    tip = model.addFrame(pin.Frame("tip", twin.ids[-1], 0, _place(arm, arm.tip), pin.FrameType.OP_FRAME))
    data = model.createData()
    for k, sample in enumerate(q):
        pin.computeJointJacobians(model, data, sample)
        pin.updateFramePlacements(model, data)
        assert error(tip_pose(arm, sample), data.oMf[tip].homogeneous) < TOLERANCE
        homes = [data.oMi[j].homogeneous @ _home(arm, i) for i, j in enumerate(twin.ids[1:])]
        assert error(link_poses(arm, q)[k], np.array(homes)) < TOLERANCE
        for frame, ours in ((pin.WORLD, space_jacobian), (pin.LOCAL, body_jacobian)):
            theirs = pin.getFrameJacobian(model, data, tip, frame)
            assert error(ours(arm, q)[k], np.vstack([theirs[3:], theirs[:3]])) < TOLERANCE


def _place(arm: object, pose: np.ndarray) -> pin.SE3:
    return pin.SE3(pose[:3, :3], pose[:3, 3] - arm.joint_points[-1])


def _home(arm: object, link: int) -> np.ndarray:
    result = arm.home[link].copy()
    result[:3, 3] -= arm.joint_points[link]
    return result
