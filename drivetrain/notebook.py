"""Display of results in notebooks: tables and axes; slow imports are made only when needed."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

MOST_ROWS = 30  # largest number of rows shown


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
