"""What a URDF file says of its drives: joint friction, and in three dialects gear ratio and rotor inertia."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

from drivetrain.arm.urdf_couplings import (
    GEAR_RATIO,
    REDUCTIONS,
    ROTOR_INERTIA,
    UrdfCoupling,
    checked_reduction,
    read_coupling,
)
from drivetrain.arm.urdf_xml import Reader
from drivetrain.errors import nearest

SIMPLE = "SimpleTransmission"


@dataclass(frozen=True)
class UrdfDrive:
    """What a file says of one joint's drive; None where it is silent.

    Attributes:
        damping: Viscous friction at the joint [N m s/rad or N s/m].
        friction: Coulomb friction at the joint [N m or N].
        ratio: Rotor turns a turn of the joint, signed [-], or rotor angle over travel [rad/m].
        rotor_inertia: About the spin axis, at the rotor [kg m^2].
    """

    damping: float | None = None
    friction: float | None = None
    ratio: float | None = None
    rotor_inertia: float | None = None


def read_drives(
    reader: Reader, root: ElementTree.Element, joints: dict[str, ElementTree.Element]
) -> tuple[dict[str, UrdfDrive], list[UrdfCoupling], list[str]]:
    """The drives of a parsed file.

    Returns:
        A drive a movable joint [SI], the couplings of two motors with two joints, and notes on what could not be used.
    """
    notes: list[str] = []
    couplings: list[UrdfCoupling] = []
    reductions: dict[str, float] = {}
    drake: dict[str, dict[str, float]] = {name: _drake(reader, element, name) for name, element in joints.items()}
    names = [element.get("name", "") for element in root.findall("joint")]
    blocks = [root, *root.findall("ros2_control")]
    for block in blocks[1:]:
        reader.count_ignored(block, ("transmission",), ("name", "type"))
    for transmission in (element for block in blocks for element in block.findall("transmission")):
        kind = _kind(reader, transmission, names)
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
    """One joint's drive from all that was found."""
    dynamics = element.find("dynamics")
    values: dict[str, float | None] = {"damping": None, "friction": None}
    if dynamics is not None:
        reader.count_ignored(dynamics, (), values)
        for attribute in values:
            if attribute in dynamics.keys():
                values[attribute] = float(reader.numbers(dynamics, attribute, f"joint {name}", [0.0])[0])
    ratio = drake.get(GEAR_RATIO, reduction)
    return UrdfDrive(values["damping"], values["friction"], ratio, drake.get(ROTOR_INERTIA))


def _drake(reader: Reader, element: ElementTree.Element, joint: str) -> dict[str, float]:
    """The values of the drake tags that are children of an element."""
    found = {}
    for tag in (ROTOR_INERTIA, GEAR_RATIO):
        child = next((child for child in element if child.tag == tag), None)  # find() reads a colon otherwise
        if child is None:
            continue
        found[tag] = reader.number(child, "value", f"joint {joint}")
        if found[tag] < 0.0 and tag == ROTOR_INERTIA:
            reader.faults.add(f"joint {joint}", f"<{tag}> must not be negative [kg m^2]", found[tag])
        if found[tag] == 0.0 and tag == GEAR_RATIO:
            reader.faults.add(f"joint {joint}", f"<{tag}> must not be zero")
    return found


def _kind(reader: Reader, transmission: ElementTree.Element, names: list[str]) -> str:
    """The type of a transmission; its joints must be there, whatever it is."""
    reader.count_ignored(transmission, ("joint", "actuator", "type", "plugin", *REDUCTIONS), ("name", "type"))
    for element in transmission.findall("joint"):
        joint = element.get("name", "")
        if joint not in names:
            place = f"transmission {transmission.get('name', '?')}"
            reader.faults.add(place, "names a joint that is not there", joint, nearest(joint, names))
    kinds = [element.text or "" for tag in ("type", "plugin") for element in transmission.findall(tag)]
    return (kinds[0] if kinds else transmission.get("type", SIMPLE)).strip()


def _driven_joint(transmission: ElementTree.Element, kind: str, notes: list[str]) -> str:
    """The one joint of a simple transmission; empty when it is not simple, with a note."""
    joints = [element.get("name", "") for element in transmission.findall("joint")]
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
