"""Effects of tolerances on a set of drives: probabilities, tornadoes, and the robust choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.sizing.search.robust import RobustSelection
from drivetrain.sizing.tolerance.monte_carlo import Robustness, robustness
from drivetrain.sizing.tolerance.tornado import Tornado, effects


@dataclass(frozen=True, eq=False)
class Spread:
    """Effects of tolerances on a set of drives."""

    robustness: Robustness  # probabilities that checks, joints and the whole set are satisfied
    # tornadoes of the binding checks of every joint and of the supply, largest utilisation first
    tornadoes: tuple[Tornado, ...]
    choice: RobustSelection | None = None  # how the set was chosen, if a probability is required


def spread(result: Evaluation | Selection) -> Spread | None:
    """Effects of tolerances on evaluated or selected drives; None if the study states no tolerance."""
    if not result.study.tolerances.given:
        return None
    evaluation = result.evaluation if isinstance(result, Selection) else result
    choice = result.choice if isinstance(result, Selection) else None
    return Spread(robustness(evaluation), effects(evaluation).worst(), cast("RobustSelection | None", choice))
