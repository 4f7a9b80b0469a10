"""Ellipsoids of the mass matrix against the forward dynamics of an arm at rest."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.kinematics import tip_jacobian
from drivetrain.dynamics.book.ellipsoids import (
    Ellipsoid,
    acceleration_ellipsoid,
    effective_mass,
    outline,
    tip_acceleration_ellipsoid,
    tip_force_ellipsoid,
    torque_ellipsoid,
)
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError

XY = np.eye(3)[:2]


def weightless(seed: int, joints: str = "RRRRRR", kind: str = "mixed") -> Arm:
    """A random arm with rotors and without gravity."""
    bare = random_arm(seed, joints)
    free = Arm.from_screws(bare.home, bare.screws, bare.masses, bare.inertias, bare.tip, np.zeros(3))
    return with_rotors(free, rotors_of(seed, kind, bare.n))


def pushed(arm: Arm, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Acceleration of the tip from rest for a force on it in base axes, by forward dynamics with J^T F."""
    rest = np.zeros(arm.n)
    jacobian = tip_jacobian(arm, q)[3:]
    return jacobian @ forward_dynamics(arm, q, rest, jacobian.T @ force)


def test_torques_of_unit_accelerations_lie_on_the_torque_ellipsoid() -> None:
    arm = weightless(100, EVERY_JOINT)
    q = motion(100, arm.n, 1)[0][0]
    found = torque_ellipsoid(arm, q)
    ways = np.random.default_rng(100).normal(size=(20, arm.n))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    torques = inverse_dynamics(arm, np.tile(q, (20, 1)), np.zeros((20, arm.n)), ways)
    inside = torques @ found.directions / found.semi_axes
    # Rounding times the condition number of M.
    np.testing.assert_allclose(np.linalg.norm(inside, axis=1), 1.0, rtol=1e-9)
    for size, way in zip(found.semi_axes, found.directions.T, strict=True):
        along = inverse_dynamics(arm, q, np.zeros(arm.n), way)
        np.testing.assert_allclose(along, size * way, atol=1e-11 * found.semi_axes[0])
    assert (np.diff(found.semi_axes) <= 0.0).all()


def test_acceleration_ellipsoid_is_the_inverse() -> None:
    arm = weightless(101)
    q, _, _ = motion(101, arm.n, 4)
    torques, accelerations = torque_ellipsoid(arm, q), acceleration_ellipsoid(arm, q)
    np.testing.assert_allclose(accelerations.semi_axes, 1.0 / torques.semi_axes[:, ::-1], rtol=1e-10)
    for sample in range(4):
        way = accelerations.directions[sample, :, 0]
        gained = forward_dynamics(arm, q[sample], np.zeros(6), way)
        np.testing.assert_allclose(gained, accelerations.semi_axes[sample, 0] * way, atol=1e-8 * np.abs(gained).max())


def test_some_joints_held() -> None:
    """With some joints held, the torques of the others are the rows of the whole matrix."""
    arm = weightless(102)
    q = motion(102, arm.n, 1)[0][0]
    found = torque_ellipsoid(arm, q, joints=[4, 1])
    for size, way in zip(found.semi_axes, found.directions.T, strict=True):
        acceleration = np.zeros(6)
        acceleration[[4, 1]] = way
        torque = inverse_dynamics(arm, q, np.zeros(6), acceleration)[[4, 1]]
        np.testing.assert_allclose(torque, size * way, atol=1e-12 * found.semi_axes[0])
    inverse = acceleration_ellipsoid(arm, q, joints=[4, 1])
    np.testing.assert_allclose(inverse.matrix @ found.matrix, np.eye(2), atol=1e-12)


@pytest.mark.parametrize("joints", ["RRR", "RRRRRR", "PRHRR", "RR"])
def test_tip_ellipsoids_agree_with_accelerations_of_a_pushed_tip(joints: str) -> None:
    arm = weightless(103, joints)
    q = motion(103, arm.n, 1)[0][0]
    moved, forces = tip_acceleration_ellipsoid(arm, q), tip_force_ellipsoid(arm, q)
    for unit in np.eye(3):
        np.testing.assert_allclose(moved.matrix @ unit, pushed(arm, q, unit), atol=1e-12 * moved.semi_axes[0])
        along = pushed(arm, q, unit) @ unit
        assert effective_mass(arm, q, 5.0 * unit) == pytest.approx(1.0 / along, rel=1e-9)
    if arm.n >= 3:
        np.testing.assert_allclose(moved.matrix @ forces.matrix, np.eye(3), atol=1e-9)  # by its condition number
    else:
        assert moved.semi_axes[2] == 0.0 and forces.semi_axes[0] == np.inf
        stuck = forces.directions[:, 0]
        assert np.abs(stuck @ tip_jacobian(arm, q)[3:]).max() < 1e-12
        assert effective_mass(arm, q, stuck) == np.inf


