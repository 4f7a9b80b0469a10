"""Arms from SDFormat files, as Gazebo and Drake write them."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.files.drives import UrdfDrive
from drivetrain.arm.files.model import SIX, UrdfJoint, UrdfModel, check_names, checked_body, fixed_joint
from drivetrain.arm.files.xml import UNLIMITED, Reader, read_document
from drivetrain.arrays import Array
from drivetrain.errors import nearest
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import inverse_pose, pose, pose_from_xyz_rpy
from drivetrain.spatial.rotations import rotation_from_quaternion, unit

WORLD, MODEL, PIN = "world", "__model__", "drake:ball_constraint"
AXES_OF_THE_JOINT = (1, 5)  # first version with axes in the joint's frame instead of the model's
KINDS = {
    "revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic", "fixed": "fixed", "ball": "floating",
    "universal": "floating", "revolute2": "floating", "screw": "floating", "gearbox": "floating",
}  # fmt: skip


def read_sdf(path: Path, tip: str | None = None) -> tuple[UrdfModel, Array | None]:
    """The contents of an SDF file with one model, and the gravity of its world [m/s^2] or None.

    The frame of a link is moved to its joint; all parts that cannot be read as an arm are faults. If no link but a
    frame has the name of the wanted tip, the frame is a link without mass.

    Reference: SDFormat, http://sdformat.org/spec, and its document on pose frame semantics.
    """
    root = read_document(path)
    reader = Reader(str(path))
    models = [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1:
        reader.faults.add("sdf", "must hold one <model>", len(models))
        reader.faults.raise_any()
    model = models[0]
    for tag in ("include", "model"):
        if model.find(tag) is not None:
            reader.faults.add(f"<{tag}>", "inside a model is not read")
    if _text(model, "static").lower() in ("true", "1"):
        reader.faults.add("<static>", "says that nothing in the model moves", "true")
    places = _Places(reader, model)
    joints, drives, own = dict[str, UrdfJoint](), dict[str, UrdfDrive](), dict[str, Array]()
    elements = {_name(reader, one): one for one in model.findall("joint")}
    notes = list[str]()
    for name, element in elements.items():
        own[places.link(_text(element, "child"))] = places.of(name)
    aged = _before(root.get("version", ""), AXES_OF_THE_JOINT)
    for name, element in elements.items():
        joints[name], drives[name] = _joint(reader, places, own, name, element, aged)
        if _number(reader, element.find("axis/dynamics"), "spring_stiffness", f"joint {name}", 0.0):
            notes.append(f"joint {name}: its spring (spring_stiffness) is not used: state it under counterbalances")
    links = {_name(reader, one): one for one in model.findall("link")}
    found: dict[str, RigidBody | None] = {name: _body(reader, places, own, name, one) for name, one in links.items()}
    roots = [name for name in found if not any(joint.child == name for joint in joints.values())]
    stand = inverse_pose(places.of(WORLD)) @ places.of(roots[0]) if len(roots) == 1 else np.eye(4)
    if not np.allclose(stand[:3, :3], np.eye(3), atol=1e-9):  # the direction of gravity depends on the base's pose
        held = fixed_joint("world_fixed", WORLD, roots[0], stand)
        joints[held.name], drives[held.name] = held, UrdfDrive()
    if any(joint.parent == WORLD for joint in joints.values()):
        found = {WORLD: None, **found}
    falls = (root.findtext("world/gravity") or "").strip()
    gravity = _numbers(reader, falls, "world, <gravity>", [0.0] * 3) if falls else None
    check_names(reader, found, joints)
    reader.faults.raise_any()
    drives = {name: drives[name] for name, joint in joints.items() if joint.movable}
    bare = [joint.child for joint in joints.values() if links[joint.child].find("inertial") is None]
    notes += [f"link {name}: no <inertial>, so 1 kg and 1 kg m^2 about each axis, SDF's default" for name in bare]
    afloat = [name for name, one in links.items() if _text(one, "gravity").lower() in ("false", "0")]
    notes += [f"link {name}: <gravity> not used: the drives must carry its weight" for name in afloat]
    if tip is not None and tip not in found and tip in {one.get("name") for one in model.findall("frame")}:
        at = places.link(tip)
        held = fixed_joint(f"{tip}_fixed", at, tip, inverse_pose(own.get(at, places.of(at))) @ places.of(tip))
        joints[held.name], found[tip] = held, None
    pins = sum(one.tag == PIN for one in model)
    notes += [f"{pins} pins of closed loops are left out: state them as closures"] if pins else []
    return UrdfModel(model.get("name", path.stem), str(path), found, joints, drives, (), tuple(notes)), gravity


def _before(written: str, version: tuple[int, int]) -> bool:
    """Whether a version is older than the given one; an unreadable version counts as new."""
    parts = written.strip().split(".")
    return len(parts) == 2 and all(part.isdigit() for part in parts) and (int(parts[0]), int(parts[1])) < version


class _Places:
    """Poses of links, joints and frames in the model's frame."""

    def __init__(self, reader: Reader, model: ElementTree.Element):
        self._reader = reader
        self._elements = {one.get("name", ""): one for tag in ("link", "joint", "frame") for one in model.findall(tag)}
        self._known = {MODEL: np.eye(4), WORLD: np.eye(4), "": np.eye(4)}
        self._open: set[str] = set()
        written = model.find("pose")
        relative = "" if written is None else written.get("relative_to", "")
        if relative not in ("", WORLD):
            reader.faults.add("model", "its pose relative to a frame of the world is not read", relative)
        placed = self.of(model.get("placement_frame", ""))
        self._known[WORLD] = placed @ inverse_pose(_pose(reader, written, "model"))

    def of(self, name: str) -> Array:
        """Pose of a link, joint or frame by name, (4, 4); translation [m]."""
        if name in self._known:
            return self._known[name]
        element = self._elements.get(name)
        if element is None or name in self._open:
            problem = "is no link, joint or frame" if element is None else "is relative to itself"
            self._reader.faults.add("pose", problem, name, nearest(name, self._elements))
            return np.eye(4)
        self._open.add(name)
        written = element.find("pose")
        usual = {"joint": _text(element, "child"), "frame": element.get("attached_to", MODEL)}.get(element.tag, MODEL)
        relative = usual if written is None else written.get("relative_to", usual)
        self._known[name] = self.of(relative) @ _pose(self._reader, written, name)
        return self._known[name]

    def link(self, name: str) -> str:
        """The link to which a frame is attached; a name that refers to no frame is returned unchanged."""
        at, seen = name, set[str]()
        while at in self._elements and at not in seen and self._elements[at].tag != "link":
            seen.add(at)
            element = self._elements[at]
            at = _text(element, "child") if element.tag == "joint" else element.get("attached_to", "")
        return at if at == WORLD or (at in self._elements and at not in seen) else name


