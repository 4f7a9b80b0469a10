"""Families of gears: laws through rows, sizes for loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import read_catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.matching import fitted_family, ideal_family
from drivetrain.errors import InputError


def rows(rng=None, noise=0.0):
    """Rows that follow laws exactly, or scattered by lognormal noise."""
    found = []
    for torque in (10.0, 20.0, 40.0, 80.0):
        for ratio in (50.0, 100.0, 160.0):
            mass = 0.2 * torque**0.8 * ratio**-0.3
            if rng is not None:
                mass *= np.exp(noise * rng.standard_normal())
            found.append(Gear(
                f"g{torque:g}-{ratio:g}", ratio, kind="strain_wave", series="X", repeated_peak_torque=torque,
                momentary_torque=2.0 * torque, average_torque_limit=0.4 * torque**1.05, mass=mass,
                inertia=1e-7 * torque**1.6, efficiency=0.8,
            ))  # fmt: skip
    return found


def test_exact_laws_are_found_again():
    family = fitted_family("X", rows(), 30.0, 160.0)
    sizes = [row.repeated_peak_torque for row in rows()]
    assert (family.smallest, family.largest) == (min(sizes), max(sizes))
    law = family.laws["mass"]
    assert (law.scale, law.torque, law.ratio) == pytest.approx((0.2, 0.8, -0.3), rel=1e-9)
    assert law.error < 1e-12 and law.rows == 12
    gear = family.gear(70.0, 33.0)
    assert gear.mass == pytest.approx(0.2 * 33.0**0.8 * 70.0**-0.3, rel=1e-9)
    assert gear.ratio == 70.0 and gear.repeated_peak_torque == 33.0 and gear.kind == "strain_wave"
    assert gear.max_input_speed is None  # no row prints it


def test_scatter_is_told():
    rng = np.random.default_rng(5)
    law = fitted_family("X", rows(rng, 0.1), 30.0, 160.0).laws["mass"]
    assert 0.04 < law.error < 0.2  # noise of 0.1, 12 rows, 3 parameters


def test_a_size_is_the_smallest_that_bears_the_load():
    family = fitted_family("X", rows(), 30.0, 160.0)
    size = family.size_for(80.0, peak=25.0, average=30.0)
    assert family.gear(80.0, size).average_torque_limit == pytest.approx(30.0, rel=1e-8)
    assert family.size_for(80.0, peak=50.0, average=1.0) == pytest.approx(50.0, rel=1e-8)
    assert family.size_for(80.0, peak=0.1, average=0.1) == family.smallest == 10.0


def test_one_ratio_has_no_law_of_ratio():
    some = [row for row in rows() if row.ratio == 100.0]
    law = fitted_family("X", some, 30.0, 160.0).laws["mass"]
    assert law.ratio == 0.0 and law.torque == pytest.approx(0.8)


def test_shipped_series_fits_within_a_fifth():
    catalog = read_catalog()
    gears = [row for row in catalog.gears.values() if row.series == "CSG-2UH"]
    family = fitted_family("CSG-2UH", gears, 30.0, 160.0)
    assert family.laws["mass"].error < 0.2 and family.laws["mass"].torque > 0.5
    for row in gears:
        assert family.gear(row.ratio, row.repeated_peak_torque).mass == pytest.approx(row.mass, rel=0.35)


def test_an_ideal_gear_has_no_limit():
    gear = ideal_family(1.0, 1000.0).gear(80.0, 5.0)
    assert gear.kind == "ideal" and gear.repeated_peak_torque is None and gear.efficiency == 1.0


def test_wrong_input_is_told():
    with pytest.raises(InputError, match="needs 4"):
        fitted_family("X", rows()[:3], 30.0, 160.0)
    with pytest.raises(InputError, match="needs 4"):
        fitted_family("X", [replace(row, repeated_peak_torque=None) for row in rows()], 30.0, 160.0)
    for low, high in ((0.0, 10.0), (20.0, 10.0), (1.0, float("inf"))):
        with pytest.raises(InputError, match="range"):
            ideal_family(low, high)
