"""Mesh files written and read back: both kinds of STL, OBJ, PLY; units, mirroring and unreadable files."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drivetrain.errors import InputError
from drivetrain.spatial.inertia import cuboid
from drivetrain.spatial.mesh_inertia import mesh_body, read_mesh

BOX = trimesh.creation.box((200.0, 300.0, 700.0))  # mm
BODY = cuboid(5.0, 0.2, 0.3, 0.7)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply"])
def test_read_in_millimetres(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"box.{kind.split('_')[0]}"
    BOX.export(path, file_type=kind)
    body = mesh_body(read_mesh(path, scale=0.001), mass=5.0)
    assert body.inertia == pytest.approx(BODY.inertia, rel=1e-9, abs=1e-12)
    assert mesh_body(read_mesh(str(path), scale=0.001), density=2.0).mass == pytest.approx(0.084)


def test_a_binary_stl_written_by_hand(tmp_path: Path) -> None:
    """80 bytes of header, a count, then 12 floats and 2 bytes per triangle."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows = np.zeros(len(BOX.faces), record)
    rows["corners"] = BOX.vertices[BOX.faces] / 1000.0
    path = tmp_path / "hand.stl"
    path.write_bytes(b"hand made".ljust(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())
    # Single precision: 7 digits.
    assert mesh_body(read_mesh(path), mass=5.0).inertia == pytest.approx(BODY.inertia, rel=1e-6, abs=1e-8)


def test_mirrored_and_stretched(tmp_path: Path) -> None:
    path = tmp_path / "box.stl"
    BOX.export(path)
    mirrored = mesh_body(read_mesh(path, scale=(-0.001, 0.002, 0.001)), mass=5.0)
    assert mirrored.inertia == pytest.approx(cuboid(5.0, 0.2, 0.6, 0.7).inertia, rel=1e-6, abs=1e-8)


def test_what_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_mesh(tmp_path / "none.stl")
    for name, content in (("a.stl", b"garbage"), ("b.obj", b""), ("c.txt", b"1 2 3")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=r"cannot read|no triangles"):
            read_mesh(tmp_path / name)
    BOX.export(tmp_path / "box.stl")
    with pytest.raises(InputError, match="not be zero"):
        read_mesh(tmp_path / "box.stl", scale=0.0)
    with pytest.raises(InputError, match="scale"):
        read_mesh(tmp_path / "box.stl", scale=[1.0, 1.0])


def test_faults_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "open.stl"
    trimesh.Trimesh(BOX.vertices, BOX.faces[1:], process=False).export(path)
    with pytest.raises(InputError, match=r"open\.stl: is not closed: 3 open edges"):
        mesh_body(read_mesh(path), density=1.0)


def test_without_trimesh_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    BOX.export(tmp_path / "box.stl")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(InputError, match=r"drivetrain\[mesh\]"):
        read_mesh(tmp_path / "box.stl")
