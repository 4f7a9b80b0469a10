"""Dynamics of one body in twists and wrenches, against point masses, the classical equations and other frames."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.spatial.free_body import body_acceleration, body_wrench, kinetic_energy, momentum
from drivetrain.spatial.inertia import RigidBody, cuboid
from drivetrain.spatial.poses import adjoint, exp_pose, inverse_pose, pose
from drivetrain.spatial.rotations import exp_rotation
from drivetrain.spatial.wrenches import bracket, dual_bracket, lie_bracket


def transform_twist(a_b, twist):
    return adjoint(a_b) @ twist


def transform_wrench(a_b, wrench):
    return adjoint(inverse_pose(a_b)).T @ wrench


def cloud(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, RigidBody]:
    """Point masses whose centre is not at the origin, and the body of them."""
    points, masses = rng.normal([0.3, -0.2, 0.5], size=(7, 3)), rng.uniform(0.1, 2.0, size=7)
    com = masses @ points / masses.sum()
    inertia = sum(m * ((r @ r) * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, points - com, strict=True))
    return points, masses, RigidBody(masses.sum(), com, inertia)


def test_wrench_is_the_sum_over_point_masses() -> None:
    """The derivation of equation 8.22: acceleration of each point times its mass, and its moment."""
    rng = np.random.default_rng(0)
    points, masses, body = cloud(rng)
    twist, rate = rng.normal(size=(2, 6))
    w, v = twist[:3], twist[3:]
    speeds = v + np.cross(w, points)
    forces = masses[:, None] * (rate[3:] + np.cross(rate[:3], points) + np.cross(w, speeds))
    wanted = np.concatenate([np.cross(points, forces).sum(axis=0), forces.sum(axis=0)])
    assert body_wrench(body.spatial_inertia(), twist, rate) == pytest.approx(wanted, abs=1e-12)
    inertia = body.spatial_inertia()
    moments = masses[:, None] * speeds
    total = np.concatenate([np.cross(points, moments).sum(axis=0), moments.sum(axis=0)])
    assert momentum(inertia, twist) == pytest.approx(total, abs=1e-12)
    assert kinetic_energy(inertia, twist) == pytest.approx(0.5 * masses @ (speeds**2).sum(axis=1))


def test_euler_and_newton_at_the_centre() -> None:
    """Equations 8.22, 8.23 and 8.25 for a body in its principal axes."""
    body = cuboid(3.0, 0.1, 0.2, 0.3)
    rng = np.random.default_rng(1)
    twist, rate = rng.normal(size=(2, 6))
    (wx, wy, wz), v = twist[:3], twist[3:]
    ixx, iyy, izz = np.diag(body.inertia)
    ax, ay, az = rate[:3]
    moment = [ixx * ax + (izz - iyy) * wy * wz, iyy * ay + (ixx - izz) * wx * wz, izz * az + (iyy - ixx) * wx * wy]
    force = 3.0 * (rate[3:] + np.cross(twist[:3], v))
    assert body_wrench(body.spatial_inertia(), twist, rate) == pytest.approx(np.concatenate([moment, force]))


def test_same_law_in_any_frame_of_the_body() -> None:
    """Exercise 8.3 b: equation 8.43."""
    rng = np.random.default_rng(2)
    _, _, body = cloud(rng)
    a_b = pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))
    twist, rate = rng.normal(size=(2, 6))
    there = body_wrench(body.spatial_inertia(a_b), transform_twist(a_b, twist), transform_twist(a_b, rate))
    here = body_wrench(body.spatial_inertia(), twist, rate)
    assert there == pytest.approx(transform_wrench(a_b, here), abs=1e-12)


def test_shifting_the_frame_is_steiners_theorem() -> None:
    """Exercise 8.3 a: equation 8.42 with a pure translation."""
    body = cuboid(3.0, 0.1, 0.2, 0.3)
    q = np.array([0.4, -0.1, 0.7])
    shifted = body.spatial_inertia(pose(point=-q))  # the centre relative to q
    steiner = body.inertia + 3.0 * (q @ q * np.eye(3) - np.outer(q, q))
    assert shifted[:3, :3] == pytest.approx(steiner, abs=1e-14)
    assert shifted[3:, 3:] == pytest.approx(3.0 * np.eye(3))


def test_forward_undoes_inverse_one_and_many() -> None:
    rng = np.random.default_rng(3)
    _, _, body = cloud(rng)
    inertia = body.spatial_inertia()
    twists, rates = rng.normal(size=(2, 50, 6)) * 10.0
    wrenches = body_wrench(inertia, twists, rates)
    assert wrenches.shape == (50, 6)
    assert body_acceleration(inertia, twists, wrenches) == pytest.approx(rates, abs=1e-11)
    for k in (0, 49):
        assert body_wrench(inertia, twists[k], rates[k]) == pytest.approx(wrenches[k], rel=1e-13)
        assert kinetic_energy(inertia, twists)[k] == pytest.approx(float(kinetic_energy(inertia, twists[k])))


def test_power_of_the_wrench_is_the_rate_of_the_energy() -> None:
    rng = np.random.default_rng(4)
    _, _, body = cloud(rng)
    inertia = body.spatial_inertia()
    twist, wrench = rng.normal(size=(2, 6))
    rate = body_acceleration(inertia, twist, wrench)
    assert wrench @ twist == pytest.approx(momentum(inertia, twist) @ rate)


def test_momentum_seen_from_space_changes_by_the_wrench() -> None:
    """d/dt of Ad_{T^-1}^T G V is the wrench in the space frame: by finite differences along the motion."""
    rng = np.random.default_rng(5)
    _, _, body = cloud(rng)
    inertia = body.spatial_inertia()
    twist, rate = rng.normal(size=(2, 6))
    start, h = exp_pose(rng.normal(size=6)), 1e-5

    def in_space(t: float) -> np.ndarray:
        there = start @ exp_pose(t * twist + 0.5 * t * t * rate)  # the motion with this twist and rate, to second order
        return adjoint(inverse_pose(there)).T @ momentum(inertia, twist + t * rate)

    slope = (in_space(h) - in_space(-h)) / (2.0 * h)
    wrench = transform_wrench(start, body_wrench(inertia, twist, rate))
    assert slope == pytest.approx(wrench, abs=1e-7)  # h^2 and rounding over h


def test_jacobi_identity() -> None:
    """Exercise 8.5, on a batch, and through the matrices."""
    a, b, c = np.random.default_rng(6).normal(size=(3, 100, 6))
    around = [lie_bracket(x, lie_bracket(y, z)) for x, y, z in ((a, b, c), (c, a, b), (b, c, a))]
    assert sum(around) == pytest.approx(np.zeros((100, 6)), abs=1e-13)
    assert np.abs(around[0]).max() > 1.0
    left = bracket(lie_bracket(a[0], b[0]))
    right = bracket(a[0]) @ bracket(b[0]) - bracket(b[0]) @ bracket(a[0])
    assert left == pytest.approx(right, abs=1e-13)


def test_brackets_are_their_matrices() -> None:
    a, b = np.random.default_rng(7).normal(size=(2, 6))
    assert lie_bracket(a, b) == pytest.approx(bracket(a) @ b)
    assert lie_bracket(a, b) == pytest.approx(-lie_bracket(b, a))
    assert dual_bracket(a, b) == pytest.approx(bracket(a).T @ b)


def test_bad_input_is_refused() -> None:
    good = cuboid(1.0, 0.1, 0.2, 0.3).spatial_inertia()
    with pytest.raises(InputError, match="symmetric"):
        body_wrench(good + np.eye(6, k=1), np.zeros(6), np.zeros(6))
    with pytest.raises(InputError, match="shape of twist"):
        body_wrench(good, np.zeros(6), np.zeros((2, 6)))
    with pytest.raises(InputError, match="acceleration"):
        body_wrench(good, np.zeros(6), np.zeros(5))
    with pytest.raises(InputError, match=r"inertia\[2\]\[2\]"):
        body_acceleration(np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]), np.zeros(6), np.zeros(6))
    needle = RigidBody(2.0, [1.0, 0.0, 0.0], np.zeros((3, 3))).seen_from(pose(exp_rotation([0.3, 0.2, 0.1])))
    with pytest.raises(InputError, match="no inertia"):
        body_acceleration(needle.spatial_inertia(), np.zeros(6), np.zeros(6))
