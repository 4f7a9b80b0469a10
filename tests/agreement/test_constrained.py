"""Constrained arms against pinocchio, closed forms, differences, and what must hold of every constraint."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pinocchio as pin
import pytest
from four_bar import four_bar
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, pose, random_arm, rotors_of
from round_surface import Sphere

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.kinematics import link_poses, tip_pose
from drivetrain.dynamics.constrained import (
    closed_position,
    closed_speed,
    constrained_forward_dynamics,
    constrained_inverse_dynamics,
    constraint_projectors,
)
from drivetrain.dynamics.constraints import (
    Attachment,
    CallableConstraint,
    ClosingJoint,
    Constraint,
    LoopClosure,
    Plane,
    PointOnSurface,
    stacked_rows,
)
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import bias_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError

STEP = 1e-4  # of five-point differences


def constraints_of(seed: int, arm: Arm) -> dict[str, Constraint]:
    """One of each kind, nothing about them special; they need not hold at any position."""
    rng = np.random.default_rng([seed, 9])
    tip, base = Attachment.tip(arm), Attachment.base(pose(rng))
    inner, outer = Attachment(1, pose(rng)), Attachment(arm.n - 1, pose(rng))
    found: dict[str, Constraint] = {f"{joint.name} to base": LoopClosure(tip, base, joint) for joint in ClosingJoint}
    found |= {f"{joint.name} between links": LoopClosure(outer, inner, joint) for joint in ClosingJoint}
    found["base first"] = LoopClosure(base, tip, ClosingJoint.WELD)
    found["plane"] = PointOnSurface(tip, Plane(rng.normal(size=3), rng.normal(size=3)))
    found["sphere"] = PointOnSurface(outer, Sphere(rng.normal(size=3), 0.3))
    return found


NAMES = list(constraints_of(0, random_arm(0)))


def five_points(function: object, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    at = [function(q + k * STEP * qd) for k in (-2, -1, 1, 2)]
    return (at[0] - 8.0 * at[1] + 8.0 * at[2] - at[3]) / (12.0 * STEP)


@pytest.mark.parametrize("joints", ["RRRRRR", EVERY_JOINT])
@pytest.mark.parametrize("name", NAMES)
def test_rows_are_derivatives(name: str, joints: str) -> None:
    """A qd is the rate of the error, and the drift that of A qd at constant qd."""
    for seed in range(3):
        arm = random_arm(seed, joints)
        _check_derivatives(arm, constraints_of(seed, arm)[name], *motion(seed, arm.n)[:2])


def _check_derivatives(arm: Arm, constraint: Constraint, q: np.ndarray, qd: np.ndarray) -> None:
    rows = constraint.rows(arm, q, qd)
    assert rows.error.shape == (len(q), constraint.count) == (len(q), len(constraint.units))
    leaving = (rows.jacobian @ qd[:, :, None])[..., 0]
    if constraint.holonomic:
        assert error(leaving, five_points(lambda x: constraint.rows(arm, x, 0 * x).error, q, qd)) < 1e-8
    else:
        assert not rows.error.any()
    drift = five_points(lambda x: (constraint.rows(arm, x, qd).jacobian @ qd[:, :, None])[..., 0], q, qd)
    assert error(rows.drift, drift) < 1e-8


def test_rows_by_hand() -> None:
    """Where the frames are, from poses by another road."""
    arm = random_arm(4)
    rng = np.random.default_rng(4)
    inner, outer = Attachment(1, pose(rng)), Attachment(4, pose(rng))
    q, _, _ = motion(4, 6)
    weld = LoopClosure(outer, inner, ClosingJoint.WELD).rows(arm, q, 0 * q).error
    links = link_poses(arm, q)
    frames = [links[:, a.link] @ np.linalg.inv(arm.home[a.link]) @ a.pose for a in (outer, inner)]
    relative = np.linalg.inv(frames[1]) @ frames[0]
    wanted = [*(relative[:, k, 3] for k in range(3)), relative[:, 0, 2], relative[:, 1, 2], relative[:, 0, 1]]
    np.testing.assert_allclose(weld, np.array(wanted).T, atol=1e-13)


@pytest.mark.parametrize("rotors", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_equations_of_the_book(name: str, rotors: bool) -> None:
    """8.93, 8.95 and 8.97, and the projectors 8.99 and 8.101, written out with inverses."""
    for seed in range(3):
        arm = random_arm(seed, "RRRRRRRR")
        arm = with_rotors(arm, rotors_of(seed, "mixed", arm.n)) if rotors else arm
        constraint = constraints_of(seed, arm)[name]
        q, qd, tau = motion(seed, arm.n)
        found = constrained_forward_dynamics(arm, constraint, q, qd, tau)
        projectors = constraint_projectors(arm, constraint, q)
        rows = constraint.rows(arm, q, qd)
        for k in range(len(q)):
            matrix, a, drift = mass_matrix(arm, q[k]), rows.jacobian[k], rows.drift[k]
            inverse = np.linalg.inv(matrix)
            mobility = a @ inverse @ a.T
            bound = 1e-13 * np.linalg.cond(mobility) * np.linalg.cond(matrix)
            rest = tau[k] - bias_torque(arm, q[k], qd[k])
            multipliers = np.linalg.solve(mobility, a @ inverse @ rest + drift)
            assert error(found.multipliers[k], multipliers) < bound + 1e-9
            assert error(found.acceleration[k], inverse @ (rest - a.T @ multipliers)) < bound + 1e-9
            assert error(a @ found.acceleration[k], -drift) < 1e-9
            p = np.eye(arm.n) - a.T @ np.linalg.solve(mobility, a @ inverse)
            p_theta = np.eye(arm.n) - inverse @ a.T @ np.linalg.solve(mobility, a)
            assert error(projectors.torque[k], p) < bound + 1e-9
            assert error(projectors.acceleration[k], p_theta) < bound + 1e-9
            assert projectors.rank[k] == found.rank[k] == constraint.count


def test_projectors() -> None:
    arm = random_arm(3, "RRRRRRR")
    q, qd, qdd = motion(3, 7)
    constraint = LoopClosure(Attachment.tip(arm), Attachment.base(np.eye(4)), ClosingJoint.HINGE)
    p, p_theta, rank = vars(constraint_projectors(arm, constraint, q)).values()
    rows, matrix = constraint.rows(arm, q, qd), mass_matrix(arm, q)
    assert (rank == 5).all()
    assert error(p @ p, p) < 1e-10
    assert error(p_theta @ p_theta, p_theta) < 1e-10
    assert error(p @ np.swapaxes(rows.jacobian, 1, 2), 0.0) < 1e-10  # what goes against the constraint is gone
    assert error(rows.jacobian @ p_theta, 0.0) < 1e-10
    assert error(matrix @ p_theta, p @ matrix) < 1e-9  # 8.101, exercise 8.10
    assert (np.linalg.matrix_rank(p, tol=1e-8) == 2).all()
    # Any feasible motion: 8.98 and 8.100. And the book's slip: P_theta qdd alone is not the acceleration.
    feasible = constrained_inverse_dynamics(arm, constraint, q, qd, qdd)
    motion_ = constrained_forward_dynamics(arm, constraint, q, qd, feasible.torque)
    tau, a = feasible.torque[..., None], motion_.acceleration[..., None]
    h = bias_torque(arm, q, qd)[..., None]
    assert error(p @ tau, p @ (matrix @ a + h)) < 1e-9
    assert error(p_theta @ a, p_theta @ np.linalg.solve(matrix, tau - h)) < 1e-9
    assert error(p_theta @ a, a) > 1e-2


@pytest.mark.parametrize(
    ("joint", "kind"),
    [(ClosingJoint.WELD, pin.ContactType.CONTACT_6D), (ClosingJoint.BALL, pin.ContactType.CONTACT_3D)],
)
@pytest.mark.parametrize("between_links", [False, True])
def test_against_pinocchio(joint: ClosingJoint, kind: object, between_links: bool) -> None:
    """Its own constrained dynamics, at states that meet the constraint."""
    for seed in range(4):
        arm = random_arm(seed, "RRRRRRRR")
        q0, qd0, tau = (x[0] for x in motion(seed, 8))
        place = tip_pose(arm, q0)
        first = Attachment.tip(arm)
        second = Attachment.at(arm, 0, q0, place) if between_links else Attachment.base(place)
        constraint = LoopClosure(first, second, joint)
        q, qd = closed_position(arm, constraint, q0), closed_speed(arm, constraint, q0, qd0)
        twin = InPinocchio(arm)

        def held(attachment: Attachment, twin: InPinocchio = twin) -> tuple[int, pin.SE3]:
            frame = attachment.pose
            return twin.ids[attachment.link + 1], pin.SE3(
                frame[:3, :3], frame[:3, 3] - twin.points[attachment.link + 1]
            )

        (id_a, place_a), (id_b, place_b) = held(first), held(second)
        contact = pin.RigidConstraintModel(kind, twin.model, id_a, place_a, id_b, place_b, pin.ReferenceFrame.LOCAL)
        models, datas = (
            pin.StdVec_RigidConstraintModel([contact]),
            pin.StdVec_RigidConstraintData([contact.createData()]),
        )
        # Since version 4 it wants the data, too.
        several = (models, datas) if int(pin.__version__.split(".")[0]) >= 4 else (models,)
        pin.initConstraintDynamics(twin.model, twin.data, *several)
        settings = pin.ProximalSettings(1e-12, 1e-12, 50)
        wanted = pin.constraintDynamics(twin.model, twin.data, q, qd, tau, models, datas, settings)
        found = constrained_forward_dynamics(arm, constraint, q, qd, tau)
        assert np.abs(found.error).max() < 1e-11
        assert np.abs(found.speed_error).max() < 1e-11
        assert error(found.acceleration, wanted) < 1e-7  # pinocchio's proximal iterations stop there


def gantry(masses: tuple[float, ...] = (2.0, 3.0)) -> Arm:
    """A carriage on a carriage: rails along x and z (and y), a point mass at the end."""
    axes = [[1, 0, 0], [0, 0, 1], [0, 1, 0]][: len(masses)]
    screws = [[0, 0, 0, *axis] for axis in axes]
    return Arm.from_screws(np.tile(np.eye(4), (len(masses), 1, 1)), screws, masses, np.zeros((len(masses), 3, 3)))


def test_pendulum_on_two_rails() -> None:
    """The first carriage weightless, the second on a circle: the mass swings, the circle carries it."""
    arm, radius, angle, rate = gantry((0.0, 3.0)), 0.7, 0.4, 1.3
    place, along = radius * np.array([np.sin(angle), -np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])
    circle = PointOnSurface(Attachment.tip(arm), Sphere(np.zeros(3), radius))
    found = constrained_forward_dynamics(arm, circle, place, radius * rate * along, np.zeros(2))
    spin = -9.81 / radius * np.sin(angle)
    np.testing.assert_allclose(found.acceleration, radius * spin * along - rate**2 * place, rtol=1e-12)
    # Outwards the arm pulls the circle: positive along the outward normal.
    np.testing.assert_allclose(found.multipliers, 3.0 * (9.81 * np.cos(angle) + rate**2 * radius), rtol=1e-12)
    assert found.rank == 1


def test_pressing_on_a_plane() -> None:
    """Inverse: the wanted slide along the plane, 5 N into it; forward: the plane's multiplier is what was asked."""
    arm = random_arm(6)
    q, qd, qdd = (x[0] for x in motion(6, 6))
    floor = PointOnSurface(Attachment.tip(arm), Plane([0, 0, 1], tip_pose(arm, q)[:3, 3]))
    speed = closed_speed(arm, floor, q, qd)
    free = constrained_inverse_dynamics(arm, floor, q, speed, qdd)
    pressed = constrained_inverse_dynamics(arm, floor, q, speed, qdd, multipliers=[-5.0])
    back = constrained_forward_dynamics(arm, floor, q, speed, pressed.torque)
    np.testing.assert_allclose(back.acceleration, pressed.acceleration, atol=1e-9)
    np.testing.assert_allclose(free.acceleration, pressed.acceleration, atol=1e-9)
    np.testing.assert_allclose(back.multipliers, -5.0, atol=1e-9)
    # Without a force asked for, the torque has no part that only works against the plane.
    p = constraint_projectors(arm, floor, q).torque
    np.testing.assert_allclose(p @ free.torque, free.torque, atol=1e-9)
    lifted = constrained_inverse_dynamics(arm, floor, q, speed, qdd, multipliers=[0.0])
    carried = constrained_forward_dynamics(arm, floor, q, speed, lifted.torque)
    np.testing.assert_allclose(carried.multipliers, 0.0, atol=1e-9)
    # 5 N down at the tip, by the other road: the same torque as that of the wrench.
    wrench = np.concatenate([np.zeros(3), tip_pose(arm, q)[:3, :3].T @ [0.0, 0.0, -5.0]])
    extra = bias_torque(arm, q, speed, tip_wrench=wrench) - bias_torque(arm, q, speed)
    np.testing.assert_allclose(pressed.torque - lifted.torque, extra, atol=1e-10)
    # An acceleration that the plane allows is given as it is.
    again = constrained_inverse_dynamics(arm, floor, q, speed, pressed.acceleration)
    np.testing.assert_allclose(again.acceleration, pressed.acceleration, atol=1e-9)
    assert np.abs(again.missed).max() < 1e-9 < np.abs(free.missed).max()


