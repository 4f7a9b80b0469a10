"""The elements of a URDF file: links, joints, drives, each from numbers that are settled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.files.drives import ACTUATORS, GEAR_RATIO, JOINTS, REDUCTIONS, ROTOR_INERTIA, SIMPLE
from drivetrain.arm.files.xml import UNLIMITED
from drivetrain.arrays import Array
from drivetrain.export.urdf_rotors import Pair, RotorTags
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import rpy_from_rotation

Element = ElementTree.Element
NOTHING = 1e-15  # of a length, an angle or a direction: what products of frames leave of zero
INTERFACE = "hardware_interface/EffortJointInterface"


def add_link(root: Element, name: str, body: RigidBody, pose_link_home: Array) -> None:
    """Add a link with a body given in its home frame; one without mass and inertia has nothing to say of itself."""
    link = ElementTree.SubElement(root, "link", name=name)
    if not body.mass and not body.inertia.any():
        return
    inertial = ElementTree.SubElement(link, "inertial")
    add_origin(inertial, pose_link_home @ pose(point=body.com))
    ElementTree.SubElement(inertial, "mass", value=text(body.mass))
    entries = {f"i{'xyz'[i]}{'xyz'[j]}": text(body.inertia[i, j]) for i in range(3) for j in range(i, 3)}
    ElementTree.SubElement(inertial, "inertia", entries)


def add_joint(root: Element, name: str, kind: str, ends: tuple[str, str]) -> Element:
    """Add a joint."""
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=ends[0])
    ElementTree.SubElement(joint, "child", link=ends[1])
    return joint


def add_origin(parent: Element, place: Array) -> None:
    """Say where a frame stands, (4, 4)."""
    rpy = cleaned(rpy_from_rotation(place[:3, :3]))
    ElementTree.SubElement(parent, "origin", xyz=text(cleaned(place[:3, 3])), rpy=text(rpy))


def add_axis(joint: Element, direction: Array) -> None:
    """Say along which way a joint turns or slides, in its frame."""
    ElementTree.SubElement(joint, "axis", xyz=text(cleaned(direction)))


def add_limits(joint: Element, limits: Mapping[str, float]) -> None:
    """Say how far a joint goes; the largest number there is stands for no limit, where URDF wants a number.

    ``lower`` and ``upper`` [rad or m], for which a continuous joint has no place, ``effort``, ``velocity``.
    """
    continuous = joint.get("type") == "continuous"
    known = {name: value for name, value in limits.items() if not (continuous and name in ("lower", "upper"))}
    if continuous and np.isinf([*known.values()]).all():
        return
    written = {name: text(np.clip(value, -UNLIMITED, UNLIMITED)) for name, value in known.items()}
    ElementTree.SubElement(joint, "limit", written)


def add_dynamics(joint: Element, dynamics: Mapping[str, float]) -> None:
    """Say what friction a joint has, ``damping`` [N m s/rad or N s/m] and ``friction`` [N m or N], if that is known."""
    if dynamics:
        ElementTree.SubElement(joint, "dynamics", {name: text(value) for name, value in dynamics.items()})


def add_transmission(root: Element, joint: str, tags: RotorTags) -> None:
    """Add a gear as ros_control wants it, the sign of its ratio kept, and its rotor as Drake does."""
    transmission = _transmission(root, f"{joint}_transmission", SIMPLE)
    _end(transmission, "joint", joint)
    _add_rotor(_end(transmission, "actuator", f"{joint}_motor"), tags)


def add_pair(root: Element, joints: tuple[str, str], pair: Pair, tags: tuple[RotorTags, RotorTags]) -> None:
    """Add a transmission that joins two motors to two joints."""
    transmission = _transmission(root, f"{joints[0]}_{joints[1]}_transmission", pair.kind)
    for role, name, reduction in zip(JOINTS, joints, pair.reductions, strict=True):
        joint = _end(transmission, "joint", name)
        ElementTree.SubElement(joint, "role").text = role
        ElementTree.SubElement(joint, REDUCTIONS[0]).text = text(reduction)
    for role, name, rotor in zip(ACTUATORS, joints, tags, strict=True):
        actuator = _end(transmission, "actuator", f"{name}_motor")
        ElementTree.SubElement(actuator, "role").text = role
        _add_rotor(actuator, rotor)


def _transmission(root: Element, name: str, kind: str) -> Element:
    transmission = ElementTree.SubElement(root, "transmission", name=name)
    ElementTree.SubElement(transmission, "type").text = f"transmission_interface/{kind}"
    return transmission


def _end(transmission: Element, tag: str, name: str) -> Element:
    """A joint or an actuator, with the interface that ros_control asks for."""
    end = ElementTree.SubElement(transmission, tag, name=name)
    ElementTree.SubElement(end, "hardwareInterface").text = INTERFACE
    return end


def _add_rotor(actuator: Element, tags: RotorTags) -> None:
    """The gear's ratio, and with Drake's tags what a transmission cannot say: the rotor's inertia."""
    ElementTree.SubElement(actuator, REDUCTIONS[0]).text = text(tags.ratio)
    if tags.inertia is not None:
        ElementTree.SubElement(actuator, ROTOR_INERTIA, value=text(tags.inertia))
        ElementTree.SubElement(actuator, GEAR_RATIO, value=text(tags.ratio))


def cleaned(values: Array) -> Array:
    """Numbers with what rounding leaves of zero made zero."""
    return np.where(np.abs(values) < NOTHING, 0.0, values)


def text(values: Any) -> str:
    """Numbers with every digit that they have, and no more."""
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in np.ravel(values))
