from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.drive.gear import Gear, wind_up
from drivetrain.drive.gear_stiffness import tangent_stiffness

GEAR = Gear(
    "hd", 100.0, kind="strain_wave", efficiency=0.7, stiffness_1=3400.0, stiffness_2=4700.0, stiffness_3=5700.0,
    torque_1=2.0, torque_2=6.9,
)  # fmt: skip


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