def test_rows_told_twice_share_their_multiplier() -> None:
    arm = random_arm(7)
    q, qd, tau = motion(7, 6)
    floor = PointOnSurface(Attachment.tip(arm), Plane([0, 0, 1], [0, 0, 0.2]))
    once = constrained_forward_dynamics(arm, floor, q, qd, tau)
    twice = constrained_forward_dynamics(arm, [floor, floor, floor], q, qd, tau)
    assert error(twice.acceleration, once.acceleration) < 1e-12
    np.testing.assert_allclose(twice.multipliers, np.repeat(once.multipliers / 3.0, 3, axis=1), rtol=1e-10)
    assert (twice.rank == 1).all()
    assert (twice.missed < 1e-10).all()
    assert (constraint_projectors(arm, [floor, floor], q).rank == 1).all()


def test_planar_loop_finds_its_rank() -> None:
    """A hinge has five rows, of which two bind a planar loop; the motion is that of the two alone."""
    arm, loop, q = four_bar()
    qd = closed_speed(arm, loop, q, [2.0, 0.0, 0.0])
    tau = np.array([1.0, 0.0, 0.0])
    whole = constrained_forward_dynamics(arm, loop, q, qd, tau)
    tip = Attachment.tip(arm)
    two = [PointOnSurface(tip, Plane([1, 0, 0], [0.9, 0, 0])), PointOnSurface(tip, Plane([0, 1, 0], [0, 0, 0]))]
    alone = constrained_forward_dynamics(arm, two, q, qd, tau)
    assert (whole.rank, alone.rank) == (2, 2)
    assert error(whole.acceleration, alone.acceleration) < 1e-12
    np.testing.assert_allclose(whole.multipliers[:2], alone.multipliers, rtol=1e-9)
    np.testing.assert_allclose(whole.multipliers[2:], 0.0, atol=1e-9)  # least norm
    # One freedom is left: the crank's own equation, by projecting everything on the speeds it gives.
    ways = qd / qd[0]
    reduced = ways @ mass_matrix(arm, q) @ ways
    rows = loop.rows(arm, q[None], qd[None])
    turned = -np.linalg.lstsq(rows.jacobian[0], rows.drift[0], rcond=None)[0]
    turned = turned - ways * turned[0]
    force = ways @ (tau - bias_torque(arm, q, qd) - mass_matrix(arm, q) @ turned)
    assert whole.acceleration[0] == pytest.approx(force / reduced, rel=1e-10)


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_nearly_redundant_rows_in_many_digits(gap: float) -> None:
    """Rows that are a hair apart are two rows still: with inverses the answer is off by far."""
    arm = gantry((2.0, 3.0, 1.5))
    normals = np.array([[0.3, -0.5, 0.8], [0.3 + gap, -0.5, 0.8]])
    lean, tau = np.array([0.7, -0.2]), np.array([1.0, 2.0, -3.0])
    rows = CallableConstraint(lambda q: normals, lambda q, qd: lean, 2)
    found = constrained_forward_dynamics(arm, rows, np.zeros(3), np.zeros(3), tau)
    with mp.workdps(60):
        weights = mp.diag([1 / mp.mpf(6.5), 1 / mp.mpf(4.5), 1 / mp.mpf(1.5)])
        a = mp.matrix(normals.tolist())
        force = mp.matrix(tau.tolist()) - mp.matrix([0, mp.mpf(9.81) * mp.mpf(4.5), 0])
        multipliers = mp.lu_solve(a * weights * a.T, a * weights * force + mp.matrix(lean.tolist()))
        wanted = weights * (force - a.T * multipliers)
        motion_, pushes = (
            np.array(wanted.tolist(), dtype=float).ravel(),
            np.array(multipliers.tolist(), dtype=float).ravel(),
        )
    assert found.rank == 2
    assert error(found.acceleration, motion_) < 1e-15 / gap * 20
    assert error(found.multipliers, pushes) < 1e-15 / gap * 200
    matrix = mass_matrix(arm, np.zeros(3))
    rest = tau - bias_torque(arm, np.zeros(3), np.zeros(3))
    inverse = np.linalg.inv(matrix)
    naive = inverse @ (
        rest - normals.T @ (np.linalg.inv(normals @ inverse @ normals.T) @ (normals @ inverse @ rest + lean))
    )
    assert error(found.acceleration, motion_) <= error(naive, motion_)
    if gap < 1e-3:
        assert error(naive, motion_) > 100.0 * error(found.acceleration, motion_)


