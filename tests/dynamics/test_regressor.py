"""The regressor times the arm's parameters is the inverse dynamics; its columns are pinocchio's."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.coupling import with_coupling
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.regressor import parameter_names, torque_parameters, torque_regressor


@pytest.mark.parametrize("level", RotorLevel)
@pytest.mark.parametrize("kind", ["none", "coaxial", "balanced", "unbalanced", "mixed", "coupled"])
def test_times_the_parameters_it_is_the_torque(kind: str, level: RotorLevel) -> None:
    arm = random_arm(41, EVERY_JOINT)
    if kind != "none":
        arm = at_level(with_rotors(arm, rotors_of(41, "mixed" if kind == "coupled" else kind, arm.n)), level)
    if kind == "coupled":
        arm = with_coupling(arm, np.eye(arm.n) + 0.3 * np.random.default_rng(1).normal(size=(arm.n, arm.n)))
    samples = motion(41, arm.n, 30)
    matrix, parameters = torque_regressor(arm, *samples), torque_parameters(arm)
    rotors = sum(rotor is not None for rotor in arm.rotors)
    assert matrix.shape == (30, arm.n, 10 * (arm.n + rotors)) and parameters.shape == matrix.shape[2:]
    assert error(matrix @ parameters, inverse_dynamics(arm, *samples)) < 1e-12
    assert len(parameter_names(arm)) == len(parameters)
    np.testing.assert_allclose(torque_regressor(arm, *(x[3] for x in samples)), matrix[3], rtol=1e-12, atol=1e-9)


def test_columns_are_pinocchios() -> None:
    arm = random_arm(42, EVERY_JOINT)
    peer, samples = InPinocchio(arm), motion(42, arm.n, 6)
    found = torque_regressor(arm, *samples)
    for k, sample in enumerate(zip(*samples, strict=True)):
        wanted = pin.computeJointTorqueRegressor(peer.model, peer.data, *sample)
        assert error(found[k], wanted) < 1e-13
    dynamic = np.concatenate([inertia.toDynamicParameters() for inertia in peer.model.inertias[1:]])
    assert error(torque_parameters(arm), dynamic) < 1e-13


def test_columns_of_a_rotor_are_pinocchios() -> None:
    """In pinocchio the rotor is a further body, whose torque acts on the joint times the ratio."""
    bare = random_arm(43, "RRR")
    arm = with_rotors(bare, [None, Rotor(-40.0, 3e-4, 0.7), None])
    peer, samples = InPinocchio(arm), motion(43, 3, 4)
    found = torque_regressor(arm, *samples)[:, :, 30:]
    spread = np.stack([peer.spread(unit) for unit in np.eye(3)], axis=1)
    for k, sample in enumerate(zip(*samples, strict=True)):
        full = pin.computeJointTorqueRegressor(peer.model, peer.data, *(peer.spread(x) for x in sample))
        theirs = spread.T @ full[:, 10 * (peer.rotor_ids[1] - 1) :][:, :10]
        # pinocchio's frame has the base's axes and another origin on the spin axis: the columns span the same space.
        away = found[k] - theirs @ np.linalg.lstsq(theirs, found[k], rcond=1e-12)[0]
        assert np.abs(away).max() < 1e-9 * np.abs(found[k]).max()


def test_friction_columns() -> None:
    arm = random_arm(44, "RP")
    q, qd, qdd = motion(44, 2, 5)
    qd[0, 1] = 0.0
    plain, whole = torque_regressor(arm, q, qd, qdd), torque_regressor(arm, q, qd, qdd, friction=True)
    np.testing.assert_array_equal(whole[..., :20], plain)
    laws = np.array([0.3, 0.4, 5.0, 6.0])
    wanted = [0.3, 0.4] * qd + [5.0, 6.0] * np.sign(qd)
    np.testing.assert_allclose(whole[..., 20:] @ laws, wanted, rtol=1e-15)
    assert parameter_names(arm, friction=True)[20:] == [
        "joint_1.viscous [N m s/rad]", "joint_2.viscous [N s/m]", "joint_1.coulomb [N m]", "joint_2.coulomb [N]"
    ]  # fmt: skip
