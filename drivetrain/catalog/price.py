"""Prices of parts: currency, date and shop, and whether it is a list price or an estimate."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from drivetrain.drive.ranges import POSITIVE, range_faults
from drivetrain.errors import raise_faults

PRICE_KINDS = ("listed", "estimate")
_OPTIONAL = ("price_to", "rated_torque", "peak_torque", "ratio")


@dataclass(frozen=True)
class Price:
    """One price of one part.

    Attributes:
        name: Name of the part as the shop or the survey gives it.
        price: In units of the currency; the lower end if a range is given.
        currency: Code of three letters.
        kind: ``listed`` or ``estimate``.
        date: Date of the price, as far as the source states it.
        price_to: Upper end of a range; None: a single price.
        part_key: Key of the part in this catalogue; empty: the part is not in it.
        category: Kind of part, such as ``gear`` or ``joint module: harmonic``.
        maker: Manufacturer, as printed.
        rated_torque, peak_torque: Torques of the part, for comparison [N m].
        ratio: Ratio of its gear.
        shop: Seller, and what the price includes.
        source: File and row, and where it was read.
    """

    name: str
    price: float
    currency: str
    kind: str
    date: str
    price_to: float | None = None
    part_key: str = ""
    category: str = ""
    maker: str = ""
    rated_torque: float | None = None
    peak_torque: float | None = None
    ratio: float | None = None
    shop: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        ranges = dict.fromkeys(("price", *_OPTIONAL), POSITIVE)
        raise_faults(range_faults(f"price of {self.name}", self, ranges, required=("price",)))


@dataclass(frozen=True)
class Offer:
    """Price of a part converted to a currency, and a text that states its origin."""

    value: float
    words: str
    estimate: bool


def offer_of(prices: Iterable[Price], currency: str, rates: Mapping[str, float]) -> Offer | None:
    """The price to use for a part: list prices before estimates, then the latest one; of a range the upper end.

    ``rates`` are the factors from other currencies to the wanted one; prices in currencies without a rate are ignored.
    """
    known = [one for one in prices if one.currency == currency or one.currency in rates]
    if not known:
        return None
    best = max(known, key=lambda one: (one.kind == "listed", one.date))
    printed, rate = best.price_to or best.price, 1.0 if best.currency == currency else rates[best.currency]
    converted = "" if best.currency == currency else f"{printed:g} {best.currency} at {rate:g}, "
    shop = f", {best.shop}" if best.shop else ""
    words = f"price {printed * rate:.6g} {currency} ({converted}{best.kind}, {best.date}{shop})"
    return Offer(printed * rate, words, best.kind == "estimate")
