"""Modern Robotics 8.8, exercise 8.12: a URDF's numbers become Mlist, Glist and Slist, and an arm becomes a URDF."""

from __future__ import annotations

import sys
import tempfile
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from figures.links import figure_links

from drivetrain.arm.builtin import ROBOTS
from drivetrain.arm.files.load import load_arm
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.export.urdf import write_urdf
from drivetrain.spatial.inertia import RigidBody
from drivetrain.spatial.poses import inverse_pose, pose_from_xyz_rpy


def origin(element: ElementTree.Element) -> np.ndarray:
    return pose_from_xyz_rpy(*(element.find("origin").get(key).split() for key in ("xyz", "rpy")))


def chapter_lists(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mlist, Glist, Slist of a file that is one chain of revolute joints, the massless frames at its end left out."""
    root = ElementTree.parse(path).getroot()
    links = {link.get("name"): link for link in root.findall("link")}
    frame, centres, tensors, screws = np.eye(4), [np.eye(4)], [], []
    for joint in (joint for joint in root.findall("joint") if joint.get("type") != "fixed"):
        frame = frame @ origin(joint)  # of the joint in the space frame, at the zero position
        axis = frame[:3, :3] @ np.array(joint.find("axis").get("xyz").split(), dtype=float)
        screws.append([*axis, *np.cross(frame[:3, 3], axis)])  # (w, -w x q)
        inertial = links[joint.find("child").get("link")].find("inertial")
        tensor = [[inertial.find("inertia").get("i" + "".join(sorted(a + b))) for b in "xyz"] for a in "xyz"]
        tensors.append(RigidBody(inertial.find("mass").get("value"), np.zeros(3), tensor).spatial_inertia())
        centres.append(frame @ origin(inertial))
    steps = [inverse_pose(before) @ here for before, here in pairwise(centres)]
    return np.array(steps), np.array(tensors), np.array(screws)


def main(picture: Path) -> None:
    steps, tensors, screws = chapter_lists(ROBOTS / "ur5.urdf")
    for i, (step, tensor, screw) in enumerate(zip(steps, tensors, screws, strict=True), 1):
        print(f"S{i} = {np.round(screw, 5) + 0.0} [-, m]  M{i - 1}{i} shift {np.round(step[:3, 3], 5) + 0.0} m")
        print(f"     G{i} = diag{tuple(np.round(np.diag(tensor), 6).tolist())} [kg m^2, kg]")
    arm = load_arm("ur5")
    with tempfile.TemporaryDirectory() as folder:
        notes = write_urdf(arm, Path(folder) / "ur5.urdf")
        again = chapter_lists(Path(folder) / "ur5.urdf")
    off = max(np.abs(a - b).max() for a, b in zip(again, (steps, tensors, screws), strict=True))
    print(f"written and read again: off by {off:.0e}; what the file could not hold: {notes or 'nothing'}")
    print(f"torque to start at 1 rad/s^2: {np.round(inverse_dynamics(arm, *np.zeros((2, 6)), np.ones(6)), 4)} N m")
    arms = {"UR5 as published": arm, "wrists of 0.06 m radius": load_arm("ur5-corrected")}
    figure_links(arms, [0.0, -1.1, 1.4, -0.7, 0.4, 0.0]).savefig(picture, dpi=150, facecolor="white")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