def _name(reader: Reader, element: ElementTree.Element) -> str:
    return reader.text(element, "name", element.tag)


def _text(element: ElementTree.Element, tag: str) -> str:
    return (element.findtext(tag) or "").strip()


def _numbers(reader: Reader, text: str, place: str, default: list[float]) -> Array:
    return reader.parsed(text or None, "<value text=...>", place, default)


def _number(reader: Reader, element: ElementTree.Element | None, tag: str, place: str, default: float) -> float:
    text = "" if element is None else _text(element, tag)
    if text.lower().lstrip("-+") in ("inf", "infinity"):
        return -math.inf if text.startswith("-") else math.inf
    value = float(_numbers(reader, text, f"{place}, <{tag}>", [default])[0]) if text else default
    return math.copysign(math.inf, value) if abs(value) >= 1e16 or abs(value) >= UNLIMITED else value


def _pose(reader: Reader, written: ElementTree.Element | None, place: str) -> Array:
    if written is None:
        return np.eye(4)
    form = written.get("rotation_format", "euler_rpy")
    if form == "quat_xyzw":
        numbers = _numbers(reader, (written.text or "").strip(), f"{place}, <pose>", [0.0] * 6 + [1.0])
        return pose(rotation_from_quaternion(numbers[6], numbers[3:6]), numbers[:3])
    if form != "euler_rpy":
        reader.faults.add(place, "its rotation_format must be euler_rpy or quat_xyzw", form)
    numbers = _numbers(reader, (written.text or "").strip(), f"{place}, <pose>", [0.0] * 6)
    turn = math.pi / 180.0 if written.get("degrees") in ("true", "1") else 1.0
    return pose_from_xyz_rpy(numbers[:3], numbers[3:] * turn)


