"""Loads an arm by the name of a built-in one, or from a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import builtin_arm, builtin_names
from drivetrain.arm.checks import warn_each
from drivetrain.arm.coupling import placed, with_coupling
from drivetrain.arm.files.drives import UrdfCoupling, UrdfDrive
from drivetrain.arm.files.links import arm_from_model, tip_among_several
from drivetrain.arm.files.mjcf import read_mjcf
from drivetrain.arm.files.model import UrdfModel, read_model
from drivetrain.arm.files.sdf import read_sdf
from drivetrain.arm.files.xml import PACKAGE, PACKAGE_ROOTS, package_file, read_document
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.whole_files import is_there

SUFFIXES = (".urdf", ".xacro", ".xml", ".sdf", ".mjcf")
STUDY_OF_TABLE = "it stands in a study as arm: {dh: FILE, convention: classic} (or modified)"
OTHERS = dict.fromkeys((".csv", ".xlsx", ".xlsm"), ("a table", f"a DH table? {STUDY_OF_TABLE}")) | dict.fromkeys(
    (".yaml", ".yml"), ("perhaps a study", "dt.load_study reads a study; its arm is load_study(FILE).arm")
)


def load_arm(source: str | Path, *, tip: str | None = None, gravity: Any = None) -> Arm:
    """Load a built-in arm or an arm from a file.

    If a URDF file gives gear ratio and rotor inertia of a joint, the arm has a rotor on the joint's axis, carried by
    the link before the joint, with inertia about its axis only. Differential and four-bar transmissions couple the
    motors of two joints.

    Args:
        source: Name of a built-in arm, or path of a URDF (``.urdf``, ``.xacro``), SDF (``.sdf``) or MJCF (``.xml``)
            file; ``package://NAME/...`` is searched in the folders of ROS (ROS_PACKAGE_PATH, AMENT_PREFIX_PATH).
        tip: Name of the link that is the end effector, or of a site in an MJCF or a frame in an SDF file. None:
            the end of the chain, if there is only one.
        gravity: Acceleration of free fall in the base frame [m/s^2], (3,). None: that of an MJCF or SDF file, else 9.81
            along -z (planar-2r: -y).

    Returns:
        The arm; its notes state what was ignored, assumed or is implausible (the last also gives warnings for a file).

    Raises:
        InputError: No such arm or file, or all faults of the file.
    """
    if str(source) in builtin_names():
        return builtin_arm(str(source), tip=tip, gravity=gravity)
    if not isinstance(source, (str, Path)):
        problem = "must be the name of a built-in arm or the path of a robot file"
        raise InputError(Fault("arm", problem, source))
    path = packaged_file(source) if isinstance(source, str) and source.startswith(PACKAGE) else Path(source)
    if path.suffix.lower() not in SUFFIXES and not is_there(path):
        problem = "neither a built-in arm nor a .urdf, .xacro, .xml (MJCF) or .sdf file"
        raise InputError(Fault("arm", problem, str(source), nearest(str(source), builtin_names())))
    told = OTHERS.get(path.suffix.lower())
    if told is not None:
        raise InputError(Fault(str(path), f"is no robot file (URDF, xacro, MJCF or SDF) but {told[0]}", hint=told[1]))
    model, stated = _model_of(path, tip)
    arm, doubtful = arm_from_model(model, tip=tip, gravity=stated if gravity is None else gravity)
    warn_each(doubtful)
    whole = _with_stated_couplings(_with_stated_rotors(arm, model.drives), model.couplings)
    return replace(whole, file=str(path))


def usual_tip(source: str) -> str | None:
    """The likely end effector of a file with several chains; None for any other file or source."""
    path = packaged_file(source) if source.startswith(PACKAGE) else Path(source)
    return tip_among_several(_model_of(path)[0]) if path.is_file() else None


def _model_of(path: Path, tip: str | None = None) -> tuple[UrdfModel, Any]:
    """The model of a file of any format, and the gravity that it states or None."""
    tag = read_document(path).tag if path.suffix.lower() in (".xml", ".sdf", ".mjcf") else "robot"
    if tag == "mujoco":
        return read_mjcf(path, tip)
    return read_sdf(path, tip) if tag == "sdf" else (read_model(path), None)


def packaged_file(address: str) -> Path:
    """The file of a ROS package; raises InputError if there is none."""
    found = package_file(address)
    if found is None:
        name = address.removeprefix(PACKAGE).partition("/")[0]
        raise InputError(Fault("arm", f"no package {name} with that file", address, PACKAGE_ROOTS))
    return found


def _with_stated_rotors(arm: Arm, drives: Mapping[str, UrdfDrive]) -> Arm:
    """The arm with the rotors that its file states, listed in its notes."""
    rotors: list[Rotor | None] = []
    half_stated = []
    for name in arm.joint_names:
        drive = drives[name]
        if drive.rotor_inertia and drive.ratio is None:
            half_stated.append(name)
        stated = drive.rotor_inertia is not None and drive.ratio is not None
        rotors.append(Rotor(drive.ratio, drive.rotor_inertia) if stated else None)  # type: ignore[arg-type]
    notes = []
    if half_stated:
        notes.append("rotor inertia without gear ratio, not used: " + ", ".join(half_stated))
    driven = [name for name, rotor in zip(arm.joint_names, rotors, strict=True) if rotor is not None]
    if driven:
        notes.append("rotors from the file, on the joint axes, carried by the link before: " + ", ".join(driven))
    rubbing = [text for name in arm.joint_names if (text := _friction(arm, name, drives[name]))]
    if rubbing:
        notes.append(f"friction in the file, not used (a study states `friction` of a joint): {', '.join(rubbing)}")
    return replace(with_rotors(arm, rotors), notes=(*arm.notes, *notes))


def _friction(arm: Arm, name: str, drive: UrdfDrive) -> str:
    """A joint's friction in words; empty if the file states none."""
    force, speed = ("N", "m/s") if arm.slides[arm.joint_names.index(name)] else ("N m", "rad/s")
    coulomb = f"{drive.friction:g} {force}" if drive.friction else ""
    viscous = f"{drive.damping:g} {force} per {speed}" if drive.damping else ""
    return f"{name} {' and '.join(filter(None, (coulomb, viscous)))}" if coulomb or viscous else ""


def _with_stated_couplings(arm: Arm, couplings: Sequence[UrdfCoupling]) -> Arm:
    """The arm with the couplings that its file states, listed in its notes."""
    matrix, notes, taken = np.eye(arm.n), [], set[str]()
    for one in couplings:
        pair = " and ".join(one.joints)
        if taken & {*one.joints} or not {*one.joints} <= {*arm.joint_names}:
            notes.append(f"transmission of {pair} not used: a joint is off the chain or in another one")
            continue
        taken |= {*one.joints}
        matrix = matrix @ placed(one.matrix, [arm.joint_names.index(name) for name in one.joints], arm.n)
        notes.append(f"motors of {pair} coupled, as the file states")
    return replace(with_coupling(arm, matrix), notes=(*arm.notes, *notes))
