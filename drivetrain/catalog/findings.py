"""Findings of the lint about a row, and the limits and unit slips that its rules share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

LIMIT = 0.10  # largest believable difference between a printed value and the one its neighbours imply
UNIT_SLIPS = (
    (60.0 / (2.0 * math.pi), "rpm against rad/s"),
    (1e3, "a prefix, such as m or k"),
    (1e6, "a prefix, such as u or M"),
    (10.0, "a power of ten, such as N cm against mN m"),
    (9.80665, "kgf against N"),
    (2.0, "phase against line-to-line"),
    (math.sqrt(3.0), "phase against line-to-line voltage"),
    (math.sqrt(2.0), "rms against peak"),
    (math.sqrt(1.5), "rms against dc ampere"),
    (math.sqrt(4.0 / 3.0), "peak against dc ampere"),
)
SLIP_TOLERANCE = 0.03


class Severity(StrEnum):
    """ERROR: the row cannot be right. WARNING: unusual, look at the sheet."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Finding:
    """Something wrong with one row."""

    column: str  # where it shows
    severity: Severity  # how sure the rule is
    problem: str  # what is wrong, in words
    # the value the rest of the row implies, in SI and in the row's own convention; None: no single value
    predicted: float | None = None


def error(column: str, problem: str, predicted: float | None = None) -> Finding:
    return Finding(column, Severity.ERROR, problem, predicted)


def warning(column: str, problem: str, predicted: float | None = None) -> Finding:
    return Finding(column, Severity.WARNING, problem, predicted)


def differs(difference: float, law: str) -> str:
    """A difference from a law in words, with the unit slip it may come from."""
    hint = slip(1.0 + difference)
    return f"differs by {100.0 * difference:+.1f} % from {law}" + (f"; {hint}" if hint else "")


def in_order(values: Mapping[str, float], *orders: tuple[Callable[..., Finding], str, str, str]) -> Iterator[Finding]:
    """A finding for each (kind of it, smaller, larger, words) of which the smaller value is the larger."""
    for found, smaller, larger, words in orders:
        if smaller in values and larger in values and values[smaller] > values[larger]:
            yield found(smaller, words or f"is larger than the {larger.replace('_', ' ')}")


def slip(ratio: float) -> str:
    """The unit slip that a wrong value may come from."""
    size = max(abs(ratio), 1.0 / abs(ratio)) if ratio else 0.0
    for factor, words in UNIT_SLIPS:
        if size and abs(size / factor - 1.0) <= SLIP_TOLERANCE:
            return f"about a factor {factor:.4g}: {words}?"
    return ""
