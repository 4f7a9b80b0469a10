"""What scatter means for a set of drives: probabilities, tornadoes, and the choice that stands it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.sizing.search.robust import RobustSelection, robust_select
from drivetrain.sizing.tolerance.monte_carlo import Robustness, robustness
from drivetrain.sizing.tolerance.tornado import Tornado, effects


@dataclass(frozen=True, eq=False)
class Spread:
    """How a set of drives stands the scatter of its numbers."""

    robustness: Robustness  # probabilities that checks, joints and the whole set hold
    tornadoes: tuple[Tornado, ...]  # of the binding check of every joint and of the supply, most loaded first
    choice: RobustSelection | None = None  # how the set was chosen, where a probability was wanted; else None


def spread(evaluation: Evaluation, choice: RobustSelection | None = None) -> Spread | None:
    """What scatter means for evaluated drives; None where the study states no tolerance."""
    if not evaluation.study.tolerances.given:
        return None
    return Spread(robustness(evaluation), effects(evaluation).worst(), choice)


def robustly(selection: Selection) -> tuple[Selection, RobustSelection | None]:
    """A selection with the best set that holds often enough, and how it was found; as it was where none is asked."""
    study = selection.study
    if study.wanted.holds is None or not study.tolerances.given or not selection.feasible:
        return selection, None
    found = robust_select(study)
    if found.chosen is None:
        return replace(selection, drives={}, objective=float("nan"), advice=(f"{found.proof}.",)), found
    best = found.chosen.drives
    evaluation = evaluate(study, best.drives)
    sets = tuple(one for one in selection.best_sets if one.objective >= best.objective) or (best,)
    if sets[0].drives != best.drives:
        sets = (best, *(one for one in sets if one.drives != best.drives))
    proof = f"{selection.proof} with nominal numbers; {found.proof}"
    changed = replace(
        selection, drives=dict(best.drives), evaluation=evaluation, objective=best.objective, proof=proof,
        best_sets=sets, equals=0, all_equals=False,
    )  # fmt: skip
    return changed, found
