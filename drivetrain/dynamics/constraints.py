"""What constrains an arm: rows ``A(q) qd = 0``, from a position that must be held (holonomic) or from speeds alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.checks import checked_pose
from drivetrain.arrays import Array, checked_array
from drivetrain.dynamics.kinematics import screw_displacements
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.poses import inverse_pose


class Rows(NamedTuple):
    """The rows of constraints over samples.

    Attributes:
        error: How far the position is off, (N, k), [m for lengths, - for angles]; zero for rows that only bind speeds.
        jacobian: A, (N, k, n): the rows of ``A qd = 0``; the derivative of the error where there is one.
        drift: ``dA/dt qd``, (N, k), [m/s^2 or 1/s^2].
    """

    error: Array
    jacobian: Array
    drift: Array


class Constraint(ABC):
    """Base of the constraints; a frozen dataclass that can tell its rows for any samples.

    Multipliers belong to rows: that of a length is a force [N], that of an angle a moment [N m], and ``A^T lambda`` are
    the joint torques that go against the constraint, equation 8.93.
    """

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of rows [-]."""

    @property
    def holonomic(self) -> bool:
        """Whether positions are held, not only speeds."""
        return True

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the rows' multipliers, k of them."""
        return ("N",) * self.count

    @abstractmethod
    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        """The rows at given samples.

        Args:
            q, qd: Positions and speeds [rad or m, and per s], (N, n), C order.
        """


@dataclass(frozen=True, eq=False)
class Attachment:
    """A frame fixed to a link.

    Attributes:
        link: Index of the link; -1 is the base.
        pose: Of the frame in the base frame with all joints at zero, (4, 4); translation [m].
    """

    link: int
    pose: Array

    def __post_init__(self) -> None:
        if isinstance(self.link, bool) or not isinstance(self.link, (int, np.integer)) or self.link < -1:
            raise InputError(Fault("Attachment.link", "must be the index of a link, or -1 for the base", self.link))
        pose = np.ascontiguousarray(checked_pose(self.pose, "Attachment.pose"))
        pose.setflags(write=False)
        object.__setattr__(self, "link", int(self.link))
        object.__setattr__(self, "pose", pose)

    @classmethod
    def tip(cls, arm: Arm) -> Attachment:
        """The tip of an arm.

        Args:
            arm: The arm.

        Returns:
            The tip frame, on the last link.
        """
        return cls(arm.n - 1, arm.tip)

    @classmethod
    def base(cls, pose: Any) -> Attachment:
        """A frame that stands still.

        Args:
            pose: In the base frame, (4, 4); translation [m].

        Returns:
            The frame, on the base.
        """
        return cls(-1, pose)

    @classmethod
    def at(cls, arm: Arm, link: int, q: Any, pose: Any) -> Attachment:
        """The frame on a link that stands somewhere given when the arm is at q: a handle that has just been grasped.

        Args:
            arm: The arm.
            link: Index of the link; -1 is the base.
            q: Positions [rad or m], (n,).
            pose: Of the frame in the base frame then, (4, 4); translation [m].

        Returns:
            The frame, fixed to the link.

        Raises:
            InputError: Wrong shapes, or no pose.
        """
        place = checked_pose(pose, "pose")
        positions = checked_array(q, (arm.n,), "q")
        moved = np.eye(4)
        for screw, angle in zip(arm.screws[: link + 1], positions, strict=False):
            moved = moved @ screw_displacements(screw, np.array([angle]))[0]
        return cls(link, np.asarray(inverse_pose(moved) @ place))


@dataclass(frozen=True, eq=False)
class CallableConstraint(Constraint):
    """Rows from functions of one sample: whatever the other constraints cannot say.

    Attributes:
        jacobian: ``q -> A``, (k, n) from (n,).
        drift: ``(q, qd) -> dA/dt qd``, (k,).
        size: k, the number of rows.
        error: ``q -> error``, (k,), whose derivative is A. None: the rows bind speeds only (Pfaffian).
    """

    jacobian: Callable[[Array], Any]
    drift: Callable[[Array, Array], Any]
    size: int
    error: Callable[[Array], Any] | None = None

    @property
    def count(self) -> int:
        return self.size

    @property
    def holonomic(self) -> bool:
        return self.error is not None

    @property
    def units(self) -> tuple[str, ...]:
        return ("-",) * self.size

    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        k, parts = self.size, []
        for position, speed in zip(q, qd, strict=True):
            error = np.zeros(k) if self.error is None else checked_array(self.error(position), (k,), "error(q)")
            jacobian = checked_array(self.jacobian(position), (k, arm.n), "jacobian(q)")
            parts.append((error, jacobian, checked_array(self.drift(position, speed), (k,), "drift(q, qd)")))
        return Rows(*(np.array(part) for part in zip(*parts, strict=True)))


def stacked_rows(arm: Arm, constraints: Sequence[Constraint], q: Array, qd: Array) -> Rows:
    """The rows of several constraints, one under the other.

    Args:
        q, qd: Positions and speeds [rad or m, and per s], (N, n), C order.
    """
    if len(constraints) == 1:
        return constraints[0].rows(arm, q, qd)
    parts = [constraint.rows(arm, q, qd) for constraint in constraints]
    return Rows(*(np.concatenate(part, axis=1) for part in zip(*parts, strict=True)))


def checked_constraints(arm: Arm, constraints: Any) -> tuple[Constraint, ...]:
    """Constraints as a tuple, each of which is one and fits the arm.

    Raises:
        InputError: None, something else, or one that names a link which the arm does not have.
    """
    if isinstance(constraints, Constraint):
        several: tuple[Any, ...] = (constraints,)
    elif isinstance(constraints, Iterable):
        several = tuple(constraints)
    else:
        raise InputError(Fault("constraints", "must be a Constraint, or several", constraints))
    if not several:
        raise InputError(Fault("constraints", "must be at least one"))
    faults = []
    for i, constraint in enumerate(several):
        if not isinstance(constraint, Constraint):
            faults.append(Fault(f"constraints[{i}]", "must be a Constraint", constraint))
            continue
        for name, value in vars(constraint).items():
            if isinstance(value, Attachment) and value.link >= arm.n:
                problem = f"names a link that the arm does not have; it has {arm.n}, counted from 0"
                faults.append(Fault(f"constraints[{i}].{name}", problem, value.link))
    if faults:
        raise InputError(faults)
    return several
