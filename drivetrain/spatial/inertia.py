"""Inertia of rigid bodies: change of frame, sum and difference, principal axes, and physical consistency."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array, frozen_array, read_only
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.spatial.poses import adjoint, inverse_pose
from drivetrain.spatial.rotations import is_rotation, nearest_rotation, skew

SYMMETRIC = 1e-6  # relative asymmetry of an inertia accepted as rounding of printed digits


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Mass, centre of mass and inertia, all in one frame.

    Attributes:
        mass: [kg]; negative for a body that is subtracted.
        com: Centre of mass [m], (3,).
        inertia: About the centre of mass, axes of the frame [kg m^2], (3, 3), symmetric to 1e-6 and then made exactly
            symmetric. Physical consistency is not checked here, see ``triangle_excess``.
    """

    mass: float
    com: Array
    inertia: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", float(checked_array(self.mass, (), "mass")))
        object.__setattr__(self, "com", frozen_array(self.com, (3,), "com"))
        object.__setattr__(self, "inertia", _symmetric(self.inertia))

    def seen_from(self, pose_a_b: Any) -> RigidBody:
        """This body, given in frame b, expressed in frame a.

        Args:
            pose_a_b: Pose of b in a, (4, 4); translation [m].

        Returns:
            The body in frame a.

        Raises:
            InputError: A wrong shape, a NaN or infinity, or a matrix that is no pose.
        """
        t = _pose(pose_a_b)
        rotation = t[:3, :3]
        return RigidBody(self.mass, rotation @ self.com + t[:3, 3], _mean(rotation @ self.inertia @ rotation.T))

    def negative(self) -> RigidBody:
        """The body that subtracts this one when combined [kg, kg m^2]."""
        return RigidBody(-self.mass, self.com, -self.inertia)

    def inertia_about(self, point: Any) -> Array:
        """The inertia about any point.

        Args:
            point: In the body's frame [m], (3,).

        Returns:
            [kg m^2], (3, 3).

        Reference: Modern Robotics, theorem 8.2 (Steiner), equation 8.27.
        """
        return self.inertia + parallel_axis(self.mass, self.com - checked_array(point, (3,), "point"))

    def spatial_inertia(self, pose_a_b: Any = None) -> Array:
        """The 6 x 6 matrix G from twist to momentum, in any frame.

        Args:
            pose_a_b: Pose of the body's frame b in the wanted frame a, (4, 4); translation [m]. None: the body's own.

        Returns:
            (6, 6), (angular, linear): kg m^2 in the upper left block, kg m off the diagonal, kg in the lower right.

        Raises:
            InputError: A wrong shape, a NaN or infinity, or a matrix that is no pose.

        Reference: Modern Robotics, equations 8.32 and 8.42.
        """
        lever = self.mass * skew(self.com)
        own = np.zeros((6, 6))
        own[:3, :3] = self.inertia_about(np.zeros(3))
        own[:3, 3:], own[3:, :3] = lever, lever.T
        own[3:, 3:] = self.mass * np.eye(3)
        if pose_a_b is None:
            return own
        back = adjoint(inverse_pose(_pose(pose_a_b)))
        return np.asarray(back.T @ own @ back)

    def principal_axes(self) -> tuple[Array, Array]:
        """Principal moments and their axes.

        Returns:
            Moments about the centre of mass, smallest first [kg m^2], (3,), and a rotation matrix whose columns are
            their axes [-], (3, 3).

        Reference: Modern Robotics, section 8.2.1. Below equation 8.26 the book has the columns of the rotation
            "correspond to the eigenvalues"; they are the eigenvectors.
        """
        moments, axes = np.linalg.eigh(self.inertia)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return moments, nearest_rotation(axes)


def combined(bodies: Iterable[RigidBody]) -> RigidBody:
    """The body that consists of bodies fixed together, all given in one frame.

    Args:
        bodies: Any number of bodies.

    Returns:
        One body in the same frame. Its centre of mass is that of the first body if the masses sum to zero.
    """
    parts = tuple(bodies)
    mass = sum(part.mass for part in parts)
    if mass == 0.0:
        centre = parts[0].com if parts else np.zeros(3)
    else:
        # Relative to the first centre, so that adding a body of zero mass changes no bit.
        centre = parts[0].com + sum(part.mass * (part.com - parts[0].com) for part in parts[1:]) / mass
    inertia = sum((part.inertia_about(centre) for part in parts), np.zeros((3, 3)))
    return RigidBody(mass, centre, _mean(inertia))  # cancellation must not leave an asymmetry


