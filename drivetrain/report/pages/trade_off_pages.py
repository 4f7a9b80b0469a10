"""The Pareto front and the curve of the optimum: as pages, in lines for the terminal, as JSON, beside a selection."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from drivetrain.report.charts.answer_charts import NAMES, curve_charts, front_charts, knee
from drivetrain.report.charts.chart import JOINT_COLOURS, Chart, captioned
from drivetrain.report.json_text import drives_data, job_data, json_text, picked
from drivetrain.report.pages.proof_section import work_done
from drivetrain.report.pages.sheet import Chip, Extra, Row, Section, SheetTable, sheet
from drivetrain.report.quantities import DASH, number, percent, printed_unit
from drivetrain.report.words import CRITERIA, HEADINGS, objective_tail
from drivetrain.sizing.answers.curve import CurvePiece, OptimumCurve
from drivetrain.sizing.answers.trade_offs import TradeOffsFound
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.results import DriveSet, Selection
from drivetrain.sizing.search.pareto.front import Front
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.study.model import Study, pair_name

MOST_LISTED = 40  # lines on the terminal
CHANCE = ("probability", "standard_error", "samples")  # of a counted probability, in JSON
EQUAL = 1e-9  # relative tolerance of equal values, for sums in another order


def front_report(found: Front) -> str:
    return sheet(found.study, "Pareto front of whole sets of drives", [front_section(found)])


def front_section(found: Front, chosen: DriveSet | None = None) -> Section:
    """The front as a part of a page, the chosen set marked."""
    figures: tuple[tuple[Chart, str], ...] = ()
    if found.points:
        caption = (
            "Each dot is a set of drives that passes every check and that no other set beats in all criteria; point "
            "at it for its drives."
        )
        bend = knee(found)
        if bend is not None:
            caption += f" The ring is the knee, set {bend + 1}: nearest to the best of all, each scaled to its span."
        if chosen is not None:
            caption += " The star is the chosen set."
        figures = captioned(front_charts(found, chosen), caption)
    word, css = ("complete", "pass") if found.complete else ("not complete", "marginal")
    tables = _front_tables(found, chosen) if found.points else ()
    work = [f"{count} {words}" for words, count in work_done(found.counters)]
    notes = (
        *(f"{name} is left out: {why}" for name, why in found.left_out.items()), *found.notes,
        f"work done: {', '.join(work)}",
    )  # fmt: skip
    title = f"The front: {_and(found.names)}" if len(found.names) > 1 else f"The least {_and(found.names)}"
    return Section(title, "front", word, css, (front_sentence(found),), figures, tables, notes)


def front_sentence(found: Front) -> str:
    """The answer in words."""
    holds = found.study.wanted.holds if found.study.tolerances.given else None
    surely = "" if holds is None else f" with at least {percent(holds)}"
    if not found.points:
        return f"No set of drives passes every check{surely} ({found.proof})."
    spans = []
    for name in found.names:
        values = [point.criteria[name] for point in found.points]
        text, unit = (percent, "") if name == "utilisation" else (number, f"\u00a0{unit_of(name)}".rstrip())
        low, high = text(min(values)), text(max(values))
        spans.append(f"{name} {low}{unit}" if low == high else f"{name} from {low} to {high}{unit}")
    count = len(found.points)
    sets = f"{count} set{'s' if count > 1 else ''} of drives"
    passing = f", each passing every check{surely}," if surely else ""
    return f"{sets}{passing} that no other beats: {', '.join(spans)}. {found.proof[0].upper()}{found.proof[1:]}."


def unit_of(name: str) -> str:
    return printed_unit({"mass": "kg", "energy": "J", "utilisation": "%", "price": ""}[name])


def front_lines(found: Front) -> list[str]:
    """The sets for the terminal."""
    lines = []
    for point in found.points:
        known = [name for name in CRITERIA if _known(point, name)]
        lines.append(", ".join(f"{name} {criterion_text(name, point.criteria[name])}" for name in known))
    if found.chances:
        lines = [f"{line}, probability {chance_text(one)}" for line, one in zip(lines, found.chances, strict=True)]
    more = len(lines) - MOST_LISTED
    return [*lines[:MOST_LISTED], f"and {more} more, which front.html and front.json list"] if more > 0 else lines


def front_json(found: Front) -> str:
    return json_text(job_data(found.study, "front") | front_data(found))


def front_data(found: Front) -> dict[str, Any]:
    """Data of a front for ``front.json``, and for ``result.json`` under ``front``."""
    return {
        "criteria": found.names,
        **picked(found, "left_out", "complete", "gap", "proof"),
        "sets": [
            {
                "criteria": point.criteria,
                "drives": drives_data(point.drives),
                **(picked(found.chances[index], *CHANCE) if found.chances else {}),
            }
            for index, point in enumerate(found.points)
        ],
        **picked(found, "counters", "notes"),
    }


def _known(point: DriveSet, name: str) -> bool:
    return not math.isnan(point.criteria.get(name, math.nan))


def criterion_text(name: str, value: float) -> str:
    if name == "utilisation":
        return percent(value)
    return DASH if math.isnan(value) else f"{number(value, 4)}\u00a0{unit_of(name)}".rstrip("\u00a0")


def chance_text(chance: Chance) -> str:
    """A counted probability with its standard error."""
    return f"{100.0 * chance.probability:.1f} ± {100.0 * chance.standard_error:.1f}\u00a0%"


def _and(names: tuple[str, ...]) -> str:
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0] if names else "nothing"


def _front_tables(found: Front, chosen: DriveSet | None) -> tuple[SheetTable, ...]:
    shown = [name for name in CRITERIA if any(_known(point, name) for point in found.points)]
    rows: list[Row] = []
    for index, point in enumerate(found.points, 1):
        values = [(name, point.criteria.get(name, math.nan)) for name in shown]  # without units: those of the headings
        cells = (str(index), *(percent(x) if name == "utilisation" else number(x, 4) for name, x in values))
        if found.chances:
            cells = (*cells, chance_text(found.chances[index - 1]))
        mark: Row = () if chosen is None else ("",)
        if chosen is not None and point.drives == chosen.drives:
            mark = (Chip("chosen", "pass"),)
        rows.append((*cells, *mark))
    scatter = ("probability",) if found.chances else ()
    headings = ("set", *(CRITERIA[name] for name in shown), *scatter, *(("",) if chosen is not None else ()))
    return (
        SheetTable(headings, tuple(rows), "Sets of the front", tuple(range(len(shown) + 1 + len(scatter)))),
        _drives_table(found.study, "set", "Their drives", (point.drives for point in found.points)),
    )


def _drives_table(study: Study, first: str, title: str, sets: Iterable[dict[str, Pair]]) -> SheetTable:
    """Table of the drives of sets by joint; a drive equal to that in the row above is not repeated."""
    title += " (same: as in the row above)"
    names, rows, before = study.joint_names, [], dict[str, Pair]()
    for index, drives in enumerate(sets, 1):
        cells = [
            DASH if pair is None else "same" if before.get(name) == pair else pair_name(*pair)
            for name, pair in ((name, drives.get(name)) for name in names)
        ]
        rows.append((str(index), *cells))
        before = drives
    return SheetTable((first, *names), tuple(rows), title, (0,))


def curve_report(found: OptimumCurve) -> str:
    return sheet(found.study, f"Best drives over the {NAMES[found.vary]}", [curve_section(found)])


def curve_section(found: OptimumCurve) -> Section:
    """The curve as a part of a page."""
    many = len({tuple(piece.drives.items()) for piece in found.pieces if piece.drives}) > len(JOINT_COLOURS)
    caption = (
        f"Each colour is one set of drives{', colours come again' if many else ''}: point at it for them; "
        "dashed is the study's own value. Red: no set fits. Amber dashes: the required reserve begins."
    )
    drives = _drives_table(found.study, "piece", "Drives of each piece", (piece.drives for piece in found.pieces))
    tables = (_pieces(found), *_chances(found), drives)
    word, css = ("proven", "pass") if found.proven else ("not all proven", "marginal")
    return Section(
        f"The best drives over the {NAMES[found.vary]}", f"curve-{found.vary}".replace("_", "-"), word, css,
        (curve_sentence(found),), captioned(curve_charts(found), caption), tables, found.notes,
    )  # fmt: skip


def curve_data(found: OptimumCurve) -> dict[str, Any]:
    """Data of a curve for ``result.json``, in SI and degrees Celsius."""
    return {
        **picked(found, "vary", "unit", "payload", "now", "tolerance", "proven"),
        "pieces": [
            {
                **picked(piece, "low", "high", "low_ends_by", "high_ends_by"),
                "drives": drives_data(piece.drives),
                "points": [{"value": one.value, "objective": one.objective, **one.criteria} for one in piece.points],
            }
            for piece in found.pieces
        ],
        "selected": [
            picked(one, "value", "objective", "proof") | ({} if one.chance is None else picked(one.chance, *CHANCE))
            for one in found.points
        ],
        "notes": found.notes,
    }


def curve_sentence(found: OptimumCurve) -> str:
    """The answer in words."""
    unit = printed_unit(found.unit)
    held = [piece for piece in found.pieces if piece.drives]
    span = f"from {number(found.pieces[0].low)} to {number(found.pieces[-1].high)}\u00a0{unit}"
    if not held:
        return f"No set of drives fits anywhere {span}."
    sets = len({tuple(piece.drives.items()) for piece in held})
    fits = f"{number(held[0].low)} to {number(held[-1].high)}\u00a0{unit}"
    parts = f"{sets} sets of drives are the best, each in a part of the range"
    text = f"{'One set of drives is the best' if sets == 1 else parts} from {fits}"
    ends = []
    for before, after in zip(found.pieces, found.pieces[1:], strict=False):
        if before.drives and not after.drives:
            ends.append(f"beyond {number(before.high, 4)}\u00a0{unit} none fits ({before.high_ends_by})")
        if after.drives and not before.drives:
            ends.append(f"below {number(after.low, 4)}\u00a0{unit} none fits ({after.low_ends_by})")
    return "; ".join([text, *ends]) + "."


def curve_lines(found: OptimumCurve) -> list[str]:
    unit = printed_unit(found.unit)
    lines = []
    for index, piece in enumerate(found.pieces):
        span = f"{' to '.join(_ends(piece))} {unit}"
        if not piece.drives:
            lines.append(f"{span}: no set fits")
            continue
        before = found.pieces[index - 1].drives if index else {}
        worth = f"{_between([point.objective for point in piece.points])}{objective_tail(found.study)}"
        changed = [f"{name}: {pair_name(*pair)}" for name, pair in piece.drives.items() if before.get(name) != pair]
        lines.append(f"{span}: {worth}; {', '.join(changed) or 'as before'}")
    return lines


def _ends(piece: CurvePiece) -> tuple[str, str]:
    """Both ends with enough digits to distinguish them."""
    found = [(number(piece.low, digits), number(piece.high, digits)) for digits in (4, 5, 6, 7, 8, 9)]
    return next((ends for ends in found if ends[0] != ends[1]), found[0])


def _between(values: list[float]) -> str:
    """The range of some numbers; one number where both ends read the same."""
    known = [value for value in values if math.isfinite(value)]
    low, high = (number(min(known)), number(max(known))) if known else (DASH, DASH)
    return low if low == high else f"{low} to {high}"


def _pieces(found: OptimumCurve) -> SheetTable:
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
    """Probability that each selected set is feasible; empty without tolerances."""
    unit, rows = printed_unit(found.unit), []
    for one in found.points:
        if one.chance is not None:
            rows.append((number(one.value, 4), number(one.objective), chance_text(one.chance)))
    headings = (f"{NAMES[found.vary]} [{unit}]", HEADINGS[found.study.objective], "probability")
    return (SheetTable(headings, tuple(rows), "Probability that the best set meets all limits", (0, 1, 2)),)


def trade_off_extra(found: TradeOffsFound, selection: Selection) -> Extra:
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
    """Sentence on a set of the front that is at least as good as the chosen set in all criteria, if there is one."""
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
    front = [] if found.front is None else [f"front: {front_sentence(found.front)}"]
    return front + [f"over the {curve.vary.replace('_', ' ')}: {curve_sentence(curve)}" for curve in found.curves]
