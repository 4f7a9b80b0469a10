"""Where the electrical power of a drive goes: what tests hold its torques and the judge's figures against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, MotorTorque, shaft_friction
from drivetrain.drive.friction import friction_torque
from drivetrain.drive.gear import DRAG_REFERENCE, drag_torque, mesh, mesh_loss_power
from drivetrain.drive.motor import current, terminal_voltage, winding_resistance


@dataclass(frozen=True, eq=False)
class PowerBalance:
    """Where the electrical power goes, each (N,) [W]; losses are never negative.

    Attributes:
        electrical: Into the terminals, inductance left out; negative when regenerating.
        copper: Loss in the winding.
        motor_friction: Loss at the motor shaft.
        drag: Loss of the gear at any load.
        mesh: Loss in the mesh.
        joint_friction: Loss at the gear's output shaft.
        output: To the link.
        rotor: To the rotor's motion against its stator.
    """

    electrical: Array
    copper: Array
    motor_friction: Array
    drag: Array
    mesh: Array
    joint_friction: Array
    output: Array
    rotor: Array

    @property
    def residual(self) -> Array:
        """Electrical power that none of the others accounts for: rounding only [W]."""
        lost = self.copper + self.motor_friction + self.drag + self.mesh + self.joint_friction
        return self.electrical - lost - self.output - self.rotor


def power_balance(
    drive: Drive,
    gear_torque: Array,
    speed: Array,
    torque: MotorTorque,
    winding_temperature: Array | float,
    magnet_temperature: float,
    *,
    gear_temperature: float = DRAG_REFERENCE,
) -> PowerBalance:
    """Where the electrical power of a motion goes."""
    motor, motor_speed, gear = drive.motor, drive.gear.ratio * np.asarray(speed), mesh(drive.gear)
    amperes = current(motor, torque.total, magnet_temperature)
    volts = terminal_voltage(motor, motor_speed, amperes, 0.0, winding_temperature, magnet_temperature)
    resistance = winding_resistance(motor, np.asarray(winding_temperature, dtype=np.float64))
    joint = friction_torque(drive.joint_friction, speed)
    load = gear_torque + joint
    return PowerBalance(
        electrical=volts * amperes,
        copper=resistance * amperes**2,
        motor_friction=friction_torque(shaft_friction(drive), motor_speed) * motor_speed,
        drag=np.asarray(drag_torque(gear, motor_speed, gear_temperature) * motor_speed),
        mesh=np.asarray(mesh_loss_power(gear, load, speed)),
        joint_friction=joint * speed,
        output=np.asarray(gear_torque * speed),
        rotor=torque.rotor * motor_speed,
    )
