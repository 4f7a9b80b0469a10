"""The contents of a URDF file before a chain is chosen: links, joints, drives."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import inf
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.checks import checked_inertia
from drivetrain.arm.files.drives import UrdfCoupling, UrdfDrive, read_drives
from drivetrain.arm.files.xml import Reader, read_document
from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import pose, pose_from_xyz_rpy
from drivetrain.spatial.rotations import rotation_from_quaternion

REVOLUTE, PRISMATIC = ("revolute", "continuous"), ("prismatic",)
MOVABLE = (*REVOLUTE, *PRISMATIC)
REFUSED = ("floating", "planar")
KINDS = (*MOVABLE, "fixed", *REFUSED)
X_AXIS = np.eye(3)[0]  # the default of URDF
SIX = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the entries of a symmetric tensor in a file


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """One joint as written."""

    name: str  # name of the joint
    kind: str  # revolute, continuous, prismatic, fixed, floating or planar
    # links it joins
    parent: str
    child: str
    origin: Array  # frame of joint and child in the parent's frame, joint at zero, (4, 4); translation [m]
    axis: Array  # unit direction in the joint's frame [-], (3,)
    # position limits [rad or m]
    lower: float = -inf
    upper: float = inf
    speed_limit: float = inf  # [rad/s or m/s]
    mimics: str = ""  # joint that it mimics according to the file; empty: none
    unsaid: str = ""  # text on what the file does not state; empty: nothing

    @property
    def movable(self) -> bool:
        """Whether it has a position [rad or m]."""
        return self.kind in MOVABLE


def fixed_joint(name: str, parent: str, child: str, origin: Array) -> UrdfJoint:
    """A joint that holds a link in place."""
    return UrdfJoint(name, "fixed", parent, child, origin, np.eye(3)[2])


@dataclass(frozen=True, eq=False)
class UrdfModel:
    """All that was read from one file."""

    name: str  # of the robot
    file: str  # path of the file
    # by name, as in the file: mass [kg], centre [m] and inertia [kg m^2] in the link's frame; None: no ``inertial``
    links: dict[str, RigidBody | None]
    joints: dict[str, UrdfJoint]  # by name, as in the file
    drives: dict[str, UrdfDrive]  # what the file says of each movable joint's friction and drive, by joint name
    couplings: tuple[UrdfCoupling, ...]  # pairs of joints whose motors are coupled
    notes: tuple[str, ...]  # texts on what was ignored


def read_model(path: Path) -> UrdfModel:
    """The contents of a URDF or xacro file."""
    root = read_document(path)
    reader = Reader(str(path))
    if root.tag != "robot":
        raise InputError(Fault("root", "must be a <robot> element", f"<{root.tag}>", file=str(path)))
    reader.count_ignored(root, ("link", "joint", "transmission", "ros2_control"), ("name", "version"))
    links = _by_name(reader, root, "link")
    joints = _by_name(reader, root, "joint")
    if not links:
        reader.faults.add("robot", "has no <link>")
    model_links = {name: _body(reader, name, element) for name, element in links.items()}
    model_joints = {name: _joint(reader, name, element) for name, element in joints.items()}
    check_names(reader, model_links, model_joints)
    movable = {name: joints[name] for name, joint in model_joints.items() if joint.movable}
    drives, couplings, drive_notes = read_drives(reader, root, movable)
    reader.faults.raise_any()
    notes = tuple(note for note in (reader.ignored_note(), *drive_notes) if note)
    return UrdfModel(root.get("name", path.stem), str(path), model_links, model_joints, drives, tuple(couplings), notes)


def _by_name(reader: Reader, root: ElementTree.Element, tag: str) -> dict[str, ElementTree.Element]:
    found: dict[str, ElementTree.Element] = {}
    for i, element in enumerate(root.findall(tag)):
        name = reader.text(element, "name", f"{tag} number {i + 1}")
        if name in found:
            reader.faults.add(f"{tag} {name}", f"the name of a {tag} must not be used twice")
        elif name:
            found[name] = element
    return found


def _body(reader: Reader, name: str, element: ElementTree.Element) -> RigidBody | None:
    reader.count_ignored(element, ("inertial",), ("name",))
    inertial = element.find("inertial")
    if inertial is None:
        return None
    place = f"link {name}"
    reader.count_ignored(inertial, ("origin", "mass", "inertia"))
    origin = origin_of(reader, inertial, place)
    mass_element, inertia_element = inertial.find("mass"), inertial.find("inertia")
    for tag, child in (("mass", mass_element), ("inertia", inertia_element)):
        if child is None:
            reader.faults.add(place, f"<inertial> needs <{tag}>")
    mass = 0.0 if mass_element is None else reader.number(mass_element, "value", place)
    tensor = np.zeros((3, 3))
    if inertia_element is not None:
        for i, j in SIX:
            tensor[i, j] = tensor[j, i] = reader.number(inertia_element, f"i{'xyz'[i]}{'xyz'[j]}", place)
    return checked_body(reader, place, mass, tensor, "<inertia>").seen_from(origin)


def checked_body(reader: Reader, place: str, mass: float, tensor: Array, tag: str) -> RigidBody:
    """A body at its own centre of mass; negative masses and moments are faults."""
    if mass < 0.0:
        reader.faults.add(place, "its mass must not be negative [kg]", mass)
    checked = reader.faults.attempt(checked_inertia, tensor, f"{place}, {tag}")
    return RigidBody(max(mass, 0.0), np.zeros(3), tensor if checked is None else checked)


def origin_of(reader: Reader, element: ElementTree.Element, place: str) -> Array:
    """The frame that the ``origin`` of an element states, (4, 4); translation [m]."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    reader.count_ignored(origin, (), ("xyz", "rpy", "quat_xyzw"))
    if "quat_xyzw" in origin.attrib:  # since URDF 1.1
        numbers = reader.numbers(origin, "quat_xyzw", place, [0.0, 0.0, 0.0, 1.0])
        point = reader.numbers(origin, "xyz", place, [0.0] * 3)
        return pose(rotation_from_quaternion(numbers[3], numbers[:3]), point)
    return pose_from_xyz_rpy(
        reader.numbers(origin, "xyz", place, [0.0] * 3), reader.numbers(origin, "rpy", place, [0.0] * 3)
    )


