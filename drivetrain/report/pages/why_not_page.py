"""Why a part was not chosen: lines for the terminal, and a page."""

from __future__ import annotations

import math

from drivetrain.report.pages.sheet import Chip, Row, Section, SheetTable, sheet
from drivetrain.report.pages.views import anchor, check_row
from drivetrain.report.quantities import number, percent, with_unit
from drivetrain.report.words import check_sentence, objective_tail
from drivetrain.sizing.answers.why_not import PairAnswer, SmallestChange, Standing, WhyNot
from drivetrain.sizing.results import Selection
from drivetrain.study.model import pair_name

STANDING_CSS = {
    Standing.CHOSEN: "pass", Standing.FEASIBLE: "pass", Standing.REJECTED: "fail", Standing.NOT_JUDGED: "unchecked",
    Standing.NO_PARTNER: "unchecked",
}  # fmt: skip


def why_not_report(found: WhyNot) -> str:
    return sheet(found.study, "Why not this part?", [_section(found, one) for one in found.answers])


def why_not_lines(found: WhyNot, answer: PairAnswer) -> list[str]:
    lines = [_standing(found, answer)]
    lines += [f"May not be chosen: {words}." for words in answer.passed_over]
    if answer.lacking:
        lines.append(f"Data are missing for {', '.join(answer.lacking)}; without them there is no verdict.")
        if answer.result is not None:
            reasons = (f"{check.name}: {check.remark}" for check in answer.result.lacking if check.remark)
            lines += [f"{text[0].upper()}{text[1:]}." for text in (*reasons, *answer.result.drive.assumptions)]
    if answer.failed is not None:
        lines.append(f"Rejected by {check_sentence(answer.failed)}.")
    lines += [change_sentence(change) for change in answer.changes]
    if answer.best is not None:
        lines.append(_best(found, answer, answer.best))
    return lines


def change_sentence(change: SmallestChange) -> str:
    """One kind of change in words."""
    gear, before = _gear(change), with_unit(change.before, change.unit)
    if change.after is None:
        return f"{change.what.capitalize()}: no change helps; {change.reason}.{gear}"
    after = f"{number(_safe(change.after, change.before))}\u00a0{change.unit}".rstrip("\u00a0")
    whole = "the whole set then meets all limits" if change.set_holds else "other drives of the set still exceed limits"
    return (
        f"{change.what.capitalize()}: passes with {after} instead of {before}; with a smaller change "
        f"{change.check} fails; {whole}.{gear}"
    )


def _gear(change: SmallestChange) -> str:
    gear = change.gear
    if gear is None:
        return ""
    return f" Of the catalogue, {gear.key} (ratio {number(gear.ratio)}) passes with {percent(gear.utilisation)}."


def _safe(after: float, before: float) -> float:
    """A value rounded to three digits away from the original one, so that the printed value passes too."""
    if after == 0.0:
        return after
    step = 10.0 ** (math.floor(math.log10(abs(after))) - 2)
    steps = round(after / step, 6)
    return step * (math.ceil(steps) if after > before else math.floor(steps))


def _standing(found: WhyNot, answer: PairAnswer) -> str:
    if answer.standing is Standing.NO_PARTNER:
        parts = (found.motor, "a direct drive" if found.gear == "" else found.gear)
        return f"{answer.joint}: {' with '.join(filter(None, parts))} has no partner here."
    meet = f"{answer.holding} of which meet{'s' * (answer.holding == 1)} all limits"
    some = f" (the best of {answer.partners} pairs, {meet})" if answer.partners > 1 else ""
    nominal = " with nominal values" if found.selection.choice is not None else ""
    words = {
        Standing.CHOSEN: "is the chosen drive",
        Standing.FEASIBLE: f"meets all limits{nominal}, and was not chosen",
        Standing.REJECTED: "does not meet all limits with the other chosen drives",
        Standing.NOT_JUDGED: "cannot be checked for lack of data",
    }
    return f"{answer.joint}: {pair_name(answer.motor, answer.gear)}{some} {words[answer.standing]}."


def _best(found: WhyNot, answer: PairAnswer, best: Selection) -> str:
    part = "it" if answer.partners == 1 else "one of its pairs"
    if not best.feasible:
        return f"With {part} at {answer.joint}, {best.proof}."
    unit = objective_tail(found.study, " ")
    chosen = found.selection.objective
    text = f"The best set with {part} at {answer.joint} has {found.study.objective} {number(best.objective)}{unit}"
    if found.selection.feasible and math.isfinite(chosen) and chosen > 0.0:
        more = best.objective / chosen - 1.0
        text += f", {100.0 * more:.3g} % above the chosen {number(chosen)}{unit}"
    return f"{text} ({best.proof})."


def _section(found: WhyNot, answer: PairAnswer) -> Section:
    tables: list[SheetTable] = []
    sentences = [change_sentence(change) for change in answer.changes]
    if answer.result is not None:
        sources = (answer.result.drive.motor.source, answer.result.drive.gear.source)
        rows = [check_row(answer.joint, check, sources) for check in answer.result.checks]
        tables.append(SheetTable(
            ("check", "verdict", "utilisation", "required", "available", "unit", "margin"),
            tuple(
                (row.name, Chip(row.verdict, row.css), row.utilisation, row.required, row.available,
                 row.unit, row.margin)
                for row in rows
            ),
            f"Every check of {pair_name(answer.motor, answer.gear)}, the other chosen drives in place",
            (2, 3, 4, 6),
        ))  # fmt: skip
    if answer.changes:
        tables.insert(0, SheetTable(
            ("smallest change", "now", "passes with", "still fails with", "whole set", "check at the edge"),
            tuple(_change_row(change) for change in answer.changes), "What would let it pass", (1, 2, 3),
        ))  # fmt: skip
    return Section(
        answer.joint, anchor(answer.joint), str(answer.standing), STANDING_CSS[answer.standing],
        tuple(line for line in why_not_lines(found, answer) if line not in sentences), tables=tuple(tables),
    )  # fmt: skip


def _change_row(change: SmallestChange) -> Row:
    before, gear = with_unit(change.before, change.unit), _gear(change)
    if change.after is None:
        return (change.what, before, "–", "–", Chip("no change helps", "fail"), f"{change.reason}.{gear}")
    after, short = (f"{number(value, 8)}\u00a0{change.unit}" for value in (change.after, change.short))
    whole = Chip("meets limits", "pass") if change.set_holds else Chip("exceeds limits", "fail")
    return (change.what, before, after, short, whole, f"{change.check}.{gear}")
