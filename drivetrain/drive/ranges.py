"""Permitted ranges of the values of a data sheet, and the faults of values outside them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from drivetrain.arrays import axes_of
from drivetrain.errors import LARGEST, Fault


@dataclass(frozen=True)
class Range:
    """Permitted range of a value."""

    words: str  # the range as text for a user
    # ends of the range, in the unit of the value
    low: float = -math.inf
    high: float = math.inf
    low_included: bool = False  # whether ``low`` itself is allowed; ``high`` always is

    def holds(self, value: float) -> bool:
        """Whether a number lies in the range and is not too large to calculate with."""
        above = value >= self.low if self.low_included else value > self.low
        return abs(value) <= LARGEST and above and value <= self.high


POSITIVE = Range("must be greater than 0", low=0.0)
NOT_NEGATIVE = Range("must be 0 or more", low=0.0, low_included=True)
FINITE = Range("must be a finite number")
EFFICIENCY = Range("must be greater than 0 and at most 1", low=0.0, high=1.0)
TEMPERATURE = Range("must be in degrees Celsius above absolute zero (-273.15)", low=-273.15)


def range_faults(
    owner: str, record: object, ranges: Mapping[str, Range], *, required: Collection[str] = ()
) -> list[Fault]:
    """A fault for every field of a record that is not a number in its range."""
    faults = []
    for name, allowed in ranges.items():
        value = getattr(record, name)
        if value is None:
            if name in required:
                faults.append(Fault(f"{owner}.{name}", "is needed", hint=allowed.words))
        elif not is_number_in(allowed, value):
            hint = "a number in SI, without a unit" if isinstance(value, str) else ""
            faults.append(Fault(f"{owner}.{name}", allowed.words, value, hint))
    return faults


def is_number_in(allowed: Range, value: object) -> bool:
    if isinstance(value, float):  # the most frequent case: thousands per catalogue
        return allowed.holds(value)
    if isinstance(value, (bool, str)) or axes_of(value) != 0:
        return False
    try:
        return allowed.holds(float(value))  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return False
