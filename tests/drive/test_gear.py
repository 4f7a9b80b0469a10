from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetrain.drive.gear import (
    HOLDING,
    Gear,
    average_torque,
    complete,
    gear_life,
    has_drag_data,
    mesh,
    mesh_input_torque,
    mesh_loss_coefficient,
    mesh_of,
    momentary_peak_count,
    standstill_interval,
    torque_exponent,
    unknown_loss,
)
from drivetrain.drive.spring import wind_up
from drivetrain.errors import InputError
from drivetrain.records import as_record

RPM = 2.0 * math.pi / 60.0
HOUR = 3600.0
LOSSY = Gear("lossy", 100.0, kind="planetary", efficiency=0.7)
WORM = Gear("worm", 50.0, kind="spur", efficiency=0.4)


def test_mesh_friction_of_both_directions_is_one_number() -> None:
    mu = mesh_loss_coefficient(LOSSY)
    assert 1.0 / (1.0 + mu) == pytest.approx(0.7)
    assert mesh(LOSSY).driven == pytest.approx(1.0 - mu) == pytest.approx(2.0 - 1.0 / 0.7)
    assert mesh(dataclasses.replace(LOSSY, backdriving_efficiency=0.5)).driven == 0.5
    assert mesh(WORM).driven < 0.0


@pytest.mark.parametrize("lost", ["mesh_efficiency", "drag_torque", "drag_speed_exponent", "drag_speed"])
def test_half_of_mesh_and_drag_is_unknown(lost: str) -> None:
    """Of a sheet that tells mesh and drag apart every number counts, of one that does not the efficiency alone."""
    apart = dataclasses.replace(
        LOSSY, mesh_efficiency=0.9, drag_torque=0.02, drag_speed=200.0, drag_speed_exponent=0.7,
        drag_temperature_1=0.0, drag_temperature_2=0.0,
    )  # fmt: skip
    record = as_record(apart)
    assert unknown_loss(record) == 0.0 and mesh_of(record).driving == pytest.approx(1.0 / 0.9)
    assert mesh_of(record).drag == pytest.approx(0.02 / 200.0**0.7)
    constant = dataclasses.replace(apart, drag_speed_exponent=0.0, drag_speed=None)
    assert unknown_loss(as_record(constant)) == 0.0 and mesh_of(as_record(constant)).drag == pytest.approx(0.02)
    less = as_record(dataclasses.replace(apart, **{lost: None}))
    assert math.isnan(unknown_loss(less)) or not has_drag_data(less)
    assert unknown_loss(as_record(LOSSY)) == 0.0
    silent = as_record(dataclasses.replace(LOSSY, efficiency=None))
    assert math.isnan(unknown_loss(silent)) and mesh_of(silent).driving == mesh_of(silent).driven == 1.0


def test_torque_through_the_mesh_in_four_quadrants() -> None:
    torque, speed = np.array([50.0, -50.0, 50.0, -50.0]), np.array([1.0, 1.0, -1.0, -1.0])
    back = 2.0 - 1.0 / 0.7
    expected = np.array([0.5 / 0.7, -0.5 * back, 0.5 * back, -0.5 / 0.7])
    np.testing.assert_allclose(mesh_input_torque(LOSSY, torque, speed), expected, rtol=1e-14)
    # the other way round for a gear that reverses
    reverse = dataclasses.replace(LOSSY, ratio=-100.0)
    np.testing.assert_allclose(mesh_input_torque(reverse, torque, speed), -expected, rtol=1e-14)


@given(
    torque=st.floats(-1e3, 1e3),
    speed=st.floats(-50.0, 50.0),
    efficiency=st.floats(0.05, 1.0),
    ratio=st.floats(1.0, 300.0) | st.floats(-300.0, -1.0),
)
def test_a_mesh_never_makes_power(torque: float, speed: float, efficiency: float, ratio: float) -> None:
    gear = Gear("any", ratio, efficiency=efficiency)
    motor_torque = float(mesh_input_torque(gear, np.array(torque), np.array(speed)))
    put_in, taken_out = motor_torque * ratio * speed, torque * speed
    loss = put_in - taken_out
    assert loss >= -1e-12 * abs(taken_out) - 1e-300  # the smallest numbers have no digits to round
    # and what it loses is mesh friction: mu times the transmitted power
    assert loss == pytest.approx((1.0 / efficiency - 1.0) * abs(taken_out), rel=1e-9, abs=1e-9)


def test_a_self_locking_mesh_must_be_pushed_down() -> None:
    pushed = float(mesh_input_torque(WORM, np.array(20.0), np.array(-1.0)))
    assert pushed == pytest.approx((2.0 - 1.0 / 0.4) * 20.0 / 50.0) and pushed < 0.0


