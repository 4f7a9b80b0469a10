"""The tip's dynamics against pinocchio, the book's formulas, and many digits near singularities."""

from __future__ import annotations

from dataclasses import replace

import mpmath as mp
import numpy as np
import pinocchio as pin
import pytest
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.kinematics import body_jacobian, body_jacobian_rate, space_jacobian, space_jacobian_rate
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.dynamics.task_space import (
    BodyTwist,
    Damped,
    Reduced,
    SpaceTwist,
    Task,
    TipVelocity,
    task_space_dynamics,
)
from drivetrain.errors import InputError

SEEDS = range(4)
TASKS: list[Task] = [
    BodyTwist(),
    SpaceTwist(),
    TipVelocity(),
]


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT, "RRRRRRRR"])
@pytest.mark.parametrize("seed", SEEDS)
def test_jacobian_rates_against_pinocchio(seed: int, joints: str) -> None:
    arm = random_arm(seed, joints)
    q, qd, _ = motion(seed, arm.n)
    twin = InPinocchio(arm)
    place = pin.SE3(arm.tip[:3, :3], arm.tip[:3, 3] - arm.joint_points[-1])
    tip = twin.model.addFrame(pin.Frame("tip", twin.ids[-1], 0, place, pin.FrameType.OP_FRAME))
    data = twin.model.createData()
    for k, sample in enumerate(zip(q, qd, strict=True)):
        pin.computeJointJacobiansTimeVariation(twin.model, data, *sample)
        pin.updateFramePlacements(twin.model, data)
        for frame, ours in ((pin.WORLD, space_jacobian_rate), (pin.LOCAL, body_jacobian_rate)):
            theirs = pin.getFrameJacobianTimeVariation(twin.model, data, tip, frame)
            assert error(ours(arm, q, qd)[k], np.vstack([theirs[3:], theirs[:3]])) < 1e-12


