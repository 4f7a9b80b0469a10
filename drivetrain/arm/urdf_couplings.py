"""Transmissions of a URDF file that join two motors to two joints, as ros_control defines them.

Differential: motors turn ``n_a1 (n_j1 q1 + n_j2 q2)`` and ``n_a2 (n_j1 q1 - n_j2 q2)``. Four-bar linkage, and every
belt over a joint: ``n_a1 n_j1 q1`` and ``n_a2 (q1 + n_j2 q2)``. The reductions n_a are the gears' ratios, n_j make the
coupling.

Reference: ros_control, transmission_interface, DifferentialTransmission and FourBarLinkageTransmission; its page on the
    former has a misprint, the torque of joint 2 with a plus where the code has a minus.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.coupling import differential
from drivetrain.arm.urdf_xml import Reader
from drivetrain.arrays import Array

REDUCTIONS = ("mechanicalReduction", "mechanical_reduction")  # ROS 1 and ROS 2
ROTOR_INERTIA, GEAR_RATIO = TAGS = "drake:rotor_inertia", "drake:gear_ratio"
DIFFERENTIAL, FOUR_BAR = "DifferentialTransmission", "FourBarLinkageTransmission"
JOINTS, ACTUATORS = ("joint1", "joint2"), ("actuator1", "actuator2")


@dataclass(frozen=True, eq=False)
class UrdfCoupling:
    """Two joints that two motors drive together.

    Attributes:
        joints: Their names; the first has the drive of the first motor.
        matrix: Turns of the shafts behind the gears a turn of each joint [-], (2, 2).
        ratios: Of the gears [-], (2,).
        actuators: The motors' elements, in the order of the joints.
    """

    joints: tuple[str, str]
    matrix: Array
    ratios: tuple[float, float]
    actuators: tuple[ElementTree.Element, ElementTree.Element]


def read_coupling(reader: Reader, transmission: ElementTree.Element, kind: str) -> UrdfCoupling | None:
    """The coupling of a transmission.

    Returns:
        The coupling [-]; None where it is of another type, or roles or the motors' reductions are missing.
    """
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
    """The two elements in the order of their roles; None where roles are missing or others."""
    found = {}
    for element in transmission.findall(tag):
        inner = element.find("role")
        role = element.get("role", "") if inner is None else (inner.text or "")
        found[role.strip()] = element
    return (found[roles[0]], found[roles[1]]) if sorted(found) == sorted(roles) else None


def _reduction(reader: Reader, element: ElementTree.Element, place: str) -> float | None:
    """A reduction; None where the element has none."""
    texts = [child.text or "" for child in element if child.tag in REDUCTIONS]
    return checked_reduction(reader, texts[0], place) if texts else None


def checked_reduction(reader: Reader, text: str, place: str) -> float:
    """A reduction as a number.

    Returns:
        The number [- or rad/m]; 0, and a fault, where it is none, not finite or zero.
    """
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if value == 0.0 or not np.isfinite(value):
        reader.faults.add(place, "its reduction must be a finite number other than zero", text)
        return 0.0
    return value
