"""Arms as URDF files that read back unchanged: what the format cannot represent gives an error or a note.

The frame of a link has its origin at the link's joint and the directions of its home frame, so that home frames,
inertia tensors and axes are written unchanged. Joints and moving links keep their names; base and tip get names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm, refuse_loops
from drivetrain.arm.files.drives import ACTUATORS, GEAR_RATIO, JOINTS, REDUCTIONS, ROTOR_INERTIA, SIMPLE
from drivetrain.arm.files.xml import UNLIMITED
from drivetrain.arm.rotors import RotorLevel
from drivetrain.arrays import Array, frozen_array
from drivetrain.errors import Faults
from drivetrain.export.urdf_rotors import Pair, RotorTags, WrittenBodies, written_bodies
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import axis_point, inverse_pose, pose
from drivetrain.spatial.rotations import rpy_from_rotation
from drivetrain.version import __version__
from drivetrain.whole_files import write_text


@dataclass(frozen=True, eq=False)
class UrdfJointData:
    """Joint data of a URDF that an arm does not contain; None: unknown, which is written as no limit.

    Attributes:
        effort: Largest torque or force [N m or N], (n,).
        damping: Viscous friction [N m s/rad or N s/m], (n,).
        friction: Coulomb friction [N m or N], (n,).
    """

    effort: Any = None
    damping: Any = None
    friction: Any = None


NO_DATA = UrdfJointData()


def write_urdf(
    arm: Arm, path: str | Path, *, data: UrdfJointData = NO_DATA, base: str | None = None, tip: str | None = None
) -> tuple[str, ...]:
    """Write an arm to a URDF file, completely or not at all.

    ``load_arm(path)`` returns an arm with the same dynamics to rounding, after setting gravity and the level of the
    rotors if a note says so.

    Args:
        arm: With or without rotors.
        path: The file; its folder must exist.
        data: Limits of effort, and friction, which an arm does not contain.
        base, tip: Names of the links of the base and the end effector. None: base_link and tool0, followed by an
            underscore if a link has that name already.

    Returns:
        What the format cannot represent, or represents differently, one sentence each; a comment in the file
        contains them too.

    Raises:
        InputError: As for ``urdf_text``, or a file that cannot be written.
    """
    content, notes = _written(arm, data, base, tip)
    write_text(path, content)
    return notes


def urdf_text(arm: Arm, *, data: UrdfJointData = NO_DATA, base: str | None = None, tip: str | None = None) -> str:
    """URDF text of an arm.

    Reference: URDF, http://wiki.ros.org/urdf/XML; the rotor tags are Drake's, the transmissions ros_control's.
    """
    return _written(arm, data, base, tip)[0]


def _written(arm: Arm, data: UrdfJointData, base: str | None, tip: str | None) -> tuple[str, tuple[str, ...]]:
    refuse_loops(arm)
    faults = Faults()
    for joint in np.flatnonzero(arm.pitches):
        place = f"joint {arm.joint_names[joint]}"
        faults.add(place, "is helical: URDF has no such joint", f"{arm.pitches[joint]:.6g} m/rad")
    given = {name: values for name, values in vars(data).items() if values is not None}
    columns = {name: faults.attempt(frozen_array, values, (arm.n,), name) for name, values in given.items()}
    ends = [_end_name(arm, base, "base_link", "base", faults), _end_name(arm, tip, "tool0", "tip", faults)]
    if ends[0] == ends[1]:
        faults.add("tip", "must have another name than the base", tip)
    bodies = faults.attempt(written_bodies, arm)
    faults.raise_any()
    assert bodies is not None
    notes = (*bodies.notes, *_notes(arm))
    root = ElementTree.Element("robot", {"name": arm.name, "xmlns:drake": "http://drake.mit.edu"})
    root.extend(_comments(arm, notes))
    _chain(root, arm, bodies, columns, ends)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n", notes


def _end_name(arm: Arm, wanted: str | None, usual: str, end: str, faults: Faults) -> str:
    """The name of the base or tip link, which must differ from those of the moving links."""
    if wanted in arm.link_names:
        faults.add(end, "must not be the name of a moving link", wanted)
    return wanted or _unused_name(usual, arm.link_names)


def _unused_name(name: str, taken: Iterable[str]) -> str:
    used = set(taken)
    while name in used:
        name += "_"
    return name


def _notes(arm: Arm) -> list[str]:
    """Notes on properties of the arm, apart from rotors, that URDF does not represent."""
    notes = []
    if tuple(arm.gravity) != STANDARD_GRAVITY:
        notes.append(f"gravity {text(arm.gravity)} m/s^2, which URDF cannot say: give it when reading")
    moved = np.linalg.norm(_points(arm) - arm.joint_points, axis=1) > 1e-9  # [m] above the rounding of a large frame
    if moved.any():
        away = ", ".join(arm.joint_names[i] for i in np.flatnonzero(moved))
        notes.append(f"joint points moved onto the axes they were off: joint {away}")
    stuck = [name for name, low, high in zip(arm.joint_names, arm.lower, arm.upper, strict=True) if low == high]
    if stuck:
        notes.append("lower and upper limit agree, which readers take as no limit: joint " + ", ".join(stuck))
    return notes


def _comments(arm: Arm, notes: Iterable[str]) -> list[Any]:
    lines = [f"arm {arm.name}, written by drivetrain {__version__}", *(f"not as in URDF: {note}" for note in notes)]
    if any(rotor is not None for rotor in arm.rotors) and arm.level is not RotorLevel.NONE:
        lines.append("the inertia of a rotor about its axis stands in its own tag and not in a link")
    lines += [f"note: {note}" for note in arm.notes]
    return comments(lines)


def comments(lines: Iterable[str]) -> list[Any]:
    """XML comments, one a line."""
    return [ElementTree.Comment(f" {line.replace('--', '- -').rstrip('-')} ") for line in lines]


def _points(arm: Arm) -> Array:
    """Points of the joints, moved onto their axes [m], (n, 3)."""
    points = arm.joint_points.copy()
    for i, screw in enumerate(arm.screws):
        if screw[:3].any():
            nearest = axis_point(screw, points[i])
            # A point that is on the axis except for rounding stays unchanged.
            points[i] = nearest if np.linalg.norm(nearest - points[i]) > 1e-14 else points[i]
    return points


def _chain(root: Element, arm: Arm, bodies: WrittenBodies, columns: dict[str, Array | None], ends: list[str]) -> None:
    frames = [pose(home[:3, :3], point) for home, point in zip(arm.home, _points(arm), strict=True)]
    ElementTree.SubElement(root, "link", name=ends[0])
    parents, before = (ends[0], *arm.link_names[:-1]), np.eye(4)
    for i, frame in enumerate(frames):
        joint = add_joint(root, arm.joint_names[i], _kind(arm, i), (parents[i], arm.link_names[i]))
        add_origin(joint, inverse_pose(before) @ frame)
        ElementTree.SubElement(joint, "axis", xyz=text(cleaned(frame[:3, :3].T @ arm.axes[i])))
        known = {name: float(column[i]) for name, column in columns.items() if column is not None}
        effort = known.pop("effort", np.inf)
        limits = {"lower": arm.lower[i], "upper": arm.upper[i], "effort": effort, "velocity": arm.speed_limits[i]}
        add_limits(joint, limits)
        if known:  # damping [N m s/rad or N s/m] and friction [N m or N]
            ElementTree.SubElement(joint, "dynamics", {name: text(value) for name, value in known.items()})
        add_link(root, arm.link_names[i], bodies.links[i], inverse_pose(frame) @ arm.home[i])
        before = frame
    flange = add_joint(root, _unused_name(f"{ends[1]}_fixed", arm.joint_names), "fixed", (arm.link_names[-1], ends[1]))
    add_origin(flange, inverse_pose(before) @ arm.tip)
    ElementTree.SubElement(root, "link", name=ends[1])
    _transmissions(root, arm, bodies)


def _transmissions(root: Element, arm: Arm, bodies: WrittenBodies) -> None:
    """Add the transmissions: one motor per joint, or two motors for two joints."""
    paired = {joint for pair in bodies.pairs for joint in pair.joints}
    for joint, (name, tags) in enumerate(zip(arm.joint_names, bodies.tags, strict=True)):
        if tags is not None and joint not in paired:
            add_transmission(root, name, tags)
    for pair in bodies.pairs:
        names = (arm.joint_names[pair.joints[0]], arm.joint_names[pair.joints[1]])
        # A direct drive is written as a gear with ratio 1.
        parts = zip(pair.joints, pair.factors, strict=True)
        first, second = (bodies.tags[joint] or RotorTags(factor, None) for joint, factor in parts)
        add_pair(root, names, pair, (first, second))


def _kind(arm: Arm, joint: int) -> str:
    if arm.slides[joint]:
        return "prismatic"
    free = np.isinf(arm.lower[joint]) and np.isinf(arm.upper[joint])
    return "continuous" if free else "revolute"


# The XML elements of a URDF file: links, joints and drives


Element = ElementTree.Element
ZERO_TOLERANCE = 1e-15  # lengths, angles and components of directions below this are rounding of zero
INTERFACE = "hardware_interface/EffortJointInterface"


def add_link(root: Element, name: str, body: RigidBody, pose_link_home: Array) -> None:
    """Add a link with a body given in its home frame; without mass and inertia it gets no ``inertial`` element."""
    link = ElementTree.SubElement(root, "link", name=name)
    if not body.mass and not body.inertia.any():
        return
    inertial = ElementTree.SubElement(link, "inertial")
    add_origin(inertial, pose_link_home @ pose(point=body.com))
    ElementTree.SubElement(inertial, "mass", value=text(body.mass))
    entries = {f"i{'xyz'[i]}{'xyz'[j]}": text(body.inertia[i, j]) for i in range(3) for j in range(i, 3)}
    ElementTree.SubElement(inertial, "inertia", entries)


def add_joint(root: Element, name: str, kind: str, ends: tuple[str, str]) -> Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=ends[0])
    ElementTree.SubElement(joint, "child", link=ends[1])
    return joint


def add_origin(parent: Element, place: Array) -> None:
    """Add the ``origin`` of a frame with this pose, (4, 4)."""
    rpy = cleaned(rpy_from_rotation(place[:3, :3]))
    ElementTree.SubElement(parent, "origin", xyz=text(cleaned(place[:3, 3])), rpy=text(rpy))


def add_limits(joint: Element, limits: Mapping[str, float]) -> None:
    """Add the limits of a joint; no limit is written as the largest float, since URDF requires a number.

    The limits are ``lower`` and ``upper`` [rad or m] (not for continuous joints), ``effort`` and ``velocity``.
    """
    continuous = joint.get("type") == "continuous"
    known = {name: value for name, value in limits.items() if not (continuous and name in ("lower", "upper"))}
    if continuous and np.isinf([*known.values()]).all():
        return
    written = {name: text(np.clip(value, -UNLIMITED, UNLIMITED)) for name, value in known.items()}
    ElementTree.SubElement(joint, "limit", written)


def add_transmission(root: Element, joint: str, tags: RotorTags) -> None:
    """Add a gear in ros_control's form, with the sign of its ratio, and its rotor with Drake's tags."""
    transmission = _transmission(root, f"{joint}_transmission", SIMPLE)
    _end(transmission, "joint", joint)
    _add_rotor(_end(transmission, "actuator", f"{joint}_motor"), tags)


def add_pair(root: Element, joints: tuple[str, str], pair: Pair, tags: tuple[RotorTags, RotorTags]) -> None:
    """Add a transmission that couples two motors with two joints."""
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
    """Add a joint or an actuator to a transmission, with the interface that ros_control requires."""
    end = ElementTree.SubElement(transmission, tag, name=name)
    ElementTree.SubElement(end, "hardwareInterface").text = INTERFACE
    return end


def _add_rotor(actuator: Element, tags: RotorTags) -> None:
    """Add the gear's ratio, and with Drake's tags the rotor's inertia, which a transmission cannot represent."""
    ElementTree.SubElement(actuator, REDUCTIONS[0]).text = text(tags.ratio)
    if tags.inertia is not None:
        ElementTree.SubElement(actuator, ROTOR_INERTIA, value=text(tags.inertia))
        ElementTree.SubElement(actuator, GEAR_RATIO, value=text(tags.ratio))


def cleaned(values: Array) -> Array:
    """The values with those that are rounding of zero set to zero."""
    return np.where(np.abs(values) < ZERO_TOLERANCE, 0.0, values)


def text(values: Any) -> str:
    """Numbers as text with the fewest digits that read back to the same values."""
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in np.ravel(values))
