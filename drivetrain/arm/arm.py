"""The arm as data: a serial chain of rigid links on screw joints, perhaps with rotors.

All frames are given in the base frame with every joint at zero, as in Modern Robotics chapter 8; twists and
screws are (angular, linear).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.arrays import Array, frozen_array
from drivetrain.errors import Fault, InputError

STANDARD_GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, the book's rounding, and pinocchio's and MuJoCo's


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm of n links; build one with ``from_screws``, ``load_arm`` or ``with_rotors``.

    Attributes:
        home: Centre-of-mass frames of the links, base frame, all joints zero, (n, 4, 4).
        screws: Joint screw axes, base frame, all joints zero, (n, 6), (angular, linear). A unit angular part is a
            revolute (or helical) joint [rad], a zero one with a unit linear part a prismatic joint [m].
        masses: [kg], (n,).
        inertias: About the centre of mass, in the home frame [kg m^2], (n, 3, 3).
        tip: End-effector frame, fixed to the last link, base frame, all joints zero, (4, 4).
        gravity: Acceleration of free fall in the base frame [m/s^2], (3,).
        joint_points: A point on each joint axis where the joint sits, base frame, all joints zero [m], (n, 3);
            drives and rotors are mounted there.
        joint_names, link_names: (n,) each.
        lower, upper: Position limits [rad or m], (n,); infinite where unknown.
        speed_limits: [rad/s or m/s], (n,); infinite where unknown.
        rotors: One rotor (or None, direct drive) a joint, (n,).
        level: How much of the rotors' motion is counted.
        name: What to call the arm.
        notes: What the reader of a report should know: ignored tags, doubtful numbers.
    """

    home: Array
    screws: Array
    masses: Array
    inertias: Array
    tip: Array
    gravity: Array
    joint_points: Array
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    lower: Array
    upper: Array
    speed_limits: Array
    rotors: tuple[Rotor | None, ...]
    level: RotorLevel = RotorLevel.FULL
    name: str = "arm"
    notes: tuple[str, ...] = field(default=())

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.masses)
