"""Rotors as bodies: the part that spins at the input of a gear, and the link that carries it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from drivetrain.arm.checks import TOLERANCE, checked_inertia, checked_pose, checked_screw
from drivetrain.arrays import Array, axes_of, checked_number, read_only
from drivetrain.errors import Fault, Faults, InputError
from drivetrain.spatial.inertia import RigidBody


class RotorLevel(StrEnum):
    """Which parts of the rotors' motion the dynamics includes.

    NONE: rotors are locked to their carriers. REFLECTED: as NONE, plus ``ratio^2 * axial inertia`` on the diagonal of
    the mass matrix, the usual approximation. FULL: rotors are bodies (Modern Robotics, equations 8.103 to 8.111).
    """

    NONE = "none"
    REFLECTED = "reflected"
    FULL = "full"


@dataclass(frozen=True, eq=False)
class Rotor:
    """The rotor of one joint's motor, which spins relative to the link that carries the stator.

    Attributes:
        ratio: Rotor turns per turn of the joint [-], or rotor angle over travel of a prismatic joint [rad/m]; negative
            if the rotor turns about ``screw`` opposite to the joint. With coupled motors (``coupling.py``), the ratio
            to the shaft behind the gear instead of the joint.
        inertia: Scalar about the spin axis [kg m^2] (the transverse inertia then belongs to the carrier), or the full
            tensor about the centre of mass in the rotor frame, (3, 3).
        mass: Mass [kg]; 0 if the mass of the carrier includes it.
        home: Frame at the centre of mass, base frame, all joints zero, (4, 4). None: z along the spin axis; x and y
            are those of the base, rotated by the shortest rotation that takes the base's z to the spin axis; the origin
            is the point of the spin axis nearest to the joint.
        screw: Spin axis, base frame, all joints zero, (6,), (angular [-], linear [m]). None: the joint's axis; for a
            prismatic joint, the line along its direction through the joint's point.
        carrier: Index of the link that holds the stator; -1 is the base. None: the link before the joint.
    """

    ratio: float
    inertia: float | Array
    mass: float = 0.0
    home: Array | None = None
    screw: Array | None = None
    carrier: int | None = None

    def __post_init__(self) -> None:
        faults = Faults()
        checked = {
            "ratio": faults.attempt(_ratio, self.ratio),
            "inertia": faults.attempt(_inertia, self.inertia),
            "mass": faults.attempt(_not_negative, self.mass, "mass", "kg"),
            "home": None if self.home is None else faults.attempt(checked_pose, self.home, "home"),
            "screw": None if self.screw is None else faults.attempt(_spin_axis, self.screw),
            "carrier": faults.attempt(_carrier, self.carrier),
        }
        faults.raise_any()
        for name, value in checked.items():
            object.__setattr__(self, name, read_only(value) if isinstance(value, np.ndarray) else value)


@dataclass(frozen=True, eq=False)
class MountedRotor(Rotor):
    """A rotor on an arm with all defaults resolved; made by ``with_rotors``."""

    ratio: float  # as in Rotor [- or rad/m]
    inertia: Array  # tensor about the centre of mass in the rotor frame [kg m^2], (3, 3)
    mass: float  # [kg]
    home: Array  # frame at the centre of mass, base frame, all joints zero, (4, 4)
    screw: Array  # spin axis, base frame, all joints zero, (6,)
    carrier: int  # index of the link that holds the stator; -1 is the base

    def __post_init__(self) -> None:
        # no checks: with_rotors makes these from a checked Rotor, and checking again would take longer than mounting
        for array in (self.inertia, self.home, self.screw):
            read_only(array)

    @property
    def body(self) -> RigidBody:
        """The rotor as a body in the base frame, all joints at zero."""
        turn = self.home[:3, :3]
        return RigidBody(self.mass, self.home[:3, 3], turn @ self.inertia @ turn.T)

    @property
    def axial_inertia(self) -> float:
        """Inertia about the spin axis [kg m^2], including the offset of an unbalanced rotor's centre of mass."""
        axis = self.home[:3, :3].T @ self.screw[:3]
        offset = self.home[:3, 3] - np.cross(self.screw[:3], self.screw[3:])
        arm = np.cross(self.screw[:3], offset)
        return float(axis @ self.inertia @ axis + self.mass * (arm @ arm))


def _ratio(value: float) -> float:
    ratio = checked_number(value, "ratio", "-")
    if ratio == 0.0:
        raise InputError(Fault("ratio", "must not be zero", value, "a direct drive has None for a rotor, or ratio 1"))
    return ratio


def _not_negative(value: object, name: str, unit: str) -> float:
    number = checked_number(value, name, unit)
    if number < 0.0:
        raise InputError(Fault(name, f"must not be negative [{unit}]", number))
    return number


def _inertia(value: float | Array) -> float | Array:
    if axes_of(value) == 0:
        return _not_negative(value, "inertia", "kg m^2")
    if axes_of(value) != 2 or np.shape(value) != (3, 3):
        problem = "must be a number (about the spin axis) or a (3, 3) tensor [kg m^2]"
        raise InputError(Fault("inertia", problem, value))
    return checked_inertia(value, "inertia")


def _spin_axis(value: object) -> Array:
    screw = checked_screw(value, "screw")
    pitch = float(screw[:3] @ screw[3:])
    if not screw[:3].any() or abs(pitch) > TOLERANCE * max(1.0, float(np.linalg.norm(screw[3:]))):
        raise InputError(Fault("screw", "must be a pure rotation: unit angular part, zero pitch", screw.tolist()))
    screw[3:] -= pitch * screw[:3]
    return screw


def _carrier(value: object) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < -1:
        raise InputError(Fault("carrier", "must be the index of a link, or -1 for the base", value))
    return int(value)
