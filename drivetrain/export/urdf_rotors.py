"""Rotors in URDF: ratio and axial inertia of each rotor in tags, the rest of its inertia as part of the links.

A reader that supports the rotor tags places a rotor on its joint's axis, carried by the previous link. A balanced
rotor that is parallel to that axis and carried by that link has the same effect on the arm, if its mass and its
transverse inertia are included in the link; so it is written without loss. Of any other rotor URDF can represent only
the reflected inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.checks import called
from drivetrain.arm.coupling import coupled_groups
from drivetrain.arm.files.drives import DIFFERENTIAL, FOUR_BAR
from drivetrain.arm.rotors import MountedRotor, RotorLevel
from drivetrain.arrays import Array
from drivetrain.errors import Faults
from drivetrain.spatial.inertia import RigidBody, combined
from drivetrain.spatial.poses import inverse_pose

PRODUCT_TOLERANCE = 1e-12  # relative tolerance for products of printed numbers


@dataclass(frozen=True, eq=False)
class Pair:
    """Two joints with two coupled motors."""

    kind: str  # ros_control's name for the transmission
    joints: tuple[int, int]  # indices in the order of ros_control's roles, which is also the order of the motors
    reductions: tuple[float, float]  # of the joints [-]
    # factors on the gears' ratios for the same motor speeds as in the arm [-]
    factors: tuple[float, float]


@dataclass(frozen=True, eq=False)
class WrittenCouplings:
    """An arm's coupling, as far as URDF can represent it."""

    pairs: tuple[Pair, ...]  # couplings of two motors with two joints
    factors: Array  # factor on each gear's ratio [-], (n,)
    lost: tuple[tuple[int, ...], ...]  # groups of joints whose coupling URDF cannot represent


def written_couplings(arm: Arm) -> WrittenCouplings:
    """The coupling of an arm as URDF's transmissions."""
    pairs, lost = [], []
    factors = np.ones(arm.n)
    for group in coupled_groups(arm):
        found = None if arm.coupling is None or len(group) > 2 else _representable(arm.coupling, group)
        # A direct drive has no ratio that could be multiplied by a factor.
        direct = found and any(arm.rotors[i] is None and f != 1.0 for i, f in zip(group, found[1], strict=True))
        if found is None or direct:
            lost.append(group)
            continue
        factors[list(group)] = found[1]
        pairs += [] if found[0] is None else [found[0]]
    return WrittenCouplings(tuple(pairs), factors, tuple(lost))


def _representable(coupling: Array, group: tuple[int, ...]) -> tuple[Pair | None, tuple[float, ...]] | None:
    """The pair, if the group is one, and the factors on the group's ratios; None if URDF cannot represent it."""
    if len(group) == 1:
        return None, (float(coupling[group[0], group[0]]),)
    for joints in (group, group[::-1]):
        pair = _pair(coupling[np.ix_(joints, joints)], (joints[0], joints[1]))
        if pair is not None:
            return pair, pair.factors if joints == group else pair.factors[::-1]
    return None


def _pair(matrix: Array, joints: tuple[int, int]) -> Pair | None:
    (a, b), (c, d) = matrix.tolist()
    if a and b and abs(a * d + b * c) <= PRODUCT_TOLERANCE * abs(a * d):
        return Pair(DIFFERENTIAL, joints, (a, b), (1.0, c / a))
    if a and c and d and not b:
        return Pair(FOUR_BAR, joints, (a, d / c), (1.0, c))
    return None


PARALLEL = 1e-9  # tolerance of directions: far below manufacturing tolerances
ROUNDING = 1e-13  # relative rounding error of a rotor's inertia without its axial part
HINT = "drivetrain.at_level(arm, RotorLevel.REFLECTED) leaves of them what URDF holds"


@dataclass(frozen=True, eq=False)
class RotorTags:
    """The tags of one joint's rotor."""

    ratio: float  # rotor turns per turn of the joint about its own axis [-], or rotor angle over travel [rad/m]
    inertia: float | None  # about the spin axis [kg m^2]; None: no tag


@dataclass(frozen=True, eq=False)
class WrittenBodies:
    """The links and rotors as written."""

    links: tuple[RigidBody, ...]  # of each link, in its home frame [kg, m, kg m^2], (n,)
    # of each joint, (n,); None: direct drive, or a coupling that URDF cannot represent
    tags: tuple[RotorTags | None, ...]
    pairs: tuple[Pair, ...]  # joints with coupled motors
    notes: tuple[str, ...]  # what URDF does not represent, and what was moved into the links


