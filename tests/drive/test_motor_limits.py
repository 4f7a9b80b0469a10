from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.motor import Motor, torque_constant, winding_resistance
from drivetrain.drive.motor_limits import (
    continuous_current,
    continuous_region,
    operating_region,
    peak_current,
    thermal_limit_current,
    thermal_resistances,
    torque_limits,
)
from drivetrain.errors import InputError
from drivetrain.records import UNKNOWN, as_record

# maxon online catalogue 2019 (resistance, thermal resistances winding-housing and housing-ambient, limit of the
# winding, printed nominal current) and how far the printed value lies from the thermal limit [%].
PUBLISHED = [
    ("A-max 16 110045", 23.1, 5.5, 29.8, 85.0, 0.243, -0.5),
    ("A-max 22 110121", 5.39, 6.0, 20.0, 85.0, 0.586, -0.5),
    ("DCX 22 L DCX22L01EBKL637", 7.25, 4.57, 13.6, 100.0, 0.655, -1.3),
    ("EC 45 flat 397172", 0.608, 4.1, 3.56, 125.0, 3.21, -18.3),
]


def _motor(**fields: float | None) -> Motor:
    sheet: dict[str, float | None] = {
        "resistance_winding_housing": 2.0,
        "resistance_housing_ambient": 6.0,
        "max_winding_temperature": 125.0,
    }
    return dataclasses.replace(Motor("test", 0.6, 0.04), **(sheet | fields))  # type: ignore[arg-type]


def test_a_text_is_told_to_be_a_number() -> None:
    with pytest.raises(InputError, match="a number in SI, without a unit"):
        Motor("M", resistance="1 ohm", torque_constant=0.1)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "resistance", "inner", "outer", "limit", "printed", "percent"), PUBLISHED)
def test_thermal_limit_against_the_printed_continuous_current(
    name: str, resistance: float, inner: float, outer: float, limit: float, printed: float, percent: float
) -> None:
    motor = _motor(
        resistance_winding_housing=inner,
        resistance_housing_ambient=outer,
        max_winding_temperature=limit,
        nominal_current=printed,
    )
    motor = dataclasses.replace(motor, resistance=resistance)
    thermal = thermal_limit_current(as_record(motor), 25.0, UNKNOWN)
    # 0.1: the percentages above are printed to one decimal
    assert 100.0 * (printed / thermal - 1.0) == pytest.approx(percent, abs=0.1)
    assert continuous_current(motor, 25.0).value == printed


def test_thermal_current_brings_the_winding_to_its_limit() -> None:
    motor = _motor()
    current = thermal_limit_current(as_record(motor), 40.0, UNKNOWN)
    loss = current**2 * winding_resistance(motor, 125.0)
    assert 40.0 + loss * (2.0 + 6.0) == pytest.approx(125.0)
    assert thermal_limit_current(as_record(motor), 130.0, UNKNOWN) == 0.0
    assert math.isnan(thermal_limit_current(as_record(_motor(max_winding_temperature=None)), 25.0, UNKNOWN))


def test_resistances_from_what_the_sheet_has() -> None:
    assert thermal_resistances(_motor()) == (2.0, 6.0)
    assert thermal_resistances(_motor(), 1.0) == (2.0, 1.0)
    lumped = _motor(resistance_winding_housing=None, resistance_housing_ambient=None, resistance_winding_ambient=8.0)
    assert thermal_resistances(lumped) == (0.0, 8.0)
    # one number for the whole way is split as assumed; without an assumption the larger of both is the whole
    assert thermal_resistances(lumped, 1.0) == (0.0, 8.0)
    assert thermal_resistances(lumped, 100.0) == (0.0, 100.0)
    assert thermal_resistances(dataclasses.replace(lumped, winding_share=0.5), 1.0) == (4.0, 1.0)
    split = dataclasses.replace(lumped, resistance_winding_housing=3.0)
    assert thermal_resistances(split) == (3.0, 5.0)
    assert thermal_resistances(split, 1.0) == (3.0, 1.0)
    outside = dataclasses.replace(lumped, resistance_housing_ambient=5.0)
    assert thermal_resistances(outside) == (3.0, 5.0)
    assert thermal_resistances(outside, 1.0) == (3.0, 1.0)
    # parts that are no less than the whole leave no difference: the whole is taken
    assert thermal_resistances(dataclasses.replace(lumped, resistance_housing_ambient=9.0)) == (0.0, 8.0)
    assert thermal_resistances(dataclasses.replace(lumped, resistance_winding_housing=9.0)) == (0.0, 8.0)
    assert thermal_resistances(Motor("bare", 1.0, 0.1)) is None


