"""A hard case: measured the naive way and ours, held to one criterion, and told in a table from the same numbers.

A test of this folder is a function without arguments that returns figures, under the decorator ``hard_case``. As a
test it passes when every figure meets its criterion our way and at least one figure misses it the naive way, so the
table (``table.py``) can show nothing that the tests do not hold.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Figure:
    """One number of a case, both ways.

    Attributes:
        what: The number, in words.
        ours: What the package gives [unit].
        naive: What the naive way gives [unit]; NaN where it gives no number at all, None where there is no naive way.
        at_most, at_least: The criterion: exactly one of them [unit].
        unit: Empty for a relative error or a count.
        naive_says: Words in place of the naive number, such as the error it ends in.
    """

    what: str
    ours: float
    naive: float | None = None
    at_most: float | None = None
    at_least: float | None = None
    unit: str = ""
    naive_says: str = ""

    def __post_init__(self) -> None:
        if (self.at_most is None) == (self.at_least is None):
            raise ValueError(f"{self.what}: give at_most or at_least")

    def met_by(self, value: float) -> bool:
        """Whether a number meets the criterion; NaN never does."""
        return value <= self.at_most if self.at_most is not None else value >= (self.at_least or 0.0)

    def criterion(self) -> str:
        """The criterion, in words."""
        if self.at_most is None:
            return f"at least {self.told(self.at_least or 0.0)}"
        return f"at most {self.told(self.at_most)}" if self.at_most else "must be 0"

    def told(self, value: float) -> str:
        """A number with its unit."""
        return f"{short(value)} {self.unit}".strip() if math.isfinite(value) else short(value)


Measure = Callable[[], Sequence[Figure]]


@dataclass(frozen=True)
class Case:
    """A case of the table.

    Attributes:
        id: Such as T06; T23a and T23b are two parts of one.
        title: What is hard, in a few words.
        setup: The problem with its numbers, in sentences.
        naive: The simple method that fails, in words.
        measure: Gives the figures.
    """

    id: str
    title: str
    setup: str
    naive: str
    measure: Measure = field(repr=False)

    def row(self) -> str:
        """The case as a row of a Markdown table, measured afresh."""
        figures = self.measure()
        check(self.id, figures)
        results = [f.naive_says or f"{f.what}: {f.told(f.naive)}" for f in figures if f.naive is not None]
        ours = "; ".join(f"{f.what}: {f.told(f.ours)} ({f.criterion()})" for f in figures)
        naive = "; ".join(dict.fromkeys(results))
        return f"| {self.id} | {self.title}. {self.setup} | {self.naive}; result: {naive} | {ours} |"


CASES: dict[str, Case] = {}


def hard_case(id: str, title: str, *, setup: str, naive: str) -> Callable[[Measure], Callable[[], None]]:
    """Register a measurement as a case, and make it a test.

    Args:
        id: Such as T06.
        title: What is hard.
        setup: The problem with its numbers, in sentences.
        naive: The simple method that fails.

    Returns:
        The decorator; what it gives is a test without arguments.
    """

    def register(measure: Measure) -> Callable[[], None]:
        CASES[id] = Case(id, title, setup, naive, measure)

        @functools.wraps(measure)
        def test() -> None:
            check(id, measure())

        del test.__wrapped__  # pytest would take the measurement for the test
        return test

    return register


def check(id: str, figures: Sequence[Figure]) -> None:
    """Every figure meets its criterion our way, and the naive way misses at least one."""
    for figure in figures:
        wanted = f"{id}, {figure.what}: {figure.criterion()}"
        assert figure.met_by(figure.ours), f"{wanted}, found {figure.told(figure.ours)}"
    tried = [figure for figure in figures if figure.naive is not None]
    told = [(figure.what, figure.criterion(), figure.naive) for figure in tried]
    assert any(not figure.met_by(figure.naive or 0.0) for figure in tried), f"{id}: the naive way holds, too: {told}"


def short(value: float) -> str:
    """A number as a reader wants it."""
    if math.isnan(value):
        return "no number"
    if math.isinf(value):
        return "diverges"
    if value == int(value) and abs(value) < 1e6:
        return str(int(value))
    size = abs(value)
    if size < 1e-2 or size >= 1e4:
        return f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
    return f"{value:.0f}" if size >= 100.0 else f"{value:.3g}"