def test_equation_8_21_where_the_jacobian_is_square() -> None:
    arm = weightless(104, "RRR", "unbalanced")
    q, _, _ = motion(104, 3, 5)
    inverse = np.linalg.inv(tip_jacobian(arm, q)[:, 3:])
    masses = torque_ellipsoid(arm, q).matrix
    wanted = np.swapaxes(inverse, 1, 2) @ masses @ inverse
    assert error(tip_force_ellipsoid(arm, q).matrix, wanted) < 1e-9
    held = np.random.default_rng(104).normal(size=3)
    held /= np.linalg.norm(held)
    # Kept on a line, the tip has at least the effective mass of a tip that is free to move sideways.
    assert (held @ wanted @ held >= effective_mass(arm, q, held)).all()


def test_tip_energy_is_joint_energy() -> None:
    """Equation 8.20: (qd M qd) = (V Lambda V) for an arm without redundant joints."""
    arm = weightless(105, "RPR", "balanced")
    q, qd, _ = motion(105, 3, 6)
    velocity = (tip_jacobian(arm, q)[:, 3:] @ qd[:, :, None])[..., 0]
    joints = np.einsum("si,sij,sj->s", qd, torque_ellipsoid(arm, q).matrix, qd)
    tip = np.einsum("si,sij,sj->s", velocity, tip_force_ellipsoid(arm, q).matrix, velocity)
    np.testing.assert_allclose(tip, joints, rtol=1e-9)


def test_axes_rotate_the_ellipsoid() -> None:
    arm = weightless(106)
    q = motion(106, 6, 1)[0][0]
    turn, _ = np.linalg.qr(np.random.default_rng(106).normal(size=(3, 3)))
    whole, turned = tip_acceleration_ellipsoid(arm, q), tip_acceleration_ellipsoid(arm, q, axes=turn)
    np.testing.assert_allclose(turned.semi_axes, whole.semi_axes, rtol=1e-11)
    np.testing.assert_allclose(turned.matrix, turn @ whole.matrix @ turn.T, atol=1e-12 * whole.semi_axes[0])
    two = tip_acceleration_ellipsoid(arm, q, axes=XY)
    np.testing.assert_allclose(two.matrix, whole.matrix[:2, :2], atol=1e-12 * whole.semi_axes[0])
    one = tip_force_ellipsoid(arm, q, axes=[[0.6, 0.0, 0.8]])
    assert one.semi_axes[0] == pytest.approx(effective_mass(arm, q, [0.6, 0.0, 0.8]), rel=1e-12)


def test_planar_arm_stretched_and_out_of_its_plane() -> None:
    arm = planar_2r_arm(Planar2R())
    postures = np.array([[0.3, 0.0], [0.3, np.pi], [0.3, 1.0]])
    along = np.array([[np.cos(0.3), np.sin(0.3), 0.0]] * 3)
    masses = effective_mass(arm, postures, along)
    assert np.isinf(masses[:2]).all() and np.isfinite(masses[2])
    forces = tip_force_ellipsoid(arm, postures, axes=XY)
    assert np.isinf(forces.semi_axes[:2, 0]).all() and np.isfinite(forces.semi_axes[2]).all()
    np.testing.assert_allclose(np.abs(forces.directions[0, :, 0]), along[0, :2], atol=1e-12)
    assert np.isinf(effective_mass(arm, postures, [0, 0, 1.0])).all()
    # A stretched arm pushed sideways moves only mass 2, since joint 2 leaves the first link at rest.
    assert effective_mass(arm, [0.0, 0.0], [0.0, 1.0, 0.0]) == pytest.approx(1.0, rel=1e-12)


