"""Arms from URDF files, without external parsers: meshes are opened only for drawing; unused data are reported.

From the tree of links in a file, the chain from the root to a tip is used; all other bodies are attached to its links.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm
from drivetrain.arm.checks import implausible
from drivetrain.arm.files.model import MOVABLE, REFUSED, REVOLUTE, UrdfJoint, UrdfModel
from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.spatial.inertia import RigidBody, combined
from drivetrain.spatial.poses import axis_screw

Joints = dict[str, list[UrdfJoint]]
USUAL_TIP = "tool0"  # name of the flange frame in ROS-Industrial


def arm_from_model(model: UrdfModel, *, tip: str | None, gravity: Any) -> tuple[Arm, list[str]]:
    """The arm of a parsed file without rotors, and texts on implausible values; gives no warning itself.

    Links on fixed joints, and on movable joints outside the chain (held at zero), are merged into the link that carries
    them. The point of each joint is the origin of its frame in the file. Ignored and implausible data are in the notes.
    """
    chain = choose_chain(model, tip)
    doubtful = _doubts(model, chain)
    lumped = [_lump(frame, bodies) for frame, bodies in zip(chain.frames, chain.bodies, strict=True)]
    screws = [axis_screw(frame[:3, :3] @ joint.axis, frame[:3, 3], slides=joint.kind not in REVOLUTE)
              for joint, frame in zip(chain.joints, chain.frames, strict=True)]  # fmt: skip
    arm = Arm.from_screws(
        [home for home, _, _ in lumped],
        screws,
        [mass for _, mass, _ in lumped],
        [inertia for _, _, inertia in lumped],
        chain.tip_pose,
        STANDARD_GRAVITY if gravity is None else gravity,
        joint_points=[frame[:3, 3] for frame in chain.frames],
        joint_names=[joint.name for joint in chain.joints],
        link_names=[joint.child for joint in chain.joints],
        lower=[joint.lower for joint in chain.joints],
        upper=[joint.upper for joint in chain.joints],
        speed_limits=[joint.speed_limit for joint in chain.joints],
        name=model.name,
        notes=[*model.notes, *_notes(chain, tip), *doubtful],
        check_inertias=False,  # checked above for each link, before they are merged
    )
    return replace(arm, frames=chain.links), doubtful


def _lump(frame: Array, bodies: list[RigidBody]) -> tuple[Array, float, Array]:
    """Home frame, mass and inertia of a moving link: the link's directions, at the common centre of mass."""
    home = frame.copy()
    if not bodies:
        return home, 0.0, np.zeros((3, 3))
    whole = combined(bodies)
    home[:3, 3] = whole.com
    rotation = frame[:3, :3]
    inertia = rotation.T @ whole.inertia @ rotation
    return home, whole.mass, 0.5 * (inertia + inertia.T)


def _notes(chain: Chain, wanted_tip: str | None) -> list[str]:
    notes = [] if wanted_tip else [f"tip: {chain.tip}, as none was named"]
    if chain.locked:
        notes.append("held at zero, off the chain: " + ", ".join(chain.locked))
    if chain.beyond:
        names, carrier = ", ".join(chain.beyond), chain.joints[-1].child
        notes.append(
            f"behind the tip {chain.tip}, kept as part of {carrier}: {names}, {sum(chain.beyond.values()):.3g} kg; "
            "take them out of the file if they are not mounted"
        )
    notes += [f"joint {j.name}: said to mimic {j.mimics}, taken as free" for j in chain.joints if j.mimics]
    notes += [f"joint {joint.name}: {joint.unsaid}" for joint in chain.joints if joint.unsaid]
    weights = [sum(body.mass for body in bodies) for bodies in chain.bodies]
    massless = [joint.child for joint, weight in zip(chain.joints, weights, strict=True) if not weight]
    if massless:
        notes.append("moving links without mass: " + ", ".join(massless))
    return notes


def _doubts(model: UrdfModel, chain: Chain) -> list[str]:
    """What is hard to believe of the links that move."""
    found = []
    for name in (rider for riders in chain.riders for rider in riders):
        body = model.links[name]
        points = [np.zeros(3), *(j.origin[:3, 3] for j in model.joints.values() if j.parent == name)]
        found += [] if body is None else implausible(name, body, points)
    return found


@dataclass(frozen=True, eq=False)
class Chain:
    """A chain chosen from a tree, everything in the root's frame with all joints at zero."""

    tip: str  # name of the tip link
    joints: tuple[UrdfJoint, ...]  # the movable joints from root to tip, in order, (n,)
    frames: tuple[Array, ...]  # of those joints, (n, 4, 4); translation [m]
    bodies: tuple[list[RigidBody], ...]  # bodies fixed to each moving link, its own first, n lists [kg, m, kg m^2]
    riders: tuple[list[str], ...]  # names of the links in ``bodies``, n lists
    tip_pose: Array  # pose of the tip link, (4, 4); translation [m]
    locked: tuple[str, ...]  # names of joints outside the chain that are not fixed, held at zero
    beyond: dict[str, float]  # links behind the tip with a mass, and their masses [kg]
    links: dict[str, tuple[str, Array]]  # as in ``Arm.frames``


