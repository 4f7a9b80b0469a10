"""Drives in a URDF file: joint friction, gear ratio and rotor inertia (in three dialects), and couplings.

Transmissions that couple two motors with two joints are those of ros_control. Differential: the motor angles are
``n_a1 (n_j1 q1 + n_j2 q2)`` and ``n_a2 (n_j1 q1 - n_j2 q2)``. Four-bar linkage, and any belt across a joint:
``n_a1 n_j1 q1`` and ``n_a2 (q1 + n_j2 q2)``. The reductions n_a are the gear ratios; n_j define the coupling.

Reference: ros_control, transmission_interface, DifferentialTransmission and FourBarLinkageTransmission; its page on the
    former has a misprint, the torque of joint 2 with a plus where the code has a minus.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.coupling import differential
from drivetrain.arm.files.xml import Reader
from drivetrain.arrays import Array
from drivetrain.units import number_of

REDUCTIONS = ("mechanicalReduction", "mechanical_reduction")  # ROS 1 and ROS 2
ROTOR_INERTIA, GEAR_RATIO = TAGS = "drake:rotor_inertia", "drake:gear_ratio"
DIFFERENTIAL, FOUR_BAR = "DifferentialTransmission", "FourBarLinkageTransmission"
SIMPLE = "SimpleTransmission"
JOINTS, ACTUATORS = ("joint1", "joint2"), ("actuator1", "actuator2")


@dataclass(frozen=True, eq=False)
class UrdfCoupling:
    """A group of joints driven together by the same number of motors; two in URDF."""

    joints: tuple[str, ...]  # their names; the first has the drive of the first motor
    matrix: Array  # turns of the shafts behind the gears per turn of each joint [-], (n, n)
    ratios: tuple[float, ...]  # gear ratios [-], (n,)
    actuators: tuple[ElementTree.Element, ...]  # the motors' elements, in the order of the joints


def read_coupling(reader: Reader, transmission: ElementTree.Element, kind: str) -> UrdfCoupling | None:
    """The coupling of a transmission; None if it is of another type, or if roles or reductions are missing."""
    which = next((name for name in (DIFFERENTIAL, FOUR_BAR) if kind.endswith(name)), None)
    joints = _by_role(transmission, "joint", JOINTS)
    actuators = _by_role(transmission, "actuator", ACTUATORS)
    if which is None or joints is None or actuators is None:
        return None
    for element in (*joints, *actuators):
        reader.count_ignored(element, ("role", *REDUCTIONS, *TAGS), ("name", "role"))
    place = f"transmission {transmission.get('name', '?')}"
    first, second = (_reduction(reader, joint, place) or 1.0 for joint in joints)
    ratios = tuple(_reduction(reader, actuator, place) for actuator in actuators)
    if None in ratios:
        return None
    names = tuple(joint.get("name", "") for joint in joints)
    matrix = differential(first, second) if which == DIFFERENTIAL else np.array([[first, 0.0], [1.0, second]])
    return UrdfCoupling((names[0], names[1]), matrix, (ratios[0] or 1.0, ratios[1] or 1.0), actuators)


def _by_role(
    transmission: ElementTree.Element, tag: str, roles: tuple[str, str]
) -> tuple[ElementTree.Element, ElementTree.Element] | None:
    """The two elements in the order of their roles; None if roles are missing or different."""
    found = {}
    for element in transmission.findall(tag):
        inner = element.find("role")
        role = element.get("role", "") if inner is None else (inner.text or "")
        found[role.strip()] = element
    return (found[roles[0]], found[roles[1]]) if sorted(found) == sorted(roles) else None


def _reduction(reader: Reader, element: ElementTree.Element, place: str) -> float | None:
    """A reduction [- or rad/m]; None if the element has none."""
    texts = [child.text or "" for child in element if child.tag in REDUCTIONS]
    return checked_reduction(reader, texts[0], place) if texts else None


def checked_reduction(reader: Reader, text: str, place: str) -> float:
    """A reduction as a number [- or rad/m]; 0 and a fault if it is not a number, not finite or zero."""
    value = number_of(text)
    if value == 0.0 or not np.isfinite(value):
        reader.faults.add(place, "its reduction must be a finite number other than zero", text)
        return 0.0
    return value


@dataclass(frozen=True)
class UrdfDrive:
    """Data of one joint's drive in a file; None if missing."""

    damping: float | None = None  # viscous friction at the joint [N m s/rad or N s/m]
    friction: float | None = None  # Coulomb friction at the joint [N m or N]
    ratio: float | None = None  # rotor turns per turn of the joint, signed [-], or rotor angle over travel [rad/m]
    rotor_inertia: float | None = None  # about the spin axis, at the rotor [kg m^2]


