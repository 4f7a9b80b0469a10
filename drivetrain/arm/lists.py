"""An arm from the lists Mlist, Glist and Slist of Modern Robotics, and the lists of an arm.

Reference: Modern Robotics, section 8.11 and exercise 8.12.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm, refuse_loops
from drivetrain.arrays import Array, checked_array
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.spatial.inertia import parallel_axis
from drivetrain.spatial.poses import inverse_pose

RIGID = 1e-9  # tolerance of the structure of a rigid body's 6 x 6 inertia, over its largest entry
UNIT = 1e-12  # tolerance of the length of a unit screw


class BookLists(NamedTuple):
    """The arguments that describe an arm in the functions of the book."""

    Mlist: Array  # poses of the link frames, each in the one before, then of the tip in the last [m], (n + 1, 4, 4)
    Glist: Array  # spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6)
    Slist: Array  # screw axes in the base frame, as columns, (6, n)


@dataclass(frozen=True, eq=False)
class BookArm:
    """An arm made from the book's lists."""

    arm: Arm  # with unit screws
    scale: Array  # motion of each joint of ``arm`` per unit of the book's theta [-], (n,): the length of its screw


def book_lists(arm: Arm) -> BookLists:
    """The lists of an arm, its link frames at the centres of mass.

    Args:
        arm: Arm without rotors, which the lists cannot describe.

    Returns:
        The lists.

    Raises:
        InputError: An arm with rotors.

    Reference: Modern Robotics, exercise 8.12.
    """
    refuse_loops(arm)
    hint = "take it off: with_rotors(arm, [None, ...])"
    mounted = [i for i, rotor in enumerate(arm.rotors) if rotor is not None]
    if mounted:
        raise InputError(Fault(f"rotors[{i}]", "the book's lists have no place for it", None, hint) for i in mounted)
    frames = [np.eye(4), *arm.home, arm.tip]
    steps = [inverse_pose(before) @ after for before, after in pairwise(frames)]
    inertias = np.zeros((arm.n, 6, 6))
    inertias[:, :3, :3] = arm.inertias
    inertias[:, 3:, 3:] = arm.masses[:, None, None] * np.eye(3)
    return BookLists(np.array(steps), inertias, arm.screws.T.copy())


def arm_from_lists(poses: Any, inertias: Any, screws: Any, gravity: Any = STANDARD_GRAVITY) -> BookArm:
    """The arm that Mlist, Glist and Slist describe: link frames anywhere, screws of any length but zero."""
    tensors = checked_array(inertias, (None, 6, 6), "Glist")
    n = len(tensors)
    steps = checked_array(poses, (n + 1, 4, 4), "Mlist")
    axes = checked_array(screws, (6, n), "Slist").T
    bodies = [_body(matrix, f"Glist[{i}]") for i, matrix in enumerate(tensors)]
    turning, sliding = np.linalg.norm(axes[:, :3], axis=1), np.linalg.norm(axes[:, 3:], axis=1)
    scale = np.where(turning > 0.0, turning, sliding)
    raise_faults(Fault(f"Slist[:, {i}]", "must not be zero") for i in np.flatnonzero(scale == 0.0))
    scale[np.abs(scale - 1.0) < UNIT] = 1.0
    frames = [steps[0]]
    for step in steps[1:]:
        frames.append(frames[-1] @ step)
    home = np.array(frames[:-1])
    home[:, :3, 3] += np.array([frame[:3, :3] @ body[1] for frame, body in zip(frames, bodies, strict=False)])
    masses, _, moments = zip(*bodies, strict=True)
    return BookArm(Arm.from_screws(home, axes / scale[:, None], masses, moments, frames[-1], gravity), scale)


def _body(matrix: Array, name: str) -> tuple[float, Array, Array]:
    """Mass, centre of mass and inertia about it, of a spatial inertia."""
    mass, lever = float(matrix[5, 5]), matrix[:3, 3:]
    first = np.array([lever[2, 1], lever[0, 2], lever[1, 0]])
    com = first / mass if mass else np.zeros(3)
    rest = matrix.copy()
    rest[:3, :3] -= rest[:3, :3].T
    rest[:3, 3:] += lever.T
    rest[3:, :3] -= lever.T
    rest[3:, 3:] -= mass * np.eye(3)
    if np.abs(rest).max() > RIGID * np.abs(matrix).max() or (mass == 0.0 and first.any()):
        problem = "must be the spatial inertia of a rigid body: [[I, m [c]], [-m [c], m 1]], symmetric"
        raise InputError(Fault(name, problem, matrix.tolist()))
    return mass, com, matrix[:3, :3] - parallel_axis(mass, com)
