"""MuJoCo's format MJCF: the arm with its drives; the controls are motor voltages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.errors import Fault, InputError
from drivetrain.export.drives import Body, DriveData, arm_bodies, coupling_rows, exported, in_frame, pins
from drivetrain.export.losses import lost
from drivetrain.export.urdf import cleaned, comments, text
from drivetrain.sizing.results import Evaluation
from drivetrain.spatial.poses import inverse_pose
from drivetrain.spatial.rotations import frame_along
from drivetrain.version import __version__
from drivetrain.whole_files import write_text

MOTORS = ("dcmotor", "general")


def write_mjcf(
    evaluation: Evaluation, path: str | Path, *, payload: str | None = None, motors: str = "dcmotor"
) -> tuple[str, ...]:
    """Write an arm with its drives as MJCF, with one actuator per motor, controlled by its terminal voltage.

    Args:
        evaluation: Evaluation of a set of drives.
        path: The file.
        payload: Name of the payload at the tip; None: none.
        motors: ``dcmotor`` (MuJoCo 3.7 and later: current limit, inductance, winding temperature as a state) or
            ``general`` (all versions; the same motor without these).

    Returns:
        What is lost in the format, one sentence each; a comment in the file contains them too.

    Raises:
        InputError: A study without an arm, helical joints, an unknown payload, or a file that cannot be written.

    Reference: MuJoCo, XML reference, actuator/dcmotor; ``armature`` is the rotor inertia reflected to the joint.
    """
    if motors not in MOTORS:
        raise InputError(Fault("motors", f"must be {' or '.join(MOTORS)}", motors))
    arm, drives = exported(evaluation, "mjcf", payload)
    notes, springs = lost("mjcf"), [task.counterbalances for task in evaluation.study.joints]
    bodies = arm_bodies(arm, "MJCF")
    root = ElementTree.Element("mujoco", model=arm.name)
    root.extend(comments([f"written by drivetrain {__version__}", *notes]))
    exact = {"balanceinertia": "false", "boundmass": "0", "boundinertia": "0"}
    ElementTree.SubElement(root, "compiler", {"angle": "radian", "autolimits": "false", **exact})
    ElementTree.SubElement(root, "option", gravity=text(arm.gravity), integrator="implicitfast")
    world, rows = ElementTree.SubElement(root, "worldbody"), coupling_rows(arm)
    places, frames = {-1: world}, {-1: np.eye(4)}
    for i, one in enumerate(bodies):
        stands, locked = inverse_pose(frames[one.before]) @ one.frame, one.locked
        body = ElementTree.SubElement(places[one.before], "body", {"name": one.link, **_place(stands)})
        joint = {"name": one.joint, "type": "slide" if one.slides else "hinge", "axis": text(cleaned(one.axis))}
        own = [drives[row] for row in one.drives if rows[row] is None]
        if own:
            joint["damping"] = text(sum(drive.viscous for drive in own))
            joint["frictionloss"] = text(sum(drive.coulomb for drive in own))
        if np.isfinite([one.lower, one.upper]).all() and one.lower < one.upper:
            joint |= {"limited": "true", "range": text([one.lower, one.upper])}
        ElementTree.SubElement(body, "joint", joint)
        tensor = text([*np.diag(locked.inertia), *locked.inertia[[0, 0, 1], [1, 2, 2]]])
        place = text(locked.com)
        ElementTree.SubElement(body, "inertial", pos=place, mass=text(locked.mass), fullinertia=tensor)
        places[i], frames[i] = body, one.frame
    last = (arm if arm.linkage is None else arm.linkage.chains[0]).n - 1
    ElementTree.SubElement(places[last], "site", {"name": "tip", **_place(inverse_pose(frames[last]) @ arm.tip)})
    _pins(root, arm, bodies)
    coupled = [(drive, row) for drive, row in zip(drives, rows, strict=True) if row is not None]
    tendons = ElementTree.Element("tendon")
    for drive, row in coupled:
        friction = {"damping": text(drive.viscous), "frictionloss": text(drive.coulomb)}
        shaft = ElementTree.SubElement(tendons, "fixed", {"name": f"{drive.joint}_shaft", **friction})
        for name, turns in zip(arm.joint_names, row, strict=True):
            if turns != 0.0:
                ElementTree.SubElement(shaft, "joint", joint=name, coef=text(turns))
    for i, one in enumerate(bodies):
        stretched = [balance for row in one.drives for balance in springs[row] if balance.stiffness]
        for k, balance in enumerate(stretched):
            _spring(tendons, (places[one.before], places[i]), one, frames[one.before], balance, f"spring_{k + 1}")
    if len(tendons):
        root.append(tendons)
    actuators = ElementTree.SubElement(root, "actuator")
    for k, (drive, turned) in enumerate(zip(drives, rows, strict=True)):
        joint_name = next(one.joint for one in bodies if k in one.drives)
        where = {"joint": joint_name} if turned is None else {"tendon": f"{drive.joint}_shaft"}
        _motor(actuators, drive, where, motors)
    ElementTree.indent(root)
    write_text(path, ElementTree.tostring(root, encoding="unicode") + "\n")
    return notes


def _place(stands: Array) -> dict[str, str]:
    """Position and orientation attributes of a frame's pose, (4, 4)."""
    turned = {} if (stands[:3, :3] == np.eye(3)).all() else {"xyaxes": text(cleaned(stands[:3, :2].T))}
    return {"pos": text(cleaned(stands[:3, 3])), **turned}


