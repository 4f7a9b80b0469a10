"""Named series with units, in the columns of one table: each is made when somebody asks for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from typing import NamedTuple

from drivetrain.arrays import Array


class Series(NamedTuple):
    """One quantity over the recording's clock.

    Attributes:
        unit: SI, such as ``rad/s``; ``-`` for a pure number.
        values: (N,).
    """

    unit: str
    values: Array


class TableSeries(Mapping[str, Series]):
    """Series that stand in the columns of a table, and others that follow from these.

    A run leaves hundreds of series, of which few are looked at: none costs anything before that.
    """

    def __init__(
        self,
        table: Array,
        columns: Mapping[str, tuple[int, str]],
        derived: Mapping[str, tuple[str, Callable[[Mapping[str, Series]], Array]]],
    ) -> None:
        """Take a table over; nobody is to change it any more.

        Args:
            table: Finite numbers, (N, K).
        """
        self._table, self._columns, self._derived = table, columns, derived
        self._made: dict[str, Series] = {}

    @property
    def rows(self) -> int:
        """How long each series is."""
        return len(self._table)

    def __getitem__(self, name: str) -> Series:
        """A series.

        Returns:
            Unit and values, (N,), read-only.

        Raises:
            KeyError: No such series.
        """
        made = self._made.get(name)
        if made is None:
            made = self._made[name] = self._make(name)
        return made

    def _make(self, name: str) -> Series:
        """The series, from its column or from others."""
        found = self._columns.get(name)
        if found is not None:
            unit, values = found[1], self._table[:, found[0]].copy()
        else:
            unit, derive = self._derived[name]
            values = derive(self)
        values.setflags(write=False)
        return Series(unit, values)

    def __contains__(self, name: object) -> bool:
        """Whether there is a series of a name, without making it."""
        return name in self._columns or name in self._derived

    def __iter__(self) -> Iterator[str]:
        return chain(self._columns, self._derived)

    def __len__(self) -> int:
        return len(self._columns) + len(self._derived)