def test_callable_rows_are_those_they_copy() -> None:
    arm = random_arm(9)
    q, qd, tau = motion(9, 6)
    ball = PointOnSurface(Attachment.tip(arm), Sphere([0.1, 0.2, 0.3], 0.5))
    copy = CallableConstraint(
        lambda x: ball.rows(arm, x[None], 0 * x[None]).jacobian[0],
        lambda x, v: ball.rows(arm, x[None], v[None]).drift[0],
        1,
        lambda x: ball.rows(arm, x[None], 0 * x[None]).error[0],
    )
    for ours, theirs in zip(
        stacked_rows(arm, (ball, ball), q, qd), stacked_rows(arm, (copy, copy), q, qd), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, atol=1e-14)
    assert copy.holonomic
    one, other = (constrained_forward_dynamics(arm, c, q, qd, tau) for c in (ball, copy))
    np.testing.assert_allclose(one.acceleration, other.acceleration, atol=1e-10)


def test_constraint_that_pulls_nothing_changes_nothing() -> None:
    """At a speed and torque that keep to the plane anyway the plane is not felt."""
    arm = gantry((2.0, 3.0))
    floor = PointOnSurface(Attachment.tip(arm), Plane([0, 0, 1], [0, 0, 0]))
    q, qd, tau = np.zeros(2), np.array([0.4, 0.0]), np.array([5.0, 3.0 * 9.81 + 2.0 * 0.0])
    free = forward_dynamics(arm, q, qd, tau)
    found = constrained_forward_dynamics(arm, floor, q, qd, tau)
    np.testing.assert_allclose(found.acceleration, free, atol=1e-14)
    np.testing.assert_allclose(found.multipliers, 0.0, atol=1e-12)


