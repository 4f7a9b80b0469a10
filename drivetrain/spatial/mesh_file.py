"""Meshes from files: STL, OBJ, PLY and what else the package trimesh reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arrays import axes_of, checked_array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.mesh_inertia import TriangleMesh
from drivetrain.whole_files import is_there


def read_mesh(path: str | Path, *, scale: Any = 1.0) -> TriangleMesh:
    """The triangles of a mesh file; several bodies in one file become one mesh.

    Args:
        path: Of a ``.stl``, ``.obj``, ``.ply`` or other file that trimesh reads (``pip install "drivetrain[mesh]"``).
        scale: Metres a unit of the file, one factor or one an axis, (3,), as in URDF: 0.001 for a file in millimetres.
            Where it mirrors, the triangles are turned round, so that they still face outwards.

    Returns:
        The mesh [m].

    Raises:
        InputError: No such file, none that can be read, a scale of zero, or trimesh is not installed.
    """
    file = Path(path)
    factors = checked_array(np.broadcast_to(scale, 3) if axes_of(scale) == 0 else scale, (3,), "scale")
    if not factors.all():
        raise InputError(Fault("scale", "must not be zero", factors.tolist()))
    if not is_there(file):
        raise InputError(Fault(str(file), "no such file"))
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
        # Corners are merged later, exactly: a merge by distance could close what is open.
        loaded = trimesh.load(file, force="mesh", process=False)
    except (ValueError, TypeError, KeyError, IndexError, OSError, AttributeError, NotImplementedError) as error:
        raise InputError(Fault(str(file), f"trimesh cannot read it: {error}")) from error
    if not len(getattr(loaded, "faces", ())):
        raise InputError(Fault(str(file), "holds no triangles"))
    return loaded
