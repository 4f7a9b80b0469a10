"""Axes as numbers: where a value stands on the picture, which ticks it gets, how wide a text is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array

FONT = "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif"
_WIDE = 30.0  # [points] of a decade that has room for fine lines
_SPARE = 1.04  # of the width of a text: fonts differ from machine to machine
_WIDTHS = {  # thousandths of the font size, of Helvetica
    " !,./:;I[]|\u202f\u00a0": 278, "'ijl": 222, "ft()-r\u00b0": 333, "cksvxyzJ": 500, "+<=>~\u2212": 584, "FTZ": 611,
    "ABEKPSVXY&": 667, "CDHNRUw": 722, "GOQ": 778, "Mm": 833, "W%": 920,
}  # fmt: skip
_WIDTH = {letter: width for letters, width in _WIDTHS.items() for letter in letters}
_OTHER = 556


def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """About how wide a text is.

    Args:
        size: Of the font [points].

    Returns:
        [points]; rather too wide than too narrow.
    """
    return size * _SPARE * (1.06 if bold else 1.0) * sum(_WIDTH.get(letter, _OTHER) for letter in text) / 1000.0


@dataclass(frozen=True)
class Scale:
    """From values to places along one side of a picture.

    Attributes:
        low, high: Values at its two ends.
        start, end: Places of the ends [points].
        logarithmic: Equal ratios are equally long.
    """

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool = False

    def at(self, values: Any) -> Array:
        """Where values stand.

        Returns:
            Places [points], same shape.
        """
        given = np.asarray(values, dtype=np.float64)
        if self.logarithmic:
            share = np.log(np.maximum(given, 1e-300) / self.low) / math.log(self.high / self.low)
        else:
            share = (given - self.low) / ((self.high - self.low) or 1.0)
        return np.asarray(self.start + share * (self.end - self.start))

    def holds(self, value: float) -> bool:
        """Whether a value lies between the ends."""
        return min(self.low, self.high) <= value <= max(self.low, self.high)

    def ticks(self, spacing: float) -> list[float]:
        """Round values to be written beside the scale.

        Args:
            spacing: About how far two should be apart, at least [points].
        """
        if self.logarithmic:
            every = math.ceil(spacing / self._decade)
            parts = (1.0, 2.0, 5.0) if self._decade >= 2.0 * spacing else (1.0,)
            return [value for value in self._decades(parts, every) if self._inside(value)]
        step = round_step((self.high - self.low) * spacing / max(abs(self.end - self.start), 1e-9))
        if step <= 0.0:
            return [self.low]
        first = math.ceil(self.low / step - 1e-9)
        count = math.floor(self.high / step + 1e-9) - first + 1
        return [round((first + i) * step, 12) + 0.0 for i in range(max(count, 0))]

    def between(self) -> list[float]:
        """Values for fine lines between the ticks of a logarithmic scale."""
        if not self.logarithmic or self._decade < _WIDE:
            return []
        return [v for v in self._decades((2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)) if self._inside(v)]

    def texts(self, values: list[float]) -> list[str]:
        """Ticks as texts, with equally many decimals on a plain scale, with as many as it takes on a log scale."""
        return [tick_texts([value])[0] for value in values] if self.logarithmic else tick_texts(values)

    @property
    def _decade(self) -> float:
        """Length of a decade of a logarithmic scale [points]."""
        return abs(self.end - self.start) / math.log10(self.high / self.low)

    def _decades(self, parts: tuple[float, ...], every: int = 1) -> list[float]:
        first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
        return [part * 10.0**power for power in range(first, last + 1) if power % every == 0 for part in parts]

    def _inside(self, value: float) -> bool:
        return self.low * (1.0 - 1e-9) <= value <= self.high * (1.0 + 1e-9)


def round_step(wanted: float) -> float:
    """The next 1, 2, 2.5 or 5 times a power of ten."""
    if wanted <= 0.0 or not math.isfinite(wanted):
        return 0.0
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(part * power for part in (1.0, 2.0, 2.5, 5.0, 10.0) if part * power >= wanted * (1.0 - 1e-9))


def tick_texts(values: list[float]) -> list[str]:
    """Ticks as texts with equally many decimals."""
    decimals = max((_decimals(value) for value in values), default=0)
    grouped = max((abs(value) for value in values), default=0.0) >= 1e4
    texts = [f"{value:,.{decimals}f}" if grouped else f"{value:.{decimals}f}" for value in values]
    return [text.replace(",", "\u202f").replace("-", "\u2212") for text in texts]


def _decimals(value: float) -> int:
    """How many decimals a round value needs."""
    return next((d for d in range(6) if abs(value * 10**d - round(value * 10**d)) < 1e-6 * max(1.0, abs(value))), 6)


def padded(values: Array, share: float = 0.05) -> tuple[float, float]:
    """Ends of a scale with some room beyond the smallest and largest value."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    room = share * (high - low)
    if room <= 1e-9 * max(abs(low), abs(high)):
        room = 0.05 * max(abs(low), abs(high)) or 1.0
    return low - room, high + room