def test_standstill_is_an_interval() -> None:
    hold, start = standstill_interval(LOSSY, np.array([50.0, -50.0, 0.0]))
    np.testing.assert_allclose(hold, [0.5 * (2.0 - 1.0 / 0.7), -0.5 * (2.0 - 1.0 / 0.7), 0.0])
    np.testing.assert_allclose(start, [0.5 / 0.7, -0.5 / 0.7, 0.0])
    np.testing.assert_array_equal(standstill_interval(WORM, np.array([20.0])).hold, [0.0])
    # at rest any torque between them holds: by default that of a mesh without friction counts, else what is chosen,
    # also where the caller says that a tiny speed is rest
    load, rest = np.array([50.0]), np.array([0.0])
    np.testing.assert_allclose(mesh_input_torque(LOSSY, load, rest), [0.5])
    np.testing.assert_allclose(mesh_input_torque(LOSSY, load, np.array([1e-15]), standstill=np.array([True])), [0.5])
    for name, end in (("least", hold[0]), ("lossless", 0.5), ("most", start[0])):
        chosen = dataclasses.replace(LOSSY, holding=HOLDING[name])
        np.testing.assert_allclose(mesh_input_torque(chosen, load, rest), [end])
        np.testing.assert_allclose(standstill_interval(chosen, load), [hold[:1], start[:1]])
    locked = dataclasses.replace(WORM, holding=HOLDING["least"])
    np.testing.assert_array_equal(mesh_input_torque(locked, np.array([20.0]), rest), [0.0])


def test_running_torque_is_not_counted_twice() -> None:
    sheet = dataclasses.replace(LOSSY, continuous_torque=40.0, no_load_torque=0.05)
    driving, driven = mesh(sheet).driving, mesh(sheet).driven
    # at rated torque mesh and running torque together are the printed efficiency, in both directions
    assert 40.0 / 100.0 * driving + 0.05 == pytest.approx(40.0 / 100.0 / 0.7)
    assert 40.0 / 100.0 * driven - 0.05 == pytest.approx(40.0 / 100.0 * (2.0 - 1.0 / 0.7))
    # running torque larger than the whole printed loss: the mesh is lossless, not a source of power
    dragging = mesh(dataclasses.replace(sheet, no_load_torque=0.5))
    assert (dragging.driving, dragging.driven) == (1.0, 1.0)
    # without a rated torque nothing can be taken out
    assert mesh(dataclasses.replace(sheet, continuous_torque=None))[:3] == mesh(LOSSY)[:3]


def test_stages_that_hardly_let_a_load_through_multiply_all_the_same() -> None:
    """A twentieth of what drives back comes through; one that locks is held, and the gear behind it drives."""
    alone, behind = mesh_of(as_record(LOSSY)), mesh_of(as_record(dataclasses.replace(LOSSY, stage_driven=0.05)))
    assert behind.driven == pytest.approx(0.05 * alone.driven, rel=1e-12) and behind.driving == alone.driving
    locked = mesh_of(as_record(dataclasses.replace(LOSSY, stage_driven=-0.05)))
    assert locked.driven == pytest.approx(-0.05 * alone.driving, rel=1e-12)


def test_an_unknown_efficiency_is_refused_and_an_ideal_gear_is_lossless() -> None:
    with pytest.raises(InputError, match=r"gear unknown\.efficiency"):
        mesh_input_torque(Gear("unknown", 10.0, kind="planetary"), np.array([1.0]), np.array([1.0]))
    direct = mesh_input_torque(Gear("", 1.0), np.array([3.0, -3.0, 3.0]), np.array([1.0, 1.0, 0.0]))
    np.testing.assert_array_equal(direct, [3.0, -3.0, 3.0])


STIFF = Gear(
    "stiff", 100.0, stiffness_1=10e3, stiffness_2=14e3, stiffness_3=16e3, torque_1=14.0, torque_2=48.0, efficiency=0.8
)


def test_wind_up_is_continuous_with_the_printed_slopes() -> None:
    torque = np.array([1.0, 13.999, 14.001, 47.999, 48.001, 200.0])
    step = 1e-6
    before, after = wind_up(STIFF, torque - step), wind_up(STIFF, torque + step)
    assert before is not None and after is not None
    # rtol: cancellation over a step of 1e-6 N m
    np.testing.assert_allclose((2.0 * step) / (after - before), [10e3, 10e3, 14e3, 14e3, 16e3, 16e3], rtol=1e-5)
    at_bends = wind_up(STIFF, np.array([14.0, 48.0]))
    np.testing.assert_allclose(at_bends, [14.0 / 10e3, 14.0 / 10e3 + 34.0 / 14e3], rtol=1e-14)


