"""The Pareto front as a page, and in lines for the terminal."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.report.charts.answer_charts import front_charts, knee
from drivetrain.report.charts.chart import Chart, captioned
from drivetrain.report.json_text import json_text
from drivetrain.report.pages.sheet import Chip, Section, SheetTable, sheet
from drivetrain.report.quantities import DASH, number, percent, printed_unit
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.front import Front
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.version import __version__

SCHEMA_VERSION = 1
MOST_LISTED = 40  # lines on the terminal
HEADINGS = {
    "mass": "mass [kg]", "price": "price", "energy": "energy a cycle [J]", "utilisation": "highest utilisation",
}  # fmt: skip
COLUMNS = ("mass", "price", "energy", "utilisation")


def front_report(found: Front) -> str:
    """The front as a page."""
    return sheet(found.study, "Pareto front of whole sets of drives", [front_section(found)])


def front_section(found: Front, chosen: DriveSet | None = None) -> Section:
    """The front as a part of a page.

    Args:
        chosen: The set that was selected, to be marked; None: none.
    """
    figures: tuple[tuple[Chart, str], ...] = ()
    if found.points:
        caption = (
            "Each dot is a set of drives that holds every check and that no other set beats in all criteria; point "
        )
        caption += "at it for its drives."
        bend = knee(found)
        if bend is not None:
            caption += f" The ring is the knee, set {bend + 1}: nearest to the best of all, each scaled to its span."
        if chosen is not None:
            caption += " The star is the chosen set."
        figures = captioned(front_charts(found, chosen), caption)
    word, css = ("complete", "pass") if found.complete else ("not complete", "marginal")
    tables = (_table(found, chosen), _drives(found)) if found.points else ()
    notes = (*(f"{name} is left out: {why}" for name, why in found.left_out.items()), *found.notes, _work(found))
    title = f"The front: {_and(found.names)}" if len(found.names) > 1 else f"The least {_and(found.names)}"
    return Section(title, "front", word, css, (front_sentence(found),), figures, tables, notes)


def front_sentence(found: Front) -> str:
    """The answer in words."""
    if not found.points:
        return f"No set of drives holds every check ({found.proof})."
    spans = []
    for name in found.names:
        values = [point.criteria[name] for point in found.points]
        text, unit = (percent, "") if name == "utilisation" else (number, f"\u00a0{unit_of(name)}".rstrip())
        low, high = text(min(values)), text(max(values))
        spans.append(f"{name} {low}{unit}" if low == high else f"{name} from {low} to {high}{unit}")
    count = len(found.points)
    sets = f"{count} set{'s' if count > 1 else ''} of drives"
    return f"{sets} that no other beats: {', '.join(spans)}. {found.proof[0].upper()}{found.proof[1:]}."


def unit_of(name: str) -> str:
    """The unit of a criterion, as it is printed."""
    return printed_unit({"mass": "kg", "energy": "J", "utilisation": "%", "price": ""}[name])


def front_lines(found: Front) -> list[str]:
    """The sets for the terminal."""
    lines = [
        ", ".join(
            f"{name} {criterion_text(name, point.criteria.get(name, math.nan))}"
            for name in COLUMNS
            if _known(point, name)
        )
        for point in found.points
    ]
    if found.chances:
        lines = [f"{line}, holds with {chance_text(one)}" for line, one in zip(lines, found.chances, strict=True)]
    more = len(lines) - MOST_LISTED
    return [*lines[:MOST_LISTED], f"and {more} more, which front.html and front.json list"] if more > 0 else lines


def front_json(found: Front) -> str:
    """The front for machines.

    Returns:
        JSON with a ``schema_version``; SI units, null where a number is unknown or not finite.
    """
    data = {
        "schema_version": SCHEMA_VERSION,
        "drivetrain": __version__,
        "study": found.study.name,
        "digest": found.study.digest,
        "job": "front",
        **front_data(found),
    }
    return json_text(data)


def front_data(found: Front) -> dict[str, Any]:
    """The front as plain data.

    Returns:
        What ``front.json`` holds of it, and ``result.json`` under ``front``; SI units, None where not finite.
    """
    return {
        "criteria": list(found.names),
        "left_out": found.left_out,
        "complete": found.complete,
        "gap": found.gap if math.isfinite(found.gap) else None,
        "proof": found.proof,
        "sets": [
            {
                "criteria": {name: value if math.isfinite(value) else None for name, value in point.criteria.items()},
                "drives": {joint: {"motor": motor, "gear": gear} for joint, (motor, gear) in point.drives.items()},
                **({} if not found.chances else chance_data(found.chances[index])),
            }
            for index, point in enumerate(found.points)
        ],
        "counters": found.counters,
        "notes": list(found.notes),
    }


def _known(point: DriveSet, name: str) -> bool:
    return not math.isnan(point.criteria.get(name, math.nan))


def criterion_text(name: str, value: float) -> str:
    """A criterion with its unit.

    Args:
        value: In SI.
    """
    if name == "utilisation":
        return percent(value)
    return DASH if math.isnan(value) else f"{number(value, 4)}\u00a0{unit_of(name)}".rstrip("\u00a0")


def chance_text(chance: Chance) -> str:
    """A counted probability with its standard error."""
    return f"{100.0 * chance.probability:.1f} ± {100.0 * chance.standard_error:.1f}\u00a0%"


def chance_data(chance: Chance) -> dict[str, float | int]:
    """A counted probability as plain data."""
    return {
        "probability": chance.probability, "standard_error": chance.standard_error, "samples": chance.samples,
    }  # fmt: skip


def _value(point: DriveSet, name: str) -> str:
    """A criterion without its unit, which stands in the heading."""
    value = point.criteria.get(name, math.nan)
    return percent(value) if name == "utilisation" else number(value, 4)


def _and(names: tuple[str, ...]) -> str:
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0] if names else "nothing"


def _table(found: Front, chosen: DriveSet | None) -> SheetTable:
    shown = [name for name in COLUMNS if any(_known(point, name) for point in found.points)]
    rows: list[tuple[str | Chip, ...]] = []
    for index, point in enumerate(found.points, 1):
        cells = (str(index), *(_value(point, name) for name in shown))
        if found.chances:
            cells = (*cells, chance_text(found.chances[index - 1]))
        mark: tuple[str | Chip, ...] = () if chosen is None else ("",)
        if chosen is not None and point.drives == chosen.drives:
            mark = (Chip("chosen", "pass"),)
        rows.append((*cells, *mark))
    scatter = ("holds with",) if found.chances else ()
    headings = ("set", *(HEADINGS[name] for name in shown), *scatter, *(("",) if chosen is not None else ()))
    return SheetTable(headings, tuple(rows), "Sets of the front", tuple(range(len(shown) + 1 + len(scatter))))


def _drives(found: Front) -> SheetTable:
    """The drives of every set, joint by joint; what a set shares with the one above is not told again."""
    names = [task.name for task in found.study.joints]
    rows, before = [], dict[str, tuple[str, str]]()
    for index, point in enumerate(found.points, 1):
        cells = [
            "same" if before.get(name) == pair else " + ".join(part for part in pair if part)
            for name, pair in ((name, point.drives[name]) for name in names)
        ]
        before = point.drives
        rows.append((str(index), *cells))
    return SheetTable(("set", *names), tuple(rows), "Their drives", (0,))


def _work(found: Front) -> str:
    return "work done: " + ", ".join(f"{number(count)} {name}" for name, count in found.counters.items())
