"""The curve of the optimum as a page, and beside a selection with the front, where the chosen set is marked."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from drivetrain.report.best_sets import HEADINGS
from drivetrain.report.charts.answer_charts import NAMES, curve_charts
from drivetrain.report.charts.chart import JOINT_COLOURS, captioned
from drivetrain.report.pages.front_page import HEADINGS as CRITERIA
from drivetrain.report.pages.front_page import (
    chance_data,
    chance_text,
    criterion_text,
    front_data,
    front_section,
    front_sentence,
)
from drivetrain.report.pages.sheet import Extra, Section, SheetTable, sheet
from drivetrain.report.quantities import DASH, number, percent, printed_unit
from drivetrain.sizing.answers.curve import CurvePiece, OptimumCurve
from drivetrain.sizing.answers.trade_offs import TradeOffsFound
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.results import DriveSet, Selection
from drivetrain.sizing.search.front import Front

EQUAL = 1e-9  # sums in another order


def curve_report(found: OptimumCurve) -> str:
    """The curve as a page."""
    return sheet(found.study, f"Best drives over the {NAMES[found.vary]}", [curve_section(found)])


def curve_section(found: OptimumCurve) -> Section:
    """The curve as a part of a page."""
    many = len({tuple(piece.drives.items()) for piece in found.pieces if piece.drives}) > len(JOINT_COLOURS)
    caption = (
        f"Each colour is one set of drives{', colours come again' if many else ''}: point at it for them; "
        "dashed is the study's own value. Red: no set fits. Amber dashes: the required reserve begins."
    )
    tables = (_table(found), *_chances(found), _changes(found))
    word, css = ("proven", "pass") if found.proven else ("not all proven", "marginal")
    return Section(
        f"The best drives over the {NAMES[found.vary]}", f"curve-{found.vary}".replace("_", "-"), word, css,
        (curve_sentence(found),), captioned(curve_charts(found), caption), tables, found.notes,
    )  # fmt: skip


def curve_data(found: OptimumCurve) -> dict[str, Any]:
    """The curve as plain data.

    Returns:
        What ``result.json`` holds of it; SI units, temperatures in degrees Celsius, None where a number is unknown.
    """
    return {
        "vary": str(found.vary),
        "unit": found.unit,
        "payload": found.payload,
        "now": found.now,
        "tolerance": found.tolerance,
        "proven": found.proven,
        "pieces": [
            {
                "low": piece.low,
                "high": piece.high,
                "low_ends_by": piece.low_ends_by,
                "high_ends_by": piece.high_ends_by,
                "drives": {joint: {"motor": motor, "gear": gear} for joint, (motor, gear) in piece.drives.items()},
                "points": [
                    {"value": one.value, "objective": _finite(one.objective)}
                    | {name: _finite(value) for name, value in one.criteria.items()}
                    for one in piece.points
                ],
            }
            for piece in found.pieces
        ],
        "selected": [
            {"value": one.value, "objective": _finite(one.objective), "proof": one.proof}
            | ({} if one.chance is None else chance_data(one.chance))
            for one in found.points
        ],
        "notes": list(found.notes),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def curve_sentence(found: OptimumCurve) -> str:
    """The answer in words."""
    unit = printed_unit(found.unit)
    held = [piece for piece in found.pieces if piece.drives]
    span = f"from {number(found.pieces[0].low)} to {number(found.pieces[-1].high)}\u00a0{unit}"
    if not held:
        return f"No set of drives fits anywhere {span}."
    sets = len({tuple(piece.drives.items()) for piece in held})
    text = f"{sets} set{'s' if sets > 1 else ''} of drives {'are' if sets > 1 else 'is'} the best somewhere {span}"
    ends = []
    for before, after in zip(found.pieces, found.pieces[1:], strict=False):
        if before.drives and not after.drives:
            ends.append(f"beyond {number(before.high, 4)}\u00a0{unit} none fits ({before.high_ends_by})")
        if after.drives and not before.drives:
            ends.append(f"below {number(after.low, 4)}\u00a0{unit} none fits ({after.low_ends_by})")
    return "; ".join([text, *ends]) + "."


def curve_lines(found: OptimumCurve) -> list[str]:
    """The pieces for the terminal."""
    unit = printed_unit(found.unit)
    lines = []
    for index, piece in enumerate(found.pieces):
        span = f"{' to '.join(_ends(piece))} {unit}"
        if not piece.drives:
            lines.append(f"{span}: no set fits")
            continue
        before = found.pieces[index - 1].drives if index else {}
        changed = ", ".join(_changed(before, piece.drives)) or "as before"
        lines.append(f"{span}: {_worth(found, piece)}; {changed}")
    return lines


def _ends(piece: CurvePiece) -> tuple[str, str]:
    """Both ends with as many digits as tell them apart."""
    found = [(number(piece.low, digits), number(piece.high, digits)) for digits in (4, 5, 6, 7, 8, 9)]
    return next((ends for ends in found if ends[0] != ends[1]), found[0])


def _worth(found: OptimumCurve, piece: CurvePiece) -> str:
    """The objective over a piece, with its unit."""
    unit = {"mass": "\u00a0kg", "energy": "\u00a0J"}.get(found.study.objective, "")
    return f"{_between([point.objective for point in piece.points])}{unit}"


def _between(values: list[float]) -> str:
    """The range of some numbers; one number where both ends read the same."""
    known = [value for value in values if math.isfinite(value)]
    low, high = (number(min(known)), number(max(known))) if known else (DASH, DASH)
    return low if low == high else f"{low} to {high}"


def _changed(before: dict[str, Pair], now: dict[str, Pair]) -> list[str]:
    """The drives that are not those of the piece before."""
    return [
        f"{name}: {motor} + {gear or 'no gear'}" for name, (motor, gear) in now.items() if before.get(name) != now[name]
    ]


def _table(found: OptimumCurve) -> SheetTable:
    unit = printed_unit(found.unit)
    rows = []
    for index, piece in enumerate(found.pieces):
        ends = _ends(piece)
        if not piece.drives:
            rows.append((str(index + 1), *ends, "no set fits", DASH, DASH, DASH, DASH))
            continue
        used = max(point.criteria["utilisation"] for point in piece.points)
        energy = _between([point.criteria["energy"] for point in piece.points])
        worth = _between([point.objective for point in piece.points])
        rows.append((
            str(index + 1), *ends, worth, energy, percent(used), piece.low_ends_by or DASH,
            piece.high_ends_by or DASH,
        ))  # fmt: skip
    headings = (
        "piece", f"from [{unit}]", f"to [{unit}]", HEADINGS[found.study.objective], "energy a cycle [J]",
        "highest utilisation", "ends below by", "ends above by",
    )  # fmt: skip
    return SheetTable(headings, tuple(rows), "Pieces", (0, 1, 2, 3, 4, 5))


def _chances(found: OptimumCurve) -> tuple[SheetTable, ...]:
    """With what probability each selected set holds; nothing where nothing scatters."""
    unit, rows = printed_unit(found.unit), []
    for one in found.points:
        if one.chance is not None:
            rows.append((number(one.value, 4), number(one.objective), chance_text(one.chance)))
    if not rows:
        return ()
    headings = (f"{NAMES[found.vary]} [{unit}]", HEADINGS[found.study.objective], "holds with")
    return (SheetTable(headings, tuple(rows), "Probability that the best set holds", (0, 1, 2)),)


def _changes(found: OptimumCurve) -> SheetTable:
    """The drives of every piece, joint by joint; only what changes is told again."""
    names = [task.name for task in found.study.joints]
    rows = []
    before: dict[str, Pair] = {}
    for index, piece in enumerate(found.pieces):
        cells = []
        for name in names:
            pair = piece.drives.get(name)
            same = pair is not None and before.get(name) == pair
            cells.append(DASH if pair is None else "same" if same else " + ".join(part for part in pair if part))
        before = piece.drives
        rows.append((str(index + 1), *cells))
    return SheetTable(("piece", *names), tuple(rows), "Drives of each piece", (0,))


def trade_off_extra(found: TradeOffsFound, selection: Selection) -> Extra:
    """Sections and data for the report of a selection."""
    sections: list[Section] = []
    data: dict[str, object] = {}
    if found.front is not None:
        evaluation = selection.evaluation
        chosen = DriveSet(selection.drives, selection.objective, evaluation.criteria) if selection.feasible else None
        part = front_section(found.front, chosen)
        sections.append(part if chosen is None else replace(part, lead=(*part.lead, *_beaten(found.front, chosen))))
        data["front"] = front_data(found.front)
    if found.curves:
        sections += [curve_section(curve) for curve in found.curves]
        data["curves"] = [curve_data(curve) for curve in found.curves]
    return Extra(tuple(sections), data)


def _beaten(front: Front, chosen: DriveSet) -> tuple[str, ...]:
    """What the front has that is no worse than the chosen set in anything, where there is such a set."""
    for index, point in enumerate(front.points, 1):
        pairs = [(name, chosen.criteria[name], point.criteria[name]) for name in front.names]
        better = [(name, own, other) for name, own, other in pairs if other < own * (1.0 - EQUAL)]
        if better and all(other <= own * (1.0 + EQUAL) for _, own, other in pairs):
            gains = " and ".join(
                f"{CRITERIA[name].split(' [')[0]} {criterion_text(name, other)} instead of {criterion_text(name, own)}"
                for name, own, other in better
            )
            return (f"Set {index} is no worse than the chosen one in what was minimised, and has {gains}.",)
    return ()


def trade_off_lines(found: TradeOffsFound) -> list[str]:
    """What the terminal tells."""
    front = [] if found.front is None else [f"front: {front_sentence(found.front)}"]
    return front + [f"over the {curve.vary.replace('_', ' ')}: {curve_sentence(curve)}" for curve in found.curves]
