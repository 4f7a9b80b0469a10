"""The tree of a URDF file: its root, the chain to a tip, and the bodies that ride on each link of the chain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arm.urdf_model import MOVABLE, REFUSED, UrdfJoint, UrdfModel
from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.spatial.inertia import RigidBody

Children = dict[str, list[UrdfJoint]]
USUAL_TIP = "tool0"  # what ROS-Industrial calls the flange frame


@dataclass(frozen=True, eq=False)
class Chain:
    """A chain chosen from a tree, everything in the root's frame with all joints at zero.

    Attributes:
        tip: Name of the tip link.
        joints: The movable joints from root to tip, in order, (n,).
        frames: Of those joints, (n, 4, 4); translation [m].
        bodies: That ride on each moving link, its own first, n lists [kg, m, kg m^2].
        riders: Names of the links with a place in ``bodies``, n lists.
        tip_pose: Of the tip link, (4, 4); translation [m].
        locked: Names of movable joints off the chain, held at zero.
    """

    tip: str
    joints: tuple[UrdfJoint, ...]
    frames: tuple[Array, ...]
    bodies: tuple[list[RigidBody], ...]
    riders: tuple[list[str], ...]
    tip_pose: Array
    locked: tuple[str, ...]


def choose_chain(model: UrdfModel, root: str | None, tip: str | None) -> Chain:
    """The chain from a root link to a tip link.

    Args:
        root: Name of the link that stands still; None: the one that hangs on nothing.
        tip: Name of the link that is the end effector; None: the end of the longest chain, if the others are part
            of it.

    Returns:
        The chain [m, kg, kg m^2].

    Raises:
        InputError: Unknown names, several roots, several chains and no tip, no movable joint, or a joint of a
            kind that a serial arm has not.
    """
    children: Children = {name: [] for name in model.links}
    for joint in model.joints.values():
        children[joint.parent].append(joint)
    base = _root(model, root)
    paths = _paths(base, children)
    refused = [joint for path in paths.values() for joint in path[-1:] if joint.kind in REFUSED]
    if refused:
        known = ", ".join(MOVABLE)
        problem = f"is of a kind that a serial arm has not; known: {known} and fixed"
        raise InputError([Fault(f"joint {j.name}", problem, j.kind, file=model.file) for j in refused])
    end = _tip(model, paths, children, base, tip)
    path = [joint for joint in paths[end] if joint.movable]
    if not path:
        raise InputError(Fault("tip", f"there is no movable joint between {base} and {end}", file=model.file))
    return _collect(model, base, end, path, children)


def _root(model: UrdfModel, wanted: str | None) -> str:
    """The link that stands still."""
    if wanted is not None:
        if wanted not in model.links:
            raise InputError(Fault("root", "no such link", wanted, nearest(wanted, model.links), model.file))
        return wanted
    held = {joint.child for joint in model.joints.values()}
    roots = [name for name in model.links if name not in held]
    if len(roots) > 1:
        raise InputError(Fault("links", "several hang on no joint; choose one as root", roots, file=model.file))
    return roots[0]


def _paths(base: str, children: Children) -> Children:
    """The joints from the base to every link that can be reached, in the order of the file."""
    paths: Children = {base: []}
    waiting = [base]
    while waiting:
        link = waiting.pop(0)
        for joint in children[link]:
            if joint.child not in paths:
                paths[joint.child] = [*paths[link], joint]
                waiting.append(joint.child)
    return paths


def _tip(model: UrdfModel, paths: Children, children: Children, base: str, tip: str | None) -> str:
    """The end-effector link: the one asked for, or the end of the one chain that holds all others."""
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


def _collect(model: UrdfModel, base: str, tip: str, path: list[UrdfJoint], children: Children) -> Chain:
    """Every body of the tree, in the base frame, with the moving link that carries it."""
    order = {joint.name: i for i, joint in enumerate(path)}
    bodies: tuple[list[RigidBody], ...] = tuple([] for _ in path)
    riders: tuple[list[str], ...] = tuple([] for _ in path)
    frames: list[Array] = [np.eye(4)] * len(path)
    locked: list[str] = []
    tip_pose = np.eye(4)
    waiting = [(base, np.eye(4), -1)]
    while waiting:
        link, frame, carrier = waiting.pop(0)
        body = model.links[link].body
        if carrier >= 0 and body is not None:
            bodies[carrier].append(body.seen_from(frame))
            riders[carrier].append(link)
        if link == tip:
            tip_pose = frame
        for joint in children[link]:
            child_frame, child_carrier = frame @ joint.origin, order.get(joint.name, carrier)
            if joint.name in order:
                frames[order[joint.name]] = child_frame
            elif joint.movable:
                locked.append(joint.name)
            waiting.append((joint.child, child_frame, child_carrier))
    return Chain(tip, tuple(path), tuple(frames), bodies, riders, tip_pose, tuple(locked))
