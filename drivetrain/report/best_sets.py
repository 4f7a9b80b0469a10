"""The best sets of drives of a selection, side by side: what each is worth and where it differs from the first."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.report.quantities import number, percent
from drivetrain.report.words import objective_tail
from drivetrain.sizing.results import DriveSet, Selection

HEADINGS = {"mass": "mass [kg]", "price": "price", "energy": "energy a cycle [J]", "weighted": "weighted objective"}

WORDS = {
    "mass": "less mass", "price": "a lower price", "energy": "less energy a cycle", "weighted": "a smaller objective",
}  # fmt: skip


SHARED = {"mass": "mass", "price": "price", "energy": "energy a cycle", "weighted": "weighted objective"}


def equals_sentence(selection: Selection) -> str:
    """How many feasible sets share the objective of the chosen one, and what puts it before them."""
    what, count = SHARED[selection.study.objective], selection.equals
    if not selection.drives or not count:
        return ""
    if count == 1 and selection.all_equals:
        return f"No other feasible set has the same {what}."
    return (
        f"{count if selection.all_equals else f'At least {count}'} feasible sets share this {what}: they come in the "
        "order of their energy a cycle, then of their largest utilisation."
    )


@dataclass(frozen=True)
class SetRow:
    """One set as texts, 1 the best; ``changes``: joints at which it differs from the first, with motor and gear."""

    rank: int
    objective: str
    mass: str
    price: str
    energy: str
    utilisation: str
    changes: tuple[str, ...]


def set_rows(selection: Selection) -> list[SetRow]:
    """The best sets, best first."""
    sets = selection.best_sets
    return [_row(rank, one, sets[0]) for rank, one in enumerate(sets, start=1)] if len(sets) > 1 else []


def set_lines(selection: Selection) -> list[str]:
    """The sets after the best one, for the terminal."""
    unit = objective_tail(selection.study, " ")
    return [f"set {row.rank}: {row.objective}{unit}; {'; '.join(row.changes)}" for row in set_rows(selection)[1:]]


def _row(rank: int, one: DriveSet, best: DriveSet) -> SetRow:
    """One set against the first."""
    changed = [joint for joint, pair in one.drives.items() if best.drives.get(joint) != pair]
    parts = tuple(f"{joint}: {_pair(one.drives[joint])}" for joint in changed)
    known = one.criteria
    mass, price, energy = (number(known.get(name), 4) for name in ("mass", "price", "energy"))
    used = percent(known.get("utilisation"))
    return SetRow(rank, number(one.objective, 4), mass, price, energy, used, parts)


def _pair(keys: tuple[str, str]) -> str:
    return f"{keys[0]} + {keys[1]}" if keys[1] else f"{keys[0]}, direct"