def test_wind_up_is_the_same_both_ways() -> None:
    torque = np.linspace(0.0, 100.0, 21)
    np.testing.assert_array_equal(wind_up(STIFF, -torque), -wind_up(STIFF, torque))  # type: ignore[operator]


def test_wind_up_with_fewer_pieces() -> None:
    one = wind_up(dataclasses.replace(STIFF, stiffness_2=None), np.array([100.0]))
    np.testing.assert_allclose(one, [100.0 / 10e3])
    assert wind_up(Gear("rigid", 10.0), np.array([1.0])) is None


def test_average_torque_of_the_worked_cycle() -> None:
    # Sections of 10, 20, 10, 0 rpm lasting 0.2, 3, 0.3, 0.2 s at 150, 82, 130, 0 N m: 89.39 N m by hand.
    torque, speed = np.array([150.0, -82.0, 130.0, 0.0]), np.array([10.0, 20.0, -10.0, 0.0])
    lasting = np.array([0.2, 3.0, 0.3, 0.2])
    assert average_torque(3.0, torque, speed, lasting) == pytest.approx(89.39, abs=0.005)
    # other units of speed and longer sections leave it where it is, and so does a constant load
    assert average_torque(3.0, torque, speed * RPM, 2.0 * lasting) == pytest.approx(89.39, abs=0.005)
    assert average_torque(10.0 / 3.0, np.full(4, -7.0), speed, lasting) == pytest.approx(7.0)
    assert average_torque(3.0, torque, np.zeros(4), lasting) == 0.0


def test_life_scales_from_the_rated_point() -> None:
    gear = Gear("hd", 100.0, kind="strain_wave", rated_life=7000 * HOUR, rated_speed=2000 * RPM, continuous_torque=40.0)
    assert gear_life(gear, 40.0, 2000 * RPM) == pytest.approx(7000 * HOUR)
    assert gear_life(gear, 20.0, 1000 * RPM) == pytest.approx(7000 * HOUR * 8.0 * 2.0)
    assert gear_life(dataclasses.replace(gear, kind="rv"), 20.0, 2000 * RPM) == pytest.approx(
        7000 * HOUR * 2.0 ** (10.0 / 3.0)
    )
    assert gear_life(gear, 0.0, 100.0) == math.inf
    assert gear_life(dataclasses.replace(gear, rated_life=None), 20.0, 100.0) is None


def test_exponents_by_kind_and_by_sheet() -> None:
    assert torque_exponent(Gear("g", 1.0, kind="strain_wave")) == 3.0
    assert torque_exponent(Gear("g", 1.0, kind="rv")) == pytest.approx(10.0 / 3.0)
    assert torque_exponent(Gear("g", 1.0, kind="rv", life_exponent=3.0)) == 3.0


def test_momentary_peaks_by_hand() -> None:
    # 14 rpm out of a 1:120 gear for 0.15 s: 10^4 / (2 * 14/60 * 120 * 0.15) = 1190.
    gear = Gear("hd", 120.0, kind="strain_wave")
    assert momentary_peak_count(gear, -14.0 * RPM, 0.15) == pytest.approx(1190.476, abs=0.001)
    assert momentary_peak_count(gear, 0.0, 0.15) == math.inf


def test_all_faults_of_a_sheet_at_once() -> None:
    with pytest.raises(InputError) as caught:
        Gear("bad", 0.0, kind="wave", efficiency=1.2, backdriving_efficiency=1.1, inertia=-1.0, stiffness_1=0.0)
    places = {fault.place for fault in caught.value.faults}
    fields = "ratio kind efficiency backdriving_efficiency inertia stiffness_1".split()
    assert places == {f"gear bad.{field}" for field in fields}
    assert Gear("locks", 60.0, efficiency=0.4, backdriving_efficiency=-0.2).backdriving_efficiency == -0.2


def test_an_ideal_gear_adds_nothing_that_is_not_stated() -> None:
    bare = complete(Gear("i", 5.0, kind="ideal"))
    assert (bare.efficiency, bare.inertia) == (1.0, 0.0)
    stated = complete(Gear("i", 5.0, kind="ideal", efficiency=0.9, inertia=2e-5))
    assert (stated.efficiency, stated.inertia) == (0.9, 2e-5)


def test_a_gear_without_load_needs_nothing_to_be_held() -> None:
    found = standstill_interval(Gear("p", 10.0, kind="planetary", efficiency=0.9), np.array([0.0, 3.0, -3.0]))
    assert found.hold[0] == 0.0 and found.hold[1] == -found.hold[2] > 0.0
