"""Mass, centre and inertia of the uniform solid inside a closed mesh of triangles.

The volume integrals of Modern Robotics, equation 8.24, are sums over tetrahedra from a common point to each triangle,
negative if the triangle faces the point. This is exact for the polyhedron, but only if the mesh is the whole boundary
of a solid: a missing or reversed triangle changes the sum, so such meshes are refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arrays import Array, axes_of, checked_array, checked_number, frozen_array, read_only
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.spatial.inertia import RigidBody
from drivetrain.whole_files import check_size, is_there

FLAT = 1e-9  # smallest volume over area^(3/2): 0.09 for a ball, 1e-16 for a flat mesh, due to rounding


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles in space; only ``mesh_body`` checks whether they form a closed surface.

    Attributes:
        vertices: Corners [m], (m, 3); corners with identical coordinates count as one.
        faces: Indices of the three vertices of each triangle, counterclockwise as seen from outside, (k, 3).
        name: Name in error messages.
    """

    vertices: Array
    faces: np.ndarray
    name: str = "mesh"

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen_array(self.vertices, (None, 3), f"{self.name}.vertices"))
        object.__setattr__(self, "faces", _checked_faces(self.faces, len(self.vertices), f"{self.name}.faces"))


def mesh_body(mesh: TriangleMesh, *, density: float | None = None, mass: float | None = None) -> RigidBody:
    """The uniform solid inside a closed mesh. Triangles that intersect each other are not detected.

    Args:
        mesh: Closed mesh, with every triangle facing outwards (those of a cavity: into the cavity); it may consist of
            several separate solids.
        density: [kg/m^3]; give this or ``mass``.
        mass: Total mass [kg].

    Returns:
        The body, in the mesh's frame.

    Raises:
        InputError: Open edges, triangles of inconsistent orientation, a shell that is inside out, zero volume; or not
            exactly one, positive, of density and mass.

    Reference: Modern Robotics, equation 8.24. Moments of tetrahedra: D. Eberly, Polyhedral mass properties (2002).
    """
    _check_one_of(density, mass)
    volume, centre, second = _moments(mesh)
    rho = density if density is not None else float(mass or 0.0) / volume
    spread = rho * second
    return RigidBody(rho * volume, centre, np.trace(spread) * np.eye(3) - spread)


def _check_one_of(density: float | None, mass: float | None) -> None:
    given = {name: value for name, value in (("density", density), ("mass", mass)) if value is not None}
    if len(given) != 1:
        raise InputError(Fault("density, mass", "give one of them: density [kg/m^3] or mass [kg]", given or None))
    ((name, value),) = given.items()
    checked_number(value, name, "kg/m^3" if name == "density" else "kg", above=0.0)


def _checked_faces(faces: object, count: int, name: str) -> np.ndarray:
    indices = np.asarray(faces)
    if indices.ndim != 2 or indices.shape[1] != 3 or len(indices) == 0 or indices.dtype.kind not in "iu":
        raise InputError(Fault(name, "must be integers of shape (k, 3), k > 0", f"{indices.dtype} {indices.shape}"))
    outside = (indices < 0) | (indices >= count)
    if outside.any():
        row, column = (int(i) for i in np.argwhere(outside)[0])
        raise InputError(Fault(f"{name}[{row}]", f"must be between 0 and {count - 1}", int(indices[row, column])))
    return read_only(indices.astype(np.int64))


