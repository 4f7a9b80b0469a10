"""MuJoCo's format: the arm with its drives, motors driven by voltage."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.errors import Fault, InputError
from drivetrain.export.drives import DriveData, coupling_rows, exported, joint_axes, locked_bodies
from drivetrain.export.files import write_text
from drivetrain.export.losses import lost
from drivetrain.export.urdf_elements import text
from drivetrain.sizing.results import Evaluation
from drivetrain.version import __version__

MOTORS = ("dcmotor", "general")


def write_mjcf(
    evaluation: Evaluation, path: str | Path, *, payload: str | None = None, motors: str = "dcmotor"
) -> tuple[str, ...]:
    """Write an arm with its drives as MJCF: one actuator a motor, whose control is the voltage at its terminals.

    Args:
        evaluation: Of a set of drives.
        path: Of the file.
        payload: That the tip carries, by its name in the study; None: nothing.
        motors: ``dcmotor`` (MuJoCo 3.7 and later: current limit, inductance, winding temperature as a state) or
            ``general`` (any version: the same motor without these).

    Returns:
        What the format loses; the same sentences stand in a comment of the file.

    Raises:
        InputError: A study without an arm, helical joints, an unknown payload, or the file cannot be written.

    Reference: MuJoCo, XML reference, actuator/dcmotor; armature is the inertia behind the gear.
    """
    if motors not in MOTORS:
        raise InputError(Fault("motors", f"must be {' or '.join(MOTORS)}", motors))
    arm, drives = exported(evaluation, payload)
    notes = lost("mjcf")
    write_text(path, mjcf_text(arm, drives, notes=notes, motors=motors))
    return notes


def mjcf_text(arm: Arm, drives: Sequence[DriveData], *, notes: Sequence[str] = (), motors: str = "dcmotor") -> str:
    """The MJCF of an arm and its drives."""
    axes = joint_axes(arm, "MJCF")
    root = ElementTree.Element("mujoco", model=arm.name)
    for line in (f"written by drivetrain {__version__}", *notes):
        root.append(ElementTree.Comment(f" {line.replace('--', '- -')} "))
    exact = {"balanceinertia": "false", "boundmass": "0", "boundinertia": "0"}
    ElementTree.SubElement(root, "compiler", {"angle": "radian", "autolimits": "false", **exact})
    ElementTree.SubElement(root, "option", gravity=text(arm.gravity), integrator="implicitfast")
    body, before = ElementTree.SubElement(root, "worldbody"), np.zeros(3)
    rows = coupling_rows(arm)
    for i, (locked, (kind, axis)) in enumerate(zip(locked_bodies(arm), axes, strict=True)):
        point, own = arm.joint_points[i], locked.inertia
        body = ElementTree.SubElement(body, "body", name=arm.link_names[i], pos=text(point - before))
        joint = {"name": arm.joint_names[i], "type": "hinge" if kind == "revolute" else "slide", "axis": text(axis)}
        if rows[i] is None:
            joint |= {"damping": text(drives[i].viscous), "frictionloss": text(drives[i].coulomb)}
        if np.isfinite([arm.lower[i], arm.upper[i]]).all() and arm.lower[i] < arm.upper[i]:
            joint |= {"limited": "true", "range": text([arm.lower[i], arm.upper[i]])}
        ElementTree.SubElement(body, "joint", joint)
        tensor = text([*np.diag(own), own[0, 1], own[0, 2], own[1, 2]])
        place = text(locked.com - point)
        ElementTree.SubElement(body, "inertial", pos=place, mass=text(locked.mass), fullinertia=tensor)
        before = point
    ElementTree.SubElement(body, "site", name="tip", pos=text(arm.tip[:3, 3] - before))
    coupled = [(drive, row) for drive, row in zip(drives, rows, strict=True) if row is not None]
    tendons = ElementTree.SubElement(root, "tendon") if coupled else None
    for drive, row in coupled:
        assert tendons is not None
        friction = {"damping": text(drive.viscous), "frictionloss": text(drive.coulomb)}
        shaft = ElementTree.SubElement(tendons, "fixed", {"name": f"{drive.joint}_shaft", **friction})
        for name, turns in zip(arm.joint_names, row, strict=True):
            if turns != 0.0:
                ElementTree.SubElement(shaft, "joint", joint=name, coef=text(turns))
    actuators = ElementTree.SubElement(root, "actuator")
    for drive, turned in zip(drives, rows, strict=True):
        where = {"joint": drive.joint} if turned is None else {"tendon": f"{drive.joint}_shaft"}
        _motor(actuators, drive, where, motors)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _motor(actuators: ElementTree.Element, drive: DriveData, where: dict[str, str], motors: str) -> None:
    """One motor, its control the voltage [V]."""
    common = {
        "name": f"{drive.joint}_motor", **where, "gear": text(drive.ratio), "armature": text(drive.rotor_inertia),
        "ctrllimited": "true", "ctrlrange": text([-drive.volts, drive.volts]),
    }  # fmt: skip
    if motors == "general":
        gain = drive.constant / drive.resistance
        affine = {"gaintype": "fixed", "gainprm": text(gain), "biastype": "affine"}
        bias = text([0.0, 0.0, -gain * drive.constant])
        peak = drive.constant * drive.current
        force = {} if math.isinf(peak) else {"forcelimited": "true", "forcerange": text([-peak, peak])}
        ElementTree.SubElement(actuators, "general", {**common, **affine, "biasprm": bias, **force})
        return
    ohms = drive.resistance if drive.thermal is None else drive.cold_resistance  # MuJoCo warms it itself
    own = {"motorconst": text(drive.constant), "resistance": text(ohms)}
    if drive.inductance:
        own["inductance"] = text(drive.inductance)
    if not math.isinf(drive.current):
        own["saturation"] = text([0.0, drive.current, 0.0])
    if drive.thermal is not None:
        resistance, capacity, coefficient, reference, housing = drive.thermal
        own["thermal"] = text([resistance, capacity, 0.0, coefficient, reference, housing])
    ElementTree.SubElement(actuators, "dcmotor", {**common, **own})
