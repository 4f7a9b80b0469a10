"""Solids inside meshes against closed forms, random points, composition and trimesh's integrals."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from drivetrain.errors import InputError
from drivetrain.spatial.inertia import RigidBody, combined, cuboid, cylinder, ellipsoid
from drivetrain.spatial.mesh_inertia import TriangleMesh, mesh_body
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation

# Two triangles per side, counterclockwise from outside; corner index = x + 2 y + 4 z.
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
BOX_FACES = np.array([triangle for a, b, c, d in SIDES for triangle in ((a, b, c), (a, c, d))])


def box(size: list[float], centre: list[float] = [0.0, 0.0, 0.0]) -> tuple[np.ndarray, np.ndarray]:  # noqa: B006
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5
    return corners * size + centre, BOX_FACES


def joined(*parts: tuple[np.ndarray, np.ndarray]) -> TriangleMesh:
    offsets = np.cumsum([0, *[len(vertices) for vertices, _ in parts]])
    faces = [f + offset for (_, f), offset in zip(parts, offsets, strict=False)]
    return TriangleMesh(np.vstack([vertices for vertices, _ in parts]), np.vstack(faces))


def same(found: RigidBody, wanted: RigidBody, rel: float = 1e-13) -> None:
    size = np.abs(wanted.inertia).max()
    assert found.mass == pytest.approx(wanted.mass, rel=rel)
    assert found.com == pytest.approx(wanted.com, rel=rel, abs=1e-14)
    assert found.inertia == pytest.approx(wanted.inertia, abs=rel * size)


def test_box_is_the_closed_form() -> None:
    same(mesh_body(TriangleMesh(*box([0.2, 0.3, 0.7])), mass=5.0), cuboid(5.0, 0.2, 0.3, 0.7))
    assert mesh_body(TriangleMesh(*box([0.2, 0.3, 0.7])), density=1.0).mass == pytest.approx(0.042, rel=1e-14)


def test_turned_and_moved_far_away() -> None:
    """One kilometre from the origin, where direct sums lose six digits of the second moments."""
    turn, far = exp_rotation([0.3, -0.8, 1.1]), np.array([1000.0, -500.0, 300.0])
    vertices, faces = box([0.2, 0.3, 0.7])
    found = mesh_body(TriangleMesh(vertices @ turn.T + far, faces), mass=5.0)
    # Corners are rounded to 1e-13 m, with sides of 0.2 m.
    same(found, cuboid(5.0, 0.2, 0.3, 0.7).seen_from(pose(turn, far)), rel=1e-11)


def test_tetrahedron_is_the_closed_form() -> None:
    """Corner at the origin, unit legs: volume 1/6, centre 1/4, the integral of x^2 is 1/60 and that of x y 1/120."""
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    body = mesh_body(mesh, density=1.0)
    assert body.mass == pytest.approx(1 / 6)
    assert body.com == pytest.approx([0.25] * 3)
    tensor = body.inertia_about([0, 0, 0])
    assert tensor == pytest.approx((1 / 30 + 1 / 120) * np.eye(3) - np.full((3, 3), 1 / 120), abs=1e-16)


def test_ball_and_cylinder_are_approached_with_the_square_of_the_edge() -> None:
    for make, wanted in (
        (lambda k: trimesh.creation.icosphere(subdivisions=k, radius=0.1), ellipsoid(1.0, 0.1, 0.1, 0.1)),
        (lambda k: trimesh.creation.cylinder(radius=0.1, height=0.3, sections=2 ** (k + 3)), cylinder(1.0, 0.1, 0.3)),
    ):
        errors = []
        for k in (2, 3, 4):
            mesh = make(k)
            body = mesh_body(TriangleMesh(mesh.vertices, mesh.faces), mass=1.0)
            errors.append(np.abs(body.inertia - wanted.inertia).max())
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
        assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("seed", range(5))
def test_hull_of_points_against_samples_within_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hull = ConvexHull(rng.normal([1.0, 2.0, 3.0], size=(12, 3)))
    normals, faces = hull.equations[:, :3], hull.simplices.copy()
    a, b, c = hull.points[faces].transpose(1, 0, 2)
    inward = np.sum(np.cross(b - a, c - a) * normals, axis=1) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    body = mesh_body(TriangleMesh(hull.points, faces), density=2.0)
    low, high = hull.points.min(axis=0), hull.points.max(axis=0)
    cloud = rng.uniform(low, high, size=(400_000, 3))
    cloud = cloud[(cloud @ normals.T + hull.equations[:, 3] <= 0.0).all(axis=1)]
    spread = np.cov(cloud.T, bias=True)
    # About 1e5 points are inside: a standard deviation of 0.3 % of a second moment, of which 4 are allowed.
    assert body.mass == pytest.approx(2.0 * hull.volume, rel=1e-12)
    assert body.com == pytest.approx(cloud.mean(axis=0), abs=0.02)
    wanted = body.mass * (np.trace(spread) * np.eye(3) - spread)
    assert body.inertia == pytest.approx(wanted, abs=0.012 * np.abs(wanted).max())


@pytest.mark.parametrize("shape", ["annulus", "torus", "capsule", "cone"])
def test_trimesh_agrees(shape: str) -> None:
    makers = {
        "annulus": lambda: trimesh.creation.annulus(r_min=0.2, r_max=0.5, height=0.3),
        "torus": lambda: trimesh.creation.torus(major_radius=1.0, minor_radius=0.3),
        "capsule": lambda: trimesh.creation.capsule(height=1.0, radius=0.2),
        "cone": lambda: trimesh.creation.cone(radius=0.4, height=1.0),
    }
    mesh = makers[shape]()
    mesh.apply_transform(pose(exp_rotation([1.0, 0.2, -0.4]), [0.3, -0.2, 0.6]))
    mesh.density = 7.0
    found = mesh_body(TriangleMesh(mesh.vertices, mesh.faces), density=7.0)
    same(found, RigidBody(mesh.mass, mesh.center_mass, mesh.moment_inertia), rel=1e-12)


def test_a_cavity_is_subtracted_and_a_second_solid_added() -> None:
    vertices, faces = box([0.2, 0.2, 0.2], [0.05, 0.0, 0.0])
    mesh = joined(box([1.0, 0.5, 0.5]), (vertices, faces[:, ::-1]), box([0.3, 0.3, 0.3], [2.0, 0.0, 0.0]))
    whole, hole, second = cuboid(250.0, 1.0, 0.5, 0.5), cuboid(8.0, 0.2, 0.2, 0.2), cuboid(27.0, 0.3, 0.3, 0.3)
    hole, second = hole.seen_from(pose(point=[0.05, 0, 0])), second.seen_from(pose(point=[2.0, 0, 0]))
    same(mesh_body(mesh, density=1000.0), combined([whole, hole.negative(), second]))


def test_separate_triangles_are_merged_to_a_mesh() -> None:
    """As in an STL file: every triangle has its own corners, some with a coordinate of -0."""
    vertices, faces = box([2.0, 2.0, 2.0], [1.0, 1.0, 1.0])
    soup = vertices[faces].reshape(-1, 3)
    soup[::2][soup[::2] == 0.0] = -0.0
    flat = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])  # and a triangle without area
    mesh = TriangleMesh(np.vstack([soup, flat]), np.arange(39).reshape(-1, 3))
    same(mesh_body(mesh, mass=3.0), cuboid(3.0, 2.0, 2.0, 2.0).seen_from(pose(point=[1, 1, 1])))


def test_two_boxes_that_share_an_edge_are_a_solid() -> None:
    """Four triangles share the edge, two in each direction: the mesh is still a closed boundary."""
    parts = box([1.0, 1.0, 1.0]), box([1.0, 1.0, 1.0], [1.0, 1.0, 0.0])
    bodies = [cuboid(1.0, 1.0, 1.0, 1.0).seen_from(pose(point=p)) for p in ([0, 0, 0], [1, 1, 0])]
    same(mesh_body(joined(*parts), density=1.0), combined(bodies))


def refusal(mesh: TriangleMesh) -> str:
    with pytest.raises(InputError) as caught:
        mesh_body(mesh, density=1.0)
    return str(caught.value)


def test_an_open_mesh_is_refused_with_its_open_edges_counted() -> None:
    vertices, faces = box([1.0, 1.0, 1.0])
    assert "3 open edges of 18" in refusal(TriangleMesh(vertices, faces[1:]))
    assert "4 open edges of 17" in refusal(TriangleMesh(vertices, faces[2:], "lid off"))
    assert "lid off" in refusal(TriangleMesh(vertices, faces[2:], "lid off"))
    torn, moved = np.vstack([vertices, vertices[3] + 1e-9]), faces.copy()
    moved[0][moved[0] == 3] = 8
    assert "4 open edges of 20" in refusal(TriangleMesh(torn, moved))


def test_a_triangle_turned_round_is_refused() -> None:
    vertices, faces = box([1.0, 1.0, 1.0])
    faces = faces.copy()
    faces[4] = faces[4, ::-1]
    text = refusal(TriangleMesh(vertices, faces))
    assert "3 edges of 18 are run the same way" in text
    assert "open" not in text


def test_all_faults_are_reported_together() -> None:
    vertices, faces = box([1.0, 1.0, 1.0])
    faces = faces.copy()
    faces[4] = faces[4, ::-1]
    text = refusal(TriangleMesh(vertices, faces[:-1]))
    assert "open edges" in text
    assert "run the same way" in text


def test_inside_out_is_refused_also_as_one_part_of_several() -> None:
    vertices, faces = box([1.0, 1.0, 1.0])
    assert "inside out" in refusal(TriangleMesh(vertices, faces[:, ::-1]))
    text = refusal(joined((vertices, faces), (vertices * 0.5 + [5.0, 0.0, 0.0], faces[:, ::-1])))
    assert "inside out" in text
    assert "4.75" in text


def test_no_volume_is_refused() -> None:
    two_sided = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
    assert "encloses no volume" in refusal(two_sided)
    assert "no triangle with an area" in refusal(TriangleMesh([[0, 0, 0], [1, 0, 0]], [[0, 1, 1]]))


@pytest.mark.parametrize("given", [{}, {"density": 1.0, "mass": 1.0}, {"mass": 0.0}, {"density": -1.0}])
def test_exactly_one_of_density_and_mass(given: dict[str, float]) -> None:
    with pytest.raises(InputError, match=r"density|mass"):
        mesh_body(TriangleMesh(*box([1.0, 1.0, 1.0])), **given)


def test_bad_arrays_are_refused() -> None:
    vertices, faces = box([1.0, 1.0, 1.0])
    with pytest.raises(InputError, match="between 0 and 7"):
        TriangleMesh(vertices, faces + 1)
    with pytest.raises(InputError, match="integers"):
        TriangleMesh(vertices, faces.astype(float))
    with pytest.raises(InputError, match="finite"):
        TriangleMesh(np.where(vertices > 0, np.nan, vertices), faces)
