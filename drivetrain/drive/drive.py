"""A drive: motor, gear and stated friction; the motor torque that a motion requires."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.friction import (
    FRICTIONLESS,
    Friction,
    breakaway_friction,
    direction,
    friction_curve,
    friction_torque,
    stronger,
)
from drivetrain.drive.gear import (
    DRAG_REFERENCE,
    Gear,
    drag_torque,
    mesh,
    mesh_loss_coefficient,
    mesh_slope,
    mesh_torque,
)
from drivetrain.drive.motor import (
    Motor,
    no_load_friction,
    torque_constant,
)
from drivetrain.jit import law
from drivetrain.records import known_or

STANDSTILL = 1e-9  # share of the largest speed below which a sample is at rest: rounding, not creep


@dataclass(frozen=True)
class Drive:
    """Motor and gear of one joint, with friction that neither data sheet gives.

    Attributes:
        motor: Data sheet; values that a check needs are either filled by a stated assumption or None.
        gear: A direct drive has a gear of kind ``ideal`` with ratio 1 and efficiency 1.
        joint_friction: At the gear's output shaft, outside the mesh (joint bearings, seals, cables).
        motor_friction: Friction at the motor shaft, which replaces that of the motor's no-load data; None: from the
            data sheet.
        assumptions: Remarks on the values that were assumed for lack of data, with the source of each assumption.
    """

    motor: Motor
    gear: Gear
    joint_friction: Friction = FRICTIONLESS
    motor_friction: Friction | None = None
    assumptions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.gear.load_friction != self.joint_friction.load_share:
            object.__setattr__(self, "gear", replace(self.gear, load_friction=self.joint_friction.load_share))


@dataclass(frozen=True, eq=False)
class MotorTorque:
    """Electromagnetic torque that a motion requires of the motor, and its components, each (N,) [N m].

    Attributes:
        total: Sum of mesh, rotor and friction torque. At rest it is that of ``Gear.holding``; where the joint starts or
            stops, it is that of the motion.
        mesh: Torque through the mesh for load and joint friction, mesh loss included.
        rotor: Torque that accelerates rotor and gear input; it does not cross the mesh.
        friction: Torque for motor friction and gear drag; 0 at rest.
        starting: Torque for peak checks: ``total`` while moving; at rest the breakaway torque against the load or in
            the direction of the next motion, or ``total`` where that is larger.
    """

    total: Array
    mesh: Array
    rotor: Array
    friction: Array
    starting: Array


def shaft_friction(drive: Drive) -> Friction:
    """Friction at the motor shaft [N m]: as stated for the drive, else from the motor's no-load data."""
    if drive.motor_friction is not None:
        return drive.motor_friction
    return no_load_friction(drive.motor) or FRICTIONLESS


@law
def drive_inertia(drive: Any) -> Any:
    """Inertia at the motor shaft: rotor and gear input [kg m^2]; an unknown one counts as 0."""
    return known_or(drive.motor.rotor_inertia, 0.0) + known_or(drive.gear.inertia, 0.0)


def unstaged_inertia(drive: Drive) -> float:
    """Inertia at the motor shaft without the stages behind the gear [kg m^2]; the gear's ratio reduces theirs as it
    does the load's.
    """
    return drive_inertia(drive) - (0.0 if drive.gear.inertia is None else drive.gear.stage_inertia)


