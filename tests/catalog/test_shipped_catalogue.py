"""The shipped catalogue: sources, no prices, even coverage, possible pairs, and drives for typical joints."""

from __future__ import annotations

import csv
import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog, compatible_pairs, read_catalog
from drivetrain.whole_files import shipped

STEPS = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000]
ASSUMED_EFFICIENCY = 0.7  # of strain-wave gears, whose rows give none
OVERLOAD = 3.0  # of the nominal current, for short peaks


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return read_catalog()


def rows(name: str) -> list[dict[str, str]]:
    with (shipped("catalogs") / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_size_and_kinds(catalog: Catalog) -> None:
    assert 130 <= len(catalog.motors) <= 170 and 270 <= len(catalog.gears) <= 330
    motors = Counter((motor.kind, motor.frameless) for motor in catalog.motors.values())
    assert min(motors["brushed", False], motors["brushless", False], motors["brushless", True]) >= 30
    gears = Counter(gear.kind for gear in catalog.gears.values())
    assert gears["planetary"] >= 150 and gears["strain_wave"] >= 70 and gears["rv"] >= 2


@pytest.mark.parametrize("name", ["motors.csv", "gears.csv"])
def test_every_row_is_cited_marked_and_unpriced(name: str) -> None:
    for row in rows(name):
        assert all(row[column] for column in ("maker", "part_number", "source", "edition", "source_quality"))
        assert "confirm against the current data sheet" in row["notes"]
        assert row["price"] == ""
    assert all("index id" not in row["source"] for row in rows(name))


def test_motors_state_the_evidence_of_their_current_basis() -> None:
    for row in rows("motors.csv"):
        assert (row["current_basis"], row["winding_basis"]) == ("dc", "line_line")
        assert row["basis_evidence"]


def test_frameless_constants_can_only_be_per_dc_ampere(catalog: Catalog) -> None:
    """No-load speed over V/kt: slightly below 1 for dc; far below for rms; above 1, which is impossible, for peak."""
    for motor in (m for m in catalog.motors.values() if m.frameless):
        assert motor.nominal_voltage is not None and motor.no_load_speed is not None
        share = motor.no_load_speed * motor.torque_constant / motor.nominal_voltage
        assert 0.92 < share < 0.985
        assert share * math.sqrt(2.0 / 3.0) < 0.81  # if it were rms, friction would take a fifth of the voltage
        assert share * math.sqrt(4.0 / 3.0) > 1.05  # if it were peak, the speed would exceed what the voltage allows


def test_torques_are_covered_evenly(catalog: Catalog) -> None:
    torques = np.array([gear.repeated_peak_torque for gear in catalog.gears.values()], dtype=float)
    for low, high in pairwise(STEPS):
        assert 10 <= np.count_nonzero((torques > low) & (torques <= high)) <= 50


def test_every_housed_motor_has_a_gear_and_every_gear_a_motor(catalog: Catalog) -> None:
    paired_motors, paired_gears = (set(keys) for keys in zip(*compatible_pairs(catalog), strict=True))
    assert {m.key for m in catalog.motors.values() if not m.frameless} <= paired_motors
    assert set(catalog.pairs) == {m.key for m in catalog.motors.values() if not m.frameless}
    alone = {gear.maker for gear in catalog.gears.values() if gear.key not in paired_gears}
    assert alone == {"Beckhoff", "Nabtesco"}  # stated in SOURCES.md


def test_strain_wave_rows_hold_what_their_size_implies(catalog: Catalog) -> None:
    for gear in (g for g in catalog.gears.values() if g.kind == "strain_wave"):
        _, size, ratio, _ = gear.part_number.split("-")
        assert gear.pitch_diameter == pytest.approx(int(size) * 0.1 * 0.0254)
        assert gear.ratio == int(ratio)
        hours = 10_000 if gear.series.startswith(("CSG", "SHG")) else 7_000
        assert gear.rated_life == pytest.approx(hours * 3600.0)
        assert gear.rated_speed == pytest.approx(2000 * 2 * math.pi / 60)
        assert (gear.life_exponent, gear.efficiency) == (3.0, None)


def drivers(catalog: Catalog, peak: float, lasting: float, speed: float, volts: float) -> set[tuple[str, str]]:
    """Pairs with enough peak torque at a joint speed and enough continuous torque, without rotor inertia."""
    found = set()
    for motor_key, gear_key in compatible_pairs(catalog):
        motor, gear = catalog.motors[motor_key], catalog.gears[gear_key]
        efficiency = gear.efficiency or ASSUMED_EFFICIENCY
        assert gear.repeated_peak_torque is not None and motor.nominal_current is not None
        per_ampere = motor.torque_constant * abs(gear.ratio) * efficiency
        voltage = motor.torque_constant * abs(gear.ratio) * speed + motor.resistance * peak / per_ampere
        if (
            gear.repeated_peak_torque >= peak
            and voltage <= 0.95 * volts
            and peak / per_ampere <= OVERLOAD * motor.nominal_current
            and lasting / per_ampere <= motor.nominal_current
            and abs(gear.ratio) * speed <= (gear.max_input_speed or math.inf)
        ):
            found.add((motor_key, gear_key))
    return found


@pytest.mark.parametrize(
    ("peak", "lasting", "speed", "volts"),
    [
        (180.0, 90.0, 3.0, 48.0),  # base joints of a UR5-class arm with 5 kg
        (150.0, 60.0, 3.0, 48.0),
        (28.0, 12.0, 3.0, 48.0),  # its wrists
        (30.0, 15.0, 1.0, 24.0),  # shoulder of a desktop arm with 1 kg
        (12.0, 6.0, 2.0, 24.0),
        (2.0, 1.0, 3.0, 24.0),
        (0.5, 0.2, 3.0, 24.0),
        (75.0, 40.0, 2.0, 48.0),  # a press or a door
        (0.1, 0.05, 5.0, 12.0),
        (500.0, 200.0, 1.0, 48.0),
    ],
)
def test_usual_joints_find_drives(catalog: Catalog, peak: float, lasting: float, speed: float, volts: float) -> None:
    assert len(drivers(catalog, peak, lasting, speed, volts)) >= 5


def test_reading_twice_gives_the_same_order(catalog: Catalog) -> None:
    again = read_catalog(shipped("catalogs"))
    assert (list(again.motors), list(again.gears), list(again.pairs)) == (
        list(catalog.motors), list(catalog.gears), list(catalog.pairs),
    )  # fmt: skip
    assert compatible_pairs(again) == compatible_pairs(catalog)
