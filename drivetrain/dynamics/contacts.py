"""A point of a link that stays on a surface, and a blade that does not slip sideways."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, checked_array, frozen_array
from drivetrain.dynamics.constraints import Attachment, Constraint, Rows
from drivetrain.dynamics.frame_kernels import compiled_frame
from drivetrain.errors import Fault, InputError


class _Motion(NamedTuple):
    """How a frame on a link moves: axes (N, 3, 3) row by row, place, rates, and rates of these at constant qd."""

    axes: Array
    place: Array
    spin: Array
    velocity: Array
    spin_drift: Array
    drift: Array
    jacobian: Array


def _motion(arm: Arm, attachment: Attachment, q: Array, qd: Array) -> _Motion:
    pose, jacobian = np.empty((len(q), 24)), np.empty((len(q), 6, arm.n))
    compiled_frame()(arm.screws, attachment.pose, attachment.link, q, qd, pose, jacobian)
    place, spin, velocity, spin_drift, drift = (pose[:, at : at + 3] for at in (9, 12, 15, 18, 21))
    return _Motion(pose[:, :9].reshape(-1, 3, 3), place, spin, velocity, spin_drift, drift, jacobian)


class Surface(ABC):
    """A surface that stands still: the points where its height is zero."""

    @abstractmethod
    def height(self, points: Array) -> tuple[Array, Array, Array]:
        """How high points are above the surface, and how that changes.

        Args:
            points: In the base frame [m], (N, 3).

        Returns:
            Height [m], (N,), positive outside; its gradient [-], (N, 3); its second derivative [1/m], (N, 3, 3).
        """


@dataclass(frozen=True, eq=False)
class Plane(Surface):
    """A plane.

    Attributes:
        normal: Outwards, made unit length [-], (3,).
        point: Any point of it, in the base frame [m], (3,).
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
class Sphere(Surface):
    """A sphere.

    Attributes:
        centre: In the base frame [m], (3,).
        radius: [m].
    """

    centre: Array
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", frozen_array(self.centre, (3,), "Sphere.centre"))
        object.__setattr__(self, "radius", _positive(self.radius, "Sphere.radius"))

    def height(self, points: Array) -> tuple[Array, Array, Array]:
        return _from_centre(points - self.centre, np.eye(3), self.radius)


@dataclass(frozen=True, eq=False)
class Cylinder(Surface):
    """A round cylinder without ends.

    Attributes:
        axis: Direction, made unit length [-], (3,).
        point: Any point of the axis, in the base frame [m], (3,).
        radius: [m].
    """

    axis: Array
    point: Array
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", _direction(self.axis, "Cylinder.axis"))
        object.__setattr__(self, "point", frozen_array(self.point, (3,), "Cylinder.point"))
        object.__setattr__(self, "radius", _positive(self.radius, "Cylinder.radius"))

    def height(self, points: Array) -> tuple[Array, Array, Array]:
        across = np.eye(3) - np.outer(self.axis, self.axis)
        return _from_centre((points - self.point) @ across, across, self.radius)


@dataclass(frozen=True, eq=False)
class PointOnSurface(Constraint):
    """The origin of a frame stays on a surface: the book's pen on paper. One row; its multiplier is a force [N].

    The multiplier is the force of the arm on the surface along the outward normal: negative while the arm pushes.
    A real surface can only be pushed; this one holds both ways.

    Attributes:
        point: The frame; its axes do not matter.
        surface: What it stays on.
    """

    point: Attachment
    surface: Surface

    @property
    def count(self) -> int:
        return 1

    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        moved = _motion(arm, self.point, q, qd)
        height, gradient, curvature = self.surface.height(moved.place)
        jacobian = gradient[:, None] @ moved.jacobian[:, 3:]
        bent = np.einsum("ni,nij,nj->n", moved.velocity, curvature, moved.velocity)
        drift = bent + np.sum(gradient * moved.drift, axis=1)
        return Rows(height[:, None], jacobian, drift[:, None])


@dataclass(frozen=True, eq=False)
class KnifeEdge(Constraint):
    """The origin of a frame has no velocity along one of the frame's own directions: a skate, a wheel, a blade.

    One row that binds speeds and not positions (nonholonomic); its multiplier is the sideways force [N].

    Attributes:
        blade: The frame.
        sideways: In that frame, made unit length [-], (3,).
    """

    blade: Attachment
    sideways: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "sideways", _direction(self.sideways, "KnifeEdge.sideways"))

    @property
    def count(self) -> int:
        return 1

    @property
    def holonomic(self) -> bool:
        return False

    def rows(self, arm: Arm, q: Array, qd: Array) -> Rows:
        moved = _motion(arm, self.blade, q, qd)
        direction = self.sideways @ moved.axes
        jacobian = direction[:, None] @ moved.jacobian[:, 3:]
        turned = np.cross(moved.spin, direction)
        drift = np.sum(turned * moved.velocity + direction * moved.drift, axis=1)
        return Rows(np.zeros((len(q), 1)), jacobian, drift[:, None])


def _from_centre(offset: Array, across: Array, radius: float) -> tuple[Array, Array, Array]:
    """Height above a round surface, from offsets at right angles to its axis or from its centre."""
    distance = np.linalg.norm(offset, axis=1)
    # On the axis itself no direction is outwards; any will do for a start.
    safe = np.where(distance > 0.0, distance, 1.0)
    gradient = offset / safe[:, None]
    curvature = (across - gradient[:, :, None] * gradient[:, None, :]) / safe[:, None, None]
    return distance - radius, gradient, curvature


def _direction(value: Any, name: str) -> Array:
    vector = checked_array(value, (3,), name)
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        raise InputError(Fault(name, "must not be zero", vector.tolist()))
    return frozen_array(vector / size, (3,), name)


def _positive(value: Any, name: str) -> float:
    number = float(checked_array(value, (), name))
    if number <= 0.0:
        raise InputError(Fault(name, "must be positive [m]", value))
    return number
