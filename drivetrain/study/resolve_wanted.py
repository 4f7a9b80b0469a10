"""What a study wants of a selection: weights of the objective, constraints over the joints, how far to search."""

from __future__ import annotations

from collections.abc import Sequence

from drivetrain.errors import nearest
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import StudyForm
from drivetrain.study.schema_selection import TERMS
from drivetrain.study.study import Wanted


def resolve_wanted(form: StudyForm, names: Sequence[str], ledger: Ledger) -> Wanted:
    """The objective and the constraints.

    Args:
        form: The study.
        names: Of the joints; empty where they are not known because of other faults.
        ledger: Takes names in groups that are no joints as faults.

    Returns:
        What is wanted, terms that count nothing left out.
    """
    told, chosen = form.objective, form.selection
    weights = {told: 1.0} if isinstance(told, str) else {name: getattr(told, name) for name in TERMS}
    for index, group in enumerate(chosen.same_family if names else ()):
        for name in group:
            if name not in names:
                place = ("selection", "same_family", index)
                ledger.fault(place, "is no joint", name, nearest(name, names))
    return Wanted(
        weights=tuple((name, weight) for name, weight in weights.items() if weight > 0.0),
        **chosen.model_dump(),
    )
