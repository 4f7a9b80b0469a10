"""SDFormat, as Gazebo and Drake read it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.export.drives import DriveData, arm_bodies, exported, joint_limits
from drivetrain.export.losses import lost
from drivetrain.export.urdf import cleaned, text
from drivetrain.sizing.results import Evaluation
from drivetrain.spatial.poses import inverse_pose, pose
from drivetrain.spatial.rotations import rpy_from_rotation
from drivetrain.version import __version__
from drivetrain.whole_files import write_text


def write_sdf(evaluation: Evaluation, path: str | Path, *, payload: str | None = None) -> tuple[str, ...]:
    """Write an arm with its drives as SDF 1.9, its base fixed to the world.

    Args:
        evaluation: Of a set of drives.
        path: Of the file.
        payload: That the tip carries, by its name in the study; None: nothing.

    Returns:
        What the format loses; the same sentences stand in a comment of the file.

    Raises:
        InputError: A study without an arm, helical joints, an unknown payload, or the file cannot be written.

    Reference: SDFormat, http://sdformat.org/spec; the rotor tags are Drake's.
    """
    arm, drives = exported(evaluation, payload)
    notes = lost("sdf")
    write_text(path, sdf_text(arm, drives, notes=notes))
    return notes


def sdf_text(arm: Arm, drives: Sequence[DriveData], *, notes: Sequence[str] = ()) -> str:
    """The SDF of an arm and its drives."""
    bodies = arm_bodies(arm, "SDF")
    root = ElementTree.Element("sdf", {"version": "1.9", "xmlns:drake": "http://drake.mit.edu"})
    for line in (f"written by drivetrain {__version__}", *notes):
        root.append(ElementTree.Comment(f" {line.replace('--', '- -')} "))
    model = ElementTree.SubElement(root, "model", name=arm.name)
    _put(ElementTree.SubElement(model, "link", name="base_link"), "pose", "0 0 0 0 0 0")
    fixed = ElementTree.SubElement(model, "joint", name="base_fixed", type="fixed")
    _put(fixed, "parent", "world")
    _put(fixed, "child", "base_link")
    before = "base_link"
    for body, drive, speed, effort in zip(bodies, drives, *joint_limits(arm, drives), strict=True):
        locked = body.locked
        link = ElementTree.SubElement(model, "link", name=body.link)
        _put(link, "pose", _place(body.frame))
        inertial = ElementTree.SubElement(link, "inertial")
        _put(inertial, "pose", _place(pose(point=locked.com)))
        _put(inertial, "mass", text(locked.mass))
        tensor = ElementTree.SubElement(inertial, "inertia")
        for a in range(3):
            for b in range(a, 3):
                _put(tensor, f"i{'xyz'[a]}{'xyz'[b]}", text(locked.inertia[a, b]))
        joint = ElementTree.SubElement(model, "joint", name=body.joint, type="prismatic" if body.slides else "revolute")
        _put(joint, "parent", before)
        _put(joint, "child", body.link)
        along = ElementTree.SubElement(joint, "axis")
        _put(along, "xyz", text(cleaned(body.axis)))
        limit = ElementTree.SubElement(along, "limit")
        numbers = {"lower": body.lower, "upper": body.upper, "effort": effort, "velocity": speed}
        for name, value in numbers.items():
            if np.isfinite(value):
                _put(limit, name, text(value))
        dynamics = ElementTree.SubElement(along, "dynamics")
        _put(dynamics, "damping", text(drive.viscous))
        _put(dynamics, "friction", text(drive.coulomb))
        _put(joint, "drake:rotor_inertia", text(drive.rotor_inertia))
        _put(joint, "drake:gear_ratio", text(drive.ratio))
        before = body.link
    tip = ElementTree.SubElement(model, "frame", name="tip", attached_to=before)
    _put(tip, "pose", _place(inverse_pose(bodies[-1].frame) @ arm.tip))
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _put(parent: ElementTree.Element, name: str, content: str) -> None:
    ElementTree.SubElement(parent, name).text = content


def _place(stands: Array) -> str:
    return text([*cleaned(stands[:3, 3]), *cleaned(rpy_from_rotation(stands[:3, :3]))])