def _pins(root: ElementTree.Element, arm: Arm, bodies: Sequence[Body]) -> None:
    """Add the constraints that close the loops, as stiff as MuJoCo's constraints can be with this time step."""
    held = ElementTree.SubElement(root, "equality") if pins(arm) else root
    for one, other, point in pins(arm):
        where = {"body1": bodies[one].link, "anchor": text(in_frame(bodies[one].frame, point))}
        if other >= 0:
            where["body2"] = bodies[other].link
        ElementTree.SubElement(held, "connect", {**where, "solref": "0.005 1", "solimp": "0.9999 0.9999 0.001"})


def _spring(
    tendons: ElementTree.Element, ends: tuple[ElementTree.Element, ElementTree.Element], body: Body, before: Array,
    balance: Counterbalance, name: str,
) -> None:  # fmt: skip
    """Add a counterbalance as a spring tendon between two levers, which are in line at its dead centre."""
    axis, point = body.frame[:3, :3] @ body.axis, body.frame[:3, 3]
    link = frame_along(axis)[:, 0]
    turned = np.cos(balance.dead_centre) * link + np.sin(balance.dead_centre) * np.cross(axis, link)
    free = {"stiffness": text(balance.stiffness), "springlength": text(balance.free_length)}
    spring = ElementTree.SubElement(tendons, "spatial", {"name": f"{body.joint}_{name}", **free})
    for which, end, at in zip(
        ("carrier", "link"), ends,
        (in_frame(before, point + balance.lever_carrier * turned),
         in_frame(body.frame, point + balance.lever_link * link)), strict=True,
    ):  # fmt: skip
        site = f"{body.joint}_{name}_{which}"
        ElementTree.SubElement(end, "site", name=site, pos=text(at))
        ElementTree.SubElement(spring, "site", site=site)


def _motor(actuators: ElementTree.Element, drive: DriveData, where: dict[str, str], motors: str) -> None:
    """Add the actuator of one motor, controlled by its voltage [V]."""
    common = {
        "name": f"{drive.joint}_motor", **where, "gear": text(drive.ratio), "armature": text(drive.rotor_inertia),
        "ctrllimited": "true", "ctrlrange": text([-drive.volts, drive.volts]),
    }  # fmt: skip
    if motors == "general":
        gain = drive.constant / drive.resistance
        affine = {"gaintype": "fixed", "gainprm": text(gain), "biastype": "affine"}
        bias = text([0.0, 0.0, -gain * drive.constant])
        peak = min(drive.constant * drive.current, drive.torque)
        force = {} if math.isinf(peak) else {"forcelimited": "true", "forcerange": text([-peak, peak])}
        ElementTree.SubElement(actuators, "general", {**common, **affine, "biasprm": bias, **force})
        return
    # With a thermal model MuJoCo computes the warm resistance itself.
    ohms = drive.resistance if drive.thermal is None else drive.cold_resistance
    own = {"motorconst": text(drive.constant), "resistance": text(ohms)}
    if drive.inductance:
        own["inductance"] = text(drive.inductance)
    if drive.torque < drive.constant * drive.current:  # MuJoCo applies only one of the two limits
        own["saturation"] = text([drive.torque, 0.0, 0.0])
    elif not math.isinf(drive.current):
        own["saturation"] = text([0.0, drive.current, 0.0])
    if drive.thermal is not None:
        resistance, capacity, coefficient, reference, housing = drive.thermal
        own["thermal"] = text([resistance, capacity, 0.0, coefficient, reference, housing])
    ElementTree.SubElement(actuators, "dcmotor", {**common, **own})
