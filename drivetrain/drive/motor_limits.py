"""Limits of a motor: continuous current, peak torque, operating region in torque and speed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array, checked_number, checked_numbers
from drivetrain.drive.amplifier import Amplifier, available_voltage
from drivetrain.drive.motor import Motor, has_friction_data, torque_constant, winding_resistance
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law
from drivetrain.records import UNKNOWN, as_record, known, known_or

SHEET_AMBIENT = 25.0  # ambient temperature at which makers print continuous values [C]

# Assumed if a data sheet gives no value: a little above the largest of the shipped rows that give one. No-load over
# continuous current is 1.5 to 13.2 % in 116 motors with a housing; L/R is 3 us to 1.77 ms in those, and up to 6.97 ms
# in 31 frameless ones, whose friction is that of the joint's bearings.
FRICTION_SHARE = 0.14
LAG, FRAMELESS_LAG = 2e-3, 7e-3  # s
# Slightly below the smallest maximum speed of the shipped motors that print one: 0.929 to 4.3 times the no-load speed,
# 0.922 to 4.2 times the speed at which kt w is the nominal voltage, and 5000 rpm, in 116 motors.
SPEED_SHARE, SLOWEST_MOTOR = 0.92, 5000.0 * math.pi / 30.0  # -, rad/s
# Shortest winding time constant: 3.6 to 87 s per square root of a kilogram in the 71 motors that print it, whose
# windings are rated for 85 to 155 C. Share of the winding-to-housing resistance in the sum: 12 to 54 % in 56 motors
# that print both. Thermal resistance from winding to ambient of 145 motors: 0.8 to 5.1 K/W kg^(2/3).
QUICKEST_WINDING, LIGHTEST, WARMEST, WINDING_SHARE = 3.5, 0.03, 155.0, 0.55  # s/kg^(1/2), kg, C, -
LEAST_LIMIT, POOREST_PATH = 84.0, 5.2  # C, K/W kg^(2/3)
# Printed continuous current, which includes iron loss, over that of copper loss alone: 0.586 to 1.01 in 103 motors.
NOMINAL_SHARE = 0.58


class SourcedValue(NamedTuple):
    """A value and its source.

    Attributes:
        value: Value in SI; None if the data sheet does not suffice.
        source: Source as text.
    """

    value: float | None
    source: str


class TorqueLimits(NamedTuple):
    """Torques that a motor can produce at given speeds; none at all where ``upper < lower``.

    Attributes:
        lower, upper: Electromagnetic torque [N m], with the shape of the speeds.
    """

    lower: Array
    upper: Array


@law
def thermal_path(motor: Any, mounting: Any) -> Any:
    """Thermal resistances from winding to housing and from housing to ambient [K/W]; NaN if unknown.

    A single resistance from winding to ambient makes winding and housing one node (0, that value), or gives a missing
    part as a difference. ``mounting`` replaces the resistance from housing to ambient [K/W]; NaN keeps the data
    sheet's. If the data sheet has only the single value, the motor's ``winding_share`` of it lies before a stated
    mounting; without that, the larger of both values is the lower bound of the total.
    """
    inner, outer = motor.resistance_winding_housing, motor.resistance_housing_ambient
    whole = motor.resistance_winding_ambient
    if math.isnan(inner) and whole > outer:
        inner = whole - outer
    elif math.isnan(outer) and whole > inner:
        outer = whole - inner
    if not math.isnan(mounting):
        if math.isnan(inner) and math.isnan(motor.winding_share):
            return 0.0, max(mounting, whole) if known(whole) else whole
        return known_or(inner, motor.winding_share * whole), mounting
    return (0.0, whole) if math.isnan(inner + outer) else (inner, outer)


@law
def scaled_nominal_current(motor: Any, ambient: Any, mounting: Any) -> Any:
    """The printed continuous current, scaled to another ambient temperature [C] and mounting [K/W] [A].

    It scales with the square root of the heat that can be removed, which keeps the share of iron loss, friction and
    brushes by which it is below the thermal limit.
    """
    current, limit = (
        known_or(motor.nominal_current, motor.nominal_torque / motor.torque_constant),
        motor.max_winding_temperature,
    )
    if ambient != SHEET_AMBIENT and limit > SHEET_AMBIENT:
        current *= math.sqrt(max(limit - ambient, 0.0) / (limit - SHEET_AMBIENT))
    if not math.isnan(mounting):
        sheet, real = thermal_path(motor, UNKNOWN), thermal_path(motor, mounting)
        current *= known_or(math.sqrt((sheet[0] + sheet[1]) / (real[0] + real[1])), 1.0)
    return current


@law
def thermal_limit_current(motor: Any, ambient: Any, mounting: Any) -> Any:
    """Constant current that heats the winding just to its limit [A]: I^2 R(T_max) (R1 + R2) = T_max - T_ambient."""
    path, limit = thermal_path(motor, mounting), motor.max_winding_temperature
    return math.sqrt(max(limit - ambient, 0.0) / (winding_resistance(motor, limit) * (path[0] + path[1])))


@law
def continuous_current_limit(motor: Any, ambient: Any, mounting: Any) -> Any:
    """The smaller of the printed current and the thermal limit [A]; NaN if neither is known."""
    printed = scaled_nominal_current(motor, ambient, mounting)
    thermal = thermal_limit_current(motor, ambient, mounting)
    return known_or(min(printed, thermal), known_or(printed, thermal))


def with_allowances(motor: Motor) -> Motor:
    """A motor with assumed upper bounds of friction and inductance where its data sheet gives none."""
    friction, inductance = 0.0, 0.0
    if not (motor.frameless or has_friction_data(motor)):
        continuous = float(continuous_current_limit(as_record(motor), SHEET_AMBIENT, UNKNOWN))
        friction = FRICTION_SHARE * motor.torque_constant * continuous
    if motor.inductance is None:
        inductance = (FRAMELESS_LAG if motor.frameless else LAG) * motor.resistance
    complete = friction == inductance == 0.0
    return motor if complete else replace(motor, friction_allowance=friction, inductance_allowance=inductance)


@law
def least_max_speed(motor: Any) -> Any:
    """A conservative maximum speed for a data sheet that gives none [rad/s]."""
    unloaded = known_or(motor.no_load_speed, abs(motor.nominal_voltage / motor.torque_constant))
    return known_or(SPEED_SHARE * unloaded, SLOWEST_MOTOR)


@law
def least_winding_time(motor: Any) -> Any:
    """Time constant of the winding, or the shortest plausible one if the data sheet gives none [s]."""
    return known_or(motor.winding_time_constant, QUICKEST_WINDING * math.sqrt(known_or(motor.mass, LIGHTEST)))


@law
def poorest_path(motor: Any) -> Any:
    """The largest plausible thermal resistance from winding to ambient of a motor of this mass [K/W]."""
    return POOREST_PATH / known_or(motor.mass, LIGHTEST) ** (2.0 / 3.0)


@law
def short_time_torque(motor: Any) -> Any:
    """Printed peak torque, else torque constant times peak current, else that of a blocked motor [N m]."""
    blocked = known_or(motor.stall_torque, motor.torque_constant * motor.nominal_voltage / motor.resistance)
    return known_or(motor.peak_torque, known_or(motor.torque_constant * motor.peak_current, blocked))


def thermal_resistances(motor: Motor, housing_to_ambient: float | None = None) -> tuple[float, float] | None:
    """Thermal resistances from winding to housing and from housing to ambient [K/W]; None if unknown."""
    inner, outer = thermal_path(as_record(motor), UNKNOWN if housing_to_ambient is None else housing_to_ambient)
    return (float(inner), float(outer)) if known(inner + outer) else None


def continuous_current(motor: Motor, ambient: float, *, housing_to_ambient: float | None = None) -> SourcedValue:
    """Largest continuous current of a motor: the smaller one of the printed value and the thermal limit.

    The printed value applies at 25 C and in the data sheet's mounting. Otherwise it is scaled by the square root of the
    heat that can be dissipated, which keeps the share of iron loss, friction and brushes that makes it smaller than the
    thermal limit.

    Args:
        motor: Data sheet.
        ambient: Air temperature [C].
        housing_to_ambient: Thermal resistance of the real mounting, which replaces the data sheet's [K/W].

    Returns:
        Current [A] and its source; the value is None if neither is known.
    """
    mounting = UNKNOWN if housing_to_ambient is None else housing_to_ambient
    record, nominal = as_record(motor), _nominal_source(motor, ambient, housing_to_ambient)
    value = _or_none(continuous_current_limit(record, ambient, mounting))
    if value is None:
        return SourcedValue(None, "the catalogue row has neither a nominal current nor a thermal resistance and limit")
    if value == scaled_nominal_current(record, ambient, mounting):
        return SourcedValue(value, nominal)
    return SourcedValue(value, f"thermal limit: winding at {motor.max_winding_temperature} °C in air of {ambient:g} °C")


def _or_none(value: float) -> float | None:
    return float(value) if known(value) else None


def _nominal_source(motor: Motor, ambient: float, housing_to_ambient: float | None) -> str:
    """Source of the result of ``scaled_nominal_current``, as text."""
    printed = "nominal current of the data sheet"
    source = (
        printed if motor.nominal_current is not None else "nominal torque of the data sheet over its torque constant"
    )
    limit = motor.max_winding_temperature
    if ambient != SHEET_AMBIENT:
        if limit is None or limit <= SHEET_AMBIENT:
            source += f", not scaled to {ambient:g} °C (no winding limit)"
        else:
            source += f", scaled from {SHEET_AMBIENT:g} °C to {ambient:g} °C"
    if housing_to_ambient is not None:
        if thermal_resistances(motor) is None or thermal_resistances(motor, housing_to_ambient) is None:
            source += ", not scaled to the mounting (no thermal resistances)"
        else:
            source += ", scaled to the mounting"
    return source


def peak_current(motor: Motor, amplifier: Amplifier) -> SourcedValue:
    """Largest short-time current that both motor and amplifier permit.

    Args:
        motor: Data sheet; without a peak current, peak torque over torque constant is used.
        amplifier: Amplifier with its peak current.

    Returns:
        Current [A] and its source; the value is None if neither states a limit.
    """
    known = []
    if motor.peak_current is not None:
        known.append(SourcedValue(motor.peak_current, "peak current of the motor's data sheet"))
    elif motor.peak_torque is not None:
        value = motor.peak_torque / motor.torque_constant
        known.append(SourcedValue(value, "peak torque of the motor's data sheet over its torque constant"))
    if amplifier.peak_current is not None:
        known.append(SourcedValue(amplifier.peak_current, "peak current of the amplifier"))
    if not known:
        return SourcedValue(None, "neither motor nor amplifier states a peak current")
    return min(known, key=lambda limit: limit.value or 0.0)


def torque_limits(
    motor: Motor,
    speed: Array,
    voltage: float,
    current_limit: float | None,
    winding_temperature: float,
    magnet_temperature: float,
) -> TorqueLimits:
    """Range of electromagnetic torque within a voltage and a current limit at given speeds, in all four quadrants.

    While braking, the rotor may be faster than its no-load speed, because the current then lowers the voltage.

    Args:
        motor: Data sheet.
        speed: Speed of the rotor [rad/s], any shape.
        voltage: Largest magnitude of the terminal voltage [V].
        current_limit: Largest magnitude of the current [A]; None: only the voltage limits.
        winding_temperature: Winding temperature [C].
        magnet_temperature: Magnet temperature [C].

    Returns:
        Lower and upper limit at each speed [N m].

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.10.
    """
    constant = torque_constant(motor, magnet_temperature)
    resistance = winding_resistance(motor, winding_temperature)
    back_emf = constant * np.asarray(speed, dtype=np.float64)
    limit = math.inf if current_limit is None else constant * current_limit
    upper = np.minimum(limit, constant * (voltage - back_emf) / resistance)
    lower = np.maximum(-limit, constant * (-voltage - back_emf) / resistance)
    return TorqueLimits(np.asarray(lower), np.asarray(upper))


def operating_region(
    motor: Motor,
    amplifier: Amplifier,
    supply_voltage: float,
    winding_temperature: float,
    magnet_temperature: float,
) -> Array:
    """Region of speed and electromagnetic torque for short-time operation, in all four quadrants.

    The region is a polygon. If neither motor nor amplifier states a peak current, the stall current closes the region.

    Args:
        motor: Data sheet; the maximum speed is an edge if it is known.
        amplifier: Amplifier with its peak current and modulation.
        supply_voltage: Supply voltage [V].
        winding_temperature: Winding temperature [C].
        magnet_temperature: Magnet temperature [C].

    Returns:
        Corners (speed [rad/s], torque [N m]) counter-clockwise, the first repeated at the end, (M, 2).

    Raises:
        InputError: A supply voltage that is not positive, or a temperature that leaves the magnets no torque constant.

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.10.
    """
    supply_voltage = checked_number(supply_voltage, "supply_voltage", "V", above=0.0)
    voltage = available_voltage(amplifier, supply_voltage)
    limit = peak_current(motor, amplifier).value
    if limit is None:
        limit = voltage / winding_resistance(motor, winding_temperature)
    torque = torque_constant(motor, magnet_temperature) * limit
    if motor.peak_torque is not None:
        torque = min(torque, motor.peak_torque)
    return _region(motor, voltage, torque, winding_temperature, magnet_temperature)


def continuous_region(
    motor: Motor,
    amplifier: Amplifier,
    supply_voltage: float,
    continuous_current: float,
    winding_temperature: float,
    magnet_temperature: float,
) -> Array:
    """Region of speed and electromagnetic torque for continuous operation, in all four quadrants.

    Args:
        motor: Data sheet; the maximum speed is an edge if it is known.
        amplifier: Amplifier with its continuous current and modulation.
        supply_voltage: Supply voltage [V].
        continuous_current: Continuous current of the motor, from ``continuous_current`` [A].
        winding_temperature: Winding temperature [C].
        magnet_temperature: Magnet temperature [C].

    Returns:
        Corners (speed [rad/s], torque [N m]) counter-clockwise, the first repeated at the end, (M, 2).

    Raises:
        InputError: As for ``operating_region``, or a negative current.
    """
    supply_voltage = checked_number(supply_voltage, "supply_voltage", "V", above=0.0)
    continuous_current = checked_number(continuous_current, "continuous_current", "A", least=0.0)
    limit = min(continuous_current, amplifier.continuous_current or math.inf)
    torque = torque_constant(motor, magnet_temperature) * limit
    voltage = available_voltage(amplifier, supply_voltage)
    return _region(motor, voltage, torque, winding_temperature, magnet_temperature)


def _region(
    motor: Motor, voltage: float, torque: float, winding_temperature: float, magnet_temperature: float
) -> Array:
    """The polygon within a torque limit, a speed limit, and both signs of the voltage limit."""
    checked_numbers(
        {"winding_temperature": (winding_temperature, "C"), "magnet_temperature": (magnet_temperature, "C")}
    )
    constant = torque_constant(motor, magnet_temperature)
    if not constant > 0.0:
        raise InputError(Fault("magnet_temperature", "leaves the magnets no torque constant", magnet_temperature))
    slope = winding_resistance(motor, winding_temperature) / constant  # [V/(N m)]
    speed = (voltage + slope * torque) / constant
    if motor.max_speed is not None:
        speed = min(speed, motor.max_speed)
    corners = [(-speed, -torque), (speed, -torque), (speed, torque), (-speed, torque)]
    for sign in (1.0, -1.0):
        corners = _clipped(corners, (sign * constant, sign * slope), voltage)
    return np.array([*corners, corners[0]])


def _clipped(
    corners: list[tuple[float, float]], normal: tuple[float, float], bound: float
) -> list[tuple[float, float]]:
    """The part of a convex polygon where normal . corner <= bound (Sutherland and Hodgman)."""
    excess = [normal[0] * x + normal[1] * y - bound for x, y in corners]
    kept: list[tuple[float, float]] = []
    for i, (x, y) in enumerate(corners):
        x0, y0 = corners[i - 1]
        if excess[i - 1] * excess[i] < 0.0:
            share = excess[i - 1] / (excess[i - 1] - excess[i])
            kept.append((x0 + share * (x - x0), y0 + share * (y - y0)))
        if excess[i] <= 0.0:
            kept.append((x, y))
    return kept
