"""Rigid bodies against sets of point masses, quadrature and values of Modern Robotics."""

from __future__ import annotations

import re

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.spatial.inertia import (
    RigidBody,
    combined,
    cuboid,
    cylinder,
    ellipsoid,
    half_axes,
    parallel_axis,
    triangle_excess,
)
from drivetrain.spatial.poses import adjoint, inverse_pose, pose
from drivetrain.spatial.rotations import exp_rotation, skew


def body_of(points: np.ndarray, masses: np.ndarray) -> RigidBody:
    """A body of point masses, by direct summation."""
    com = masses @ points / masses.sum()
    inertia = sum(m * ((r @ r) * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, points - com, strict=True))
    return RigidBody(masses.sum(), com, inertia)


def random_cloud(rng: np.random.Generator, count: int = 7) -> tuple[np.ndarray, np.ndarray]:
    return rng.normal(size=(count, 3)), rng.uniform(0.1, 2.0, size=count)


def test_combining_two_clouds_is_the_cloud_of_both() -> None:
    rng = np.random.default_rng(1)
    (p1, m1), (p2, m2) = random_cloud(rng), random_cloud(rng)
    whole = combined([body_of(p1, m1), body_of(p2, m2)])
    wanted = body_of(np.vstack([p1, p2]), np.concatenate([m1, m2]))
    assert whole.mass == pytest.approx(wanted.mass)
    assert whole.com == pytest.approx(wanted.com, abs=1e-15)
    assert whole.inertia == pytest.approx(wanted.inertia, abs=1e-13)


def test_subtracting_a_part_gives_the_rest() -> None:
    rng = np.random.default_rng(2)
    (p1, m1), (p2, m2) = random_cloud(rng), random_cloud(rng)
    first, second = body_of(p1, m1), body_of(p2, m2)
    rest = combined([combined([first, second]), second.negative()])
    assert rest.com == pytest.approx(first.com, abs=1e-14)
    assert rest.inertia == pytest.approx(first.inertia, abs=1e-13)


def test_seen_from_another_frame_is_the_moved_cloud() -> None:
    rng = np.random.default_rng(3)
    points, masses = random_cloud(rng)
    a_b = pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))
    moved = body_of(points @ a_b[:3, :3].T + a_b[:3, 3], masses)
    found = body_of(points, masses).seen_from(a_b)
    assert found.com == pytest.approx(moved.com, abs=1e-14)
    assert found.inertia == pytest.approx(moved.inertia, abs=1e-13)


def test_massless_bodies_combine() -> None:
    spinner = RigidBody(0.0, [1, 2, 3], np.diag([0, 0, 2.0]))
    assert combined([spinner, spinner]).inertia == pytest.approx(np.diag([0, 0, 4.0]))
    assert combined([spinner, spinner]).com == pytest.approx([1, 2, 3])
    assert combined([]).mass == 0.0


def test_steiner() -> None:
    body = cuboid(3.0, 0.1, 0.2, 0.3)
    about = body.inertia_about([0.5, 0.0, 0.0])
    assert about - body.inertia == pytest.approx(np.diag([0.0, 0.75, 0.75]))
    assert parallel_axis(3.0, [0.5, 0, 0]) == pytest.approx(np.diag([0.0, 0.75, 0.75]))


def test_spatial_inertia_gives_the_energy_of_the_cloud() -> None:
    rng = np.random.default_rng(4)
    points, masses = random_cloud(rng)
    twist = rng.normal(size=6)
    speeds = np.cross(twist[:3], points) + twist[3:]
    energy = 0.5 * masses @ (speeds**2).sum(axis=1)
    assert 0.5 * twist @ body_of(points, masses).spatial_inertia() @ twist == pytest.approx(energy)


def test_spatial_inertia_in_another_frame_obeys_8_42() -> None:
    rng = np.random.default_rng(5)
    body = body_of(*random_cloud(rng))
    a_b = pose(exp_rotation(rng.normal(size=3)), rng.normal(size=3))
    back = adjoint(inverse_pose(a_b))
    direct = body.seen_from(a_b).spatial_inertia()
    assert body.spatial_inertia(a_b) == pytest.approx(back.T @ body.spatial_inertia() @ back, abs=1e-13)
    assert body.spatial_inertia(a_b) == pytest.approx(direct, abs=1e-13)


def test_spatial_inertia_at_the_centre_is_block_diagonal() -> None:
    matrix = cylinder(2.0, 0.1, 0.5).spatial_inertia()
    assert matrix[3:, 3:] == pytest.approx(2.0 * np.eye(3))
    assert not matrix[:3, 3:].any()


def test_principal_axes_diagonalise() -> None:
    rng = np.random.default_rng(6)
    body = body_of(*random_cloud(rng))
    moments, axes = body.principal_axes()
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes.T @ body.inertia @ axes == pytest.approx(np.diag(moments), abs=1e-13)
    assert (np.diff(moments) >= 0).all()