def choose_chain(model: UrdfModel, tip: str | None) -> Chain:
    """The chain from the root link to a tip link."""
    base = _root(model)
    children, paths = _tree(model, base)
    end = _tip(model, paths, children, base, tip)
    refused = [joint for joint in paths[end] if joint.kind in REFUSED]
    if refused:
        known = ", ".join(MOVABLE)
        problem = f"is of a kind that a serial arm cannot have; known: {known} and fixed"
        raise InputError([Fault(f"joint {j.name}", problem, j.kind, file=model.file) for j in refused])
    path = [joint for joint in paths[end] if joint.movable]
    if not path:
        raise InputError(Fault("tip", f"there is no movable joint between {base} and {end}", file=model.file))
    return _collect(model, base, end, path, children)


def _root(model: UrdfModel) -> str:
    held = {joint.child for joint in model.joints.values()}
    roots = [name for name in model.links if name not in held]
    if len(roots) > 1:
        raise InputError(Fault("links", "several hang on no joint, so there is no single base", roots, file=model.file))
    return roots[0]


def _tree(model: UrdfModel, base: str) -> tuple[Joints, Joints]:
    """The joints on each link, and those from the base to each link that it carries; in the order of the file."""
    children: Joints = {name: [] for name in model.links}
    for joint in model.joints.values():
        children[joint.parent].append(joint)
    paths: Joints = {base: []}
    waiting = [base]
    while waiting:
        link = waiting.pop(0)
        for joint in children[link]:
            if joint.child not in paths:
                paths[joint.child] = [*paths[link], joint]
                waiting.append(joint.child)
    return children, paths


def _tip(model: UrdfModel, paths: Joints, children: Joints, base: str, tip: str | None) -> str:
    """The end-effector link: the requested one, or the end of the chain if one chain contains all others."""
    if tip is not None:
        if tip in paths:
            return tip
        problem = f"no link that {base} carries" if tip in model.links else "no such link"
        raise InputError(Fault("tip", problem, tip, nearest(tip, paths), model.file))
    leaves = [name for name in paths if not children[name]]
    moving = {leaf: [joint.name for joint in paths[leaf] if joint.movable] for leaf in leaves}
    longest = max(moving.values(), key=len)
    if any(longest[: len(chain)] != chain for chain in moving.values()):
        problem = "the file has several chains: choose the link that is the end effector"
        raise InputError(Fault("tip", problem, None, "ends: " + ", ".join(leaves), model.file))
    ends = [leaf for leaf in leaves if moving[leaf] == longest]
    if USUAL_TIP in ends:
        return USUAL_TIP
    return max(ends, key=lambda leaf: len(paths[leaf]))


def tip_among_several(model: UrdfModel) -> str | None:
    """The likely end effector of a file with several chains; None if one chain contains all others.

    It is the last link that all moving chains have in common (the hand of several fingers) if the common part is at
    least half of the longest chain, else the end of the longest chain.
    """
    _, paths = _tree(model, _root(model))
    moving = {link: [joint.name for joint in path if joint.movable] for link, path in paths.items()}
    longest = max(moving, key=lambda link: (len(moving[link]), len(paths[link])))  # a foot that is fixed to the shank
    if all(chain == moving[longest][: len(chain)] for chain in moving.values()):
        return None
    ends = [link for link in paths if all(chain[: len(moving[link])] != moving[link] or chain == moving[link]
                                          for chain in moving.values())]  # fmt: skip
    common = [step[0] for step in zip(*(paths[link] for link in ends), strict=False) if len({*map(id, step)}) == 1]
    shared = [joint for joint in common if joint.movable]
    return common[-1].child if shared and 2 * len(shared) >= len(moving[longest]) else longest


def _collect(model: UrdfModel, base: str, tip: str, path: list[UrdfJoint], children: Joints) -> Chain:
    """Every body of the tree, in the base frame, with the moving link that carries it."""
    order = {joint.name: i for i, joint in enumerate(path)}
    bodies: tuple[list[RigidBody], ...] = tuple([] for _ in path)
    riders: tuple[list[str], ...] = tuple([] for _ in path)
    frames: list[Array] = [np.eye(4)] * len(path)
    locked: list[str] = []
    tip_pose = np.eye(4)
    beyond: dict[str, float] = {}
    links: dict[str, tuple[str, Array]] = {}
    waiting = [(base, np.eye(4), -1, False)]
    while waiting:
        link, frame, carrier, behind = waiting.pop(0)
        body, links[link] = model.links[link], (path[carrier].child if carrier >= 0 else "", frame)
        if behind and body is not None and body.mass:
            beyond[link] = body.mass
        if carrier >= 0 and body is not None:
            bodies[carrier].append(body.seen_from(frame))
            riders[carrier].append(link)
        if link == tip:
            tip_pose = frame
        for joint in children[link]:
            child_frame, child_carrier = frame @ joint.origin, order.get(joint.name, carrier)
            if joint.name in order:
                frames[order[joint.name]] = child_frame
            elif joint.kind != "fixed":
                locked.append(joint.name)
            waiting.append((joint.child, child_frame, child_carrier, behind or link == tip))
    return Chain(tip, tuple(path), tuple(frames), bodies, riders, tip_pose, tuple(locked), beyond, links)