def parallel_axis(mass: float, offset: Any) -> Array:
    """The parallel-axis (Steiner) term of a mass at an offset [kg m^2], (3, 3); Modern Robotics, equation 8.27."""
    cross = skew(offset)
    return np.asarray(-mass * (cross @ cross))


def cuboid(mass: float, length: float, width: float, height: float) -> RigidBody:
    """A uniform box with its centre at the origin and edges along the axes.

    Args:
        mass: [kg].
        length, width, height: Edges along x, y and z [m].

    Returns:
        The body.

    Raises:
        InputError: A mass or size that is negative, or no finite number; all of them at once.

    Reference: Modern Robotics, figure 8.5.
    """
    _check_solid({"mass": mass, "length": length, "width": width, "height": height})
    x, y, z = length**2, width**2, height**2
    return RigidBody(mass, np.zeros(3), mass / 12.0 * np.diag([y + z, x + z, x + y]))


def cylinder(mass: float, radius: float, height: float) -> RigidBody:
    """A uniform circular cylinder about z with its centre at the origin.

    Args:
        mass: [kg].
        radius: [m].
        height: Along z [m].

    Returns:
        The body.

    Raises:
        InputError: A mass or size that is negative, or no finite number; all of them at once.

    Reference: Modern Robotics, figure 8.5.
    """
    _check_solid({"mass": mass, "radius": radius, "height": height})
    across = mass * (3.0 * radius**2 + height**2) / 12.0
    return RigidBody(mass, np.zeros(3), np.diag([across, across, 0.5 * mass * radius**2]))


def ellipsoid(mass: float, a: float, b: float, c: float) -> RigidBody:
    """A uniform ellipsoid with its centre at the origin; a ball if the half axes are equal.

    Args:
        mass: [kg].
        a, b, c: Half axes along x, y and z [m].

    Returns:
        The body.

    Raises:
        InputError: A mass or size that is negative, or no finite number; all of them at once.

    Reference: Modern Robotics, figure 8.5.
    """
    _check_solid({"mass": mass, "a": a, "b": b, "c": c})
    x, y, z = a * a, b * b, c * c
    return RigidBody(mass, np.zeros(3), mass / 5.0 * np.diag([y + z, x + z, x + y]))


def triangle_excess(inertia: Any) -> float:
    """Excess of the largest principal moment over the sum of the two others, as a share of the sum of all three.

    It is positive for no distribution of mass; it is 0 for a flat plate, -1/3 for a ball and a point mass. It equals
    minus the smallest eigenvalue of ``0.5 trace(I) E - I`` over half the trace: Wensing, Kim and Slotine, Linear matrix
    inequalities for physically consistent inertial parameter identification, IEEE RA-L 3 (2018) 60-67.
    """
    tensor = checked_array(inertia, (3, 3), "inertia")
    if not tensor.any():
        return -1.0 / 3.0
    moments = np.linalg.eigvalsh(tensor)
    total = float(moments.sum())
    if total <= 0.0:
        return float("inf")
    return float(2.0 * moments[2] - total) / total


def half_axes(mass: float, inertia: Any) -> Array:
    """Half axes [m], largest first, (3,), of the uniform ellipsoid of this mass and inertia; zero for a point mass."""
    moments = np.linalg.eigvalsh(checked_array(inertia, (3, 3), "inertia"))
    spread = np.clip(0.5 * moments.sum() - moments, 0.0, None)
    return np.asarray(np.sqrt(5.0 * spread / mass))


def _symmetric(inertia: Any) -> Array:
    """The tensor, read-only and exactly symmetric; a symmetric one is returned without change of a bit."""
    tensor = checked_array(inertia, (3, 3), "inertia")
    if np.abs(tensor - tensor.T).max() > SYMMETRIC * np.abs(tensor).max():
        raise InputError(Fault("inertia", "must be symmetric", tensor.tolist()))
    return read_only(_mean(tensor))


def _mean(tensor: Array) -> Array:
    return np.asarray(0.5 * (tensor + tensor.T))


def _pose(pose_a_b: Any) -> Array:
    matrix = checked_array(pose_a_b, (4, 4), "pose_a_b")
    if not is_rotation(matrix[:3, :3]) or np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]).max() > SYMMETRIC:
        problem = "must be a pose: a rotation, a point, and a last row of 0 0 0 1"
        raise InputError(Fault("pose_a_b", problem, matrix.tolist()))
    return matrix


def _check_solid(sizes: dict[str, float]) -> None:
    faults = Faults()
    for name, value in sizes.items():
        number = faults.attempt(checked_array, value, (), name)
        if number is not None and number < 0.0:
            faults.add(name, f"must not be negative [{'kg' if name == 'mass' else 'm'}]", value)
    faults.raise_any()