def test_the_smaller_of_printed_and_thermal_counts() -> None:
    thermal = thermal_limit_current(as_record(_motor()), 25.0, UNKNOWN)
    below, above = (
        continuous_current(_motor(nominal_current=2.0), 25.0),
        continuous_current(_motor(nominal_current=9.0), 25.0),
    )
    assert below.value == 2.0 and "nominal" in below.source
    assert above.value == thermal and "thermal limit" in above.source


def test_printed_current_is_carried_to_another_air_and_mounting() -> None:
    hot = continuous_current(_motor(nominal_current=2.0), 75.0)
    assert hot.value == pytest.approx(2.0 * math.sqrt(50.0 / 100.0)) and "scaled from 25 °C to 75 °C" in hot.source
    cooled = continuous_current(_motor(nominal_current=2.0), 25.0, housing_to_ambient=2.0)
    assert cooled.value == pytest.approx(2.0 * math.sqrt(8.0 / 4.0)) and "mounting" in cooled.source
    both = continuous_current(_motor(nominal_current=2.0), 75.0, housing_to_ambient=2.0)
    assert both.value == pytest.approx(2.0 * math.sqrt(0.5 * 8.0 / 4.0))
    torque = continuous_current(_motor(nominal_torque=0.06), 75.0)
    assert torque.value == pytest.approx(1.5 * math.sqrt(0.5))  # over the torque constant of 0.04 N m/A
    assert continuous_current(_motor(nominal_current=2.0), 25.0).value == 2.0
    assert continuous_current(_motor(nominal_current=2.0), 130.0).value == 0.0  # hotter air than the winding may be
    unknown = continuous_current(Motor("bare", 1.0, 0.1, nominal_current=2.0), 75.0)
    assert unknown.value == 2.0 and "not scaled" in unknown.source


def test_continuous_current_without_data_is_none_with_a_reason() -> None:
    value, source = continuous_current(Motor("bare", 1.0, 0.1), 25.0)
    assert value is None and "neither" in source
    from_torque = continuous_current(Motor("bare", 1.0, 0.1, nominal_torque=0.3), 25.0)
    assert from_torque.value == pytest.approx(3.0)


def test_peak_current_is_the_smaller_of_motor_and_amplifier() -> None:
    motor, amplifier = _motor(peak_current=20.0), Amplifier(peak_current=15.0)
    assert peak_current(motor, amplifier) == (15.0, "peak current of the amplifier")
    assert peak_current(motor, Amplifier()).value == 20.0
    assert peak_current(_motor(peak_torque=0.4), Amplifier()).value == pytest.approx(10.0)
    assert peak_current(_motor(), Amplifier()).value is None


def _allowed(motor: Motor, volts: float, limit: float, points: Array) -> Array:
    """The constraints of figure 8.10 written out at given speeds and torques."""
    speed, torque = points.T
    constant, resistance = torque_constant(motor, 60.0), winding_resistance(motor, 120.0)
    voltage = constant * speed + resistance * torque / constant
    inside = (np.abs(voltage) <= volts) & (np.abs(torque) <= constant * limit)
    return inside & (np.abs(speed) <= (motor.max_speed or np.inf))


def _inside(polygon: Array, points: Array) -> Array:
    """Whether points lie left of every edge of a closed counter-clockwise polygon."""
    edges = np.diff(polygon, axis=0)
    to_points = points[:, None, :] - polygon[None, :-1, :]
    return (edges[:, 0] * to_points[..., 1] - edges[:, 1] * to_points[..., 0] >= 0.0).all(axis=1)