def test_near_singular_masses_keep_their_digits() -> None:
    """At 1e-5 rad from stretched, mass and mobility differ by 1e10; the mass along the arm is 1/sin^2 plus O(1)."""
    arm, bend = planar_2r_arm(Planar2R()), 1e-5
    largest = tip_force_ellipsoid(arm, [0.0, bend], axes=XY).semi_axes[0]
    # det(Lambda) = det(M)/det(J)^2 = (1 + sin^2)/sin^2 and trace by eq. 8.21 with unit masses.
    s, c = np.sin(bend), np.cos(bend)
    inverse = np.array([[np.cos(bend), np.sin(bend)], [-c - 1.0, -s]]) / s
    exact = inverse.T @ np.array([[3 + 2 * c, 1 + c], [1 + c, 1.0]]) @ inverse
    assert largest == pytest.approx(np.linalg.eigvalsh(exact)[-1], rel=1e-9)


def test_outline_is_the_image_of_the_circle() -> None:
    arm = planar_2r_arm(Planar2R())
    found = torque_ellipsoid(arm, [[0.0, 1.0], [0.0, 2.5]])
    curves = outline(found, points=13)
    assert curves.shape == (2, 13, 2)
    np.testing.assert_allclose(curves[:, 0], curves[:, -1], atol=1e-14)
    for matrix, curve in zip(found.matrix, curves, strict=True):
        np.testing.assert_allclose(np.linalg.norm(np.linalg.solve(matrix, curve.T), axis=0), 1.0, rtol=1e-12)
    endless = tip_force_ellipsoid(arm, [0.0, 0.0], axes=XY)
    assert np.abs(outline(endless, longest=7.0)).max() == pytest.approx(7.0)


def test_one_sample_and_a_batch() -> None:
    arm = load_arm("ur5")
    q = np.random.default_rng(107).uniform(-3, 3, (3, 6))
    assert np.shape(effective_mass(arm, q[1], [1.0, 0, 0])) == ()
    ways = np.eye(3)
    for row in range(3):
        assert effective_mass(arm, q, ways)[row] == pytest.approx(effective_mass(arm, q[row], ways[row]), rel=1e-11)


def massless() -> Arm:
    home = np.tile(np.eye(4), (2, 1, 1))
    screws = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0]]
    return Arm.from_screws(home, screws, [1.0, 0.0], [np.eye(3), np.zeros((3, 3))])


@pytest.mark.parametrize("function", [acceleration_ellipsoid, tip_acceleration_ellipsoid, tip_force_ellipsoid])
def test_a_joint_without_inertia_is_refused(function: object) -> None:
    with pytest.raises(InputError, match="moves no inertia"):
        function(massless(), np.zeros(2))
    assert torque_ellipsoid(massless(), np.zeros(2)).semi_axes[1] == 0.0  # a flat ellipsoid is not an error


def test_two_joints_on_one_inertia_are_refused() -> None:
    """Both joints turn the same body about the same axis: M is singular although its diagonal is not zero."""
    home = np.tile(np.eye(4), (2, 1, 1))
    screws = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0]]
    arm = Arm.from_screws(home, screws, [0.0, 1.0], [np.zeros((3, 3)), np.eye(3)])
    with pytest.raises(InputError, match="moves no inertia"):
        acceleration_ellipsoid(arm, np.zeros(2))
    first = Arm.from_screws(home[:1], screws[:1], [0.0], np.zeros((1, 3, 3)))
    with pytest.raises(InputError, match="moves no inertia"):
        acceleration_ellipsoid(first, np.zeros(1))


def test_wrong_input() -> None:
    arm, q = load_arm("ur5"), np.zeros(6)
    for joints in ([0, 0], [6], [-1], [0.5], [], "01"):
        with pytest.raises(InputError, match="joints"):
            torque_ellipsoid(arm, q, joints=joints)
    for axes in (np.eye(3) * 2, [[1, 0, 0], [0.1, 1, 0]], np.eye(4), np.empty((0, 3))):
        with pytest.raises(InputError, match="axes"):
            tip_force_ellipsoid(arm, q, axes=axes)
    for direction in (np.zeros(3), [1.0, 0.0], np.ones((2, 3)), [np.nan, 0, 0]):
        with pytest.raises(InputError, match="direction"):
            effective_mass(arm, q, direction)
    with pytest.raises(InputError, match="two axes"):
        outline(torque_ellipsoid(arm, q))
    with pytest.raises(InputError, match="longest"):
        outline(Ellipsoid(np.array([np.inf, 1.0]), np.eye(2)))
    with pytest.raises(InputError, match="points"):
        outline(Ellipsoid(np.ones(2), np.eye(2)), points=3)
