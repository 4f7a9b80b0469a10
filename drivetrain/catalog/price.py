"""What a part was offered for: currency, day and shop, and whether it is a list price or an estimate."""

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
        name: The part as the shop or the survey calls it.
        price: In the currency; the lower end where a range was given.
        currency: Three letters.
        kind: ``listed`` or ``estimate``.
        date: When it was seen, as far as the source states.
        price_to: The upper end of a range; None: one price.
        part_key: Key of the part in this catalogue; empty: it is not in it.
        category: What it is, such as ``gear`` or ``joint module: harmonic``.
        maker: As printed.
        rated_torque, peak_torque: Of the part, to compare by [N m].
        ratio: Of its gear.
        shop: Where, and what the figure includes.
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
        raise_faults(
            range_faults(
                f"price of {self.name}",
                self,
                {"price": POSITIVE, **dict.fromkeys(_OPTIONAL, POSITIVE)},
                required=("price",),
            )
        )


@dataclass(frozen=True)
class Offer:
    """What a part costs in a wanted currency, and in words where that is from."""

    value: float
    words: str
    estimate: bool


def offer_of(prices: Iterable[Price], currency: str, rates: Mapping[str, float]) -> Offer | None:
    """The price of a part by its best offer: listed before estimated, of those the latest, at its upper end."""
    known = [one for one in prices if one.currency == currency or one.currency in rates]
    if not known:
        return None
    best = max(known, key=lambda one: (one.kind == "listed", one.date))
    printed, rate = best.price_to or best.price, 1.0 if best.currency == currency else rates[best.currency]
    converted = "" if best.currency == currency else f"{printed:g} {best.currency} at {rate:g}, "
    shop = f", {best.shop}" if best.shop else ""
    words = f"price {printed * rate:.6g} {currency} ({converted}{best.kind}, {best.date}{shop})"
    return Offer(printed * rate, words, best.kind == "estimate")
