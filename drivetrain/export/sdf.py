"""SDFormat for Gazebo and Drake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arrays import Array
from drivetrain.export.drives import Body, arm_bodies, exported, in_frame, joint_limits, pins
from drivetrain.export.losses import lost
from drivetrain.export.urdf import cleaned, comments, text
from drivetrain.sizing.results import Evaluation
from drivetrain.spatial.poses import inverse_pose, pose
from drivetrain.spatial.rotations import rpy_from_rotation
from drivetrain.version import __version__
from drivetrain.whole_files import write_text


def write_sdf(evaluation: Evaluation, path: str | Path, *, payload: str | None = None) -> tuple[str, ...]:
    """Write an arm with its drives as SDF 1.9, with its base fixed to the world.

    Args:
        evaluation: Evaluation of a set of drives.
        path: The file.
        payload: Name of the payload at the tip; None: none.

    Returns:
        What is lost in the format, one sentence each; a comment in the file contains them too.

    Raises:
        InputError: A study without an arm, helical joints, an unknown payload, or a file that cannot be written.

    Passive joints in closed loops have zero effort, so that Drake gives them no actuator. Pins are Drake's ball
    constraints between frames of the two links; other readers need their own constraints between these frames.

    Reference: SDFormat, http://sdformat.org/spec; the rotor tags and ball constraints are Drake's.
    """
    arm, drives = exported(evaluation, "sdf", payload)
    notes, bodies = lost("sdf"), arm_bodies(arm, "SDF")
    joints = {body.joint for body in bodies}  # in SDF no link may have the name of a joint
    bodies = [replace(one, link=f"{one.link}_link") if one.link in joints else one for one in bodies]
    root = ElementTree.Element("sdf", {"version": "1.9", "xmlns:drake": "http://drake.mit.edu"})
    root.extend(comments([f"written by drivetrain {__version__}", *notes]))
    model = ElementTree.SubElement(root, "model", name=arm.name)
    _put(ElementTree.SubElement(model, "link", name="base_link"), "pose", "0 0 0 0 0 0")
    fixed = ElementTree.SubElement(model, "joint", name="base_fixed", type="fixed")
    _put(fixed, "parent", "world")
    _put(fixed, "child", "base_link")
    speeds, efforts = joint_limits(arm, drives)
    for body in bodies:
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
        _put(joint, "parent", "base_link" if body.before < 0 else bodies[body.before].link)
        _put(joint, "child", body.link)
        along = ElementTree.SubElement(joint, "axis")
        _put(along, "xyz", text(cleaned(body.axis)))
        limit = ElementTree.SubElement(along, "limit")
        numbers = {"lower": body.lower, "upper": body.upper, "effort": 0.0}
        for row in body.drives:
            numbers |= {"effort": efforts[row], "velocity": speeds[row]}
        for name, value in numbers.items():
            if np.isfinite(value):
                _put(limit, name, text(value))
        for row in body.drives:
            dynamics = ElementTree.SubElement(along, "dynamics")
            _put(dynamics, "damping", text(drives[row].viscous))
            _put(dynamics, "friction", text(drives[row].coulomb))
            _put(joint, "drake:rotor_inertia", text(drives[row].rotor_inertia))
            _put(joint, "drake:gear_ratio", text(drives[row].ratio))
    for k, (one, other, point) in enumerate(pins(arm)):
        _pin(model, k, [bodies[at] if at >= 0 else None for at in (one, other)], point)
    last = bodies[(arm if arm.linkage is None else arm.linkage.chains[0]).n - 1]
    tip = ElementTree.SubElement(model, "frame", name="tip", attached_to=last.link)
    _put(tip, "pose", _place(inverse_pose(last.frame) @ arm.tip))
    ElementTree.indent(root)
    write_text(path, '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n")
    return notes


def _pin(model: ElementTree.Element, number: int, ends: Sequence[Body | None], point: Array) -> None:
    """Add a pin of a closed loop: a frame on each of its two links (None: the base) and the constraint between them."""
    held = ElementTree.Element("drake:ball_constraint")
    for which, vector, body in zip("AB", ("AP", "BQ"), ends, strict=True):
        link, at = ("base_link", point) if body is None else (body.link, in_frame(body.frame, point))
        frame = ElementTree.SubElement(model, "frame", name=f"pin_{number}_{which}", attached_to=link)
        _put(frame, "pose", _place(pose(point=at)))
        _put(held, f"drake:ball_constraint_body_{which}", link)
        _put(held, f"drake:ball_constraint_p_{vector}", text(cleaned(at)))
    model.append(held)


def _put(parent: ElementTree.Element, name: str, content: str) -> None:
    ElementTree.SubElement(parent, name).text = content


def _place(stands: Array) -> str:
    return text([*cleaned(stands[:3, 3]), *cleaned(rpy_from_rotation(stands[:3, :3]))])
