"""What a task asks of the tip, as rows of a Jacobian: its twist in some frame, or the rates of its coordinates.

A task with fewer rows than six leaves the rest of the tip's motion free: (2, 3, 4) of a body twist is the plane of a
planar arm that turns about z.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.jacobian_rates import body_jacobian_rate, space_jacobian_rate
from drivetrain.dynamics.kinematics import body_jacobian, space_jacobian, tip_pose
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.rotation_coordinates import ROTATION_VECTOR, RotationCoordinates

ALL = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True)
class Task(ABC):
    """Base of the tasks.

    Attributes:
        rows: Which of the six rows count, (angular 0 to 2, linear 3 to 5).
    """

    rows: tuple[int, ...] = ALL

    def __post_init__(self) -> None:
        rows = tuple(self.rows)
        if not rows or len(set(rows)) != len(rows) or not set(rows) <= set(ALL):
            raise InputError(Fault(f"{type(self).__name__}.rows", "must be different numbers from 0 to 5", self.rows))
        object.__setattr__(self, "rows", rows)

    @abstractmethod
    def _whole(self, arm: Arm, q: Array) -> Array:
        """The Jacobian with all six rows, (N, 6, n)."""

    @abstractmethod
    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        """Its time derivative, (N, 6, n)."""

    def jacobian(self, arm: Arm, q: Array) -> Array:
        """The matrix that takes joint rates to the rates of the task.

        Args:
            q: Positions [rad or m], (N, n).

        Returns:
            (N, k, n), rows in SI units.
        """
        return self._whole(arm, q)[:, self.rows]

    def jacobian_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        """The time derivative of the Jacobian.

        Args:
            q, qd: Positions and speeds [rad or m, and per s], (N, n).

        Returns:
            (N, k, n), rows in SI units per second.
        """
        return self._whole_rate(arm, q, qd)[:, self.rows]


@dataclass(frozen=True)
class BodyTwist(Task):
    """The twist of the tip in the tip's frame."""

    def _whole(self, arm: Arm, q: Array) -> Array:
        return body_jacobian(arm, q)

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        return body_jacobian_rate(arm, q, qd)


@dataclass(frozen=True)
class SpaceTwist(Task):
    """The twist of the tip in the base frame: its linear part is that of the point that passes the base's origin."""

    def _whole(self, arm: Arm, q: Array) -> Array:
        return space_jacobian(arm, q)

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        return space_jacobian_rate(arm, q, qd)


@dataclass(frozen=True)
class TipVelocity(Task):
    """Angular velocity of the tip, and velocity of its origin, both along the base's axes."""

    def _whole(self, arm: Arm, q: Array) -> Array:
        return _turned(tip_pose(arm, q)[:, :3, :3], body_jacobian(arm, q))

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        turn, columns = tip_pose(arm, q)[:, :3, :3], body_jacobian(arm, q)
        spin = columns[:, :3] @ qd[:, :, None]
        carried = np.concatenate(
            [np.cross(spin, columns[:, :3], axis=1), np.cross(spin, columns[:, 3:], axis=1)], axis=1
        )
        return _turned(turn, carried + body_jacobian_rate(arm, q, qd))


@dataclass(frozen=True)
class PoseCoordinates(Task):
    """Rates of coordinates of the tip's pose: three of its rotation, then its origin in the base frame.

    Its Jacobian is the analytic one; wrenches that belong to it do work on these rates.

    Attributes:
        coordinates: Of the rotation.

    Reference: Modern Robotics, section 5.1.5.
    """

    coordinates: RotationCoordinates = ROTATION_VECTOR

    def values(self, arm: Arm, q: Array) -> Array:
        """The coordinates themselves.

        Args:
            q: Positions [rad or m], (N, n).

        Returns:
            (N, k), [rad] and [m].
        """
        poses = tip_pose(arm, q)
        turns = np.array([self.coordinates.values(pose[:3, :3]) for pose in poses])
        return np.concatenate([turns, poses[:, :3, 3]], axis=1)[:, self.rows]

    def _whole(self, arm: Arm, q: Array) -> Array:
        turn, columns = tip_pose(arm, q)[:, :3, :3], body_jacobian(arm, q)
        rates = np.array([self.coordinates.rate_matrix(one) for one in turn])
        return np.concatenate([rates @ columns[:, :3], turn @ columns[:, 3:]], axis=1)

    def _whole_rate(self, arm: Arm, q: Array, qd: Array) -> Array:
        turn, columns, slopes = tip_pose(arm, q)[:, :3, :3], body_jacobian(arm, q), body_jacobian_rate(arm, q, qd)
        spin = columns[:, :3] @ qd[:, :, None]
        pairs = [self.coordinates.rate_matrix_rate(one, w[:, 0]) for one, w in zip(turn, spin, strict=True)]
        rates = np.array([self.coordinates.rate_matrix(one) for one in turn])
        angular = np.array(pairs) @ columns[:, :3] + rates @ slopes[:, :3]
        linear = turn @ (np.cross(spin, columns[:, 3:], axis=1) + slopes[:, 3:])
        return np.concatenate([angular, linear], axis=1)


def _turned(turn: Array, columns: Array) -> Array:
    """Both parts of columns turned, (N, 6, n)."""
    return np.concatenate([turn @ columns[:, :3], turn @ columns[:, 3:]], axis=1)
