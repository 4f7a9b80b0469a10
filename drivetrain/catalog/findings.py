"""Findings of the lint in a row, and what its rules share: laws between values, orders, typical unit mistakes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

Values = Mapping[str, float]  # the numbers of a row by column name
Band = tuple[float, float]  # limits of the relative difference between a printed value and what others imply

LIMIT = 0.10  # largest plausible relative difference between a printed value and the one that other values imply
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
    """ERROR: the row cannot be right. WARNING: unusual, compare with the data sheet."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Finding:
    """One fault of a row."""

    column: str  # name of the column
    severity: Severity  # ERROR or WARNING
    problem: str  # message
    # the value that the rest of the row implies, in SI and in the row's convention of current and winding; None if it
    # implies no single value
    predicted: float | None = None


def error(column: str, problem: str, predicted: float | None = None) -> Finding:
    return Finding(column, Severity.ERROR, problem, predicted)


def warning(column: str, problem: str, predicted: float | None = None) -> Finding:
    return Finding(column, Severity.WARNING, problem, predicted)


def numbers(cells: Mapping[str, object]) -> dict[str, float]:
    """The cells of a row that hold a number."""
    return {name: cell for name, cell in cells.items() if isinstance(cell, float)}


ANY = (-math.inf, math.inf)


@dataclass(frozen=True)
class Relation:
    """A printed value that follows from others of the same row."""

    column: str
    law: str  # in words or symbols
    predict: Callable[[Values], float]  # the value that follows; 0: none
    error: Band = (-LIMIT, LIMIT)  # beyond this band the row cannot be right
    warning: Band = ANY  # beyond this band it is unusual


def conflicts(values: Values, relations: Iterable[Relation]) -> Iterator[Finding]:
    """Findings where a printed value is too far from the one that others imply."""
    for one in relations:
        try:
            printed, predicted = values[one.column], one.predict(values)
        except KeyError:  # a value is not printed
            continue
        difference = printed / predicted - 1.0 if predicted else 0.0
        for found, (low, high) in ((error, one.error), (warning, one.warning)):
            if not low <= difference <= high:
                yield found(one.column, differs(difference, one.law), predicted)
                break


def differs(difference: float, law: str) -> str:
    """Message about a relative difference from a law, with the unit mistake that would explain it."""
    hint = slip(1.0 + difference)
    return f"differs by {100.0 * difference:+.1f} % from {law}" + (f"; {hint}" if hint else "")


def in_order(values: Values, *orders: tuple[Callable[..., Finding], str, str, str]) -> Iterator[Finding]:
    """Findings where values are in the wrong order.

    Each order is (``error`` or ``warning``, column of the smaller value, column of the larger value, message).
    """
    for found, smaller, larger, words in orders:
        if smaller in values and larger in values and values[smaller] > values[larger]:
            yield found(smaller, words or f"is larger than the {larger.replace('_', ' ')}")


def slip(ratio: float) -> str:
    """Message about the unit mistake whose factor is nearest to ``ratio``; empty if none is near."""
    size = max(abs(ratio), 1.0 / abs(ratio)) if ratio else 0.0
    factor, words = min(UNIT_SLIPS, key=lambda known: abs(size / known[0] - 1.0))
    return f"about a factor {factor:.4g}: {words}?" if abs(size / factor - 1.0) <= SLIP_TOLERANCE else ""
