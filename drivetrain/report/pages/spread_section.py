"""Effect of the tolerances on the drives, for the report, the terminal and ``result.json``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.report.charts.arm_charts import MOST_BARS, UNITS, tornado_chart
from drivetrain.report.charts.chart import Chart
from drivetrain.report.json_text import picked
from drivetrain.report.pages.sheet import Section, SheetTable
from drivetrain.report.quantities import percent
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.tolerance.monte_carlo import Chance, Robustness
from drivetrain.sizing.tolerance.sampling import failed_undrawn, undrawn
from drivetrain.study.model import Study

SURE = 0.9999  # probability above which checks are not listed individually
MOST_FIGURES = 4
TORNADO = (
    "Each value varied alone to both ends of its tolerance (two standard deviations of a normal one), all others "
    "nominal; bars end at ten times the limit. Point at an end for the share of the variance of this utilisation that "
    "the value causes if all values vary together."
)


@dataclass(frozen=True)
class ChanceRow:
    """One probability as texts; an empty check: all of them. ``share``: for sorting."""

    place: str
    check: str
    probability: str
    error: str
    interval: str
    usual: str
    share: float


def spread_section(found: Spread) -> Section:
    """Section of the report on the effect of the tolerances."""
    odds = found.robustness
    figures: list[tuple[Chart, str]] = []
    for one in [one for one in found.tornadoes if one.bars][:MOST_FIGURES]:
        left = len(one.bars) - MOST_BARS
        texts = ([] if figures else [TORNADO]) + ([f"{left} narrower bars are left out."] if left > 0 else [])
        figures.append((tornado_chart(one), " ".join(texts)))
    rows = tuple(
        (one.place, one.check, one.probability, one.error, one.interval, one.usual) for one in chance_rows(odds)
    )
    choice = "" if found.choice is None else f" The set {found.choice.proof}."
    how = (
        f"{_grouped(odds.samples)} sampled arms, seed {odds.seed}, each evaluated by all checks. The values of the "
        "motor and gear of each joint, the ambient temperature, each payload and the forces at the tip together are "
        "drawn independently for each arm. "
        f"Limits of data sheets stay as printed. {'; '.join(law_lines(odds.evaluation.study))}."
    )
    if "arm" in odds.checks:
        how += " The arm's stiffness is checked with the payloads of each arm, and else with nominal values."
    headings = ("where", "check", "satisfied in", "standard error", "95 % interval",
                "utilisation: 5th / 50th / 95th percentile")  # fmt: skip
    return Section("What tolerances do", "spread", lead=(f"{chance_sentence(odds)}{choice}",), figures=tuple(figures),
                   tables=(SheetTable(headings, rows, "", (2, 3, 4, 5)),), notes=(how,))  # fmt: skip


def chance_sentence(odds: Robustness) -> str:
    """The probability of the whole set in words."""
    lacking = ", ".join(dict.fromkeys(check.name for check in odds.evaluation.lacking))
    if lacking:
        return f"All checks are proven satisfied in no arm: data are missing to check {lacking}."
    if failed := failed_undrawn(odds.evaluation):
        return f"All checks are satisfied in no arm: {', '.join(failed)} fails with nominal values already."
    row, nominal = _row("", "", odds.whole), ", ".join(check.name for check in undrawn(odds.evaluation))
    return (
        f"All checks are satisfied in {row.probability} of {_grouped(odds.samples)} sampled arms "
        f"(standard error {row.error}, 95\u00a0% interval {row.interval})."
    ) + (f" Checked with nominal values alone: {nominal}." if nominal else "")


def _grouped(count: int) -> str:
    """A whole number with a thin space between thousands."""
    return f"{count:,}".replace(",", "\u202f")


def law_lines(study: Study) -> list[str]:
    lines = []
    for name in study.tolerances.given:
        one = getattr(study.tolerances, name)
        unit = UNITS.get(name, "")
        width = f"{one.width:g}\u00a0{unit}" if one.absolute else f"{100.0 * one.width:g}\u00a0%"
        law = f"normal, standard deviation {width}" if one.normal else f"uniform within ±{width}"
        lines.append(f"{name.replace('_', ' ')}: {law}")
    return lines


def chance_rows(odds: Robustness) -> list[ChanceRow]:
    """Rows of the whole set, of every joint, and of every check below ``SURE``; least probable first."""
    rows = [_row("all together", "", odds.whole)]
    rows += sorted((_row(name, "all checks", one) for name, one in odds.joints.items()), key=lambda row: row.share)
    single = [
        _row(place, name, chance, odds.utilisations[place].get(name, ()))
        for place, checks in odds.checks.items() for name, chance in checks.items() if chance.probability < SURE
    ]  # fmt: skip
    return rows + sorted(single, key=lambda row: row.share)


def spread_lines(found: Spread) -> list[str]:
    lines = [chance_sentence(found.robustness)]
    weak = [row for row in chance_rows(found.robustness) if row.check not in ("", "all checks")][:3]
    lines += [f"{row.place}: {row.check} is satisfied in {row.probability}" for row in weak]
    first = next((one for one in found.tornadoes if one.bars), None)
    if first is not None:
        widest = ", ".join(f"{bar.source} ({percent(bar.at_low)} to {percent(bar.at_high)})" for bar in first.bars[:3])
        lines.append(f"{first.joint}: {first.check} changes most with {widest}")
    return lines


def spread_data(found: Spread) -> dict[str, Any]:
    """Data of the section for ``result.json``."""
    odds, choice = found.robustness, found.choice
    data: dict[str, Any] = {
        **picked(odds, "samples", "seed", "scattering"),
        "whole": _chance(odds.whole),
        "joints": {name: _chance(one) for name, one in odds.joints.items()},
        "checks": {
            place: {name: _chance(one) for name, one in checks.items()} for place, checks in odds.checks.items()
        },
        "tornadoes": [
            {
                "place": one.joint, "check": one.check, "nominal": one.nominal,
                "bars": [
                    {"source": str(bar.source), **picked(bar, "low", "high", "absolute", "at_low", "at_high"),
                     "variance_share": bar.share}
                    for bar in one.bars
                ],
            }
            for one in found.tornadoes
        ],
    }  # fmt: skip
    if choice is not None:
        data["choice"] = {
            **picked(choice, "wanted", "confidence", "proof", "proven"),
            "tried": [
                {"objective": trial.drives.objective, **picked(trial, "decision", "joint"), **_chance(trial.chance)}
                for trial in choice.trials
            ],
        }  # fmt: skip
    return data


def _row(place: str, check: str, chance: Chance, usual: tuple[float, ...] = ()) -> ChanceRow:
    low, high = chance.interval
    decimals = min(max(math.ceil(-math.log10(max(100.0 * chance.standard_error, 1e-9))), 0) + 1, 4)

    def text(share: float) -> str:
        """A share with as many digits as its error justifies."""
        return f"{100.0 * share:.{decimals}f}\u00a0%"

    return ChanceRow(
        place, check, text(chance.probability), text(chance.standard_error), f"{text(low)} to {text(high)}",
        " / ".join(percent(value) for value in usual), chance.probability,
    )  # fmt: skip


def _chance(chance: Chance) -> dict[str, Any]:
    low, high = chance.interval
    return picked(chance, "probability", "standard_error") | {"low": low, "high": high, "samples": chance.samples}
