"""Arms from Denavit-Hartenberg tables, classic or modified; the user states which, as the table does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm
from drivetrain.arm.checks import checked_pose
from drivetrain.arrays import Array, checked_array
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.spatial.poses import axis_screw, pose
from drivetrain.spatial.rotations import exp_rotation


class DHConvention(StrEnum):
    """Position of the frame of link i.

    CLASSIC: at the far end of the link, z along joint i + 1; row i is a rotation theta about and a translation d along
    the previous z, then a translation a along and a rotation alpha about the new x (Denavit and Hartenberg; Paul;
    Corke's "standard"). MODIFIED: at the near end of the link, z along joint i; row i has a and alpha of the link
    before, which are applied first (Craig; Modern Robotics, appendix C).
    """

    CLASSIC = "classic"
    MODIFIED = "modified"


class JointKind(StrEnum):
    """Kind of a joint: its position is added to theta [rad] if REVOLUTE, to d [m] if PRISMATIC."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


@dataclass(frozen=True, eq=False)
class DHRow:
    """One row of a Denavit-Hartenberg table, with the link it moves.

    Attributes:
        a: Translation along x [m].
        alpha: Rotation about x [rad].
        d: Translation along z with the joint at zero [m].
        theta: Rotation about z with the joint at zero [rad].
        kind: Whether the joint's position is added to theta or to d.
        mass: Mass of the link [kg].
        com: Centre of mass in the link's frame, to which this row leads [m], (3,).
        inertia: Inertia about the centre of mass, axes of the link's frame [kg m^2], (3, 3).
        lower, upper: Position limits [rad or m].
        speed_limit: Speed limit [rad/s or m/s].
    """

    a: float
    alpha: float
    d: float
    theta: float = 0.0
    kind: JointKind = JointKind.REVOLUTE
    mass: float = 0.0
    com: Any = (0.0, 0.0, 0.0)
    inertia: Any = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    lower: float = -inf
    upper: float = inf
    speed_limit: float = inf


def arm_from_dh(
    rows: Sequence[DHRow],
    *,
    convention: DHConvention,
    base: Any = None,
    tool: Any = None,
    gravity: Any = STANDARD_GRAVITY,
    joint_names: Sequence[str] | None = None,
    link_names: Sequence[str] | None = None,
    name: str = "arm",
    notes: Sequence[str] = (),
    check_inertias: bool = True,
) -> Arm:
    """The arm of a Denavit-Hartenberg table.

    Args:
        rows: One row per joint, base first, (n,).
        convention: Classic or modified.
        base: Frame 0 of the table in the arm's base frame, (4, 4); translation [m]. None: the same.
        tool: Tip frame in the last link's frame, (4, 4); translation [m]. None: the last link's frame.
        gravity: Acceleration of free fall in the arm's base frame [m/s^2], (3,).
        joint_names, link_names: n each; None: numbered.
        name: Name of the arm.
        notes: Remarks for the report.
        check_inertias: Whether to warn of inertias that no body can have.

    Returns:
        The arm. The position of each joint is the point of its axis nearest to its link's centre of mass.

    Raises:
        InputError: An unknown convention or joint kind, values that are not numbers, or faults of ``Arm.from_screws``.
    """
    order = _known(DHConvention, convention, "convention")
    faults = Faults()
    base_pose = np.eye(4) if base is None else faults.attempt(checked_pose, base, "base")
    tool_pose = np.eye(4) if tool is None else faults.attempt(checked_pose, tool, "tool")
    steps = [faults.attempt(_step, row, order, f"rows[{i}]") for i, row in enumerate(rows)]
    coms = [faults.attempt(checked_array, row.com, (3,), f"rows[{i}].com") for i, row in enumerate(rows)]
    faults.raise_any()
    frame, screws, home = np.asarray(base_pose), [], []
    for row, step, com in zip(rows, steps, coms, strict=True):
        before, frame = frame, frame @ np.asarray(step)
        axis_frame = before if order is DHConvention.CLASSIC else frame
        slides = JointKind(row.kind) is JointKind.PRISMATIC
        screws.append(axis_screw(axis_frame[:3, 2], axis_frame[:3, 3], slides=slides))
        home.append(frame @ pose(point=com))
    return Arm.from_screws(
        home,
        screws,
        [row.mass for row in rows],
        [row.inertia for row in rows],
        frame @ np.asarray(tool_pose),
        gravity,
        joint_names=joint_names,
        link_names=link_names,
        lower=[row.lower for row in rows],
        upper=[row.upper for row in rows],
        speed_limits=[row.speed_limit for row in rows],
        name=name,
        notes=notes,
        check_inertias=check_inertias,
    )


def _known(kinds: type[Any], value: object, place: str) -> Any:
    try:
        return kinds(value)
    except ValueError:
        known = " or ".join(member.value for member in kinds)
        raise InputError(Fault(place, f"must be {known}", value)) from None


def _step(row: DHRow, convention: DHConvention, place: str) -> Array:
    """The pose of the row's frame in the frame before it, the joint at zero."""
    _known(JointKind, row.kind, f"{place}.kind")
    a, alpha, d, theta = checked_array([row.a, row.alpha, row.d, row.theta], (4,), f"{place} (a, alpha, d, theta)")
    about_z = pose(exp_rotation([0.0, 0.0, theta]), [0.0, 0.0, d])
    about_x = pose(exp_rotation([alpha, 0.0, 0.0]), [a, 0.0, 0.0])
    return about_z @ about_x if convention is DHConvention.CLASSIC else about_x @ about_z