def _joint(reader: Reader, name: str, element: ElementTree.Element) -> UrdfJoint:
    place = f"joint {name}"
    known = ("parent", "child", "origin", "axis", "limit", "dynamics", "mimic")
    reader.count_ignored(element, (*known, "drake:rotor_inertia", "drake:gear_ratio"), ("name", "type"))
    kind = reader.text(element, "type", place)
    if kind and kind not in KINDS:
        reader.faults.add(place, f"its type must be one of {', '.join(MOVABLE)} or fixed", kind, nearest(kind, KINDS))
    # converters write axes of zero length at fixed joints, which have neither axis nor limits
    axis, no_axis = (X_AXIS, "") if kind == "fixed" else _axis(reader, element, place)
    lower, upper, speed, no_limit = (-inf, inf, inf, "") if kind == "fixed" else _limits(reader, element, kind, place)
    mimic = element.find("mimic")
    unsaid = [phrase for phrase in (no_axis, no_limit) if phrase and kind in MOVABLE]
    parent, child = _end(reader, element, "parent", place), _end(reader, element, "child", place)
    mimics = "" if mimic is None else mimic.get("joint", "?")
    origin = origin_of(reader, element, place)
    return UrdfJoint(name, kind, parent, child, origin, axis, lower, upper, speed, mimics, " and ".join(unsaid))


def _end(reader: Reader, element: ElementTree.Element, tag: str, place: str) -> str:
    end = element.find(tag)
    if end is None:
        reader.faults.add(place, f"needs <{tag}>")
        return ""
    return reader.text(end, "link", place)


def _axis(reader: Reader, element: ElementTree.Element, place: str) -> tuple[Array, str]:
    """Unit direction of a joint, and a text on what the file does not state."""
    child = element.find("axis")
    if child is None:
        return X_AXIS, "no <axis>: taken along x, URDF's default"
    axis = reader.numbers(child, "xyz", place, X_AXIS)
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        reader.faults.add(place, "its axis must have a direction", child.get("xyz"))
        return X_AXIS, ""
    return axis / length, ""


def _limits(reader: Reader, element: ElementTree.Element, kind: str, place: str) -> tuple[float, float, float, str]:
    """Lower, upper and speed limit, and a text on what the file does not state."""
    limit = element.find("limit")
    if limit is None:
        return -inf, inf, inf, "" if kind == "continuous" else "no <limit>: taken as unlimited"
    reader.count_ignored(limit, (), ("lower", "upper", "velocity"))
    speed = reader.limit(limit, "velocity", place, inf)
    # files often give a speed of zero or less for "no limit"
    speed = speed if speed > 0.0 else inf
    if kind == "continuous":
        return -inf, inf, speed, ""
    lower, upper = reader.limit(limit, "lower", place, 0.0), reader.limit(limit, "upper", place, 0.0)
    if lower > upper:
        reader.faults.add(place, "its lower limit must not be above its upper limit", (lower, upper))
    if lower == upper:
        return -inf, inf, speed, f"limits both {lower:g}: taken as unlimited"
    return lower, upper, speed, ""


def check_names(reader: Reader, links: Collection[str], joints: dict[str, UrdfJoint]) -> None:
    """Check that joints name existing links and that no link is the child of two joints."""
    holder: dict[str, str] = {}
    for joint in joints.values():
        for end in (joint.parent, joint.child):
            if end and end not in links:
                reader.faults.add(f"joint {joint.name}", "names a link that is not there", end, nearest(end, links))
        if joint.child in holder:
            problem = f"is the child of two joints, {holder[joint.child]} and {joint.name}: closed chains are not read"
            reader.faults.add(f"link {joint.child}", problem)
        holder.setdefault(joint.child, joint.name)
    looped = [name for name in links if _hangs_on_itself(name, holder, joints)]
    if looped:
        reader.faults.add("links", "hang on each other in a loop", looped)


def _hangs_on_itself(link: str, holder: dict[str, str], joints: dict[str, UrdfJoint]) -> bool:
    """Whether the path from a link towards the root returns to it."""
    seen: set[str] = set()
    above = link
    while above in holder and above not in seen:
        seen.add(above)
        above = joints[holder[above]].parent
    return above == link and above in seen
