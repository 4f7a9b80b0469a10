"""Shapes of the links of a URDF file: visual shapes, else collision shapes; meshes are read by the package trimesh."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.model import origin_of
from drivetrain.arm.files.xml import PACKAGE, Reader, package_file, read_document
from drivetrain.arrays import Array
from drivetrain.errors import InputError
from drivetrain.spatial.mesh_inertia import read_mesh
from drivetrain.whole_files import is_there

CELLS = 9  # grid cells along the longest side of a mesh; corners in one cell are merged
ROUND = np.exp(2j * np.pi * np.arange(12) / 12)  # corners of a circle about z, as x + iy
CORNERS = np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])  # corners of a square
Triangles = tuple[Array, np.ndarray]  # corners [m], (m, 3); indices of each triangle's corners, outward normal, (k, 3)


def link_shapes(arm: Arm) -> list[tuple[int, Triangles]]:
    """Shapes in the base frame, all joints at zero, each with the index of the link that carries it (-1: base).

    An arm without a URDF file has none; shapes that cannot be read are left out.
    """
    try:
        root = read_document(Path(arm.file)) if arm.file else None
    except InputError:
        return []
    if root is None or root.tag != "robot":
        return []
    found = []
    for link in root.findall("link"):
        name = link.get("name", "")
        if name not in arm.frames or arm.frames[name][0] not in (*arm.link_names, ""):
            continue  # link of another root, or of a linkage
        carrier, frame = arm.link_index(name), arm.link_frame(name)
        for kind in ("visual", "collision"):
            known = [shape for one in link.findall(kind) if (shape := _shape(one, Path(arm.file))) is not None]
            for origin, (points, faces) in known:
                at = frame @ origin
                found.append((carrier, (points @ at[:3, :3].T + at[:3, 3], faces)))
            if known:
                break
    return found


def _shape(element: ElementTree.Element, file: Path) -> tuple[Array, Triangles] | None:
    """Frame of a shape in that of its link, (4, 4), and the shape in its own frame; None if they cannot be read."""
    reader = Reader(str(file))
    try:
        origin, shape = origin_of(reader, element, ""), _geometry(reader, element.find("geometry"), file)
    except (ValueError, InputError):
        return None
    return None if shape is None or reader.faults.found else (origin, shape)


def _geometry(reader: Reader, geometry: ElementTree.Element | None, file: Path) -> Triangles | None:
    for one in [] if geometry is None else geometry:
        if one.tag == "mesh":
            path, scale = mesh_path(one.get("filename", ""), file), reader.numbers(one, "scale", "", [1.0] * 3)
            return None if path is None else _coarse(path, tuple(scale.tolist()))
        if one.tag == "box" and reader.text(one, "size", ""):
            return box(reader.numbers(one, "size", "", [0.0] * 3))
        if one.tag == "cylinder":
            radius, length = reader.number(one, "radius", ""), reader.number(one, "length", "")
            return _stacked([(radius * ROUND, side) for side in (-length / 2, length / 2)])
        if one.tag == "sphere":
            radius, tilts = reader.number(one, "radius", ""), np.linspace(-0.5 * np.pi, 0.5 * np.pi, 7)
            return _stacked([(radius * np.cos(a) * ROUND, radius * np.sin(a)) for a in tilts])
    return None


def mesh_path(name: str, file: Path) -> Path | None:
    """The file of a mesh: relative to the URDF file, or in its package."""
    if name.startswith(PACKAGE):
        return package_file(name, file)
    place = file.parent / name.removeprefix("file://")
    return place if is_there(place) else None


def box(size: Array) -> Triangles:
    x, y, z = 0.5 * np.asarray(size)
    return _stacked([(x * CORNERS.real + 1j * y * CORNERS.imag, side) for side in (-z, z)])


def _stacked(rings: list[tuple[Array, float]]) -> Triangles:
    """A body with flat ends from rings of equally many corners (x + iy), each at its height."""
    points = np.array([[at.real, at.imag, z] for ring, z in rings for at in ring])
    around, one = len(rings[0][0]), np.arange(len(rings[0][0]))
    end = np.stack([np.zeros_like(one), one, (one + 1) % around], axis=1)[1:-1]
    low = np.stack([one, (one + 1) % around, one + around], axis=1)
    high = np.stack([(one + 1) % around, (one + 1) % around + around, one + around], axis=1)
    sides = [face + k * around for k in range(len(rings) - 1) for face in (low, high)]
    return points, np.concatenate([end[:, ::-1], *sides, end + (len(rings) - 1) * around])


@lru_cache(maxsize=64)
def _coarse(path: Path, scale: tuple[float, ...]) -> Triangles:
    """A mesh with the corners of each grid cell merged, which is sufficient for a picture."""
    mesh = read_mesh(path, scale=np.array(scale))
    low = mesh.vertices.min(axis=0)
    cells = np.floor((mesh.vertices - low) * (CELLS / np.ptp(mesh.vertices, axis=0).max()))
    _, place, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    points = np.stack([np.bincount(place.ravel(), mesh.vertices[:, k]) for k in range(3)], axis=1) / count[:, None]
    faces = place.ravel()[mesh.faces]
    flat = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    return points, np.unique(faces[~flat], axis=0)
