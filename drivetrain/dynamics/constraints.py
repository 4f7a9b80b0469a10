"""Constraints of an arm as rows ``A(q) qd = 0``, from conditions on positions (holonomic) or on speeds only.

``LoopClosure``: two frames, on links or on the base, connected as by a joint. ``PointOnSurface``: a point of a link
that stays on a surface. ``CallableConstraint``: any other, such as a blade that does not slip sideways.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.checks import checked_pose
from drivetrain.arm.kinematics import displacements
from drivetrain.arrays import Array, checked_array, frozen_array, read_only
from drivetrain.dynamics.core.frames import FRAME, ROW, close_loop, move_frame
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.spatial.poses import inverse_pose


class Rows(NamedTuple):
    """The rows of constraints at N samples."""

    # error of position, (N, k), [m for lengths, - for angles]; zero for rows that constrain speeds only
    error: Array
    jacobian: Array  # A, (N, k, n): the rows of ``A qd = 0``; for holonomic rows the derivative of the error
    drift: Array  # ``dA/dt qd``, (N, k), [m/s^2 or 1/s^2]


class Constraint(ABC):
    """Base class of constraints: frozen dataclasses that compute their rows for given samples.

    Each row has a multiplier: a force [N] for a length, a moment [N m] for an angle. ``A^T lambda`` are the joint
    torques that act on the constraint, equation 8.93.
    """

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of rows [-]."""

    @property
    def holonomic(self) -> bool:
        """Whether positions are constrained, not only speeds."""
        return True

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the rows' multipliers, k of them."""
        return ("N",) * self.count

    @abstractmethod
    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        """The rows at samples q and qd, (N, n) each."""


@dataclass(frozen=True, eq=False)
class Attachment:
    """A frame fixed to a link.

    Attributes:
        link: Index of the link; -1 is the base.
        pose: Pose of the frame in the base frame with all joints at zero, (4, 4); translation [m].
    """

    link: int
    pose: Array

    def __post_init__(self) -> None:
        if isinstance(self.link, bool) or not isinstance(self.link, (int, np.integer)) or self.link < -1:
            raise InputError(Fault("Attachment.link", "must be the index of a link, or -1 for the base", self.link))
        pose = read_only(np.ascontiguousarray(checked_pose(self.pose, "Attachment.pose")))
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
        """A frame fixed to the base.

        Args:
            pose: In the base frame, (4, 4); translation [m].

        Returns:
            The frame, on the base.
        """
        return cls(-1, pose)

    @classmethod
    def at(cls, arm: Arm, link: int, q: Any, pose: Any) -> Attachment:
        """The frame on a link that has a given pose when the arm is at q, such as a handle that has just been grasped.

        Args:
            arm: The arm.
            link: Index of the link; -1 is the base.
            q: Positions [rad or m], (n,).
            pose: Pose of the frame in the base frame at q, (4, 4); translation [m].

        Returns:
            The frame, fixed to the link.

        Raises:
            InputError: Wrong shapes, or a matrix that is not a pose.
        """
        place = checked_pose(pose, "pose")
        moved = displacements(arm, checked_array(q, (arm.n,), "q"))[0, link + 1]
        return cls(link, np.asarray(inverse_pose(moved) @ place))


