"""Catalogue rows as the compiled judge takes them: one row of plain numbers a motor and a gear, NaN where unknown.

The laws are those of ``drive/``, asked once a row, with the study's assumptions filled in as ``Shelf`` fills them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear, mesh_factors, torque_exponent
from drivetrain.drive.motor import Motor, copper_coefficient
from drivetrain.drive.motor_limits import continuous_current, short_time_torque
from drivetrain.drive.thermal_network import thermal_network
from drivetrain.records import as_record
from drivetrain.sizing.judge.fill import DIRECT

# Columns of a motor's row at one joint.
(
    RESISTANCE, CONSTANT, INDUCTANCE, ROTOR, REFERENCE, COPPER, MAGNET, MAX_SPEED, PEAK_TORQUE, PEAK_CURRENT,
    CONTINUOUS, MAX_WINDING, INNER, OUTER, WINDING_CAPACITY, HOUSING_CAPACITY,
    COULOMB, COULOMB_BACK, VISCOUS, VISCOUS_BACK, STATIC, STRIBECK, SHAPE, MOTOR_COLUMNS,
) = range(24)  # fmt: skip

# Columns of a gear's row.
(
    RATIO, DRIVING, DRIVEN, NO_LOAD, INPUT_INERTIA, REPEATED, MOMENTARY, AVERAGE, EXPONENT, MAX_INPUT, MEAN_INPUT,
    RATED_LIFE, RATED_SPEED, RATED_TORQUE, TILTING, AXIAL, RADIAL, DIRECT_DRIVE, UNKNOWN, GEAR_COLUMNS,
) = range(20)  # fmt: skip


def motor_row(motor: Motor, ambient: float, housing_to_ambient: float | None, friction: Friction | None) -> Array:
    """A motor at a joint.

    Args:
        ambient: Air temperature [C].
        housing_to_ambient: Of the joint's mounting; None: the sheet's [K/W].
        friction: Of the joint's motor shaft; None: the sheet's.

    Returns:
        The columns above in SI, (MOTOR_COLUMNS,).
    """
    network = thermal_network(motor, ambient, housing_to_ambient=housing_to_ambient)
    shaft = shaft_friction(Drive(motor, DIRECT, motor_friction=friction))
    back = shaft.coulomb if shaft.coulomb_negative is None else shaft.coulomb_negative
    viscous_back = shaft.viscous if shaft.viscous_negative is None else shaft.viscous_negative
    thermal: tuple[float | None, ...] = (None,) * 4
    if network is not None:
        inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
        thermal = (inner, outer, network.winding_capacity, network.housing_capacity)
    columns = (
        motor.resistance, motor.torque_constant, motor.inductance or 0.0, motor.rotor_inertia,
        motor.reference_temperature, copper_coefficient(motor.reference_temperature), motor.magnet_coefficient,
        motor.max_speed, float(short_time_torque(as_record(motor))), motor.peak_current,
        continuous_current(motor, ambient, housing_to_ambient=housing_to_ambient).value,
        motor.max_winding_temperature, *thermal,
        shaft.coulomb, back, shaft.viscous, viscous_back, shaft.static, shaft.stribeck_speed, shaft.stribeck_exponent,
    )  # fmt: skip
    return _numbers(columns)


def gear_row(gear: Gear) -> Array:
    """A gear.

    Returns:
        The columns above in SI, (GEAR_COLUMNS,); lossless and UNKNOWN where the motor's torque cannot be computed.
    """
    ideal = gear.kind == "ideal"
    unknown = not ideal and (gear.efficiency is None or gear.inertia is None)
    computed = gear
    if gear.efficiency is None and not ideal:
        computed = replace(gear, efficiency=1.0, backdriving_efficiency=1.0)
    mesh = mesh_factors(computed)
    lasting = gear.continuous_torque
    columns = (
        gear.ratio, mesh.driving, mesh.driven, gear.no_load_torque or 0.0, gear.inertia or 0.0,
        lasting if gear.repeated_peak_torque is None else gear.repeated_peak_torque,
        gear.momentary_torque,
        lasting if gear.average_torque_limit is None else gear.average_torque_limit,
        torque_exponent(gear), gear.max_input_speed, gear.average_input_speed_limit,
        gear.rated_life, gear.rated_speed, lasting,
        gear.tilting_moment_limit, gear.axial_load_limit, gear.radial_load_limit,
        float(gear.key == ""), float(unknown),
    )  # fmt: skip
    return _numbers(columns)


def rows(parts: Sequence[Array], columns: int) -> Array:
    """Rows as one table.

    Args:
        parts: (columns,) each, in SI.

    Returns:
        (rows, columns).
    """
    return np.array(parts).reshape(-1, columns)


def _numbers(values: Sequence[float | None]) -> Array:
    return np.array([math.nan if value is None else value for value in values])
