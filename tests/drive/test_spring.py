"""The spring of a gear undoes its wind-up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.drive.gear import Gear
from drivetrain.drive.spring import answer, gear_spring, tangent_stiffness, wind_up
from drivetrain.errors import InputError

GEARS = [
    Gear("one", 100.0, stiffness_1=2e4),
    Gear("two", 100.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4),
    Gear("three", 100.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4, torque_2=15.0, stiffness_3=3e4),
    Gear("softer", 100.0, stiffness_1=3e4, torque_1=5.0, stiffness_2=2e4, torque_2=15.0, stiffness_3=1e4),
]

GEAR = Gear(
    "hd", 100.0, kind="strain_wave", efficiency=0.7, stiffness_1=3400.0, stiffness_2=4700.0, stiffness_3=5700.0,
    torque_1=2.0, torque_2=6.9,
)  # fmt: skip


@pytest.mark.parametrize("gear", GEARS, ids=lambda gear: gear.key)
def test_spring_undoes_the_wind_up(gear: Gear) -> None:
    spring = gear_spring(gear)
    for torque in (-40.0, -7.0, -1.0, 0.0, 2.0, 4.999, 9.0, 14.0, 16.0, 90.0):
        twist = wind_up(gear, np.array(torque))
        back, slope, energy = answer(spring, float(twist))
        assert back == pytest.approx(torque, rel=1e-12, abs=1e-15)
        assert slope == pytest.approx(float(tangent_stiffness(gear, np.array(torque))), rel=1e-12)
        path = np.linspace(0.0, float(twist), 2001)
        work = np.trapezoid([answer(spring, x)[0] for x in path], path)
        assert energy == pytest.approx(work, rel=1e-5, abs=1e-15)  # trapezoids cut the bends


def test_no_stiffness_is_no_spring() -> None:
    with pytest.raises(InputError, match="stiffness_1"):
        gear_spring(Gear("stiff", 10.0))


@pytest.mark.parametrize(
    "gear",
    [
        GEAR,
        replace(GEAR, stiffness_3=None),
        replace(GEAR, torque_1=None),
        replace(GEAR, stiffness_2=None),
        replace(GEAR, torque_2=None),
    ],
)
def test_it_is_the_slope_of_the_wind_up(gear: Gear) -> None:
    torque = np.array([-20.0, -5.0, -1.0, 0.0, 0.5, 3.0, 6.0, 8.0])  # clear of the bends
    step = 1e-4
    slope = 2 * step / (wind_up(gear, torque + step) - wind_up(gear, torque - step))
    np.testing.assert_allclose(tangent_stiffness(gear, torque), slope, rtol=1e-8)


def test_pieces_by_hand() -> None:
    np.testing.assert_array_equal(
        tangent_stiffness(GEAR, np.array([-7.0, -2.0, 0.0, 2.0, 2.1, 6.9, 7.0])),
        [5700.0, 3400.0, 3400.0, 3400.0, 4700.0, 4700.0, 5700.0],
    )


def test_unknown_stays_unknown() -> None:
    assert tangent_stiffness(replace(GEAR, stiffness_1=None), np.ones(3)) is None
