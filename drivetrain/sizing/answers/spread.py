"""Effects of tolerances on a set of drives: probabilities, tornadoes, and the robust choice."""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.sizing.search.robust import RobustSelection, robust_select
from drivetrain.sizing.search.search import UNTESTED
from drivetrain.sizing.tolerance.monte_carlo import Robustness, robustness
from drivetrain.sizing.tolerance.tornado import Tornado, effects


@dataclass(frozen=True, eq=False)
class Spread:
    """Effects of tolerances on a set of drives."""

    robustness: Robustness  # probabilities that checks, joints and the whole set are satisfied
    # tornadoes of the binding checks of every joint and of the supply, largest utilisation first
    tornadoes: tuple[Tornado, ...]
    choice: RobustSelection | None = None  # how the set was chosen, if a probability is required


def spread(evaluation: Evaluation, choice: RobustSelection | None = None) -> Spread | None:
    """Effects of tolerances on evaluated drives; None if the study states no tolerance."""
    if not evaluation.study.tolerances.given:
        return None
    return Spread(robustness(evaluation), effects(evaluation).worst(), choice)


def robustly(selection: Selection) -> tuple[Selection, RobustSelection | None]:
    """A selection of the best set with the required probability, and its proof; unchanged if none is required."""
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
    proof = f"{selection.proof.removesuffix(UNTESTED)} with nominal values; {found.proof}"
    changed = replace(
        selection, drives=dict(best.drives), evaluation=evaluation, objective=best.objective, proof=proof,
        best_sets=sets, equals=0, all_equals=False,
    )  # fmt: skip
    return changed, found