def _body(reader: Reader, places: _Places, own: dict[str, Array], name: str, element: ElementTree.Element) -> RigidBody:
    inertial, place = element.find("inertial"), f"link {name}"
    inertial = ElementTree.Element("inertial") if inertial is None else inertial  # default: 1 kg
    if inertial.get("auto") in ("true", "1"):
        reader.faults.add(place, "its <inertial> is to be computed from its collision shapes, which is not done")
    mass = _number(reader, inertial, "mass", place, 1.0)
    tensor, written = np.zeros((3, 3)), inertial.find("inertia")
    for i, j in SIX:
        usual = 1.0 if i == j else 0.0
        tensor[i, j] = tensor[j, i] = _number(reader, written, f"i{'xyz'[i]}{'xyz'[j]}", place, usual)
    body = checked_body(reader, place, mass, tensor, "<inertia>")
    here = inverse_pose(own.get(name, places.of(name))) @ places.of(name)
    return body.seen_from(here @ _pose(reader, inertial.find("pose"), place))


def _joint(
    reader: Reader, places: _Places, own: dict[str, Array], name: str, element: ElementTree.Element, aged: bool
) -> tuple[UrdfJoint, UrdfDrive]:
    place, kind = f"joint {name}", reader.text(element, "type", f"joint {name}")
    if kind and kind not in KINDS:
        reader.faults.add(place, f"its type must be one of {', '.join(KINDS)}", kind, nearest(kind, KINDS))
    parent, child = places.link(_text(element, "parent")), places.link(_text(element, "child"))
    axis_element, here = element.find("axis"), places.of(name)
    limit = None if axis_element is None else axis_element.find("limit")
    dynamics = None if axis_element is None else axis_element.find("dynamics")
    axis = np.array([0.0, 0.0, 1.0])
    written = None if axis_element is None or kind == "fixed" else axis_element.find("xyz")
    if written is not None:
        axis = _numbers(reader, (written.text or "").strip(), f"{place}, <xyz>", [0.0, 0.0, 1.0])
        usual = _text(axis_element, "use_parent_model_frame").lower() if axis_element is not None else ""
        frame = MODEL if aged or usual in ("true", "1") else written.get("expressed_in")
        if frame:
            axis = here[:3, :3].T @ places.of(frame)[:3, :3] @ axis
    if not axis.any():
        reader.faults.add(place, "its axis must have a direction")
        axis = np.array([0.0, 0.0, 1.0])
    known = {
        "damping": _number(reader, dynamics, "damping", place, 0.0) or None,
        "friction": _number(reader, dynamics, "friction", place, 0.0) or None,
        "ratio": _number(reader, element, "drake:gear_ratio", place, math.nan),
        "rotor_inertia": _number(reader, element, "drake:rotor_inertia", place, math.nan),
    }
    drive = UrdfDrive(**{key: None if value is None or math.isnan(value) else value for key, value in known.items()})
    before = own.get(parent, places.of(parent))
    mimic = None if axis_element is None else axis_element.find("mimic")
    speed = _number(reader, limit, "velocity", place, math.inf)
    joint = UrdfJoint(
        name, KINDS.get(kind, kind), parent, child, inverse_pose(before) @ here, unit(axis),
        _number(reader, limit, "lower", place, -math.inf), _number(reader, limit, "upper", place, math.inf),
        speed if speed > 0.0 else math.inf, "" if mimic is None else mimic.get("joint", "?"),
    )  # fmt: skip
    return joint, drive
