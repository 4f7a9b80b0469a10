"""What a part was offered for: currency, day and shop, and whether it is a list price or an estimate."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.drive.ranges import POSITIVE, range_faults
from drivetrain.errors import InputError

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
        date: When it was seen, as far as the source tells.
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
        faults = range_faults(
            f"price of {self.name}",
            self,
            {"price": POSITIVE, **dict.fromkeys(_OPTIONAL, POSITIVE)},
            required=("price",),
        )
        if faults:
            raise InputError(faults)
