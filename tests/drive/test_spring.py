"""The spring of a gear undoes its wind-up."""

import numpy as np
import pytest

from drivetrain.drive.gear import Gear, wind_up
from drivetrain.drive.gear_stiffness import tangent_stiffness
from drivetrain.drive.spring_kernel import spring, spring_numbers
from drivetrain.errors import InputError

GEARS = [
    Gear("one", 100.0, stiffness_1=2e4),
    Gear("two", 100.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4),
    Gear("three", 100.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=2e4, torque_2=15.0, stiffness_3=3e4),
    Gear("softer", 100.0, stiffness_1=3e4, torque_1=5.0, stiffness_2=2e4, torque_2=15.0, stiffness_3=1e4),
]


@pytest.mark.parametrize("gear", GEARS, ids=lambda gear: gear.key)
def test_spring_undoes_the_wind_up(gear: Gear) -> None:
    numbers = spring_numbers(gear)
    for torque in (-40.0, -7.0, -1.0, 0.0, 2.0, 4.999, 9.0, 14.0, 16.0, 90.0):
        twist = wind_up(gear, np.array(torque))
        answer, slope, energy = spring(*numbers, float(twist))
        assert answer == pytest.approx(torque, rel=1e-12, abs=1e-15)
        assert slope == pytest.approx(float(tangent_stiffness(gear, np.array(torque))), rel=1e-12)
        path = np.linspace(0.0, float(twist), 2001)
        work = np.trapezoid([spring(*numbers, x)[0] for x in path], path)
        assert energy == pytest.approx(work, rel=1e-5, abs=1e-15)  # trapezoids cut the bends


def test_no_stiffness_is_no_spring() -> None:
    with pytest.raises(InputError, match="stiffness_1"):
        spring_numbers(Gear("stiff", 10.0))
