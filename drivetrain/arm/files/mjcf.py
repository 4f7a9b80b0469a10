"""Arms from MJCF files: bodies, hinges and slides; masses of geoms are not computed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.files.drives import UrdfCoupling, UrdfDrive
from drivetrain.arm.files.model import UrdfJoint, UrdfModel, check_names, checked_body, fixed_joint
from drivetrain.arm.files.xml import Reader, read_document
from drivetrain.arrays import Array
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import pose
from drivetrain.spatial.rotations import exp_rotation, rotation_from_quaternion, unit

BASE = "world"
KINDS = {"hinge": "revolute", "slide": "prismatic", "free": "floating", "ball": "floating"}
SAVED = "let MuJoCo write it out: mujoco.mj_saveLastXML puts an <inertial> into every body"
DROPPED = ("include", "replicate", "attach", "frame")
# Actuators share one set of defaults: MuJoCo treats them all as "general".
ACTUATORS = ("motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion", "dcmotor")
TENDON_NUMBERS = ("stiffness", "damping", "frictionloss", "armature")  # attributes that act on joints


@dataclass
class _Reading:
    """State of reading one file."""

    reader: Reader
    turn: float
    euler: str
    autolimits: bool
    balanced: bool
    defaults: dict[str, dict[str, dict[str, str]]]
    site: str | None  # name of the site that is the wanted tip
    links: dict[str, RigidBody | None] = field(default_factory=dict)
    joints: dict[str, UrdfJoint] = field(default_factory=dict)
    drives: dict[str, UrdfDrive] = field(default_factory=dict)
    couplings: list[UrdfCoupling] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_mjcf(path: Path, tip: str | None = None) -> tuple[UrdfModel, Array]:
    """The contents of an MJCF file, and its gravity [m/s^2]; all parts that cannot be read as an arm are faults.

    If no body but a site has the name of the wanted tip, the site is a link without mass.

    Reference: MuJoCo, XML reference.
    """
    root = read_document(path)
    reader = Reader(str(path))
    compiler, option, flag = (_merged(root, path) for path in ("compiler", "option", "option/flag"))
    for tag in DROPPED:
        if root.find(f".//{tag}") is not None:
            reader.faults.add(f"<{tag}>", "is not read", hint=SAVED)
    for name in ("settotalmass", "boundmass", "boundinertia"):
        if reader.number(compiler, name, "compiler", 0.0) > 0.0:
            reader.faults.add(f"compiler {name}", "changes what bodies weigh and is not read", hint=SAVED)
    if compiler.get("inertiafromgeom") == "true":
        reader.faults.add("compiler inertiafromgeom", "what geoms weigh is not computed", "true", SAVED)
    sequence = compiler.get("eulerseq", "xyz")
    if len(sequence) != 3 or {*sequence.lower()} - {*"xyz"}:
        reader.faults.add("compiler eulerseq", "must be three of x, y, z, X, Y, Z", sequence)
        sequence = "xyz"
    turn = 1.0 if compiler.get("angle", "degree") == "radian" else math.pi / 180.0
    defaults: dict[str, dict[str, dict[str, str]]] = {}
    for one in root.findall("default"):
        _defaults(one, "main", defaults.get("main", {}), defaults)
    limits = compiler.get("autolimits", "true") == "true"
    balanced = compiler.get("balanceinertia") == "true"
    site = None if any(body.get("name") == tip for body in root.iter("body")) else tip
    reading = _Reading(reader, turn, sequence, limits, balanced, defaults, site)
    reading.links[BASE] = None
    for world in root.findall("worldbody"):
        for body in world.findall("body"):
            _body(reading, body, BASE, np.eye(4), "main")
    _actuators(reading, root)
    check_names(reader, reading.links, reading.joints)
    reader.faults.raise_any()
    for tag, hint in (("equality", ": loops that it closes are `closures` of a study"), ("keyframe", "")):
        if root.find(tag) is not None:
            reading.notes.append(f"ignored: <{tag}>{hint}")
    springs = root.findall("tendon/spatial")
    if springs:
        names = ", ".join(one.get("name", "?") for one in springs)
        reading.notes.append(f"ignored: tendons along the links ({names}): springs are `counterbalances` of a study")
    for one in root.findall("tendon/fixed"):
        acts = [name for name in TENDON_NUMBERS if _first(reading, one, name, "tendon")]
        if acts:
            reading.notes.append(f"tendon {one.get('name', '?')}: its {', '.join(acts)} not used")
    gravity = reader.numbers(option, "gravity", "option", [0.0, 0.0, -9.81])
    gravity = 0.0 * gravity if flag.get("gravity") == "disable" else gravity
    name = root.get("model", path.stem)
    drives = {joint: reading.drives.get(joint, UrdfDrive()) for joint in reading.joints}
    return UrdfModel(name, str(path), reading.links, reading.joints, drives, tuple(reading.couplings),
                     tuple(reading.notes)), gravity  # fmt: skip


def _merged(root: ElementTree.Element, path: str) -> ElementTree.Element:
    """One element with the attributes of all elements of the same tag; later ones take precedence."""
    found = ElementTree.Element(path)
    for one in root.findall(path):
        found.attrib.update(one.attrib)
    return found


def _defaults(
    element: ElementTree.Element,
    name: str,
    above: dict[str, dict[str, str]],
    found: dict[str, dict[str, dict[str, str]]],
) -> None:
    own = {tag: dict(values) for tag, values in above.items()}
    for child in element:
        if child.tag != "default":
            own.setdefault(_kind(child), {}).update(child.attrib)
    found[name] = own
    for child in element.findall("default"):
        _defaults(child, child.get("class", ""), own, found)


def _filled(reading: _Reading, element: ElementTree.Element, inherited: str) -> ElementTree.Element:
    """An element with the attributes of its class."""
    known = reading.defaults.get(element.get("class", inherited), {}).get(_kind(element), {})
    return ElementTree.Element(element.tag, {**known, **element.attrib})


def _kind(element: ElementTree.Element) -> str:
    """Tag under which the defaults of an element are given."""
    return "general" if element.tag in ACTUATORS else element.tag


def _first(reading: _Reading, element: ElementTree.Element, name: str, place: str) -> float:
    """The first number of an attribute; further ones, coefficients of higher powers, give a note."""
    words = element.get(name, "0").split()
    if len(words) > 1:
        reading.notes.append(f"{place}: of its {name} the first number is used, not those of higher powers")
    return float(reading.reader.parsed(" ".join(words[:1]), f"<{element.tag} {name}=...>", place, [0.0])[0])


def _body(reading: _Reading, element: ElementTree.Element, parent: str, above: Array, inherited: str) -> None:
    """Add a body with its joints, in the frame of the link that carries it; then its child bodies."""
    name = element.get("name") or f"body_{len(reading.links)}"
    inherited, place = element.get("childclass", inherited), f"body {name}"
    frame = above @ _pose(reading, element, place)
    if reading.reader.number(element, "gravcomp", place, 0.0):
        reading.notes.append(f"{place}: gravcomp not used: the drives must carry that weight")
    joints = [*element.findall("joint"), *element.findall("freejoint")]
    for i, written in enumerate(joints or [None]):
        link = name if i + 1 == max(len(joints), 1) else f"{name}_{i + 1}"
        if link in reading.links:
            reading.reader.faults.add(place, "the name of a body must not be used twice")
            return
        frame = _joint(reading, written, parent, link, frame, inherited)
        reading.links[link] = None
        parent = link
    reading.links[name] = _inertial(reading, element, frame, place)
    for site in element.findall("site"):
        if reading.site is not None and site.get("name") == reading.site:
            held = fixed_joint(f"{reading.site}_fixed", name, reading.site, frame @ _pose(reading, site, place))
            reading.joints[held.name], reading.links[reading.site] = held, None
    for child in element.findall("body"):
        _body(reading, child, name, frame, inherited)


def _joint(
    reading: _Reading, written: ElementTree.Element | None, parent: str, link: str, frame: Array, inherited: str
) -> Array:
    """Add a joint that carries a link; returns the body's frame in the link's frame, whose origin is at the joint."""
    if written is None:
        held = fixed_joint(f"{link}_fixed", parent, link, frame)
        reading.joints[held.name] = held
        return np.eye(4)
    element, reader = _filled(reading, written, inherited), reading.reader
    kind = "free" if written.tag == "freejoint" else element.get("type", "hinge")
    name = element.get("name") or f"{link}_joint"
    place = f"joint {name}"
    if name in reading.joints:
        reader.faults.add(place, "the name of a joint must not be used twice")
    if reader.number(element, "ref", place, 0.0):
        reader.faults.add(place, "has a ref other than zero, which is not read")
    anchor = reader.numbers(element, "pos", place, [0.0] * 3)
    axis = _direction(reader, reader.numbers(element, "axis", place, [0.0, 0.0, 1.0]), element, place)
    limited = element.get("limited", "auto")
    bounded = limited == "true" or (limited == "auto" and reading.autolimits and "range" in element.attrib)
    low, high = -math.inf, math.inf
    if bounded:
        ends = reader.numbers(element, "range", place, [0.0, 0.0]) * (reading.turn if kind == "hinge" else 1.0)
        if limited == "true" or ends.any():  # "0 0" removes a limit of the class
            low, high = ends
    reading.joints[name] = UrdfJoint(
        name, KINDS.get(kind, kind), parent, link, frame @ pose(point=anchor), axis, float(low), float(high)
    )
    friction = reader.number(element, "frictionloss", place, 0.0)
    reading.drives[name] = UrdfDrive(_first(reading, element, "damping", place) or None, friction or None)
    if reader.number(element, "armature", place, 0.0):
        reading.notes.append(f"joint {name}: armature not used, because the rotor's inertia needs a ratio")
    if any(word.strip("+-0.") for word in element.get("stiffness", "").split()):
        reading.notes.append(f"joint {name}: its spring (stiffness) is not used: state it under counterbalances")
    return pose(point=-anchor)


def _inertial(reading: _Reading, element: ElementTree.Element, frame: Array, place: str) -> RigidBody | None:
    found = element.find("inertial")
    reader = reading.reader
    if found is None:
        if element.find("geom") is not None:
            reader.faults.add(place, "has no <inertial>, and what its geoms weigh is not computed", hint=SAVED)
        return None
    mass = reader.number(found, "mass", place)
    if "fullinertia" in found.attrib:
        xx, yy, zz, xy, xz, yz = reader.numbers(found, "fullinertia", place, [0.0] * 6)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    else:
        tensor = np.diag(reader.numbers(found, "diaginertia", place, [0.0] * 3))
    if reading.balanced and 2.0 * np.linalg.eigvalsh(tensor)[-1] > np.trace(tensor):
        tensor = np.eye(3) * (np.trace(tensor) / 3.0)
        reading.notes.append(f"{place}: no body has its moments of inertia: their mean, as the compiler is asked to")
    return checked_body(reader, place, mass, tensor, "<inertial>").seen_from(frame @ _pose(reading, found, place))


def _pose(reading: _Reading, element: ElementTree.Element, place: str) -> Array:
    """Pose of an element: pos, and an orientation in one of five forms."""
    reader = reading.reader
    point = reader.numbers(element, "pos", place, [0.0] * 3)
    if "quat" in element.attrib:
        numbers = reader.numbers(element, "quat", place, [1.0, 0.0, 0.0, 0.0])
        return pose(rotation_from_quaternion(numbers[0], numbers[1:]), point)
    if "axisangle" in element.attrib:
        *axis, angle = reader.numbers(element, "axisangle", place, [0.0, 0.0, 1.0, 0.0])
        return pose(exp_rotation(_direction(reader, axis, element, place) * angle * reading.turn), point)
    if "euler" in element.attrib:
        rotation, angles = np.eye(3), reader.numbers(element, "euler", place, [0.0] * 3) * reading.turn
        for letter, angle in zip(reading.euler, angles, strict=True):
            step = exp_rotation(np.eye(3)["xyz".index(letter.lower())] * angle)
            rotation = rotation @ step if letter.islower() else step @ rotation  # capital letters: fixed axes
        return pose(rotation, point)
    if "xyaxes" in element.attrib:
        numbers = reader.numbers(element, "xyaxes", place, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
        x = _direction(reader, numbers[:3], element, place)
        y = _direction(reader, numbers[3:] - float(x @ numbers[3:]) * x, element, place)
        return pose(np.column_stack([x, y, np.cross(x, y)]), point)
    if "zaxis" in element.attrib:
        reader.faults.add(place, "its zaxis is not read", hint=SAVED)
    return pose(point=point)


def _direction(reader: Reader, vector: Any, element: ElementTree.Element, place: str) -> Array:
    """A vector as a unit vector; for a zero vector a fault, and an arbitrary direction."""
    if not np.linalg.norm(vector) > 1e-12:
        reader.faults.add(place, "an axis must have a direction", dict(element.attrib))
        return np.array([0.0, 0.0, 1.0])
    return unit(vector)


@dataclass(frozen=True)
class _Motor:
    """One actuator: turns of its shaft per turn of each joint, and the ratio and rotor before the shaft."""

    place: str
    turns: dict[str, float]
    ratio: float
    inertia: float


def _actuators(reading: _Reading, root: ElementTree.Element) -> None:
    """Ratio and rotor of the motors: each of one joint, or coupled to as many joints by fixed tendons."""
    shafts = {one.get("name", ""): one for one in root.findall("tendon/fixed")}
    motors, reader = [], reading.reader
    for written in (one for section in root.findall("actuator") for one in section):
        element = _filled(reading, written, "main")
        place = f"actuator {element.get('name', '')}"
        turns = {element.get("joint", element.get("jointinparent", "")): 1.0}
        if element.get("tendon", "") in shafts:
            driven = shafts[element.get("tendon", "")].findall("joint")
            turns = {one.get("joint", ""): reader.number(one, "coef", place, 0.0) for one in driven}
        words = element.get("gear", "1").split()
        try:
            ratio = float(words[0])
        except (ValueError, IndexError):
            reader.faults.add(place, "its gear must be numbers", element.get("gear"))
            continue
        if {*turns} <= {*reading.drives}:
            motors.append(_Motor(place, turns, ratio, reader.number(element, "armature", place, 0.0)))
    for group in _groups([{*one.turns} for one in motors]):
        joints = [name for name in reading.drives if name in group]
        own = [one for one in motors if {*one.turns} <= group]
        if len(own) != len(joints):
            if len(joints) > 1 or len({one.place for one in own if one.inertia}) > 1:
                places = ", ".join(one.place for one in own)
                reading.notes.append(f"{places}: not as many motors as joints ({', '.join(joints)}), not used")
            continue
        if len(joints) > 1:
            matrix = np.array([[one.turns.get(name, 0.0) for name in joints] for one in own])
            reading.couplings.append(UrdfCoupling(tuple(joints), matrix, tuple(one.ratio for one in own), ()))
        for name, one in zip(joints, own, strict=True):
            drive = reading.drives[name]
            if one.inertia:
                reading.drives[name] = UrdfDrive(drive.damping, drive.friction, one.ratio, one.inertia)


def _groups(sets: list[set[str]]) -> list[set[str]]:
    """Disjoint sets: sets with common elements are merged."""
    found: list[set[str]] = []
    for one in sets:
        whole = one.union(*(other for other in found if other & one))
        found = [*(other for other in found if not other & one), whole]
    return found
