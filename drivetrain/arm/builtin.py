"""The built-in arms; ``robots/SOURCES.md`` states the sources of their data. Loading one gives no warnings."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm
from drivetrain.arm.bodies import with_payload
from drivetrain.arm.checks import triangle_warning
from drivetrain.arm.dh import DHConvention, DHRow, arm_from_dh
from drivetrain.arm.files.links import arm_from_model
from drivetrain.arm.files.model import read_model
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.inertia import cylinder
from drivetrain.spatial.poses import pose, pose_from_xyz_rpy

ROBOTS = Path(__file__).with_name("robots")


def builtin_names() -> tuple[str, ...]:
    """The names of the built-in arms [-], sorted."""
    return tuple(sorted(_BUILDERS))


def builtin_arm(name: str, *, tip: str | None = None, gravity: Any = None) -> Arm:
    """A built-in arm; default gravity: 9.81 m/s^2 along -z, for the planar arms along -y as in Modern Robotics."""
    if name not in _BUILDERS:
        raise InputError(Fault("arm", "no built-in arm of that name; known: " + ", ".join(builtin_names()), name))
    return _BUILDERS[name](tip, gravity)


def _planar_2r_bare(tip: str | None, gravity: Any) -> Arm:
    """The book's 2R arm: unit links with unit point masses at their ends, no motors."""
    name, note = "planar-2r-bare", "Modern Robotics, figure 8.1: links without motors"
    return _planar_arm(name, note, tip, gravity, [1.0, 1.0], np.zeros((2, 3, 3)))


def _planar_2r(tip: str | None, gravity: Any) -> Arm:
    """The same with a unit motor at each joint, gear ratio 10."""
    # Link 1 carries motor 2 at its end: 1 kg, stator 0.005 kg m^2 about z. The book does not give the moments across z;
    # those of a disc make the tensor physically possible.
    stator = np.diag([0.0025, 0.0025, 0.005])
    note = (
        "Modern Robotics, figure 8.1 with the motors of section 8.9.2, gear ratio 10; the motors' mass, rotors "
        "included, is counted at the stators"
    )
    arm = _planar_arm("planar-2r", note, tip, gravity, [2.0, 1.0], np.array([stator, np.zeros((3, 3))]))
    return with_rotors(arm, [Rotor(10.0, 0.00125), Rotor(10.0, 0.00125)])


def _planar_arm(name: str, note: str, tip: str | None, gravity: Any, masses: list[float], inertias: Array) -> Arm:
    """Two unit links in the x-y plane, their masses at their ends."""
    _refuse_tip(name, tip)
    home = [pose(point=[1.0, 0.0, 0.0]), pose(point=[2.0, 0.0, 0.0])]
    return Arm.from_screws(
        home,
        [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, -1.0, 0.0]],
        masses,
        inertias,
        home[1],
        (0.0, -9.81, 0.0) if gravity is None else gravity,
        joint_points=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        name=name,
        notes=[note],
    )


def _ur5(tip: str | None, gravity: Any) -> Arm:
    arm, _ = arm_from_model(read_model(ROBOTS / "ur5.urdf"), tip=tip or "tool0", gravity=gravity)
    return _renamed(arm, "ur5", "the wrist inertias are kept as published; ur5-corrected has corrected ones")


def _ur5_corrected(tip: str | None, gravity: Any) -> Arm:
    """The UR5 file with wrist cylinders of 0.06 m radius."""
    model = read_model(ROBOTS / "ur5.urdf")
    links = dict(model.links)
    for name in ("wrist_1_link", "wrist_2_link", "wrist_3_link"):
        if (body := links[name]) is not None:
            links[name] = cylinder(body.mass, 0.06, 0.12)
    arm, _ = arm_from_model(replace(model, links=links), tip=tip or "tool0", gravity=gravity)
    return _renamed(arm, "ur5-corrected", "wrist links as cylinders of 0.06 m radius where the published file has 0.6")


def _panda(tip: str | None, gravity: Any) -> Arm:
    """The Panda arm with its hand, fingers closed."""
    arm, _ = arm_from_model(read_model(ROBOTS / "panda.urdf"), tip=tip or "panda_hand_tcp", gravity=gravity)
    return arm


def _table_arm(name: str, tip: str | None, gravity: Any) -> Arm:
    """An arm from one of the package's Denavit-Hartenberg tables, with its rotors."""
    data = json.loads((ROBOTS / f"{name}.json").read_text(encoding="utf-8"))
    _refuse_tip(name, tip)
    rows = []
    for row in data["rows"]:
        xx, yy, zz, xy, yz, xz = row["inertia"]
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        given = {key: row[key] for key in ("a", "alpha", "d", "theta", "mass", "com", "lower", "upper") if key in row}
        rows.append(DHRow(**given, inertia=tensor))
    arm = arm_from_dh(
        rows,
        convention=DHConvention(data["convention"]),
        base=pose_from_xyz_rpy([0.0, 0.0, 0.0], data["base_rpy"]),
        gravity=STANDARD_GRAVITY if gravity is None else gravity,
        joint_names=data["joint_names"],
        name=name,
        notes=[*data["notes"], "source: " + data["source"]],
        check_inertias=False,  # reported below, in the notes
    )
    if "payload" in data:
        arm = with_payload(arm, data["payload"]["mass"], data["payload"]["com"], np.zeros((3, 3)))
    rotors = [Rotor(row["ratio"], row["rotor_inertia"]) for row in data["rows"]]
    arm = with_rotors(arm, rotors, coupling=data.get("coupling"))
    warnings = [triangle_warning(tensor, link) for tensor, link in zip(arm.inertias, arm.link_names, strict=True)]
    return replace(arm, notes=(*arm.notes, *filter(None, warnings)))


def _refuse_tip(name: str, tip: str | None) -> None:
    if tip is not None:
        raise InputError(Fault("tip", f"{name} has no links to choose from; leave it out", tip))


def _renamed(arm: Arm, name: str, note: str) -> Arm:
    return replace(arm, name=name, notes=(note, *arm.notes))


_BUILDERS: dict[str, Callable[[str | None, Any], Arm]] = {
    "planar-2r": _planar_2r,
    "planar-2r-bare": _planar_2r_bare,
    "ur5": _ur5,
    "ur5-corrected": _ur5_corrected,
    "panda": _panda,
    **{name: partial(_table_arm, name) for name in ("puma560", "kr300", "wam")},
}
