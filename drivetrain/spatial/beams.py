"""Slender beams: rotation and displacement of their ends under bending, torsion and axial load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_number, checked_numbers, frozen_array
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.rotations import frame_along
from drivetrain.spatial.wrenches import same_batches

# Gauss points and weights on 0 to 1: exact for the integrals here, cubic moments times a linear lever arm.
_POINTS = 0.5 + 0.5 * math.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


@dataclass(frozen=True)
class Section:
    """Stiffness of the cross-section of a beam; z is along the beam."""

    # against bending about x and about y, E I [N m^2]
    bending_x: float
    bending_y: float
    torsion: float  # against twisting about z, G J [N m^2]
    axial: float  # against stretching, E A [N]

    def __post_init__(self) -> None:
        units = {"bending_x": "N m^2", "bending_y": "N m^2", "torsion": "N m^2", "axial": "N"}
        checked_numbers({f"section.{name}": (getattr(self, name), unit) for name, unit in units.items()}, above=0.0)


@dataclass(frozen=True, eq=False)
class Beam:
    """A straight beam between two points.

    Attributes:
        section: Constant along the beam.
        start, end: Its ends, in the frame in which the beam is given [m], (3,).
        side: Direction of the section's x axis, which is made perpendicular to the beam [-], (3,); None: the frame's
            axes are rotated by the smallest angle that takes z along the beam.
    """

    section: Section
    start: Array
    end: Array
    side: Array | None = None

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (3,), f"beam.{name}"))
        if self.length == 0.0:
            raise InputError(Fault("beam.end", "must differ from its start", self.end.tolist()))
        if self.side is not None:
            object.__setattr__(self, "side", frozen_array(self.side, (3,), "beam.side"))
            across = np.cross(self.side, self.end - self.start)
            if np.linalg.norm(across) < 1e-9 * np.linalg.norm(self.side) * self.length or not np.any(self.side):
                problem = "must point away from the beam's own direction"
                raise InputError(Fault("beam.side", problem, self.side.tolist()))

    @property
    def length(self) -> float:
        """Distance of the ends [m]."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def axes(self) -> Array:
        """Rotation matrix whose columns are the section's axes, z along the beam [-], (3, 3)."""
        along = (self.end - self.start) / self.length
        if self.side is None:
            return frame_along(along)
        across = np.cross(along, self.side)
        across /= np.linalg.norm(across)
        return np.column_stack([np.cross(across, along), across, along])


def round_tube(outer: float, inner: float, youngs_modulus: float, shear_modulus: float) -> Section:
    """The section of a round tube, or of a round bar if the inner diameter is zero.

    Args:
        outer, inner: Diameters [m].
        youngs_modulus, shear_modulus: Of the material [Pa].

    Returns:
        The section.

    Raises:
        InputError: Values that are not positive numbers, or an inner diameter that is negative or not smaller.
    """
    place = "round_tube"
    checked_numbers({f"{place}.outer": (outer, "m"), **_moduli(place, youngs_modulus, shear_modulus)}, above=0.0)
    checked_number(inner, f"{place}.inner", "m", least=0.0)
    if not 0.0 <= inner < outer:
        raise InputError(Fault("round_tube.inner", f"must lie between 0 and the outer diameter {outer:g} m", inner))
    second = math.pi / 64.0 * (outer**4 - inner**4)
    area = math.pi / 4.0 * (outer**2 - inner**2)
    bending = youngs_modulus * second
    return Section(bending, bending, 2.0 * shear_modulus * second, youngs_modulus * area)


def box_tube(width: float, height: float, wall: float, youngs_modulus: float, shear_modulus: float) -> Section:
    """The section of a rectangular tube with a thin wall of constant thickness.

    Args:
        width, height: Outer dimensions along x and y [m].
        wall: Thickness [m].
        youngs_modulus, shear_modulus: Of the material [Pa].

    Returns:
        The section.

    Raises:
        InputError: Values that are not positive numbers, or a wall that is not thinner than half the smaller side.

    Reference:
        Torsion by Bredt's second formula for thin closed walls, 4 A^2 t / perimeter of the middle line.
    """
    place, sizes = "box_tube", {"width": width, "height": height, "wall": wall}
    named = {f"{place}.{name}": (value, "m") for name, value in sizes.items()}
    checked_numbers({**named, **_moduli(place, youngs_modulus, shear_modulus)}, above=0.0)
    if not 0.0 < wall < 0.5 * min(width, height):
        raise InputError(Fault("box_tube.wall", "must lie between 0 and half the smaller side", wall))
    inside = (width - 2.0 * wall, height - 2.0 * wall)
    about_x = (width * height**3 - inside[0] * inside[1] ** 3) / 12.0
    about_y = (height * width**3 - inside[1] * inside[0] ** 3) / 12.0
    middle = (width - wall, height - wall)
    torsion = 2.0 * (middle[0] * middle[1]) ** 2 * wall / (middle[0] + middle[1])
    area = width * height - inside[0] * inside[1]
    return Section(youngs_modulus * about_x, youngs_modulus * about_y, shear_modulus * torsion, youngs_modulus * area)