def _moments(mesh: TriangleMesh) -> tuple[float, Array, Array]:
    """Volume, centre, and second moments about the centre, for unit density."""
    vertices, inverse = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)  # + 0.0 makes -0 equal to +0
    faces = inverse.reshape(-1)[mesh.faces]
    # Triangles with two equal corners have no area.
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if len(faces) == 0:
        raise InputError(Fault(mesh.name, "has no triangle with an area"))
    _check_closed(faces, mesh.name)
    # Relative to the middle of the mesh, so that a mesh far from the origin loses no digits.
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    corners = (vertices - middle)[faces]
    volumes = np.einsum("ki,ki->k", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    _check_outwards(faces, vertices, volumes, corners, mesh.name)
    volume = float(volumes.sum())
    sums = corners.sum(axis=1)
    centre = volumes @ sums / (4.0 * volume)
    about_middle = np.einsum("k,ki,kj->ij", volumes, sums, sums) + np.einsum("k,kai,kaj->ij", volumes, corners, corners)
    return volume, middle + centre, about_middle / 20.0 - volume * np.outer(centre, centre)


def _check_closed(faces: np.ndarray, name: str) -> None:
    """Raise ``InputError`` unless every edge is used equally often in both directions.

    The message distinguishes open edges from inconsistent orientation.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = edges[:, 0] < edges[:, 1]
    _, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    uses = np.bincount(which.reshape(-1))
    balance = np.bincount(which.reshape(-1), weights=np.where(forward, 1.0, -1.0))
    open_edges = int(np.count_nonzero(uses % 2))
    disputed = int(np.count_nonzero((uses % 2 == 0) & (balance != 0.0)))
    faults = []
    if open_edges:
        hint = "close the holes, or merge corners that should be one (they must agree to the last digit)"
        faults.append(Fault(name, f"is not closed: {open_edges} open edges of {len(uses)}", None, hint))
    if disputed:
        problem = f"is not consistently wound: {disputed} edges of {len(uses)} are run the same way by both triangles"
        faults.append(Fault(name, problem, None, "order corners counterclockwise as seen from outside"))
    raise_faults(faults)


def _check_outwards(faces: np.ndarray, vertices: Array, volumes: Array, corners: Array, name: str) -> None:
    """Raise ``InputError`` for a shell that is inside out, unless it is a cavity within another shell."""
    from scipy.sparse import coo_array  # slow to import, and few arms have meshes without an inertia
    from scipy.sparse.csgraph import connected_components

    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if abs(volumes.sum()) <= FLAT * areas.sum() ** 1.5:
        raise InputError(Fault(name, "encloses no volume", float(volumes.sum())))
    ones = np.ones(2 * len(faces))
    links = coo_array((ones, (faces[:, :2].ravel("F"), faces[:, 1:].ravel("F"))), shape=(len(vertices),) * 2)
    count, shell_of_vertex = connected_components(links, directed=False)
    shells = shell_of_vertex[faces[:, 0]]
    inside = np.bincount(shells, weights=volumes, minlength=count)
    solid = [_box(vertices[shell_of_vertex == shell]) for shell in np.flatnonzero(inside > 0.0)]
    for shell in np.flatnonzero(inside < 0.0):
        low, high = _box(vertices[shell_of_vertex == shell])
        if not any((a <= low).all() and (high <= b).all() for a, b in solid):
            part = "" if count == 1 else f" (the part from {np.round(low, 6)} to {np.round(high, 6)} m)"
            problem = f"is inside out{part}: its triangles face inwards"
            raise InputError(Fault(name, problem, None, "reverse the order of their corners: faces[:, ::-1]"))


def _box(points: Array) -> tuple[Array, Array]:
    return points.min(axis=0), points.max(axis=0)


def read_mesh(path: str | Path, *, scale: Any = 1.0) -> TriangleMesh:
    """The triangles of a mesh file; several bodies in one file become one mesh.

    Args:
        path: A ``.stl``, ``.obj``, ``.ply`` or other file that trimesh reads (``pip install "drivetrain[mesh]"``).
        scale: Metres per unit of the file, a number or one per axis, (3,), as in URDF: 0.001 for a file in millimetres.
            If it mirrors, the triangles are reversed, so that they still face outwards.

    Returns:
        The mesh [m].

    Raises:
        InputError: No such file, a file that cannot be read, a scale of zero, or trimesh is not installed.
    """
    file = Path(path)
    factors = checked_array(np.broadcast_to(scale, 3) if axes_of(scale) == 0 else scale, (3,), "scale")
    if not factors.all():
        raise InputError(Fault("scale", "must not be zero", factors.tolist()))
    if not is_there(file):
        raise InputError(Fault(str(file), "no such file"))
    check_size(file, file.stat().st_size)
    loaded = _loaded(file)
    faces = np.asarray(loaded.faces, dtype=np.int64)
    if factors.prod() < 0.0:
        faces = faces[:, ::-1]
    return TriangleMesh(np.asarray(loaded.vertices, dtype=np.float64) * factors, faces, file.name)


def _loaded(file: Path) -> Any:
    try:
        import trimesh
    except ImportError:
        hint = 'install it with: pip install "drivetrain[mesh]"'
        raise InputError(Fault(str(file), "reading a mesh needs the package trimesh", hint=hint)) from None
    try:
        # Corners are merged later, only if identical: a merge by distance could close open edges.
        loaded = trimesh.load(file, force="mesh", process=False)
    except (ValueError, TypeError, KeyError, IndexError, OSError, AttributeError, NotImplementedError) as error:
        raise InputError(Fault(str(file), f"trimesh cannot read it: {error}")) from error
    if not len(getattr(loaded, "faces", ())):
        raise InputError(Fault(str(file), "holds no triangles"))
    return loaded
