"""What a motor may do: its continuous current, its peak current, and its region of torque and speed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Amplifier, available_voltage
from drivetrain.drive.motor import Motor, torque_constant, winding_resistance

SHEET_AMBIENT = 25.0  # C, at which makers print continuous values


class SourcedValue(NamedTuple):
    """A number and where it comes from.

    Attributes:
        value: In SI; None when the sheet does not say enough.
        source: In words.
    """

    value: float | None
    source: str


class TorqueLimits(NamedTuple):
    """The torques a motor can make at given speeds; where ``upper < lower`` it can make none at all.

    Attributes:
        lower, upper: Electromagnetic [N m], the shape of the speeds.
    """

    lower: Array
    upper: Array


def thermal_resistances(motor: Motor, housing_to_ambient: float | None = None) -> tuple[float, float] | None:
    """The way of the heat: from winding to housing, and from housing to ambient.

    A sheet with one number from winding to ambient gives (0, that number): winding and housing are one. With that
    number and one of the two others, the missing one is the difference.

    Args:
        motor: The sheet.
        housing_to_ambient: Replaces the sheet's, for the real mounting [K/W].

    Returns:
        Both [K/W]; None when the sheet does not say enough. One number from winding to ambient holds for the sheet's
        own mounting, so it does not say enough when another mounting is given.
    """
    inner, outer, whole = (
        motor.resistance_winding_housing,
        motor.resistance_housing_ambient,
        motor.resistance_winding_ambient,
    )
    if whole is not None:
        if inner is None and outer is not None and whole > outer:
            inner = whole - outer
        elif outer is None and inner is not None and whole > inner:
            outer = whole - inner
    if housing_to_ambient is not None:
        return None if inner is None else (inner, housing_to_ambient)
    if inner is not None and outer is not None:
        return inner, outer
    return None if whole is None else (0.0, whole)


def thermal_current(motor: Motor, ambient: float, housing_to_ambient: float | None = None) -> float | None:
    """Constant current that heats the winding just to its limit, copper loss alone.

    Args:
        motor: The sheet.
        ambient: Air temperature [C].
        housing_to_ambient: Replaces the sheet's, for the real mounting [K/W].

    Returns:
        [A]; 0 when the air is as hot as the winding may be; None when the sheet does not say enough.

    Reference:
        I^2 R(T_max) (R_th1 + R_th2) = T_max - T_ambient.
    """
    resistances = thermal_resistances(motor, housing_to_ambient)
    limit = motor.max_winding_temperature
    if resistances is None or limit is None:
        return None
    rise = max(limit - ambient, 0.0)
    return math.sqrt(rise / (winding_resistance(motor, limit) * sum(resistances)))


def continuous_current(motor: Motor, ambient: float, *, housing_to_ambient: float | None = None) -> SourcedValue:
    """The current a motor can carry for ever: the smaller of what is printed and of the thermal limit.

    The printed value holds at 25 C and for the sheet's mounting. Elsewhere it is scaled by the square root of the
    heat that can leave, which keeps the share of iron loss, friction and brushes that makes it smaller than the
    thermal limit.

    Args:
        motor: The sheet.
        ambient: Air temperature [C].
        housing_to_ambient: Replaces the sheet's thermal resistance, for the real mounting [K/W].

    Returns:
        Current [A] and its source; the value is None when neither is known.
    """
    printed = _nominal_current(motor, ambient, housing_to_ambient)
    thermal = SourcedValue(
        thermal_current(motor, ambient, housing_to_ambient),
        f"thermal limit: winding at {motor.max_winding_temperature} °C in air of {ambient:g} °C",
    )
    known = [limit for limit in (printed, thermal) if limit.value is not None]
    if not known:
        return SourcedValue(None, "the sheet has neither a nominal current nor a thermal resistance and limit")
    return min(known, key=lambda limit: limit.value or 0.0)


def _nominal_current(motor: Motor, ambient: float, housing_to_ambient: float | None) -> SourcedValue:
    """The printed continuous current, carried over to another ambient and mounting."""
    if motor.nominal_current is not None:
        value, source = motor.nominal_current, "nominal current of the sheet"
    elif motor.nominal_torque is not None:
        value = motor.nominal_torque / motor.torque_constant
        source = "nominal torque of the sheet over its torque constant"
    else:
        return SourcedValue(None, "no nominal current")
    limit = motor.max_winding_temperature
    if ambient != SHEET_AMBIENT:
        if limit is None or limit <= SHEET_AMBIENT:
            source += f", not scaled to {ambient:g} °C (no winding limit)"
        else:
            value *= math.sqrt(max(limit - ambient, 0.0) / (limit - SHEET_AMBIENT))
            source += f", scaled from {SHEET_AMBIENT:g} °C to {ambient:g} °C"
    sheet, mounted = thermal_resistances(motor), thermal_resistances(motor, housing_to_ambient)
    if housing_to_ambient is not None:
        if sheet is None or mounted is None:
            source += ", not scaled to the mounting (no thermal resistances)"
        else:
            value *= math.sqrt(sum(sheet) / sum(mounted))
            source += ", scaled to the mounting"
    return SourcedValue(value, source)


def peak_current(motor: Motor, amplifier: Amplifier) -> SourcedValue:
    """The largest current motor and amplifier both allow for a short time.

    Args:
        motor: The sheet; without a peak current, its peak torque over its torque constant.
        amplifier: Its peak current.

    Returns:
        Current [A] and its source; the value is None when neither part states one.
    """
    known = []
    if motor.peak_current is not None:
        known.append(SourcedValue(motor.peak_current, "peak current of the motor's sheet"))
    elif motor.peak_torque is not None:
        value = motor.peak_torque / motor.torque_constant
        known.append(SourcedValue(value, "peak torque of the motor's sheet over its torque constant"))
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
    """The electromagnetic torques within a voltage and a current limit at given speeds, in all four quadrants.

    While braking the rotor may be faster than its no-load speed: the current then lowers the voltage.

    Args:
        motor: The sheet.
        speed: Of the rotor [rad/s], any shape.
        voltage: Largest magnitude at the terminals [V].
        current_limit: Largest magnitude [A]; None: the voltage alone limits.
        winding_temperature: [C].
        magnet_temperature: [C].

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
    """The region of speed and electromagnetic torque that is open for a short time, in all four quadrants.

    Its edges are straight, so its corners are all there is to it. Where neither motor nor amplifier states a peak
    current, the current is cut at that of a blocked rotor, so that the region closes.

    Args:
        motor: The sheet; its maximum speed is an edge where it is known.
        amplifier: Its peak current and modulation.
        supply_voltage: [V].
        winding_temperature: [C].
        magnet_temperature: [C].

    Returns:
        Corners (speed [rad/s], torque [N m]) counter-clockwise, the first repeated at the end, (M, 2).

    Reference:
        Lynch and Park, Modern Robotics (2017), figure 8.10.
    """
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
    """The region of speed and electromagnetic torque that is open for ever, in all four quadrants.

    Args:
        motor: The sheet; its maximum speed is an edge where it is known.
        amplifier: Its continuous current and modulation.
        supply_voltage: [V].
        continuous_current: Of the motor, from ``continuous_current`` [A].
        winding_temperature: [C].
        magnet_temperature: [C].

    Returns:
        Corners (speed [rad/s], torque [N m]) counter-clockwise, the first repeated at the end, (M, 2).
    """
    limit = min(continuous_current, amplifier.continuous_current or math.inf)
    torque = torque_constant(motor, magnet_temperature) * limit
    voltage = available_voltage(amplifier, supply_voltage)
    return _region(motor, voltage, torque, winding_temperature, magnet_temperature)


def _region(
    motor: Motor, voltage: float, torque: float, winding_temperature: float, magnet_temperature: float
) -> Array:
    """The polygon inside a torque limit, a speed limit, and both signs of the voltage limit."""
    constant = torque_constant(motor, magnet_temperature)
    slope = winding_resistance(motor, winding_temperature) / constant  # volts per newton metre
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