def test_one_sample_is_a_batch_of_one() -> None:
    arm = random_arm(1)
    q, qd, tau = motion(1, 6)
    closing = LoopClosure(Attachment.tip(arm), Attachment.base(np.eye(4)), ClosingJoint.HINGE)
    batch_, one = (
        constrained_forward_dynamics(arm, closing, *(x[rows] for x in (q, qd, tau))) for rows in (slice(None), 2)
    )
    for whole, single in zip(vars(batch_).values(), vars(one).values(), strict=True):
        np.testing.assert_array_equal(whole[2], single)
    tip = np.arange(6.0)
    shifted = constrained_forward_dynamics(arm, closing, q, qd, tau, tip_wrench=tip)
    equal = constrained_forward_dynamics(
        arm, closing, q, qd, tau - bias_torque(arm, q, 0 * q, tip_wrench=tip) + bias_torque(arm, q, 0 * q)
    )
    np.testing.assert_allclose(shifted.acceleration, equal.acceleration, atol=1e-8)


def test_closing() -> None:
    arm, loop, q = four_bar()
    assert np.abs(loop.rows(arm, q[None], np.zeros((1, 3))).error).max() < 1e-12
    qd = closed_speed(arm, loop, q, [2.0, 1.0, 0.5])
    assert np.abs(loop.rows(arm, q[None], qd[None]).jacobian[0] @ qd).max() < 1e-13
    np.testing.assert_allclose(closed_speed(arm, loop, q, qd), qd, atol=1e-13)
    far = np.eye(4)
    far[0, 3] = 9.0
    with pytest.raises(InputError, match=r"no position near it.*start nearer"):
        closed_position(arm, LoopClosure(Attachment.tip(arm), Attachment.base(far), ClosingJoint.HINGE), q)