def _moduli(place: str, youngs: Any, shear: Any) -> dict[str, tuple[Any, str]]:
    return {f"{place}.youngs_modulus": (youngs, "Pa"), f"{place}.shear_modulus": (shear, "Pa")}


def beam_compliance(section: Section, length: float) -> Array:
    """The matrix from a wrench on the free end of a clamped beam to its (rotation, displacement), axes of the section.

    Euler-Bernoulli cantilever: f L^3/(3 E I), f L^2/(2 E I), m L/(E I), and m L/(G J), f L/(E A); without shear.
    """
    checked_number(length, "length", "m", above=0.0)
    result = np.diag([
        length / section.bending_x, length / section.bending_y, length / section.torsion,
        length**3 / (3.0 * section.bending_y), length**3 / (3.0 * section.bending_x), length / section.axial,
    ])  # fmt: skip
    # A rotation about +x moves z towards -y, one about +y moves it towards +x.
    result[0, 4] = result[4, 0] = -(length**2) / (2.0 * section.bending_x)
    result[1, 3] = result[3, 1] = length**2 / (2.0 * section.bending_y)
    return result


def end_deflection(section: Section, length: float, start_wrench: Any, end_wrench: Any) -> Array:
    """Rotation and displacement of the end of a beam relative to its start, from the wrenches at both ends.

    The difference of the two wrenches is the load of the beam itself, its weight and inertia. It is assumed to be
    distributed linearly along the beam, so that the bending moment is the cubic with the moments and shear forces of
    both ends; for axial load and torsion it is distributed uniformly. This is exact for a beam of uniform mass. For a
    point mass at the end that is counted as the beam's own load, the deflection is 10 % too small.

    Args:
        section: Constant along the beam.
        length: [m].
        start_wrench, end_wrench: Wrench that the section at the start, or at the end, exerts on what follows it
            (moment about that section [N m], force [N]), axes of the section, z along the beam; (6,) or (N, 6), both
            of the same shape. For a weight P (a force vector) attached to the end, the force of ``end_wrench`` is -P.

    Returns:
        (rotation [rad], displacement [m]) of the end, same axes, (6,) or (N, 6).

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or a length that is not positive.
    """
    length = checked_number(length, "length", "m", above=0.0)
    first, last = same_batches(start_wrench=start_wrench, end_wrench=end_wrench)
    result = np.zeros_like(first)
    for s, weight in zip(_POINTS, _WEIGHTS, strict=True):
        moment, axial = _section_load(first, last, length, float(s))
        # The load on the end is the opposite of the wrench that the end exerts.
        turn = -weight * length * moment / np.array([section.bending_x, section.bending_y, section.torsion])
        lever = (1.0 - s) * length
        result[:, :3] += turn
        result[:, 3] += turn[:, 1] * lever
        result[:, 4] -= turn[:, 0] * lever
        result[:, 5] -= weight * length * axial / section.axial
    return result if np.ndim(start_wrench) == 2 else result[0]


def _section_load(first: Array, last: Array, length: float, s: float) -> tuple[Array, Array]:
    """Moment about the section at share ``s`` of the length, and axial force through it."""
    moment = first[:, :3] + s * (last[:, :3] - first[:, :3])
    # Equilibrium of a slice: the derivative along z of the moment about x is the force along y, that of the moment
    # about y is minus the force along x.
    slopes = [length * np.column_stack([w[:, 4], -w[:, 3]]) for w in (first, last)]
    ends = [w[:, :2] for w in (first, last)]
    moment[:, :2] = (
        (1.0 + 2.0 * s) * (1.0 - s) ** 2 * ends[0] + s**2 * (3.0 - 2.0 * s) * ends[1]
        + s * (1.0 - s) ** 2 * slopes[0] - s**2 * (1.0 - s) * slopes[1]
    )  # fmt: skip
    return moment, first[:, 5] + s * (last[:, 5] - first[:, 5])
