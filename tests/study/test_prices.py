"""Prices of a study: in one currency, from the catalogue's list where a row has none, with what they rest on."""

from __future__ import annotations

import pytest

from drivetrain.catalog.price import Price, offer_of
from drivetrain.errors import InputError
from drivetrain.study.read import load_study

STUDY = """
schema_version: 1
motions: {swing: {table: swing.csv}}
supply: {voltage: 24 V}
objective: price
joints: {axis: {candidates: {motors: {keys: [FH_2250S024BX4]}, pairs: published}}}
%s
"""


def written(tmp_path, more):
    (tmp_path / "swing.csv").write_text("time [s],torque_axis [N m],speed_axis [rad/s]\n0,0.1,0\n1,0.1,0.5\n2,0.1,0\n")
    (tmp_path / "study.yaml").write_text(STUDY % more)
    return load_study(tmp_path / "study.yaml")


def priced(price, currency="EUR", kind="listed", date="2026-01", **more) -> Price:
    return Price("part", price, currency, kind, date, part_key="part", **more)


def test_the_best_offer_is_listed_late_and_at_its_upper_end():
    offers = [
        priced(90.0, kind="estimate", date="2026-09"),
        priced(100.0),
        priced(110.0, date="2026-05", price_to=120.0),
    ]
    found = offer_of(offers, "EUR", {})
    assert found.value == 120.0 and "120 EUR (listed, 2026-05)" in found.words and not found.estimate
    assert offer_of(offers[:1], "EUR", {}).estimate
    assert offer_of([priced(100.0, "USD", shop="a shop")], "EUR", {}) is None
    converted = offer_of([priced(100.0, "USD", shop="a shop")], "EUR", {"USD": 0.9})
    assert converted.value == pytest.approx(90.0) and "100 USD at 0.9, listed, 2026-01, a shop" in converted.words


def test_a_row_without_a_price_takes_that_of_the_list(tmp_path):
    plain, own = written(tmp_path, ""), written(tmp_path, "prices: {currency: USD}")
    assert plain.catalog.motors["FH_2250S024BX4"].price is None and plain.prices.currency == ""
    row = own.catalog.motors["FH_2250S024BX4"]
    assert row.price == 238.2 and "price 238.2 USD (listed, 2026" in row.source
    assert any("1 rows without a price" in note for note in own.notes)
    converted = written(tmp_path, "prices: {currency: EUR, rates: {USD: 0.9}}").catalog.motors["FH_2250S024BX4"]
    assert converted.price == pytest.approx(0.9 * 238.2) and "238.2 USD at 0.9" in converted.source


@pytest.mark.parametrize(
    ("prices", "told"),
    [
        ("{currency: EUR}", "needs USD: the price of FH_2250S024BX4"), ("{currency: euro}", "three capital letters"),
        ("{rates: {USD: 1}}", "currency"), ("{currency: EUR, rates: {USD: -1}}", "rates"),
    ],
)  # fmt: skip
def test_currencies_are_never_mixed_silently(tmp_path, prices, told):
    with pytest.raises(InputError) as error:
        written(tmp_path, f"prices: {prices}")
    assert told in str(error.value)
