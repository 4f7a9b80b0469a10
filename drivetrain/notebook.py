"""Display of results and data sheets: texts, tables and axes; slow imports are made only when needed."""

from __future__ import annotations

from dataclasses import MISSING, fields
from html import escape
from typing import TYPE_CHECKING, Any

from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

MOST_ROWS = 30  # largest number of rows shown


class DataSheet:
    """Base of data classes with many fields: their text lists those that differ from the defaults."""

    def __repr__(self) -> str:
        own: Any = self
        stated = []
        for field in fields(own):
            value, default = getattr(self, field.name), field.default
            if default is MISSING or value != default:
                stated.append(f"{field.name}={value!r}")
        return f"{type(self).__name__}({', '.join(stated)})"


def shown(title: str, table: pd.DataFrame) -> str:
    """A title and a table as HTML; the middle of long tables is left out."""
    body = table.to_html(max_rows=MOST_ROWS, border=0, na_rep="", float_format=lambda value: f"{value:.4g}")
    return f"<p><b>{escape(title)}</b></p>{body}"


def axes_of(ax: Axes | None) -> Axes:
    """The axes given, or those of a new figure."""
    if ax is not None:
        if not hasattr(ax, "plot"):
            raise InputError(Fault("ax", "must be the axes of a figure of matplotlib, or None", ax))
        return ax
    from matplotlib.pyplot import subplots

    made: Any = subplots(layout="constrained")[1]
    return made  # type: ignore[no-any-return]