WITH_SIZE = {
    "rotor_inertia", "mass", "no_load_current", "coulomb_friction", "viscous_friction", "nominal_current",
    "nominal_torque", "stall_torque", "stall_current", "peak_current", "peak_torque", "price", "friction_allowance",
    "no_load_torque", "drag_torque", "seal_drag_torque", "starting_torque", "inertia", "continuous_torque",
    "average_torque_limit", "repeated_peak_torque", "momentary_torque", "ratcheting_torque", "buckling_torque",
    "stiffness_1", "stiffness_2", "stiffness_3", "torque_1", "torque_2", "stage_inertia", "stage_torque", "coulomb",
    "coulomb_negative", "viscous", "viscous_negative", "static", "static_torque", "power", "current",
    "energy_per_stop", "energy_per_hour", "continuous_current", "standby_power", "stiffness",
    "gas_force", "torque", "stage_mass", "stage_sprung",
}  # fmt: skip
"""Fields whose value doubles when two parts work in parallel, of motors, gears, brakes, amplifiers, frictions or
counterbalances.
"""
AGAINST_SIZE = {
    "resistance", "inductance", "inductance_allowance", "resistance_winding_housing", "resistance_housing_ambient",
    "resistance_winding_ambient", "on_resistance",
}  # fmt: skip
"""Fields whose value is halved: electrical and thermal resistances in parallel."""


def times_as_large(part: Any, times: float) -> Any:
    """Several equal parts that work in parallel with the same motion, as one part; speeds, voltages, lengths stay."""
    return with_scaled(part, dict.fromkeys(WITH_SIZE, times) | dict.fromkeys(AGAINST_SIZE, 1.0 / times))


def with_scaled(part: Any, scale: Mapping[str, float]) -> Any:
    """A part whose fields are multiplied by factors, by name; unknown values stay unknown."""
    named = [(one.name, getattr(part, one.name)) for one in fields(part) if one.name in scale]
    return replace(part, **{name: scale[name] * value for name, value in named if value is not None})


@law
def rotor_torque(inertia: Any, ratio: Any, acceleration: Any, carrier_acceleration: Any) -> Any:
    """J (G a + a_carrier) [N m]; it does not cross the mesh. Modern Robotics, equation 8.111."""
    return inertia * (ratio * acceleration + carrier_acceleration)


@law
def breakaway_motor_torque(mesh: Any, shaft: Any, joint: Any, gear_torque: Any, sign: Any) -> Any:
    """Motor torque that breaks a resting joint loose in the direction ``sign``, whether its load is against that or
    with it [N m]; the rotor's acceleration is not included.
    """
    turning = direction(mesh.ratio) * sign
    pushed = gear_torque + breakaway_friction(joint, sign)
    return mesh_slope(mesh, pushed * sign) * pushed + breakaway_friction(shaft, turning) + mesh.starting * turning


@law
def starting_torque(mesh: Any, shaft: Any, joint: Any, gear_torque: Any, rotor: Any, ahead: Any) -> Any:
    """The larger of the motor torques that break a resting joint loose against its load, and in the direction
    ``ahead`` in which it moves next [N m]: friction of that direction may be larger. ``rotor``: torque that accelerates
    the rotor.
    """
    against = breakaway_motor_torque(mesh, shaft, joint, gear_torque, direction(gear_torque)) + rotor
    return stronger(against, breakaway_motor_torque(mesh, shaft, joint, gear_torque, direction(ahead)) + rotor)


