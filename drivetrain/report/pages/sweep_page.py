"""The page of a sweep: its picture, and its points in a table."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from drivetrain.report.charts.answer_charts import OBJECTIVES, sweep_chart, varied_name
from drivetrain.report.pages.sheet import Chip, Row, Section, SheetTable, sheet
from drivetrain.report.quantities import DASH, number, percent
from drivetrain.report.words import HEADINGS
from drivetrain.study.model import Study

MOST_ROWS = 500
SAME = "as above"
_CSS = {"PASS": "pass", "MARGINAL": "marginal", "FAIL": "fail"}


def sweep_report(study: Study, results: pd.DataFrame, names: Sequence[str]) -> str:
    """The results of a sweep as one page that needs nothing from outside."""
    label = OBJECTIVES.get(study.objective, "objective")
    picture = sweep_chart(results, names, label)
    fits = int(results["feasible"].sum())
    lead = f"{fits} of {len(results)} points fit."
    shown = results.head(MOST_ROWS)
    headings = (
        *map(varied_name, names), "verdict", HEADINGS.get(study.objective, "objective"), "highest utilisation",
        "nearest limit", "drives or what is wrong",
    )  # fmt: skip
    numeric = (len(names) + 1, len(names) + 2)
    table = SheetTable(headings, _rows(shown, names), numeric=numeric)
    notes = ("The shards hold every point; " + f"the first {MOST_ROWS} are shown here.",) * (len(results) > MOST_ROWS)
    caption = "Each mark is one point; crosses at the foot: no set fits there."
    figures = () if picture is None else ((picture, caption),)
    section = Section("Every point", "points", lead=(lead,), figures=figures, tables=(table,), notes=notes)
    return sheet(study, "Sweep", [section])


def _rows(results: pd.DataFrame, names: Sequence[str]) -> tuple[Row, ...]:
    """The points; of drives only what differs from the last point above that has some."""
    rows, before = [], dict[str, str]()
    for _, row in results.iterrows():
        drives_text = str(row["drives"] or "")
        drives = dict(part.partition(": ")[::2] for part in drives_text.split("; ")) if drives_text else {}
        changed = [f"{joint}: {pair}" for joint, pair in drives.items() if before.get(joint) != pair]
        same = bool(before) and len(changed) < len(drives)
        text = "; ".join(changed) or SAME
        rows.append(_row(row, names, f"{SAME}, except {text}" if same and changed else text if drives else ""))
        before = drives or before
    return tuple(rows)


def _row(row: pd.Series, names: Sequence[str], drives: str) -> Row:
    verdict = str(row["verdict"])
    nearest = " of ".join(part for part in (row["binding_check"], row["binding_joint"]) if part)
    return (
        *(str(row[name]) for name in names),
        Chip(verdict, _CSS.get(verdict, "unchecked")),
        number(row["objective"]) if row["feasible"] else DASH,
        percent(row["utilisation"]) if row["utilisation"] == row["utilisation"] else DASH,
        nearest or DASH,
        str(row["fault"] or drives or row["proof"]),
    )
