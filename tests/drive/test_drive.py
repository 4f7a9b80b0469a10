from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from power_balance import power_balance

from drivetrain.drive.drive import (
    Drive,
    MotorTorque,
    book_current,
    drive_inertia,
    motor_torque,
    resting,
    shaft_friction,
)
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, current
from drivetrain.errors import InputError

MOTOR = Motor("m", 0.3, 0.03, rotor_inertia=1.4e-5, no_load_current=0.1)
GEAR = Gear("g", 100.0, kind="strain_wave", efficiency=0.7, inertia=2e-5, no_load_torque=0.004, continuous_torque=40.0)
FULL = Drive(
    MOTOR,
    GEAR,
    joint_friction=Friction(coulomb=0.4, coulomb_negative=0.4, viscous=0.1, static=0.7, stribeck_speed=0.05),
    motor_friction=Friction(coulomb=0.015, viscous=5e-6, static=0.025),
)
BARE = Drive(Motor("m", 0.3, 0.03, rotor_inertia=1.4e-5), dataclasses.replace(GEAR, no_load_torque=None, inertia=None))


def _asked(drive: Drive, torque: float, speed: float, acceleration: float = 0.0, carrier: float = 0.0) -> MotorTorque:
    columns = (np.array([value]) for value in (torque, speed, acceleration, carrier))
    return motor_torque(drive, *columns, standstill=np.array([speed == 0.0]))


def test_losses_act_on_what_crosses_the_mesh_only() -> None:
    asked = _asked(BARE, 30.0, 2.0, acceleration=-50.0, carrier=7.0)
    rotor = 1.4e-5 * (100.0 * -50.0 + 7.0)
    assert asked.rotor[0] == pytest.approx(rotor)
    assert asked.mesh[0] == pytest.approx(30.0 / (0.7 * 100.0))
    assert asked.total[0] == pytest.approx(30.0 / 70.0 + rotor)
    assert _asked(BARE, -30.0, 2.0, acceleration=-50.0).mesh[0] == pytest.approx(-(2.0 - 1.0 / 0.7) * 0.3)


def test_joint_friction_crosses_the_mesh_and_may_turn_the_power_around() -> None:
    drive = dataclasses.replace(BARE, joint_friction=Friction(coulomb=5.0))
    # a load of 3 N m helps, joint friction of 5 N m eats it: the motor still drives
    assert _asked(drive, -3.0, 1.0).mesh[0] == pytest.approx((5.0 - 3.0) / (0.7 * 100.0))
    assert _asked(drive, -8.0, 1.0).mesh[0] == pytest.approx((5.0 - 8.0) * (2.0 - 1.0 / 0.7) / 100.0)


def test_shaft_friction_follows_the_motor_through_a_reversing_gear() -> None:
    reverse = dataclasses.replace(FULL, gear=dataclasses.replace(GEAR, ratio=-100.0))
    forward, backward = _asked(FULL, 10.0, 2.0), _asked(reverse, 10.0, 2.0)
    expected = 0.015 + 5e-6 * 200.0 + 0.004
    assert forward.friction[0] == pytest.approx(expected)
    assert backward.friction[0] == pytest.approx(-expected)
    assert backward.total[0] == pytest.approx(-forward.total[0])


def test_own_friction_replaces_the_sheet() -> None:
    assert shaft_friction(BARE) == Friction()
    assert shaft_friction(Drive(MOTOR, GEAR)).coulomb == pytest.approx(0.003)
    assert shaft_friction(FULL).coulomb == 0.015
    assert drive_inertia(FULL) == pytest.approx(3.4e-5)


def test_at_rest_hold_as_without_loss_and_size_for_starting() -> None:
    asked = _asked(FULL, 20.0, 0.0)
    assert asked.total[0] == pytest.approx(20.0 / 100.0)
    assert asked.friction[0] == 0.0
    driving = 1.0 / 0.7 - 0.004 * 100.0 / 40.0
    assert asked.starting[0] == pytest.approx(driving * 20.7 / 100.0 + 0.025 + 0.004)
    moving = _asked(FULL, 20.0, 0.3)
    assert moving.starting[0] == moving.total[0]


def test_starting_without_a_load_still_breaks_friction_away_in_the_direction_that_follows() -> None:
    speed = np.array([0.0, -0.2, 0.3])
    zeros = np.zeros(3)
    asked = motor_torque(FULL, zeros, speed, zeros, zeros)
    driving = 1.0 / 0.7 - 0.004 * 100.0 / 40.0
    assert asked.starting[0] == pytest.approx(-(driving * 0.7 / 100.0 + 0.025 + 0.004))
    # the motor of a reversing gear starts the other way
    reverse = dataclasses.replace(FULL, gear=dataclasses.replace(GEAR, ratio=-100.0))
    assert motor_torque(reverse, zeros, speed, zeros, zeros).starting[0] == pytest.approx(-asked.starting[0])
    # nothing moves and nothing pulls: nothing to start
    assert motor_torque(FULL, zeros, zeros, zeros, zeros).starting.tolist() == [0.0, 0.0, 0.0]


def test_a_rotor_that_pulls_the_other_way_keeps_the_larger_torque() -> None:
    asked = _asked(FULL, 1.0, 0.0, acceleration=-300.0)
    assert asked.rotor[0] < 0.0
    assert abs(asked.starting[0]) >= abs(asked.total[0])


def test_rounding_is_rest() -> None:
    np.testing.assert_array_equal(resting(np.array([1e-15, 0.0, -2.0, 1e-3])), [True, True, False, False])
    np.testing.assert_array_equal(resting(np.zeros(3)), [True, True, True])
    asked = motor_torque(FULL, np.full(2, 20.0), np.array([1e-15, 2.0]), np.zeros(2), np.zeros(2))
    assert asked.total[0] == _asked(FULL, 20.0, 0.0).total[0]