def motor_torque(
    drive: Drive,
    gear_torque: Array,
    speed: Array,
    acceleration: Array,
    carrier_acceleration: Array,
    *,
    standstill: Array | None = None,
    parts: Sequence[slice] = (),
    gear_temperature: float = DRAG_REFERENCE,
) -> MotorTorque:
    """The motor torque that a motion requires: mesh loss by direction of power, rotor acceleration outside the mesh.

    Args:
        drive: Motor, gear and frictions.
        gear_torque: Torque at the gear's output on the link, without joint friction [N m], (N,), in order of time.
        speed: Speed of the gear's output [rad/s], (N,).
        acceleration: Acceleration of the gear's output [rad/s^2], (N,).
        carrier_acceleration: Angular acceleration of the stator's link along the rotor's axis [rad/s^2], (N,).
        standstill: True where the joint is at rest, (N,); None: where the speed is zero to rounding of the largest
            speed.
        parts: Slices of the samples that each repeat on their own; empty: all samples form one cycle.
        gear_temperature: Gear temperature at which its drag is evaluated [C].

    Returns:
        The torque and its parts.

    Raises:
        InputError: The gear's loss is unknown and the gear is not ``ideal``.

    Reference:
        Lynch and Park, Modern Robotics (2017), equation 8.111, with losses on the power that crosses the mesh only.
    """
    at_rest = resting(speed) if standstill is None else standstill
    speed, gear = loss_speed(speed, acceleration, at_rest, parts=parts), mesh(drive.gear)
    through = np.asarray(mesh_torque(gear, gear_torque + friction_torque(drive.joint_friction, speed), speed))
    rotor = np.asarray(rotor_torque(drive_inertia(drive), gear.ratio, acceleration, carrier_acceleration))
    friction = friction_torque(shaft_friction(drive), gear.ratio * speed)
    friction = np.asarray(friction + drag_torque(gear, gear.ratio * speed, gear_temperature))
    total = through + rotor + friction
    shaft, joint = friction_curve(shaft_friction(drive)), friction_curve(drive.joint_friction)
    starting = starting_torque(gear, shaft, joint, gear_torque, rotor, rolled(speed, -1, parts))
    stronger = np.logical_and(at_rest, np.abs(starting) > np.abs(total))
    return MotorTorque(total, through, rotor, friction, np.where(stronger, starting, total))


def resting(speed: Array) -> Array:
    """Samples at which a motion is at rest, up to rounding of the largest speed."""
    magnitude = np.abs(speed)
    return np.asarray(magnitude <= STANDSTILL * np.max(magnitude, initial=0.0))


def rolled(values: Array, places: int, parts: Sequence[slice] = ()) -> Array:
    """Values shifted cyclically by some samples; with ``parts`` each part is a cycle of its own."""
    if len(parts) <= 1:
        return np.roll(values, places)
    return np.concatenate([np.roll(values[part], places) for part in parts])


def loss_speed(speed: Array, acceleration: Array, at_rest: Array, *, parts: Sequence[slice] = ()) -> Array:
    """The speed whose sign determines the losses.

    Where a motion starts or ends it is a negligible speed in the direction of that motion: a joint that accelerates
    from rest already works against mesh loss and friction, and a torque without them would not move it.
    """
    tiny = STANDSTILL * float(np.max(np.abs(speed), initial=0.0))
    way = np.where(at_rest, 0.0, np.sign(speed))
    after, before, push = rolled(way, -1, parts), rolled(way, 1, parts), np.sign(acceleration)
    sets_off, stops = (push != 0.0) & (after == push), (push != 0.0) & (before == -push)
    return np.where(at_rest, tiny * np.where(sets_off, after, np.where(stops, before, 0.0)), speed)


def book_current(
    drive: Drive, gear_torque: Array, acceleration: Array, carrier_acceleration: Array, magnet_temperature: float
) -> Array:
    """The current of the book's formula, for comparison only: it divides by the efficiency regardless of the direction
    of power.

    It has two errors that do not cancel: power from the load should be multiplied by the efficiency, and the torque
    that accelerates the rotor does not cross the mesh.

    Args:
        drive: Motor and gear; friction is not in the formula.
        gear_torque: At the gear's output [N m], (N,).
        acceleration: Acceleration of the gear's output [rad/s^2], (N,).
        carrier_acceleration: Angular acceleration of the stator's link along the rotor's axis [rad/s^2], (N,).
        magnet_temperature: [C].

    Returns:
        tau_motor / (eta k_t) [A], (N,).

    Raises:
        InputError: The gear's loss is unknown and the gear is not ``ideal``.

    Reference:
        Lynch and Park, Modern Robotics (2017), section 8.9.2, I_com, with tau_motor of equation 8.111.
    """
    rotor = rotor_torque(drive_inertia(drive), drive.gear.ratio, acceleration, carrier_acceleration)
    lossless = np.asarray(gear_torque / drive.gear.ratio + rotor)
    efficiency = 1.0 / (1.0 + mesh_loss_coefficient(drive.gear))
    return lossless / (efficiency * torque_constant(drive.motor, magnet_temperature))
