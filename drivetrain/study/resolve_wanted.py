"""What a study wants of a selection: weights of the objective, constraints over the joints, how far to search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drivetrain.errors import nearest
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import StudyForm
from drivetrain.study.schema_selection import TERMS
from drivetrain.study.study import Payload, Wanted
from drivetrain.study.trade_offs import TradeOffs


def resolve_wanted(form: StudyForm, names: Sequence[str], ledger: Ledger) -> Wanted:
    """The objective and the constraints."""
    told, chosen = form.objective, form.selection
    weights = {told: 1.0} if isinstance(told, str) else {name: getattr(told, name) for name in TERMS}
    for index, group in enumerate(chosen.same_family if names else ()):
        for name in group:
            if name not in names:
                place = ("selection", "same_family", index)
                ledger.fault(place, "is no joint", name, nearest(name, names))
    return Wanted(
        weights=tuple((name, weight) for name, weight in weights.items() if weight > 0.0),
        **chosen.model_dump(exclude={"front", "curves"}),
    )


def resolve_trade_offs(
    form: StudyForm, cycle: Cycle | None, payloads: Mapping[str, Payload], ledger: Ledger
) -> TradeOffs:
    """What the report shall tell beside the best set.

    Args:
        cycle: None where other faults keep it from being built.
    """
    curves = form.selection.curves
    carried = () if cycle is None else cycle.payload_names
    # A payload that is missing here is one whose own faults are told.
    weighs = [name not in payloads or payloads[name].mass > 0.0 for name in carried]
    heavy = cycle is None or (form.arm is not None and any(weighs))
    for index, curve in enumerate(curves):
        place = ("selection", "curves", index)
        if curve.vary == "payload" and not heavy:
            ledger.fault(place, "the study carries no payload of any mass that could be varied", curve.vary)
        if curve.vary in [other.vary for other in curves[:index]]:
            ledger.fault(place, "is asked for twice", curve.vary)
    return TradeOffs(tuple(dict.fromkeys(form.selection.front)), curves)