def test_an_unknown_efficiency_is_refused() -> None:
    with pytest.raises(InputError, match="efficiency"):
        _asked(dataclasses.replace(FULL, gear=dataclasses.replace(GEAR, efficiency=None)), 1.0, 1.0)


# Cases that reproduce the comparison with the book's formula: lossless currents of load and rotor [A] at eta 0.7.
@pytest.mark.parametrize(
    ("load", "rotor", "driving", "book", "right"), [(7.0, 4.0, False, 15.714, 8.0), (6.0, -4.0, True, 2.857, 4.571)]
)
def test_the_books_current_is_wrong_both_ways(
    load: float, rotor: float, driving: bool, book: float, right: float
) -> None:
    constant, ratio = MOTOR.torque_constant, GEAR.ratio
    torque, acceleration = load * constant * ratio, rotor * constant / (1.4e-5 * ratio)
    speed = 1.0 if driving else -1.0
    asked = _asked(BARE, torque, speed, acceleration)
    printed = book_current(BARE, np.array([torque]), np.array([acceleration]), np.zeros(1), 25.0)
    # 0.001: the expected figures are printed to three decimals
    assert printed[0] == pytest.approx(book, abs=0.001)
    assert current(BARE.motor, asked.total, 25.0)[0] == pytest.approx(right, abs=0.001)


MOTIONS = st.tuples(
    st.floats(-200.0, 200.0), st.sampled_from([-3.0, -0.02, 0.02, 3.0]) | st.floats(-5.0, 5.0), st.floats(-40.0, 40.0)
)
RATIOS = st.sampled_from([-160.0, -1.0, 1.0, 50.0, 100.0])
EFFICIENCIES = st.sampled_from([0.3, 0.7, 0.95, 1.0])


def _drive(ratio: float, efficiency: float) -> Drive:
    return dataclasses.replace(FULL, gear=dataclasses.replace(GEAR, ratio=ratio, efficiency=efficiency))


@given(motions=st.lists(MOTIONS, min_size=1, max_size=8), ratio=RATIOS, efficiency=EFFICIENCIES)
def test_power_in_is_power_out_and_losses_and_stored(
    motions: list[tuple[float, float, float]], ratio: float, efficiency: float
) -> None:
    drive = _drive(ratio, efficiency)
    torque, speed, acceleration = np.array(motions).T
    speed = np.where(np.abs(speed) < 1e-6, 0.0, speed)
    asked = motor_torque(drive, torque, speed, acceleration, 0.3 * acceleration)
    balance = power_balance(drive, torque, speed, asked, 120.0, 70.0)
    scale = np.abs(balance.electrical) + np.abs(balance.output) + np.abs(balance.rotor) + balance.copper + 1.0
    # rounding of about ten operations on numbers of this scale
    assert (np.abs(balance.residual) <= 1e-13 * scale).all()
    for loss in (balance.copper, balance.motor_friction, balance.mesh, balance.joint_friction):
        assert (loss >= -1e-13 * scale).all()


@given(motions=st.lists(MOTIONS, min_size=2, max_size=8), ratio=RATIOS, efficiency=EFFICIENCIES)
def test_mirroring_a_motion_mirrors_the_torque(
    motions: list[tuple[float, float, float]], ratio: float, efficiency: float
) -> None:
    drive = _drive(ratio, efficiency)
    torque, speed, acceleration = np.array(motions).T
    one = motor_torque(drive, torque, speed, acceleration, acceleration)
    other = motor_torque(drive, -torque, -speed, -acceleration, -acceleration)
    for name in ("total", "mesh", "rotor", "friction", "starting"):
        np.testing.assert_array_equal(getattr(one, name), -getattr(other, name))
    np.testing.assert_array_equal(
        np.abs(current(drive.motor, one.total, 60.0)), np.abs(current(drive.motor, other.total, 60.0))
    )


def test_mesh_loss_counted_at_the_teeth() -> None:
    # an independent count: torque in times speed in, less torque out times speed out
    rng = np.random.default_rng(5)
    torque, speed = rng.normal(size=100) * 40.0, rng.normal(size=100) * 3.0
    asked = motor_torque(BARE, torque, speed, np.zeros(100), np.zeros(100))
    balance = power_balance(BARE, torque, speed, asked, 25.0, 25.0)
    np.testing.assert_allclose(balance.mesh, asked.mesh * 100.0 * speed - torque * speed, rtol=1e-10, atol=1e-12)


def test_setting_off_asks_the_torque_of_the_motion_not_that_of_holding() -> None:
    """At the first instant of a motion the speed is zero, but the mesh already drives; in a dwell it holds."""
    motor = Motor("m", resistance=1.0, torque_constant=0.05, rotor_inertia=1e-5)
    lossy = Drive(motor, Gear("g", ratio=50.0, kind="planetary", efficiency=0.8, inertia=1e-6))
    load = np.full(7, 20.0)
    speed = np.array([0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    acceleration = np.array([0.0, 0.0, 5.0, 0.0, -5.0, 0.0, 0.0])
    mesh = motor_torque(lossy, load, speed, acceleration, np.zeros(7)).mesh
    drives, holds = 20.0 / (0.8 * 50.0), 20.0 / 50.0
    # lifts off and stops while lifting: driven by the motor at both ends; the rest of the time held as without loss
    np.testing.assert_allclose(mesh, [holds, holds, drives, drives, drives, holds, holds], rtol=1e-12)
