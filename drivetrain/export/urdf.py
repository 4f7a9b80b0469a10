"""Arms as URDF files that read back as they were: what the format cannot hold is an error or a note, never lost.

Frame of a link: origin where its joint sits, directions of its home frame; so home frames, tensors and axes survive as
they are. Names: the arm's own for joints and moving links; the base and the tip get one each.
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
    """What a URDF says of the joints that an arm does not hold; None: nothing known, which URDF writes as no limit."""

    effort: Any = None  # largest torque or force [N m or N], (n,)
    damping: Any = None  # viscous friction [N m s/rad or N s/m], (n,)
    friction: Any = None  # Coulomb friction [N m or N], (n,)


NO_DATA = UrdfJointData()


def write_urdf(
    arm: Arm, path: str | Path, *, data: UrdfJointData = NO_DATA, base: str | None = None, tip: str | None = None
) -> tuple[str, ...]:
    """Write an arm to a URDF file, whole or not at all.

    ``load_arm(path)`` gives the arm back: dynamics equal to rounding, once gravity and the level of the rotors are set
    where a note says so.

    Args:
        arm: With rotors or without.
        path: Of the file; its folder must be there.
        data: Limits of effort and friction, which an arm does not hold.
        base, tip: Names of the links that stand for the base and the end effector. None: base_link and tool0, with an
            underscore behind where a link has that name already.

    Returns:
        What the format could not hold, or holds in another way; the same sentences stand in a comment of the file.

    Raises:
        InputError: As of urdf_text; or the file cannot be written.
    """
    content, notes = _written(arm, data, base, tip)
    write_text(path, content)
    return notes


def urdf_text(arm: Arm, *, data: UrdfJointData = NO_DATA, base: str | None = None, tip: str | None = None) -> str:
    """The URDF of an arm.

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
    if bodies is None:  # its faults have been raised
        return "", ()
    notes = (*bodies.notes, *_notes(arm))
    root = ElementTree.Element("robot", {"name": arm.name, "xmlns:drake": "http://drake.mit.edu"})
    root.extend(_comments(arm, notes))
    _chain(root, arm, bodies, columns, ends)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n", notes


def _end_name(arm: Arm, wanted: str | None, usual: str, end: str, faults: Faults) -> str:
    """The name of the base or tip link, which no moving link may have."""
    if wanted in arm.link_names:
        faults.add(end, "must not be the name of a moving link", wanted)
    return wanted or _free(usual, arm.link_names)


def _free(name: str, taken: Iterable[str]) -> str:
    used = set(taken)
    while name in used:
        name += "_"
    return name


def _notes(arm: Arm) -> list[str]:
    """What of an arm without rotors a URDF does not hold."""
    notes = []
    if tuple(arm.gravity) != STANDARD_GRAVITY:
        notes.append(f"gravity {text(arm.gravity)} m/s^2, which URDF cannot say: give it when reading")
    away = [
        arm.joint_names[i]
        for i in range(arm.n)
        if np.linalg.norm(_points(arm)[i] - arm.joint_points[i]) > 1e-9  # m: rounding of a large frame
    ]
    if away:
        notes.append("joint points moved onto the axes they were off: joint " + ", ".join(away))
    stuck = [name for name, low, high in zip(arm.joint_names, arm.lower, arm.upper, strict=True) if low == high]
    if stuck:
        notes.append("lower and upper limit agree, which readers take as no limit: joint " + ", ".join(stuck))
    return notes


def _comments(arm: Arm, notes: Iterable[str]) -> list[Any]:
    lines = [f"arm {arm.name}, written by drivetrain {__version__}", *(f"not as in URDF: {note}" for note in notes)]
    if any(rotor is not None for rotor in arm.rotors) and arm.level is not RotorLevel.NONE:
        lines.append("the inertia of a rotor about its axis stands in its own tag and not in a link")
    lines += [f"note: {note}" for note in arm.notes]
    return [ElementTree.Comment(f" {line.replace('--', '- -').rstrip('-')} ") for line in lines]


def _points(arm: Arm) -> Array:
    """Where the joints sit, on their axes."""
    points = arm.joint_points.copy()
    for i, screw in enumerate(arm.screws):
        if screw[:3].any():
            nearest = axis_point(screw, points[i])
            # A point that is on the axis but for rounding stays what it is.
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
    flange = add_joint(root, _free(f"{ends[1]}_fixed", arm.joint_names), "fixed", (arm.link_names[-1], ends[1]))
    add_origin(flange, inverse_pose(before) @ arm.tip)
    ElementTree.SubElement(root, "link", name=ends[1])
    _transmissions(root, arm, bodies)


def _transmissions(root: Element, arm: Arm, bodies: WrittenBodies) -> None:
    """What drives the joints: one motor each, or two motors two joints together."""
    paired = {joint for pair in bodies.pairs for joint in pair.joints}
    for joint, (name, tags) in enumerate(zip(arm.joint_names, bodies.tags, strict=True)):
        if tags is not None and joint not in paired:
            add_transmission(root, name, tags)
    for pair in bodies.pairs:
        names = (arm.joint_names[pair.joints[0]], arm.joint_names[pair.joints[1]])
        # A direct drive counts as a gear of ratio 1.
        first, second = (
            bodies.tags[joint] or RotorTags(factor, None)
            for joint, factor in zip(pair.joints, pair.factors, strict=True)
        )
        add_pair(root, names, pair, (first, second))


def _kind(arm: Arm, joint: int) -> str:
    if arm.slides[joint]:
        return "prismatic"
    free = np.isinf(arm.lower[joint]) and np.isinf(arm.upper[joint])
    return "continuous" if free else "revolute"


# The elements of a URDF file: links, joints, drives, each from numbers that are settled


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
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=ends[0])
    ElementTree.SubElement(joint, "child", link=ends[1])
    return joint


def add_origin(parent: Element, place: Array) -> None:
    """Say where a frame stands, (4, 4)."""
    rpy = cleaned(rpy_from_rotation(place[:3, :3]))
    ElementTree.SubElement(parent, "origin", xyz=text(cleaned(place[:3, 3])), rpy=text(rpy))


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