@dataclass(frozen=True, eq=False)
class CallableConstraint(Constraint):
    """Rows from functions of one sample, for constraints that the other classes cannot express.

    Attributes:
        jacobian: ``q -> A``, (k, n) from (n,).
        drift: ``(q, qd) -> dA/dt qd``, (k,).
        size: k, the number of rows.
        error: ``q -> error``, (k,), whose derivative is A. None: the rows constrain speeds only (Pfaffian).

    Reference: Modern Robotics, section 8.7: the Pfaffian A(theta), and the term with its derivative.
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


# Rows of closures: (0: distance, 1: angle), axis of the second frame, axis of the first frame.
_X, _Y, _Z = ((0, k, 0) for k in range(3))
_TILTS = ((1, 0, 2), (1, 1, 2))  # the z axis of a is perpendicular to x and y of b
_TURN = (1, 0, 1)  # its y axis is perpendicular to x of b: together with the tilts, no rotation


class ClosingJoint(Enum):
    """Connection of two frames, in the axes of the second one, by the freedom that is left.

    WELD: none. HINGE: rotation about the common z axis. SLIDER: translation along it. CYLINDER: both. BALL: any
    rotation about the common origin. PLANE: translation in the x-y plane and rotation about z.
    """

    WELD = (_X, _Y, _Z, *_TILTS, _TURN)
    HINGE = (_X, _Y, _Z, *_TILTS)
    SLIDER = (_X, _Y, *_TILTS, _TURN)
    CYLINDER = (_X, _Y, *_TILTS)
    BALL = (_X, _Y, _Z)
    PLANE = (_Z, *_TILTS)


@dataclass(frozen=True, eq=False)
class LoopClosure(Constraint):
    """Two frames connected as by a joint: a loop of links, a handle, a fixture, or a given pose (WELD).

    Rows are distances along the axes of the second frame [m], then cosines of angles between axes [-], which near
    closure are small angles [rad]. Their multipliers are forces [N] and moments [N m].

    Attributes:
        first, second: The frames.
        joint: Kind of connection.
    """

    first: Attachment
    second: Attachment
    joint: ClosingJoint
    _homes: Array = field(init=False, repr=False)
    _ends: np.ndarray = field(init=False, repr=False)
    _codes: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        kinds = (("first", Attachment), ("second", Attachment), ("joint", ClosingJoint))
        strange = [(name, kind) for name, kind in kinds if not isinstance(getattr(self, name), kind)]
        if strange:
            raise InputError(
                Fault(f"LoopClosure.{name}", f"must be of kind {kind.__name__}", type(getattr(self, name)).__name__)
                for name, kind in strange
            )
        if self.first.link == self.second.link:
            raise InputError(Fault("LoopClosure", "must hold frames on two different links", self.first.link))
        object.__setattr__(self, "_homes", np.array([self.first.pose, self.second.pose]))
        object.__setattr__(self, "_ends", np.array([self.first.link, self.second.link], dtype=np.int64))
        object.__setattr__(self, "_codes", np.array(list(self.joint.value), ROW))

    @property
    def count(self) -> int:
        return len(self._codes)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple("N m" if across else "N" for across, _, _ in self.joint.value)

    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        samples, k = len(q), self.count
        rows = Rows(np.empty((samples, k)), np.empty((samples, k, arm.n)), np.empty((samples, k)))
        close_loop(arm.screws, self._homes, self._ends, self._codes, q, qd, *rows)
        return rows


def _motion(arm: Arm, attachment: Attachment, q: Array, qd: Array) -> tuple[Any, Array]:
    """Motion of a frame on a link, records FRAME (N,), and the Jacobian of its velocities (N, 6, n)."""
    frames, jacobian = np.empty(len(q), FRAME), np.empty((len(q), 6, arm.n))
    move_frame(arm.screws, attachment.pose, attachment.link, q, qd, frames, jacobian)
    return frames, jacobian


class Surface(ABC):
    """A fixed surface: the points whose height is zero."""

    @abstractmethod
    def height(self, points: Array) -> tuple[Array, Array, Array]:
        """Height of points (N, 3) above the surface [m], positive outside, with its gradient and second derivative."""


@dataclass(frozen=True, eq=False)
class Plane(Surface):
    """A plane.

    Attributes:
        normal: Outward normal, scaled to unit length [-], (3,).
        point: Any point of the plane, in the base frame [m], (3,).
    """

    normal: Array
    point: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", _direction(self.normal, "Plane.normal"))
        object.__setattr__(self, "point", frozen_array(self.point, (3,), "Plane.point"))

    def height(self, points: Array) -> tuple[Array, Array, Array]:
        gradient = np.broadcast_to(self.normal, points.shape)
        return (points - self.point) @ self.normal, gradient, np.zeros((len(points), 3, 3))


@dataclass(frozen=True, eq=False)
class PointOnSurface(Constraint):
    """The origin of a frame stays on a surface: the book's pen on paper. One row; its multiplier is a force [N].

    The multiplier is the force of the arm on the surface along the outward normal: negative if the arm pushes. A real
    surface can only be pushed; this constraint acts in both directions.

    Attributes:
        point: The frame; its axes are not used.
        surface: The surface.
    """

    point: Attachment
    surface: Surface

    @property
    def count(self) -> int:
        return 1

    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        moved, jacobian = _motion(arm, self.point, q, qd)
        height, gradient, curvature = self.surface.height(np.ascontiguousarray(moved["place"]))
        bent = np.einsum("ni,nij,nj->n", moved["v"], curvature, moved["v"])
        drift = bent + np.sum(gradient * moved["dv"], axis=1)
        return Rows(height[:, None], gradient[:, None] @ jacobian[:, 3:], drift[:, None])


def _direction(value: Any, name: str) -> Array:
    vector = checked_array(value, (3,), name)
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        raise InputError(Fault(name, "must not be zero", vector.tolist()))
    return frozen_array(vector / size, (3,), name)


def stacked_rows(arm: Arm, constraints: Sequence[Constraint], q: Array, qd: Array) -> Rows:
    """The rows of several constraints, one under the other."""
    if len(constraints) == 1:
        return constraints[0].rows(arm, q, qd)
    parts = [constraint.rows(arm, q, qd) for constraint in constraints]
    return Rows(*(np.concatenate(part, axis=1) for part in zip(*parts, strict=True)))


def checked_constraints(arm: Arm, constraints: Any) -> tuple[Constraint, ...]:
    """The constraints as a tuple; raises ``InputError`` unless each is a constraint that fits the arm."""
    refuse_loops(arm)
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
    raise_faults(faults)
    return several
