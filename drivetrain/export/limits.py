"""Drives for controllers and physics engines: URDF with drives, ROS 2 joint limits, PhysX performance envelopes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from drivetrain.export.drives import DriveData, exported, joint_limits
from drivetrain.export.losses import lost
from drivetrain.export.urdf import UrdfJointData, text, write_urdf
from drivetrain.sizing.results import Evaluation
from drivetrain.version import __version__
from drivetrain.whole_files import write_files


def write_drive_urdf(evaluation: Evaluation, path: str | Path, *, payload: str | None = None) -> tuple[str, ...]:
    """Write an arm with its drives as URDF: ``write_urdf`` with efforts, friction, transmissions and Drake's tags.

    Args:
        evaluation: Evaluation of a set of drives.
        path: The file.
        payload: Name of the payload at the tip; None: none.

    Returns:
        What is lost in the format, one sentence each.

    Raises:
        InputError: As for ``write_urdf``; a study without an arm, an unknown payload.
    """
    arm, drives = exported(evaluation, "urdf", payload)
    coupled = arm.coupling is not None and not np.array_equal(arm.coupling, np.eye(arm.n))
    speeds, efforts = joint_limits(arm, drives)
    known = efforts if np.isfinite(efforts).all() else None
    data = UrdfJointData(known, [one.viscous for one in drives], [one.coulomb for one in drives])
    data = UrdfJointData(known) if coupled else data  # friction of coupled shafts cannot be assigned to single joints
    return (*write_urdf(replace(arm, speed_limits=speeds), path, data=data), *lost("urdf"))


def write_ros2(evaluation: Evaluation, path: str | Path) -> tuple[str, ...]:
    """Write ``joint_limits.yaml`` for MoveIt and ros2_control, and a file with the ``ros2_control`` tag beside it.

    Args:
        evaluation: Evaluation of a set of drives.
        path: The YAML file; the tag is written to ``<name>.ros2_control.xacro``.

    Returns:
        What the format loses.

    Raises:
        InputError: A study without an arm, or a file that cannot be written.

    Reference: joint_limits, https://github.com/ros-controls/ros2_control, package joint_limits.
    """
    arm, drives = exported(evaluation, "ros2")
    lines = [f"# by drivetrain {__version__}", *(f"# {line}" for line in lost("ros2")), "joint_limits:"]
    robot = ElementTree.Element("robot", {"xmlns:xacro": "http://www.ros.org/wiki/xacro"})
    control = ElementTree.SubElement(robot, "ros2_control", name=arm.name, type="system")
    hardware = ElementTree.SubElement(control, "hardware")
    ElementTree.SubElement(hardware, "plugin").text = "mock_components/GenericSystem"
    for i, (drive, speed, effort) in enumerate(zip(drives, *joint_limits(arm, drives), strict=True)):
        swing = np.isfinite([arm.lower[i], arm.upper[i]]).all() and arm.lower[i] < arm.upper[i]
        fastest = float(np.abs(evaluation.study.cycle.acceleration[:, i]).max())
        limits: list[tuple[str, bool, dict[str, float]]] = [
            ("position", bool(swing), {"min_position": arm.lower[i], "max_position": arm.upper[i]}),
            ("velocity", math.isfinite(speed), {"max_velocity": speed}),
            ("acceleration", fastest > 0.0, {"max_acceleration": fastest}),
            ("jerk", False, {}),
            ("effort", math.isfinite(effort), {"max_effort": effort}),
        ]
        lines.append(f"  {json.dumps(drive.joint)}:")
        joint = ElementTree.SubElement(control, "joint", name=drive.joint)
        command = ElementTree.SubElement(joint, "command_interface", name="effort")
        for name, known, numbers in limits:
            lines.append(f"    has_{name}_limits: {'true' if known else 'false'}")
            lines += [f"    {key}: {float(value)!r}" for key, value in numbers.items() if known]
        if math.isfinite(effort):
            for name, sign in (("min", -1.0), ("max", 1.0)):
                ElementTree.SubElement(command, "param", name=name).text = text(sign * effort)
        for name in ("position", "velocity", "effort"):
            ElementTree.SubElement(joint, "state_interface", name=name)
    ElementTree.indent(robot)
    place, tags = Path(path), ElementTree.tostring(robot, encoding="unicode") + "\n"
    write_files(place.parent, {place.name: "\n".join(lines) + "\n", f"{place.stem}.ros2_control.xacro": tags})
    return lost("ros2")


def write_physx(evaluation: Evaluation, path: str | Path) -> tuple[str, ...]:
    """Write the performance envelope of each drive for PhysX and Isaac Sim as JSON.

    ``|effort| <= max_effort - velocity_dependent_resistance |v|`` and
    ``|v| <= max_actuator_velocity - speed_effort_gradient |effort|``; the second follows from the voltage limit, with
    the constants V/(k G) and R/(k G)^2. ``tau_max`` and ``k`` are the same line solved for the effort.

    Args:
        evaluation: Evaluation of a set of drives.
        path: The file.

    Returns:
        What is lost in the format, one sentence each, which the file contains too.

    Raises:
        InputError: A study without an arm, or the file cannot be written.

    Reference: PhysX 5.6, PxPerformanceEnvelope of articulation drives.
    """
    _, drives = exported(evaluation, "physx")
    content = {
        "written_by": f"drivetrain {__version__}",
        "units": "N m, rad/s, kg m^2; N, m/s, kg at joints that slide",
        "lost": list(lost("physx")),
        "joints": {drive.joint: _envelope(drive) for drive in drives},
    }
    place = Path(path)
    write_files(place.parent, {place.name: json.dumps(content, indent=2) + "\n"})
    return lost("physx")


def _envelope(drive: DriveData) -> dict[str, Any]:
    """Values of one drive, None if unknown."""
    size, ohms = drive.constant * abs(drive.ratio), drive.resistance
    numbers = {
        "max_effort": drive.effort,
        "max_actuator_velocity": drive.volts / size,
        "speed_effort_gradient": ohms / size**2,
        "velocity_dependent_resistance": 0.0,
        "velocity_limit": drive.speed,
        "tau_max": size * drive.volts / ohms,
        "k": size**2 / ohms,
        "continuous_effort": drive.continuous,
        "armature": drive.rotor_inertia * drive.ratio**2,
        "friction_effort": drive.coulomb,
        "viscous_friction": drive.viscous,
    }
    return {name: value if math.isfinite(value) else None for name, value in numbers.items()}