def written_bodies(arm: Arm) -> WrittenBodies:
    """The links and rotors of an arm as URDF can represent them, with the same dynamics at the arm's rotor level."""
    faults, couplings = Faults(), written_couplings(arm)
    lost = {joint for group in couplings.lost for joint in group}
    added: list[list[RigidBody]] = [[] for _ in range(arm.n)]
    moved, tags = [], []
    for joint, rotor in enumerate(arm.rotors):
        if rotor is not None and arm.level is RotorLevel.FULL:
            _check_full(arm, joint, rotor, faults, lost=joint in lost)
        tag = None
        if rotor is not None and joint not in lost:
            ratio = rotor.ratio * (_turn(arm, joint, rotor) or 1) * float(couplings.factors[joint])
            tag = RotorTags(ratio, None if arm.level is RotorLevel.NONE else rotor.axial_inertia)
        tags.append(tag)
        if rotor is not None and _move_into_links(arm, joint, rotor, added, tag=tag):
            moved.append(arm.joint_names[joint])
    faults.raise_any()
    links = tuple(_with_added(arm, i, parts, faults) for i, parts in enumerate(added))
    faults.raise_any()
    notes = []
    if any(tags) and arm.level is not RotorLevel.FULL:
        note = f"rotors are counted at level {arm.level.value}, which URDF cannot say: set it after reading"
        kept = "" if arm.level is RotorLevel.REFLECTED else "; rotor inertias left out, ratios kept"
        notes.append(note + kept)
    if moved:
        notes.append("mass and cross inertia of rotors, written as part of the links that carry them: joint "
                     + ", ".join(moved))  # fmt: skip
    for group in couplings.lost:
        names = ", ".join(arm.joint_names[joint] for joint in group)
        notes.append(f"motors of {names} are coupled in a way that URDF has no words for: ratios and the inertia of "
                     "their spin left out")  # fmt: skip
    return WrittenBodies(links, tuple(tags), couplings.pairs, tuple(notes))


def _turn(arm: Arm, joint: int, rotor: MountedRotor) -> int:
    """1 if the rotor's axis is parallel to the joint's, -1 if it is antiparallel, else 0."""
    along = float(rotor.screw[:3] @ arm.axes[joint])
    across = float(np.linalg.norm(np.cross(rotor.screw[:3], arm.axes[joint])))
    return int(np.sign(along)) if across <= PARALLEL else 0


def _check_full(arm: Arm, joint: int, rotor: MountedRotor, faults: Faults, *, lost: bool) -> None:
    """Add faults if a rotor at level ``full`` is not equivalent to one on the joint's axis, on the previous link."""
    place = f"rotor of joint {arm.joint_names[joint]}"
    if lost:
        problem = "is coupled to several joints in a way that URDF has no words for"
        faults.add(place, problem, None, "drivetrain.at_level(arm, RotorLevel.NONE) locks it to its carrier")
        return
    spin = rotor.home[:3, :3].T @ rotor.screw[:3]
    offset = rotor.home[:3, 3] - np.cross(rotor.screw[:3], rotor.screw[3:])
    off_axis = float(np.linalg.norm(np.cross(rotor.screw[:3], offset)))
    axial = float(spin @ rotor.inertia @ spin)
    cross = 0.5 * (float(np.trace(rotor.inertia)) - axial)
    shape = axial * np.outer(spin, spin) + cross * (np.eye(3) - np.outer(spin, spin))
    uneven = float(np.abs(rotor.inertia - shape).max()) > PARALLEL * float(np.abs(rotor.inertia).max())
    if uneven or (rotor.mass > 0.0 and off_axis > PARALLEL):
        faults.add(place, "is not balanced: URDF has no word for that", None, HINT)
    if rotor.carrier != joint - 1:
        carrier = "the base" if rotor.carrier < 0 else called(arm.link_names[rotor.carrier])
        faults.add(place, f"is carried by {carrier}: in URDF the link before the joint carries it", None, HINT)
    elif joint > 0 and not _turn(arm, joint, rotor):
        faults.add(place, "is not parallel to the joint's axis, as URDF takes it to be", None, HINT)


def _move_into_links(
    arm: Arm, joint: int, rotor: MountedRotor, added: list[list[RigidBody]], *, tag: RotorTags | None
) -> bool:
    """Add a rotor to the links in ``added``, without the axial inertia that readers add to the previous link.

    Returns whether anything was added.
    """
    parts = [(rotor.carrier, rotor.body)]
    if tag is not None and tag.inertia is not None:
        z = arm.axes[joint]
        axial = RigidBody(0.0, rotor.body.com, -rotor.axial_inertia * np.outer(z, z))
        if rotor.carrier == joint - 1:
            parts = [(rotor.carrier, _without_axial(rotor.body, axial))]
        else:
            parts.append((joint - 1, axial))
    parts = [(link, part) for link, part in parts if link >= 0 and (part.mass or part.inertia.any())]
    for link, part in parts:
        added[link].append(part)
    return bool(parts)


def _without_axial(body: RigidBody, axial: RigidBody) -> RigidBody:
    """A rotor without its axial inertia; a zero transverse inertia stays exactly zero."""
    transverse = body.inertia + axial.inertia
    if np.abs(transverse).max() <= ROUNDING * np.abs(body.inertia).max():
        transverse = np.zeros((3, 3))
    return RigidBody(body.mass, body.com, transverse)


def _with_added(arm: Arm, link: int, parts: list[RigidBody], faults: Faults) -> RigidBody:
    """A link with the parts added to it, in its home frame."""
    own = RigidBody(arm.masses[link], np.zeros(3), arm.inertias[link])
    if not parts:
        return own
    back = inverse_pose(arm.home[link])
    whole = combined([own, *(part.seen_from(back) for part in parts)])
    least = float(np.linalg.eigvalsh(whole.inertia)[0])
    if least < -ROUNDING * float(np.abs(whole.inertia).max()):
        problem = "has too little inertia to give the next joint's rotor its own, as URDF's reader will"
        faults.add(called(arm.link_names[link]), problem, least)
    return RigidBody(whole.mass, whole.com, 0.5 * (whole.inertia + whole.inertia.T))