def read_drives(
    reader: Reader, root: ElementTree.Element, joints: dict[str, ElementTree.Element]
) -> tuple[dict[str, UrdfDrive], list[UrdfCoupling], list[str]]:
    """The drive of each movable joint, the couplings of two motors with two joints, and notes on unused data."""
    notes: list[str] = []
    couplings: list[UrdfCoupling] = []
    reductions: dict[str, float] = {}
    drake: dict[str, dict[str, float]] = {name: _drake(reader, element, name) for name, element in joints.items()}
    names = [element.get("name", "") for element in root.findall("joint")]
    blocks = [root, *root.findall("ros2_control")]
    for block in blocks[1:]:
        reader.count_ignored(block, ("transmission",), ("name", "type"))
    for transmission in (element for block in blocks for element in block.findall("transmission")):
        absent = [joint for joint in _joints_of(transmission) if joint not in names]
        if absent:  # files of a part of a robot keep the transmissions of the whole
            name, others = transmission.get("name", "?"), ", ".join(absent)
            notes.append(f"transmission {name} not used: the file has no joint {others}")
            continue
        kind = _kind(reader, transmission)
        coupling = read_coupling(reader, transmission, kind)
        if coupling is not None and all(joint in joints for joint in coupling.joints):
            couplings.append(coupling)
            for joint, ratio, actuator in zip(coupling.joints, coupling.ratios, coupling.actuators, strict=True):
                reductions[joint] = ratio
                drake[joint] |= _drake(reader, actuator, joint)
            continue
        joint = _driven_joint(transmission, kind, notes)
        if joint in joints:
            _take_reduction(reader, transmission, joint, reductions)
            for actuator in transmission.findall("actuator"):
                drake[joint] |= _drake(reader, actuator, joint)
    for joint, tags in drake.items():
        stated = reductions.get(joint)
        if GEAR_RATIO in tags and stated not in (None, tags[GEAR_RATIO]):
            notes.append(f"joint {joint}: {GEAR_RATIO} {tags[GEAR_RATIO]:g} taken, not the reduction {stated:g}")
    drives = {name: _drive(reader, name, joints[name], drake[name], reductions.get(name)) for name in joints}
    return drives, couplings, notes


def _drive(
    reader: Reader, name: str, element: ElementTree.Element, drake: dict[str, float], reduction: float | None
) -> UrdfDrive:
    dynamics = element.find("dynamics")
    values: dict[str, float | None] = {"damping": None, "friction": None}
    if dynamics is not None:
        reader.count_ignored(dynamics, (), values)
        for attribute in values:
            if attribute in dynamics.keys():
                values[attribute] = reader.number(dynamics, attribute, f"joint {name}", 0.0)
    ratio = drake.get(GEAR_RATIO, reduction)
    return UrdfDrive(values["damping"], values["friction"], ratio, drake.get(ROTOR_INERTIA))


def _drake(reader: Reader, element: ElementTree.Element, joint: str) -> dict[str, float]:
    found = {}
    for tag in (ROTOR_INERTIA, GEAR_RATIO):
        # find() would take the colon for a namespace
        child = next((child for child in element if child.tag == tag), None)
        if child is None:
            continue
        found[tag] = reader.number(child, "value", f"joint {joint}")
        if found[tag] < 0.0 and tag == ROTOR_INERTIA:
            reader.faults.add(f"joint {joint}", f"<{tag}> must not be negative [kg m^2]", found[tag])
        if found[tag] == 0.0 and tag == GEAR_RATIO:
            reader.faults.add(f"joint {joint}", f"<{tag}> must not be zero")
    return found


def _joints_of(transmission: ElementTree.Element) -> list[str]:
    return [element.get("name", "") for element in transmission.findall("joint")]


def _kind(reader: Reader, transmission: ElementTree.Element) -> str:
    reader.count_ignored(transmission, ("joint", "actuator", "type", "plugin", *REDUCTIONS), ("name", "type"))
    kinds = [element.text or "" for tag in ("type", "plugin") for element in transmission.findall(tag)]
    return (kinds[0] if kinds else transmission.get("type", SIMPLE)).strip()


def _driven_joint(transmission: ElementTree.Element, kind: str, notes: list[str]) -> str:
    """The joint of a simple transmission; empty, with a note, for any other transmission."""
    joints = _joints_of(transmission)
    if len(joints) == 1 and kind.endswith(SIMPLE):
        return joints[0]
    couple = ", ".join(joints) or "no joint"
    known = f"only {SIMPLE} is, and differentials and four-bar linkages with roles and reductions"
    notes.append(f"transmission {transmission.get('name', '?')} ({kind}) of {couple} not read: {known}")
    return ""


def _take_reduction(
    reader: Reader, transmission: ElementTree.Element, joint: str, reductions: dict[str, float]
) -> None:
    """The reduction of a simple transmission, which ROS 1 puts at the actuator, ROS 2 at the joint."""
    known = (*REDUCTIONS, ROTOR_INERTIA, GEAR_RATIO)
    for element in (*transmission.findall("joint"), *transmission.findall("actuator")):
        reader.count_ignored(element, known, ("name", "role"))
    holders = [*transmission.findall("joint"), *transmission.findall("actuator"), transmission]
    written = [child.text or "" for holder in holders for child in holder if child.tag in REDUCTIONS]
    for text in written[:1]:
        place = f"transmission {transmission.get('name', '?')}"
        reduction = checked_reduction(reader, text, place)
        if reduction and reductions.setdefault(joint, reduction) != reduction:
            reader.faults.add(place, f"gives joint {joint} another reduction than {reductions[joint]:g}", text)
