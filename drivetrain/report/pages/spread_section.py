"""What scatter means for the drives, as the report, the terminal and ``result.json`` tell it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.report.charts.arm_charts import MOST_BARS, UNITS, tornado_chart
from drivetrain.report.charts.chart import Pictures
from drivetrain.report.quantities import percent
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.tolerance.monte_carlo import Chance, Robustness
from drivetrain.study.model import Study

SURE = 0.9999  # of a probability: checks that hold more often are not listed one by one
MOST_FIGURES = 4


@dataclass(frozen=True)
class ChanceRow:
    """One probability as it stands in the table.

    Attributes:
        place, check: Joint or supply, and the check; an empty check: all of them.
        probability, error, interval: Texts.
        usual: Utilisations that 5, 50 and 95 of 100 arms stay below, as text.
        share: The probability, for sorting.
    """

    place: str
    check: str
    probability: str
    error: str
    interval: str
    usual: str
    share: float


def spread_frame(found: Spread | None, pictures: Pictures) -> dict[str, Any]:
    """What the page's template asks of the scatter.

    Args:
        found: Of ``spread``; None where nothing scatters.
        pictures: Of the page.
    """
    if found is None:
        return {"spread": None}
    told = found.robustness
    figures = [
        (tornado, pictures.add(tornado_chart(tornado)), max(len(tornado.bars) - MOST_BARS, 0))
        for tornado in [one for one in found.tornadoes if one.bars][:MOST_FIGURES]
    ]
    return {
        "spread": {
            "sentence": chance_sentence(told),
            "choice": "" if found.choice is None else found.choice.proof,
            "laws": law_lines(told.evaluation.study),
            "rows": chance_rows(told),
            "figures": figures,
            "samples": _grouped(told.samples),
            "seed": told.seed,
        }
    }


def chance_sentence(told: Robustness) -> str:
    """The probability of the whole set in words."""
    lacking = ", ".join(dict.fromkeys(check.name for check in told.evaluation.lacking))
    if lacking:
        return f"That all checks hold is proven in no arm: data are missing to check {lacking}."
    row = _row("", "", told.whole)
    return (
        f"All checks hold in {row.probability} of {_grouped(told.samples)} arms drawn "
        f"(standard error {row.error}, 95\u00a0% interval {row.interval})."
    )


def _grouped(count: int) -> str:
    """A whole number with a thin space between thousands."""
    return f"{count:,}".replace(",", "\u202f")


def law_lines(study: Study) -> list[str]:
    """What scatters, by which law."""
    lines = []
    for name in study.tolerances.given:
        one = getattr(study.tolerances, name)
        unit = UNITS.get(name, "")
        width = f"{one.width:g}\u00a0{unit}" if one.absolute else f"{100.0 * one.width:g}\u00a0%"
        law = f"normal, standard deviation {width}" if one.normal else f"uniform within ±{width}"
        lines.append(f"{name.replace('_', ' ')}: {law}")
    return lines


def chance_rows(told: Robustness) -> list[ChanceRow]:
    """The whole set, every joint, and every check that does not hold for certain; least probable first."""
    rows = [_row("all together", "", told.whole)]
    rows += sorted((_row(name, "all checks", one) for name, one in told.joints.items()), key=lambda row: row.share)
    single = [
        _row(place, name, chance, told.utilisations[place].get(name, ()))
        for place, checks in told.checks.items() for name, chance in checks.items() if chance.probability < SURE
    ]  # fmt: skip
    return rows + sorted(single, key=lambda row: row.share)


def spread_lines(found: Spread) -> list[str]:
    """What the terminal tells."""
    lines = [chance_sentence(found.robustness)]
    weak = [row for row in chance_rows(found.robustness) if row.check not in ("", "all checks")][:3]
    lines += [f"{row.place}: {row.check} holds in {row.probability}" for row in weak]
    first = next((one for one in found.tornadoes if one.bars), None)
    if first is not None:
        widest = ", ".join(f"{bar.source} ({percent(bar.at_low)} to {percent(bar.at_high)})" for bar in first.bars[:3])
        lines.append(f"{first.joint}: {first.check} moves most with {widest}")
    return lines


def spread_data(found: Spread) -> dict[str, Any]:
    """What ``result.json`` holds of it."""
    told, choice = found.robustness, found.choice
    data: dict[str, Any] = {
        "samples": told.samples,
        "seed": told.seed,
        "scattering": list(told.scattering),
        "whole": _chance(told.whole),
        "joints": {name: _chance(one) for name, one in told.joints.items()},
        "checks": {
            place: {name: _chance(one) for name, one in checks.items()} for place, checks in told.checks.items()
        },
        "tornadoes": [
            {
                "place": one.joint, "check": one.check, "nominal": one.nominal,
                "bars": [
                    {
                        "source": str(bar.source), "low": bar.low, "high": bar.high, "absolute": bar.absolute,
                        "at_low": bar.at_low, "at_high": bar.at_high, "variance_share": bar.share,
                    }
                    for bar in one.bars
                ],
            }
            for one in found.tornadoes
        ],
    }  # fmt: skip
    if choice is not None:
        data["choice"] = {
            "wanted": choice.wanted, "confidence": choice.confidence, "proof": choice.proof, "proven": choice.proven,
            "tried": [
                {"objective": trial.drives.objective, "decision": str(trial.decision), "joint": trial.joint}
                | _chance(trial.chance)
                for trial in choice.trials
            ],
        }  # fmt: skip
    return data


def _row(place: str, check: str, chance: Chance, usual: tuple[float, ...] = ()) -> ChanceRow:
    low, high = chance.interval
    decimals = min(max(math.ceil(-math.log10(max(100.0 * chance.standard_error, 1e-9))), 0) + 1, 4)

    def text(share: float) -> str:
        """As many digits as the error leaves."""
        return f"{100.0 * share:.{decimals}f}\u00a0%"

    return ChanceRow(
        place, check, text(chance.probability), text(chance.standard_error), f"{text(low)} to {text(high)}",
        " / ".join(percent(value) for value in usual), chance.probability,
    )  # fmt: skip


def _chance(chance: Chance) -> dict[str, Any]:
    low, high = chance.interval
    return {
        "probability": chance.probability, "standard_error": chance.standard_error, "low": low, "high": high,
        "samples": chance.samples,
    }  # fmt: skip
