"""Checks of the data of an arm: each reports all faults that it finds and corrects deviations due to rounding.

Warnings are given for inertias that no body can have, and for those that are implausible for the size of the link.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.errors import Fault, Faults, InputError, PhysicsWarning, raise_faults
from drivetrain.spatial.inertia import RigidBody, half_axes, triangle_excess
from drivetrain.spatial.rotations import is_rotation, nearest_rotation

TOLERANCE = 1e-6  # of unit axes and orthogonal frames, which files give to six digits; they are then normalised
TRIANGLE_TOLERANCE = 1e-4  # of the triangle inequality: files give four digits

T = TypeVar("T")


def checked_pose(value: Any, name: str) -> Array:
    """A pose, (4, 4), whose rotation is orthogonal to the digits of a file; it is made exactly orthogonal."""
    matrix = checked_array(value, (4, 4), name)
    faults = []
    if not is_rotation(matrix[:3, :3], TOLERANCE):
        faults.append(Fault(name, "its rotation must be orthogonal with determinant +1", matrix[:3, :3].tolist()))
    if np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]).max() > TOLERANCE:
        faults.append(Fault(name, "its last row must be 0 0 0 1", matrix[3].tolist()))
    raise_faults(faults)
    result = matrix.copy()
    result[3] = [0.0, 0.0, 0.0, 1.0]
    if not is_rotation(matrix[:3, :3], 1e-14):
        result[:3, :3] = nearest_rotation(matrix[:3, :3])
    return result


def checked_screw(value: Any, name: str) -> Array:
    """A screw axis, (6,), normalised to exact unit length."""
    screw = checked_array(value, (6,), name)
    angular, linear = float(np.linalg.norm(screw[:3])), float(np.linalg.norm(screw[3:]))
    if abs(angular - 1.0) <= TOLERANCE:
        # Dividing the whole screw keeps the axis where it is.
        return screw / angular
    if angular <= TOLERANCE and abs(linear - 1.0) <= TOLERANCE:
        return np.concatenate([np.zeros(3), screw[3:] / linear])
    problem = "must be a unit screw (angular, linear): angular part of length 1, or angular part 0 and linear part 1"
    raise InputError(Fault(name, problem, screw.tolist(), f"lengths are {angular:.6g} and {linear:.6g}"))


def checked_inertia(value: Any, name: str) -> Array:
    """An inertia tensor, (3, 3), made exactly symmetric; negative moments by rounding become zero."""
    tensor = checked_array(value, (3, 3), name)
    rounding = TOLERANCE * max(float(np.abs(tensor).max()), 1e-12)
    if np.abs(tensor - tensor.T).max() > rounding:
        raise InputError(Fault(name, "must be symmetric", tensor.tolist()))
    if (np.diag(tensor) < -rounding).any():
        raise InputError(Fault(name, "must have no negative moment on its diagonal [kg m^2]", tensor.tolist()))
    tensor = 0.5 * (tensor + tensor.T)
    np.fill_diagonal(tensor, np.maximum(np.diag(tensor), 0.0))
    return tensor


def each(values: Sequence[Any], check: Callable[[Any, str], Array], name: str, faults: Faults) -> Array:
    checked = [faults.attempt(check, value, f"{name}[{i}]") for i, value in enumerate(values)]
    return np.array([value for value in checked if value is not None])


def called(link: str) -> str:
    """Name of a link in a sentence: "link forearm", but not "link link_1"."""
    return link if link.lower().startswith("link") else f"link {link}"


def triangle_warning(inertia: Array, link: str) -> str:
    if triangle_excess(inertia) <= TRIANGLE_TOLERANCE:
        return ""
    moments = ", ".join(f"{moment:.6g}" for moment in np.linalg.eigvalsh(inertia))
    rule = "the largest may not exceed the sum of the two others"
    return f"{called(link)}: no body has principal moments {moments} kg m^2: {rule}"


def warn_of_inertias(inertias: Array, links: Sequence[str]) -> list[str]:
    found = [triangle_warning(tensor, link) for tensor, link in zip(inertias, links, strict=True)]
    texts = [warning for warning in found if warning]
    warn_each(texts)
    return texts


def warn_each(texts: Sequence[str]) -> None:
    """Give a warning for each text, located at the caller of the package."""
    for text in texts:
        warnings.warn(text, PhysicsWarning, stacklevel=_frames_inside())


def _frames_inside() -> int:
    """The ``stacklevel`` of a warning that shall point to the line outside the package that called it."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).split(".")[0] == __name__.split(".")[0]:
        frame, level = frame.f_back, level + 1
    return level


REACH_FACTOR = 2.0  # radius of gyration over size of the link; covers and coincident joints make it larger than 1
DENSITY = 20.0  # kg/m^3: packing foam; links of correct arm files are above 50, the faulty UR5 wrists at 1 and 8
THINNEST = 0.1  # smallest over largest half axis: thin plates and rods count as this thick


def implausible(name: str, body: RigidBody, points: Sequence[Array]) -> list[str]:
    """Warnings about an implausible mass or inertia of a link; ``points`` are the joints at it, in its frame [m].

    There are two tests. The first is the triangle inequality of the principal moments. The second finds links that are
    much wider than the distances between their joints and their centre of mass, and also lighter than foam of this
    size. They usually result from a radius or unit that is wrong by a factor of ten, or from a placeholder of 1 kg m^2.
    Either property alone has harmless causes (thin links, joints drawn at one point, large covers).
    """
    if body.mass <= 0.0:
        return []
    found = [warning for warning in [triangle_warning(body.inertia, name)] if warning]
    all_points = np.array([*points, body.com])
    size = float(np.linalg.norm(all_points[:, np.newaxis] - all_points, axis=2).max())
    largest = float(np.linalg.eigvalsh(body.inertia)[2])
    gyration = float(np.sqrt(max(largest, 0.0) / body.mass))
    density = mean_density(body)
    if gyration > REACH_FACTOR * size and density < DENSITY:
        found.append(
            f"{called(name)}: {largest:.4g} kg m^2 with {body.mass:.4g} kg is a radius of gyration of {gyration:.3g} m"
            f", but its joints and centre of mass lie within {size:.3g} m, and a body so wide would have a density of "
            f"{density:.2g} kg/m^3: check its inertia"
        )
    return found


def mean_density(body: RigidBody) -> float:
    """Density of the uniform ellipsoid with a body's mass and inertia [kg/m^3]; infinite for a point mass."""
    axes = half_axes(body.mass, body.inertia)
    volume = 4.0 / 3.0 * np.pi * float(np.prod(np.maximum(axes, THINNEST * axes[0])))
    return body.mass / volume if volume > 0.0 else float("inf")


LENGTH = 10.0  # [m] largest plausible length of a link; also a travel per turn far above any rack and pinion
FAR = 3.0  # [m] largest plausible distance of a centre of mass from its joint or from the tip, for arms of less reach
NEAR = 1.0  # [m] distance of a centre of mass that never gives a warning, however short the arm
REACHES = 10.0  # distance of a centre of mass over the reach of the arm at which a warning is given


def farthest(reach: float) -> float:
    """Largest plausible distance of a centre of mass from the joint or tip that holds its body [m]."""
    return min(max(FAR, reach), max(REACHES * reach, NEAR))


def millimetres(value: float) -> str:
    return f"was {value:.4g} mm meant?"
