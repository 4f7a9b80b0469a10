"""An arm with mounted rotors, and the level at which the dynamics includes their motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import checked_coupling
from drivetrain.arm.rotors import MountedRotor, Rotor, RotorLevel
from drivetrain.arrays import Array
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.spatial.poses import axis_point, axis_screw, pose
from drivetrain.spatial.rotations import frame_along


def with_rotors(
    arm: Arm, rotors: Sequence[Rotor | None], *, level: RotorLevel = RotorLevel.FULL, coupling: Any = None
) -> Arm:
    """The arm with these rotors, in place of any it had.

    Defaults of a rotor are resolved here, see the docstring of ``Rotor``; the arm then has ``MountedRotor`` objects
    with definite home, screw, carrier and tensor. A scalar inertia J becomes ``J u u^T`` with u the spin axis in the
    rotor frame: J about the spin axis and zero across it.

    Args:
        arm: The arm that carries them.
        rotors: One rotor per joint, None for a direct drive, (n,).
        level: Which parts of the rotors' motion the dynamics includes.
        coupling: Turns of shaft i, which motor i drives through its gear, per turn of joint j [-], (n, n): rotor i then
            spins relative to its carrier at ``ratio_i`` times row i of it times the joint speeds. None: the coupling of
            the arm; without one, rotor i spins at ``ratio_i`` times the speed of joint i.

    Returns:
        The arm with rotors; lengths [m], masses [kg] and inertias [kg m^2] of the links do not change.

    Raises:
        InputError: Not n rotors, a carrier that is not a link of this arm, or a coupling of wrong shape or singular.
    """
    faults = Faults()
    shafts = arm.coupling if coupling is None else faults.attempt(checked_coupling, coupling, arm.n)
    if len(rotors) != arm.n:
        faults.add("rotors", f"must be one a joint (None for a direct drive): {arm.n}", len(rotors))
        faults.raise_any()
    mounted = [faults.attempt(_mounted, arm, i, rotor) for i, rotor in enumerate(rotors)]
    faults.raise_any()
    return replace(arm, rotors=tuple(mounted), level=_checked_level(level), coupling=shafts)


def with_lighter_rotors(arm: Arm, inertia: Array) -> Arm:
    """The arm whose rotors have that much less inertia about their axes [kg m^2], (n,)."""
    lighter: list[Rotor | None] = []
    for rotor, less in zip(arm.rotors, inertia, strict=True):
        if rotor is not None and less:
            axis = rotor.home[:3, :3].T @ rotor.screw[:3]
            lighter.append(replace(rotor, inertia=rotor.inertia - less * np.outer(axis, axis)))
        else:
            lighter.append(rotor)
    return with_rotors(arm, lighter, level=arm.level)


def at_level(arm: Arm, level: RotorLevel) -> Arm:
    """The same arm with another level of its rotors' motion.

    Args:
        arm: The arm, with or without rotors.
        level: Which parts of the rotors' motion to include.

    Returns:
        The arm at that level; its rotors [kg, kg m^2] are kept, so that the level can be changed again.

    Raises:
        InputError: No such level.
    """
    return replace(arm, level=_checked_level(level))


def _checked_level(level: RotorLevel) -> RotorLevel:
    try:
        return RotorLevel(level)
    except ValueError:
        known = ", ".join(member.value for member in RotorLevel)
        raise InputError(Fault("level", f"must be one of {known}", level)) from None


def _mounted(arm: Arm, joint: int, rotor: Rotor | None) -> MountedRotor | None:
    place = f"rotors[{joint}]"
    if rotor is None:
        return None
    if not isinstance(rotor, Rotor):
        raise InputError(Fault(place, "must be a Rotor or None", rotor))
    carrier = arm.body_before(joint) if rotor.carrier is None else rotor.carrier
    bodies = arm.n if arm.linkage is None else len(arm.linkage.loops.owner)
    if carrier >= bodies:
        raise InputError(Fault(f"{place}.carrier", f"must be between -1 (base) and {bodies - 1}", carrier))
    screw = _joint_line(arm, joint) if rotor.screw is None else rotor.screw
    home = rotor.home
    if home is None:
        home = pose(frame_along(screw[:3]), axis_point(screw, arm.joint_points[joint]))
    axis = home[:3, :3].T @ screw[:3]
    inertia = rotor.inertia if np.ndim(rotor.inertia) == 2 else rotor.inertia * np.outer(axis, axis)
    return MountedRotor(rotor.ratio, np.asarray(inertia), rotor.mass, home, screw, carrier)


def _joint_line(arm: Arm, joint: int) -> Array:
    """The joint's axis as a pure rotation, (6,): a helical axis without its pitch; of a prismatic joint, the line along
    its direction through its point.
    """
    screw = arm.screws[joint]
    if not screw[:3].any():
        return axis_screw(screw[3:], arm.joint_points[joint])
    return np.concatenate([screw[:3], screw[3:] - float(screw[:3] @ screw[3:]) * screw[:3]])
