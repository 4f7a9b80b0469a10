"""Brakes, amplifiers and prices: read in SI, refused without their conventions, checked for consistency."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path

import pytest

from drivetrain.catalog.linting import check_amplifier, check_brake, check_price, lint
from drivetrain.catalog.read import Catalog, read_catalog
from drivetrain.catalog.table import Cell
from drivetrain.drive.amplifier import limits_of
from drivetrain.errors import InputError
from drivetrain.whole_files import shipped

BRAKES = "key,torque_side,static_torque [Nm],voltage [V],power [W],current [A],inertia [kg cm^2],release_time [ms]\n"
AMPLIFIERS = "key,current_basis,continuous_current [A],peak_current [A],peak_time [s],min_voltage [V],max_voltage [V]\n"
PRICES = "part_key,name,price,price_to,currency,kind,date,source\n"


def table(folder: Path, name: str, text: str) -> Path:
    """A folder with one table."""
    (folder / name).write_text(text, encoding="utf-8")
    return folder


def test_a_brake_is_read_in_si(tmp_path: Path) -> None:
    catalog = read_catalog(table(tmp_path, "brakes.csv", BRAKES + "B,motor,1.42,24,8.4,0.35,0.011,35\n"))
    brake = catalog.brakes["B"]
    assert (brake.static_torque, brake.torque_side) == (1.42, "motor")
    assert (brake.inertia, brake.release_time) == pytest.approx((1.1e-6, 0.035))
    assert brake.mass is None and brake.kind == "" and not catalog.motors


@pytest.mark.parametrize(
    ("basis", "factor"), [("dc", 1.0), ("rms", math.sqrt(1.5)), ("peak", math.sqrt(1.5) / math.sqrt(2.0))]
)
def test_an_amplifier_is_read_in_dc_amperes_whatever_it_prints(tmp_path: Path, basis: str, factor: float) -> None:
    sheet = read_catalog(table(tmp_path, "amplifiers.csv", AMPLIFIERS + f"A,{basis},5,10,3,10,50\n")).amplifiers["A"]
    assert (sheet.continuous_current, sheet.peak_current) == pytest.approx((5.0 * factor, 10.0 * factor))
    limits = limits_of(sheet)
    assert (limits.peak_current, limits.continuous_current) == (sheet.peak_current, sheet.continuous_current)


def test_one_amplifier_in_all_conventions_is_one_amplifier() -> None:
    """Beckhoff prints one power stage with 6.364 A amplitude and another of the same family with 4.5 A rms."""
    sheets = read_catalog().amplifiers
    one, other = sheets["beckhoff_EL7411"], sheets["beckhoff_ELM7211"]
    assert one.continuous_current == pytest.approx(other.continuous_current, rel=1e-4)
    assert one.peak_current == pytest.approx(other.peak_current, rel=1e-4)


def test_an_amplifier_without_its_convention_is_refused_with_the_reason(tmp_path: Path) -> None:
    folder = table(tmp_path, "amplifiers.csv", AMPLIFIERS + "A,,5,10,3,10,50\nB,amplitude,5,10,3,10,50\n")
    with pytest.raises(InputError) as refused:
        read_catalog(folder)
    message = str(refused.value)
    assert "row 2" in message and "41 %" in message and "not guessed" in message
    assert "row 3" in message and "dc, rms, peak" in message
    assert [fault.row for fault in lint(folder) if fault.column == "current_basis"] == [2, 3]


def test_a_brake_without_its_side_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="differ by the ratio"):
        read_catalog(table(tmp_path, "brakes.csv", BRAKES + "B,,1.42,24,8.4,0.35,0.011,35\n"))


def test_prices_add_up_over_folders_and_need_no_part(tmp_path: Path) -> None:
    folder = table(tmp_path, "prices.csv", PRICES + ",thing,10,,EUR,listed,2026-06,s\nM,it,10,20,USD,estimate,2025,s\n")
    prices = read_catalog(folder, folder).prices
    assert [price.name for price in prices] == ["thing", "it"] * 2
    assert (prices[1].price, prices[1].price_to, prices[1].currency, prices[1].part_key) == (10.0, 20.0, "USD", "M")


@pytest.mark.parametrize("missing", ["price", "currency", "kind", "date", "name"])
def test_a_price_without_currency_day_or_kind_is_refused(tmp_path: Path, missing: str) -> None:
    row = {"part_key": "", "name": "it", "price": "10", "price_to": "", "currency": "EUR", "kind": "listed"}
    row |= {"date": "2026", "source": "s", missing: ""}
    with pytest.raises(InputError, match=missing):
        read_catalog(table(tmp_path, "prices.csv", PRICES + ",".join(row.values()) + "\n"))


def test_a_price_must_name_a_part_that_exists(tmp_path: Path) -> None:
    table(tmp_path, "prices.csv", PRICES + "B,it,10,,EUR,listed,2026,s\nC,it,10,,EUR,listed,2026,s\n")
    assert lint(tmp_path) == []  # without a table of parts the key cannot be checked
    table(tmp_path, "brakes.csv", BRAKES.strip() + ",source,edition\nB,motor,1.42,24,8.4,0.35,0.011,35,s,e\n")
    assert [(fault.row, fault.printed) for fault in lint(tmp_path)] == [(3, "C")]


SOUND_BRAKE: dict[str, Cell] = {
    "voltage": 24.0, "current": 0.38, "power": 9.0, "energy_per_stop": 64.0, "energy_per_hour": 640.0,
}  # fmt: skip
SOUND_AMPLIFIER: dict[str, Cell] = {
    "continuous_current": 5.0, "peak_current": 15.0, "peak_time": 3.0, "min_voltage": 10.0, "max_voltage": 50.0,
    "basis_evidence": "printed",
}  # fmt: skip
SOUND_PRICE: dict[str, Cell] = {"price": 713.0, "price_to": 1027.0, "currency": "EUR", "date": "2026-06"}


@pytest.mark.parametrize(
    ("change", "column", "severity"),
    [
        ({"power": 12.0}, "power", "error"),
        ({"current": 0.038}, "power", "error"),
        ({"energy_per_hour": 6.4}, "energy_per_stop", "error"),
    ],
)
def test_each_rule_of_brakes(change: Mapping[str, Cell], column: str, severity: str) -> None:
    assert check_brake(SOUND_BRAKE) == []
    assert [(f.column, f.severity.value) for f in check_brake({**SOUND_BRAKE, **change})] == [(column, severity)]


@pytest.mark.parametrize(
    ("change", "column", "severity"),
    [
        ({"peak_current": 4.0}, "continuous_current", "error"),
        ({"min_voltage": 60.0}, "min_voltage", "error"),
        ({"thermal_time_constant": 3.5}, "peak_time", "warning"),
        ({"basis_evidence": None}, "basis_evidence", "warning"),
    ],
)
def test_each_rule_of_amplifiers(change: Mapping[str, Cell], column: str, severity: str) -> None:
    assert check_amplifier(SOUND_AMPLIFIER) == []
    found = [(f.column, f.severity.value) for f in check_amplifier({**SOUND_AMPLIFIER, **change})]
    assert found == [(column, severity)]


@pytest.mark.parametrize(
    ("change", "column", "severity"),
    [
        ({"price_to": 7.0}, "price", "error"),
        ({"currency": "Euro"}, "currency", "error"),
        ({"date": "last week"}, "date", "warning"),
    ],
)
def test_each_rule_of_prices(change: Mapping[str, Cell], column: str, severity: str) -> None:
    assert check_price(SOUND_PRICE) == check_price({**SOUND_PRICE, "date": "not dated (project page)"}) == []
    assert [(f.column, f.severity.value) for f in check_price({**SOUND_PRICE, **change})] == [(column, severity)]


# ---------------------------------------------------------------- the shipped rows


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return read_catalog()


def test_number_of_shipped_rows(catalog: Catalog) -> None:
    assert (len(catalog.brakes), len(catalog.amplifiers), len(catalog.prices)) == (25, 8, 177)
    assert sum(price.kind == "listed" for price in catalog.prices) == 113
    assert {price.currency for price in catalog.prices} == {"EUR", "USD"}


@pytest.mark.parametrize("name", ["brakes.csv", "amplifiers.csv", "prices.csv"])
def test_every_row_is_cited(name: str) -> None:
    with (shipped("catalogs") / name).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        assert row["source"] and row["source_quality"][:2] in ("A:", "B:", "C:")
        assert "index id" not in row["source"]
        assert name == "prices.csv" or "confirm against the current data sheet" in row["notes"]


def test_makers_ask_for_the_torque_that_they_print(catalog: Catalog) -> None:
    """PI's motor brake is the B&R brake of size 2: torque and power are equal."""
    one, other = catalog.brakes["PI_L-417"], catalog.brakes["BR_8JSA_2"]
    assert (one.static_torque, one.power) == (other.static_torque, other.power) == (1.42, 8.4)