@pytest.mark.parametrize("max_speed", [None, 900.0, 2500.0])
@pytest.mark.parametrize("limit", [3.0, 30.0, 300.0])
def test_region_is_exactly_where_all_limits_hold(max_speed: float | None, limit: float) -> None:
    motor, amplifier = _motor(max_speed=max_speed, peak_current=limit), Amplifier(modulation=0.9)
    polygon = operating_region(motor, amplifier, 48.0, 120.0, 60.0)
    rng = np.random.default_rng(7)
    extent = 1.2 * np.abs(polygon).max(axis=0)
    points = rng.uniform(-1.0, 1.0, size=(4000, 2)) * extent
    np.testing.assert_array_equal(_inside(polygon, points), _allowed(motor, 0.9 * 48.0, limit, points))
    np.testing.assert_array_equal(polygon[0], polygon[-1])
    # figure 8.10 is the same after half a turn
    turned = {tuple(np.round(corner, 9)) for corner in -polygon}
    assert turned == {tuple(np.round(corner, 9)) for corner in polygon}


def test_torque_limits_are_a_cut_through_the_region() -> None:
    motor, amplifier = _motor(peak_current=12.0), Amplifier(modulation=1.0)
    polygon = operating_region(motor, amplifier, 48.0, 120.0, 60.0)
    speed = np.linspace(polygon[:, 0].min(), polygon[:, 0].max(), 50)[1:-1]
    limits = torque_limits(motor, speed, 48.0, 12.0, 120.0, 60.0)
    for bound, outward in ((limits.lower, -1.0), (limits.upper, 1.0)):
        inner = np.column_stack([speed, bound - outward * 1e-9])
        outer = np.column_stack([speed, bound + outward * 1e-9])
        assert _inside(polygon, inner).all() and not _inside(polygon, outer).any()


def test_braking_may_be_faster_than_no_load_and_stall_may_be_out_of_reach() -> None:
    motor = _motor(peak_current=12.0)
    constant = torque_constant(motor, 25.0)
    no_load = 48.0 / constant
    limits = torque_limits(motor, np.array([0.0, 1.05 * no_load, 2.0 * no_load]), 48.0, 12.0, 25.0, 25.0)
    assert limits.upper[0] == pytest.approx(12.0 * constant)
    assert limits.upper[0] < 48.0 * constant / 0.6
    assert limits.lower[1] == pytest.approx(-12.0 * constant) and -12.0 * constant < limits.upper[1] < 0.0
    assert limits.upper[2] < limits.lower[2]  # no torque keeps both limits there
    free = torque_limits(motor, np.array([0.0]), 48.0, None, 25.0, 25.0)
    assert free.upper[0] == pytest.approx(48.0 * constant / 0.6)


def test_without_any_peak_current_the_region_closes_at_stall() -> None:
    polygon = operating_region(_motor(), Amplifier(modulation=1.0), 48.0, 25.0, 25.0)
    assert polygon[:, 1].max() == pytest.approx(0.04 * 48.0 / 0.6)


def test_a_printed_peak_torque_below_the_line_counts() -> None:
    # iron saturates: the printed peak torque is less than torque constant times peak current
    polygon = operating_region(_motor(peak_current=12.0, peak_torque=0.4), Amplifier(), 48.0, 25.0, 25.0)
    assert polygon[:, 1].max() == pytest.approx(0.4) and polygon[:, 1].min() == pytest.approx(-0.4)


def test_continuous_region_lies_inside_the_intermittent_one() -> None:
    motor, amplifier = _motor(peak_current=12.0), Amplifier(continuous_current=3.0)
    outer = operating_region(motor, amplifier, 48.0, 120.0, 60.0)
    inner = continuous_region(motor, amplifier, 48.0, 4.0, 120.0, 60.0)
    assert _inside(outer, 0.999 * inner).all()
    assert inner[:, 1].max() == pytest.approx(3.0 * torque_constant(motor, 60.0))
