"""Numbers in common engineering units (rpm, mN m, degrees Celsius) with a suitable number of digits."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.units import from_si, readable_unit

DASH = "–"  # shown for an unknown number
# SI units of the study's quantities, and the common units in which they are shown
_SPOKEN = {"rad/s": "rpm", "rad": "deg", "rad/s^2": "rad/s^2"}
_PRINTED = {"C": "°C", "degC": "°C", "deg": "°", "ohm": "Ω", "mohm": "mΩ", "uH": "µH", "1": ""}


def shown_unit(largest: float | None, unit: str) -> str:
    """The unit in which values of an SI unit are shown, chosen by the largest; ``C``, ``h`` and ``1`` are kept."""
    if unit in ("", "1", "C", "degC", "h"):
        return unit
    if unit in _SPOKEN:
        return _SPOKEN[unit]
    return unit if largest is None else readable_unit(float(largest), unit)


def convert(values: Any, unit: str, shown: str) -> Array:
    return np.asarray(values, dtype=np.float64) if unit == shown else from_si(values, unit, shown)


def scaled(values: Array, unit: str, *others: float | None) -> tuple[Array, str]:
    """A series of an SI unit converted to the unit that suits the largest of its and the other values; and the unit."""
    known = [abs(other) for other in others if other is not None and math.isfinite(other)]
    largest = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
    shown = shown_unit(max([largest, *known]), unit)
    return convert(values, unit, shown), shown


def printed_unit(unit: str) -> str:
    return _PRINTED.get(unit, unit).replace("ohm", "Ω").replace("^2", "²").replace(" ", "\u00a0")


def number(value: float | None, digits: int = 3) -> str:
    """A number with ``digits`` significant digits, without rounding integer digits; None and NaN give a dash."""
    if value is None or math.isnan(value):
        return DASH
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    size = abs(value)
    if size == 0.0:
        return "0"
    if not 1e-4 <= size < 1e9:
        return re.sub(r"e\+?(-?)0*", r"e\1", f"{value:.{digits - 1}e}").replace("-", "−")
    decimals = max(0, digits - 1 - math.floor(math.log10(size)))
    return f"{value:,.{decimals}f}".replace(",", "\u202f").replace("-", "−")


def with_unit(value: float | None, unit: str, *, shown: str = "") -> str:
    """An SI value with its unit; None gives a dash."""
    if value is None or math.isnan(value):
        return DASH
    chosen = shown or shown_unit(value, unit)
    return f"{number(float(convert(value, unit, chosen)))}\u00a0{printed_unit(chosen)}".strip("\u00a0")


def percent(share: float | None) -> str:
    """A utilisation, 1 at the limit, in per cent; None gives a dash."""
    if share is None or math.isnan(share):
        return DASH
    if math.isinf(share):
        return "∞"
    if share > 1e4:
        return ">\u202f10⁶\u00a0%"
    decimals = 1 if 0.99 < share < 1.01 and share != 1.0 else 0
    return f"{100 * share:,.{decimals}f}\u00a0%".replace(",", "\u202f")


def axis_name(direction: Array) -> str:
    for name, axis in zip("xyz", np.eye(3), strict=True):
        if np.abs(direction - axis).max() < 1e-9:
            return name
    return "along (" + ", ".join(f"{value:.3g}" for value in direction) + ")"