def accelerations_of(task: Task, arm: Arm, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """How the task moves under torques, equation 8.84: J qdd + dJ/dt qd."""
    driven = np.einsum("nij,nj->ni", task.jacobian(arm, q), forward_dynamics(arm, q, qd, tau))
    return driven + np.einsum("nij,nj->ni", task.jacobian_rate(arm, q, qd), qd)


def test_sign_of_exercise_8_6() -> None:
    """d J_i / d q_j by differences: ad_Ji(J_j) holds for the body, its negative for the space Jacobian."""
    arm, step = random_arm(1), 1e-6
    q = motion(1, 6)[0][0]

    def bracket(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.concatenate([np.cross(a[:3], b[:3]), np.cross(a[3:], b[:3]) + np.cross(a[:3], b[3:])])

    for jacobian, sign, filled in ((space_jacobian, -1.0, np.greater), (body_jacobian, 1.0, np.less)):
        columns = jacobian(arm, q).T
        for j in range(6):
            slopes = (jacobian(arm, q + step * np.eye(6)[j]) - jacobian(arm, q - step * np.eye(6)[j])).T / (2 * step)
            for i in range(6):
                wanted = sign * bracket(columns[i], columns[j]) if filled(i, j) else np.zeros(6)
                np.testing.assert_allclose(slopes[i], wanted, atol=1e-8)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: type(task).__name__)
@pytest.mark.parametrize("seed", SEEDS)
def test_rates_of_tasks_by_differences(seed: int, task: Task) -> None:
    arm, step = random_arm(seed), 1e-4
    q, qd, _ = (0.4 * x for x in motion(seed, 6))
    at = [task.jacobian(arm, q + k * step * qd) for k in (-2, -1, 1, 2)]
    slope = (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * step)
    assert error(task.jacobian_rate(arm, q, qd), slope) < 1e-8


@pytest.mark.parametrize("task", TASKS, ids=lambda task: type(task).__name__)
@pytest.mark.parametrize("rotors", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_book_s_formulas(seed: int, rotors: bool, task: Task) -> None:
    """Lambda = J^-T M J^-1 and eta = J^-T h - Lambda dJ/dt J^-1 V, written out."""
    arm = random_arm(seed)
    arm = with_rotors(arm, rotors_of(seed, "mixed", 6)) if rotors else arm
    q, qd, _ = motion(seed, 6)
    found = task_space_dynamics(arm, q, qd, task=task)
    jacobians, slopes = task.jacobian(arm, q), task.jacobian_rate(arm, q, qd)
    for k in range(len(q)):
        back = np.linalg.inv(jacobians[k])
        inertia = back.T @ mass_matrix(arm, q[k]) @ back
        eta = back.T @ bias_torque(arm, q[k], qd[k]) - inertia @ slopes[k] @ qd[k]
        bound = 1e-13 * found.condition[k] ** 2 + 1e-11
        assert error(found.inertia[k], inertia) < bound
        assert error(found.bias[k] + found.gravity[k], eta) < bound
    assert (found.rank == 6).all()
    assert (found.damping == 0.0).all()
    one = task_space_dynamics(arm, q[1], qd[1], task=task)
    np.testing.assert_allclose(one.inertia, found.inertia[1], rtol=1e-12)
    assert one.rank == 6


@pytest.mark.parametrize("task", TASKS, ids=lambda task: type(task).__name__)
def test_equation_of_motion_of_the_tip(task: Task) -> None:
    """What forward dynamics does to the joints, seen at the tip: F = Lambda Vd + eta; power is the same."""
    arm = with_rotors(random_arm(2, "RRPRRR"), rotors_of(2, "coaxial", 6))
    q, qd, tau = motion(2, 6)
    terms = task_space_dynamics(arm, q, qd, task=task)
    acceleration = accelerations_of(task, arm, q, qd, tau)
    wrench = np.einsum("nij,nj->ni", terms.inertia, acceleration) + terms.bias + terms.gravity
    jacobian = task.jacobian(arm, q)
    assert error(np.einsum("nij,ni->nj", jacobian, wrench), tau) < 1e-9
    speed = (jacobian @ qd[:, :, None])[..., 0]
    np.testing.assert_allclose(np.sum(wrench * speed, axis=1), np.sum(tau * qd, axis=1), atol=1e-8)


def test_redundant_arm_is_dynamically_consistent() -> None:
    arm = load_arm("panda")
    rng = np.random.default_rng(5)
    middle = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
    q, qd = rng.uniform(-1, 1, (6, arm.n)) + middle, rng.uniform(-1, 1, (6, arm.n))
    free, force = rng.uniform(-5, 5, (6, arm.n)), rng.uniform(-9, 9, (6, 6))
    terms, jacobian = task_space_dynamics(arm, q, qd), body_jacobian(arm, q)
    assert terms.inertia.shape == (6, 6, 6)
    # Lambda is the inverse of the mobility that pinocchio gives.
    twin = InPinocchio(arm)
    for k in range(6):
        inverse = pin.computeMinverse(twin.model, twin.data, q[k])
        inverse = np.triu(inverse) + np.triu(inverse, 1).T
        assert error(np.linalg.inv(jacobian[k] @ inverse @ jacobian[k].T), terms.inertia[k]) < 1e-9
    # Torques: those for a wrench, and any others from the null space, which the tip must not feel.
    back = np.swapaxes(jacobian, 1, 2)
    projector = np.eye(arm.n) - back @ terms.inertia @ jacobian @ np.linalg.inv(mass_matrix(arm, q))
    assert np.linalg.matrix_rank(projector[0], tol=1e-6) == 1
    held = np.einsum("nij,nj->ni", back, force) + np.einsum("nij,nj->ni", projector, free)
    acceleration = accelerations_of(BodyTwist(), arm, q, qd, held)
    felt = np.einsum("nij,nj->ni", terms.inertia, acceleration) + terms.bias + terms.gravity
    assert error(felt, force) < 1e-9


def exact_2r(arm: Arm, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lambda and eta of the linear velocity of a planar 2R arm of point masses, in 60 digits (equation 8.9)."""
    with mp.workdps(60):
        a, b, va, vb = (mp.mpf(float(x)) for x in (*q, *qd))
        m1, m2, g = mp.mpf(float(arm.masses[0])), mp.mpf(float(arm.masses[1])), mp.mpf(9.81)
        c, s, c1, s1, c12, s12 = mp.cos(b), mp.sin(b), mp.cos(a), mp.sin(a), mp.cos(a + b), mp.sin(a + b)
        mass = mp.matrix([[m1 + m2 * (2 + 2 * c), m2 * (1 + c)], [m2 * (1 + c), m2]])
        bias = mp.matrix([-m2 * s * (2 * va * vb + vb**2), m2 * s * va**2])
        bias += mp.matrix([(m1 + m2) * g * c1 + m2 * g * c12, m2 * g * c12])
        jacobian = mp.matrix([[-s1 - s12, -s12], [c1 + c12, c12]])
        w = va + vb
        slope = mp.matrix([[-c1 * va - c12 * w, -c12 * w], [-s1 * va - s12 * w, -s12 * w]])
        back = jacobian**-1
        inertia = back.T * mass * back
        eta = back.T * bias - inertia * slope * mp.matrix([va, vb])
        return np.array(inertia.tolist(), dtype=float), np.array(eta.tolist(), dtype=float).ravel()


def point_masses() -> Arm:
    homes = [np.eye(4), np.eye(4)]
    homes[0][0, 3], homes[1][0, 3] = 1.0, 2.0
    screws = [[0, 0, 1.0, 0, 0, 0], [0, 0, 1.0, 0, -1.0, 0]]
    return Arm.from_screws(homes, screws, [2.0, 1.0], np.zeros((2, 3, 3)), homes[1], (0.0, -9.81, 0.0))


def test_near_singular_exact_or_flagged() -> None:
    """At q2 = 1e-1 to 1e-12 the arm is nearly straight: 1e-8 of the truth, or the answer says that it is damped."""
    arm, task, flagged = point_masses(), TipVelocity((3, 4)), []
    for exponent in range(1, 13):
        q, qd = np.array([0.7, 10.0**-exponent]), np.array([0.5, -0.3])
        inertia, eta = exact_2r(arm, q, qd)
        found = task_space_dynamics(arm, q, qd, task=task)
        assert np.isfinite(found.inertia).all()
        assert found.condition > 0.5 * 10.0**exponent
        flagged.append(found.damping > 0.0)
        assert flagged[-1] == (found.rank < 2)
        if not flagged[-1]:
            assert error(found.inertia, inertia) < 1e-8
            assert error(found.bias + found.gravity, eta) < 1e-8
    assert flagged == sorted(flagged)
    assert not flagged[4]
    assert flagged[-1]
    # The naive way, inverting twice, is wrong by then and does not say so.
    q = np.array([0.7, 1e-8])
    jacobian = task.jacobian(arm, q[None])[0]
    twice = np.linalg.inv(jacobian @ np.linalg.inv(mass_matrix(arm, q)) @ jacobian.T)
    assert error(twice, exact_2r(arm, q, np.zeros(2))[0]) > 1e-3


def test_exactly_singular() -> None:
    arm, task = point_masses(), TipVelocity((3, 4))
    q, qd = np.zeros(2), np.array([0.3, 0.2])
    damped, reduced = (task_space_dynamics(arm, q, qd, task=task, near_singular=how) for how in (Damped(), Reduced()))
    for found in (damped, reduced):
        assert found.condition > 1e12
        assert found.rank == 1
        for part in (found.inertia, found.bias, found.gravity):
            assert np.isfinite(part).all()
    assert damped.damping > 0.0
    # Straight along x only the y row is alive: 1/(J M^-1 J^T) of that row alone.
    row = task.jacobian(arm, q[None])[0][1]
    alone = 1.0 / (row @ np.linalg.solve(mass_matrix(arm, q), row))
    np.testing.assert_allclose(reduced.inertia, [[0.0, 0.0], [0.0, alone]], atol=1e-9)


@pytest.mark.parametrize("task", TASKS)
def test_condition_and_rank_in_any_unit_of_mass(task: Task) -> None:
    """The condition is the root of that of the mobility's eigenvalues; with masses in grams all but the scale stays."""
    arm = random_arm(3, "RRRRRRRR")
    q, qd, _ = motion(3, arm.n)
    mobility = task.jacobian(arm, q) @ np.linalg.inv(mass_matrix(arm, q)) @ np.swapaxes(task.jacobian(arm, q), 1, 2)
    values = np.linalg.eigvalsh(mobility)
    for threshold in (1e-3, 0.05, 0.3):
        how = Reduced(threshold)
        found = task_space_dynamics(arm, q, qd, task=task, near_singular=how)
        np.testing.assert_allclose(found.condition, np.sqrt(values[:, -1] / values[:, 0]), rtol=1e-8)
        np.testing.assert_array_equal(found.rank, (np.sqrt(values / values[:, -1:]) > threshold).sum(axis=1))
        for scale in (1e-6, 1e6):
            other = replace(arm, masses=scale * arm.masses, inertias=scale * arm.inertias)
            scaled = task_space_dynamics(other, q, qd, task=task, near_singular=how)
            np.testing.assert_array_equal(scaled.rank, found.rank)
            assert error(scaled.inertia / scale, found.inertia) < 1e-9


def test_damping_begins_smoothly() -> None:
    arm, task, how = point_masses(), TipVelocity((3, 4)), Damped(1e-2)
    angles = np.geomspace(1e-1, 1e-4, 400)
    found = task_space_dynamics(
        arm, np.column_stack([0.7 + 0 * angles, angles]), np.zeros((400, 2)), task=task, near_singular=how
    )
    largest = np.linalg.norm(found.inertia, axis=(1, 2))
    assert np.abs(np.diff(np.log(largest))).max() < 0.1
    assert (found.damping[:50] == 0.0).all()
    assert (np.diff(found.damping) >= 0.0).all()


def test_arms_with_fewer_joints_name_their_rows() -> None:
    arm = at_level(load_arm("planar-2r"), RotorLevel.NONE)
    q, qd = np.array([0.4, 1.1]), np.array([0.2, -0.5])
    with pytest.raises(InputError, match="at most as many rows"):
        task_space_dynamics(arm, q, qd)
    rows = task_space_dynamics(arm, q, qd, task=TipVelocity((3, 4)))
    jacobian = TipVelocity((3, 4)).jacobian(arm, q[None])[0]
    back = np.linalg.inv(jacobian)
    np.testing.assert_allclose(rows.inertia, back.T @ mass_matrix(arm, q) @ back, rtol=1e-10)
    whole = task_space_dynamics(arm, q, qd, near_singular=Reduced())
    assert whole.rank == 2
    assert np.isinf(whole.condition)
    assert whole.inertia.shape == (6, 6)


def test_singular_mass_matrix_names_the_joint() -> None:
    arm = point_masses()
    light = Arm.from_screws(arm.home, arm.screws, [1.0, 0.0], np.zeros((2, 3, 3)), arm.tip)
    with pytest.raises(InputError, match=r"joint_2.*moves no inertia"):
        task_space_dynamics(light, np.array([0.1, 0.5]), np.zeros(2), task=TipVelocity((3, 4)))


def test_wrong_input() -> None:
    arm, zero = random_arm(0), np.zeros(6)
    with pytest.raises(InputError, match="rows"):
        BodyTwist((0, 0))
    with pytest.raises(InputError, match="rows"):
        BodyTwist((6,))
    with pytest.raises(InputError, match="threshold"):
        Damped(0.0)
    with pytest.raises(InputError, match="shape"):
        task_space_dynamics(arm, zero, zero[:5])
