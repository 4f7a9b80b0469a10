"""A drive: a motor, its gear, and the friction that neither sheet holds."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor


@dataclass(frozen=True)
class Drive:
    """What moves one joint.

    Attributes:
        motor: With every unknown that a check needs either filled by a stated assumption or left None.
        gear: A direct drive has a gear of kind ``ideal`` with ratio 1 and efficiency 1.
        joint_friction: At the gear's output shaft, outside the mesh (joint bearings, seals, cables).
        motor_friction: At the motor shaft, replacing what the motor's no-load data imply; None: from the sheet.
        assumptions: What was assumed where a sheet was silent, in words, with the source of the assumption.
    """

    motor: Motor
    gear: Gear
    joint_friction: Friction = Friction()
    motor_friction: Friction | None = None
    assumptions: tuple[str, ...] = ()
