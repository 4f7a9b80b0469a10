"""Output bearings: the worked example of the pan of the UR5, and the law against its printed cases."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.catalog.read import read_catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.output_bearing import bearing_life, equivalent_load, static_safety

GEAR = Gear("G", 100.0, bearing_dynamic_rating=5290.0, bearing_static_rating=7550.0, bearing_pitch_diameter=0.0425)


@pytest.mark.parametrize(
    ("moment", "radial", "axial", "load"),
    [
        (0.0, 100.0, 0.0, 100.0),
        (21.25, 0.0, 0.0, 1000.0),
        (21.25, 500.0, 1000.0, 1500.0 + 450.0),  # axial within 1.5 of what stands across: x = 1, y = 0.45
        (0.0, 100.0, 1000.0, 0.67 * 1100.0),  # beyond it: both 0.67
        (-21.25, 500.0, -1000.0, 1950.0),
    ],
)
def test_equivalent_load(moment: float, radial: float, axial: float, load: float) -> None:
    assert equivalent_load(GEAR, np.array(moment), np.array(radial), np.array(axial)) == pytest.approx(load)


def test_both_cases_meet_at_the_printed_switch() -> None:
    across = 1000.0
    below = equivalent_load(GEAR, np.array(0.0), np.array(across), np.array(1.5 * across - 1e-6))
    assert below == pytest.approx(across + 0.45 * 1.5 * across) == pytest.approx(0.67 * 2.5 * across)


def test_life_of_a_steady_load_is_the_printed_formula() -> None:
    """10^6/(60 n) (C/(fw P))^(10/3) hours at n turns a minute."""
    rpm, load, factor = 15.0, 1200.0, 1.3
    speed = np.full(5, rpm * 2.0 * math.pi / 60.0) * np.array([1, -1, 1, 1, -1])
    found = bearing_life(GEAR, np.full(5, load), speed, np.ones(5), load_factor=factor)
    hours = 1e6 / (60.0 * rpm) * (5290.0 / (factor * load)) ** (10.0 / 3.0)
    assert found == pytest.approx(hours * 3600.0)
    paused = bearing_life(
        GEAR, np.append(np.full(5, load), 9e3), np.append(speed, 0.0), np.append(np.ones(5), 5.0), load_factor=factor
    )
    assert paused == pytest.approx(2.0 * hours * 3600.0)  # half of the time at rest, where no load counts


def test_what_stands_still_or_is_free_lives_for_ever() -> None:
    assert bearing_life(GEAR, np.array([9e3]), np.array([0.0]), np.array([1.0]), load_factor=1.2) == math.inf
    assert bearing_life(GEAR, np.array([0.0]), np.array([1.0]), np.array([1.0]), load_factor=1.2) == math.inf
    assert static_safety(GEAR, np.zeros(2), np.zeros(2), np.zeros(2)) == math.inf


def test_static_safety_of_the_pan_of_the_ur5_example() -> None:
    """116.4 N m, 83 N and 250 N on a CSG-17: 7550 / (83 + 5478 + 110) = 1.33."""
    gear = read_catalog().gears["hd_CSG-17-100-2UH"]
    found = static_safety(gear, np.array([20.0, 116.42]), np.array([83.1, 10.0]), np.array([-249.6, 0.0]))
    assert found == pytest.approx(1.331, abs=2e-3)


def test_unknown_ratings_give_no_answer() -> None:
    bare, one = Gear("G", 100.0), np.ones(1)
    assert equivalent_load(bare, one, one, one) is None
    assert static_safety(bare, one, one, one) is None
    assert bearing_life(bare, one, one, one, load_factor=1.2) is None
