"""Output bearings: the worked example of the pan of the UR5, and the laws against their printed cases."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.catalog.read import read_catalog
from drivetrain.drive.gear import Gear, bearing_arm, bearing_life, equivalent_load, moment_square, static_load


@pytest.mark.parametrize(
    ("moment", "radial", "axial", "load"),
    [
        (0.0, 100.0, 0.0, 100.0),
        (21.25, 0.0, 0.0, 1000.0),
        (21.25, 500.0, 1000.0, 1500.0 + 450.0),  # axial within 1.5 of what stands across: x = 1, y = 0.45
        (0.0, 100.0, 1000.0, 0.67 * 1100.0),  # beyond it: both 0.67
    ],
)
def test_equivalent_load(moment: float, radial: float, axial: float, load: float) -> None:
    assert equivalent_load(0.0425, moment, radial, axial) == pytest.approx(load)


def test_both_cases_meet_at_the_printed_switch() -> None:
    across = 1000.0
    below = equivalent_load(0.0425, 0.0, across, 1.5 * across - 1e-6)
    assert below == pytest.approx(across + 0.45 * 1.5 * across) == pytest.approx(0.67 * 2.5 * across)


def test_life_of_a_steady_load_is_the_printed_formula() -> None:
    """10^6/(60 n) (C/(fw P))^(10/3) hours at n turns a minute."""
    rpm, load, factor = 15.0, 1200.0, 1.3
    found = bearing_life(5290.0, factor, load, rpm * 2.0 * math.pi / 60.0)
    assert found == pytest.approx(3600.0 * 1e6 / (60.0 * rpm) * (5290.0 / (factor * load)) ** (10.0 / 3.0))


def test_static_safety_of_the_pan_of_the_ur5_example() -> None:
    """116.4 N m, 83 N and 250 N on a CSG-17: 7550 / (83 + 5478 + 110) = 1.33."""
    gear = read_catalog().gears["hd_CSG-17-100-2UH"]
    assert gear.bearing_static_rating is not None and gear.bearing_pitch_diameter is not None
    load = static_load(gear.bearing_pitch_diameter, 116.42, 83.1, 249.6)
    assert gear.bearing_static_rating / load == pytest.approx(1.331, abs=2e-3)


def test_the_moment_is_moved_to_the_worse_side() -> None:
    """Against the wrench carried over by the cross product, for either side."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        moment, force, arm = rng.normal(size=3), 5.0 * rng.normal(size=3), float(rng.uniform(0.0, 0.2))
        moved = [moment - np.cross([0.0, 0.0, side * arm], force) for side in (1.0, -1.0)]
        worse = max(float(np.hypot(*one[:2])) for one in moved)
        assert math.sqrt(moment_square(arm, *moment[:2], *force[:2])) == pytest.approx(worse, rel=1e-12)


def test_where_the_centre_lies() -> None:
    assert bearing_arm(Gear("G", 100.0)) == 0.0
    assert bearing_arm(Gear("G", 100.0, bearing_offset=0.01)) == 0.01
    assert bearing_arm(Gear("G", 100.0, bearing_offset=0.01, bearing_pitch_diameter=0.04)) == 0.01
    assert bearing_arm(Gear("G", 100.0, bearing_pitch_diameter=0.04)) is None
