"""How sure a selection is: the bound, the gap, how the search went, the rules in force, and how to go on."""

from __future__ import annotations

import math
from collections.abc import Mapping

from drivetrain.report.pages.sheet import Section, SheetTable
from drivetrain.report.quantities import DASH, number
from drivetrain.report.words import CRITERIA, HEADINGS, WORDS, equals_sentence, objective_tail, set_rows
from drivetrain.sizing.results import Selection

WORK = {
    "nodes": "search nodes",
    "nodes made": "search nodes made",
    "passes": "passes that rule candidates out",
    "candidates tested": "tests of a candidate against bounds",
    "candidates judged": "candidates evaluated by all checks",
    "descents": "descents to a whole set",
    "sets that fit": "whole sets met that pass every check",
    "equal sets judged": "equals of the best set, or of the last of the best, that were judged",
    "disagreements": "sets on which compiled code and evaluation differed, taken out",
    # of a front
    "candidates costed": "bounds on the criteria of a candidate",
    "nodes decided": "search nodes whose sets were all listed, with exact criteria",
    "nodes walked": "search nodes whose sets were all listed, with bounds on the criteria",
    "sets judged": "whole sets compared with the limits of all joints together",
    "sets drawn": "whole sets tested by Monte Carlo samples",
    "sets with a drive that fails too often": "whole sets rejected because of one drive that fails too often",
    "sets too near to decide": "whole sets too near the required probability to decide",
}  # "pushed" only orders the search


def proof_section(selection: Selection) -> Section:
    proven = not selection.proof.startswith("not proven")
    word, css = ("proven", "pass") if proven else ("not proven", "marginal")
    reached = "not needed" if selection.state is None else "reached"
    limit = ("time limit of the search", f"{selection.study.wanted.time_limit:g}\u00a0s, {reached}")
    facts = (*_worth(selection), *_choice(selection), *_rules(selection), limit)
    return Section("The optimum and its proof", "proof", word, css, _lead(selection, proven), facts=facts,
                   tables=_sets(selection))  # fmt: skip


def _lead(selection: Selection, proven: bool) -> tuple[str, ...]:
    worth = WORDS[selection.study.objective]
    if selection.drives and proven:
        often = "" if selection.choice is None else " with the required probability"
        first = f"No other allowed set of drives that passes every check{often} has {worth}."
        words = (f"{selection.proof}." if selection.proof != "optimal" else "", equals_sentence(selection))
        return (first, *(text for text in words if text))
    if proven:
        return (f"{selection.proof[0].upper()}{selection.proof[1:]}.",)
    lead = f"{selection.proof[0].upper()}{selection.proof[1:]}."
    if selection.state is None:
        return (lead,)
    on = (
        "To go on: `drivetrain select` with a longer --time-limit, or selection: {time_limit: ...} in the study; in "
        "Python `select(study, resume=selection)` goes on from where this search stopped and loses nothing."
    )
    return f"The search stopped at its time limit. {lead}", on


def _sets(selection: Selection) -> tuple[SheetTable, ...]:
    """The best sets side by side, where there are several."""
    found, currency = set_rows(selection), selection.study.prices.currency
    columns = {"set": [str(row.rank) for row in found]}
    if selection.study.objective == "weighted":
        columns[HEADINGS["weighted"]] = [row.objective for row in found]
    columns[CRITERIA["mass"]] = [row.mass for row in found]
    if any(row.price != DASH for row in found):
        columns[f"price [{currency}]" if currency else "price"] = [row.price for row in found]
    columns |= {
        CRITERIA["energy"]: [row.energy for row in found],
        CRITERIA["utilisation"]: [row.utilisation for row in found],
        "differs from the first at": ["; ".join(row.changes) for row in found],
    }
    headings, rows = tuple(columns), tuple(zip(*columns.values(), strict=True))
    title = f"The best sets: {len(rows)} that pass every check, best first"
    return (SheetTable(headings, rows, title, tuple(range(len(headings) - 1))),)


def _worth(selection: Selection) -> list[tuple[str, str]]:
    unit = objective_tail(selection.study)
    best, bound = selection.objective, selection.bound
    facts = []
    if math.isfinite(best):
        facts.append(("best set found", f"{number(best, 4)}{unit}"))
    if math.isfinite(bound):
        facts.append(("lower bound", f"{number(bound, 4)}{unit}"))
    if math.isfinite(best) and math.isfinite(bound) and best > 0.0:
        gap = max(best - bound, 0.0)
        share = f" ({100.0 * gap / best:.2g}\u00a0% of the best)" if gap > 1e-12 * best else ""
        facts.append(("gap", f"{number(gap, 3) if share else '0'}{unit}{share}"))
    return facts


def _choice(selection: Selection) -> list[tuple[str, str]]:
    counts = [max(len(task.pairs), 1) for task in selection.study.joints]
    low, high = min(counts), max(counts)
    each = f"{low}" if low == high else f"{low} to {high}"
    digits = sum(math.log10(count) for count in counts)
    power = str(int(digits)).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
    sets = f"{math.prod(counts)}" if digits < 6.0 else f"{10.0 ** (digits % 1.0):.1f} × 10{power}"
    return [("candidates", f"{each} pairs of motor and gear a joint, {sets} sets of drives")]


def _rules(selection: Selection) -> list[tuple[str, str]]:
    """The constraints of the selection besides the checks, and their values in the chosen set."""
    wanted, pairs = selection.study.wanted, list(selection.drives.values())
    used = {"motor": len({motor for motor, _ in pairs}), "gear": len({gear for _, gear in pairs if gear})}
    facts = []
    for part, most in (("motor", wanted.most_motor_types), ("gear", wanted.most_gear_types)):
        use = f"{used[part]} in the chosen set" if pairs else ""
        limit = "" if most is None else f"at most {most} wanted"
        text = "; ".join(one for one in (limit, use) if one)
        if text:
            facts.append((f"{part} types", text))
    for group in wanted.same_family:
        facts.append(("same family", ", ".join(group)))
    if given := selection.study.given_drives:
        facts.append(("drive given by the study", ", ".join(given)))
    if not (wanted.most_motor_types or wanted.most_gear_types or wanted.same_family):
        facts.append(("constraints besides the checks", "none"))
    return facts


def work_done(counters: Mapping[str, int]) -> list[tuple[str, str]]:
    """What a search did, in words, and how often; without what it did not do."""
    return [(words, f"{counters[name]:,}".replace(",", "\u202f")) for name, words in WORK.items() if counters.get(name)]


def search_table(selection: Selection) -> SheetTable | None:
    """Counters of the search; None if there was nothing to search."""
    rows = tuple(work_done(selection.counters))
    return SheetTable(("work", "count"), rows, numeric=(1,)) if rows else None
