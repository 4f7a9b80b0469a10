"""What stands beside the best set in a report: the front with the chosen set marked, and the curves."""

from __future__ import annotations

from dataclasses import replace

from drivetrain.report.curve_page import curve_data, curve_section, curve_sentence
from drivetrain.report.front_page import HEADINGS, criterion_text, front_data, front_section, front_sentence
from drivetrain.report.sections import Extra, Section
from drivetrain.sizing.answers.trade_offs import TradeOffsFound
from drivetrain.sizing.results import DriveSet, Selection
from drivetrain.sizing.search.front import Front

EQUAL = 1e-9  # sums in another order


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
                f"{HEADINGS[name].split(' [')[0]} {criterion_text(name, other)} instead of {criterion_text(name, own)}"
                for name, own, other in better
            )
            return (f"Set {index} is no worse than the chosen one in what was minimised, and has {gains}.",)
    return ()


def trade_off_lines(found: TradeOffsFound) -> list[str]:
    """What the terminal tells."""
    front = [] if found.front is None else [f"front: {front_sentence(found.front)}"]
    return front + [f"over the {curve.vary.replace('_', ' ')}: {curve_sentence(curve)}" for curve in found.curves]
