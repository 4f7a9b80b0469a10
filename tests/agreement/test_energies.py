"""Energies, Coriolis matrix and tip Jacobian against pinocchio, whose rotors are bodies on joints of their own."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.kinematics import tip_acceleration_terms, tip_jacobian
from drivetrain.dynamics.book.ellipsoids import tip_force_ellipsoid
from drivetrain.dynamics.derivatives import christoffel_symbols, coriolis_matrix
from drivetrain.dynamics.energy import kinetic_energy, potential_energy

KINDS = ("coaxial", "balanced", "unbalanced", "mixed")


def geared(seed: int, kind: str) -> Arm:
    bare = random_arm(seed, EVERY_JOINT)
    return with_rotors(bare, rotors_of(seed, kind, bare.n))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_energies_with_rotors(seed: int, kind: str) -> None:
    arm = geared(seed, kind)
    other = InPinocchio(arm)
    q, qd, _ = motion(seed, arm.n, 4)
    kinetic, potential = kinetic_energy(arm, q, qd), potential_energy(arm, q)
    for sample in range(4):
        at, speed = other.spread(q[sample]), other.spread(qd[sample])
        # Sines of rotor angles up to 500 rad lose three digits.
        assert kinetic[sample] == pytest.approx(pin.computeKineticEnergy(other.model, other.data, at, speed), rel=1e-11)
        wanted = pin.computePotentialEnergy(other.model, other.data, at)
        assert potential[sample] == pytest.approx(wanted, rel=1e-11, abs=1e-10)


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
def test_coriolis_torque_of_links(joints: str) -> None:
    arm = random_arm(3, joints)
    other = InPinocchio(arm)
    q, qd, _ = motion(3, arm.n, 4)
    symbols = christoffel_symbols(arm, q)
    for sample in range(4):
        wanted = pin.computeCoriolisMatrix(other.model, other.data, q[sample], qd[sample]) @ qd[sample]
        assert error(coriolis_matrix(arm, q[sample], qd[sample]) @ qd[sample], wanted) < 1e-12
        assert error(np.einsum("ijk,j,k->i", symbols[sample], qd[sample], qd[sample]), wanted) < 1e-12


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_tip_of_real_arms(name: str) -> None:
    """Jacobian, acceleration at constant joint speeds, and the mass at the tip by pinocchio's own matrices."""
    arm = load_arm(name)
    other = InPinocchio(arm, rotors=False)
    place = pin.SE3(arm.tip[:3, :3], arm.tip[:3, 3] - arm.joint_points[-1])
    frame = other.model.addFrame(pin.Frame("tip", other.ids[-1], 0, place, pin.FrameType.OP_FRAME))
    data, aligned = other.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    q, qd, _ = motion(4, arm.n, 3)
    for sample in range(3):
        pin.forwardKinematics(other.model, data, q[sample], qd[sample], np.zeros(arm.n))
        jacobian = pin.computeFrameJacobian(other.model, data, q[sample], frame, aligned)
        found = tip_jacobian(arm, q[sample])
        assert error(found, np.vstack([jacobian[3:], jacobian[:3]])) < 1e-13
        moved = pin.getFrameClassicalAcceleration(other.model, data, frame, aligned).linear
        assert error(tip_acceleration_terms(arm, q[sample], qd[sample]).sum(axis=(0, 1)), moved) < 1e-12
        mass = pin.crba(other.model, data, q[sample])
        mass = np.triu(mass) + np.triu(mass, 1).T
        wanted = np.linalg.inv(jacobian[:3] @ np.linalg.inv(mass) @ jacobian[:3].T)
        assert error(tip_force_ellipsoid(arm, q[sample]).matrix, wanted) < 1e-10  # two inversions