def test_wrong_input() -> None:
    arm, zero = random_arm(0), np.zeros(6)
    tip = Attachment.tip(arm)
    with pytest.raises(InputError, match="at least one"):
        constrained_forward_dynamics(arm, [], zero, zero, zero)
    with pytest.raises(InputError, match="must be a Constraint"):
        constrained_forward_dynamics(arm, ["door"], zero, zero, zero)
    with pytest.raises(InputError, match="must be a Constraint, or several"):
        constrained_forward_dynamics(arm, 5, zero, zero, zero)
    with pytest.raises(InputError, match="does not have"):
        floor = PointOnSurface(Attachment(6, np.eye(4)), Plane([0, 0, 1], [0, 0, 0]))
        constrained_forward_dynamics(arm, floor, zero, zero, zero)
    with pytest.raises(InputError, match="two different links"):
        LoopClosure(tip, tip, ClosingJoint.BALL)
    with pytest.raises(InputError, match="link"):
        Attachment(-2, np.eye(4))
    with pytest.raises(InputError, match="pose"):
        Attachment(0, np.ones((4, 4)))
    with pytest.raises(InputError, match="zero"):
        Plane([0, 0, 0], [0, 0, 0])
    floor = PointOnSurface(tip, Plane([0, 0, 1], [0, 0, 0]))
    with pytest.raises(InputError, match="multipliers"):
        constrained_inverse_dynamics(arm, floor, zero, zero, zero, multipliers=[1.0, 2.0])
    with pytest.raises(InputError, match="finite"):
        constrained_forward_dynamics(arm, floor, zero, zero + np.nan, zero)
    with pytest.raises(InputError, match="moves no inertia"):
        constrained_forward_dynamics(
            gantry((1.0, 0.0)),
            PointOnSurface(Attachment.tip(gantry((1.0, 0.0))), Plane([0, 0, 1], [0, 0, 0])),
            *[np.zeros(2)] * 3,
        )
    with pytest.raises(InputError, match="jacobian"):
        constrained_forward_dynamics(
            arm, CallableConstraint(lambda q: np.zeros((2, 5)), lambda q, qd: np.zeros(2), 2), zero, zero, zero
        )
