"""Wrenches of the drives on the joints of an arm without loops, computed when they are needed.

Stored per unit of each load parameter, as torques are, they would take two thirds of the memory of a load basis. The
recursion of the inverse dynamics is linear in the bodies of the links, so it is run for an arm whose links have no mass
besides that of the drives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import on_moving_base
from drivetrain.arm.geared import with_rotors
from drivetrain.arrays import Array
from drivetrain.dynamics.core.blocks import BLOCK, JOINT
from drivetrain.dynamics.core.packed import carried_moments, inverse_poses, link_frames, packed, write_bodies
from drivetrain.dynamics.core.records import LINK, MOMENTS, ROTOR
from drivetrain.dynamics.core.recursion import LINKS, back, carried, couple, outwards, read, take_wrench
from drivetrain.jit import kernel
from drivetrain.motion.base import BASE_JOINTS
from drivetrain.records import as_numbers
from drivetrain.sizing.demand.load_basis import PARAMETERS, joint_motion, mounted_drives
from drivetrain.spatial.rotations import frame_along
from drivetrain.study.model import Study

# Inertia of a drive per unit of its load parameters mass, inertia across and along the axis (z), rotor inertia.
_INERTIAS = np.array([np.zeros((3, 3)), np.diag([1.0, 1.0, 0.0]), np.diag([0.0, 0.0, 1.0]), np.diag([0.0, 0.0, 1.0])])


@dataclass(frozen=True, eq=False)
class DriveWrenches:
    """Drives of n joints on links without mass, as records for the recursion."""

    study: Study  # the task, whose motion has N samples
    links: Array  # links, then rotors, without drives: records LINK as plain numbers, (numbers,)
    per_unit: Array  # change of these per unit of each load parameter of each drive, (n, PARAMETERS, numbers)
    rotors: Any  # records ROTOR
    gravity: Array  # in the frame of the base [m/s^2], (3,)
    first: int  # index of the arm's first joint; those before are of a moving base

    def of(self, joint: int, parameters: Array) -> Array:
        """Moment [N m] and force [N] through a joint, in its frame, by all drives, (6, N).

        ``parameters``: load parameters of the drives, (n, PARAMETERS).
        """
        links = self.links + parameters.ravel() @ self.per_unit.reshape(parameters.size, -1)
        return self._wrenches(joint, links[np.newaxis], slice(None))[0]

    def per_unit_of(self, joint: int, drives: Any, samples: Any) -> Array:
        """The same per unit of each load parameter of some drives, at M samples, (K, 6, M)."""
        links = self.links + self.per_unit[drives].reshape(-1, len(self.links))
        return self._wrenches(joint, links, samples)

    def _wrenches(self, joint: int, links: Array, samples: Any) -> Array:
        motion = joint_motion(self.study, self.study.cycle, samples)
        out = np.empty((len(links), 6, len(motion[0])))
        compute_wrenches(links.view(LINK), self.rotors, self.gravity, *motion, self.first + joint, out)
        return out


@kernel
def compute_wrenches(
    links: Any, rotors: Any, gravity: Array, q: Array, qd: Array, qdd: Array, joint: int, out: Array
) -> None:
    """Fill ``out``, (K, 6, N), with the wrench through a joint for each of K arms; other arguments as ``recursion``.

    The arms differ in their bodies alone, so all of them move as the first one does without its rotors.
    """
    n = q.shape[1]
    joints, bodies, wrench = np.empty(n + 1, JOINT), np.zeros(n + 2, LINKS), np.empty((BLOCK, 6))
    for t in range(BLOCK):
        bodies[0].ax[t], bodies[0].ay[t], bodies[0].az[t] = -gravity[0], -gravity[1], -gravity[2]
    for first in range(0, len(q) if len(links) else 0, BLOCK):
        count = min(BLOCK, len(q) - first)
        size = read(joints, q, qd, qdd, first, count)
        outwards(links[0], rotors[:0], joints, bodies, n, size)
        for k in range(len(links)):
            for i in range(joint, n):
                carried(links[k, i], bodies[i + 1])
            for r in range(len(rotors)):
                couple(links[k, n + r], joints[rotors[r].joint], bodies[rotors[r].carrier + 1])
            back(links[k], joints, bodies, n, joint + 1)
            take_wrench(links[k, joint], joints[joint], bodies[joint + 1], wrench)
            for r in range(6):
                for t in range(count):
                    out[k, r, first + t] = wrench[t, r]


def drive_wrenches(study: Study) -> DriveWrenches:
    """The drives of a study whose arm has no loops."""
    arm, drives = study.arm, mounted_drives(study)
    assert arm is not None
    bare, inverse, gravity, first = _without_mass(arm, study.base is not None)
    turns = np.eye(arm.n) if arm.coupling is None else arm.coupling
    moved = np.flatnonzero(drives.carrier >= 0)  # drives that a link carries
    followed = [(k, i) for k in moved for i in np.flatnonzero(turns[k])]
    per_unit: Any = np.zeros((arm.n, PARAMETERS, len(bare) + len(followed)), LINK)
    link, homes = first + drives.carrier[moved], np.tile(np.eye(4), (len(moved), 1, 1, 1))
    homes[:, 0, :3, :3] = np.reshape([frame_along(axis) for axis in drives.axis[moved]], (-1, 3, 3))
    homes[:, 0, :3, 3] = drives.place[moved]
    bodies = np.zeros((len(moved), PARAMETERS - 1), LINK)
    write_bodies(bodies, carried_moments(inverse[link + 1, None] @ homes, np.array([1.0, 0.0, 0.0, 0.0]), _INERTIAS))
    per_unit[moved, : PARAMETERS - 1, link] = bodies
    for row, (k, i) in enumerate(followed):  # a rotor's momentum, for each joint whose motion its shaft follows
        spin = turns[k, i] * (inverse[first + drives.carrier[k] + 1, :3, :3] @ drives.axis[k])
        own = per_unit[k, PARAMETERS - 1, len(bare) + row]
        own["px"], own["py"], own["pz"] = spin
    rotors = np.array([(first + i, first + drives.carrier[k], 1) for k, i in followed], ROTOR)
    links = np.concatenate([bare, np.zeros(len(followed), LINK)])
    # as plain numbers, of which the last axis has those of all records
    return DriveWrenches(study, as_numbers(links).ravel(), per_unit.view(np.float64), rotors, gravity, first)


@lru_cache(maxsize=8)
def _without_mass(arm: Arm, on_base: bool) -> tuple[np.ndarray, Array, Array, int]:
    """An arm's links without mass and rotors, records LINK; inverse of their frames with all joints at zero; gravity in
    the frame of the base; and the index of the first joint after those of a moving base.
    """
    arm = with_rotors(arm, [None] * arm.n)
    arm, first = (on_moving_base(arm), len(BASE_JOINTS)) if on_base else (arm, 0)
    model = packed(arm)
    links = model.links.copy()
    for name in MOMENTS:
        links[name] = 0.0
    return links, inverse_poses(link_frames(arm)), model.gravity, first
