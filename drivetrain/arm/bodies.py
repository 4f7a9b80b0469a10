"""Changes of an arm: bodies (drives, payloads) added to or removed from links, external axes, a moving base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import ROWS, Arm, refuse_loops
from drivetrain.arm.checks import called, checked_inertia, warn_of_inertias
from drivetrain.arm.closures import LoopLink, link_rows
from drivetrain.arrays import Array, checked_array, read_only
from drivetrain.errors import Fault, InputError
from drivetrain.motion.base import BASE_JOINTS
from drivetrain.spatial.inertia import RigidBody, combined
from drivetrain.spatial.poses import adjoint, pose_from_xyz_rpy


def with_body(arm: Arm, link: int, mass: float, com: Any, inertia: Any) -> Arm:
    """The arm with a body rigidly added to a link, or removed from it.

    The link's home frame moves to the new centre of mass and keeps its directions; rotors, tip and joints stay where
    they are.

    Args:
        arm: The arm.
        link: Index of the link; -1 is the base, where a body changes nothing.
        mass: Mass of the body [kg]; a negative mass removes the body with its inertia.
        com: Centre of mass of the body, base frame, all joints zero [m], (3,).
        inertia: Inertia of the body about its centre of mass, base axes [kg m^2], (3, 3); not negative, also when the
            body is removed.

    Returns:
        The arm with the changed link; removing a body that was added restores the link to rounding.

    Raises:
        InputError: No such link; invalid mass or inertia; or more removed than the link has.
    """
    body = RigidBody(mass, com, checked_inertia(inertia, "inertia"))
    if arm.linkage is not None and 0 <= link < len(arm.linkage.loops.owner):
        loops, chains = arm.linkage.loops, arm.linkage.chains
        at = loops.owner[link]
        chain = with_body(chains[at], loops.paths[at].index(link), mass, com, inertia)
        return replace(arm, linkage=arm.linkage.with_chain(at, chain))
    if isinstance(link, bool) or not isinstance(link, (int, np.integer)) or not -1 <= link < arm.n:
        raise InputError(Fault("link", f"must be between -1 (the base) and {arm.n - 1}", link))
    if link == -1:
        return arm
    if body.mass < 0.0:
        body = RigidBody(body.mass, body.com, -body.inertia)
    old_home = arm.home[link]
    rotation = old_home[:3, :3]
    own = RigidBody(arm.masses[link], old_home[:3, 3], rotation @ arm.inertias[link] @ rotation.T)
    whole = combined([own, body])
    tensor = rotation.T @ whole.inertia @ rotation
    if body.mass < 0.0:
        _check_remainder(arm, link, whole.mass, tensor)
    new_home = old_home.copy()
    new_home[:3, 3] = whole.com
    return replace(
        arm,
        home=_replaced(arm.home, link, new_home),
        masses=_replaced(arm.masses, link, whole.mass),
        inertias=_replaced(arm.inertias, link, 0.5 * (tensor + tensor.T)),
    )


def with_payload(arm: Arm, mass: float, com: Any, inertia: Any) -> Arm:
    """The arm with a body fixed to its tip.

    Args:
        arm: The arm.
        mass: Mass of the payload [kg]; a negative mass removes a payload.
        com: Centre of mass in the tip frame [m], (3,).
        inertia: Inertia about the centre of mass, tip axes [kg m^2], (3, 3).

    Returns:
        The arm; its last link carries the payload.

    Raises:
        InputError: As for ``with_body``.
    """
    tensor = checked_inertia(inertia, "inertia")
    body = RigidBody(mass, checked_array(com, (3,), "com"), tensor).seen_from(arm.tip)
    last = arm.n - 1 if arm.linkage is None else arm.linkage.chains[0].n - 1
    return with_body(arm, last, body.mass, body.com, 0.5 * (body.inertia + body.inertia.T))


def on_moving_base(arm: Arm) -> Arm:
    """The arm on a vehicle, a ship or a gantry with a prescribed motion: six joints without mass before its own.

    The first three slide along x, y and z of the ground, the next three turn the base about its z, y and x axis (yaw,
    pitch, roll). Their motion is the motion of the base, and their torques and forces are the loads on the base. For a
    driven track or positioner, use ``on_external_axes``.

    Args:
        arm: The arm, with or without rotors; rotors carried by its base move with the base.

    Returns:
        An arm of n + 6 joints, the arm's own the last n.

    Raises:
        InputError: An arm with closed loops.
    """
    return _carried(arm, moving_base(arm), np.eye(4))


def on_external_axes(arm: Arm, links: Sequence[LoopLink], point: Any = (0.0, 0.0, 0.0), rpy: Any = (0.0,) * 3) -> Arm:
    """The arm on a track, a lift or a turntable with drives of their own: joints before its own.

    Args:
        arm: The arm, with or without rotors.
        links: Body that each external axis moves, from the ground upwards; the last one includes the foot of the arm.
            In the ground frame, all joints at zero.
        point: Position of the arm's base on the last of them, in the ground frame [m], (3,).
        rpy: Orientation of the arm's base: roll, pitch and yaw about the fixed axes of the ground [rad], (3,).

    Returns:
        An arm whose base frame is the ground frame and whose first joints are the external axes. The numbers of gravity
        do not change; they now refer to the ground axes.

    Raises:
        InputError: An arm with closed loops, no axis, or an axis with the name of a joint or link of the arm.
    """
    taken = [link.joint for link in links if link.joint in (*arm.joint_names, *arm.link_names)]
    if taken or not links:
        problem = "must have names that the arm does not use" if taken else "must be one at least"
        raise InputError(Fault("external axes", problem, taken))
    names = [link.joint for link in links]
    axes = Arm.from_screws(**link_rows(links), gravity=arm.gravity, joint_names=names, link_names=names)
    return _carried(arm, axes, pose_from_xyz_rpy(point, rpy))


def _carried(arm: Arm, below: Arm, place: Array) -> Arm:
    """The arm with the joints of ``below`` before its own; ``place`` is its base in the base frame of ``below``."""
    refuse_loops(arm)
    k, turned, points = below.n, adjoint(place), arm.joint_points @ place[:3, :3].T + place[:3, 3]
    own = replace(arm, home=place @ arm.home, screws=arm.screws @ turned.T, joint_points=points)
    joined = {name: read_only(np.concatenate([getattr(below, name), getattr(own, name)])) for name in ROWS}
    rotors = tuple(
        None if one is None else replace(one, home=place @ one.home, screw=turned @ one.screw, carrier=one.carrier + k)
        for one in arm.rotors
    )
    frames = {name: (carrier or below.link_names[-1], place @ at) for name, (carrier, at) in arm.frames.items()}
    coupling = None
    if arm.coupling is not None:
        coupling = np.eye(k + arm.n)
        coupling[k:, k:] = arm.coupling
    return replace(
        arm, **joined, joint_names=(*below.joint_names, *arm.joint_names), tip=read_only(place @ arm.tip),
        link_names=(*below.link_names, *arm.link_names), rotors=(*below.rotors, *rotors), coupling=coupling,
        frames=frames,
    )  # fmt: skip


def moving_base(arm: Arm) -> Arm:
    """The moving base as six joints without mass, whose tip carries the arm."""
    screws = np.zeros((6, 6))
    screws[:3, 3:], screws[3:, :3] = np.eye(3), np.eye(3)[::-1]
    return Arm.from_screws(
        np.tile(np.eye(4), (6, 1, 1)), screws, np.zeros(6), np.zeros((6, 3, 3)), gravity=arm.gravity,
        joint_points=np.zeros((6, 3)), joint_names=BASE_JOINTS, link_names=BASE_JOINTS, name="base",
    )  # fmt: skip


def _check_remainder(arm: Arm, link: int, mass: float, tensor: Array) -> None:
    """Raise InputError if a link would have no mass left or a negative moment of inertia."""
    name = arm.link_names[link]
    if mass <= 0.0:
        problem = f"must leave the link some mass; it has {arm.masses[link]:.6g} kg"
        raise InputError(Fault(called(name), problem, f"{mass:.6g} kg left"))
    if (np.diag(tensor) < 0.0).any():
        problem = "must leave the link no negative moment of inertia [kg m^2]"
        raise InputError(Fault(called(name), problem, np.diag(tensor).tolist()))
    warn_of_inertias(tensor[np.newaxis], [name])


def _replaced(values: Array, index: int, value: Any) -> Array:
    copy = values.copy()
    copy[index] = value
    return np.asarray(read_only(copy))
