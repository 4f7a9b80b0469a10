"""Arms from URDF files, read by ourselves: meshes are never opened, and what is not used is told."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm
from drivetrain.arm.plausibility import doubts
from drivetrain.arm.urdf_drives import UrdfDrive
from drivetrain.arm.urdf_model import REVOLUTE, UrdfModel, read_model
from drivetrain.arm.urdf_tree import Chain, choose_chain
from drivetrain.arrays import Array
from drivetrain.errors import PhysicsWarning
from drivetrain.spatial.inertia import RigidBody, combined


def read_urdf(path: str | Path, *, tip: str | None = None, root: str | None = None, gravity: Any = None) -> Arm:
    """The arm that a URDF file describes, without rotors.

    Links on fixed joints, and on movable joints off the chain (held at zero), are lumped into the link that carries
    them. Each joint sits at the origin of its URDF frame. What was ignored or is hard to believe stands in the arm's
    notes; the latter is also a PhysicsWarning.

    Args:
        tip: Name of the link that is the end effector; any link, also one on a fixed joint. None: the end of the
            longest chain, when all others are part of it.
        root: Name of the link that stands still; its frame is the arm's base frame. None: the file's root.
        gravity: Acceleration of free fall in the base frame [m/s^2], (3,). None: 9.81 along -z.

    Raises:
        InputError: Everything that is wrong with the file, or with the names given, at once.
    """
    arm, doubtful = arm_from_model(read_model(Path(path)), tip=tip, root=root, gravity=gravity)
    warn_each(doubtful)
    return arm


def read_urdf_drives(path: str | Path) -> dict[str, UrdfDrive]:
    """What a URDF file says of its movable joints' friction, gears and rotors.

    Returns:
        By joint name: friction [N m, N m s/rad], ratio and rotor inertia [kg m^2], None where the file is silent.

    Raises:
        InputError: Everything that is wrong with the file, at once.
    """
    return read_model(Path(path)).drives


def warn_each(texts: list[str]) -> None:
    """Warn of each doubt, as if the caller's caller had."""
    for text in texts:
        warnings.warn(text, PhysicsWarning, stacklevel=3)


def arm_from_model(
    model: UrdfModel, *, tip: str | None = None, root: str | None = None, gravity: Any = None
) -> tuple[Arm, list[str]]:
    """The arm of a parsed file, and what is hard to believe of it; warns of nothing.

    Args:
        gravity: Acceleration of free fall in the base frame [m/s^2], (3,); None: 9.81 along -z.

    Raises:
        InputError: As of read_urdf.
    """
    chain = choose_chain(model, root, tip)
    doubtful = _doubts(model, chain)
    lumped = [_lump(frame, bodies) for frame, bodies in zip(chain.frames, chain.bodies, strict=True)]
    screws = [_screw(joint.kind, joint.axis, frame) for joint, frame in zip(chain.joints, chain.frames, strict=True)]
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
        check_inertias=False,  # done above link by link, before lumping hides the culprit
    )
    return arm, doubtful


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


def _screw(kind: str, axis: Array, frame: Array) -> Array:
    direction = frame[:3, :3] @ axis
    if kind in REVOLUTE:
        return np.concatenate([direction, np.cross(frame[:3, 3], direction)])
    return np.concatenate([np.zeros(3), direction])


def _notes(chain: Chain, wanted_tip: str | None) -> list[str]:
    """What was chosen or assumed on the way to the chain."""
    notes = [] if wanted_tip else [f"tip: {chain.tip}, as none was named"]
    if chain.locked:
        notes.append("held at zero, off the chain: " + ", ".join(chain.locked))
    notes += [f"joint {j.name}: said to mimic {j.mimics}, taken as free" for j in chain.joints if j.mimics]
    notes += [f"joint {joint.name}: {joint.unsaid}" for joint in chain.joints if joint.unsaid]
    massless = [
        joint.child
        for joint, bodies in zip(chain.joints, chain.bodies, strict=True)
        if not sum(body.mass for body in bodies)
    ]
    if massless:
        notes.append("moving links without mass: " + ", ".join(massless))
    return notes


def _doubts(model: UrdfModel, chain: Chain) -> list[str]:
    """What is hard to believe of the links that move."""
    found = []
    for name in (rider for riders in chain.riders for rider in riders):
        body = model.links[name].body
        points = [np.zeros(3), *(j.origin[:3, 3] for j in model.joints.values() if j.parent == name)]
        found += [] if body is None else doubts(name, body, points)
    return found
