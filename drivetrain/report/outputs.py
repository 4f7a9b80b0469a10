"""The files of one job."""

from __future__ import annotations

import math
from csv import writer
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from drivetrain.report.pages.report_page import html_report
from drivetrain.report.pages.sheet import Extra
from drivetrain.report.rejected import rejected_text
from drivetrain.report.result_json import result_json
from drivetrain.report.words import both
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.whole_files import write_files

if TYPE_CHECKING:
    import pandas as pd


def write_outputs(
    out_dir: str | Path, result: Evaluation | Selection, *, spread: Spread | None = None, extra: Extra | None = None
) -> dict[str, Path]:
    """Write ``report.html``, ``result.json`` and ``currents.csv``, of a selection also ``rejected.csv``.

    Everything is made before anything is written, and written beside its place before any old file is replaced.

    Args:
        out_dir: Folder, made when missing.
        result: Of ``evaluate`` or ``select``.
        spread: What the scatter of its numbers means, where the study states tolerances.
        extra: What was asked for beside, such as ``trade_off_extra``.

    Returns:
        Where each file is, by name.

    Raises:
        InputError: The folder cannot be made or written to.
    """
    texts = {
        "report.html": html_report(result, spread=spread, extra=extra),
        "result.json": result_json(result, spread=spread, extra=extra, folder=Path(out_dir)),
        "currents.csv": currents_csv(both(result)[0]),
    }
    if isinstance(result, Selection):
        texts["rejected.csv"] = rejected_text(result.rejected)
    return write_files(out_dir, texts)


def currents_csv(evaluation: Evaluation, *, rate: float | None = None, hold: int = 1) -> str:
    """The current commands as CSV text; at a rate [Hz] a comment line says which, and how values are held."""
    table = current_commands(evaluation, rate=rate, hold=hold)
    text = StringIO()
    if rate is not None:
        text.write(f"# rate: {rate:.9g} Hz, order of hold between samples: {hold}\n")
    lines = writer(text, lineterminator="\n")  # pandas takes three times as long where it formats numbers
    lines.writerow(table.columns)
    lines.writerows(zip(*(_printed(table[name]) for name in table.columns), strict=True))
    return text.getvalue()


def _printed(column: pd.Series) -> list[object]:
    """Numbers with six digits, empty where unknown; other values as they are."""
    if column.dtype.kind != "f":
        return column.tolist()
    return ["" if math.isnan(value) else f"{value:.6g}" for value in column.tolist()]