def gauss_points(count: int) -> tuple[np.ndarray, np.ndarray]:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    grid = np.array(np.meshgrid(nodes, nodes, nodes, indexing="ij")).reshape(3, -1).T
    return grid, np.prod(np.array(np.meshgrid(weights, weights, weights, indexing="ij")).reshape(3, -1), axis=0)


def test_cuboid_is_its_integral() -> None:
    grid, weights = gauss_points(3)  # exact for second moments
    wanted = body_of(grid * np.array([0.2, 0.3, 0.7]) / 2, 5.0 * weights / weights.sum())
    assert cuboid(5.0, 0.2, 0.3, 0.7).inertia == pytest.approx(wanted.inertia, abs=1e-15)


def test_cylinder_is_its_integral() -> None:
    grid, weights = gauss_points(8)
    radius, angle, z = (grid[:, 0] + 1) / 2, np.pi * (grid[:, 1] + 1), grid[:, 2] / 2
    points = np.column_stack([0.3 * radius * np.cos(angle), 0.3 * radius * np.sin(angle), 0.9 * z])
    masses = weights * radius  # volume element r dr
    wanted = body_of(points, 2.0 * masses / masses.sum())
    # 8 nodes over the circumference.
    assert cylinder(2.0, 0.3, 0.9).inertia == pytest.approx(wanted.inertia, rel=1e-5, abs=1e-7)


def test_ellipsoid_is_its_integral() -> None:
    rng = np.random.default_rng(7)
    points = rng.uniform(-1, 1, size=(200_000, 3))
    points = points[(points**2).sum(axis=1) <= 1] * np.array([0.1, 0.2, 0.3])
    wanted = 4.0 * np.diag(np.array([[0, 1, 1], [1, 0, 1], [1, 1, 0]]) @ (points**2).mean(axis=0))
    found = ellipsoid(4.0, 0.1, 0.2, 0.3).inertia
    assert np.diag(found) == pytest.approx(np.diag(wanted), rel=0.01)  # 1e5 samples: 0.3 %
    assert half_axes(4.0, found) == pytest.approx([0.3, 0.2, 0.1])


def test_triangle_excess_of_known_bodies() -> None:
    assert triangle_excess(np.eye(3)) == pytest.approx(-1 / 3)
    assert triangle_excess(np.diag([1.0, 1.0, 2.0])) == pytest.approx(0.0, abs=1e-15)
    assert triangle_excess(np.diag([0.0, 0.0, 1.0])) == pytest.approx(1.0)
    assert triangle_excess(np.zeros((3, 3))) == pytest.approx(-1 / 3)  # a point mass
    assert triangle_excess(-np.eye(3)) == float("inf")


def test_skew_in_the_spatial_inertia_has_the_books_sign() -> None:
    body = RigidBody(2.0, [0.1, 0.2, 0.3], np.zeros((3, 3)))
    assert body.spatial_inertia()[:3, 3:] == pytest.approx(2.0 * skew([0.1, 0.2, 0.3]))


def test_bad_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="com"):
        RigidBody(1.0, [0, 0], np.eye(3))
    with pytest.raises(InputError, match="inertia"):
        RigidBody(1.0, [0, 0, 0], np.full((3, 3), np.nan))


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: cuboid(-1.0, 1.0, 1.0, 1.0), "mass: must not be negative"),
        (lambda: cuboid(1.0, -1.0, 1.0, -2.0), "length: must not be negative.*height: must not be negative"),
        (lambda: cylinder(1.0, float("nan"), 1.0), "radius: must be finite"),
        (lambda: ellipsoid(1.0, 1.0, float("inf"), 1.0), "b: must be finite"),
        (lambda: cylinder("heavy", 1.0, 1.0), "mass"),
        (lambda: RigidBody(1.0, np.zeros(3), [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "symmetric"),
        (lambda: cuboid(1.0, 1.0, 1.0, 1.0).seen_from(np.diag([1.0, 1.0, 2.0, 1.0])), "must be a pose"),
        (lambda: cuboid(1.0, 1.0, 1.0, 1.0).seen_from(np.diag([1.0, 1.0, -1.0, 1.0])), "must be a pose"),
        (lambda: cuboid(1.0, 1.0, 1.0, 1.0).spatial_inertia(np.diag([1.0, 1.0, 1.0, 2.0])), "must be a pose"),
    ],
)
def test_impossible_bodies_are_refused(make, complaint):
    with pytest.raises(InputError) as caught:
        make()
    assert re.search(complaint, str(caught.value), re.S), str(caught.value)


def test_adding_and_subtracting_a_body_leaves_no_asymmetry():
    # A distant, rotated body of 1000 kg is added and subtracted: the rest is of the size of rounding, and symmetric.
    rng = np.random.default_rng(31)
    heavy = cuboid(1e3, 1.0, 2.0, 3.0).seen_from(pose(exp_rotation(rng.normal(size=3)), 10.0 * rng.normal(size=3)))
    left = combined([heavy, heavy.negative(), cuboid(1e-6, 1e-3, 1e-3, 1e-3)])
    assert np.array_equal(left.inertia, left.inertia.T)
